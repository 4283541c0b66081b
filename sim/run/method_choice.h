// The integration method of a run: the first choice, and what it is changed to where it turns out wrong.
#pragma once

#include "sim/time/system.h"

#include <string>

namespace flexframe::sim {

// The method that "auto" begins with. fastest_vibration: of the elastic bodies, rad/s; 0 where another reason decided.
Method choose_method(const System& system, double& fastest_vibration);

// Why the exponential method cannot follow a system, half a sentence; empty where it can.
std::string why_not_exponential(const System& system);

// Whether the exponential method follows the vibrations of a system rightly, whatever its matrices cost. Not in open chains: what
// vibrations do to a free motion on the average is second order, which it leaves out at all but tight tolerances (a cart with an elastic
// pole, let go: 150 tolerances off at 1e-6, the Runge-Kutta method half a one), and where they have died away long steps are the cheaper
// ones (pendulums: to a tenth).
bool may_follow(const System& system);

// Whether explicit steps may follow the vibrations of the bodies: not where a deformation closes a loop. A held beam's stretching is a
// thousandth of its bending and carries as much force, so that the noise of vibrations which explicit steps follow at the limit of their
// stability shows (a wire between hinges at 1e-8: Adams loses 1.4 % of its energy, the Runge-Kutta method 1e-5 for the same time).
bool may_be_followed(const System& system);

// What is fastest in the equations of motion linearised about (t, y), bodies, springs, dampers, bushings and contacts alike.
struct FastestPart {
  double rate = 0.0;    // 1/s: size of the largest eigenvalue; 0: unknown (too many coordinates, or no accelerations there)
  bool decays = false;  // all that is within a hundredth of it decays rather than vibrates
  std::string owner;    // "joint 'slide'", "body 'rod'": whose coordinate moves most in it
};
FastestPart find_fastest(System& system, double t, const VecX& y);

// When a run looks at its method again. Steps and effort, in evaluations, are counted over all integrators of the run.
class MethodReview {
 public:
  // After a step: true where the method is to be compared with others and the run's length with its budget.
  bool due(long steps, double effort, double t, double duration);
  // Of the steps since the last review: simulated seconds an evaluation and a step, and the steps still to go at that pace.
  double pace() const { return pace_; }
  double step() const { return step_; }
  double steps_to_go() const { return to_go_; }
  // Whether a run of `most` steps in all is so far out of reach that it ends here; the farther, the earlier.
  bool hopeless(double most) const;

 private:
  long next_ = 2000, from_steps_ = 0;
  double from_ = 0.0, from_effort_ = 0.0, pace_ = 0.0, step_ = 0.0, to_go_ = 0.0;
};

// What a run does with its steps, half a sentence: "they follow joint 'slide', which vibrates at 1e+07 rad/s". step: their length, s.
std::string what_takes_steps(System& system, double t, const VecX& y, double step);

}  // namespace flexframe::sim
