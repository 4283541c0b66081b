// A trial of a map by motions that every body can do: bending about its principal axes, and twist. What it makes of the nodes' motion is
// compared with the motion itself, at the vertices and in the faces' normals.
#pragma once

#include "interp/graph.h"
#include "interp/lift.h"
#include "interp/partition.h"
#include "interp/sparse.h"

namespace flexframe::interp {

// Relative L2 errors over five motions: of the vertices' displacements, and of the turns of the faces' normals by area.
struct TrialError {
  double displacement = 0.0, normals = 0.0;
};

// nodes: N x 3, m; lift and weights as a map has them. Linear: motions are infinitesimal.
TrialError trial_error(const Weld& weld, const Points& nodes, const Lift& lift, const SparseWeights& weights);

// make_partition; where it had to simplify patches, also with larger patches and with a looser limit, and of these the one that the trial
// finds least wrong.
Partition make_tried_partition(const Weld& weld, const Graph& graph, const Points& nodes, const PartitionOptions& options);

}  // namespace flexframe::interp
