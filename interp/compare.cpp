#include "interp/compare.h"

#include "interp/error_bar.h"
#include "interp/residuals.h"
#include "interp/trial.h"
#include "interp/watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace flexframe::interp {

namespace {

// What leaving nodes out makes of one motion.
struct LeftOut {
  Points moved, turned;  // of the merged nodes, m and rad (0 x 3 without rotations)
  Points missed;         // residuals of the merged nodes
  double deforms = 0.0;  // mean square of the nodes' displacements less their rigid part
};

// Of every motion that deforms, whichever map is asked: the same ones.
std::vector<LeftOut> leave_out(const Map& map, const Weld& weld, const NodeMotions& known) {
  constexpr double small = 1e-6;  // a mode shape this small is no finite turn
  std::vector<LeftOut> out;
  for (Eigen::Index k = 0; k < known.displacement.cols(); ++k) {
    const double largest = known.displacement.col(k).cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) continue;
    const double scale = known.linear ? small * weld.size / largest : 1.0;
    const auto rows_of = [&](const Eigen::MatrixXd& of) {
      Points rows(of.rows() / 3, 3);
      for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = scale * of.block<3, 1>(3 * i, k).transpose();
      return rows;
    };
    const Points u = rows_of(known.displacement), theta = map.rotations ? rows_of(known.rotation) : Points(0, 3);
    Points positions(map.nodes, 3);
    for (int i = 0; i < map.nodes; ++i) positions.row(i) = map.node_positions.row(map.node_of[i]);
    const RigidMotion rigid = best_rigid_motion(positions, u, theta);
    double deforms = 0.0;
    for (int i = 0; i < map.nodes; ++i)
      deforms += (u.row(i).transpose() - rigid.displacement(positions.row(i).transpose())).squaredNorm() / map.nodes;
    if (deforms > 1e-24 * scale * scale * largest * largest)
      out.push_back({merge_data(map, u), merge_data(map, theta), node_residuals(map, u, theta), deforms});
  }
  return out;
}

// Weights of the nodes; empty: not known.
Eigen::VectorXd weights_of(const Map& map, const Weld& weld) {
  const MeshView mesh{Eigen::Map<const Points>(weld.positions.data(), weld.positions.rows(), 3),
                      Eigen::Map<const Triangles>(weld.triangles.data(), weld.triangles.rows(), 3)};
  const MeanError mean(map, mesh);
  return mean.known() ? mean.weights() : Eigen::VectorXd();
}

}  // namespace

double left_out_error(const Map& map, const Weld& weld, const NodeMotions& known) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  if (known.displacement.cols() == 0) return none;
  const Eigen::VectorXd weight = weights_of(map, weld);
  if (weight.size() == 0) return none;
  const std::vector<LeftOut> motions = leave_out(map, weld, known);
  double sum = 0.0;
  for (const LeftOut& motion : motions) {
    double squares = 0.0;
    for (Eigen::Index i = 0; i < motion.missed.rows(); ++i)
      if (weight[i] > 0.0) squares += weight[i] * motion.missed.row(i).squaredNorm();
    sum += std::min(1.0, squares / motion.deforms);
  }
  return motions.empty() ? none : std::sqrt(sum / static_cast<double>(motions.size()));
}

namespace {

// Mean square over the vertices of how far two maps are apart in a motion.
double apart(const Candidate& a, const Candidate& b, const LeftOut& motion) {
  const auto moved = [&](const Candidate& c) {
    std::vector<int> every(c.weights.rows);
    std::iota(every.begin(), every.end(), 0);
    PointsF found(c.weights.rows, 3);
    multiply_single(c.weights, lift_exact(c.map.lift, motion.moved, motion.turned).cast<float>(), every,
                    std::span<float>(found.data(), found.size()), 1);
    return found;
  };
  return static_cast<double>((moved(a) - moved(b)).squaredNorm()) / a.weights.rows;
}

}  // namespace

BestBlend best_blend(const Candidate& a, const Candidate& b, const Weld& weld, const NodeMotions& known) {
  constexpr double alike = 0.4;
  constexpr size_t looked_at = 12;  // motions, of how far the maps are apart
  const double none = std::numeric_limits<double>::quiet_NaN();
  const Eigen::VectorXd weight = weights_of(a.map, weld), other = weights_of(b.map, weld);
  if (weight.size() == 0 || other.size() == 0) return {none, none};
  const std::vector<LeftOut> of_a = leave_out(a.map, weld, known), of_b = leave_out(b.map, weld, known);
  // Squares and products of the residuals of each motion: a a, a b, b b.
  std::vector<Vec3> products;
  Vec3 sum = Vec3::Zero();
  double distance = 0.0, looked = 0.0;
  const size_t step = std::max<size_t>(1, of_a.size() / looked_at);
  for (size_t k = 0; k < of_a.size(); ++k) {
    look();
    Vec3 p = Vec3::Zero();
    for (Eigen::Index i = 0; i < weight.size(); ++i) {
      if (!(weight[i] > 0.0 && other[i] > 0.0)) continue;
      const Vec3 x = of_a[k].missed.row(i).transpose(), y = of_b[k].missed.row(i).transpose();
      p += weight[i] * Vec3(x.squaredNorm(), x.dot(y), y.squaredNorm());
    }
    // A motion that nobody can follow does not decide.
    const double unit = std::max({of_a[k].deforms, p[0], p[2]});
    products.push_back(p / of_a[k].deforms);
    sum += p / unit;
    if (k % step != 0) continue;
    distance += apart(a, b, of_a[k]) / unit;
    ++looked;
  }
  // Least of (1 - s)^2 aa + 2 s (1 - s) ab + s^2 bb.
  const double spread = sum[0] - 2.0 * sum[1] + sum[2];
  if (products.empty() || !(spread > 0.0)) return {none, none};
  const double between = std::sqrt(distance / looked * static_cast<double>(of_a.size()));
  if (between > std::sqrt(sum[0]) + std::sqrt(sum[2])) return {none, none};
  const bool ranked = between > alike * std::sqrt(std::min(sum[0], sum[2]));
  const double s = ranked ? std::clamp((sum[0] - sum[1]) / spread, 0.0, 1.0) : 0.5;
  double error = 0.0;
  for (const Vec3& p : products) error += std::min(1.0, p.dot(Vec3((1.0 - s) * (1.0 - s), 2.0 * s * (1.0 - s), s * s)));
  return {s, std::sqrt(error / static_cast<double>(products.size()))};
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
