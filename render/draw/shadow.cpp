#include "render/draw/shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::render {
namespace {

constexpr int n = filtered_size, fine = shadow_size, ratio = shadow_size / filtered_size;

// Texels of the filtered map around the occupied part, `lanes` floats each; rows from t = 0.
template <int lanes>
struct Patch {
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<float> values;
  // The map's part, `rim` texels wider on each side and filled with `around`.
  Patch(const ShadowMap& map, int rim, const std::array<float, lanes>& around)
      : x(map.x / ratio - rim), y(map.y / ratio - rim), width(map.width / ratio + 2 * rim), height(map.height / ratio + 2 * rim) {
    values.resize(std::size_t(width) * height * lanes);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = around[i % lanes];
  }
  float* at(int px, int py) { return &values[(std::size_t(py) * width + px) * lanes]; }
};

// Mean over 2 r + 1 values along rows and columns, twice: close to a Gaussian. Values outside are constant (`around`); a patch
// with a rim of 2 r texels holds all of the result.
template <int lanes>
void blur(Patch<lanes>& patch, int r, const std::array<float, lanes>& around) {
  if (r < 1 || patch.values.empty()) return;
  const int w = patch.width, h = patch.height;
  const double share = 1.0 / (2 * r + 1);
  const std::size_t width = std::size_t(w) * lanes;
  std::vector<float> line(width), source(width * h);
  std::vector<double> sum(width);
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = 0; y < h; ++y) {
      float* row = patch.at(0, y);
      std::copy_n(row, width, line.begin());
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
    source = patch.values;
    for (std::size_t k = 0; k < width; ++k) sum[k] = static_cast<double>(around[k % lanes]) * r;
    for (int i = 0; i <= r; ++i)
      for (std::size_t k = 0; k < width; ++k) sum[k] += static_cast<double>(i < h ? source[std::size_t(i) * width + k] : around[k % lanes]);
    for (int y = 0; y < h; ++y) {
      float* row = patch.at(0, y);
      const float* in = y + r + 1 < h ? &source[std::size_t(y + r + 1) * width] : nullptr;
      const float* out = y - r >= 0 ? &source[std::size_t(y - r) * width] : nullptr;
      for (std::size_t k = 0; k < width; ++k) {
        row[k] = static_cast<float>(sum[k] * share);
        sum[k] += static_cast<double>(in ? in[k] : around[k % lanes]) - static_cast<double>(out ? out[k] : around[k % lanes]);
      }
    }
  }
}

// First and last column of each row from which something is to be seen between it and the next column, in this row or the next.
std::vector<std::array<int, 2>> occupied(Patch<2>& patch) {
  std::vector<std::array<int, 2>> spans(static_cast<std::size_t>(patch.height), {patch.width, -1});
  for (int y = 0; y < patch.height; ++y)
    for (int x = 0; x < patch.width; ++x)
      if (*patch.at(x, y) > 0.0f)
        for (int row = std::max(0, y - 1); row <= y; ++row) {
          std::array<int, 2>& span = spans[static_cast<std::size_t>(row)];
          span = {std::min(span[0], x - 1), std::max(span[1], x)};
        }
  return spans;
}

}  // namespace

LightFrame make_light(const glm::dvec3& to_light, const Bounds& bounds) {
  LightFrame light;
  light.to_light = glm::normalize(to_light);
  const glm::dvec3 reference = std::abs(light.to_light.y) < 0.95 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  const glm::dvec3 side = glm::normalize(glm::cross(reference, light.to_light)), rise = glm::cross(light.to_light, side);
  glm::dvec3 lower(1e300), upper(-1e300);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 c(i & 1 ? bounds.upper.x : bounds.lower.x, i & 2 ? bounds.upper.y : bounds.lower.y,
                       i & 4 ? bounds.upper.z : bounds.lower.z);
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

ShadowMap shadow_part(std::span<const Surface> surfaces, std::span<const Bounds> boxes, const LightFrame& light) {
  double lower[2] = {1e300, 1e300}, upper[2] = {-1e300, -1e300};
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    if (!surfaces[i].casts_shadow || surfaces[i].opacity < 1.0f || surfaces[i].triangles.empty()) continue;
    const glm::dmat4 map = light.map_from_world * surfaces[i].pose;
    const Bounds& b = boxes[i];
    for (int c = 0; c < 8; ++c) {
      const glm::dvec4 q =
          map * glm::dvec4(c & 1 ? b.upper.x : b.lower.x, c & 2 ? b.upper.y : b.lower.y, c & 4 ? b.upper.z : b.lower.z, 1.0);
      for (int k = 0; k < 2; ++k) {
        lower[k] = std::min(lower[k], q[k]);
        upper[k] = std::max(upper[k], q[k]);
      }
    }
  }
  ShadowMap part;
  if (!(lower[0] <= upper[0])) return part;
  const auto texel = [](double v) { return static_cast<int>(std::clamp(v, 0.0, double(n))) * ratio; };
  part.x = texel(std::floor(lower[0] * n - 1.0));
  part.y = texel(std::floor(lower[1] * n - 1.0));
  part.width = texel(std::ceil(upper[0] * n + 1.0)) - part.x;
  part.height = texel(std::ceil(upper[1] * n + 1.0)) - part.y;
  return part;
}

void CasterDepth::start(const ShadowMap& part) {
  x_ = part.x;
  y_ = part.y;
  width_ = part.width;
  height_ = part.height;
  depths_.assign(std::size_t(width_) * height_, 1.0f);
}

void CasterDepth::add(const Surface& s, const LightFrame& light) {
  const glm::dmat4 map = light.map_from_world * s.pose;
  glm::vec4 rows[3];
  for (int k = 0; k < 4; ++k) {
    rows[0][k] = static_cast<float>(map[k].x * fine - (k == 3 ? x_ : 0));
    rows[1][k] = static_cast<float>(map[k].y * fine - (k == 3 ? y_ : 0));
    rows[2][k] = static_cast<float>(map[k].z);
  }
  projected_.resize(s.positions.size());
  for (std::size_t i = 0; i < s.positions.size(); ++i) {
    const glm::vec3 p = s.positions[i];
    for (int k = 0; k < 3; ++k) projected_[i][k] = rows[k].x * p.x + rows[k].y * p.y + rows[k].z * p.z + rows[k].w;
  }
  const float side = s.two_sided ? 0.0f : glm::determinant(glm::dmat3(s.pose)) < 0.0 ? -1.0f : 1.0f;
  const auto column = [this](float x) { return static_cast<int>(std::min(std::max(0.0f, x + 0.5f), static_cast<float>(width_))); };
  for (const glm::uvec3& t : s.triangles) {
    const glm::vec3 &a = projected_[t.x], &b = projected_[t.y], &c = projected_[t.z];
    const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    // Turned away, without an extent, or not a number.
    if (!(side * area >= 0.0f) || !(std::abs(area) > 0.0f)) continue;
    // Between the centres of two columns: of a fine mesh most are.
    if (column(std::min({a.x, b.x, c.x})) == column(std::max({a.x, b.x, c.x}))) continue;
    fill(a, b, c, area);
  }
}

// Row by row between two edges. An edge is worked out from its lower end for either of the triangles that share it, and a centre on it
// belongs to one of them: no gaps, through which light would fall.
void CasterDepth::fill(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, float area) {
  const glm::vec3 *low = &a, *middle = &b, *high = &c;
  if (low->y > middle->y) std::swap(low, middle);
  if (middle->y > high->y) std::swap(middle, high);
  if (low->y > middle->y) std::swap(low, middle);
  const auto first_centre = [](float v, int size) {
    return static_cast<int>(std::min(std::max(0.0f, v + 0.5f), static_cast<float>(size)));
  };
  const int from = first_centre(low->y, height_), to = first_centre(high->y, height_);
  if (from >= to) return;
  const float share = 1.0f / area, nearest = std::min({a.z, b.z, c.z}), farthest = std::max({a.z, b.z, c.z});
  const float by_x = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) * share,
              by_y = ((c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)) * share;
  const auto along = [](const glm::vec3& p, const glm::vec3& q, float y) { return p.x + (y - p.y) * ((q.x - p.x) / (q.y - p.y)); };
  for (int y = from; y < to; ++y) {
    const float centre = static_cast<float>(y) + 0.5f;
    const float one = along(*low, *high, centre),
                other = centre <= middle->y ? along(*low, *middle, centre) : along(*middle, *high, centre);
    const int x0 = first_centre(std::min(one, other), width_), x1 = first_centre(std::max(one, other), width_);
    const float start = a.z + by_y * (centre - a.y) + by_x * (0.5f - a.x);
    float* row = &depths_[std::size_t(y) * width_];
    // Slivers have planes that are hardly known: never beyond their corners.
    for (int x = x0; x < x1; ++x) row[x] = std::min(row[x], std::min(std::max(nearest, start + by_x * static_cast<float>(x)), farthest));
  }
}

void CasterDepth::reduce(ShadowMap& map) const {
  const int columns = width_ / ratio;
  map.texels.assign(std::size_t(columns) * (height_ / ratio), {});
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (const float d = depths_[std::size_t(y) * width_ + x]; d < 1.0f) {
        ShadowMap::Texel& texel = map.texels[std::size_t(y / ratio) * columns + x / ratio];
        texel.cover += 1.0f;
        texel.depth += d;
      }
  for (ShadowMap::Texel& texel : map.texels)
    if (texel.cover > 0.0f) {
      texel.depth /= texel.cover;
      texel.cover /= ratio * ratio;
    }
}

ShadowMoments filter_shadow(const ShadowMap& map, const LightFrame& light, double radius) {
  // Empty texels are many: their value once.
  const float empty = std::exp(shadow_warp * 0.5f);
  const std::array<float, 2> around = {empty, empty * empty};
  const int r = std::clamp(static_cast<int>(std::lround(0.5 * radius / (light.texel * ratio))), 1, 16), rim = 2 * r + 1;
  Patch<2> patch(map, rim, around);
  const ShadowMap::Texel* texel = map.texels.data();
  for (int y = 0; y < map.height / ratio; ++y)
    for (int x = 0; x < map.width / ratio; ++x, ++texel) {
      if (texel->cover <= 0.0f) continue;
      const float m = std::exp(shadow_warp * (texel->depth - 0.5f));
      float* out = patch.at(x + rim, y + rim);
      out[0] = empty + texel->cover * (m - empty);
      out[1] = empty * empty + texel->cover * (m * m - empty * empty);
    }
  blur<2>(patch, r, around);
  return {patch.x, patch.y, patch.width, patch.height, std::move(patch.values)};
}

namespace {

// A mask from the values of every second pixel, of `columns` in each row, shade_row(y, values): between them the mean of two, in rows and
// then in columns.
template <class ShadeRow>
void shade_every_second(Mask& shadow, int columns, const ShadeRow& shade_row) {
  const int y0 = shadow.part.y, y1 = y0 + shadow.part.height;
  std::vector<std::uint8_t> here(static_cast<std::size_t>(columns) + 1), next(here.size());
  const auto mean = [](int a, int b) { return static_cast<std::uint8_t>((a + b + 1) / 2); };
  shade_row(y0, here.data());
  for (int y = y0; y < y1; y += 2) {
    shade_row(y + 2, next.data());
    here[static_cast<std::size_t>(columns)] = here[static_cast<std::size_t>(columns) - 1];
    next[static_cast<std::size_t>(columns)] = next[static_cast<std::size_t>(columns) - 1];
    for (int row = y; row < std::min(y + 2, y1); ++row) {
      std::uint8_t* out = &shadow.values[std::size_t(row - y0) * shadow.part.width];
      for (int x = 0; x < shadow.part.width; ++x) {
        const auto i = static_cast<std::size_t>(x / 2), right = i + static_cast<std::size_t>(x & 1);
        const std::uint8_t above = mean(here[i], here[right]);
        out[x] = row == y ? above : mean(above, mean(next[i], next[right]));
      }
    }
    std::swap(here, next);
  }
}

}  // namespace

Mask ground_shadow(const ShadowMap& map, const LightFrame& light, const GroundFrame& ground, const ViewFrame& frame, double radius) {
  const PixelRect& area = frame.area;
  const double steep = glm::dot(light.to_light, ground.normal);
  if (!ground.visible || steep < 0.05 || map.texels.empty()) return {};

  // Ground in map coordinates: (s, t, depth) is linear in (u, v).
  const auto to_map = [&](const glm::dvec3& v, double w) { return glm::dvec3(light.map_from_world * glm::dvec4(v, w)); };
  const glm::dvec3 mu = to_map(ground.axis_u, 0.0), mv = to_map(ground.axis_v, 0.0), mo = to_map(ground.origin, 1.0);
  const double det = mu.x * mv.y - mv.x * mu.y;
  // Depth of the ground by (s, t): solve the two first rows for (u, v).
  const double ds = (mu.z * mv.y - mv.z * mu.y) / det, dt = (mv.z * mu.x - mu.z * mv.x) / det;

  // Coverage softened and nearly sharp, and height above the ground along the light in m times coverage: soft, gap, sharp.
  const int r = std::clamp(static_cast<int>(std::lround(radius / (light.texel * ratio))), 2, 40), rim = 2 * r + 1;
  Patch<2> soft(map, rim, {0.0f, 0.0f});
  Patch<1> sharp(map, rim, {0.0f});
  const ShadowMap::Texel* texel = map.texels.data();
  const int left = map.x / ratio, below = map.y / ratio;
  for (int y = 0; y < map.height / ratio; ++y)
    for (int x = 0; x < map.width / ratio; ++x, ++texel) {
      if (texel->cover <= 0.0f) continue;
      const double s = (left + x + 0.5) / n, t = (below + y + 0.5) / n;
      const double height = (mo.z + ds * (s - mo.x) + dt * (t - mo.y) - static_cast<double>(texel->depth)) * light.depth_range;
      // What is below the ground throws no shadow on it.
      if (height < -2.0 * light.texel) continue;
      float* out = soft.at(x + rim, y + rim);
      out[0] = *sharp.at(x + rim, y + rim) = texel->cover;
      out[1] = texel->cover * static_cast<float>(std::max(0.0, height));
    }
  blur<1>(sharp, std::max(1, r / 6), {0.0f});
  blur<2>(soft, r, {0.0f, 0.0f});

  // Pixels that see the patch on the ground: its corners taken to the ground and to the picture.
  int x0 = 0, y0 = 0, x1 = area.width, y1 = area.height;
  const glm::dmat3& h = ground.pixel_to_ground;
  const glm::dmat3 pixel_from_ground = glm::inverse(h);
  glm::dvec2 lower(1e300), upper(-1e300);
  bool bounded = true;
  for (int k = 0; k < 4; ++k) {
    const double s = double(k & 1 ? soft.x + soft.width : soft.x) / n - mo.x, t = double(k & 2 ? soft.y + soft.height : soft.y) / n - mo.y;
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
  if (x1 <= x0 || y1 <= y0) return {};
  x0 &= ~1;  // what moves must not drag the grid of points along
  y0 &= ~1;
  Mask shadow{{x0, y0, x1 - x0, y1 - y0}, std::vector<std::uint8_t>(std::size_t(x1 - x0) * (y1 - y0), 0)};
  const float inverse_fade = static_cast<float>(1.0 / ground.fade_radius), inverse_height = static_cast<float>(1.0 / (6.0 * radius));
  const std::vector<std::array<int, 2>> spans = occupied(soft);
  // From pixels to texels of the patch and to the ground at once: (fx, fy, w), then (u, v, w), to be divided by w.
  glm::dmat3 texels(0.0);
  texels[0] = glm::dvec3(mu.x * n, mu.y * n, 0.0);
  texels[1] = glm::dvec3(mv.x * n, mv.y * n, 0.0);
  texels[2] = glm::dvec3(mo.x * n - 0.5 - soft.x, mo.y * n - 0.5 - soft.y, 1.0);
  const glm::dmat3 to_texel = texels * h;
  const glm::vec3 place_by_x(to_texel[0]), ground_by_x(h[0]);
  // One row of every second pixel; a texel is wider than two.
  const int columns = (x1 - x0) / 2 + 1;
  const auto shade_row = [&](int y, std::uint8_t* out) {
    const glm::dvec3 pixel(area.x + x0 + 0.5, area.y + y + 0.5, 1.0);
    const glm::vec3 place_at(to_texel * pixel), ground_at(h * pixel);
    for (int i = 0; i < columns; ++i) {
      out[i] = 0;
      const float across = static_cast<float>(2 * i);
      const glm::vec3 place = place_at + across * place_by_x;
      if (!(place.z > 0.0f)) continue;
      const float share = 1.0f / place.z, fx = place.x * share, fy = place.y * share;
      // Between four texels of the patch.
      if (!(fx >= 0.0f && fy >= 0.0f && fx < static_cast<float>(soft.width - 1) && fy < static_cast<float>(soft.height - 1))) continue;
      const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
      if (ix < spans[static_cast<std::size_t>(iy)][0] || ix > spans[static_cast<std::size_t>(iy)][1]) continue;
      const float ax = fx - static_cast<float>(ix), ay = fy - static_cast<float>(iy);
      const auto between = [&](const float* low, const float* high, int lanes) {
        const float a = low[0] + (low[lanes] - low[0]) * ax, b = high[0] + (high[lanes] - high[0]) * ax;
        return a + (b - a) * ay;
      };
      const float *low = soft.at(ix, iy), *high = soft.at(ix, iy + 1);
      const float wide = between(low, high, 2);
      if (wide <= 0.0f) continue;
      const float height = between(low + 1, high + 1, 2) / std::max(wide, 1e-4f);
      const float softness = std::clamp(height * inverse_height, 0.0f, 1.0f);
      const float tight = softness < 1.0f ? between(sharp.at(ix, iy), sharp.at(ix, iy + 1), 1) : 0.0f;
      const glm::vec3 q = ground_at + across * ground_by_x;
      const float distance = std::sqrt(q.x * q.x + q.y * q.y) * share * inverse_fade;
      const float fade = std::clamp(1.6f * (1.0f - distance), 0.0f, 1.0f);
      out[i] = static_cast<std::uint8_t>(255.0f * std::clamp(tight + (wide - tight) * softness, 0.0f, 1.0f) * fade);
    }
  };
  shade_every_second(shadow, columns, shade_row);
  return shadow;
}

}  // namespace flexframe::render
