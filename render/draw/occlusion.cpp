#include "render/draw/occlusion.h"

#include "render/base/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::render {
namespace {

constexpr int taps = 12;
constexpr float nothing = 1e30f;

struct Half {
  int width = 0, height = 0;
  std::vector<float> distance;        // from the camera's plane, m; nothing: no surface, no ground
  std::vector<std::uint8_t> surface;  // 1: a surface, 0: ground or nothing
  float at(int x, int y) const { return distance[std::size_t(std::clamp(y, 0, height - 1)) * width + std::clamp(x, 0, width - 1)]; }
};

// For -1000 < v: without the calls of std::lround.
int nearest_int(float v) { return static_cast<int>(v + 1000.5f) - 1000; }

}  // namespace

Mask compute_occlusion(const Samples& samples, const ViewFrame& frame, const GroundFrame* ground, double radius) {
  const int w = frame.area.width, h = frame.area.height;
  Mask full;
  const int step = samples.per_pixel;
  const float near = static_cast<float>(frame.near), far = static_cast<float>(frame.far);
  const auto distance_of = [&](float depth) {
    return frame.orthographic ? far - depth * (far - near) : near * far / (near + depth * (far - near));
  };
  const auto sample_depth = [&](int px, int py) {  // pixel of the area, from the top
    px -= samples.part.x;
    py -= samples.part.y;
    if (px < 0 || py < 0 || px >= samples.part.width || py >= samples.part.height) return 0.0f;
    return samples.depth[std::size_t(samples.height - 1 - (py * step + step / 2)) * samples.width + (px * step + step / 2)];
  };

  // Distances of every second pixel, and which tiles of 8 x 8 of them hold surfaces.
  // Only the part with surfaces and what is in reach of it.
  constexpr int most = 48;  // reach, half pixels
  // Whole patterns of 4 x 4 half pixels: what moves must not drag the pattern along.
  const int px0 = std::max(0, samples.part.x - 2 * most) & ~7, py0 = std::max(0, samples.part.y - 2 * most) & ~7;
  const int px1 = std::min(w, samples.part.x + samples.part.width + 2 * most), py1 = std::min(h, samples.part.y + samples.part.height + 2 * most);
  if (px1 <= px0 || py1 <= py0) return full;
  Half half{(px1 - px0 + 1) / 2, (py1 - py0 + 1) / 2, {}, {}};
  half.distance.assign(std::size_t(half.width) * half.height, nothing);
  half.surface.assign(half.distance.size(), 0);
  const int tiles_x = (half.width + 7) / 8, tiles_y = (half.height + 7) / 8;
  std::vector<std::uint8_t> tile(std::size_t(tiles_x) * tiles_y, 0);
  float nearest = nothing;
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      const float depth = sample_depth(px0 + 2 * x, py0 + 2 * y);
      if (depth <= 0.0f) continue;
      const float d = distance_of(depth);
      half.distance[std::size_t(y) * half.width + x] = d;
      half.surface[std::size_t(y) * half.width + x] = 1;
      tile[std::size_t(y / 8) * tiles_x + x / 8] = 1;
      nearest = std::min(nearest, d);
    }
  if (nearest == nothing) return full;
  full.part = {px0, py0, px1 - px0, py1 - py0};
  full.values.assign(std::size_t(px1 - px0) * (py1 - py0), 255);

  // Reach in half pixels; tiles within reach of a surface are worked on.
  const float pixel = static_cast<float>(frame.pixel);
  const auto reach_at = [&](float d) { return std::clamp(static_cast<float>(radius) / (pixel * 2.0f * (frame.orthographic ? 1.0f : d)), 2.0f, static_cast<float>(most)); };
  const int spread = static_cast<int>(reach_at(nearest)) / 8 + 1;
  std::vector<std::uint8_t> work(tile.size(), 0);
  for (int ty = 0; ty < tiles_y; ++ty)
    for (int tx = 0; tx < tiles_x; ++tx)
      if (tile[std::size_t(ty) * tiles_x + tx])
        for (int j = std::max(0, ty - spread); j <= std::min(tiles_y - 1, ty + spread); ++j)
          std::fill_n(&work[std::size_t(j) * tiles_x + std::max(0, tx - spread)], std::min(tiles_x - 1, tx + spread) - std::max(0, tx - spread) + 1, std::uint8_t(1));

  // Ground behind the pixels in reach.
  glm::vec3 ground_normal(0.0f);
  if (ground && ground->visible) {
    ground_normal = glm::vec3(glm::dmat3(frame.view) * ground->normal);
    const glm::dvec3 du = glm::dmat3(frame.view) * ground->axis_u, dv = glm::dmat3(frame.view) * ground->axis_v;
    const glm::dvec3 o = glm::dvec3(frame.view * glm::dvec4(ground->origin, 1.0));
    for (int y = 0; y < half.height; ++y)
      for (int x = 0; x < half.width; ++x) {
        float& d = half.distance[std::size_t(y) * half.width + x];
        if (d != nothing || !work[std::size_t(y / 8) * tiles_x + x / 8]) continue;
        const glm::dvec3 q = ground->pixel_to_ground * glm::dvec3(frame.area.x + px0 + 2 * x + 0.5, frame.area.y + py0 + 2 * y + 0.5, 1.0);
        if (q.z > 0.0) d = static_cast<float>(-(o.z + du.z * q.x / q.z + dv.z * q.y / q.z));
      }
  }

  // Position in the camera's frame of a half pixel.
  const float left = static_cast<float>(px0) + 0.5f - 0.5f * static_cast<float>(w), top = static_cast<float>(py0) + 0.5f - 0.5f * static_cast<float>(h);
  const auto position = [&](float x, float y, float d) {
    const float sx = (2.0f * x + left) * pixel, sy = -(2.0f * y + top) * pixel;
    return frame.orthographic ? glm::vec3(sx, sy, -d) : glm::vec3(sx * d, sy * d, -d);
  };
  std::array<std::array<glm::vec2, taps>, 16> spiral;
  for (int r = 0; r < 16; ++r)
    for (int i = 0; i < taps; ++i) {
      const float angle = 2.39996323f * static_cast<float>(i) + 6.2831853f * static_cast<float>((r * 7) % 16) / 16.0f;
      const float length = std::sqrt((static_cast<float>(i) + 0.6f) / static_cast<float>(taps));
      spiral[r][i] = length * glm::vec2(std::cos(angle), std::sin(angle));
    }

  std::vector<float> open(half.distance.size(), 1.0f);
  const float range = static_cast<float>(radius), inverse_range2 = 1.0f / (range * range);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      if (!work[std::size_t(y / 8) * tiles_x + x / 8]) continue;
      const std::size_t k = std::size_t(y) * half.width + x;
      const float d = half.distance[k];
      if (d == nothing) continue;
      const glm::vec3 p = position(static_cast<float>(x), static_cast<float>(y), d);
      glm::vec3 normal = ground_normal;
      if (half.surface[k]) {
        // Normal from the neighbours nearer in depth: it does not cross silhouettes.
        const float l = half.at(x - 1, y), r = half.at(x + 1, y), u = half.at(x, y - 1), b = half.at(x, y + 1);
        const bool leftward = std::abs(l - d) < std::abs(r - d), upper = std::abs(u - d) < std::abs(b - d);
        const glm::vec3 dx = leftward ? p - position(static_cast<float>(x - 1), static_cast<float>(y), l) : position(static_cast<float>(x + 1), static_cast<float>(y), r) - p;
        const glm::vec3 dy = upper ? position(static_cast<float>(x), static_cast<float>(y - 1), u) - p : p - position(static_cast<float>(x), static_cast<float>(y + 1), b);
        normal = glm::cross(dx, dy);
        const float length = glm::length(normal);
        if (!(length > 0.0f) || length > 1e20f) continue;
        normal /= length;
      }
      const float reach = reach_at(d);
      const auto& pattern = spiral[(y & 3) * 4 + (x & 3)];
      float blocked = 0.0f;
      for (int i = 0; i < taps; ++i) {
        const int qx = x + nearest_int(pattern[i].x * reach), qy = y + nearest_int(pattern[i].y * reach);
        if (qx < 0 || qy < 0 || qx >= half.width || qy >= half.height) continue;
        const std::size_t kq = std::size_t(qy) * half.width + qx;
        const float dq = half.distance[kq];
        if (dq == nothing || (!half.surface[k] && !half.surface[kq])) continue;
        const glm::vec3 v = position(static_cast<float>(qx), static_cast<float>(qy), dq) - p;
        const float square = glm::dot(v, v);
        const float fall = 1.0f - square * inverse_range2;
        if (fall <= 0.0f || square <= 0.0f) continue;
        blocked += std::max(0.0f, glm::dot(v, normal) / std::sqrt(square) - 0.12f) * fall;
      }
      open[k] = std::max(0.0f, 1.0f - 2.2f * blocked / static_cast<float>(taps));
    }

  // Mean over the 4 x 4 pattern, over like depths only.
  std::vector<float> smooth = open;
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      if (!work[std::size_t(y / 8) * tiles_x + x / 8]) continue;
      const float d = half.distance[std::size_t(y) * half.width + x];
      if (d == nothing) continue;
      float sum = 0.0f, weight = 0.0f;
      for (int j = -2; j < 2; ++j)
        for (int i = -2; i < 2; ++i) {
          const int qx = std::clamp(x + i, 0, half.width - 1), qy = std::clamp(y + j, 0, half.height - 1);
          const std::size_t kq = std::size_t(qy) * half.width + qx;
          const float like = std::max(0.0f, 1.0f - std::abs(half.distance[kq] - d) / range);
          sum += like * open[kq];
          weight += like;
        }
      if (weight > 0.0f) smooth[std::size_t(y) * half.width + x] = sum / weight;
    }

  // Back to pixels, again over like depths: the occlusion of a body does not spill over its edge.
  for (int y = py0; y < py1; ++y)
    for (int x = px0; x < px1; ++x) {
      const int hx = (x - px0) / 2, hy = (y - py0) / 2;
      if (!work[std::size_t(hy / 8) * tiles_x + hx / 8]) continue;
      const float depth = sample_depth(x, y);
      const bool on_surface = depth > 0.0f;
      const float d = on_surface ? distance_of(depth) : 0.0f;
      float sum = 0.0f, weight = 0.0f;
      for (int j = 0; j <= 1; ++j)
        for (int i = 0; i <= 1; ++i) {
          const int qx = std::min(hx + i, half.width - 1), qy = std::min(hy + j, half.height - 1);
          const std::size_t kq = std::size_t(qy) * half.width + qx;
          if (half.distance[kq] == nothing || (half.surface[kq] != 0) != on_surface) continue;
          const float bilinear = (i == (x & 1) || (x & 1) ? 1.0f : 1e-3f) * (j == (y & 1) || (y & 1) ? 1.0f : 1e-3f);
          const float like = on_surface ? std::max(1e-3f, 1.0f - std::abs(half.distance[kq] - d) / range) : 1.0f;
          sum += bilinear * like * smooth[kq];
          weight += bilinear * like;
        }
      if (weight > 0.0f) full.values[std::size_t(y - py0) * (px1 - px0) + (x - px0)] = static_cast<std::uint8_t>(rounded(255.0f * std::clamp(sum / weight, 0.0f, 1.0f)));
    }
  return full;
}

}  // namespace flexframe::render
