// Bodies that mislead a map: parts beside each other, thin bodies with nodes on one face, faces that look the wrong way or hang loose.
#include "interp/graph.h"
#include "interp_bodies.h"

#include <gtest/gtest.h>

#include <random>

namespace flexframe::test_thin {
namespace {

using namespace interp;
using namespace test;

const Points none(0, 3);

Map make_precise(const Nodes& nodes, const Body& body, Scheme scheme = Scheme::automatic) {
  Options options;
  options.scheme = scheme;
  options.precise = true;
  return make_map(nodes, body.view(), options);
}

Body join(const Body& a, const Body& b) {
  Body both;
  both.v.resize(a.v.rows() + b.v.rows(), 3);
  both.v << a.v, b.v;
  both.t.resize(a.t.rows() + b.t.rows(), 3);
  both.t << a.t, Triangles(b.t.array() + static_cast<int>(a.v.rows()));
  return both;
}

Body make_plate(double bottom, double thickness) {
  return make_blocks(lines(0.0, 1.0, 20), lines(0.0, 0.8, 16), {bottom, bottom + thickness}, [](int, int, int) { return true; });
}

// Kirchhoff's plate with the deflection w = sin(2 x) cos(1.5 y) of its middle surface.
Points plate_motion(const Points& v, double middle) {
  Points u(v.rows(), 3);
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    const double x = v(i, 0), y = v(i, 1), z = v(i, 2) - middle;
    u.row(i) << -2.0 * z * std::cos(2 * x) * std::cos(1.5 * y), 1.5 * z * std::sin(2 * x) * std::sin(1.5 * y),
        std::sin(2 * x) * std::cos(1.5 * y);
  }
  return u;
}

// Two plates 10 mm apart: the nodes of one do not move the other, however few they are.
TEST(InterpThin, PlatesSideBySideMoveAlone) {
  const Body low = make_plate(0.0, 0.004), both = join(low, make_plate(0.014, 0.004));
  const auto m = low.v.rows();
  for (const int each : {3, 5, 12, 30}) {
    std::vector<int> pick = farthest_points(low.v, each);
    for (int k = 0; k < each; ++k) pick.push_back(pick[k] + static_cast<int>(m));
    const Nodes nodes = nodes_at(both.v, pick, 2 * each);
    Points u = Points::Zero(2 * each, 3);
    for (int k = each; k < 2 * each; ++k) u.row(k) << 0.0, 0.1, std::sin(3.0 * nodes.positions(k, 0));
    for (const Scheme scheme : {Scheme::kernel, Scheme::automatic}) {
      const Map map = make_precise(nodes, both, scheme);
      EXPECT_TRUE(std::none_of(map.report.warnings.begin(), map.report.warnings.end(),
                               [](const std::string& w) { return w.find("moves with") != std::string::npos; }));
      EXPECT_LE(apply_linear(map, u, none).topRows(m).cwiseAbs().maxCoeff(), 1e-9) << each << " " << scheme_name(scheme);
    }
  }
  // With nodes on one of them only, the other follows, and that is said: where it is and what it lacks.
  const Map map = make_precise(nodes_at(both.v, farthest_points(low.v, 12), 12), both);
  ASSERT_FALSE(map.report.warnings.empty());
  EXPECT_NE(map.report.warnings.front().find("(0.5, 0.4, 0.016) holds 0 of the nodes"), std::string::npos) << map.report.warnings.front();
}

// Each vertex of a plate lies on its own side of the middle, corners too, however its faces are cut: the corner across the rim is the
// nearest neighbour of a corner.
TEST(InterpThin, CornersLookTheirOwnWay) {
  Body plate = make_plate(-0.0025, 0.005);
  Points nodes(5, 3);
  nodes << 0.0, 0.0, 0.0025, 1.0, 0.0, 0.0025, 0.0, 0.8, 0.0025, 1.0, 0.8, 0.0025, 0.5, 0.4, 0.0025;
  for (int mirrored = 0; mirrored < 2; ++mirrored) {
    const Weld weld = weld_vertices(plate.view(), 1e-9);
    const Graph graph = make_graph(weld, nodes, 8, false);
    ASSERT_EQ(graph.beside.rows(), weld.positions.rows());
    for (Eigen::Index v = 0; v < weld.positions.rows(); ++v)
      EXPECT_NEAR(graph.beside(v, 2), weld.positions(v, 2), 1e-12) << weld.positions.row(v);
    for (Eigen::Index i = 0; i < nodes.rows(); ++i) EXPECT_NEAR(graph.node_beside(i, 2), 0.0025, 1e-12) << nodes.row(i);
    plate.v.col(0) = 1.0 - plate.v.col(0).array();
    plate.t.col(0).swap(plate.t.col(1));
  }
}

// Thin plate with nodes on its upper face, or in its middle: the normals of both faces turn as they should.
TEST(InterpThin, NodesOnOneFace) {
  const Body plate = make_plate(-0.0025, 0.005);
  for (const double height : {0.0, 0.0025}) {
    Nodes nodes;
    nodes.positions.resize(30, 3);
    for (int k = 0; k < 30; ++k) nodes.positions.row(k) << (k % 6) / 5.0, 0.8 * (k / 6) / 4.0, height;
    const Map map = make_precise(nodes, plate);
    EXPECT_EQ(map.report.scheme, Scheme::kernel) << map.report.reason;
    const Points truth = plate_motion(plate.v, 0.0), got = apply_linear(map, plate_motion(nodes.positions, 0.0), none);
    EXPECT_LE((got - truth).norm() / truth.norm(), 0.01) << height;
    double off = 0.0, all = 0.0;
    for (Eigen::Index t = 0; t < plate.t.rows(); ++t) {
      const auto edge = [&](const Points& p, int c) { return Vec3((p.row(plate.t(t, c)) - p.row(plate.t(t, 0))).transpose()); };
      const Vec3 a = edge(plate.v, 1), b = edge(plate.v, 2), n = a.cross(b);
      const auto turn = [&](const Points& p) {
        const Vec3 change = edge(p, 1).cross(b) + a.cross(edge(p, 2));
        return Vec3(change / n.norm() - n * (n.dot(change) / std::pow(n.norm(), 3)));
      };
      off += n.norm() * (turn(got) - turn(truth)).squaredNorm();
      all += n.norm() * turn(truth).squaredNorm();
    }
    EXPECT_LE(std::sqrt(off / all), 0.06) << height;
  }
}

// A sheet rolled to an arc round x, 1 m long, two faces 5 mm apart; p: along, angle, height above the middle of radius r.
struct Arc {
  double angle, radius;
  Points place(const Points& p) const {
    Points x(p.rows(), 3);
    for (Eigen::Index i = 0; i < p.rows(); ++i)
      x.row(i) << p(i, 0), (radius + p(i, 2)) * std::sin(p(i, 1)), (radius + p(i, 2)) * std::cos(p(i, 1));
    return x;
  }
  // Bending without stretch of the middle (Rayleigh): radial cos(n angle), the normals follow.
  Points motion(const Points& p, double n) const {
    Points u(p.rows(), 3);
    for (Eigen::Index i = 0; i < p.rows(); ++i) {
      const double f = p(i, 1), radial = std::cos(n * f), tangential = -std::sin(n * f) / n;
      const double along = tangential - p(i, 2) * (-n * std::sin(n * f) - tangential) / radius;
      u.row(i) << 0.0, radial * std::sin(f) + along * std::cos(f), radial * std::cos(f) - along * std::sin(f);
    }
    return u;
  }
  // Relative error of the displacements by nodes across x columns times rows, on the outer face.
  double error(const Points& flat, const Body& body, int columns, int rows, double n, Scheme& scheme) const {
    Points at(columns * rows, 3);
    for (int k = 0; k < columns * rows; ++k)
      at.row(k) << static_cast<double>(k % columns) / (columns - 1), angle * (static_cast<double>(k / columns) / (rows - 1) - 0.5), 0.0025;
    Nodes nodes;
    nodes.positions = place(at);
    const Map map = make_precise(nodes, body, scheme);
    scheme = map.report.scheme;
    const Points truth = motion(flat, n);
    return (apply_linear(map, motion(at, n), none) - truth).norm() / truth.norm();
  }
};

// Curved walls: with enough nodes the kernel sees them along their normal (3 % and more when it took the slope across the wall from nodes
// on a curve); with few, the elastic surface knows how they bend.
TEST(InterpThin, CurvedWalls) {
  for (const double turn : {2.0, 5.0}) {
    const Arc arc{turn, turn > 3.0 ? 0.2 : 0.5};
    Body body = make_blocks(lines(0.0, 1.0, 12), lines(-turn / 2, turn / 2, 40), {-0.0025, 0.0025}, [](int, int, int) { return true; });
    const Points flat = body.v;
    body.v = arc.place(flat);
    Scheme scheme = Scheme::kernel;
    if (turn < 3.0) {
      EXPECT_LE(arc.error(flat, body, 8, 15, 3.0, scheme), 0.01);
    }
    scheme = Scheme::automatic;
    EXPECT_LE(arc.error(flat, body, 4, 6, 2.0, scheme), 0.05) << turn;
    if (turn > 3.0) {
      EXPECT_EQ(scheme, Scheme::elastic);
    }
  }
}

// Nodes on the outer face only, or on both: the inner face of half a tube moves as the outer one does. A slope across the wall taken from
// nodes on a curve would move it by n^2 t / r of the motion (22 %) too far. Truth: Rayleigh's bending.
TEST(InterpThin, BothFacesOfAWall) {
  const Arc arc{3.0, 0.2};
  Body body = make_blocks(lines(0.0, 1.0, 20), lines(-1.5, 1.5, 40), {-0.0025, 0.0025}, [](int, int, int) { return true; });
  const Points flat = body.v, truth = arc.motion(flat, 3.0);
  body.v = arc.place(flat);
  for (const bool both : {false, true}) {
    Points at(11 * 13, 3);
    for (int k = 0; k < at.rows(); ++k) at.row(k) << (k % 11) / 10.0, 3.0 * ((k / 11) / 12.0 - 0.5), both && k % 5 == 0 ? -0.0025 : 0.0025;
    Nodes nodes;
    nodes.positions = arc.place(at);
    const Map map = make_precise(nodes, body, Scheme::kernel);
    const Points wrong = apply_linear(map, arc.motion(at, 3.0), none) - truth;
    double square[2] = {0.0, 0.0};
    for (Eigen::Index v = 0; v < flat.rows(); ++v) square[flat(v, 2) > 0.0] += wrong.row(v).squaredNorm() / truth.squaredNorm();
    EXPECT_LE(std::sqrt(square[0]), 2.0 * std::sqrt(square[1]) + 1e-3) << both;
    EXPECT_LE(std::sqrt(square[0]), 0.01) << both;
    // Rigid motion of all nodes, large and small, is exact on both faces.
    const Mat3 turn = Eigen::AngleAxisd(0.9, Vec3(1, 2, -1).normalized()).toRotationMatrix();
    const auto rigid = [&](const Points& x) { return Points((x * turn.transpose() - x).rowwise() + Eigen::RowVector3d(0.1, 0.2, 0.3)); };
    PointsF out;
    apply(map, rigid(nodes.positions), none, out);
    EXPECT_LE((out.cast<double>() - rigid(body.v)).cwiseAbs().maxCoeff(), 1e-5);
  }
}

// Nodes at the corners of a face, whose vertices have creases beside them only: the map is finite and as right as the nodes allow.
TEST(InterpThin, CornersOfAWall) {
  const Body plate = make_plate(-0.0025, 0.005);
  for (const int count : {8, 12, 20}) {
    Nodes nodes;
    nodes.positions.resize(count, 3);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int k = 0; k < count; ++k) {
      const bool corner = k < 4;
      nodes.positions.row(k) << (corner ? k % 2 : share(random)), 0.8 * (corner ? k / 2 : share(random)), 0.0025;
    }
    const Map map = make_precise(nodes, plate, Scheme::kernel);
    // x y / 2: in the reach of an interpolant of few nodes.
    const auto twist = [](const Points& p) {
      Points u(p.rows(), 3);
      for (Eigen::Index i = 0; i < p.rows(); ++i) u.row(i) << -0.5 * p(i, 2) * p(i, 1), -0.5 * p(i, 2) * p(i, 0), 0.5 * p(i, 0) * p(i, 1);
      return u;
    };
    const Points truth = twist(plate.v), got = apply_linear(map, 1e-3 * twist(nodes.positions), none) * 1e3;
    ASSERT_TRUE(got.allFinite()) << count;
    EXPECT_LE((got - truth).norm() / truth.norm(), 0.2) << count;
  }
}

// The thickness of an elastic surface's wall: what is asked for; else twice its volume over its area, of an open one a hundredth of its
// size.
TEST(InterpThin, AskedThickness) {
  const Body open = half_tube(), closed = make_plate(-0.0025, 0.005);
  for (const Body* body : {&open, &closed}) {
    const Nodes nodes = nodes_at(body->v, farthest_points(body->v, 12), 12);
    Points u = Points::Zero(12, 3);
    for (int k = 0; k < 12; ++k) u.row(k) << 0.0, 1e-3 * (k % 3), 2e-3 * (k % 2);
    const auto moved = [&](double thickness) {
      Options options;
      options.scheme = Scheme::elastic;
      options.precise = true;
      options.thickness = thickness;
      return apply_linear(make_map(nodes, body->view(), options), u, none);
    };
    const double size = (body->v.colwise().maxCoeff() - body->v.colwise().minCoeff()).norm();
    const double wall = body == &open ? 0.01 * size : 2.0 * (1.0 * 0.8 * 0.005) / (2.0 * (0.8 + 0.005 + 0.8 * 0.005));
    const Points usual = moved(0.0);
    EXPECT_LE((moved(wall) - usual).norm(), 1e-6 * usual.norm());
    EXPECT_GE((moved(4.0 * wall) - usual).norm(), 1e-2 * usual.norm());
  }
}

// Faces that look the wrong way, faces twice and faces between vertices far apart leave the map as it is.
TEST(InterpThin, BadFacesChangeNothing) {
  const FeBody fork = read_fe_body("fork");
  for (const int count : {20, 60}) {
    const std::vector<int> pick = farthest_points(fork.body.v, count);
    const Nodes nodes = nodes_at(fork.body.v, pick, count);
    const Points u = rows_at(fork.mode[0], pick, count);
    const Map map = make_precise(nodes, fork.body);
    const Points clean = apply_linear(map, u, none);
    std::mt19937 random(5);
    Body inverted = fork.body;
    for (Eigen::Index t = 0; t < inverted.t.rows(); ++t)
      if (random() % 3 == 0) std::swap(inverted.t(t, 0), inverted.t(t, 1));
    Body fins = fork.body;
    fins.t.conservativeResize(fins.t.rows() + 6, 3);
    for (Eigen::Index t = fork.body.t.rows(); t < fins.t.rows(); ++t)
      for (int c = 0; c < 3; ++c) fins.t(t, c) = static_cast<int>(random() % fork.body.v.rows());
    for (const Body* bad : {&inverted, &fins}) {
      const Map other = make_precise(nodes, *bad);
      EXPECT_EQ(other.report.scheme, map.report.scheme);
      EXPECT_LE((apply_linear(other, u, none) - clean).norm(), 1e-6 * clean.norm()) << count << (bad == &fins ? " fins" : " inverted");
    }
    // A few faces that float about: hardly anything.
    Body floating;
    floating.v.resize(9, 3);
    floating.t.resize(3, 3);
    for (int k = 0; k < 9; ++k) {
      floating.v.row(k) = Eigen::RowVector3d(0.3 * (k / 3), 0.9 + 0.01 * (k % 3), -0.7 * (k % 2) * 0.01);
      floating.t(k / 3, k % 3) = k;
    }
    const Map other = make_precise(nodes, join(fork.body, floating));
    EXPECT_EQ(other.report.scheme, map.report.scheme);
    EXPECT_LE((apply_linear(other, u, none).topRows(clean.rows()) - clean).norm(), 2e-3 * clean.norm()) << count;
  }
}

}  // namespace
}  // namespace flexframe::test_thin
