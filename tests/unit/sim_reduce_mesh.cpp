// Divided meshes, and patches of distorted elements.
#include "sim/base/eigen_solvers.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_facets.h"
#include "sim/reduce/fe_refine.h"
#include "sim/reduce/fe_solver.h"
#include "sim/reduce/fe_system.h"
#include "sim/reduce/reduce.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace flexframe::sim::test_reduce_mesh {
namespace {

FeMaterial steel() { return {"steel", 2.1e11, 0.3, 7850.0}; }

// Elements of corner shape `linear` between given points, with the middle nodes that `shape` has.
FeModel model_of(FeShape shape, const std::vector<Vec3>& points, const std::vector<std::vector<int>>& elements) {
  FeModel m;
  m.file = "mesh";
  m.materials = {steel()};
  m.nodes = points;
  std::map<std::pair<int, int>, int> middles;
  for (const std::vector<int>& corners : elements) {
    FeElement e;
    e.id = static_cast<int>(m.elements.size()) + 1;
    e.shape = shape;
    e.material = 0;
    e.thickness = fe_is_shell(shape) ? 0.01 : 0.0;
    e.first = static_cast<int>(m.connectivity.size());
    e.count = fe_node_count(shape);
    std::vector<int> nodes = corners;
    nodes.resize(e.count, -1);
    for (int a = 0; a < static_cast<int>(corners.size()); ++a)
      for (int b = 0; b < a; ++b)
        if (const int place = fe_middle(shape, a, b); place >= 0) {
          const auto [at, fresh] = middles.try_emplace(std::minmax(corners[a], corners[b]), static_cast<int>(m.nodes.size()));
          if (fresh) m.nodes.emplace_back(0.5 * (points[corners[a]] + points[corners[b]]));
          nodes[place] = at->second;
        }
    m.connectivity.insert(m.connectivity.end(), nodes.begin(), nodes.end());
    m.elements.push_back(e);
  }
  for (size_t i = 0; i < m.nodes.size(); ++i) m.node_ids.push_back(static_cast<int>(i) + 1);
  return m;
}

// Eight points of a brick, none of its faces plane.
std::vector<Vec3> skewed_brick() {
  std::vector<Vec3> out;
  const Mat3X p = parent_nodes(FeShape::hexahedron8);
  for (int i = 0; i < 8; ++i)
    out.emplace_back(Vec3(0.3, 0.2, 0.1).cwiseProduct(Vec3(p.col(i))) +
                     0.02 * Vec3(std::sin(3.0 * i), std::cos(5.0 * i), std::sin(7.0 * i)));
  return out;
}

double volume(const FeModel& m) {
  double sum = 0.0;
  for (const FeElement& e : m.elements) {
    Mat3X X(3, e.count);
    for (int i = 0; i < e.count; ++i) X.col(i) = m.nodes[m.connectivity[e.first + i]];
    if (fe_is_solid(e.shape))
      for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::mass, X, e.id)) sum += p.volume;
    else
      for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) sum += p.area;
  }
  return sum;
}

// Two elements with a common face, divided: the volume stays, nodes of both sides are the same, the outer surface is in one piece and four
// times as many faces, and what is held and tied on a face is so between its nodes.
TEST(FeRefine, DividesEveryKind) {
  std::vector<Vec3> bricks = skewed_brick();
  for (const int k : {1, 2, 6, 5}) bricks.emplace_back(bricks[k] + Vec3(0.5, 0.01 * k, 0.0));
  const std::vector<Vec3> tetrahedra = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.1, 0.2, 0.9}, {0.9, 0.8, 0.7}};
  const std::vector<Vec3> flat = {{0, 0, 0}, {1, 0, 0}, {1.1, 1, 0}, {0, 1, 0}, {2, 0.1, 0}, {2, 1, 0}};
  struct Case {
    FeShape shape;
    std::vector<Vec3> points;
    std::vector<std::vector<int>> elements;
    size_t parts, held;  // of both elements; new nodes on the first element's held face or edge
  };
  const std::vector<std::vector<int>> two_bricks = {{0, 1, 2, 3, 4, 5, 6, 7}, {1, 8, 9, 2, 5, 11, 10, 6}};
  const std::vector<std::vector<int>> two_wedges = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}}, two_tetrahedra = {{0, 1, 2, 3}, {1, 4, 2, 3}};
  const std::vector<std::vector<int>> two_squares = {{0, 1, 2, 3}, {1, 4, 5, 2}}, two_triangles = {{0, 1, 2}, {0, 2, 3}};
  const Case cases[] = {{FeShape::hexahedron8, bricks, two_bricks, 16, 5},
                        {FeShape::hexahedron20, bricks, two_bricks, 16, 13},
                        {FeShape::wedge6, skewed_brick(), two_wedges, 16, 3},
                        {FeShape::wedge15, skewed_brick(), two_wedges, 16, 9},
                        {FeShape::tetrahedron4, tetrahedra, two_tetrahedra, 16, 3},
                        {FeShape::tetrahedron10, tetrahedra, two_tetrahedra, 16, 9},
                        {FeShape::quadrangle4, flat, two_squares, 8, 1},
                        {FeShape::quadrangle8, flat, two_squares, 8, 2},
                        {FeShape::triangle3, {flat.begin(), flat.begin() + 4}, two_triangles, 8, 1},
                        {FeShape::triangle6, {flat.begin(), flat.begin() + 4}, two_triangles, 8, 2}};
  for (const Case& c : cases) {
    FeModel m = model_of(c.shape, c.points, c.elements);
    // The first face of a solid, the first edge of a shell.
    std::vector<int> side;
    if (fe_is_solid(c.shape)) {
      for (const int k : fe_face_nodes(c.shape, 0)) side.push_back(m.connectivity[k]);
    } else {
      side = {m.connectivity[0], m.connectivity[1]};
      if (const int middle = fe_middle(c.shape, 0, 1); middle >= 0) side.push_back(m.connectivity[middle]);
    }
    std::vector<FeConstraint> held;
    for (const int n : side) held.push_back({n, 1});
    FeSpider spider;
    spider.node = static_cast<int>(m.nodes.size());
    spider.slaves = side;
    m.nodes.emplace_back(5, 5, 5);
    m.node_ids.push_back(1000);
    m.spiders.push_back(spider);
    const std::optional<FeRefined> divided = refine(m, held);
    ASSERT_TRUE(divided) << fe_name(c.shape);
    EXPECT_EQ(divided->model.elements.size(), c.parts) << fe_name(c.shape);
    EXPECT_NEAR(volume(divided->model), volume(m), 1e-12) << fe_name(c.shape);
    EXPECT_EQ(divided->held.size(), held.size() + c.held) << fe_name(c.shape);
    EXPECT_EQ(divided->model.spiders[0].slaves.size(), side.size() + c.held) << fe_name(c.shape);
    if (fe_is_solid(c.shape)) {
      EXPECT_EQ(outer_faces(divided->model).size(), 4 * outer_faces(m).size()) << fe_name(c.shape);
    }
    std::set<int> used(divided->model.connectivity.begin(), divided->model.connectivity.end());
    EXPECT_EQ(used.size() + 1, divided->model.nodes.size()) << fe_name(c.shape);
    FeModel again = divided->model;
    again.spiders.clear();
    const FeSystem system = assemble(again);
    EXPECT_EQ(unconnected_parts(again, system).size(), 1) << fe_name(c.shape);
    // A node of the first element's far end is where it was.
    for (size_t i = 0; i < m.nodes.size(); ++i) EXPECT_EQ(divided->model.nodes[i], m.nodes[i]);
  }
}

// Facets on a cylinder of radius 1, each `angle` wide, their normals turned about where asked for.
FeModel facets_around(double angle, FeShape shape, bool flipped) {
  std::vector<Vec3> points;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 5; ++j) points.emplace_back(std::cos(angle * j), std::sin(angle * j), 0.5 * i);
  std::vector<std::vector<int>> elements;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      const int a = 5 * i + j;
      std::vector<int> q = {a, a + 1, a + 6, a + 5};
      if (flipped && (i + j) % 2 == 1) std::reverse(q.begin(), q.end());
      if (shape == FeShape::quadrangle4 || shape == FeShape::quadrangle8) elements.push_back(q);
      else elements.insert(elements.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
    }
  return model_of(shape, points, elements);
}

// The middles of edges around a cylinder rise to it, at the ends of the mesh too, those along it do not; the divided mesh has its nodes
// there and so, on the straight sides of quadratic shells, have the middles.
TEST(FeFacets, RiseToTheCylinder) {
  for (const FeShape shape : {FeShape::quadrangle4, FeShape::triangle3, FeShape::quadrangle8, FeShape::triangle6})
    for (const double angle : {0.05, 0.3, 0.7})
      for (const bool flipped : {false, true}) {
        const FeModel m = facets_around(angle, shape, flipped);
        const FacetRises rises(m);
        const double sagitta = 1.0 - std::cos(0.5 * angle);
        for (int i = 0; i < 4; ++i)
          for (int j = 0; j < 4; ++j) {
            const Vec3 out(std::cos(angle * (j + 0.5)), std::sin(angle * (j + 0.5)), 0.0), rise = rises.of(5 * i + j, 5 * i + j + 1);
            EXPECT_NEAR(rise.dot(out), sagitta, 0.35 * sagitta) << fe_name(shape) << " " << angle;
            EXPECT_LT((rise - out * out.dot(rise)).norm(), 0.1 * sagitta) << fe_name(shape) << " " << angle;
            if (i < 3) {
              EXPECT_LT(rises.of(5 * i + j, 5 * i + j + 5).norm(), 0.1 * sagitta) << fe_name(shape) << " " << angle;
            }
          }
        const double whole = 4.0 * angle * 1.5 * 0.01 * 7850.0, facets = whole * std::sin(0.5 * angle) / (0.5 * angle);
        const FacetMoments moments = facet_moments(m, Vec3::Zero());
        EXPECT_NEAR(moments.mass, facets, 1e-9 * whole);
        EXPECT_NEAR(moments.smooth_mass, whole, 0.5 * (whole - facets)) << fe_name(shape) << " " << angle;
        const std::optional<FeRefined> divided = refine(m, {});
        for (const int n : divided->model.connectivity)
          EXPECT_NEAR(divided->model.nodes[n].head<2>().norm(), 1.0, 0.35 * sagitta) << fe_name(shape) << " " << angle;
      }
}

// A parabola's corners tell its middles exactly, warped quadrangles and triangles whose diagonals go either way; a plane has none, nor has
// an angle between plates of more than one element.
TEST(FeFacets, SaddleAndFold) {
  for (const bool triangles : {false, true}) {
    std::vector<Vec3> points;
    std::vector<std::vector<int>> elements;
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j) points.emplace_back(0.1 * i, 0.1 * j, 0.02 * i * 0.1 * j);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const int a = 5 * i + j;
        if (!triangles) elements.push_back({a, a + 5, a + 6, a + 1});
        else if ((i + j) % 2 == 0) elements.insert(elements.end(), {{a, a + 5, a + 6}, {a, a + 6, a + 1}});
        else elements.insert(elements.end(), {{a, a + 5, a + 1}, {a + 5, a + 6, a + 1}});
      }
    const FeModel m = model_of(triangles ? FeShape::triangle3 : FeShape::quadrangle4, points, elements);
    const std::optional<FeRefined> divided = refine(m, {});
    for (const Vec3& x : divided->model.nodes) EXPECT_NEAR(x.z(), 0.2 * x.x() * x.y(), 1e-5);
    for (const double degrees : {0.0, 10.0, 40.0, 90.0}) {
      FeModel folded = m;
      const double a = degrees * std::numbers::pi / 180.0;
      for (Vec3& x : folded.nodes) {
        const double beyond = std::max(0.0, x.x() - 0.2);
        x = {x.x() - beyond + beyond * std::cos(a), x.y(), beyond * std::sin(a)};
      }
      const FacetRises rises(folded);
      for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j)
          if (i < 4) {
            EXPECT_LT(rises.of(5 * i + j, 5 * i + j + 5).norm(), 1e-9) << degrees << " degrees";
          }
    }
  }
}

// Nodes that an equation ties may have others between them: nothing is told of that.
TEST(FeRefine, LeavesEquationsAlone) {
  FeModel m = model_of(FeShape::hexahedron8, skewed_brick(), {{0, 1, 2, 3, 4, 5, 6, 7}});
  EXPECT_TRUE(refine(m, {}));
  m.equations.push_back({{{1, 0, 1.0}, {2, 0, -1.0}}, 0});
  EXPECT_FALSE(refine(m, {}));
}

// The patch test on bricks that are no parallelepipeds: a uniform strain at the outer nodes moves the inner ones with it. CalculiX' own
// incompatible modes, without the ratio of determinants, fail it.
TEST(FeElements, PatchOfDistortedBricks) {
  Mat3 H;
  H << 1e-3, 2e-4, -3e-4, 5e-4, -2e-4, 1e-4, 3e-4, -4e-4, 6e-4;
  for (FeFormulation f : {FeFormulation::full, FeFormulation::incompatible}) {
    // A cube within a cube, its corners anywhere: seven bricks.
    std::vector<Vec3> points;
    const Mat3X p = parent_nodes(FeShape::hexahedron8);
    for (int i = 0; i < 8; ++i) points.emplace_back(p.col(i));
    const std::vector<Vec3> skewed = skewed_brick();
    for (int i = 0; i < 8; ++i) points.emplace_back(1.3 * skewed[i]);
    std::vector<std::vector<int>> elements = {{8, 9, 10, 11, 12, 13, 14, 15}};
    for (const std::vector<int>& face : fe_faces(FeShape::hexahedron8)) {
      // Outward faces: seen from inside the outer one comes first.
      std::vector<int> e;
      for (const int k : face) e.push_back(k);
      for (const int k : face) e.push_back(8 + k);
      std::vector<int> turned = {e[0], e[3], e[2], e[1], e[4], e[7], e[6], e[5]};
      elements.push_back(turned);
    }
    FeModel m = model_of(FeShape::hexahedron8, points, elements);
    for (FeElement& e : m.elements) e.formulation = f;
    for (FeElement& e : m.elements) {
      Mat3X X(3, 8);
      for (int i = 0; i < 8; ++i) X.col(i) = m.nodes[m.connectivity[e.first + i]];
      VecX N;
      MatX dN;
      shape_functions(FeShape::hexahedron8, Vec3::Zero(), N, dN);
      if ((X * dN).determinant() < 0.0)
        for (int i = 0; i < 4; ++i) std::swap(m.connectivity[e.first + i], m.connectivity[e.first + 4 + i]);
    }
    const FeSystem system = assemble(m);
    VecX u(system.size);
    for (size_t i = 0; i < m.nodes.size(); ++i)
      for (int d = 0; d < 3; ++d) u(system.dof[i][d]) = H.row(d).dot(m.nodes[i]);
    const VecX forces = symmetric_product(system.K, u);
    for (size_t i = 8; i < m.nodes.size(); ++i)
      for (int d = 0; d < 3; ++d)
        EXPECT_LT(std::abs(forces(system.dof[i][d])), 1e-12 * forces.cwiseAbs().maxCoeff()) << i << static_cast<int>(f);
  }
}

// A strip twisted by 90 degrees, held at one end, its elements warped: R. H. MacNeal, R. L. Harder, A proposed standard set of problems to
// test finite element accuracy, 1985, 5.424e-3 and 1.754e-3 under a unit force along and across the tip; ten times thinner, where a warped
// element must not stiffen, 48 x 8 S8R have it. The tolerance is what either mesh is off by itself.
TEST(FeElements, TwistedStripOfShells) {
  struct Case {
    FeShape shape;
    double thickness, in, out, tolerance;
    int parts;  // of 24 x 4 cells
  };
  for (const Case& c :
       {Case{FeShape::quadrangle4, 0.32, 5.424e-3, 1.754e-3, 0.015, 1}, Case{FeShape::triangle3, 0.32, 5.424e-3, 1.754e-3, 0.08, 1},
        Case{FeShape::triangle3, 0.32, 5.424e-3, 1.754e-3, 0.03, 2},  // a third too soft while nothing tied them
        Case{FeShape::quadrangle4, 0.032, 5.2897, 1.3011, 0.01, 1}}) {
    const int along = 24 * c.parts, across = 4 * c.parts;
    std::vector<Vec3> points;
    std::vector<std::vector<int>> elements;
    for (int i = 0; i <= along; ++i)
      for (int j = 0; j <= across; ++j) {
        const double angle = 0.5 * std::numbers::pi * i / along, y = 1.1 * (static_cast<double>(j) / across - 0.5);
        points.emplace_back(12.0 * i / along, y * std::cos(angle), y * std::sin(angle));
        const int a = i * (across + 1) + j, b = a + across + 1;
        if (i == along || j == across) continue;
        if (c.shape == FeShape::quadrangle4) elements.push_back({a, b, b + 1, a + 1});
        else elements.push_back({a, b, b + 1}), elements.push_back({a, b + 1, a + 1});
      }
    FeModel m = model_of(c.shape, points, elements);
    m.materials = {{"strip", 29e6, 0.22, 1.0}};
    for (FeElement& e : m.elements) e.thickness = c.thickness;
    const FeSystem system = assemble(m);
    const MatX rigid = rigid_motions(m, system), energy = rigid.transpose() * symmetric_product(system.K, rigid);
    EXPECT_LT(energy.norm(), 1e-12 * system.K.norm());
    std::vector<FeConstraint> held;
    for (int j = 0; j <= across; ++j)
      for (int d = 0; d < 6; ++d) held.push_back({j, d});
    const FeReduced reduced = eliminate(m, system, held);
    FeSolver solver{reduced, MatX(reduced.size(), 0), estimate_modes(m, system)};
    solver.factorise();
    const int tip = along * (across + 1) + across / 2;
    MatX loads = MatX::Zero(system.size, 2);
    loads(system.dof[tip][2], 0) = loads(system.dof[tip][1], 1) = 1.0;
    const MatX small = reduced.restrict(loads), seen = small.transpose() * solver.respond(small);
    EXPECT_NEAR(seen(0, 0), c.in, c.tolerance * c.in) << fe_name(c.shape) << ' ' << c.thickness;
    EXPECT_NEAR(seen(1, 1), c.out, c.tolerance * c.out) << fe_name(c.shape) << ' ' << c.thickness;
  }
}

// A panel of 135 degrees, a tenth of its radius thick, free: its flat elements meet at angles and twist, facets of one
// element or of four. 24 x 14 x 2 C3D20R have 572.3,
// 854.8 and 1273.5 Hz, 24 x 14 S8R 572.2, 854.1, 1272.3.
TEST(FeElements, CurvedPanelOfFlatShells) {
  for (const int parts : {1, 2}) {  // of each facet
    const int around = 24 * parts, along = 14 * parts;
    std::vector<Vec3> points;
    std::vector<std::vector<int>> elements;
    for (int i = 0; i <= around; ++i)
      for (int j = 0; j <= along; ++j) {
        const auto corner = [&](int facet) {
          const double angle = 0.75 * std::numbers::pi * facet * parts / around;
          return Vec3(0.1 * std::cos(angle), 0.1 * std::sin(angle), 0.25 * j / along);
        };
        const double share = static_cast<double>(i % parts) / parts;
        points.emplace_back((1 - share) * corner(i / parts) + share * corner(i / parts + 1));
        const int a = i * (along + 1) + j, b = a + along + 1;
        if (i < around && j < along) elements.push_back({a, b, b + 1, a + 1});
      }
    ReduceOptions o;
    o.method = ReduceMethod::eigenmodes;
    o.modes = 3;
    o.stiffening = false;
    const ReduceReport report = reduce(model_of(FeShape::quadrangle4, points, elements), o).report;
    const VecX& found = report.frequencies;
    const double wanted[3] = {572.3, 854.8, 1273.5};
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found(k), wanted[k], 0.01 * wanted[k]) << parts;
    // Fourteen elements along it make its moments of inertia 1.02 % too large, which is told.
    for (const std::string& warning : report.warnings) EXPECT_NE(warning.find("moment of inertia"), std::string::npos) << warning;
  }
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_mesh
