// The start: coordinates and rates that close every loop, as near to the scene's as the loops allow.
#pragma once

#include "sim/dynamics/work.h"

#include <string>

namespace flexframe::sim {

// Sets work.q and work.w. Given values and rates are kept; where none is given they start at 0 and move as little as loops need
// (Gauss-Newton with minimum-norm steps). Chooses every cluster's partition and leaves positions and velocities up to date.
// Throws InputError naming the joint that stays open and by how much, or the joints whose given rates contradict each other.
// notes: what had to be moved.
void assemble(Model& model, const Scene& scene, Work& work, Notes& notes);

// The second half of it: rates in work.w that keep the loops closed at the present (closed) positions, given rates kept.
void assemble_rates(const Model& model, const Scene& scene, Work& work, Notes& notes);

// "0.12 m and 1.9 rad": how far the joints' coordinates lie apart at most, lengths and angles (turns of orientations). Empty: nowhere by
// more than `least`, m or rad.
std::string largest_moves(const Model& model, const VecX& from, const VecX& to, double least);

}  // namespace flexframe::sim
