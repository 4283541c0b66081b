// Nodes on the axis of a beam: accuracy, smoothness, sections, large rotations.
#include "interp/map.h"
#include "interp/rotation.h"
#include "interp_bodies.h"

#include <gtest/gtest.h>

namespace flexframe::test_beam {
namespace {

using namespace interp;
using namespace test;

struct BeamData {
  Nodes nodes;
  Points u, theta;
};

// count nodes on the axis of a bar of length 1 in cantilever mode `mode`, bending in the xz plane.
BeamData beam_mode(int count, int mode, bool rotations) {
  const Cantilever bend(mode);
  BeamData d;
  d.nodes.rotations = rotations;
  d.nodes.positions = Points::Zero(count, 3);
  d.u = Points::Zero(count, 3);
  d.theta = Points::Zero(rotations ? count : 0, 3);
  for (int i = 0; i < count; ++i) {
    const double x = static_cast<double>(i) / (count - 1);
    d.nodes.positions(i, 0) = x;
    d.u(i, 2) = bend.value(x);
    if (rotations) d.theta(i, 1) = -bend.slope(x);
  }
  return d;
}

double beam_error(int count, int mode, bool rotations) {
  const Body bar = make_bar(1.0, 0.025, 201, 16);
  const BeamData d = beam_mode(count, mode, rotations);
  Options options;
  options.precise = true;
  const Map map = make_map(d.nodes, bar.view(), options);
  EXPECT_EQ(map.report.layout, "axis");
  const Points got = apply_linear(map, d.u, d.theta);
  const Cantilever bend(mode);
  double error2 = 0.0, truth2 = 0.0;
  for (Eigen::Index v = 0; v < bar.v.rows(); ++v) {
    const Vec3 truth(-bar.v(v, 2) * bend.slope(bar.v(v, 0)), 0.0, bend.value(bar.v(v, 0)));
    error2 += (got.row(v).transpose() - truth).squaredNorm();
    truth2 += truth.squaredNorm();
  }
  return std::sqrt(error2 / truth2);
}

TEST(InterpBeam, TwentyAxisNodes) {
  for (const int mode : {1, 2, 3}) {
    EXPECT_LE(beam_error(20, mode, true), 0.01) << "mode " << mode;
    EXPECT_LE(beam_error(20, mode, false), 0.01) << "mode " << mode << ", estimated rotations";
  }
}

TEST(InterpBeam, TenAxisNodesWithRotations) {
  for (const int mode : {1, 2, 3}) EXPECT_LE(beam_error(10, mode, true), 0.01) << "mode " << mode;
}

TEST(InterpBeam, FourthOrder) {
  EXPECT_GE(std::log2(beam_error(6, 2, true) / beam_error(11, 2, true)), 3.5);
  EXPECT_GE(std::log2(beam_error(11, 2, false) / beam_error(21, 2, false)), 3.0);
}

// Ten volumes rolled up to a full circle: a node between two of them every 36 degrees.
TEST(InterpBeam, RollUp) {
  const double radius = 0.02, ring = 0.5 / std::numbers::pi;
  const Body bar = make_bar(1.0, radius, 401, 12);
  const int count = 11;
  Nodes nodes;
  nodes.rotations = true;
  nodes.positions = Points::Zero(count, 3);
  Points u(count, 3), theta = Points::Zero(count, 3);
  for (int i = 0; i < count; ++i) {
    const double x = 0.1 * i, a = 2.0 * std::numbers::pi * x;
    nodes.positions(i, 0) = x;
    u.row(i) << ring * std::sin(a) - x, 0.0, ring * (1.0 - std::cos(a));
    // A rotation vector may come as its short form beyond half a turn.
    theta(i, 1) = -(i % 2 == 0 ? a : std::remainder(a, 2.0 * std::numbers::pi));
  }
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, bar.view(), options);
  const Points got = bar.v + apply_precise(map, u, theta);
  double worst = 0.0, kink = 0.0;
  for (Eigen::Index v = 0; v < 401 * 12; ++v) {
    const double a = 2.0 * std::numbers::pi * bar.v(v, 0), r = ring - bar.v(v, 2);
    worst = std::max(worst, (got.row(v) - Eigen::RowVector3d(r * std::sin(a), bar.v(v, 1), ring - r * std::cos(a))).norm());
    // Turn of each generator between neighbouring pieces: even, no kink at a node.
    const Eigen::Index i = v / 12;
    if (i == 0 || i == 400) continue;
    const Vec3 before = (got.row(v) - got.row(v - 12)).transpose(), after = (got.row(v + 12) - got.row(v)).transpose();
    kink = std::max(kink, std::atan2(before.cross(after).norm(), before.dot(after)));
  }
  EXPECT_LE(worst, 0.002 * radius + 2e-4 * ring);
  EXPECT_LE(kink, 1.25 * 2.0 * std::numbers::pi / 400.0);
}

TEST(InterpBeam, TorsionIsSmoothAndSectionsKeepTheirSize) {
  const Body bar = make_bar(1.0, 0.05, 201, 12);
  Nodes nodes;
  nodes.rotations = true;
  nodes.positions = Points::Zero(6, 3);
  Points theta = Points::Zero(6, 3);
  for (int i = 0; i < 6; ++i) {
    nodes.positions(i, 0) = 0.2 * i;
    theta(i, 0) = 1.5 * std::sin(0.5 * std::numbers::pi * 0.2 * i);
  }
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, bar.view(), options);
  const Points got = bar.v + apply_precise(map, Points::Zero(6, 3), theta);
  for (Eigen::Index v = 0; v < 201 * 12; ++v) {
    EXPECT_NEAR(std::hypot(got(v, 1), got(v, 2)), 0.05, 1e-5);
    const double twist = std::remainder(std::atan2(got(v, 2), got(v, 1)) - std::atan2(bar.v(v, 2), bar.v(v, 1)), 2.0 * std::numbers::pi);
    EXPECT_NEAR(twist, 1.5 * std::sin(0.5 * std::numbers::pi * bar.v(v, 0)), 2e-3);
  }
}

// The nodes of a run turn for good although a beam without stiffening moves them along straight lines, as a mode shape does.
TEST(InterpBeam, SectionsOfARunKeepTheirSize) {
  const Body bar = make_bar(1.0, 0.05, 101, 12);
  Nodes nodes;
  nodes.rotations = nodes.finite = true;
  nodes.positions = Points::Zero(6, 3);
  Points u = Points::Zero(6, 3), theta = u;
  for (int i = 0; i < 6; ++i) {
    const double x = 0.2 * i;
    nodes.positions(i, 0) = x;
    u(i, 1) = 0.02 * x * x;
    theta.row(i) << 0.4 * x, 0.0, 0.04 * x;
  }
  Options options;
  options.precise = true;
  const Points got = bar.v + apply_precise(make_map(nodes, bar.view(), options), u, theta);
  const auto tip = got.middleRows(Eigen::Index{100} * 12, 12);
  const Eigen::RowVector3d centre = tip.colwise().mean();
  for (Eigen::Index v = 0; v < 12; ++v) EXPECT_NEAR((tip.row(v) - centre).norm(), 0.05, 1e-6);
}

// The modal path is the first order of the exact one.
TEST(InterpBeam, LinearIsTheLimitOfExact) {
  const Body bar = make_bar(1.0, 0.03, 51, 8);
  for (const bool rotations : {true, false}) {
    BeamData d = beam_mode(7, 2, rotations);
    for (int i = 0; i < 7; ++i) {
      d.u(i, 0) = 0.3 * std::pow(i / 6.0, 2);
      if (rotations) d.theta(i, 0) = 0.4 * std::sin(i / 3.0);
    }
    Options options;
    options.precise = true;
    const Map map = make_map(d.nodes, bar.view(), options);
    const double small = 1e-7;
    const Points linear = apply_linear(map, d.u, d.theta);
    const auto& axis = std::get<AxisLift>(map.lift);
    const Points exact = lift_exact(axis, small * d.u, small * d.theta), first = lift_linear(axis, small * d.u, small * d.theta);
    EXPECT_LE((exact - first).cwiseAbs().maxCoeff(), 1e-4 * small);
    EXPECT_LE((linear - apply_linear(map, 2.0 * d.u, 2.0 * d.theta) / 2.0).cwiseAbs().maxCoeff(), 1e-12);
  }
}

// A console of three heights under forces at its tip that bend it both ways, its section's axes turned, by Timoshenko's equations: places
// and turns of any point, not of the nodes only.
TEST(InterpBeam, SectionsOfShearedBeamsStandAslant) {
  const Body bar = make_bar(1.0, 0.15, 41, 12);
  // E I and k G A of a section, P on the tip; curvature E I w'' = P (1 - x), shear k G A g = P.
  Eigen::Matrix2d ei, kga;
  ei << 2.0, 0.6, 0.6, 3.0;
  kga << 40.0, 0.0, 0.0, 25.0;
  const Eigen::Vector2d force(1e-4, -2e-4);
  const Eigen::Vector2d bent = ei.inverse() * force, shear = kga.inverse() * force;
  const auto slope = [&](double x) { return Eigen::Vector2d(bent * (x - 0.5 * x * x)); };
  const auto axis = [&](double x) { return Eigen::Vector2d(bent * (0.5 * x * x - x * x * x / 6.0) + shear * x); };
  const std::vector<double> at{0.0, 0.17, 0.5, 0.77, 1.0};
  const auto n = static_cast<Eigen::Index>(at.size());
  Nodes nodes;
  nodes.rotations = nodes.finite = true;
  nodes.positions = Points::Zero(n, 3);
  Points u = Points::Zero(n, 3), theta = u;
  Mat3 length2 = Mat3::Zero();
  length2.bottomRightCorner<2, 2>() = kga.inverse() * ei;
  for (Eigen::Index i = 0; i < n; ++i) {
    nodes.positions(i, 0) = at[i];
    u.row(i).tail<2>() = axis(at[i]).transpose();
    theta.row(i) << 0.0, -slope(at[i])[1], slope(at[i])[0];
    nodes.shear.push_back(length2);
  }
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, bar.view(), options);
  const Points linear = apply_linear(map, u, theta), exact = apply_precise(map, u, theta);
  nodes.shear.clear();
  const Points square = apply_linear(make_map(nodes, bar.view(), options), u, theta);
  double worst = 0.0, apart = 0.0, without = 0.0;
  for (Eigen::Index v = 0; v < bar.v.rows(); ++v) {
    const double x = bar.v(v, 0);
    const Eigen::RowVector3d truth(-bar.v.row(v).tail<2>().dot(slope(x).transpose()), axis(x)[0], axis(x)[1]);
    worst = std::max(worst, (linear.row(v) - truth).norm());
    apart = std::max(apart, (exact.row(v) - linear.row(v)).norm());
    without = std::max(without, (square.row(v) - truth).norm());
  }
  // Between stations slopes are those of parabolas: exact here.
  EXPECT_LE(worst, 1e-12);
  EXPECT_LE(apart, 2.0 * u.squaredNorm());
  EXPECT_GE(without, 0.1 * 0.15 * shear.norm());
}

// Where the shear jumps at a node (a force between two elements), sections keep their turn and the axis bends within an eighth of an
// interval.
TEST(InterpBeam, ShearJumpsAtAForce) {
  const Body bar = make_bar(1.0, 0.1, 81, 8);
  // Held at its root, P = 1e-4 at the middle: the second half is straight and not sheared.
  const double ei = 1.0, kga = 30.0, force = 1e-4;
  const auto slope = [&](double x) { return force / ei * (x < 0.5 ? 0.5 * x - 0.5 * x * x : 0.125); };
  const auto axis = [&](double x) {
    return x < 0.5 ? force / ei * (0.25 * x * x - x * x * x / 6.0) + force / kga * x
                   : force / ei * (0.25 * 0.25 - 0.125 / 6.0 + 0.125 * (x - 0.5)) + force / kga * 0.5;
  };
  Nodes nodes;
  nodes.rotations = nodes.finite = true;
  nodes.positions = Points::Zero(5, 3);
  Points u = Points::Zero(5, 3), theta = u;
  for (int i = 0; i < 5; ++i) {
    const double x = 0.25 * i;
    nodes.positions(i, 0) = x;
    u(i, 1) = axis(x);
    theta(i, 2) = slope(x);
    nodes.shear.emplace_back(Vec3(0.0, ei / kga, ei / kga).asDiagonal());
  }
  Options options;
  options.precise = true;
  const Points got = apply_precise(make_map(nodes, bar.view(), options), u, theta);
  double along = 0.0, across = 0.0;
  for (Eigen::Index v = 0; v < bar.v.rows(); ++v) {
    const double x = bar.v(v, 0);
    along = std::max(along, std::abs(got(v, 0) + bar.v(v, 1) * slope(x)));
    across = std::max(across, std::abs(got(v, 1) - axis(x)));
  }
  const double jump = force / kga;
  EXPECT_LE(along, 0.05 * 0.1 * jump);
  EXPECT_LE(across, 0.5 * jump * 0.25 / 8.0 * 4.0 / 27.0 * 1.05);
}

TEST(InterpBeam, TorsionWithoutRotationsWarns) {
  const BeamData d = beam_mode(5, 1, false);
  const Map map = make_map(d.nodes, make_bar(1.0, 0.02, 21, 8).view());
  ASSERT_FALSE(map.report.warnings.empty());
  EXPECT_NE(map.report.warnings.front().find("torsion"), std::string::npos);
}

// Mid-surface nodes of a thick plate: sections turn with the surface.
TEST(InterpBeam, ThickPlateMidSurface) {
  const Body plate = make_blocks(lines(0.0, 1.0, 20), lines(0.0, 0.8, 16), lines(-0.025, 0.025, 1), [](int, int, int) { return true; });
  Nodes nodes;
  nodes.positions.resize(9 * 7, 3);
  Points u(63, 3), theta(63, 3);
  auto w = [](double x, double y) { return std::sin(2.0 * x) * std::cos(1.5 * y); };
  auto wx = [](double x, double y) { return 2.0 * std::cos(2.0 * x) * std::cos(1.5 * y); };
  auto wy = [](double x, double y) { return -1.5 * std::sin(2.0 * x) * std::sin(1.5 * y); };
  for (int j = 0; j < 7; ++j)
    for (int i = 0; i < 9; ++i) {
      const double x = i / 8.0, y = 0.8 * j / 6.0;
      nodes.positions.row(i + 9 * j) << x, y, 0.0;
      u.row(i + 9 * j) << 0.0, 0.0, w(x, y);
      theta.row(i + 9 * j) << wy(x, y), -wx(x, y), 0.0;
    }
  for (const bool given : {true, false}) {
    nodes.rotations = given;
    Options options;
    options.precise = true;
    options.scheme = Scheme::kernel;
    const Points got = apply_linear(make_map(nodes, plate.view(), options), u, given ? theta : Points(0, 3));
    double error2 = 0.0, truth2 = 0.0;
    for (Eigen::Index v = 0; v < plate.v.rows(); ++v) {
      const double x = plate.v(v, 0), y = plate.v(v, 1), z = plate.v(v, 2);
      const Vec3 truth(-z * wx(x, y), -z * wy(x, y), w(x, y));
      error2 += (got.row(v).transpose() - truth).squaredNorm();
      truth2 += truth.squaredNorm();
    }
    EXPECT_LE(std::sqrt(error2 / truth2), 0.01) << (given ? "given" : "estimated");
  }
}

}  // namespace
}  // namespace flexframe::test_beam
