// Meshes on the surface of finite elements: the elements' own motion at every point of a face, rigid motion beside it, error bars.
#include "interp/error_bar.h"
#include "interp/faces.h"
#include "interp/modes.h"
#include "interp/residuals.h"
#include "interp_bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace flexframe::test_faces {
namespace {

using namespace interp;
using namespace test;

// A bent sheet of n x n faces with 3, 4, 6 or 8 points each over the unit square, z = 0.2 x^2 + 0.1 x y: quadratic faces are exact.
double height(double x, double y) { return 0.2 * x * x + 0.1 * x * y; }

FaceMesh bent_sheet(int n, int points) {
  FaceMesh mesh;
  const int side = 2 * n + 1;
  mesh.points.resize(side * side, 3);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const double x = 0.5 * i / n, y = 0.5 * j / n;
      mesh.points.row(i + side * j) << x, y, height(x, y);
    }
  const bool triangles = points % 3 == 0;
  mesh.faces = decltype(mesh.faces)::Constant(triangles ? 2 * n * n : n * n, 8, -1);
  int f = 0;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto at = [&](int a, int b) { return 2 * i + a + side * (2 * j + b); };
      const std::vector<int> all = triangles
                                       ? std::vector<int>{at(0, 0), at(2, 0), at(2, 2), at(1, 0), at(2, 1), at(1, 1)}
                                       : std::vector<int>{at(0, 0), at(2, 0), at(2, 2), at(0, 2), at(1, 0), at(2, 1), at(1, 2), at(0, 1)};
      for (int k = 0; k < points; ++k) mesh.faces(f, k) = all[static_cast<size_t>(k)];
      ++f;
      if (!triangles) continue;
      const std::vector<int> other{at(0, 0), at(2, 2), at(0, 2), at(1, 1), at(1, 2), at(0, 1)};
      for (int k = 0; k < points; ++k) mesh.faces(f, k) = other[static_cast<size_t>(k)];
      ++f;
    }
  return mesh;
}

Eigen::MatrixXd motion_of(const Points& x, const std::function<Vec3(const Vec3&)>& motion) {
  Eigen::MatrixXd u(3 * x.rows(), 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) u.col(0).segment<3>(3 * i) = motion(x.row(i).transpose());
  return u;
}

double largest_miss(const ModeColumns& found, const Eigen::MatrixXd& wanted) {
  double worst = 0.0;
  for (Eigen::Index i = 0; i < wanted.rows(); ++i) worst = std::max(worst, std::abs(static_cast<double>(found(i, 0)) - wanted(i, 0)));
  return worst;
}

// Fields that a face's shape functions hold are exact anywhere on it: linear ones of three points, quadratic ones in x and y of six and
// eight. The vertices lie at random on the bent surface, which six and eight points follow exactly.
TEST(InterpFaces, FollowTheShapeFunctions) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  Points x(500, 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double a = u(random), b = u(random);
    x.row(i) << a, b, height(a, b);
  }
  const auto quadratic = [](const Vec3& p) {
    return Vec3(p.x() * p.x() - p.y(), 0.5 * p.x() * p.y() + p.x(), p.y() * p.y() - 0.3 * p.x());
  };
  for (const int points : {6, 8}) {
    const FaceMesh mesh = bent_sheet(3, points);
    const std::vector<FaceFoot> feet = find_feet(mesh, x, 2);
    EXPECT_LT(measure_gap(feet).largest, 1e-12) << points;
    const ModeColumns found = map_displacement(mesh, feet, motion_of(mesh.points, quadratic));
    EXPECT_LT(largest_miss(found, motion_of(x, quadratic)), 1e-6) << points;  // single precision
    const Eigen::MatrixXd field = motion_of(mesh.points, quadratic);
    EXPECT_LT(largest_miss(map_field(feet, 3, field), motion_of(x, quadratic)), 1e-6) << points;
    EXPECT_LT(largest_miss(map_doubt(mesh, feet, field), Eigen::MatrixXd::Zero(3 * x.rows(), 1)), 1e-12) << points;
  }
  // On the nodes themselves every face gives their own motion.
  for (const int points : {3, 4, 6, 8}) {
    const FaceMesh mesh = bent_sheet(2, points);
    Points nodes(0, 3);
    for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
      for (int k = 0; k < points; ++k) {
        nodes.conservativeResize(nodes.rows() + 1, 3);
        nodes.bottomRows(1) = mesh.points.row(mesh.faces(f, k));
      }
    const std::vector<FaceFoot> feet = find_feet(mesh, nodes);
    EXPECT_LT(measure_gap(feet).largest, 1e-15) << points;
    EXPECT_LT(largest_miss(map_displacement(mesh, feet, motion_of(mesh.points, quadratic)), motion_of(nodes, quadratic)), 1e-7) << points;
  }
}

// Beside the surface, above faces, off edges and corners: rigid motion is exact, and a bent plate's points follow its normals.
TEST(InterpFaces, CarryWhatLiesBeside) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-0.2, 1.2), h(-0.1, 0.1);
  Points x(500, 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) << u(random), u(random), h(random);
  const Vec3 turn(0.3, -0.2, 0.5), shift(0.1, 0.2, -0.3);
  const auto rigid = [&](const Vec3& p) { return Vec3(shift + turn.cross(p)); };
  for (const int points : {3, 4, 6, 8}) {
    const FaceMesh mesh = bent_sheet(3, points);
    const ModeColumns found = map_displacement(mesh, find_feet(mesh, x), motion_of(mesh.points, rigid));
    EXPECT_LT(largest_miss(found, motion_of(x, rigid)), 2e-7) << points;
  }
  // Kirchhoff: w = x^2 + x y on a flat sheet, u = -z (w_x, w_y).
  FaceMesh flat = bent_sheet(3, 8);
  flat.points.col(2).setZero();
  const auto plate = [](const Vec3& p) { return Vec3(-p.z() * (2.0 * p.x() + p.y()), -p.z() * p.x(), p.x() * p.x() + p.x() * p.y()); };
  for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i).head<2>() = x.row(i).head<2>().cwiseMax(0.0).cwiseMin(1.0);
  const std::vector<FaceFoot> feet = find_feet(flat, x);
  EXPECT_LT(largest_miss(map_displacement(flat, feet, motion_of(flat.points, plate)), motion_of(x, plate)), 1e-6);
  // The doubt of an arm is its length times the strain of the face: here of a stretch by 1.
  const Eigen::MatrixXd stretch = motion_of(flat.points, [](const Vec3& p) { return Vec3(p.x(), 0.0, 0.0); });
  const ModeColumns doubt = map_doubt(flat, feet, stretch);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const Vec3 d(static_cast<double>(doubt(3 * i, 0)), static_cast<double>(doubt(3 * i + 1, 0)), static_cast<double>(doubt(3 * i + 2, 0)));
    EXPECT_NEAR(d.norm(), std::abs(x(i, 2)), 1e-6);
  }
}

TEST(InterpFaces, RefuseWhatIsNoSurface) {
  FaceMesh mesh = bent_sheet(1, 4);
  Points x = Points::Zero(1, 3);
  mesh.faces(0, 1) = 99;
  EXPECT_THROW(find_feet(mesh, x), InputError);
  mesh.faces.row(0).setConstant(-1);
  EXPECT_THROW(find_feet(mesh, x), InputError);
  mesh.faces.resize(0, 8);
  EXPECT_THROW(find_feet(mesh, x), InputError);
}

// The error bar against the error itself, on a plate with a wave and nodes scattered in it: nothing at the nodes, nothing for motions that
// the map knows, and of the size of the error elsewhere.
TEST(InterpErrorBar, IsOfTheSizeOfTheError) {
  const Body plate = make_sheet(1.0, 0.8, 61, 49);
  const auto wave = [](const Vec3& p) { return Vec3(0.0, 0.0, 0.1 * std::sin(7.0 * p.x()) * std::cos(5.0 * p.y())); };
  for (const int count : {30, 60, 120}) {
    const std::vector<int> pick = farthest_points(plate.v, count);
    const Nodes nodes = nodes_at(plate.v, pick, count);
    Options options;
    options.precise = true;
    const Map map = make_map(nodes, plate.view(), options);
    const ErrorBar bar(map, plate.view());
    ASSERT_TRUE(bar.known());
    const auto rows = [](const Points& x, const auto& motion) {
      Points u(x.rows(), 3);
      for (Eigen::Index i = 0; i < x.rows(); ++i) u.row(i) = motion(Vec3(x.row(i).transpose())).transpose();
      return u;
    };
    const Points none(0, 3), u = rows(nodes.positions, wave), wrong = apply_precise(map, u, none) - rows(plate.v, wave);
    std::vector<float> told(static_cast<size_t>(plate.v.rows()));
    bar.evaluate(map, u, none, told);
    double bars = 0.0, errors = 0.0;
    int above = 0;
    for (Eigen::Index v = 0; v < plate.v.rows(); ++v) {
      const auto e = static_cast<double>(told[static_cast<size_t>(v)]);
      bars += e * e;
      errors += wrong.row(v).squaredNorm();
      above += wrong.row(v).norm() <= e + 1e-9;
    }
    EXPECT_GT(std::sqrt(bars / errors), 0.7) << count;
    EXPECT_LT(std::sqrt(bars / errors), 8.0) << count;
    EXPECT_GT(above, plate.v.rows() * 7 / 10) << count;
    for (const int node : pick) EXPECT_LT(told[static_cast<size_t>(node)], 1e-6f);
    const auto rigid = [](const Vec3& p) { return Vec3(Vec3(0.1, 0.0, 0.2) + Vec3(0.0, 0.3, 0.1).cross(p)); };
    bar.evaluate(map, rows(nodes.positions, rigid), none, told);
    for (const float e : told) EXPECT_LT(e, 1e-6f);
  }
}

// Few nodes scattered at random tell little of the error, some by luck less than it is: nine in ten sets tell at least as much.
TEST(InterpErrorBar, OfFewNodesIsRaised) {
  const Body plate = make_sheet(1.0, 0.8, 31, 25);
  std::mt19937 random(5);
  Options options;
  options.precise = true;
  int below = 0, sets = 0;
  for (int set = 0; set < 100; ++set) {
    std::vector<int> pick;
    while (pick.size() < 14)
      if (const int v = static_cast<int>(random() % static_cast<unsigned>(plate.v.rows()));
          std::find(pick.begin(), pick.end(), v) == pick.end())
        pick.push_back(v);
    std::sort(pick.begin(), pick.end());
    const double a = 3.0 + 0.02 * static_cast<double>(random() % 100), b = 2.0 + 0.02 * static_cast<double>(random() % 100);
    const auto wave = [&](const Points& x) {
      Points u = Points::Zero(x.rows(), 3);
      for (Eigen::Index i = 0; i < x.rows(); ++i) u(i, 2) = 0.1 * std::sin(a * x(i, 0)) * std::cos(b * x(i, 1));
      return u;
    };
    const Nodes nodes = nodes_at(plate.v, pick, static_cast<int>(pick.size()));
    const Map map = make_map(nodes, plate.view(), options);
    const ErrorBar bar(map, plate.view());
    if (!bar.known() || !map.report.warnings.empty()) continue;
    const Points none(0, 3), wrong = apply_precise(map, wave(nodes.positions), none) - wave(plate.v);
    std::vector<float> told(static_cast<size_t>(plate.v.rows()));
    bar.evaluate(map, wave(nodes.positions), none, told);
    double bars = 0.0;
    for (const float e : told) bars += static_cast<double>(e) * static_cast<double>(e);
    ++sets;
    below += bars < wrong.squaredNorm() ? 1 : 0;
  }
  EXPECT_GE(sets, 20);
  EXPECT_LE(10 * below, sets) << below << " of " << sets;
}

// A node left out of an elastic surface (a lattice has the same equations): what the map of the other nodes, made without it, does there.
TEST(InterpErrorBar, LeavesOutWhatAnotherMapHasNot) {
  const Body plate = make_blocks(lines(0.0, 1.0, 10), lines(0.0, 0.6, 6), {0.0, 0.05}, [](int, int, int) { return true; });
  const std::vector<int> pick = farthest_points(plate.v, 14);
  const auto wave = [](const Vec3& p) { return Vec3(0.01 * p.y() * p.x(), 0.0, 0.1 * std::sin(4.0 * p.x()) * std::cos(3.0 * p.y())); };
  Options options;
  options.precise = true;
  options.scheme = Scheme::elastic;
  const Nodes nodes = nodes_at(plate.v, pick, 14);
  Points u(14, 3);
  for (int i = 0; i < 14; ++i) u.row(i) = 1e-3 * wave(nodes.positions.row(i).transpose()).transpose();
  const Points none(0, 3);
  const Map map = make_map(nodes, plate.view(), options);
  const Points missed = node_residuals(map, u, none);
  for (int left = 0; left < 14; left += 5) {
    std::vector<int> others = pick;
    others.erase(others.begin() + left);
    Points moved(13, 3);
    for (int i = 0; i < 13; ++i) moved.row(i) = u.row(i < left ? i : i + 1);
    const Map without = make_map(nodes_at(plate.v, others, 13), plate.view(), options);
    const Vec3 predicted = apply_linear(without, moved, none).row(pick[left]).transpose(), known = u.row(left).transpose();
    const Vec3 found = missed.row(map.node_of[left]).transpose();
    // Signs differ by what is called the miss; the trace that keeps loose vertices and rigid motion's mending are the tolerance.
    EXPECT_NEAR(found.norm(), (predicted - known).norm(), 0.01 * (predicted - known).norm()) << left;
  }
}

// The mean of the body is that of its vertices; a body's coordinates have the same by their tables.
TEST(InterpErrorBar, OfTheWholeBody) {
  const Body plate = make_sheet(1.0, 0.8, 41, 33);
  const Nodes nodes = nodes_at(plate.v, farthest_points(plate.v, 40), 40);
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, plate.view(), options);
  const MeanError mean(map, plate.view());
  ASSERT_TRUE(mean.known());
  Points u(40, 3);
  Eigen::MatrixXd phi(120, 1);
  for (int i = 0; i < 40; ++i) {
    u.row(i) << 0.0, 0.0, 1e-3 * std::sin(7.0 * nodes.positions(i, 0));
    phi.block<3, 1>(3 * i, 0) = u.row(i).transpose();
  }
  const Points none(0, 3);
  std::vector<float> bars(static_cast<size_t>(plate.v.rows()));
  ErrorBar(map, plate.view()).evaluate(map, u, none, bars);
  double square = 0.0;
  for (const float e : bars) square += static_cast<double>(e) * static_cast<double>(e) / static_cast<double>(plate.v.rows());
  // An upper bound of it, hardly above.
  EXPECT_GE(mean.evaluate(map, u, none), 0.999 * std::sqrt(square));
  EXPECT_LE(mean.evaluate(map, u, none), 1.5 * std::sqrt(square));
  const ModeColumns columns = map_modes(map, phi, Eigen::MatrixXd());
  const ModeDoubt doubt = doubt_modes(map, plate.view(), phi, Eigen::MatrixXd(), columns);
  ASSERT_EQ(doubt.doubt.rows(), 1);
  EXPECT_NEAR(std::sqrt(doubt.doubt(0, 0)), mean.evaluate(map, u, none), 1e-6 * std::sqrt(doubt.doubt(0, 0)));
  const Points moved = apply_linear(map, u, none);
  EXPECT_NEAR(doubt.moved(0, 0), moved.squaredNorm() / static_cast<double>(moved.rows()), 1e-4 * doubt.moved(0, 0));
}

}  // namespace
}  // namespace flexframe::test_faces
