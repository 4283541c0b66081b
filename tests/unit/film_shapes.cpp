#include "render/film/rigid_mesh.h"
#include "render/film/shapes.h"

#include "sim/base/spatial.h"
#include "sim/scene/section.h"
#include "sim/scene/shape_mass.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <numbers>
#include <optional>
#include <span>

namespace test_shapes {
namespace {

using namespace flexframe;

double volume(const render::Mesh& mesh) {
  double six = 0.0;
  for (const glm::ivec3& t : mesh.triangles) six += glm::dot(mesh.positions[t.x], glm::cross(mesh.positions[t.y], mesh.positions[t.z]));
  return six / 6.0;
}

// Every directed edge meets its reverse exactly once.
void expect_closed(const render::Mesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << " " << edge.second;
  }
}

TEST(Shapes, SweptBeamsAreClosedAndHaveTheirVolume) {
  const std::vector<std::pair<std::string, std::map<std::string, double>>> sections = {
      {"circle", {{"diameter", 0.01}}},
      {"tube", {{"diameter", 0.02}, {"thickness", 0.002}}},
      {"rectangle", {{"width", 0.2}, {"height", 0.009}}},
      {"box", {{"width", 0.05}, {"height", 0.03}, {"thickness", 0.004}}},
      {"i", {{"height", 0.1}, {"width", 0.06}, {"web", 0.005}, {"flange", 0.008}}},
      {"u", {{"height", 0.1}, {"width", 0.06}, {"web", 0.005}, {"flange", 0.008}}},
      {"t", {{"height", 0.1}, {"width", 0.06}, {"web", 0.005}, {"flange", 0.008}}},
  };
  for (const auto& [shape, sizes] : sections) {
    SCOPED_TRACE(shape);
    const sim::Section section = sim::make_section(shape, sizes);
    const std::vector<double> stations = {0.0, 0.13, 0.2, 0.4};
    const render::Mesh mesh = film::make_beam_mesh(section, 0.4, stations, "beam");
    expect_closed(mesh);
    EXPECT_NEAR(volume(mesh), section.area * 0.4, 1e-9 * section.area * 0.4);
  }
}

TEST(Shapes, BeamHasARingAtEveryStation) {
  sim::Section section;
  section.area = 1e-4;
  const std::vector<double> stations = {0.31, 0.1};
  const render::Mesh mesh = film::make_beam_mesh(section, 1.0, stations, "beam");
  expect_closed(mesh);
  for (double x : {0.0, 0.1, 0.31, 1.0}) {
    bool found = false;
    for (const glm::dvec3& p : mesh.positions) found = found || p.x == x;
    EXPECT_TRUE(found) << x;
  }
}

TEST(Shapes, SolidsAreClosedAndFaceOutwards) {
  const film::Build edges = film::box({1, 2, 3}, {0.1, 0.2, 0.3});
  const render::Mesh solid = render::make_mesh(edges.positions, edges.triangles, "box", film::flat_bevels);
  expect_closed(solid);
  expect_closed(film::make_sphere({0, 0, 0}, 2.0, "ball"));
  expect_closed(film::make_cylinder({0, 0, 0}, {1, 2, 3}, 0.2, "pin"));
  EXPECT_LT(volume(solid), 0.048);
  EXPECT_GT(volume(solid), 0.98 * 0.048);
  EXPECT_NEAR(volume(film::make_sphere({0, 0, 0}, 2.0, "ball")), 32.0 / 3.0 * std::numbers::pi, 0.4);
}

TEST(Shapes, RigidBodyHasTheBoxOfItsInertia) {
  // A box of 0.2 x 0.4 x 0.6 m: moments m/12 (b^2 + c^2).
  sim::RigidDef body;
  body.mass = 12.0;
  body.inertia << 0.16 + 0.36, 0.04 + 0.36, 0.04 + 0.16, 0, 0, 0;
  const render::Bounds bounds = render::compute_bounds(film::make_rigid_mesh(body, {}, 0.1 / 0.035, 0, "block"));
  EXPECT_NEAR(bounds.upper.x, 0.1, 1e-9);
  EXPECT_NEAR(bounds.upper.y, 0.2, 1e-9);
  EXPECT_NEAR(bounds.upper.z, 0.3, 1e-9);
}

TEST(Shapes, RigidBodyReachesItsFrames) {
  sim::RigidDef body;
  body.frames = {{"far", sim::Vec3(0, 2, 0)}};
  const render::Bounds bounds = render::compute_bounds(film::make_rigid_mesh(body, {}, 0.1 / 0.035, 0, "block"));
  EXPECT_GE(bounds.upper.y, 2.0 - 1e-9);
}

// The mesh of every solid is closed and weighs what the closed formula says, at its place and in its axes.
TEST(Shapes, SolidsOfTheSceneHaveTheMassOfTheirFormulas) {
  using sim::ShapeKind;
  std::vector<sim::ShapeDef> all(8);
  all[0] = {.kind = ShapeKind::box, .size = {0.3, 0.2, 0.1}, .color = {}};
  all[1] = {.kind = ShapeKind::plate, .size = {0.5, 0.4, 0.01}, .color = {}};
  all[2] = {.kind = ShapeKind::cylinder, .radius = 0.1, .inner_radius = 0.04, .length = 0.5, .color = {}};
  all[3] = {.kind = ShapeKind::disc, .radius = 0.2, .length = 0.02, .color = {}};
  all[4] = {.kind = ShapeKind::capsule, .radius = 0.05, .length = 0.3, .color = {}};
  all[5] = {.kind = ShapeKind::sphere, .radius = 0.1, .color = {}};
  all[6] = {.kind = ShapeKind::link, .length = 0.4, .width = 0.06, .thickness = 0.02, .hole = 0.03, .color = {}};
  all[7] = {.kind = ShapeKind::gear, .radius = 0.1, .inner_radius = 0.02, .length = 0.03, .teeth = 40, .color = {}};
  const sim::Mat3 axes = sim::rotation_exp({0.3, -0.5, 1.1});
  for (sim::ShapeDef& shape : all) {
    SCOPED_TRACE(static_cast<int>(shape.kind));
    shape.position = {0.1, -0.2, 0.3};
    shape.axes = axes;
    const std::vector<std::optional<glm::vec3>> colors{glm::vec3(1, 0, 0)};
    const render::Mesh mesh = film::make_shapes_mesh(std::span(&shape, 1), colors, "shape");
    expect_closed(mesh);
    ASSERT_EQ(mesh.materials.size(), 2u);
    EXPECT_EQ(mesh.triangle_material.front(), 1);
    // int dm, int r dm and int r r^T dm of the tetrahedra from the origin to each triangle.
    double mass = 0.0;
    sim::Vec3 first = sim::Vec3::Zero();
    sim::Mat3 second = sim::Mat3::Zero();
    for (const glm::ivec3& t : mesh.triangles) {
      std::array<sim::Vec3, 3> p;
      for (int k = 0; k < 3; ++k) p[k] = {mesh.positions[t[k]].x, mesh.positions[t[k]].y, mesh.positions[t[k]].z};
      const double v = p[0].dot(p[1].cross(p[2])) / 6.0;
      const sim::Vec3 sum = p[0] + p[1] + p[2];
      mass += v;
      first += v / 4.0 * sum;
      second += v / 20.0 * (sum * sum.transpose());
      for (const sim::Vec3& corner : p) second += v / 20.0 * corner * corner.transpose();
    }
    const sim::MassMoments formula = sim::shape_moments(shape, 1.0);
    // Circles have 48 corners, balls facets both ways, boxes bevelled edges; a gear wheel has as much tooth as gap.
    const bool ball = shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::sphere;
    const double near = shape.kind == ShapeKind::gear ? 0.03 : ball ? 0.012 : 0.01;
    EXPECT_NEAR(mass, formula.mass, near * formula.mass);
    EXPECT_NEAR((first / mass - shape.position).norm(), 0.0, 2e-3);
    const sim::Vec6 drawn = sim::central_inertia({mass, first, second}), wanted = sim::central_inertia(formula);
    EXPECT_NEAR((drawn - wanted).norm(), 0.0, 3.0 * near * wanted.norm());
  }
}

// Between two pins a link reaches to both; more holding places are joined.
TEST(Shapes, RigidBodiesReachWhatHoldsThem) {
  sim::RigidDef body;
  body.mass = 1.0;
  body.centre_of_mass = {0.2, 0.0, 0.0};
  const std::vector<film::HoldingPlace> two{{{0, 0, 0}, {0, 0, 1}}, {{0.4, 0, 0}, {0, 0, 1}}};
  const render::Mesh link = film::make_rigid_mesh(body, two, 1.0, 0, "link");
  expect_closed(link);
  const render::Bounds bounds = render::compute_bounds(link);
  EXPECT_NEAR(bounds.lower.x, -0.02, 1e-9);
  EXPECT_NEAR(bounds.upper.x, 0.42, 1e-9);
  EXPECT_NEAR(bounds.upper.y, 0.02, 1e-3);
  EXPECT_LT(bounds.upper.z, 0.01);
  const std::vector<film::HoldingPlace> three{{{0, 0, 0}, {0, 0, 1}}, {{0.4, 0, 0}, {0, 0, 1}}, {{0.2, 0.3, 0}, {0, 0, 1}}};
  EXPECT_NEAR(render::compute_bounds(film::make_rigid_mesh(body, three, 1.0, 0, "triangle")).upper.y, 0.32, 1e-3);
}

// Nodes of a grid are joined along its lines, all of them.
TEST(Shapes, NodesWithoutMeshAreJoined) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) points.emplace_back(0.1 * i, 0.1 * k, 0.0);
  const render::Mesh mesh = film::make_lattice_mesh(points, 0.002, "plate");
  // 3 x 3 ways along one direction, 4 x 2 along the other, each a tube of 7 rings with 12 sides and its two ends.
  expect_closed(mesh);
  EXPECT_EQ(mesh.positions.size(), 17u * 86u);
  EXPECT_NEAR(render::compute_bounds(mesh).upper.x, 0.302, 1e-3);
}

}  // namespace

}  // namespace test_shapes
