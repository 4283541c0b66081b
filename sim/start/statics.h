// Static equilibrium: coordinates at which nothing accelerates, with loops closed.
#pragma once

#include "sim/dynamics/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// What a small disturbance of an equilibrium does.
struct Stability {
  bool stable = true;
  bool diverges = false;        // leaves it without swinging about it
  double growth = 0.0;          // 1/s, of what grows fastest; 0: not known
  double frequency = 0.0;       // Hz, of the flutter that needs the most damping
  double damping_wanted = 0.0;  // the ratio that would hold that
  double slowest = 0.0;         // rad/s, of its vibrations; 0: not known

  // Whether it is unstable by flutter that is no part of a run of so many seconds: half a hundredth of critical damping would hold it, less
  // than joints bring, and it grows by less than e.
  bool flutters_little(double duration) const {
    return !stable && !diverges && growth > 0.0 && growth * duration <= 1.0 && damping_wanted <= 5e-3;
  }
};

struct StaticSolution {
  int iterations = 0;  // Newton steps of all load steps
  int load_steps = 1;  // 1: the whole load at once
  Stability stability;
  double snapped =
      -1.0;  // share of the loads at which it snapped through or buckled on the way, when they are raised from zero; negative: it did not
  std::string accelerating;  // joints whose prescribed motions accelerate at t = 0, which counts as a load; empty: none
  double residual = 0.0;     // N, largest force left over
  double leaves = 0.0;       // m/s, of the largest coordinate, as the equilibrium moves on when motions turn loads; 0: none, or not known
  double moved = 0.0;        // m, largest displacement of a coordinate from where the search began
  double softened = 1.0;     // by how much centrifugal forces and pressure enlarge a small addition to the deflection, >= 1
};

// Moves work.q to a relative equilibrium at t = 0 (prescribed motions keep their rates) and leaves positions up to date; work.w is not
// changed, though the search is one at rest, and may no longer suit the loops (assembly.h: assemble_rates).
//
// What is sought: the elastic coordinates of the bodies marked `initial = { static = true }` and, in the trees and loops they stand
// in, every joint coordinate whose `initial` gives neither value nor rate; with SimulationSettings::static_start of all bodies and
// joints. The rest is held. Joint friction holds nothing. `left`, per rate of w_all: coordinates that stay where they are all the same, as
// if nothing drove them (out of the plane of a mechanism that is its own mirror image they are in balance); empty: none.
//
// Newton's method on the forces of rest_forces, each step damped until the tangent stiffness is positive definite (so that a search
// runs downhill, to a stable equilibrium), limited to half a radian or half the mechanism and cut back where the force along it
// turns round (Deuflhard, Newton Methods for Nonlinear Problems, 2004, ch. 3; Nocedal and Wright 2006, ch. 4; the natural monotonicity test
// is Deuflhard's eq. 3.30). Where that fails, or leads over unstable states from a start that rests without loads, the loads are raised in
// steps from zero, and the step is halved where it must; where the states so reached end, at a limit load, the search runs downhill to what
// lies beyond it (snap-through). Where prescribed motions turn the mechanism, the state beside the start is taken if its small motions are
// stable (linearise.h), or flutter by little: gyroscopic forces hold what stiffness alone does not. From one that flutters by more the
// loads are not raised again, which would pass its critical speed.
// Throws InputError naming the coordinate that finds no rest and the force that drives it, prescribed accelerations where these are the
// reason, and beams deformed beyond what their linear displacements can show.
StaticSolution solve_statics(const Model& model, const Scene& scene, Work& work, const std::vector<char>& left = {});

// Whether a scene starts from static equilibrium, wholly or in part.
bool wants_statics(const Scene& scene);

}  // namespace flexframe::sim
