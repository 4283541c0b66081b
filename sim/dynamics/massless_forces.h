// What the search for rates without inertia (massless_find.cpp) and their balance (massless.cpp) share.
#pragma once

#include "sim/dynamics/inverse_dynamics.h"
#include "sim/dynamics/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// Part whose joint has rate v; -1 for elastic rates.
int joint_of_rate(const Model& model, int v);
// Their joints in quotes, for messages; rates in ascending order.
std::string joints_of(const Model& model, const std::vector<int>& rates);

// Which of the rates without inertia dampers act on, at the present state.
void split_massless(const Model& model, Work& work);

// Closes the loops and places all parts.
void place_all(const Model& model, Work& work);
// Moves the coordinates by dw (of w_all, times seconds); nothing is placed.
void move_all(const Model& model, const VecX& dw, Work& work);

// Applied forces on all rates with everything at rest where it stands: no damper acts. Lives in `rest`.
const VecX& forces_at_rest(const Model& model, Work& work, RestForces& rest);

}  // namespace flexframe::sim
