// Stress of displacement fields at the nodes of a finite element model.
//
// Around a node the stress of solids is the mean of their elements, of shells the mean of those that go on smoothly there: the same plate,
// whatever way the elements' normals point. At a fold, or where the thickness changes, each plate has a stress of its own, and on each of
// its two faces: a mean over all of them would be that of none. Faces are those of the side that the first element's normal points to, and
// the other side.
#pragma once

#include "sim/reduce/fe_system.h"

#include <vector>

namespace flexframe::sim {

// Per node a list of stresses, 6 x n each (xx yy zz xy yz xz, space axes): of the solids, then of each plate on the face that its normal
// points to and on the other one; empty: nothing there has a stress.
std::vector<std::vector<MatX>> stresses_at_nodes(const FeModel& model, const FeSystem& system, const MatX& U,
                                                 const std::vector<int>& nodes);

// The first of each list; without columns where there is none.
std::vector<MatX> nodal_stress(const FeModel& model, const FeSystem& system, const MatX& U, const std::vector<int>& nodes);

}  // namespace flexframe::sim
