// Everything that is solved on the finite element model, from one factorisation of K + s M, s > 0 small (or 0 where no rigid motion is
// free): free vibration modes, modes with points held, static and harmonic response. Rigid motions are known beforehand and kept out of
// every iteration.
//
// Modes: block Lanczos in the M inner product with full orthogonalisation on the operator (K + s M)^-1 M
// (R. G. Grimes, J. G. Lewis, H. D. Simon, A shifted block Lanczos algorithm, SIAM J. Matrix Anal. 15 (1994)). Blocks, because a solution
// for eight right-hand sides costs twice one, not eight times (REDUCE.md), and because equal frequencies of symmetric parts need no luck.
// Started from smooth fields, which save a block or two.
// Responses: conjugate gradients on the complement of the rigid motions, preconditioned by the same factor and started from modes already
// known; two to four iterations.
#pragma once

#include "sim/reduce/fe_system.h"
#include "sim/reduce/sparse_cholesky.h"

#include <functional>
#include <memory>

namespace flexframe::sim {

struct FeModes {
  VecX eigenvalues;    // omega^2, ascending, (rad/s)^2
  MatX vectors;        // free x count, M-orthonormal
  int iterations = 0;  // blocks solved
};

// Ritz values and vectors of displacement fields that are quadratic polynomials of position, rigid motions aside.
struct FeEstimate {
  double eigenvalue = 0.0;  // the lowest: a squared frequency (rad/s)^2 of the order of the lowest elastic one or above it
  MatX fields;              // size of the system x at most 8, the lowest
};
FeEstimate estimate_modes(const FeModel& model, const FeSystem& system);

using FeProgress = std::function<void(const std::string&)>;

class FeSolver {
 public:
  // `estimate`: for the shift and the first block. R: rigid motions the reduced system is free to do, any basis. threads, ask:
  // and scratch: SparseCholesky's.
  FeSolver(const FeReduced& system, const MatX& R, const FeEstimate& estimate, int threads = 1, std::function<void()> ask = {},
           const std::string& scratch = {});

  double estimated_bytes() const { return cholesky->estimated_bytes(); }
  double factor_entries() const { return cholesky->factor_entries(); }
  // Throws InputError where a held model has a motion without stiffness left.
  void factorise();

  int rigid() const { return static_cast<int>(R.cols()); }
  const MatX& rigid_basis() const { return R; }  // M-orthonormal

  // The lowest elastic modes: `count` of them, or all up to `eigenvalue_limit` and at least one beyond (count = 0). hold: loads whose
  // work-conjugate motions are held at zero (free x m), empty for none; with held points rigid motions are not taken out. Throws
  // SimulationError when the iteration does not end, and InputError when motions without stiffness are left beyond the rigid ones.
  FeModes modes(int count, double eigenvalue_limit, const MatX& hold, const FeProgress& progress) const;

  // u with (K - eigenvalue M) u = p, elastic part only (M-orthogonal to the rigid motions); eigenvalue below the lowest elastic one.
  // p: free x k. tolerance: of the residual against p. known: modes (or M-orthonormal fields that diagonalise K) to start from.
  MatX respond(const MatX& p, double eigenvalue = 0.0, const FeModes* known = nullptr, double tolerance = 1e-11) const;

  // About the elastic part of K^-1 p (that of (K + s M)^-1 p), p: free x k: a preconditioner.
  MatX approximate(MatX p) const;

  const FeReduced& system;

 private:
  // The first block of the iteration: smooth fields, and what no smooth field knows of from a random one (fixed seed, so that runs repeat).
  // apply: b -> the shifted inverse times b; project: takes out rigid or held motions. free x width.
  MatX start_block(int width, const std::function<void(MatX&)>& apply, const std::function<void(MatX&)>& project) const;
  // Throws InputError where motions without stiffness are left that are no rigid ones: a mechanism.
  void refuse_mechanism(const FeModes& found) const;

  MatX R, MR, start;
  double shift = 0.0;
  double estimate = 0.0;
  std::unique_ptr<SparseCholesky> cholesky;
};

}  // namespace flexframe::sim
