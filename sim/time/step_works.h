// Work supplied and dissipated within a long step that follows vibrations. The integrator takes their rates for parabolas through states
// at rest, which misses what the vibration does. Here they are evaluated along the solution, at Chebyshev points, twice as many until the
// last quarter of the series of their integral is small; the series tells the works at any time within (Clenshaw, Curtis 1960).
#pragma once

#include "sim/base/types.h"

#include <functional>

namespace flexframe::sim {

class StepWorks {
 public:
  // Rates of both works at a time within the step, W.
  using Rates = std::function<Eigen::Vector2d(double t)>;
  // Of a step from `from` to `to`, s; what rates throws goes on.
  void follow(double from, double to, const Rates& rates);
  // Works since `from`, J.
  Eigen::Vector2d at(double t) const;

 private:
  Eigen::Vector2d scale_ = Eigen::Vector2d::Zero();  // the largest works of a step so far, J
  Eigen::Index points_ = 0;                          // that the next step begins with
  double from_ = 0.0, to_ = 0.0;
  Eigen::Matrix2Xd series_;  // of the works, by Chebyshev polynomials
};

}  // namespace flexframe::sim
