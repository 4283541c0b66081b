// The outer surface of a finite element model, face by face.
#pragma once

#include "sim/reduce/fe_model.h"

#include <vector>

namespace flexframe::sim {

// outer_faces in the order of the elements with all their nodes: corners, then the middles of its edges (3, 4, 6 or 8 node indices).
std::vector<std::vector<int>> whole_outer_faces(const FeModel& model);

}  // namespace flexframe::sim
