// Forces in the joints, from the accelerations by a recursion over the tree; loop joints from the multipliers of their closure rows.
#pragma once

#include "sim/work.h"

namespace flexframe::sim {

struct Reactions {
  std::vector<Vec6> part;   // per part: wrench that its joint exerts on it, at the outboard frame, frame axes
  std::vector<Vec6> loop;   // per loop joint: wrench on frame b (child side), at b, b's axes
};

// Needs accelerations (update_accelerations). Redundant rows carry no force.
void compute_reactions(const Model& model, const Work& work, Reactions& out);

// Power that prescribed motions feed in, W.
double motion_power(const Model& model, const Work& work, const Reactions& reactions);

}  // namespace flexframe::sim
