#include "render/film/shapes.h"

#include "sim/scene/section.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

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
  expect_closed(film::make_box({1, 2, 3}, {0.1, 0.2, 0.3}, "box"));
  expect_closed(film::make_sphere({0, 0, 0}, 2.0, "ball"));
  expect_closed(film::make_cylinder({0, 0, 0}, {1, 2, 3}, 0.2, "pin"));
  const double box = volume(film::make_box({0, 0, 0}, {0.1, 0.2, 0.3}, "box"));
  EXPECT_LT(box, 0.048);
  EXPECT_GT(box, 0.98 * 0.048);
  EXPECT_NEAR(volume(film::make_sphere({0, 0, 0}, 2.0, "ball")), 32.0 / 3.0 * std::numbers::pi, 0.4);
}

TEST(Shapes, RigidBodyHasTheBoxOfItsInertia) {
  // A box of 0.2 x 0.4 x 0.6 m: moments m/12 (b^2 + c^2).
  sim::RigidDef body;
  body.mass = 12.0;
  body.inertia << 0.16 + 0.36, 0.04 + 0.36, 0.04 + 0.16, 0, 0, 0;
  const render::Bounds bounds = render::compute_bounds(film::make_rigid_mesh(body, 0.1, "block"));
  EXPECT_NEAR(bounds.upper.x, 0.1, 1e-9);
  EXPECT_NEAR(bounds.upper.y, 0.2, 1e-9);
  EXPECT_NEAR(bounds.upper.z, 0.3, 1e-9);
}

TEST(Shapes, RigidBodyReachesItsFrames) {
  sim::RigidDef body;
  body.frames = {{"far", sim::Vec3(0, 2, 0)}};
  const render::Bounds bounds = render::compute_bounds(film::make_rigid_mesh(body, 0.1, "block"));
  EXPECT_GE(bounds.upper.y, 2.0 - 1e-9);
}

}  // namespace
