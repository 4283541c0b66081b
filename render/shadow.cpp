#include "render/shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::render {
namespace {

constexpr int n = filtered_size, fine = shadow_size, ratio = shadow_size / filtered_size;

// Texels [x0, x1) x [y0, y1) of a map.
struct Patch {
  int x0 = n, y0 = n, x1 = 0, y1 = 0;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  Patch grown(int r) const { return {std::max(0, x0 - r), std::max(0, y0 - r), std::min(n, x1 + r), std::min(n, y1 + r)}; }
};

// Texels of the filtered map that have a caster.
Patch occupied(const std::vector<float>& depth) {
  Patch p;
  for (int y = 0; y < fine; ++y) {
    const float* row = &depth[std::size_t(y) * fine];
    int first = 0, last = fine - 1;
    while (first < fine && row[first] >= 1.0f) ++first;
    if (first == fine) continue;
    while (row[last] >= 1.0f) --last;
    p.x0 = std::min(p.x0, first / ratio);
    p.x1 = std::max(p.x1, last / ratio + 1);
    p.y0 = std::min(p.y0, y / ratio);
    p.y1 = std::max(p.y1, y / ratio + 1);
  }
  return p;
}

// Mean over 2 r + 1 values along rows and columns, twice: close to a Gaussian. `lanes` floats a texel. Values outside the
// patch are constant (`around`, one a lane); the patch must already be grown by 2 r where it can.
template <int lanes>
void blur(std::vector<float>& values, const Patch& patch, int r, const std::array<float, lanes>& around) {
  if (r < 1 || patch.empty()) return;
  const int w = patch.x1 - patch.x0, h = patch.y1 - patch.y0;
  const double share = 1.0 / (2 * r + 1);
  std::vector<float> line(std::size_t(w) * lanes), source(std::size_t(w) * h * lanes);
  std::vector<double> sum(std::size_t(w) * lanes);
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = patch.y0; y < patch.y1; ++y) {
      float* row = &values[(std::size_t(y) * n + patch.x0) * lanes];
      std::copy_n(row, w * lanes, line.begin());
      double run[lanes];
      for (int k = 0; k < lanes; ++k) {
        run[k] = static_cast<double>(around[k]) * r;
        for (int i = 0; i <= r; ++i) run[k] += static_cast<double>(i < w ? line[std::size_t(i) * lanes + k] : around[k]);
      }
      for (int x = 0; x < w; ++x)
        for (int k = 0; k < lanes; ++k) {
          row[x * lanes + k] = static_cast<float>(run[k] * share);
          const float in = x + r + 1 < w ? line[std::size_t(x + r + 1) * lanes + k] : around[k];
          const float out = x - r >= 0 ? line[std::size_t(x - r) * lanes + k] : around[k];
          run[k] += static_cast<double>(in) - static_cast<double>(out);
        }
    }
    // Columns: a running sum of whole rows, so that memory is walked in order.
    const std::size_t width = std::size_t(w) * lanes;
    for (int y = 0; y < h; ++y) std::copy_n(&values[(std::size_t(y + patch.y0) * n + patch.x0) * lanes], width, &source[std::size_t(y) * width]);
    for (std::size_t k = 0; k < width; ++k) sum[k] = static_cast<double>(around[k % lanes]) * r;
    for (int i = 0; i <= r; ++i)
      for (std::size_t k = 0; k < width; ++k) sum[k] += static_cast<double>(i < h ? source[std::size_t(i) * width + k] : around[k % lanes]);
    for (int y = 0; y < h; ++y) {
      float* row = &values[(std::size_t(y + patch.y0) * n + patch.x0) * lanes];
      const float* in = y + r + 1 < h ? &source[std::size_t(y + r + 1) * width] : nullptr;
      const float* out = y - r >= 0 ? &source[std::size_t(y - r) * width] : nullptr;
      for (std::size_t k = 0; k < width; ++k) {
        row[k] = static_cast<float>(sum[k] * share);
        sum[k] += static_cast<double>(in ? in[k] : around[k % lanes]) - static_cast<double>(out ? out[k] : around[k % lanes]);
      }
    }
  }
}

float at(const std::vector<float>& values, double x, double y) {
  const double fx = x * n - 0.5, fy = y * n - 0.5;
  const int x0 = static_cast<int>(std::floor(fx)), y0 = static_cast<int>(std::floor(fy));
  const float ax = static_cast<float>(fx - x0), ay = static_cast<float>(fy - y0);
  const auto value = [&](int i, int j) { return values[std::size_t(std::clamp(j, 0, n - 1)) * n + std::clamp(i, 0, n - 1)]; };
  const float low = value(x0, y0) + (value(x0 + 1, y0) - value(x0, y0)) * ax;
  const float high = value(x0, y0 + 1) + (value(x0 + 1, y0 + 1) - value(x0, y0 + 1)) * ax;
  return low + (high - low) * ay;
}

}  // namespace

LightFrame make_light(const glm::dvec3& to_light, const Bounds& bounds) {
  LightFrame light;
  light.to_light = glm::normalize(to_light);
  const glm::dvec3 reference = std::abs(light.to_light.y) < 0.95 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  const glm::dvec3 side = glm::normalize(glm::cross(reference, light.to_light)), rise = glm::cross(light.to_light, side);
  glm::dvec3 lower(1e300), upper(-1e300);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 c(i & 1 ? bounds.upper.x : bounds.lower.x, i & 2 ? bounds.upper.y : bounds.lower.y, i & 4 ? bounds.upper.z : bounds.lower.z);
    const glm::dvec3 p(glm::dot(side, c), glm::dot(rise, c), -glm::dot(light.to_light, c));
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  // Square texels, a rim that stays empty, and room for the blur.
  const glm::dvec3 middle = 0.5 * (lower + upper);
  const double span = std::max({upper.x - lower.x, upper.y - lower.y, 1e-9}) * 1.12;
  const double range = std::max(upper.z - lower.z, 1e-3 * span) * 1.04;
  light.texel = span / fine;
  light.depth_range = range;
  glm::dmat4 m(0.0);
  for (int k = 0; k < 3; ++k) {
    m[k][0] = side[k] / span;
    m[k][1] = rise[k] / span;
    m[k][2] = -light.to_light[k] / range;
  }
  m[3] = glm::dvec4(0.5 - middle.x / span, 0.5 - middle.y / span, 0.5 - middle.z / range, 1.0);
  light.map_from_world = m;
  return light;
}

std::vector<float> filter_shadow(const std::vector<float>& depth, const LightFrame& light, double radius) {
  // Empty texels are many: their value once.
  const float empty = std::exp(shadow_warp * 0.5f);
  std::vector<float> moments(std::size_t(n) * n * 2);
  for (std::size_t i = 0; i < moments.size(); i += 2) {
    moments[i] = empty;
    moments[i + 1] = empty * empty;
  }
  const Patch patch = occupied(depth);
  for (int y = patch.y0; y < patch.y1; ++y)
    for (int x = patch.x0; x < patch.x1; ++x) {
      float first = 0.0f, second = 0.0f;
      for (int j = 0; j < ratio; ++j)
        for (int i = 0; i < ratio; ++i) {
          const float d = depth[std::size_t(y * ratio + j) * fine + (x * ratio + i)];
          const float m = d >= 1.0f ? empty : std::exp(shadow_warp * (d - 0.5f));
          first += m;
          second += m * m;
        }
      moments[2 * (std::size_t(y) * n + x)] = first / (ratio * ratio);
      moments[2 * (std::size_t(y) * n + x) + 1] = second / (ratio * ratio);
    }
  const int r = std::clamp(static_cast<int>(std::lround(0.5 * radius / (light.texel * ratio))), 1, 16);
  blur<2>(moments, patch.grown(2 * r), r, {empty, empty * empty});
  return moments;
}

std::vector<std::uint8_t> ground_shadow(const std::vector<float>& depth, const LightFrame& light, const GroundFrame& ground,
                                        const ViewFrame& frame, double radius) {
  const PixelRect& area = frame.area;
  std::vector<std::uint8_t> shadow(std::size_t(area.width) * area.height, 0);
  const double steep = glm::dot(light.to_light, ground.normal);
  if (!ground.visible || steep < 0.05) return shadow;

  // Ground in map coordinates: (s, t, depth) is linear in (u, v).
  const auto map = [&](const glm::dvec3& v, double w) { return glm::dvec3(light.map_from_world * glm::dvec4(v, w)); };
  const glm::dvec3 mu = map(ground.axis_u, 0.0), mv = map(ground.axis_v, 0.0), mo = map(ground.origin, 1.0);
  const double det = mu.x * mv.y - mv.x * mu.y;
  // Depth of the ground by (s, t): solve the two first rows for (u, v).
  const double ds = (mu.z * mv.y - mv.z * mu.y) / det, dt = (mv.z * mu.x - mu.z * mv.x) / det;

  // Coverage, and height above the ground along the light in m times coverage.
  std::vector<float> soft(std::size_t(n) * n, 0.0f), gap(std::size_t(n) * n, 0.0f);
  const Patch patch = occupied(depth);
  if (patch.empty()) return shadow;
  for (int y = patch.y0; y < patch.y1; ++y)
    for (int x = patch.x0; x < patch.x1; ++x)
      for (int j = 0; j < ratio; ++j)
        for (int i = 0; i < ratio; ++i) {
          const int fx = x * ratio + i, fy = y * ratio + j;
          const float d = depth[std::size_t(fy) * fine + fx];
          if (d >= 1.0f) continue;
          const double s = (fx + 0.5) / fine, t = (fy + 0.5) / fine;
          const double height = (mo.z + ds * (s - mo.x) + dt * (t - mo.y) - static_cast<double>(d)) * light.depth_range;
          // What is below the ground throws no shadow on it.
          if (height < -2.0 * light.texel) continue;
          soft[std::size_t(y) * n + x] += 1.0f / (ratio * ratio);
          gap[std::size_t(y) * n + x] += static_cast<float>(std::max(0.0, height)) / (ratio * ratio);
        }
  std::vector<float> sharp = soft;
  const int r = std::clamp(static_cast<int>(std::lround(radius / (light.texel * ratio))), 2, 40);
  const Patch wide_patch = patch.grown(2 * r);
  blur<1>(sharp, wide_patch, std::max(1, r / 6), {0.0f});
  blur<1>(soft, wide_patch, r, {0.0f});
  blur<1>(gap, wide_patch, r, {0.0f});

  // Pixels that see the patch on the ground: its corners taken to the ground and to the picture.
  int x0 = 0, y0 = 0, x1 = area.width, y1 = area.height;
  const glm::dmat3& h = ground.pixel_to_ground;
  const glm::dmat3 pixel_from_ground = glm::inverse(h);
  glm::dvec2 lower(1e300), upper(-1e300);
  bool bounded = true;
  for (int k = 0; k < 4; ++k) {
    const double s = double(k & 1 ? wide_patch.x1 : wide_patch.x0) / n - mo.x, t = double(k & 2 ? wide_patch.y1 : wide_patch.y0) / n - mo.y;
    const double u = (s * mv.y - mv.x * t) / det, v = (mu.x * t - s * mu.y) / det;
    const glm::dvec3 q = pixel_from_ground * glm::dvec3(u, v, 1.0);
    bounded = bounded && q.z > 0.0;
    lower = glm::min(lower, glm::dvec2(q) / q.z);
    upper = glm::max(upper, glm::dvec2(q) / q.z);
  }
  if (bounded) {
    x0 = static_cast<int>(std::clamp(std::floor(lower.x) - area.x - 1.0, 0.0, double(area.width)));
    y0 = static_cast<int>(std::clamp(std::floor(lower.y) - area.y - 1.0, 0.0, double(area.height)));
    x1 = static_cast<int>(std::clamp(std::ceil(upper.x) - area.x + 1.0, 0.0, double(area.width)));
    y1 = static_cast<int>(std::clamp(std::ceil(upper.y) - area.y + 1.0, 0.0, double(area.height)));
  }
  const double s0 = double(wide_patch.x0) / n, s1 = double(wide_patch.x1) / n, t0 = double(wide_patch.y0) / n, t1 = double(wide_patch.y1) / n;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const glm::dvec3 q = h * glm::dvec3(area.x + x + 0.5, area.y + y + 0.5, 1.0);
      if (!(q.z > 0.0)) continue;
      const double u = q.x / q.z, v = q.y / q.z;
      const double s = mo.x + mu.x * u + mv.x * v, t = mo.y + mu.y * u + mv.y * v;
      if (s <= s0 || s >= s1 || t <= t0 || t >= t1) continue;
      const float wide = at(soft, s, t);
      if (wide <= 0.0f) continue;
      const float height = at(gap, s, t) / std::max(wide, 1e-4f);
      const float softness = std::clamp(height / static_cast<float>(6.0 * radius), 0.0f, 1.0f);
      const float tight = softness < 1.0f ? at(sharp, s, t) : 0.0f;
      const double distance = std::sqrt(u * u + v * v) / ground.fade_radius;
      const float fade = static_cast<float>(std::clamp(1.6 * (1.0 - distance), 0.0, 1.0));
      shadow[std::size_t(y) * area.width + x] = static_cast<std::uint8_t>(255.0f * std::clamp(tight + (wide - tight) * softness, 0.0f, 1.0f) * fade);
    }
  return shadow;
}

}  // namespace flexframe::render
