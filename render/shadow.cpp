#include "render/shadow.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace flexframe::render {
namespace {

constexpr int n = shadow_size;

// Mean over 2 r + 1 values along rows, then columns, twice: close to a Gaussian. `lanes` floats a texel; edges repeat.
template <int lanes>
void blur(std::vector<float>& values, int r) {
  if (r < 1) return;
  std::vector<float> line(std::size_t(n) * lanes);
  const float share = 1.0f / static_cast<float>(2 * r + 1);
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = 0; y < n; ++y) {
      float* row = &values[std::size_t(y) * n * lanes];
      std::copy_n(row, n * lanes, line.begin());
      double sum[lanes] = {};
      for (int i = -r; i <= r; ++i)
        for (int k = 0; k < lanes; ++k) sum[k] += line[std::size_t(std::clamp(i, 0, n - 1)) * lanes + k];
      for (int x = 0; x < n; ++x) {
        const int in = std::min(x + r + 1, n - 1), out = std::max(x - r, 0);
        for (int k = 0; k < lanes; ++k) {
          row[x * lanes + k] = static_cast<float>(sum[k]) * share;
          sum[k] += static_cast<double>(line[std::size_t(in) * lanes + k]) - static_cast<double>(line[std::size_t(out) * lanes + k]);
        }
      }
    }
    // Columns: a running sum of whole rows, so that memory is walked in order.
    std::vector<double> sum(std::size_t(n) * lanes, 0.0);
    const std::vector<float> source = values;
    const std::size_t width = std::size_t(n) * lanes;
    for (int i = -r; i <= r; ++i) {
      const float* row = &source[std::size_t(std::clamp(i, 0, n - 1)) * width];
      for (std::size_t k = 0; k < width; ++k) sum[k] += row[k];
    }
    for (int y = 0; y < n; ++y) {
      float* row = &values[std::size_t(y) * width];
      const float* in = &source[std::size_t(std::min(y + r + 1, n - 1)) * width];
      const float* out = &source[std::size_t(std::max(y - r, 0)) * width];
      for (std::size_t k = 0; k < width; ++k) {
        row[k] = static_cast<float>(sum[k]) * share;
        sum[k] += static_cast<double>(in[k]) - static_cast<double>(out[k]);
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
  light.texel = span / n;
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
  std::vector<float> moments(std::size_t(n) * n * 2);
  // Empty texels are many: their value once.
  const float empty = std::exp(shadow_warp * 0.5f);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const float m = depth[i] >= 1.0f ? empty : std::exp(shadow_warp * (depth[i] - 0.5f));
    moments[2 * i] = m;
    moments[2 * i + 1] = m * m;
  }
  blur<2>(moments, std::clamp(static_cast<int>(std::lround(0.5 * radius / light.texel)), 1, 24));
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
  // Depth of the ground by (s, t): solve the two first rows for (u, v).
  const double det = mu.x * mv.y - mv.x * mu.y;
  const double ds = (mu.z * mv.y - mv.z * mu.y) / det, dt = (mv.z * mu.x - mu.z * mv.x) / det;

  // Coverage and height above the ground along the light, in m.
  std::vector<float> cover(std::size_t(n) * n), gap(std::size_t(n) * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const std::size_t k = std::size_t(j) * n + i;
      if (depth[k] >= 1.0f) continue;
      const double s = (i + 0.5) / n, t = (j + 0.5) / n;
      const double here = mo.z + ds * (s - mo.x) + dt * (t - mo.y);
      const double height = (here - static_cast<double>(depth[k])) * light.depth_range;
      // What is below the ground throws no shadow on it.
      if (height < -2.0 * light.texel) continue;
      cover[k] = 1.0f;
      gap[k] = static_cast<float>(std::max(0.0, height));
    }
  std::vector<float> sharp = cover, soft = cover;
  const int r = std::clamp(static_cast<int>(std::lround(radius / light.texel)), 2, 60);
  blur<1>(sharp, std::max(1, r / 6));
  blur<1>(soft, r);
  blur<1>(gap, r);

  // Bounds of the map in pixels would be an optimisation of little worth: the row test is cheap.
  const glm::dmat3& h = ground.pixel_to_ground;
  for (int y = 0; y < area.height; ++y)
    for (int x = 0; x < area.width; ++x) {
      const glm::dvec3 q = h * glm::dvec3(area.x + x + 0.5, area.y + y + 0.5, 1.0);
      if (!(q.z > 0.0)) continue;
      const double u = q.x / q.z, v = q.y / q.z;
      const double s = mo.x + mu.x * u + mv.x * v, t = mo.y + mu.y * u + mv.y * v;
      if (s <= 0.0 || s >= 1.0 || t <= 0.0 || t >= 1.0) continue;
      const float wide = at(soft, s, t), tight = at(sharp, s, t);
      if (wide <= 0.0f && tight <= 0.0f) continue;
      const float height = wide > 1e-4f ? at(gap, s, t) / wide : 0.0f;
      const float softness = std::clamp(height / static_cast<float>(6.0 * radius), 0.0f, 1.0f);
      const double distance = std::sqrt(u * u + v * v) / ground.fade_radius;
      const float fade = static_cast<float>(std::clamp(1.6 * (1.0 - distance), 0.0, 1.0));
      shadow[std::size_t(y) * area.width + x] = static_cast<std::uint8_t>(255.0f * std::clamp(tight + (wide - tight) * softness, 0.0f, 1.0f) * fade);
    }
  return shadow;
}

}  // namespace flexframe::render
