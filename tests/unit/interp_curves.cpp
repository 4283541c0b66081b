// Nodes with rotations along curved lines: closed forms of arcs, rings and helices, frames of bars, large rotations.
#include "interp/map.h"
#include "interp/rotation.h"
#include "interp_bodies.h"

#include <gtest/gtest.h>

#include <functional>

namespace flexframe::test_curves {
namespace {

using namespace interp;
using namespace test;

constexpr double pi = std::numbers::pi;

// A line with the motion of its sections, linear in the amplitude: parameter 0..1.
struct Line {
  std::function<Vec3(double)> centre, shift, turn;
};

// Round bar along the line, rings of 12 vertices; station of each vertex.
struct Bar {
  Body body;
  std::vector<double> s;
};
Bar make_curved_bar(const Line& line, double radius, int rings, bool closed) {
  constexpr int around = 12;
  std::vector<Vec3> v;
  std::vector<std::array<int, 3>> t;
  Bar bar;
  const int last = closed ? rings : rings - 1;
  for (int i = 0; i < rings; ++i) {
    const double s = static_cast<double>(i) / last;
    const Vec3 along = (line.centre(s + 1e-6) - line.centre(s - 1e-6)).normalized();
    const Vec3 side = along.cross(Vec3(0.1, 0.2, 0.97)).normalized(), other = along.cross(side);
    for (int k = 0; k < around; ++k) {
      const double a = 2.0 * pi * k / around;
      v.push_back(line.centre(s) + radius * (std::cos(a) * side + std::sin(a) * other));
      bar.s.push_back(s);
    }
  }
  for (int i = 0; i < last; ++i)
    for (int k = 0; k < around; ++k) {
      const int a = i * around + k, b = i * around + (k + 1) % around, c = (i + 1) % rings * around;
      t.push_back({a, c + k, c + (k + 1) % around});
      t.push_back({a, c + (k + 1) % around, b});
    }
  bar.body = make_body(v, t);
  return bar;
}

Nodes nodes_on(const Line& line, int count, bool closed) {
  Nodes nodes;
  nodes.rotations = true;
  nodes.positions.resize(count, 3);
  for (int i = 0; i < count; ++i) nodes.positions.row(i) = line.centre(static_cast<double>(i) / (closed ? count : count - 1)).transpose();
  return nodes;
}

double line_error(const Line& line, double radius, int count, bool closed) {
  const Bar bar = make_curved_bar(line, radius, 121, closed);
  const Nodes nodes = nodes_on(line, count, closed);
  Points u(count, 3), theta(count, 3);
  for (int i = 0; i < count; ++i) {
    const double s = static_cast<double>(i) / (closed ? count : count - 1);
    u.row(i) = line.shift(s).transpose();
    theta.row(i) = line.turn(s).transpose();
  }
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, bar.body.view(), options);
  EXPECT_EQ(map.report.layout, "curve");
  const Points got = apply_linear(map, u, theta);
  double error2 = 0.0, truth2 = 0.0;
  for (Eigen::Index v = 0; v < got.rows(); ++v) {
    const double s = bar.s[v];
    const Vec3 truth = line.shift(s) + line.turn(s).cross(Vec3(bar.body.v.row(v).transpose() - line.centre(s)));
    error2 += (got.row(v).transpose() - truth).squaredNorm();
    truth2 += truth.squaredNorm();
  }
  return std::sqrt(error2 / truth2);
}

Vec3 radial(double f) { return {std::cos(f), std::sin(f), 0.0}; }
Vec3 tangent(double f) { return {-std::sin(f), std::cos(f), 0.0}; }

// Ring of radius 1 in a mode of n waves (Love, A treatise on the mathematical theory of elasticity, 1927, art. 293): in its plane without
// stretch, across it with any twist. Eight nodes see two waves.
TEST(InterpCurves, RingBendsAndTwists) {
  const auto f = [](double s) { return 2.0 * pi * s; };
  Line plane, across, roll;
  plane.centre = across.centre = roll.centre = [&](double s) { return radial(f(s)); };
  plane.shift = [&](double s) { return Vec3(std::cos(2 * f(s)) * radial(f(s)) - 0.5 * std::sin(2 * f(s)) * tangent(f(s))); };
  plane.turn = [&](double s) { return Vec3(0.0, 0.0, 1.5 * std::sin(2 * f(s))); };
  across.shift = [&](double s) { return Vec3(0.0, 0.0, std::cos(2 * f(s))); };
  across.turn = [&](double s) { return Vec3(-2.0 * std::sin(2 * f(s)) * radial(f(s)) - 2.0 * std::cos(2 * f(s)) * tangent(f(s))); };
  roll.shift = [](double) { return Vec3(Vec3::Zero()); };
  roll.turn = [&](double s) { return tangent(f(s)); };
  for (const Line* line : {&plane, &across, &roll}) {
    EXPECT_LE(line_error(*line, 0.08, 8, true), 0.005);
    EXPECT_LE(line_error(*line, 0.08, 16, true), 0.0005);
  }
}

// Quarter of a circle held at one end, under a radial force at the other: angle (1 - cos f), displacement by u' = theta x c'.
TEST(InterpCurves, QuarterCircleUnderAForce) {
  const auto f = [](double s) { return 0.5 * pi * s; };
  Line arc;
  arc.centre = [&](double s) { return radial(f(s)); };
  arc.turn = [&](double s) { return Vec3(0.0, 0.0, 1.0 - std::cos(f(s))); };
  // Integral of (1 - cos f) e_z x tangent = -(1 - cos f) radial.
  arc.shift = [&](double s) {
    const double a = f(s);
    return Vec3(-std::sin(a) + 0.5 * a + 0.25 * std::sin(2 * a), std::cos(a) - 1.0 + 0.5 * std::sin(a) * std::sin(a), 0.0);
  };
  for (const int count : {6, 8, 12, 24}) EXPECT_LE(line_error(arc, 0.05, count, false), 0.005) << count;
  EXPECT_LE(line_error(arc, 0.05, 8, false), 0.0005);
}

// Turns of a helix that lie nearer to each other than its nodes: it is wound up about its own axis.
TEST(InterpCurves, HelixWithCloseTurns) {
  Line helix;
  helix.centre = [](double s) { return Vec3(std::cos(4 * pi * s), std::sin(4 * pi * s), 0.6 * s); };
  helix.turn = [](double s) { return Vec3(0.0, 0.0, s); };
  // Integral of s e_z x c': -s (cos, sin) k taken by parts, k = 4 pi.
  helix.shift = [](double s) {
    const double k = 4 * pi, a = k * s;
    return Vec3(-s * std::sin(a) + (1.0 - std::cos(a)) / k, s * std::cos(a) - std::sin(a) / k, 0.0);
  };
  EXPECT_LE(line_error(helix, 0.04, 24, false), 0.005);
}

// A finite rotation of all nodes comes out exactly, and a straight rod of two arms rolled round a corner keeps its joint.
TEST(InterpCurves, RigidMotionIsExact) {
  Line ring;
  ring.centre = [](double s) { return radial(2.0 * pi * s); };
  const Bar bar = make_curved_bar(ring, 0.1, 60, true);
  const Nodes nodes = nodes_on(ring, 7, true);
  const Vec3 axis = 2.5 * Vec3(0.3, -0.6, 0.74).normalized();
  const Mat3 turn = rotation_matrix(axis) - Mat3::Identity();
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, bar.body.view(), options);
  Points u = nodes.positions * turn.transpose(), theta(7, 3);
  u.rowwise() += Eigen::RowVector3d(0.5, -1.0, 2.0);
  theta.rowwise() = axis.transpose();
  const Points moved = apply_precise(map, u, theta);
  EXPECT_LE((moved - ((bar.body.v * turn.transpose()).rowwise() + Eigen::RowVector3d(0.5, -1.0, 2.0))).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(leave_one_out(map, u, theta).relative, 0.0);
}

// A quarter of a circle straightened: large rotations, the line keeps its length.
TEST(InterpCurves, ArcIsStraightened) {
  Line arc;
  arc.centre = [](double s) { return radial(0.5 * pi * s); };
  const Bar bar = make_curved_bar(arc, 0.05, 91, false);
  const Nodes nodes = nodes_on(arc, 9, false);
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, bar.body.view(), options);
  Points u(9, 3), theta = Points::Zero(9, 3);
  for (int i = 0; i < 9; ++i) {
    const double f = 0.5 * pi * i / 8.0;
    u.row(i) = Eigen::RowVector3d(1.0, f, 0.0) - nodes.positions.row(i);
    theta(i, 2) = -f;
  }
  const Points moved = bar.body.v + apply_precise(map, u, theta);
  double worst = 0.0;
  for (Eigen::Index v = 0; v < moved.rows(); ++v) {
    const double f = 0.5 * pi * bar.s[v];
    const Vec3 arm = rotation_matrix(Vec3(0.0, 0.0, -f)) * (Vec3(bar.body.v.row(v).transpose()) - radial(f));
    worst = std::max(worst, (moved.row(v).transpose() - Vec3(1.0, f, 0.0) - arm).norm());
  }
  EXPECT_LE(worst, 1e-4);
}

// A cross of four bars, each a mesh of its own, that turn with their joint; each end is bent by a force (cubic of a cantilever).
TEST(InterpCurves, FrameOfBars) {
  std::vector<Vec3> v, truth;
  std::vector<std::array<int, 3>> t;
  Nodes nodes;
  nodes.rotations = true;
  nodes.positions.resize(13, 3);
  Points u = Points::Zero(13, 3), theta = Points::Zero(13, 3);
  nodes.positions.row(0).setZero();
  const auto deflection = [](double x) { return 0.5 * x * x - x * x * x / 6.0; };
  for (int arm = 0; arm < 4; ++arm) {
    const Vec3 along = radial(0.5 * pi * arm + 0.2), beside = tangent(0.5 * pi * arm + 0.2);
    const double force = arm + 1.0;
    for (int k = 0; k < 3; ++k) {
      const double x = (k + 1) / 3.0;
      const int i = 1 + 3 * arm + k;
      nodes.positions.row(i) = x * along.transpose();
      u(i, 2) = force * deflection(x);
      theta.row(i) = -force * (x - 0.5 * x * x) * beside.transpose();
    }
    const Body bar = make_bar(1.0, 0.04, 41, 12);
    const int first = static_cast<int>(v.size());
    for (Eigen::Index k = 0; k < bar.v.rows(); ++k) {
      const double x = bar.v(k, 0);
      const Vec3 off = bar.v(k, 1) * beside + bar.v(k, 2) * Vec3::UnitZ();
      // A little apart, so that the bars are not welded at the joint.
      v.push_back((x + 1e-3) * along + off);
      truth.push_back(force * deflection(x + 1e-3) * Vec3::UnitZ() - force * (x - 0.5 * x * x) * beside.cross(off));
    }
    for (Eigen::Index k = 0; k < bar.t.rows(); ++k) t.push_back({first + bar.t(k, 0), first + bar.t(k, 1), first + bar.t(k, 2)});
  }
  const Body frame = make_body(v, t);
  Options options;
  options.precise = true;
  const Map map = make_map(nodes, frame.view(), options);
  EXPECT_EQ(map.report.layout, "curve");
  const Points got = apply_linear(map, u, theta);
  double error2 = 0.0, truth2 = 0.0;
  for (size_t k = 0; k < truth.size(); ++k) {
    error2 += (got.row(static_cast<Eigen::Index>(k)).transpose() - truth[k]).squaredNorm();
    truth2 += truth[k].squaredNorm();
  }
  EXPECT_LE(std::sqrt(error2 / truth2), 0.005);
}

// Nodes in the corners of the cross section too: every way between two of them is a line inside the bar, none is its axis.
TEST(InterpCurves, LinesAcrossABodyAreNoLinesAlongIt) {
  const Body bar = make_bar(2.0, 0.05, 61, 16);
  Nodes corners;
  corners.rotations = true;
  corners.positions.resize(12, 3);
  for (int i = 0; i < 12; ++i) corners.positions.row(i) << i / 4, i % 4 / 2 ? 0.05 : -0.05, i % 2 ? 0.05 : -0.05;
  EXPECT_NE(make_map(corners, bar.view(), {}).report.layout, "curve");

  // A disc of one fan of triangles has vertices along its rim only, near the lines between nine nodes inside it.
  std::vector<Vec3> v;
  std::vector<std::array<int, 3>> t;
  for (int k = 0; k < 300; ++k) v.push_back(radial(2.0 * pi * k / 300.0));
  for (int k = 1; k + 1 < 300; ++k) t.push_back({0, k, k + 1});
  const Body disc = make_body(v, t);
  for (const bool rotations : {false, true}) {
    Nodes grid;
    grid.rotations = rotations;
    grid.positions.resize(9, 3);
    for (int i = 0; i < 9; ++i) grid.positions.row(i) << i / 3 - 1.0, i % 3 - 1.0, 0.0;
    EXPECT_NE(make_map(grid, disc.view(), {}).report.layout, "curve");
  }
}

}  // namespace
}  // namespace flexframe::test_curves
