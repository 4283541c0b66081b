// Error-controlled integration of y' = f(t, y) by SUNDIALS: CVODE Adams and BDF, ARKODE explicit and diagonally implicit
// Runge-Kutta (Dormand-Prince 5(4); ESDIRK3(2)5L and ESDIRK4(3)6L, Kennedy and Carpenter 2019), IDA on y' - f = 0.
//
// SUNDIALS is included by the implementation only.
#pragma once

#include "sim/scene.h"
#include "sim/types.h"

#include <functional>
#include <memory>

namespace flexframe::sim {

struct OdeProblem {
  int size = 0;
  double tolerance = 1e-6;    // relative; the weights carry it, the order of the implicit Runge-Kutta method is chosen by it
  // Writes dy; may throw SimulationError, which makes the integrator try a smaller step.
  std::function<void(double t, const double* y, double* dy)> rhs;
  // Writes the error weights 1 / (tolerance of each component) for the current y.
  std::function<void(const double* y, double* weight)> weights;
  // Root functions: a change of sign ends the step there.
  int roots = 0;
  std::function<void(double t, const double* y, double* g)> root;
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
  // Takes one internal step, not beyond t_stop. Returns true where a root was found (then time() is the root).
  // Throws SimulationError saying when and why it cannot go on.
  bool step(double t_stop);
  double time() const;
  double previous_time() const;          // start of the last step
  // The solution at a time within the last step.
  void interpolate(double t, VecX& y) const;
  const VecX& state() const;
  const std::vector<int>& root_directions() const;  // per root function after step() returned true: +1, -1 or 0
  IntegratorStatistics statistics() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flexframe::sim
