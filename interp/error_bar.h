// What a map may be wrong by at each vertex, told from the nodes alone: each node is predicted from the others (leave_one_out), and the
// miss there is carried to the vertices around. A vertex on a node has none; one as far from the nearest node as that from its next has
// what leaving a node out made. Of the size of the error with the kernel, far above it with the elastic surface, which loses the support of
// the node that is left out (README.md).
#pragma once

#include "interp/map.h"

#include <span>
#include <vector>

namespace flexframe::interp {

class ErrorBar {
 public:
  // Of a map and the mesh that it was made for. Straight distances.
  ErrorBar(const Map& map, const MeshView& mesh);

  // False where the layout has no estimate (one or two nodes, patches that were all simplified).
  bool known() const { return !carried_.empty(); }

  // Error bar of each vertex, m (map.vertices floats). displacement N x 3, m, and rotation N x 3, rad, or 0 x 3, as for apply(map, ...).
  void evaluate(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation,
                std::span<float> out) const;

 private:
  static constexpr int around = 4;  // nodes whose misses a vertex takes
  struct Share {
    int node = -1;
    float weight = 0.0f;
  };
  std::vector<Share> carried_;  // `around` a vertex; empty: unknown
};

}  // namespace flexframe::interp
