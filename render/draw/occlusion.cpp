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

// A picture's occlusion step by step.
class Occlusion {
 public:
  Occlusion(const Samples& samples, const ViewFrame& frame, double radius, double strength)
      : samples_(samples),
        frame_(frame),
        radius_(static_cast<float>(radius)),
        strength_(static_cast<float>(strength)),
        pixel_(static_cast<float>(frame.pixel)) {
    // Only the part with surfaces and what is in reach of it, in whole patterns of 4 x 4 half pixels: what moves must not drag the
    // pattern along.
    px0_ = std::max(0, samples.part.x - 2 * most_reach) & ~7;
    py0_ = std::max(0, samples.part.y - 2 * most_reach) & ~7;
    px1_ = std::min(frame.area.width, samples.part.x + samples.part.width + 2 * most_reach);
    py1_ = std::min(frame.area.height, samples.part.y + samples.part.height + 2 * most_reach);
    left_ = static_cast<float>(px0_) + 0.5f - 0.5f * static_cast<float>(frame.area.width);
    top_ = static_cast<float>(py0_) + 0.5f - 0.5f * static_cast<float>(frame.area.height);
  }

  Mask make(const GroundFrame* ground) {
    Mask full;
    if (px1_ <= px0_ || py1_ <= py0_) return full;
    if (!take_distances()) return full;
    mark_tiles_in_reach();
    if (ground && ground->visible) add_ground(*ground);
    measure();
    if (!any_) return full;
    full.part = {px0_, py0_, px1_ - px0_, py1_ - py0_};
    full.values.assign(std::size_t(px1_ - px0_) * (py1_ - py0_), 255);
    to_pixels(smoothed(), full);
    return full;
  }

 private:
  static constexpr int most_reach = 48;  // half pixels
  using Pattern = std::array<glm::vec2, taps>;

  std::size_t index(int x, int y) const { return std::size_t(y) * half_.width + x; }
  std::uint8_t& tile_of(std::vector<std::uint8_t>& tiles, int x, int y) const { return tiles[std::size_t(y / 8) * tiles_x_ + x / 8]; }
  bool worked_on(int x, int y) const { return work_[std::size_t(y / 8) * tiles_x_ + x / 8] != 0; }

  float distance_of(float depth) const {
    const float near = static_cast<float>(frame_.near), far = static_cast<float>(frame_.far);
    return frame_.orthographic ? far - depth * (far - near) : near * far / (near + depth * (far - near));
  }
  float sample_depth(int px, int py) const {  // pixel of the area, from the top
    const int step = samples_.per_pixel;
    px -= samples_.part.x;
    py -= samples_.part.y;
    if (px < 0 || py < 0 || px >= samples_.part.width || py >= samples_.part.height) return 0.0f;
    return samples_.depth[std::size_t(samples_.height - 1 - (py * step + step / 2)) * samples_.width + (px * step + step / 2)];
  }
  // Reach in half pixels.
  float reach_at(float d) const {
    return std::clamp(radius_ / (pixel_ * 2.0f * (frame_.orthographic ? 1.0f : d)), 2.0f, static_cast<float>(most_reach));
  }
  // Position in the camera's frame of a half pixel.
  glm::vec3 position(int x, int y, float d) const {
    const float sx = (2.0f * static_cast<float>(x) + left_) * pixel_, sy = -(2.0f * static_cast<float>(y) + top_) * pixel_;
    return frame_.orthographic ? glm::vec3(sx, sy, -d) : glm::vec3(sx * d, sy * d, -d);
  }

  // Distances of every second pixel, and which tiles of 8 x 8 of them hold surfaces. False: none does.
  bool take_distances() {
    half_ = Half{(px1_ - px0_ + 1) / 2, (py1_ - py0_ + 1) / 2, {}, {}};
    half_.distance.assign(std::size_t(half_.width) * half_.height, nothing);
    half_.surface.assign(half_.distance.size(), 0);
    tiles_x_ = (half_.width + 7) / 8;
    tiles_y_ = (half_.height + 7) / 8;
    tile_.assign(std::size_t(tiles_x_) * tiles_y_, 0);
    for (int y = 0; y < half_.height; ++y)
      for (int x = 0; x < half_.width; ++x) {
        const float depth = sample_depth(px0_ + 2 * x, py0_ + 2 * y);
        if (depth <= 0.0f) continue;
        const float d = distance_of(depth);
        half_.distance[index(x, y)] = d;
        half_.surface[index(x, y)] = 1;
        tile_of(tile_, x, y) = 1;
        nearest_ = std::min(nearest_, d);
      }
    return nearest_ != nothing;
  }

  // Tiles within reach of a surface are worked on.
  void mark_tiles_in_reach() {
    const int spread = static_cast<int>(reach_at(nearest_)) / 8 + 1;
    work_.assign(tile_.size(), 0);
    for (int ty = 0; ty < tiles_y_; ++ty)
      for (int tx = 0; tx < tiles_x_; ++tx) {
        if (!tile_[std::size_t(ty) * tiles_x_ + tx]) continue;
        const int from = std::max(0, tx - spread), count = std::min(tiles_x_ - 1, tx + spread) - from + 1;
        for (int j = std::max(0, ty - spread); j <= std::min(tiles_y_ - 1, ty + spread); ++j)
          std::fill_n(&work_[std::size_t(j) * tiles_x_ + from], count, std::uint8_t(1));
      }
  }

  // Ground behind the pixels in reach.
  void add_ground(const GroundFrame& ground) {
    ground_normal_ = glm::vec3(glm::dmat3(frame_.view) * ground.normal);
    const glm::dvec3 du = glm::dmat3(frame_.view) * ground.axis_u, dv = glm::dmat3(frame_.view) * ground.axis_v;
    const glm::dvec3 o = glm::dvec3(frame_.view * glm::dvec4(ground.origin, 1.0));
    // Distance times w, and w: both linear in the pixel.
    const glm::dmat3& h = ground.pixel_to_ground;
    const auto pair = [&](const glm::dvec3& q) { return glm::dvec2(-(o.z * q.z + du.z * q.x + dv.z * q.y), q.z); };
    const glm::vec2 by_x(2.0 * pair(h[0]));
    for (int y = 0; y < half_.height; ++y) {
      const glm::vec2 first(pair(h * glm::dvec3(frame_.area.x + px0_ + 0.5, frame_.area.y + py0_ + 2 * y + 0.5, 1.0)));
      for (int x = 0; x < half_.width; ++x) {
        float& d = half_.distance[index(x, y)];
        if (d != nothing || !worked_on(x, y)) continue;
        const glm::vec2 q = first + static_cast<float>(x) * by_x;
        if (q.y > 0.0f) d = q.x / q.y;
      }
    }
  }

  static std::array<Pattern, 16> spirals() {
    std::array<Pattern, 16> out;
    for (int r = 0; r < 16; ++r)
      for (int i = 0; i < taps; ++i) {
        const float angle = 2.39996323f * static_cast<float>(i) + 6.2831853f * static_cast<float>((r * 7) % 16) / 16.0f;
        const float length = std::sqrt((static_cast<float>(i) + 0.6f) / static_cast<float>(taps));
        out[r][i] = length * glm::vec2(std::cos(angle), std::sin(angle));
      }
    return out;
  }

  // From the neighbours nearer in depth: it does not cross silhouettes. Zero: none can be told.
  glm::vec3 surface_normal(int x, int y, float d, const glm::vec3& p) const {
    const float l = half_.at(x - 1, y), r = half_.at(x + 1, y), u = half_.at(x, y - 1), b = half_.at(x, y + 1);
    const bool leftward = std::abs(l - d) < std::abs(r - d), upper = std::abs(u - d) < std::abs(b - d);
    const glm::vec3 dx = leftward ? p - position(x - 1, y, l) : position(x + 1, y, r) - p;
    const glm::vec3 dy = upper ? position(x, y - 1, u) - p : p - position(x, y + 1, b);
    const glm::vec3 normal = glm::cross(dx, dy);
    const float length = glm::length(normal);
    if (!(length > 0.0f) || length > 1e20f) return glm::vec3(0.0f);
    return normal / length;
  }

  // Sum over the samples around a half pixel at p of how much each takes away.
  float blocked(int x, int y, const glm::vec3& p, const glm::vec3& normal, const Pattern& pattern) const {
    const bool surface = half_.surface[index(x, y)];
    const float reach = reach_at(half_.distance[index(x, y)]), inverse_range2 = 1.0f / (radius_ * radius_);
    float sum = 0.0f;
    for (int i = 0; i < taps; ++i) {
      const int qx = x + nearest_int(pattern[i].x * reach), qy = y + nearest_int(pattern[i].y * reach);
      if (qx < 0 || qy < 0 || qx >= half_.width || qy >= half_.height) continue;
      const std::size_t kq = index(qx, qy);
      const float dq = half_.distance[kq];
      if (dq == nothing || (!surface && !half_.surface[kq])) continue;
      const glm::vec3 v = position(qx, qy, dq) - p;
      const float square = glm::dot(v, v);
      const float fall = 1.0f - square * inverse_range2, height = glm::dot(v, normal);
      // Most lie level with the surface or below it: no root for them. sin of 7 degrees.
      if (fall <= 0.0f || height <= 0.0f || height * height <= 0.0144f * square) continue;
      sum += (height / std::sqrt(square) - 0.12f) * fall;
    }
    return sum;
  }

  float open_share(int x, int y, const std::array<Pattern, 16>& spiral) const {
    const std::size_t k = index(x, y);
    const float d = half_.distance[k];
    if (d == nothing) return 1.0f;
    const glm::vec3 p = position(x, y, d);
    const glm::vec3 normal = half_.surface[k] ? surface_normal(x, y, d, p) : ground_normal_;
    if (normal == glm::vec3(0.0f)) return 1.0f;
    return std::max(0.0f, 1.0f - strength_ * blocked(x, y, p, normal, spiral[(y & 3) * 4 + (x & 3)]) / static_cast<float>(taps));
  }

  std::uint8_t& block_of(std::vector<std::uint8_t>& blocks, int x, int y) const { return blocks[std::size_t(y / 4) * blocks_x_ + x / 4]; }
  // Whether a block of 4 x 4 half pixels or one beside it is set.
  bool near_block(const std::vector<std::uint8_t>& blocks, int bx, int by) const {
    for (int j = std::max(0, by - 1); j <= std::min(blocks_y_ - 1, by + 1); ++j)
      for (int i = std::max(0, bx - 1); i <= std::min(blocks_x_ - 1, bx + 1); ++i)
        if (blocks[std::size_t(j) * blocks_x_ + i]) return true;
    return false;
  }

  // Half of the half pixels, as the white fields of a chessboard lie: their eight patterns in a block of 4 x 4 look in 96 directions and
  // distances, which the mean over such a block joins.
  static bool measured(int x, int y) { return ((x ^ y) & 1) == 0; }

  // Open share of those: first of four in a block of 4 x 4; of the others where one of these, or of a block beside, found something in
  // reach. Plain faces and what bulges out are open all over.
  void measure() {
    const std::array<Pattern, 16> spiral = spirals();
    blocks_x_ = (half_.width + 3) / 4;
    blocks_y_ = (half_.height + 3) / 4;
    open_.assign(half_.distance.size(), 1.0f);
    std::vector<std::uint8_t> found(std::size_t(blocks_x_) * blocks_y_, 0);
    const auto first_pass = [](int x, int y) { return ((x | y) & 1) == 0; };
    for (int y = 0; y < half_.height; y += 2)
      for (int x = 0; x < half_.width; x += 2) {
        if (!worked_on(x, y)) continue;
        const float open = open_share(x, y, spiral);
        if (open < 1.0f) open_[index(x, y)] = open, block_of(found, x, y) = 1;
      }
    reached_.assign(found.size(), 0);
    for (int by = 0; by < blocks_y_; ++by)
      for (int bx = 0; bx < blocks_x_; ++bx) {
        if (!near_block(found, bx, by)) continue;
        reached_[std::size_t(by) * blocks_x_ + bx] = 1;
        any_ = true;
        for (int y = 4 * by; y < std::min(4 * by + 4, half_.height); ++y)
          for (int x = 4 * bx; x < std::min(4 * bx + 4, half_.width); ++x)
            if (measured(x, y) && !first_pass(x, y) && worked_on(x, y)) open_[index(x, y)] = open_share(x, y, spiral);
      }
  }

  // Mean over the 4 x 4 pattern, over like depths only.
  std::vector<float> smoothed() const {
    std::vector<float> smooth = open_;
    const float inverse_radius = 1.0f / radius_;
    for (int by = 0; by < blocks_y_; ++by)
      for (int bx = 0; bx < blocks_x_; ++bx) {
        if (!near_block(reached_, bx, by)) continue;
        for (int y = 4 * by; y < std::min(4 * by + 4, half_.height); ++y)
          for (int x = 4 * bx; x < std::min(4 * bx + 4, half_.width); ++x) {
            const float d = half_.distance[index(x, y)];
            if (d == nothing) continue;
            float sum = 0.0f, weight = 0.0f;
            for (int qy = std::max(0, y - 2); qy < std::min(y + 2, half_.height); ++qy)
              for (int qx = std::max(0, x - 2); qx < std::min(x + 2, half_.width); ++qx) {
                if (!measured(qx, qy)) continue;
                const std::size_t kq = index(qx, qy);
                const float like = std::max(0.0f, 1.0f - std::abs(half_.distance[kq] - d) * inverse_radius);
                sum += like * open_[kq];
                weight += like;
              }
            if (weight > 0.0f) smooth[index(x, y)] = sum / weight;
          }
      }
    return smooth;
  }

  // Back to pixels, again over like depths: the occlusion of a body does not spill over its edge.
  void to_pixels(const std::vector<float>& smooth, Mask& full) const {
    const float inverse_radius = 1.0f / radius_;
    for (int by = 0; by < blocks_y_; ++by)
      for (int bx = 0; bx < blocks_x_; ++bx) {
        if (!near_block(reached_, bx, by)) continue;
        for (int y = py0_ + 8 * by; y < std::min(py0_ + 8 * by + 8, py1_); ++y)
          for (int x = px0_ + 8 * bx; x < std::min(px0_ + 8 * bx + 8, px1_); ++x) {
            const int hx = (x - px0_) / 2, hy = (y - py0_) / 2;
            const std::size_t right = static_cast<std::size_t>(hx + 1 < half_.width), below = hy + 1 < half_.height ? half_.width : 0u;
            const float* corner = &smooth[index(hx, hy)];
            if (corner[0] + corner[right] + corner[below] + corner[below + right] == 4.0f) continue;  // open already
            const float depth = sample_depth(x, y);
            const bool on_surface = depth > 0.0f;
            const float d = on_surface ? distance_of(depth) : 0.0f;
            float sum = 0.0f, weight = 0.0f;
            for (int j = 0; j <= 1; ++j)
              for (int i = 0; i <= 1; ++i) {
                const std::size_t kq = index(std::min(hx + i, half_.width - 1), std::min(hy + j, half_.height - 1));
                if (half_.distance[kq] == nothing || (half_.surface[kq] != 0) != on_surface) continue;
                const float bilinear = (i == (x & 1) || (x & 1) ? 1.0f : 1e-3f) * (j == (y & 1) || (y & 1) ? 1.0f : 1e-3f);
                const float like = on_surface ? std::max(1e-3f, 1.0f - std::abs(half_.distance[kq] - d) * inverse_radius) : 1.0f;
                sum += bilinear * like * smooth[kq];
                weight += bilinear * like;
              }
            if (weight <= 0.0f) continue;
            full.values[std::size_t(y - py0_) * (px1_ - px0_) + (x - px0_)] =
                static_cast<std::uint8_t>(rounded(255.0f * std::clamp(sum / weight, 0.0f, 1.0f)));
          }
      }
  }

  const Samples& samples_;
  const ViewFrame& frame_;
  const float radius_, strength_, pixel_;
  int px0_, py0_, px1_, py1_;  // the part of the area that is looked at
  float left_, top_;
  Half half_;
  int tiles_x_ = 0, tiles_y_ = 0;
  std::vector<std::uint8_t> tile_, work_;
  int blocks_x_ = 0, blocks_y_ = 0;
  std::vector<std::uint8_t> reached_;  // blocks of 4 x 4 half pixels where something is in reach
  bool any_ = false;
  float nearest_ = nothing;
  glm::vec3 ground_normal_ = glm::vec3(0.0f);
  std::vector<float> open_;
};

}  // namespace

Mask compute_occlusion(const Samples& samples, const ViewFrame& frame, const GroundFrame* ground, double radius, double strength) {
  return Occlusion(samples, frame, radius, strength).make(ground);
}

}  // namespace flexframe::render
