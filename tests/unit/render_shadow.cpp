// Depth of casters seen from the light, against planes and spheres by formula.
#include "render/draw/shadow.h"
#include "tests/unit/render_solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace flexframe::render::test_shadow {
namespace {

ShadowMap drawn(const Surface& s, const LightFrame& light) {
  const std::vector<Bounds> boxes = {compute_bounds(s.positions)};
  ShadowMap map = shadow_part(std::span(&s, 1), boxes, light);
  CasterDepth depth;
  depth.start(map);
  depth.add(s, light);
  depth.reduce(map);
  return map;
}

// A sheet of crooked triangles, some slivers, seen at a slant: no gap through which light falls, and the depth of its plane.
TEST(CasterDepth, ASheetOfTrianglesHasNoGaps) {
  constexpr int n = 60;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> shift(-0.45f, 0.45f);
  std::vector<glm::vec3> positions;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const bool rim = i == 0 || j == 0 || i == n || j == n;
      const glm::vec2 at(static_cast<float>(i) + (rim ? 0.0f : shift(random)),
                         static_cast<float>(j) + (rim ? 0.0f : 1.05f * shift(random)));
      positions.emplace_back(at.x / n, 0.3f * at.x / n, at.y / n);
    }
  std::vector<glm::uvec3> triangles;
  for (unsigned j = 0; j < n; ++j)
    for (unsigned i = 0; i < n; ++i) {
      const unsigned a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      triangles.insert(triangles.end(), {{a, b, c}, {b, d, c}});
    }
  Surface s;
  s.positions = positions;
  s.triangles = triangles;
  const LightFrame light = make_light(glm::dvec3(0.3, 1.0, 0.2), compute_bounds(positions));
  const ShadowMap map = drawn(s, light);
  const glm::dmat4 world = glm::inverse(light.map_from_world);
  int inside = 0;
  for (int y = 0; y < map.height / 2; ++y)
    for (int x = 0; x < map.width / 2; ++x) {
      const ShadowMap::Texel& texel = map.texels[std::size_t(y) * (map.width / 2) + x];
      // The ray through the middle of the texel meets the plane y = 0.3 x at this depth.
      const double u = (map.x / 2 + x + 0.5) / filtered_size, v = (map.y / 2 + y + 0.5) / filtered_size;
      const glm::dvec3 a(world * glm::dvec4(u, v, 0.0, 1.0)), b(world * glm::dvec4(u, v, 1.0, 1.0));
      const double fa = a.y - 0.3 * a.x, fb = b.y - 0.3 * b.x, t = fa / (fa - fb);
      const glm::dvec3 hit = a + t * (b - a);
      const double rim = std::min({hit.x, hit.z, 1.0 - hit.x, 1.0 - hit.z});
      if (rim > 4.0 * light.texel) {
        ++inside;
        ASSERT_EQ(texel.cover, 1.0f) << x << ' ' << y;
        ASSERT_NEAR(texel.depth, t, 2e-5) << x << ' ' << y;
      } else if (rim < -4.0 * light.texel) {
        ASSERT_EQ(texel.cover, 0.0f) << x << ' ' << y;
      }
    }
  EXPECT_GT(inside, 50000);
}

// Of a closed mesh the side towards the light, wherever the pose mirrors it to.
TEST(CasterDepth, ASphereIsNearestAsItsFormulaSays) {
  const Shape ball = make_ball(0.5, 96);
  for (const double mirror : {1.0, -1.0}) {
    Surface s;
    s.positions = ball.positions;
    s.triangles = ball.triangles;
    s.two_sided = false;
    s.pose = glm::dmat4(1.0);
    s.pose[0][0] = mirror;
    s.pose[3] = glm::dvec4(0.2, 0.1, -0.3, 1.0);
    const glm::dvec3 centre(0.2, 0.1, -0.3);
    const LightFrame light = make_light(glm::dvec3(-0.4, 1.0, 0.5), compute_bounds(s.positions, s.pose));
    const ShadowMap map = drawn(s, light);
    int seen = 0;
    for (int y = 0; y < map.height / 2; ++y)
      for (int x = 0; x < map.width / 2; ++x) {
        const glm::dvec3 middle(light.map_from_world * glm::dvec4(centre, 1.0));
        const double span = light.texel * shadow_size;
        const double du = ((map.x / 2 + x + 0.5) / filtered_size - middle.x) * span,
                     dv = ((map.y / 2 + y + 0.5) / filtered_size - middle.y) * span;
        const double left = 0.25 - du * du - dv * dv;
        if (left < 0.02) continue;
        ++seen;
        const ShadowMap::Texel& texel = map.texels[std::size_t(y) * (map.width / 2) + x];
        ASSERT_EQ(texel.cover, 1.0f);
        // Facets lie below the sphere by half a step squared over eight radii and more where it is steep.
        ASSERT_NEAR(texel.depth, middle.z - std::sqrt(left) / light.depth_range, 4e-3) << du << ' ' << dv;
      }
    EXPECT_GT(seen, 50000);
  }
}

}  // namespace
}  // namespace flexframe::render::test_shadow
