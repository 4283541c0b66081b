// Error-controlled integration of y' = f(t, y) by SUNDIALS: CVODE Adams and BDF, ARKODE explicit and diagonally implicit
// Runge-Kutta (Verner 6(5); ESDIRK3(2)5L[2]SA, Kennedy and Carpenter 2019), IDA on y' - f = 0.
//
// SUNDIALS is included by the implementation only.
#pragma once

#include "sim/base/types.h"
#include "sim/scene/scene.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace flexframe::sim {

// A matrix of which little is not zero; entries at one place add up.
struct SparseEntries {
  struct Entry {
    int row, column;
    double value;
  };
  Eigen::Index rows = 0, cols = 0;
  std::vector<Entry> entries;
  // y += factor M x.
  void add_product(double factor, const double* x, double* y) const {
    for (const Entry& e : entries) y[e.row] += factor * (e.value * x[e.column]);
  }
  MatX dense() const {
    MatX M = MatX::Zero(rows, cols);
    for (const Entry& e : entries) M(e.row, e.column) += e.value;
    return M;
  }
};

// Derivatives of mechanical equations y = [q; w; further], q' = T w, w' = f(q, w) for implicit methods: A, of w' by a change of q
// along each of the directions of w (n x n), B, of w' by w (n x n), T (q x n), and P (n x q) with P T = 1 on what is independent.
struct MechanicalJacobian {
  // Rates `first` and the following: M w' = -K p - D w besides what else acts on them, p the change of q. All symmetric and whole. Of a
  // stiffness that is nothing but its diagonal that alone, the matrix empty; damping empty where there is none.
  struct Piece {
    Eigen::Index first = 0;
    MatX mass, stiffness, damping;
    VecX diagonal;
  };
  MatX A, B;
  SparseEntries T, P;
  // Where there are any they cover all rates, and of A and B only the columns `beside` are there.
  std::vector<Piece> pieces;
  std::vector<int> beside;
};

struct OdeProblem {
  int size = 0;
  double tolerance = 1e-6;  // relative; the weights carry it
  // Writes dy; may throw SimulationError, which makes the integrator try a smaller step.
  std::function<void(double t, const double* y, double* dy)> rhs;
  // Optional. Runge-Kutta stages start from the state of the step's beginning, at other times: rates of a state that was evaluated
  // lately are kept. keep: writes, after an evaluation, what shift needs; shift: brings the rates dy of an unchanged state from t0 to t,
  // or returns false where that takes an evaluation. Without shift nothing but the same time counts as the same.
  std::function<void(VecX& kept)> keep;
  std::function<bool(double t0, double t, const VecX& kept, double* dy)> shift;
  // Optional, for DIRK and BDF: derivatives at (t, y). fresh: anew; else cheap parts only.
  // Without it every state is differenced.
  std::function<void(double t, const double* y, bool fresh, MechanicalJacobian& out)> jacobian;
  // For the exponential method: T, P and the parts of A and B that cost no evaluation; and all of A and B, differenced.
  std::function<void(double t, const double* y, MechanicalJacobian& out)> closed_derivatives;
  std::function<void(double t, const double* y, MatX& A, MatX& B)> all_derivatives;
  bool sharp_jacobian = false;  // may change by orders within a few steps: made anew at every step
  bool closes_loops = false;    // conditions on the coordinates turn small errors of stiff ones into forces on slow ones
  bool cheap_jacobian = false;  // the cheap parts are all of it, and cost less than the iterations of a step
  // Writes the error weights 1 / (tolerance of each component) for the current y.
  std::function<void(const double* y, double* weight)> weights;
};

struct IntegratorStatistics {
  long steps = 0, evaluations = 0, jacobians = 0, failures = 0;
  double last_step = 0.0;
  int last_order = 0;
};

class Integrator {
 public:
  // method must not be automatic. The problem outlives the integrator.
  Integrator(const OdeProblem& problem, Method method, double t0, const VecX& y0);
  ~Integrator();
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;

  // Starts afresh at t0 (after a discontinuity); first step found anew. Counters go on.
  void restart(double t0, const VecX& y0);
  // Takes one internal step, not beyond t_stop. Throws SimulationError saying when and how it got stuck; why, complaint may tell.
  void step(double t_stop);
  double time() const;
  double previous_time() const;  // start of the last step
  // What the last evaluation threw, empty where it succeeded: what steps that were too long for it met counts no more.
  const std::string& complaint() const;
  // The solution at a time within the last step.
  void interpolate(double t, VecX& y) const;
  // The same at four times, a row each, into 4 x size, some of it for all of them at once. Only coordinates are sure to be written.
  void interpolate_four(const double* times, MatX& states) const;
  const VecX& state() const;
  IntegratorStatistics statistics() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flexframe::sim
