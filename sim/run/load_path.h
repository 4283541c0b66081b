// Curves of static equilibria over a load: load-deflection curves, through limit points where a structure snaps.
//
// Pseudo-arclength continuation (H. B. Keller 1977; M. A. Crisfield, Computers and Structures 13 (1981)): each state is found by Newton's
// method on the forces at rest (static_problem.h) together with the condition that it lies a given length along the tangent, so that a load
// that passes its maximum is no singular point. Limit points, where the load is largest or smallest, are located to 1e-9 of it.
#pragma once

#include "sim/scene/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

struct LoadPathOptions {
  std::string force;            // name of the force, torque or distributed force that is varied; empty: all loads, weight among them
  double from = 0.0, to = 1.0;  // factors of what the scene gives at t = 0
  int most_states = 2000;
};

struct LoadPathState {
  double load = 0.0;    // factor
  bool stable = false;  // the stiffness is positive definite (of loads with a potential: the state is stable)
  bool limit = false;   // the load is largest or smallest here
  VecX outputs;         // of the scene, at rest
};

struct LoadPath {
  std::vector<std::string> columns, units;  // of the outputs
  std::vector<LoadPathState> states;        // in the order in which they follow one another
  bool complete = true;                     // `to` was reached
  std::string ended;                        // why not, half a sentence
  std::vector<std::string> warnings;        // what the curve shows wrongly, one sentence each
  std::vector<std::string> notes;           // what was switched on, or not looked at
};

// From the state that is found at the load `from`, beside the scene's assembled start, until the load is `to`. Joint friction holds
// nothing; joints are free to move whatever their `initial` says; those with a motion stand where they are at t = 0. Throws InputError: an
// unknown force, no output, no equilibrium to start from, motions with a rate, parts without mass that springs hold.
LoadPath load_path(const Scene& scene, const LoadPathOptions& options);

}  // namespace flexframe::sim
