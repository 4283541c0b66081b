// Fewer triangles of meshes finer than pixels: what is left out lies within what was asked, at rest, bent and coloured.
#include "render/film/detail.h"
#include "render/picture/adjacency.h"
#include "tests/unit/render_solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace flexframe::film::test_detail {
namespace {

// A tube along x of 2 m, radius 0.1 m, about this many triangles.
render::Shape tube(int triangles) {
  const int sides = static_cast<int>(std::lround(std::sqrt(triangles / 10.0))), rings = triangles / 2 / sides;
  std::vector<glm::dvec3> path;
  for (int i = 0; i <= rings; ++i) path.emplace_back(2.0 * i / rings, 0.0, 0.0);
  return render::make_tube(path, 0.1, sides);
}

// Bent to an arc of this radius in the plane of x and y.
std::vector<glm::vec3> bent(const std::vector<glm::vec3>& rest, double radius) {
  std::vector<glm::vec3> out;
  for (const glm::vec3& p : rest) {
    const double angle = static_cast<double>(p.x) / radius, r = radius - static_cast<double>(p.y);
    out.emplace_back(r * std::sin(angle), radius - r * std::cos(angle), p.z);
  }
  return out;
}

// How far the middles of a level's triangles lie off the bent tube's wall, m: they have not been looked at. Its ends are not looked at.
double off_the_wall(const DetailLevel& level, const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& rest, double radius) {
  double most = 0.0;
  for (const glm::uvec3& t : level.triangles) {
    if (std::max({rest[t.x].x, rest[t.y].x, rest[t.z].x}) > 1.999f || std::min({rest[t.x].x, rest[t.y].x, rest[t.z].x}) < 0.001f) continue;
    const glm::dvec3 m = glm::dvec3(positions[t.x] + positions[t.y] + positions[t.z]) / 3.0;
    const double across = std::hypot(radius - std::hypot(m.x, radius - m.y), m.z);
    most = std::max(most, std::abs(across - 0.1));
  }
  return most;
}

TEST(Detail, StandsForTheBentTube) {
  const render::Shape shape = tube(320000);
  const std::vector<DetailLevel> levels = make_levels(shape.positions, shape.triangles);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_LT(levels[0].triangles.size(), 6000u);
  EXPECT_LT(levels[1].triangles.size(), 42000u);
  EXPECT_LT(levels[0].away, 3e-3);
  EXPECT_LT(levels[1].away, 1e-3);
  for (const double radius : {1e6, 3.0, 1.0}) {
    const std::vector<glm::vec3> positions = bent(shape.positions, radius);
    for (const double length : {3e-3, 1e-3, 1e-4}) {
      const DetailLevel* level = fitting_level(levels, positions, true, length, {}, 0.0);
      if (length > 1e-4) {
        ASSERT_NE(level, nullptr) << radius << " " << length;
      }
      if (level) {
        EXPECT_LE(off_the_wall(*level, positions, shape.positions, radius), 1.5 * length) << radius << " " << length;
      }
    }
  }
  // Finer than the mesh itself is: all of it.
  EXPECT_EQ(fitting_level(levels, bent(shape.positions, 1.0), true, 1e-7, {}, 0.0), nullptr);
}

// Piece by piece: no rim opens, no fewer triangles are left out, and they lie as near.
TEST(Detail, PiecesHaveNoGaps) {
  const render::Shape shape = tube(320000);
  const std::vector<DetailLevel> whole = make_levels(shape.positions, shape.triangles),
                                 pieces = make_levels(shape.positions, shape.triangles, 100000);
  ASSERT_EQ(pieces.size(), 2u);
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_LT(pieces[i].triangles.size(), 1.2 * static_cast<double>(whole[i].triangles.size()));
    EXPECT_LT(pieces[i].away, 1.5 * whole[i].away);
    // Every edge of the closed tube has two sides; the same place may have several vertices.
    const std::vector<int> place = render::weld_equal(std::span<const glm::vec3>(shape.positions));
    std::map<std::pair<int, int>, int> sides;
    for (const glm::uvec3& t : pieces[i].triangles)
      for (int k = 0; k < 3; ++k) {
        const int a = place[t[k]], b = place[t[(k + 1) % 3]];
        sides[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
      }
    EXPECT_TRUE(std::all_of(sides.begin(), sides.end(), [](const auto& edge) { return edge.second == 0; }));
  }
  EXPECT_NE(pieces[1].triangles, whole[1].triangles);
}

// A kink that the shape at rest knows nothing of, and colours that change between two vertices.
TEST(Detail, LooksAtEveryPicture) {
  const render::Shape shape = tube(320000);
  const std::vector<DetailLevel> levels = make_levels(shape.positions, shape.triangles);
  ASSERT_EQ(levels.size(), 2u);
  std::vector<glm::vec3> positions = shape.positions;
  ASSERT_EQ(fitting_level(levels, positions, true, 3e-3, {}, 0.0), &levels[0]);
  const std::uint32_t gone = levels[1].left_out[levels[1].left_out.size() / 2].point;
  positions[gone].y += 0.005f;
  EXPECT_EQ(fitting_level(levels, positions, true, 3e-3, {}, 0.0), nullptr);
  EXPECT_EQ(fitting_level(levels, shape.positions, false, 3e-3, {}, 0.0), &levels[0]);

  std::vector<float> scalars(shape.positions.size(), 1.0f);
  EXPECT_EQ(fitting_level(levels, shape.positions, false, 3e-3, scalars, 0.01), &levels[0]);
  scalars[gone] = 1.02f;
  EXPECT_EQ(fitting_level(levels, shape.positions, false, 3e-3, scalars, 0.01), nullptr);
  scalars[gone] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(fitting_level(levels, shape.positions, false, 3e-3, scalars, 0.01), nullptr);
}

TEST(Detail, HalfAPixelOfTheNearestPoint) {
  render::Picture picture;
  picture.size = {1280, 720};
  picture.camera = {.position = {0, 0, 10}, .target = {0, 0, 0}, .fov = 60.0};
  const std::vector<glm::vec3> points = {{0, 0, 0}, {5, 0, 2}, {0, 1, -30}};
  glm::dmat4 pose(1.0);
  pose[3] = {0, 0, 1, 1};
  const double pixel = 2.0 * std::tan(M_PI / 6.0) * 7.0 / 720.0;  // 7 m from the viewer's plane
  EXPECT_NEAR(unseen_length(picture, pose, points), 0.5 * pixel, 1e-6 * pixel);
  picture.insets.push_back({.zoom = 4.0, .label = {}});
  EXPECT_LE(unseen_length(picture, pose, points), 0.5 * pixel / 4.0);
  picture.insets.clear();
  picture.views.push_back(
      {.camera = {.position = {0, 0, 10}, .target = {0, 0, 0}, .height = 3.6, .projection = render::Projection::orthographic},
       .label = {}});
  EXPECT_NEAR(unseen_length(picture, pose, points), 0.0025, 1e-9);
  picture.views.clear();
  pose[3].z = 9.0;
  EXPECT_EQ(unseen_length(picture, pose, points), 0.0) << "a point behind the viewer";
}

// Nothing to leave out, or nothing that could be: no level.
TEST(Detail, OddMeshes) {
  const std::vector<glm::vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  const std::vector<glm::uvec3> one = {{0, 1, 2}}, none = {{0, 0, 0}, {3, 0, 3}};
  EXPECT_TRUE(make_levels(points, one).empty());
  EXPECT_TRUE(make_levels(points, none).empty());
}

}  // namespace
}  // namespace flexframe::film::test_detail
