// Forces in the joints, from the accelerations by a recursion over the tree; loop joints from the multipliers of their closure rows.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

struct Reactions {
  std::vector<Vec6> part;        // per part: wrench that its joint exerts on it, at the outboard frame, frame axes
  std::vector<Vec6> loop;        // per loop joint: wrench on frame b (child side), at b, b's axes
  std::vector<double> coupling;  // per coupling: multiplier of its row, N or N m
};

// Needs accelerations (update_accelerations). Redundant closure conditions (a planar loop of spatial revolutes) leave reactions
// undetermined: with minimum_norm the joints of the cluster share the load so that the sum of squares is least (moments over its size),
// else redundant ones carry none.
template <class W>
void compute_reactions(const Model& model, W& work, Reactions& out, bool minimum_norm = true);

// Multipliers of all closure rows of a cluster (N, or Nm for angles), those of its locked rates last: forces along the rows' directions.
// Redundant rows carry none.
template <class W>
VecX closure_multipliers(const Model& model, W& work, int cluster);

// Power that prescribed motions feed in, W: what the parts gain beyond what loads and the joints' own springs, dampers, stops and friction
// give them, since joints and couplings as such do no work. Needs accelerations (update_accelerations). With MasslessRates as exact as
// their balance.
template <class W>
double motion_power(const Model& model, const W& work);

}  // namespace flexframe::sim
