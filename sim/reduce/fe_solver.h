// Everything that is solved on the finite element model, from one factorisation of K + s M, s > 0 small (or 0 where no rigid motion is free):
// free vibration modes, modes with points held, static and harmonic response. Rigid motions are known beforehand and kept out of every iteration.
//
// Modes: block Lanczos in the M inner product with full orthogonalisation on the operator (K + s M)^-1 M
// (R. G. Grimes, J. G. Lewis, H. D. Simon, A shifted block Lanczos algorithm, SIAM J. Matrix Anal. 15 (1994)). Blocks, because a solution for eight right-hand
// sides costs twice one, not eight times (REDUCE.md), and because equal frequencies of symmetric parts need no luck.
// Responses: conjugate gradients on the complement of the rigid motions, preconditioned by the same factor; a handful of iterations.
#pragma once

#include "sim/reduce/fe_system.h"
#include "sim/reduce/sparse_cholesky.h"

#include <functional>
#include <memory>

namespace flexframe::sim {

struct FeModes {
  VecX eigenvalues;   // omega^2, ascending, (rad/s)^2
  MatX vectors;       // free x count, M-orthonormal
  int iterations = 0; // blocks solved
};

using FeProgress = std::function<void(const std::string&)>;

class FeSolver {
 public:
  // `estimate`: a rough square of the lowest elastic frequency, for the shift (estimate_stiffness). R: rigid motions the reduced system is free to do, any basis.
  FeSolver(const FeReduced& system, const MatX& R, double estimate);

  double estimated_bytes() const { return cholesky->estimated_bytes(); }
  double factor_entries() const { return cholesky->factor_entries(); }
  void factorise() { cholesky->factorise(); }

  int rigid() const { return static_cast<int>(R.cols()); }
  const MatX& rigid_basis() const { return R; }   // M-orthonormal

  // The lowest elastic modes: `count` of them, or all up to `eigenvalue_limit` and at least one beyond (count = 0). hold: loads whose work-conjugate motions are
  // held at zero (free x m), empty for none; with held points rigid motions are not taken out. Throws SimulationError when the iteration does not end, and
  // InputError when motions without stiffness are left beyond the rigid ones.
  FeModes modes(int count, double eigenvalue_limit, const MatX& hold, const FeProgress& progress) const;

  // u with (K - eigenvalue M) u = p, elastic part only (M-orthogonal to the rigid motions); eigenvalue below the lowest elastic one.
  // p: free x k. Relative residual 1e-11.
  MatX respond(const MatX& p, double eigenvalue = 0.0) const;

  const FeReduced& system;

 private:
  MatX R, MR;
  double shift = 0.0;
  double estimate = 0.0;
  std::unique_ptr<SparseCholesky> cholesky;
};

// Square of a frequency (rad/s)^2 of the order of the lowest elastic one or above it: the smallest Rayleigh-Ritz value of displacement fields that are quadratic
// polynomials of position, rigid motions aside.
double estimate_stiffness(const FeModel& model, const FeSystem& system);

}  // namespace flexframe::sim
