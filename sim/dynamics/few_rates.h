// Accelerations of a cluster of few independent rates, by what each of these does to the parts.
//
// The twist of every part per independent rate, T, follows from that of the part which carries it, with the conditions of loops solved
// already (ClusterWork::E). The reduced mass matrix is then the sum over the parts of T^T M T, and the forces that of -T^T f: what Kane
// calls partial velocities. All rates of a row of T fit into one or two registers, so that nothing is projected and no block is placed;
// with more rates composite bodies (dynamics.cpp) need fewer operations.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// Whether solve_few serves a cluster that what carries it does not feel: up to eight independent rates, no deformation that closes a loop.
template <class W>
bool has_few_rates(int cluster, const W& work);

// Accelerations work.wdot of such a cluster; own inertias and forces of its parts and the acceleration of its base come first. Leaves the
// factor in ClusterWork::L, not M and r, and the power that prescribed motions feed in in ClusterWork::fed. False where a coordinate has
// no inertia or the kinetic energy is not positive: nothing is set then.
template <class W>
bool solve_few(const Model& model, int cluster, W& work);

// A thin rod that turns about itself in a loop has an inertia of rounding, by products with what closes the loop, and its pivot does not
// show it: that of one rate alone is as large as itself. Whether a rigid body of the cluster has no inertia about some axis, and where a
// joint's rate has no more than this share of the masses, in metres, these masses (kg; else, and where something deforms, 0).
inline constexpr double idle_share = 1e-13;
bool has_thin_body(const Model& model, int cluster);
double idle_mass(const Model& model, int cluster, const ClusterWork& cw);

}  // namespace flexframe::sim
