#include "render/draw/content.h"

#include "render/frame/backdrop.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::render {
namespace {

Bounds box_of(std::span<const glm::vec3> positions) {
  glm::vec3 lower(3e38f), upper(-3e38f);
  for (const glm::vec3& p : positions) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  Bounds b;
  if (!positions.empty()) b.add(glm::dvec3(lower)), b.add(glm::dvec3(upper));
  return b;
}

Bounds posed(const Bounds& b, const glm::dmat4& pose) {
  Bounds out;
  if (b.empty()) return out;
  for (int i = 0; i < 8; ++i)
    out.add(
        glm::dvec3(pose * glm::dvec4(i & 1 ? b.upper.x : b.lower.x, i & 2 ? b.upper.y : b.lower.y, i & 4 ? b.upper.z : b.lower.z, 1.0)));
  return out;
}

void check_picture(const Picture& p) {
  const auto refuse = [](const std::string& what) { throw ArgumentError(what); };
  if (p.size.width < 16 || p.size.height < 16 || p.size.width > 16384 || p.size.height > 16384)
    refuse(fmt::format("picture of {} x {} pixels; 16 to 16384 are allowed", p.size.width, p.size.height));
  if (p.look.samples != 1 && p.look.samples != 4 && p.look.samples != 9 && p.look.samples != 16)
    refuse(fmt::format("{} antialiasing samples; 1, 4, 9 and 16 are allowed", p.look.samples));
  const int n = static_cast<int>(std::lround(std::sqrt(p.look.samples)));
  if (std::max(p.size.width, p.size.height) * n > 16384)
    refuse(fmt::format("picture of {} x {} pixels with {} samples; pixels times samples along a side must not exceed 16384", p.size.width,
                       p.size.height, p.look.samples));
  const auto check_camera = [&](const Camera& c) {
    const double numbers[] = {c.position.x, c.position.y, c.position.z, c.target.x, c.target.y, c.target.z,
                              c.up.x,       c.up.y,       c.up.z,       c.fov,      c.height};
    for (const double v : numbers)
      if (!std::isfinite(v)) refuse("camera with a number that is not finite");
    if (c.projection == Projection::perspective && !(c.fov > 0.0 && c.fov < 180.0))
      refuse(fmt::format("camera with a field of view of {} degrees; it must lie between 0 and 180", c.fov));
    if (c.projection == Projection::orthographic && !(c.height > 0.0))
      refuse(fmt::format("orthographic camera of height {} m; it must be positive", c.height));
    if (!(glm::length(c.target - c.position) > 0.0)) refuse("camera whose position and target coincide");
    if (!(glm::length(c.up) > 0.0)) refuse("camera whose up vector is zero");
  };
  if (p.scalar_map.logarithmic && !(p.scalar_map.lower > 0.0 && p.scalar_map.upper > p.scalar_map.lower))
    refuse(fmt::format("logarithmic colours from {:g} to {:g}; both must be positive and rise", p.scalar_map.lower, p.scalar_map.upper));
  for (const Inset& inset : p.insets)
    if (!(inset.zoom > 0.0) || !std::isfinite(inset.zoom) || !std::isfinite(glm::length(inset.point)))
      refuse(fmt::format("inset with a zoom of {:g}; it must be positive, and its point finite", inset.zoom));
  if (p.cut && !(glm::length(p.cut->normal) > 0.0)) refuse("cut whose normal is zero");
  if (p.views.empty()) check_camera(p.camera);
  for (const View& v : p.views) check_camera(v.camera);
  for (std::size_t i = 0; i < p.surfaces.size(); ++i) {
    const Surface& s = p.surfaces[i];
    const auto name = [&] { return fmt::format("surface {} of the picture: ", i); };
    const auto same = [&](std::size_t n_values, const char* what) {
      if (n_values != 0 && n_values != s.positions.size())
        refuse(name() + fmt::format("{} {} for {} positions", n_values, what, s.positions.size()));
    };
    same(s.normals.size(), "normals");
    same(s.scalars.size(), "scalars");
    same(s.vectors.size(), "vectors");
    same(s.shears.size(), "shears");
    same(s.colors.size(), "colours");
    unsigned largest = 0;
    for (const glm::uvec3& t : s.triangles) largest = std::max({largest, t.x, t.y, t.z});
    if (!s.triangles.empty() && largest >= s.positions.size())
      refuse(name() + fmt::format("triangle with position {} of {}", largest, s.positions.size()));
    if (!all_finite(s.positions)) {
      std::size_t k = 0;
      while (all_finite(s.positions.subspan(k, 1))) ++k;
      refuse(name() + fmt::format("position {} is not finite", k));
    }
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r)
        if (!std::isfinite(s.pose[c][r])) refuse(name() + "pose that is not finite");
  }
}

}  // namespace

bool all_finite(std::span<const glm::vec3> values) {
  // Zero times anything but a number is not zero.
  float sum = 0.0f;
  for (const glm::vec3& v : values) sum += v.x * 0.0f + v.y * 0.0f + v.z * 0.0f;
  return sum == 0.0f;
}

bool translucent(const Lines& l) {
  if (l.colors.size() != l.points.size()) return l.color.a < 1.0f;
  return std::any_of(l.colors.begin(), l.colors.end(), [](const glm::vec4& c) { return c.a < 1.0f; });
}

Content gather_content(const Picture& p) {
  check_picture(p);
  Content d;
  d.surfaces = p.surfaces;
  // Wires are a shell that is clear between its lines.
  for (Surface& s : d.surfaces)
    if (s.wires) {
      s.edges = true;
      s.opacity = std::min(s.opacity, 0.999f);
    }
  // A cut shows the inside of what is closed; translucent things stay whole.
  for (Surface& s : d.surfaces) {
    s.cut = s.cut && p.cut && s.opacity >= 1.0f;
    s.two_sided = s.two_sided || s.cut;
  }
  for (const Surface& s : d.surfaces) d.boxes.push_back(box_of(s.positions));
  d.shapes.reserve(p.arrows.size() + 1);
  const auto add_shape = [&](const Shape& shape, const glm::dmat4& pose, const glm::vec3& color, float opacity, float seen_through) {
    Surface s;
    s.positions = shape.positions;
    s.normals = shape.normals;
    s.triangles = shape.triangles;
    s.pose = pose;
    s.material = {color, 0.5f, 0.0f};
    s.opacity = opacity;
    s.seen_through = seen_through;
    s.two_sided = false;
    d.surfaces.push_back(s);
    d.boxes.push_back(box_of(shape.positions));
  };
  // Along +x to the direction of the arrow.
  const auto turned = [](const glm::dvec3& from, const glm::dvec3& direction) {
    const glm::dvec3 x = glm::normalize(direction);
    const glm::dvec3 z = glm::normalize(glm::cross(x, std::abs(x.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1)));
    glm::dmat4 pose(1.0);
    pose[0] = glm::dvec4(x, 0.0);
    pose[1] = glm::dvec4(glm::cross(z, x), 0.0);
    pose[2] = glm::dvec4(z, 0.0);
    pose[3] = glm::dvec4(from, 1.0);
    return pose;
  };
  for (const Arrow& a : p.arrows) {
    const double length = glm::length(a.to - a.from);
    if (!(length > 0.0) || !std::isfinite(length)) continue;
    d.shapes.push_back(make_arrow(length, a.radius));
    add_shape(d.shapes.back(), turned(a.from, a.to - a.from), a.color, a.opacity, a.seen_through);
  }
  if (!p.triads.empty()) d.shapes.push_back(make_arrow(1.0, 0.028));
  static const glm::vec3 axis_color[3] = {{0.82f, 0.20f, 0.17f}, {0.18f, 0.58f, 0.24f}, {0.16f, 0.37f, 0.80f}};
  for (const Triad& t : p.triads)
    for (int k = 0; k < 3; ++k) {
      glm::dvec3 e(0.0);
      e[k] = 1.0;
      glm::dmat4 scale(t.length);
      scale[3][3] = 1.0;
      add_shape(d.shapes.back(), t.pose * turned(glm::dvec3(0.0), e) * scale, axis_color[k], 1.0f, t.seen_through);
    }

  for (std::size_t i = 0; i < d.surfaces.size(); ++i) {
    const Bounds world = posed(d.boxes[i], d.surfaces[i].pose);
    d.all.add(world);
    if (casts(d.surfaces[i])) d.casters.add(world);
  }
  for (const Lines& l : p.lines) d.all.add(compute_bounds(l.points, l.pose));
  for (const Markers& m : p.markers) d.all.add(compute_bounds(m.points, m.pose));
  return d;
}

double unit_scale(const Content& content, const Bounds& motion) {
  Bounds all = content.all;
  all.add(motion);
  const double radius = all.radius();
  return !(radius > 0.0) || (radius > 0.05 && radius < 1e5) ? 1.0 : std::exp2(-std::round(std::log2(radius)));
}

Picture scaled_picture(const Picture& picture, double factor, const Bounds& bounds) {
  Picture p = picture;
  const auto scale_pose = [factor](glm::dmat4& pose) {
    for (int c = 0; c < 4; ++c) pose[c] = glm::dvec4(factor * glm::dvec3(pose[c]), pose[c].w);
  };
  const auto scale_camera = [factor](Camera& c) {
    c.position *= factor;
    c.target *= factor;
    c.height *= factor;
  };
  scale_camera(p.camera);
  for (View& v : p.views) scale_camera(v.camera);
  if (p.ground) {
    p.ground->point *= factor;
    p.ground->spacing = factor * grid_spacing(*p.ground, bounds);
  }
  for (Surface& s : p.surfaces) scale_pose(s.pose);
  for (Lines& l : p.lines) scale_pose(l.pose);
  for (Markers& m : p.markers) scale_pose(m.pose);
  for (Arrow& a : p.arrows) {
    a.from *= factor;
    a.to *= factor;
    a.radius *= factor;
  }
  for (Triad& t : p.triads) {
    t.pose[3] = glm::dvec4(factor * glm::dvec3(t.pose[3]), 1.0);
    t.length *= factor;
  }
  for (Label& l : p.labels) l.point *= factor;
  for (Inset& inset : p.insets) inset.point *= factor;
  for (Dimension& d : p.dimensions) {
    for (glm::dvec3& point : d.line) point *= factor;
    for (auto& helper : d.helpers)
      for (glm::dvec3& point : helper) point *= factor;
  }
  if (p.cut) p.cut->point *= factor;
  if (!p.bounds.empty()) {
    p.bounds.lower *= factor;
    p.bounds.upper *= factor;
  }
  return p;
}

PixelRect covered(const Bounds& box, const glm::dmat4& pose, const ViewFrame& frame, int per_pixel, double extra) {
  if (box.empty()) return {};
  const int width = frame.area.width * per_pixel, height = frame.area.height * per_pixel;
  const glm::dmat4 clip = frame.clip * frame.view * pose;
  glm::dvec2 lower(1e300), upper(-1e300);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec4 q =
        clip * glm::dvec4(i & 1 ? box.upper.x : box.lower.x, i & 2 ? box.upper.y : box.lower.y, i & 4 ? box.upper.z : box.lower.z, 1.0);
    if (q.w <= 0.0) return {0, 0, width, height};
    const glm::dvec2 s((0.5 + 0.5 * q.x / q.w) * width, (0.5 + 0.5 * q.y / q.w) * height);
    lower = glm::min(lower, s);
    upper = glm::max(upper, s);
  }
  const int x0 = static_cast<int>(std::clamp(std::floor(lower.x - extra), 0.0, double(width))),
            x1 = static_cast<int>(std::clamp(std::ceil(upper.x + extra), 0.0, double(width)));
  const int y0 = static_cast<int>(std::clamp(std::floor(lower.y - extra), 0.0, double(height))),
            y1 = static_cast<int>(std::clamp(std::ceil(upper.y + extra), 0.0, double(height)));
  return {x0, y0, x1 - x0, y1 - y0};
}

PixelRect covered(const Content& content, const Picture& picture, const ViewFrame& frame, int per_pixel, double unit,
                  const std::vector<bool>& surfaces) {
  PixelRect all;
  for (std::size_t i = 0; i < content.surfaces.size(); ++i)
    if (!content.surfaces[i].triangles.empty() && (surfaces.empty() || surfaces[i]))
      all = joined(all, covered(content.boxes[i], content.surfaces[i].pose, frame, per_pixel, 2.0));
  for (const Lines& l : picture.lines)
    all = joined(all, covered(compute_bounds(l.points), l.pose, frame, per_pixel,
                              std::max(double(per_pixel), static_cast<double>(l.width) * unit) + 2.0));
  for (const Markers& m : picture.markers)
    all = joined(all, covered(compute_bounds(m.points), m.pose, frame, per_pixel,
                              std::max(2.0 * per_pixel, static_cast<double>(m.diameter) * unit) + 2.0));
  return all;
}

}  // namespace flexframe::render
