// Whether a body is slender along its nodes - an arc, a ring, a helix, a frame of bars - and if so, which nodes follow one another.
//
// Neighbours are those of Gabriel and Sokal (A new statistical approach to geographic variation analysis, 1969): no third node lies in the
// ball over the way between them, measured along the surface (the legs of a bow are far apart). Nodes of no common part of the mesh are no
// neighbours. Rows of nodes with two neighbours are chains; they end at branches and at corners.
#pragma once

#include "interp/curve.h"
#include "interp/graph.h"
#include "interp/sparse.h"

#include <optional>
#include <string>

namespace flexframe::interp {

struct Skeleton {
  CurveLift curves;
  std::vector<std::vector<int>> beside;               // of each node: chain and interval, chain and interval, ... within two neighbours
  std::vector<int> label;                             // of each welded vertex: the nearest node along the surface
  std::vector<int> part;                              // of each welded vertex; empty: the mesh is one
  std::vector<std::vector<std::vector<int>>> owners;  // of each chain's intervals: the parts that they run inside
  double reach = 0.0;                                 // m: where a vertex lies so near to a line of its node's surroundings, it hangs there
  int branches = 0;
};

// None if the nodes do not run along a slender body.
std::optional<Skeleton> find_skeleton(const Weld& weld, const Graph& graph, const Points& nodes, bool rotations_given);

// Weights of the welded vertices: on the nearest line, shared where several meet.
SparseWeights skeleton_weights(const Skeleton& skeleton, const Weld& weld, bool precise, int threads);

// The chains without one node, for its prediction from the others; empty if the node ends a chain.
std::optional<CurveLift> without_node(const CurveLift& curves, int chain, int place);

}  // namespace flexframe::interp
