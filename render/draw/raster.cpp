#include "render/draw/raster.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::render {
namespace {

// First centre not before a coordinate in 1/256 sample.
int first_centre(std::int32_t v) { return (v + 255) >> 8; }

// First centre in row y (1/256 sample) not before the edge from `a` up to `b`. The quotient is rounded once and its terms are whole, so the
// two triangles that share an edge agree, and a centre on the edge is not missed.
template <class Corner>
int edge_at(const Corner& a, const Corner& b, std::int32_t y, int width) {
  const double rise = b.y - a.y, x = (double(a.x) * rise + double(y - a.y) * double(b.x - a.x)) / (256.0 * rise);
  return static_cast<int>(std::ceil(std::clamp(x, 0.0, double(width))));
}

}  // namespace

void Raster::start(Samples& samples, int x, int y, int view_width, int view_height) {
  x_ = x;
  y_ = y;
  width_ = samples.width;
  height_ = samples.height;
  view_width_ = view_width;
  view_height_ = view_height;
  used_ = 0;
  next_ = 0;
  const std::size_t count = std::size_t(width_) * height_;
  triangles_.assign(count, 0);
  samples.depth.assign(count, 0.0f);
  depth_ = samples.depth.data();
}

const Raster::Part& Raster::part_of(std::uint32_t triangle) const {
  const auto after = std::upper_bound(parts_.begin(), parts_.begin() + static_cast<std::ptrdiff_t>(used_), triangle,
                                      [](std::uint32_t t, const Part& p) { return t < p.first; });
  return *(after - 1);
}

bool Raster::project(const Surface& s, const glm::dmat4& clip_from_surface, Part& part) {
  const glm::mat4 m(clip_from_surface);
  const float half_width = 0.5f * static_cast<float>(view_width_), half_height = 0.5f * static_cast<float>(view_height_);
  const float right = half_width - static_cast<float>(x_), up = half_height - static_cast<float>(y_);
  // Products of two such lengths in 1/256 sample are whole numbers in a double, and a float tells 1/256 sample there.
  const float most = 16000.0f, whole = 12582912.0f;  // added to a float, the latter rounds it to a whole number
  part.seen.resize(s.positions.size());
  fixed_.resize(s.positions.size());
  int good = 1;
  for (std::size_t i = 0; i < s.positions.size(); ++i) {
    const glm::vec3 p = s.positions[i];
    const float w = m[0][3] * p.x + m[1][3] * p.y + m[2][3] * p.z + m[3][3], z = m[0][2] * p.x + m[1][2] * p.y + m[2][2] * p.z + m[3][2];
    const float inverse = 1.0f / w;
    const float x = (m[0][0] * p.x + m[1][0] * p.y + m[2][0] * p.z + m[3][0]) * inverse * half_width + right,
                y = (m[0][1] * p.x + m[1][1] * p.y + m[2][1] * p.z + m[3][1]) * inverse * half_height + up;
    // In front of the near plane, before the far one; what is not a number is none of it, and here becomes one.
    good &= int(w > 0.0f) & int(z <= w) & int(z >= 0.0f) & int(std::abs(x) < most) & int(std::abs(y) < most);
    part.seen[i] = {x, y, z * inverse, inverse};
    const float inside_x = std::min(std::max(-most, x), most), inside_y = std::min(std::max(-most, y), most);
    fixed_[i] = {static_cast<std::int32_t>(256.0f * inside_x - 128.0f + whole) - 12582912,
                 static_cast<std::int32_t>(256.0f * inside_y - 128.0f + whole) - 12582912};
  }
  return good != 0;
}

bool Raster::add(const Surface& s, int mark, const glm::dmat4& clip_from_surface, Facing facing) {
  if (used_ == parts_.size()) parts_.emplace_back();
  Part& part = parts_[used_];
  if (!project(s, clip_from_surface, part)) return false;
  part.surface = &s;
  part.mark = mark;
  part.first = next_;
  ++used_;
  const std::int64_t side = facing == Facing::any ? 0 : facing == Facing::counterclockwise ? 1 : -1;
  for (std::size_t i = 0; i < s.triangles.size(); ++i) {
    const glm::uvec3 t = s.triangles[i];
    const Corner fixed[3] = {fixed_[t.x], fixed_[t.y], fixed_[t.z]};
    // Of a fine mesh most lie between two rows or columns of centres, or look away.
    if (first_centre(std::min({fixed[0].y, fixed[1].y, fixed[2].y})) == first_centre(std::max({fixed[0].y, fixed[1].y, fixed[2].y})) ||
        first_centre(std::min({fixed[0].x, fixed[1].x, fixed[2].x})) == first_centre(std::max({fixed[0].x, fixed[1].x, fixed[2].x})))
      continue;
    const std::int64_t area = std::int64_t(fixed[1].x - fixed[0].x) * (fixed[2].y - fixed[0].y) -
                              std::int64_t(fixed[2].x - fixed[0].x) * (fixed[1].y - fixed[0].y);
    if (area == 0 || side * area < 0) continue;
    const Seen* const corners[3] = {&part.seen[t.x], &part.seen[t.y], &part.seen[t.z]};
    fill(corners, fixed, next_ + static_cast<std::uint32_t>(i) + 1);
  }
  next_ += static_cast<std::uint32_t>(s.triangles.size());
  return true;
}

void Raster::fill(const Seen* const (&corners)[3], const Corner (&fixed)[3], std::uint32_t triangle) {
  const Corner *low = &fixed[0], *middle = &fixed[1], *high = &fixed[2];
  if (low->y > middle->y) std::swap(low, middle);
  if (middle->y > high->y) std::swap(middle, high);
  if (low->y > middle->y) std::swap(low, middle);
  const int from = std::max(0, first_centre(low->y)), to = std::min(height_, first_centre(high->y));
  if (from >= to) return;
  const Seen &a = *corners[0], &b = *corners[1], &c = *corners[2];
  const float bx = b.x - a.x, by = b.y - a.y, cx = c.x - a.x, cy = c.y - a.y, area = bx * cy - cx * by;
  const float share = area != 0.0f ? 1.0f / area : 0.0f, bz = b.z - a.z, cz = c.z - a.z;
  const float by_x = (bz * cy - cz * by) * share, by_y = (cz * bx - bz * cx) * share;
  const float nearest = std::max({a.z, b.z, c.z}), farthest = std::min({a.z, b.z, c.z});
  for (int y = from; y < to; ++y) {
    const std::int32_t centre = y << 8;
    const int one = edge_at(*low, *high, centre, width_),
              other = centre < middle->y ? edge_at(*low, *middle, centre, width_) : edge_at(*middle, *high, centre, width_);
    const int x0 = std::min(one, other), x1 = std::max(one, other);
    const float start = a.z + by_y * (static_cast<float>(y) + 0.5f - a.y) + by_x * (0.5f - a.x);
    float* const depths = depth_ + std::size_t(y) * width_;
    std::uint32_t* const triangles = triangles_.data() + std::size_t(y) * width_;
    // Slivers have planes that are hardly known: never beyond their corners.
    for (int x = x0; x < x1; ++x) {
      const float z = std::min(std::max(farthest, start + by_x * static_cast<float>(x)), nearest);
      const bool nearer = z > depths[x];
      depths[x] = nearer ? z : depths[x];
      triangles[x] = nearer ? triangle : triangles[x];
    }
  }
}

}  // namespace flexframe::render
