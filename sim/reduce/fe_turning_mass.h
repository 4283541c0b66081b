// Inertia that turns with nodes: rotary inertia and masses beside their nodes (lumps, shells with an offset), sections of beams. Of each
// the second order in the motion of its node: what turns by theta takes its inertia along, J becomes R J R^T.
#pragma once

#include "sim/reduce/fe_system.h"

#include <array>

namespace flexframe::sim {

struct TurningMass {
  int node = -1;          // index
  Vec3 s = Vec3::Zero();  // first moment about the node, kg m
  Mat3 J = Mat3::Zero();  // inertia about the node, kg m^2
};

std::vector<TurningMass> turning_masses(const FeModel& model, const FeSystem& system);

// What the rotations of their nodes in the fields U (size x n) add to the first order of the inertia (xx yy zz xy xz yz), 6 x n; the loads
// (size x 6) whose work on a field is that are added to `loads`.
Mat6X turned_inertia(const FeModel& model, const FeSystem& system, const std::vector<TurningMass>& masses, const MatX& U);
void add_turning_loads(const FeModel& model, const FeSystem& system, const std::vector<TurningMass>& masses, Eigen::Ref<MatX> loads);

// Second derivatives of first moment, angular momentum (of the rate j, by the coordinate k) and inertia that a mass matrix of translations
// and rotations does not have, n x n each. md stays empty where no mass lies beside its node.
struct TurnedMass {
  std::array<MatX, 3> md, Cr;
  std::array<MatX, 6> J;
};
TurnedMass turned_mass(const FeModel& model, const FeSystem& system, const std::vector<TurningMass>& masses, const MatX& U);

}  // namespace flexframe::sim
