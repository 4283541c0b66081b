#include "sim/reduce/sparse_libraries.h"

namespace flexframe::sim {

OpenBlas::OpenBlas() : LateLibrary(FLEXFRAME_OPENBLAS_FILE, "products of matrices (OpenBLAS)") {}
Mumps::Mumps() : LateLibrary(FLEXFRAME_MUMPS_FILE, "sparse factorisations (MUMPS)") {}
Metis::Metis() : LateLibrary(FLEXFRAME_METIS_FILE, "the order of sparse factorisations (METIS)") {}

const OpenBlas& openblas() {
  static const OpenBlas library;
  return library;
}

const Mumps& mumps() {
  static const Mumps library;
  return library;
}

const Metis& metis() {
  static const Metis library;
  return library;
}

}  // namespace flexframe::sim
