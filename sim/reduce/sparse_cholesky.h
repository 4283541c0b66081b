// Factorisation of a large sparse symmetric positive definite matrix and solution for blocks of right-hand sides.
// One library behind one small class: MUMPS 5.5 (multifrontal, METIS ordering; CeCILL-C), chosen by measurement (REDUCE.md).
#pragma once

#include "sim/base/types.h"

#include <Eigen/Sparse>

#include <functional>
#include <memory>
#include <string>

namespace flexframe::sim {

class SparseCholesky {
 public:
  // Lower triangle only. Orders and estimates. The matrix is given away, and let go once it is factorised. threads: of the dense kernels.
  // ask: called in the calling thread, some fifty times a second while it factorises and before every 32 right-hand sides; may throw
  // whatever shall end the call. scratch: folder for the factor's files while this lives; empty: it is kept in memory.
  explicit SparseCholesky(Eigen::SparseMatrix<double>&& lower, int threads = 1, std::function<void()> ask = {},
                          const std::string& scratch = {});
  ~SparseCholesky();
  SparseCholesky(const SparseCholesky&) = delete;
  SparseCholesky& operator=(const SparseCholesky&) = delete;

  // Bytes the factorisation will need at its peak, known before the work; entries of the factor.
  double estimated_bytes() const;
  double factor_entries() const;

  // Once. Throws SimulationError if the matrix is not positive definite or memory is short, and what `ask` throws, at once: MUMPS cannot
  // be stopped, and goes on in a thread beside that owns all it touches, until it is done or the process ends.
  void factorise();

  // Solves A x = b in place, b: n x k column-major.
  void solve(MatX& b) const;

 private:
  struct State;
  std::shared_ptr<State> state;
  std::function<void()> ask;
};

}  // namespace flexframe::sim
