// Geodesic partition of unity: overlapping patches of 15-30 nodes grown along the surface, their interpolants blended by Wendland C2
// weights of the distance from the patch's centre. Sparse and O(N + M); nothing bleeds across gaps wider than a step along the surface.
// Source: Wendland, Scattered data approximation, 2005, ch. 15; Wendland C2 function (1 - r)^4 (4 r + 1).
#pragma once

#include "interp/graph.h"
#include "interp/lift.h"
#include "interp/patch.h"
#include "interp/sparse.h"

#include <map>
#include <memory>
#include <span>
#include <vector>

namespace flexframe::interp {

struct Partition {
  ArmLift lift;
  SparseWeights weights;  // welded vertices x sources
  LeaveOneOut leave_one_out;
  double lebesgue = 0.0;
  int lebesgue_vertex = -1;  // welded
  int patches = 0;
  int repaired = 0;             // patches that were simplified
  int sheets = 0;               // patches seen as a curved wall
  std::vector<Repair> repairs;  // of each patch
  Eigen::MatrixXd soft;         // of an elastic surface: Green::soft
};

struct PartitionOptions {
  KernelType kernel = KernelType::cubic;
  int patch_nodes = 24;    // <= 0: one patch of all nodes
  bool rotations = false;  // given with the data
  bool arms = true;        // rigid arms along dropped directions; without them vertices follow the nodes' plane
  bool sheets = false;     // patches whose faces look along their third direction are walls: seen along it, vertices beside on arms
  double lebesgue_limit = 10.0;
  bool precise = false;
  int threads = 1;
};

// Makes partitions of one mesh and its nodes; what depends on the size of the patches alone is made once.
class PartitionMaker {
 public:
  // weld, graph, nodes (N x 3, m): must outlive it.
  PartitionMaker(const Weld& weld, const Graph& graph, const Points& nodes);
  ~PartitionMaker();
  // vertices: welded vertices that get rows, in this order, and count for the limit; empty: all. start: simplifications to begin with, as
  // Partition::repairs has them for patches of the same size; empty: none.
  Partition make(const PartitionOptions& options, std::span<const int> vertices = {}, std::span<const Repair> start = {});
  // Whether patches are made in the middle of a wall, with both faces on arms.
  bool in_wall(const PartitionOptions& options) const { return graph_.beside.rows() > 0 && options.arms && options.patch_nodes > 0; }

 private:
  struct Covered;
  const Covered& cover_by(int patch_nodes);
  // Whether the faces around a patch look along its third direction, nearly all.
  bool looks_like_sheet(const Patch& patch, std::span<const int> vertices) const;

  const Weld& weld_;
  const Graph& graph_;
  const Points& nodes_;
  std::map<int, std::unique_ptr<Covered>> covered_;  // by nodes a patch
  Points normals_;                                   // of the welded vertices, where sheets were asked for
  Points middle_, node_middle_;                      // of vertices and nodes, in the middle of the wall
};

// One partition, of all vertices.
Partition make_partition(const Weld& weld, const Graph& graph, const Points& nodes, const PartitionOptions& options);

}  // namespace flexframe::interp
