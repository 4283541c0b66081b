#include "interp/compare.h"

#include "interp/error_bar.h"
#include "interp/residuals.h"
#include "interp/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace flexframe::interp {

double left_out_error(const Map& map, const Weld& weld, const NodeMotions& known) {
  constexpr double small = 1e-6;  // a mode shape this small is no finite turn
  const double none = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Index n = known.displacement.cols();
  if (n == 0) return none;
  const MeshView mesh{Eigen::Map<const Points>(weld.positions.data(), weld.positions.rows(), 3),
                      Eigen::Map<const Triangles>(weld.triangles.data(), weld.triangles.rows(), 3)};
  const MeanError mean(map, mesh);
  if (!mean.known()) return none;
  double sum = 0.0;
  int counted = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double largest = known.displacement.col(k).cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) continue;
    const double scale = known.linear ? small * weld.size / largest : 1.0;
    const auto rows_of = [&](const Eigen::MatrixXd& of) {
      Points rows(of.rows() / 3, 3);
      for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = scale * of.block<3, 1>(3 * i, k).transpose();
      return rows;
    };
    const Points u = rows_of(known.displacement), theta = map.rotations ? rows_of(known.rotation) : Points(0, 3);
    const Points residual = node_residuals(map, u, theta);
    Points positions(map.nodes, 3);
    for (int i = 0; i < map.nodes; ++i) positions.row(i) = map.node_positions.row(map.node_of[i]);
    const RigidMotion rigid = best_rigid_motion(positions, u, theta);
    double squares = 0.0, deforms = 0.0;
    for (int i = 0; i < map.nodes; ++i)
      deforms += (u.row(i).transpose() - rigid.displacement(positions.row(i).transpose())).squaredNorm() / map.nodes;
    for (Eigen::Index i = 0; i < residual.rows(); ++i)
      if (mean.weights()[i] > 0.0) squares += mean.weights()[i] * residual.row(i).squaredNorm();
    if (!(deforms > 1e-24 * scale * scale * largest * largest)) continue;
    sum += std::min(1.0, squares / deforms);
    ++counted;
  }
  return counted > 0 ? std::sqrt(sum / counted) : none;
}

namespace {

// How far the kernel is from the elastic surface in the motions that cost the latter the least energy: waves round a tube need more nodes
// than the trial by smooth motions tells.
double soft_difference(const Weld& weld, const Map& map, const Partition& elastic, const Partition& kernel) {
  const Points none(0, 3);
  std::vector<int> every(weld.positions.rows());
  std::iota(every.begin(), every.end(), 0);
  const auto moved = [&](const Lift& lift, const SparseWeights& weights, const Points& u) {
    PointsF found(weld.positions.rows(), 3);
    multiply_single(weights, lift_linear(lift, u, none).cast<float>(), every, std::span<float>(found.data(), found.size()), 1);
    return found;
  };
  double off = 0.0;
  for (Eigen::Index k = 0; k < elastic.soft.cols(); ++k) {
    const Eigen::VectorXd column = elastic.soft.col(k);
    const Points u = Eigen::Map<const Points>(column.data(), map.node_positions.rows(), 3);
    const PointsF truth = moved(map.lift, elastic.weights, u), found = moved(Lift(kernel.lift), kernel.weights, u);
    off += static_cast<double>((found - truth).squaredNorm() / truth.squaredNorm());
  }
  return elastic.soft.cols() > 0 ? std::sqrt(off / static_cast<double>(elastic.soft.cols())) : 0.0;
}

}  // namespace

std::string bends_worse(const Weld& weld, const Map& map, const Partition& elastic, const Partition& kernel) {
  constexpr double limit = 0.1, times = 4.0, follows = 0.13;
  if (soft_difference(weld, map, elastic, kernel) > follows) return {};
  const TrialError own = trial_error(weld, map.node_positions, map.lift, elastic.weights);
  if (own.normals <= limit && own.displacement <= limit) return {};
  const TrialError other = trial_error(weld, map.node_positions, Lift(kernel.lift), kernel.weights);
  if (own.normals <= times * other.normals && own.displacement <= times * other.displacement) return {};
  return fmt::format(
      "{} nodes: in bending and twist of the whole the kernel turns normals wrong by {:.2g} %, the elastic surface by {:.2g} %",
      map.node_positions.rows(), 100.0 * other.normals, 100.0 * own.normals);
}

}  // namespace flexframe::interp
