// Where leaving nodes out cannot rank the kernel and the elastic surface, the map is a blend of both.
#include "interp/error_bar.h"
#include "interp/known.h"
#include "interp/map.h"
#include "interp/rotation.h"
#include "interp_bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace flexframe::test_blend {
namespace {

using namespace interp;
using namespace test;

const Points none(0, 3);

// Vertices of the con rod, 20 and 40 of them in a cluster, as `tests/bench/interp/measures.py --unseen 200` draws them: the elastic surface
// alone was 1.10, 1.15 and 1.05 times as wrong as one global kernel.
const std::vector<std::vector<int>> clusters = {
    {98, 141, 172, 466, 743, 757, 781, 931, 1202, 1328, 1437, 1475, 1635, 1654, 1675, 1942, 2496, 2567, 2851, 2943},
    {335, 646, 694, 735, 1142, 1528, 1723, 1806, 1861, 2162, 2201, 2314, 2326, 2339, 2485, 2674, 3026, 3142, 3305, 3357},
    {156,  291,  309,  416,  482,  485,  760,  805,  876,  908,  1142, 1152, 1206, 1207, 1226, 1296, 1490, 1591, 1633, 1706,
     1735, 1845, 1858, 1923, 1929, 1945, 1960, 2248, 2284, 2297, 2430, 2432, 2553, 2556, 2628, 2644, 2677, 2822, 2844, 2985}};

Map map_of(const ConRod& rod, const std::vector<int>& pick, Scheme scheme) {
  const auto count = static_cast<int>(pick.size());
  NodeMotions known;
  known.displacement.resize(3 * count, static_cast<Eigen::Index>(rod.mode.size()));
  for (size_t k = 0; k < rod.mode.size(); ++k)
    known.displacement.col(static_cast<Eigen::Index>(k)) = rows_at(rod.mode[k], pick, count).reshaped<Eigen::RowMajor>();
  Options options;
  options.scheme = scheme;
  options.precise = true;
  return make_map_for(nodes_at(rod.body.v, pick, count), rod.body.view(), options, known);
}

// Root mean square over the modes of the relative L2 error, and the largest miss at a node relative to the mode's largest displacement.
struct Wrong {
  double relative = 0.0, at_node = 0.0;
};
Wrong wrong(const ConRod& rod, const std::vector<int>& pick, const Map& map) {
  Wrong out;
  const auto count = static_cast<int>(pick.size());
  for (const Points& mode : rod.mode) {
    const Points miss = apply_linear(map, rows_at(mode, pick, count), none) - mode;
    out.relative += miss.squaredNorm() / mode.squaredNorm() / static_cast<double>(rod.mode.size());
    for (const int v : pick) out.at_node = std::max(out.at_node, miss.row(v).norm() / mode.rowwise().norm().maxCoeff());
  }
  out.relative = std::sqrt(out.relative);
  return out;
}

TEST(InterpBlend, NotWorseThanThePlainKernel) {
  const ConRod rod = read_conrod();
  for (const std::vector<int>& pick : clusters) {
    const Map map = map_of(rod, pick, Scheme::automatic);
    const Wrong own = wrong(rod, pick, map), plain = wrong(rod, pick, map_of(rod, pick, Scheme::r3));
    EXPECT_LE(own.relative, plain.relative) << map.report.reason;
    EXPECT_LE(own.at_node, 1e-6) << map.report.reason;
    EXPECT_NE(map.report.reason.find("50 % "), std::string::npos) << map.report.reason;
  }
}

// Both parts turn exactly, so their blend does; and what it tells of its error is that of the blend.
TEST(InterpBlend, TurnsExactlyAndTellsItsError) {
  const ConRod rod = read_conrod();
  const std::vector<int>& pick = clusters[1];
  const auto count = static_cast<int>(pick.size());
  const Map map = map_of(rod, pick, Scheme::automatic);
  ASSERT_TRUE(std::holds_alternative<BlendLift>(map.lift));
  const Mat3 turn = rotation_matrix(Vec3(1.1, -0.7, 0.4)) - Mat3::Identity();
  const Points all = (rod.body.v * turn.transpose()).rowwise() + Vec3(0.3, 0.1, -0.2).transpose();
  EXPECT_LT((apply_precise(map, rows_at(all, pick, count), none) - all).cwiseAbs().maxCoeff(), 1e-9 * all.cwiseAbs().maxCoeff());
  // Leaving nodes out sees nothing of a turn either.
  EXPECT_LT(leave_one_out(map, rows_at(all, pick, count), none).maximum, 1e-9 * all.cwiseAbs().maxCoeff());
  const MeanError mean(map, rod.body.view());
  ASSERT_TRUE(mean.known());
  const Points u = 1e-6 * rows_at(rod.mode[0], pick, count);
  const auto vertices = static_cast<double>(rod.mode[0].rows());
  const double told = mean.evaluate(map, u, none), deflection = 1e-6 * std::sqrt(rod.mode[0].squaredNorm() / vertices);
  const double truth = (apply_linear(map, u, none) - 1e-6 * rod.mode[0]).norm() / std::sqrt(vertices);
  EXPECT_GT(told, truth) << told / deflection;
}

}  // namespace
}  // namespace flexframe::test_blend
