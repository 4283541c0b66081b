#include "interp/error_bar.h"

#include "interp/graph.h"
#include "interp/modes.h"
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

// Of each node; without a prediction nothing.
Eigen::VectorXd squares_of(const Points& missed, const Eigen::VectorXd& weight) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(missed.rows());
  for (Eigen::Index i = 0; i < missed.rows(); ++i)
    if (weight[i] > 0.0) out[i] = weight[i] * missed.row(i).squaredNorm();
  return out;
}

// How much a root of squares may lie below the truth when few of them make most of it: with (sum)^2 / sum of squares as the degrees of
// freedom of chi-square, the root of its mean over its lower tenth (E. B. Wilson, M. M. Hilferty, The distribution of chi-square, PNAS 17,
// 1931). 1.05 for 400 alike, 1.4 for 10, 2.1 for 3.
double scatter(const Eigen::VectorXd& squares) {
  constexpr double lower_tenth = -1.2816;
  const double sum = squares.sum();
  if (!(sum > 0.0)) return 1.0;
  const double freedom = std::max(2.0, sum * sum / squares.squaredNorm()), part = 2.0 / (9.0 * freedom);
  return std::pow(1.0 - part + lower_tenth * std::sqrt(part), -1.5);
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
      const double away = to_node / reach[node];
      // A node left out is as far from the others as `reach`: farther away, beyond the nodes or in a gap, a miss grows faster than
      // distance.
      const double grown = away > 1.0 ? away * std::sqrt(away) : away;
      carried_[around * v + k] = {node, static_cast<float>(grown / (sorted[k].first + floor) / total)};
    }
  }
}

void ErrorBar::evaluate(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation,
                        std::span<float> out) const {
  Points missed = node_residuals(map, displacement, rotation);
  if (known()) missed *= scatter(squares_of(missed, node_weights(map)));
  const Eigen::VectorXf length = missed.rowwise().norm().cast<float>();
  for (size_t v = 0; v < out.size(); ++v) {
    float sum = 0.0f;
    for (size_t k = 0; k < around; ++k)
      if (const Share& s = carried_[around * v + k]; s.node >= 0) sum += s.weight * length[s.node];
    out[v] = sum;
  }
}

Eigen::VectorXd ErrorBar::node_weights(const Map& map) const {
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(map.node_positions.rows());
  const size_t vertices = carried_.size() / around;
  for (size_t v = 0; v < vertices; ++v) {
    double all = 0.0;
    for (size_t k = around * v; k < around * (v + 1); ++k) all += static_cast<double>(carried_[k].weight);
    for (size_t k = around * v; k < around * (v + 1); ++k)
      if (carried_[k].node >= 0) weight[carried_[k].node] += static_cast<double>(carried_[k].weight) * all;
  }
  return weight / static_cast<double>(std::max<size_t>(1, vertices));
}

namespace {

constexpr Eigen::Index looked_at = 4000;  // vertices

Points some_vertices(const MeshView& mesh, Eigen::Index step) {
  Points some((mesh.vertices.rows() + step - 1) / step, 3);
  for (Eigen::Index i = 0; i < some.rows(); ++i) some.row(i) = mesh.vertices.row(i * step);
  return some;
}

Eigen::Index step_over(Eigen::Index vertices) { return 1 + vertices / looked_at; }

// Half the spacing has this share of the error of a spline of that degree: leaving a node out doubles it.
double spline_share(const Map& map) {
  if (std::holds_alternative<AxisLift>(map.lift)) return 1.0 / 16.0;   // cubic: fourth order
  if (std::holds_alternative<CurveLift>(map.lift)) return 1.0 / 64.0;  // fifth degree: sixth order
  return 1.0;
}

}  // namespace

MeanError::MeanError(const Map& map, const MeshView& mesh) {
  const Points some = some_vertices(mesh, step_over(mesh.vertices.rows()));
  const MeshView view{Eigen::Map<const Points>(some.data(), some.rows(), 3), Eigen::Map<const Triangles>(nullptr, 0, 3)};
  const ErrorBar bar(map, view);
  if (!bar.known()) return;
  const double share = spline_share(map);
  weight_ = share * share * bar.node_weights(map);
}

double MeanError::evaluate(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) const {
  const Points missed = node_residuals(map, displacement, rotation);
  const Eigen::VectorXd squares = squares_of(missed, weight_);
  return scatter(squares) * std::sqrt(squares.sum());
}

ModeDoubt doubt_modes(const Map& map, const MeshView& mesh, const Eigen::Ref<const Eigen::MatrixXd>& phi,
                      const Eigen::Ref<const Eigen::MatrixXd>& psi, const ModeColumns& columns) {
  ModeDoubt out;
  const MeanError mean(map, mesh);
  if (!mean.known() || phi.cols() == 0) return out;
  const Eigen::Index nodes = map.node_positions.rows(), n = phi.cols();
  const double size = (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).norm();
  Eigen::MatrixXd missed = Eigen::MatrixXd::Zero(3 * nodes, n);
  for (Eigen::Index m = 0; m < n; ++m) {
    // So small that it is a mode shape and no finite turn.
    constexpr double small = 1e-6;
    const double largest = phi.col(m).cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) continue;
    const double scale = small * size / largest;
    const auto rows_of = [&](const Eigen::MatrixXd& of) {
      Points rows(of.rows() / 3, 3);
      for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = scale * of.block<3, 1>(3 * i, 0).transpose();
      return rows;
    };
    const Points r = node_residuals(map, rows_of(phi.col(m)), map.rotations ? rows_of(psi.col(m)) : Points(0, 3));
    for (Eigen::Index i = 0; i < nodes; ++i)
      if (mean.weights()[i] > 0.0) missed.block<3, 1>(3 * i, m) = std::sqrt(mean.weights()[i]) / scale * r.row(i).transpose();
    missed.col(m) *= scatter(squares_of(r, mean.weights()));
  }
  out.doubt = missed.transpose() * missed;
  const Eigen::Index step = step_over(map.vertices), some = (map.vertices + step - 1) / step;
  Eigen::MatrixXd moved(3 * some, n);
  for (Eigen::Index i = 0; i < some; ++i)
    for (Eigen::Index m = 0; m < n; ++m)
      for (int c = 0; c < 3; ++c) moved(3 * i + c, m) = static_cast<double>(columns(3 * i * step + c, m));
  out.moved = moved.transpose() * moved / static_cast<double>(some);
  return out;
}

}  // namespace flexframe::interp
