// What a map may be wrong by at each vertex, told from the nodes alone: each node is predicted from the others (leave_one_out), and the
// miss there is carried to the vertices around. A vertex on a node has none; one as far from the nearest node as that from its next has
// what leaving a node out made. Of the size of the error (README.md).
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

  // Of each merged node: what its squared miss adds to the mean square of the bars (an upper bound of it, by Cauchy and Schwarz).
  Eigen::VectorXd node_weights(const Map& map) const;

 private:
  static constexpr int around = 4;  // nodes whose misses a vertex takes
  struct Share {
    int node = -1;
    float weight = 0.0f;
  };
  std::vector<Share> carried_;  // `around` a vertex; empty: unknown
};

// The error bars of a body on the whole, from a few thousand of its vertices.
class MeanError {
 public:
  // Of a map and the mesh that it was made for.
  MeanError(const Map& map, const MeshView& mesh);
  bool known() const { return weight_.size() > 0; }
  // Root mean square over the vertices, m.
  double evaluate(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) const;
  // Of each merged node, as ErrorBar::node_weights.
  const Eigen::VectorXd& weights() const { return weight_; }

 private:
  Eigen::VectorXd weight_;  // of each merged node; empty: unknown
};

class ModeColumns;

// The same for the coordinates of a modal body: mean squares over the vertices of error bar and displacement are q' doubt q and q' moved q.
struct ModeDoubt {
  Eigen::MatrixXd doubt, moved;  // n x n; empty: unknown
};
// phi, psi: as for map_modes, whose columns (3 M x n) these are.
ModeDoubt doubt_modes(const Map& map, const MeshView& mesh, const Eigen::Ref<const Eigen::MatrixXd>& phi,
                      const Eigen::Ref<const Eigen::MatrixXd>& psi, const ModeColumns& columns);

}  // namespace flexframe::interp
