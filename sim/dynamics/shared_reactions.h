// Which reactions bodies that are rigid leave open: a door on two hinges tells nobody what each of them carries.
#pragma once

#include "sim/dynamics/reactions.h"

#include <vector>

namespace flexframe::sim {

// Of joints with states of self-stress: how much of the joint's reaction could be moved to others, relative to the largest in the cluster
// (moments over its size). Reactions across the plane of a plane mechanism are open too, but none of its loads is carried that way: 0.
struct SharedReactions {
  std::vector<double> part, loop;  // per part, per loop joint
};

// Of the state whose reactions (compute_reactions, least squares) are given.
SharedReactions shared_reactions(const Model& model, Work& work, const Reactions& reactions);

}  // namespace flexframe::sim
