// What is seen, and the light on it, worked out on the processor: against the definition of coverage, and against OpenGL.
#include "render/draw/raster.h"

#include "render/draw/renderer.h"
#include "render/frame/camera.h"
#include "render/image/image_compare.h"
#include "tests/unit/render_front.h"
#include "tests/unit/render_solids.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace flexframe::render::test_raster {
namespace {

std::array<std::int64_t, 2> fixed(const glm::vec3& p) { return {std::llround(256.0 * p.x - 128.0), std::llround(256.0 * p.y - 128.0)}; }

// The triangles alone, in samples, drawn by the raster: false where that leaves them to OpenGL.
bool draw(const std::vector<glm::vec3>& positions, const std::vector<glm::uvec3>& triangles, Samples& samples, Raster& raster) {
  Surface s;
  s.positions = positions;
  s.triangles = triangles;
  raster.start(samples, 0, 0, samples.width, samples.height);
  return raster.add(s, 1, clip_of(samples.width, samples.height), Facing::any);
}

// Whether the centre (x, y) lies strictly inside (1), on the rim (0) or outside (-1) of the triangle of corners rounded to 1/256 sample.
int side_of(const glm::vec3* v, int x, int y) {
  const std::array<std::int64_t, 2> p[3] = {fixed(v[0]), fixed(v[1]), fixed(v[2])};
  const auto cross = [](const auto& a, const auto& b, std::int64_t qx, std::int64_t qy) {
    return (b[0] - a[0]) * (qy - a[1]) - (qx - a[0]) * (b[1] - a[1]);
  };
  const std::int64_t area = cross(p[0], p[1], p[2][0], p[2][1]);
  if (area == 0) return -1;
  int least = 1;
  for (int k = 0; k < 3; ++k) {
    const std::int64_t d = cross(p[k], p[(k + 1) % 3], 256 * std::int64_t(x), 256 * std::int64_t(y)) * (area > 0 ? 1 : -1);
    least = std::min(least, d > 0 ? 1 : d < 0 ? -1 : 0);
  }
  return least;
}

// Truth: sides of the three edges in whole numbers; of what covers a sample strictly, the nearest.
TEST(Raster, NearestTriangleAtEverySample) {
  const int width = 60, height = 40;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> place(-20.0f, 80.0f), depth(0.05f, 0.95f);
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> triangles;
  for (unsigned i = 0; i < 300; ++i) {
    const float size = i % 3 == 0 ? 1.0f : 0.05f, ax = place(random), ay = place(random);
    for (int k = 0; k < 3; ++k) {
      const float x = place(random), y = place(random), z = depth(random);
      positions.emplace_back(ax + size * (x - 30.0f), ay + size * (y - 30.0f), z);
    }
    triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  Samples samples;
  samples.width = width;
  samples.height = height;
  Raster raster;
  ASSERT_TRUE(draw(positions, triangles, samples, raster));
  int looked_at = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double nearest = 0.0, second = 0.0;
      std::uint32_t id = 0;
      bool rim = false;
      for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const glm::vec3* v = &positions[3 * i];
        const int side = side_of(v, x, y);
        rim = rim || side == 0;
        if (side < 1) continue;
        const glm::dvec3 a(v[0]), b(v[1]), c(v[2]), n = glm::cross(b - a, c - a);
        const double z = a.z - (n.x * (x + 0.5 - a.x) + n.y * (y + 0.5 - a.y)) / n.z;
        if (z > nearest) second = nearest, nearest = z, id = i + 1;
        else second = std::max(second, z);
      }
      if (rim || nearest - second < 0.02) continue;  // slivers are not drawn beyond their corners
      ++looked_at;
      const std::size_t k = std::size_t(y) * width + x;
      EXPECT_EQ(raster.triangles()[k], id) << x << " " << y;
      if (id != 0) {
        EXPECT_NEAR(samples.depth[k], nearest, 5e-3);
      }
    }
  EXPECT_GT(looked_at, 1500);
}

// A net of triangles over the whole of the samples, many corners right on centres: every sample belongs to exactly one.
TEST(Raster, NoGapsAndNothingTwice) {
  const int cells = 12, width = 48, height = 48;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> off(-0.6f, 0.6f);
  std::vector<glm::vec3> positions;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      const float dx = off(random), dy = off(random), step = static_cast<float>(width) / cells;
      positions.emplace_back(step * static_cast<float>(i) + (inner ? dx : static_cast<float>(i ? 1 : -1)),
                             step * static_cast<float>(j) + (inner ? dy : static_cast<float>(j ? 1 : -1)), 0.5f);
      if (inner && (i + j) % 2) positions.back() = glm::vec3(glm::round(glm::vec2(positions.back())) + 0.5f, 0.5f);
    }
  std::vector<int> count(std::size_t(width) * height, 0);
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i)
      for (int half = 0; half < 2; ++half) {
        const auto a = static_cast<unsigned>(j * (cells + 1) + i), up = static_cast<unsigned>(cells + 1);
        const std::vector<glm::uvec3> one = {half ? glm::uvec3(a, a + up + 1, a + up) : glm::uvec3(a, a + 1, a + up + 1)};
        Samples samples;
        samples.width = width;
        samples.height = height;
        Raster raster;
        ASSERT_TRUE(draw(positions, one, samples, raster));
        for (std::size_t k = 0; k < count.size(); ++k) count[k] += raster.triangles()[k] != 0;
      }
  for (std::size_t k = 0; k < count.size(); ++k) ASSERT_EQ(count[k], 1) << k % width << " " << k / width;
}

TEST(Raster, WhatLiesBehindTheViewerIsLeftToOpenGl) {
  const std::vector<glm::vec3> positions = {{1, 1, 0.5f}, {5, 1, 0.5f}, {1, 5, 1.5f}};
  const std::vector<glm::uvec3> triangles = {{0, 1, 2}};
  Samples samples;
  samples.width = samples.height = 8;
  Raster raster;
  EXPECT_FALSE(draw(positions, triangles, samples, raster));
  EXPECT_TRUE(raster.parts().empty());
  std::vector<glm::vec3> none = positions;
  none[2] = glm::vec3(std::numeric_limits<float>::quiet_NaN(), 5.0f, 0.5f);
  EXPECT_FALSE(draw(none, triangles, samples, raster));
  EXPECT_EQ(std::count(raster.triangles().begin(), raster.triangles().end(), 0u), 64);
}

// Solids of all kinds of material, direction and value, with lines, symbols and a shell among them.
struct Scene {
  Shape ball = make_ball(0.5, 24), box = make_box({0.7, 0.5, 0.6}), disc = make_box({0.9, 0.9, 0.1});
  std::vector<float> scalars, lengths, stress;
  std::vector<glm::vec3> vectors, direct, shears, colors;
  Picture picture;
  explicit Scene(bool orthographic) {
    for (const glm::vec3& q : ball.positions) {
      scalars.push_back(q.y > 0.35f ? std::numeric_limits<float>::quiet_NaN() : q.x);
      colors.push_back(glm::vec3(0.5f) + 0.5f * q);
    }
    for (const glm::vec3& q : disc.positions) {
      vectors.emplace_back(-q.y, q.x, 0.0f);
      direct.emplace_back(q.x, -q.y, 0.1f);
      shears.emplace_back(0.2f * q.y, 0.1f, q.x);
      lengths.push_back(glm::length(vectors.back()));
      stress.push_back(0.0f);
    }
    picture.size = {480, 360};
    picture.background.top = picture.background.bottom = glm::vec3(0.9f);
    const auto put = [&](const Shape& shape, const glm::dvec3& at, const Material& material) -> Surface& {
      Surface s = surface_of(shape);
      s.pose[3] = glm::dvec4(at, 1.0);
      s.material = material;
      picture.surfaces.push_back(s);
      return picture.surfaces.back();
    };
    picture.surfaces.reserve(16);
    put(ball, {-1.2, 0.7, 0.0}, {{0.8f, 0.2f, 0.1f}, 0.4f, 0.0f}).seen_through = 0.3f;
    put(ball, {0.0, 0.7, 0.3}, {{0.9f, 0.8f, 0.5f}, 0.25f, 1.0f}).silhouette = true;
    put(ball, {1.2, 0.7, 0.0}, {}).scalars = scalars;
    put(ball, {-1.2, -0.6, 0.0}, {{1, 1, 1}, 0.7f, 0.3f}).colors = colors;
    Surface& flat = put(box, {0.0, -0.5, 0.0}, {{0.2f, 0.5f, 0.3f}, 0.45f, 0.0f});
    flat.normals = {};
    Surface& mirrored = put(box, {0.9, -0.4, 0.4}, {{0.3f, 0.3f, 0.8f}, 0.5f, 0.0f});
    mirrored.pose[0] = glm::dvec4(-0.8, 0.0, 0.5, 0.0);
    mirrored.pose[2] = glm::dvec4(0.5, 0.0, 0.8, 0.0);
    mirrored.two_sided = false;
    Surface& turning = put(disc, {1.6, -0.5, -0.3}, {});
    turning.scalars = lengths;
    turning.vectors = vectors;
    Surface& strained = put(disc, {-0.5, 0.1, -0.9}, {});
    strained.scalars = stress;
    strained.vectors = direct;
    strained.shears = shears;
    put(box, {-0.6, -0.6, 0.5}, {{0.7f, 0.7f, 0.2f}, 0.5f, 0.0f}).edges = true;
    put(ball, {0.4, 0.2, 0.8}, {{0.2f, 0.4f, 0.9f}, 0.5f, 0.0f}).opacity = 0.4f;
    picture.scalar_map = {Colormap::viridis, -0.4, 0.5, 0};
    picture.lines.push_back({.points = {{-1.5, -1, 0.2}, {1.5, 1, 0.2}}, .colors = {}, .faces = {}, .width = 3.0f, .seen_through = 0.3f});
    picture.markers.push_back({.points = {{0, 0, 0.6}, {0.5, 0.5, 1}}});
    std::vector<glm::dvec3> corners;
    picture.bounds.add(glm::dvec3(-1.9, -1.2, -1.1));
    picture.bounds.add(glm::dvec3(2.2, 1.3, 1.1));
    append_corners(corners, picture.bounds);
    picture.ground = default_ground(corners, glm::dvec3(0, 1, 0));
    picture.camera = fit_camera(picture, corners, default_view(corners, glm::dvec3(0)));
    if (orthographic) {
      picture.camera.projection = Projection::orthographic;
      picture.camera.height = 4.0;
    }
  }
};

// The gate of flexframe compare is what pictures of other processors must pass.
TEST(Raster, PicturesAgreeWithOpenGl) {
  Renderer opengl(Backend::osmesa, Solids::opengl);
  struct Case {
    bool orthographic, studio;
    int samples;
  };
  for (const Case c : {Case{false, true, 4}, Case{true, false, 1}, Case{true, true, 9}}) {
    Scene scene(c.orthographic);
    Picture& p = scene.picture;
    p.lighting.studio = p.scalar_map.lightened = c.studio;
    p.look.samples = c.samples;
    if (c.samples == 9) p.scalar_map.levels = 6;
    const Image here = renderer().draw(p), there = opengl.draw(p);
    // More single pixels than between two processors: a band's border at a sample's middle, 0.06 %.
    const ImageDifference difference = compare_images(there, here, {.gate = {.share = 1e-3}, .measures = false});
    EXPECT_TRUE(difference.passes) << c.orthographic << c.studio << c.samples << ": at most " << difference.largest << ", "
                                   << difference.pixels_over << " pixels, mean " << difference.mean;
    EXPECT_GT(difference.mean, 0.0);  // or it was not drawn here at all
  }
}

TEST(Raster, ViewersAmongTheThingsAgreeWithOpenGl) {
  Renderer opengl(Backend::osmesa, Solids::opengl);
  Scene scene(false);
  Picture& p = scene.picture;
  p.camera.position = {0.1, 0.1, 0.55};
  p.camera.target = {-0.6, -0.4, -0.6};
  p.camera.fov = 90.0;
  const ImageDifference difference = compare_images(opengl.draw(p), renderer().draw(p), {.gate = {.share = 5e-4}, .measures = false});
  EXPECT_TRUE(difference.passes) << "at most " << difference.largest << ", " << difference.pixels_over << " pixels";
}

}  // namespace
}  // namespace flexframe::render::test_raster
