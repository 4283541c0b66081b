// Inverse dynamics: what generalised forces are left over when no independent coordinate accelerates, or with given accelerations.
//
// Zero where the mechanism is in (relative) equilibrium. No mass matrix is factorised, so that massless parts are ordinary, and the
// cost is O(bodies) (recursive Newton-Euler, Featherstone 2008 sec. 5.3, with elastic coordinates and loop closure).
#pragma once

#include "sim/dynamics/work.h"

namespace flexframe::sim {

struct RestForces {
  VecX force;          // per rate of w_all: what would accelerate it, N, Nm or per elastic coordinate
  double scale = 0.0;  // N: size of the terms that were added up, to judge what is left of them
  VecX unclosed;       // per rate of w_all: the same where no loop holds it, dependent rates too
  VecX size;           // per rate of w_all: sum of the sizes of the terms in `force`, in its units
};

// Positions and velocities in `work` come first; refreshes loads, velocity terms and the parts' accelerations A.
// Loops: the entry of an independent rate is reduced by its cluster's closure, that of a dependent rate is zero.
// elastic: per part, elastic forces to use instead of those of the coordinates (to difference everything else), or null.
// accelerations: of the independent rates (w_all, other entries are not read), or null: none accelerates.
void rest_forces(const Model& model, Work& work, const std::vector<VecX>* elastic, RestForces& out, const VecX* accelerations = nullptr);

// Generalised forces on all rates, dependent ones too, of the loads and the joints' springs, dampers, stops and friction alone: without
// weight, inertia and elastic forces.
void applied_forces(const Model& model, Work& work, RestForces& out);

}  // namespace flexframe::sim
