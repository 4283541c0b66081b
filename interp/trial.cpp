#include "interp/trial.h"

#include "interp/dense_solvers.h"
#include "interp/elastic.h"
#include "interp/watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace flexframe::interp {
namespace {

// Displacement and rotation (half its curl) of one of the motions at x y z along the principal axes, the longest first: the curvatures of
// a plate about both axes and its twist, bending in its plane, torsion of a bar.
constexpr int motions = 5;
std::array<Vec3, 2> motion_at(int motion, const Vec3& p) {
  const double x = p.x(), y = p.y(), z = p.z();
  switch (motion) {
    case 0:
      return {Vec3(-x * z, 0.0, 0.5 * x * x), Vec3(0.0, -x, 0.0)};
    case 1:
      return {Vec3(0.0, -y * z, 0.5 * y * y), Vec3(y, 0.0, 0.0)};
    case 2:
      return {Vec3(-y * z, -x * z, x * y), Vec3(x, -y, 0.0)};
    case 3:
      return {Vec3(-x * y, 0.5 * x * x, 0.0), Vec3(0.0, 0.0, x)};
    default:
      return {Vec3(0.0, -x * z, x * y), Vec3(x, -0.5 * y, -0.5 * z)};
  }
}

}  // namespace

TrialError trial_error(const Weld& weld, const Points& nodes, const Lift& lift, const SparseWeights& weights) {
  const Vec3 centre = weld.positions.colwise().mean().transpose();
  const Points local = weld.positions.rowwise() - centre.transpose();
  const Mat3 frame = principal_axes(local.transpose() * local).axes.rowwise().reverse();
  std::vector<int> every(weld.positions.rows());
  std::iota(every.begin(), every.end(), 0);
  double error = 0.0, turned = 0.0;
  for (int motion = 0; motion < motions; ++motion) {
    look();
    const auto move = [&](const Points& points, Points& shift, Points* turn) {
      shift.resize(points.rows(), 3);
      if (turn) turn->resize(points.rows(), 3);
      for (Eigen::Index i = 0; i < points.rows(); ++i) {
        const auto at = motion_at(motion, frame.transpose() * (points.row(i).transpose() - centre));
        shift.row(i) = (frame * at[0]).transpose();
        // The frame may be left-handed: an axis of rotation then changes its sign.
        if (turn) turn->row(i) = (frame.determinant() * (frame * at[1])).transpose();
      }
    };
    Points u, theta, truth;
    move(nodes, u, &theta);
    move(weld.positions, truth, nullptr);
    PointsF found(weld.positions.rows(), 3);
    multiply_single(weights, lift_linear(lift, u, theta).cast<float>(), every, std::span<float>(found.data(), found.size()), 1);
    const Points wrong = found.cast<double>() - truth;
    error += wrong.squaredNorm() / truth.squaredNorm() / motions;
    double off = 0.0, all = 0.0;
    for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) {
      const Eigen::Vector3i c = weld.triangles.row(t).transpose();
      const auto edge = [&](const Points& p, int k) { return Vec3((p.row(c[k]) - p.row(c[0])).transpose()); };
      const Vec3 a = edge(weld.positions, 1), b = edge(weld.positions, 2), normal = a.cross(b);
      const double area = normal.norm();
      if (!(area > 1e-6 * a.norm() * b.norm())) continue;
      // First order of the unit normal.
      const auto turn = [&](const Points& p) {
        const Vec3 change = (edge(p, 1).cross(b) + a.cross(edge(p, 2))) / area, n = normal / area;
        return Vec3(change - n * n.dot(change));
      };
      off += area * turn(wrong).squaredNorm();
      all += area * turn(truth).squaredNorm();
    }
    turned += all > 0.0 ? off / all / motions : 0.0;
  }
  return {std::sqrt(error), std::sqrt(turned)};
}

namespace {

// A mesh of some faces of a large one: enough to tell one map from another.
struct Sample {
  std::vector<int> vertices;  // of the large mesh, ascending; empty: it is small, take all of it
  Weld weld;
};

Sample sample_faces(const Weld& weld) {
  constexpr Eigen::Index enough = 20000;
  Sample sample;
  const Eigen::Index count = weld.triangles.rows();
  if (count <= 4 * enough) return sample;
  // Spread by the golden section, so that no regular order of the faces matters.
  std::vector<Eigen::Index> faces;
  for (Eigen::Index i = 0; i < enough; ++i) {
    const double place = std::fmod(static_cast<double>(i) * std::numbers::phi, 1.0);
    faces.push_back(std::min(count - 1, static_cast<Eigen::Index>(place * static_cast<double>(count))));
  }
  std::vector<int>& kept = sample.vertices;
  for (const Eigen::Index f : faces)
    for (int c = 0; c < 3; ++c) kept.push_back(weld.triangles(f, c));
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  sample.weld.positions.resize(std::ssize(kept), 3);
  for (size_t k = 0; k < kept.size(); ++k) sample.weld.positions.row(static_cast<Eigen::Index>(k)) = weld.positions.row(kept[k]);
  sample.weld.triangles.resize(enough, 3);
  for (Eigen::Index i = 0; i < enough; ++i)
    for (int c = 0; c < 3; ++c)
      sample.weld.triangles(i, c) =
          static_cast<int>(std::lower_bound(kept.begin(), kept.end(), weld.triangles(faces[static_cast<size_t>(i)], c)) - kept.begin());
  return sample;
}

// A wall far thinner than its nodes' spacing, or a surface without thickness: it may be seen along its normal.
bool thin_wall(const Weld& weld, Eigen::Index nodes) {
  const Solidity solidity = measure_solidity(weld.positions, weld.triangles);
  const double spacing = std::sqrt(solidity.area / static_cast<double>(nodes));
  return !solidity.closed || 2.0 * std::abs(solidity.volume) < 0.3 * spacing * solidity.area;
}

}  // namespace

Partition make_tried_partition(const Weld& weld, const Graph& graph, const Points& nodes, const PartitionOptions& given) {
  PartitionMaker maker(weld, graph, nodes);
  // On a large mesh some of its faces decide; the map of all of them is made once.
  const Sample sample = sample_faces(weld);
  const bool sampled = !sample.vertices.empty();
  const auto wrong = [&](const Partition& p) {
    const TrialError e = trial_error(sampled ? sample.weld : weld, nodes, Lift(p.lift), p.weights);
    return e.displacement + e.normals;
  };
  PartitionOptions options = given;
  // One patch of all nodes is the plain kernel, for comparison.
  if (given.patch_nodes > 0 && weld.triangles.rows() > 0 && !maker.in_wall(given) && thin_wall(weld, nodes.rows())) {
    options.sheets = true;
    const Partition walls = maker.make(options, sample.vertices);
    options.sheets = walls.sheets > 0 && wrong(walls) < wrong(maker.make(given, sample.vertices));
  }
  Partition best = maker.make(options, sample.vertices), whole;
  if (sampled && best.repaired == 0) {
    whole = maker.make(options);
    if (whole.repaired == 0) return whole;
    best = maker.make(options, sample.vertices, whole.repairs);
  }
  if (best.repaired == 0 || weld.triangles.rows() == 0) return best;
  double least = wrong(best);
  PartitionOptions chosen = options;
  // Errors of the nodes may grow five times as much as the limit for the sake of a shape that is right.
  constexpr double looser = 5.0;
  for (const auto& [larger, limit] : {std::pair(2, 1.0), std::pair(1, looser), std::pair(2, looser)}) {
    PartitionOptions how = options;
    how.patch_nodes *= larger;
    how.lebesgue_limit *= limit;
    Partition other = maker.make(how, sample.vertices);
    if (!(other.lebesgue <= std::max(best.lebesgue, looser * options.lebesgue_limit))) continue;
    if (const double own = wrong(other); own < 0.9 * least) {
      least = own;
      best = std::move(other);
      chosen = how;
    }
  }
  if (!sampled) return best;
  const bool first = chosen.patch_nodes == options.patch_nodes && chosen.lebesgue_limit == options.lebesgue_limit;
  return first && whole.patches > 0 ? std::move(whole) : maker.make(chosen, {}, best.repairs);
}

}  // namespace flexframe::interp
