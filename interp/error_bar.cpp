#include "interp/error_bar.h"

#include "interp/graph.h"
#include "interp/residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::interp {
namespace {

// Of each node with a prediction the distance to its nearest other node; NaN without one.
Eigen::VectorXd reach_of_nodes(const Map& map) {
  const Points& x = map.node_positions;
  const Points zero = Points::Zero(map.nodes, 3), none(0, 3);
  // A map's predictions are linear in the data: which exist is seen with nodes at rest.
  const Points missed = node_residuals(map, zero, map.rotations ? zero : none);
  Eigen::VectorXd reach = Eigen::VectorXd::Constant(x.rows(), std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (!missed.row(i).allFinite()) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (Eigen::Index j = 0; j < x.rows(); ++j)
      if (j != i) nearest = std::min(nearest, (x.row(i) - x.row(j)).squaredNorm());
    reach[i] = std::sqrt(nearest);
  }
  return reach;
}

}  // namespace

ErrorBar::ErrorBar(const Map& map, const MeshView& mesh) {
  const Eigen::VectorXd reach = reach_of_nodes(map);
  std::vector<int> predicted;
  for (Eigen::Index i = 0; i < reach.size(); ++i)
    if (std::isfinite(reach[i]) && reach[i] > 0.0) predicted.push_back(static_cast<int>(i));
  if (predicted.empty()) return;
  Points at(std::ssize(predicted), 3);
  for (size_t k = 0; k < predicted.size(); ++k) at.row(static_cast<Eigen::Index>(k)) = map.node_positions.row(predicted[k]);
  const PointGrid all(map.node_positions), grid(at);
  carried_.resize(around * mesh.vertices.rows());
  std::vector<int> near;
  std::vector<std::pair<double, int>> sorted;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Vec3 x = mesh.vertices.row(v).transpose();
    const double to_node = (map.node_positions.row(all.nearest(x)).transpose() - x).norm();
    // The nearest few of those with a prediction, found in a ball that grows.
    const int first = grid.nearest(x);
    const double to_first = (at.row(first).transpose() - x).norm();
    double radius = std::max(1.5 * to_first, reach[predicted[first]]);
    const auto wanted = std::min<size_t>(around, predicted.size());
    for (grid.within(x, radius, near); near.size() < wanted; grid.within(x, radius, near)) radius *= 1.5;
    sorted.clear();
    for (const int k : near) sorted.emplace_back((at.row(k).transpose() - x).squaredNorm(), k);
    std::partial_sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(wanted), sorted.end());
    double total = 0.0;
    const double floor = 1e-12 * radius * radius;
    for (size_t k = 0; k < wanted; ++k) total += 1.0 / (sorted[k].first + floor);
    for (size_t k = 0; k < wanted; ++k) {
      const int node = predicted[sorted[k].second];
      carried_[around * v + k] = {node, static_cast<float>(to_node / reach[node] / (sorted[k].first + floor) / total)};
    }
  }
}

void ErrorBar::evaluate(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation,
                        std::span<float> out) const {
  const Points missed = node_residuals(map, displacement, rotation);
  const Eigen::VectorXf length = missed.rowwise().norm().cast<float>();
  for (size_t v = 0; v < out.size(); ++v) {
    float sum = 0.0f;
    for (size_t k = 0; k < around; ++k)
      if (const Share& s = carried_[around * v + k]; s.node >= 0) sum += s.weight * length[s.node];
    out[v] = sum;
  }
}

}  // namespace flexframe::interp
