// What reductions take from MUMPS, METIS and OpenBLAS, which are opened with the first of them.
#pragma once

#include "sim/base/late_library.h"

#include <cblas.h>
#include <dmumps_c.h>
#include <metis.h>

namespace flexframe::sim {

struct OpenBlas : LateLibrary {
  OpenBlas();
  decltype(&cblas_dgemm) dgemm = function("cblas_dgemm");
  decltype(&openblas_set_num_threads) set_threads = function("openblas_set_num_threads");
};

struct Mumps : LateLibrary {
  Mumps();
  decltype(&dmumps_c) call = function("dmumps_c");
};

struct Metis : LateLibrary {
  Metis();
  decltype(&METIS_SetDefaultOptions) defaults = function("METIS_SetDefaultOptions");
  decltype(&METIS_NodeND) nested_dissection = function("METIS_NodeND");
};

// Each opened once a process. Throw FileError.
const OpenBlas& openblas();
const Mumps& mumps();
const Metis& metis();

}  // namespace flexframe::sim
