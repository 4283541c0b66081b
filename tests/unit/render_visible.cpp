// Triangles that are left out would not have touched a sample.
#include "render/draw/visible.h"

#include "tests/unit/render_front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace flexframe::render::test_visible {
namespace {

// Whether the centre of a sample lies in the triangle or within `off` of it.
bool touches(const glm::dvec2* v, int width, int height, double off, bool* counterclockwise) {
  const auto cross = [](const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; };
  const double area = cross(v[1] - v[0], v[2] - v[0]);
  *counterclockwise = area > 0.0;
  if (area == 0.0) return false;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const glm::dvec2 p(x + 0.5, y + 0.5);
      bool inside = p.x >= std::min({v[0].x, v[1].x, v[2].x}) - off && p.x <= std::max({v[0].x, v[1].x, v[2].x}) + off &&
                    p.y >= std::min({v[0].y, v[1].y, v[2].y}) - off && p.y <= std::max({v[0].y, v[1].y, v[2].y}) + off;
      for (int k = 0; k < 3; ++k) {
        const glm::dvec2 edge = v[(k + 1) % 3] - v[k];
        inside = inside && std::copysign(1.0, area) * cross(edge, p - v[k]) >= -off * (std::abs(edge.x) + std::abs(edge.y));
      }
      if (inside) return true;
    }
  return false;
}

TEST(Visible, KeepsWhatTouchesASampleAndLittleElse) {
  std::mt19937 random(7);
  const int width = 24, height = 16;
  std::uniform_real_distribution<float> place(-6.0f, 30.0f), step(-1.5f, 1.5f);
  VisibleTriangles visible;
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> triangles;
  for (unsigned i = 0; i < 4000; ++i) {
    // One number a statement: the order of arguments is the compiler's.
    const float y = place(random), x = place(random);
    const float size = i % 10 == 0 ? 12.0f : i % 3 == 0 ? 0.3f : 1.0f;
    for (int k = 0; k < 3; ++k) {
      const float up = step(random), along = step(random);
      positions.push_back(glm::vec3(x, y, 0.0f) + size * glm::vec3(along, up, 0.0f));
    }
    // Now and then vertices right on centres, and no area at all.
    if (i % 17 == 0) positions[3 * i] = glm::round(positions[3 * i]) + glm::vec3(0.5f, 0.5f, 0.0f);
    if (i % 31 == 0) positions[3 * i + 1] = positions[3 * i];
    triangles.push_back(glm::uvec3(3 * i, 3 * i + 1, 3 * i + 2));
  }
  for (const Facing facing : {Facing::any, Facing::counterclockwise, Facing::clockwise}) {
    const std::span<const glm::uvec3> kept = visible.select(positions, triangles, clip_of(width, height), width, height, facing);
    ASSERT_EQ(kept.size(), visible.indices().size());
    EXPECT_TRUE(std::is_sorted(visible.indices().begin(), visible.indices().end()));
    std::vector<bool> in(triangles.size(), false);
    for (std::size_t k = 0; k < kept.size(); ++k) {
      EXPECT_EQ(kept[k], triangles[visible.indices()[k]]);
      in[visible.indices()[k]] = true;
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const glm::dvec2 v[3] = {positions[triangles[i].x], positions[triangles[i].y], positions[triangles[i].z]};
      bool counterclockwise = false;
      const bool wanted = touches(v, width, height, 1.0 / 256.0, &counterclockwise) &&
                          (facing == Facing::any || counterclockwise == (facing == Facing::counterclockwise));
      EXPECT_TRUE(in[i] || !wanted) << "triangle " << i;
    }
    // Of triangles about as large as a sample some miss every centre though their boxes do not.
    EXPECT_LT(kept.size(), triangles.size() / (facing == Facing::any ? 3 : 6));
  }
}

TEST(Visible, VerticesBehindTheViewerOrNowhereStay) {
  // Perspective: w is minus z.
  glm::dmat4 clip(1.0);
  clip[2] = glm::dvec4(0.0, 0.0, 0.0, -1.0);
  clip[3] = glm::dvec4(0.0, 0.0, 0.1, 0.0);
  const float nan = std::numeric_limits<float>::quiet_NaN(), far = 3e38f;
  const std::vector<glm::vec3> positions = {{0, 0, 1},       {0, 1, 1},    {1, 0, 1},    {0, 0, -1},     {0, 0.001f, -1},
                                            {0.001f, 0, -1}, {nan, 0, -1}, {far, 0, -1}, {-far, far, -1}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}, {0, 3, 4}, {3, 4, 5}, {3, 4, 6}, {3, 7, 8}};
  VisibleTriangles visible;
  visible.select(positions, triangles, clip, 9, 9, Facing::clockwise);
  const std::vector<std::uint32_t> kept(visible.indices().begin(), visible.indices().end());
  for (const std::uint32_t i : {0u, 1u, 3u, 4u}) EXPECT_EQ(std::count(kept.begin(), kept.end(), i), 1) << i;
  EXPECT_TRUE(visible.select({}, {}, clip, 9, 9, Facing::any).empty());
}

}  // namespace
}  // namespace flexframe::render::test_visible
