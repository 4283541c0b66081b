#include "render/frame/backdrop.h"

#include "render/base/srgb.h"

#include <algorithm>
#include <cmath>

namespace flexframe::render {

double nice_step(double extent, double count) {
  if (!(extent > 0.0) || !std::isfinite(extent)) return 1.0;
  const double raw = extent / count, decade = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / decade;
  return decade * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
}

Image paint_background(const Picture& picture) {
  Image image = make_image(picture.size.width, picture.size.height, picture.background.transparent ? 4 : 3);
  if (picture.background.transparent) return image;
  for (int y = 0; y < image.height; ++y) {
    const float t = (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height);
    const glm::vec3 c = glm::clamp(glm::mix(picture.background.top, picture.background.bottom, t), 0.0f, 1.0f) * 255.0f;
    std::uint8_t* row = &image.pixels[std::size_t(y) * image.width * 3];
    // Ordered dither of one level breaks up the bands of the gradient.
    static constexpr int bayer[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
    std::uint8_t pattern[4][3];
    for (int x = 0; x < 4; ++x)
      for (int k = 0; k < 3; ++k)
        pattern[x][k] = static_cast<std::uint8_t>(std::clamp(c[k] + (static_cast<float>(bayer[y & 3][x]) + 0.5f) / 16.0f, 0.0f, 255.0f));
    for (int x = 0; x < image.width; ++x)
      for (int k = 0; k < 3; ++k) row[3 * x + k] = pattern[x & 3][k];
  }
  return image;
}

double grid_spacing(const Ground& ground, const Bounds& bounds) {
  const double radius = bounds.empty() ? 1.0 : std::max(bounds.radius(), 1e-300);
  return ground.spacing > 0.0 ? ground.spacing : nice_step(2.0 * radius, 12.0);
}

GroundFrame make_ground(const Ground& ground, const ViewFrame& frame, const Bounds& bounds) {
  GroundFrame g;
  const double length = glm::length(ground.normal);
  if (!(length > 0.0)) return g;
  g.normal = ground.normal / length;
  const double radius = bounds.empty() ? 1.0 : std::max(bounds.radius(), 1e-12);
  g.spacing = grid_spacing(ground, bounds);
  g.fade_radius = 2.6 * radius;

  // Axes along the world's axes where the normal is one; origin on a grid crossing below the centre.
  const glm::dvec3 reference = std::abs(g.normal.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  g.axis_u = glm::normalize(reference - g.normal * glm::dot(reference, g.normal));
  g.axis_v = glm::cross(g.normal, g.axis_u);
  const glm::dvec3 centre = bounds.empty() ? ground.point : bounds.centre();
  const glm::dvec3 offset = centre - ground.point;
  g.origin = ground.point + g.axis_u * std::round(glm::dot(offset, g.axis_u) / g.spacing) * g.spacing +
             g.axis_v * std::round(glm::dot(offset, g.axis_v) / g.spacing) * g.spacing;

  // Pixel from ground: columns of view * (axis_u, axis_v, origin), projected; its inverse is wanted.
  const auto camera = [&](const glm::dvec3& v, double w) { return glm::dvec3(frame.view * glm::dvec4(v, w)); };
  const glm::dvec3 u = camera(g.axis_u, 0.0), v = camera(g.axis_v, 0.0), o = camera(g.origin, 1.0);
  const auto column = [&](const glm::dvec3& p, double w) {
    const double px = 1.0 / frame.pixel, cx = frame.area.x + 0.5 * frame.area.width, cy = frame.area.y + 0.5 * frame.area.height;
    const double depth = frame.orthographic ? w : -p.z;
    return glm::dvec3(p.x * px + cx * depth, -p.y * px + cy * depth, depth);
  };
  const glm::dmat3 pixel_from_ground(column(u, 0.0), column(v, 0.0), column(o, 1.0));
  const double determinant = glm::determinant(pixel_from_ground);
  const glm::dvec3 n = camera(g.normal, 0.0);
  // Seen from above: the camera is on the normal's side (perspective), or looks against the normal (orthographic).
  const double above = frame.orthographic ? n.z : -glm::dot(n, o);
  if (!(above > 1e-6 * (frame.orthographic ? 1.0 : glm::length(o))) || determinant == 0.0) return g;
  g.pixel_to_ground = glm::inverse(pixel_from_ground);
  // Sign: positive third component in front of the camera.
  if (!frame.orthographic) {
    const glm::dvec3 foot = camera(g.origin, 1.0);
    if (foot.z < 0.0) {
      const glm::dvec3 p = pixel_from_ground * glm::dvec3(0, 0, 1);
      if ((g.pixel_to_ground * (p / p.z)).z < 0.0) g.pixel_to_ground = -g.pixel_to_ground;
    } else if (glm::determinant(pixel_from_ground) < 0.0) {
      g.pixel_to_ground = -g.pixel_to_ground;
    }
  }
  g.visible = true;
  return g;
}

bool paint_grid(Image& image, const GroundFrame& ground, const ViewFrame& frame, const Ground& settings, double line_scale) {
  if (!ground.visible) return false;
  double inked = 0.0;  // pixels of full ink
  const auto& linear = linear_table();
  const auto& srgb = srgb_table();
  const glm::vec3 line = linear_from_srgb(settings.line_color) * 16383.0f;
  const double half_width = 0.5 * std::max(1.0, line_scale);
  const glm::dmat3& h = ground.pixel_to_ground;
  const double inverse_spacing = 1.0 / ground.spacing;
  for (int y = frame.area.y; y < frame.area.y + frame.area.height; ++y) {
    for (int x = frame.area.x; x < frame.area.x + frame.area.width; ++x) {
      const glm::dvec3 q = h * glm::dvec3(x + 0.5, y + 0.5, 1.0);
      if (!(q.z > 0.0)) continue;
      const double u = q.x / q.z, v = q.y / q.z;
      const double distance = std::sqrt(u * u + v * v) / ground.fade_radius;
      if (distance >= 1.0) continue;
      const double fade = (1.0 - distance) * (1.0 - distance) * (1.0 + 2.0 * distance);
      // Derivatives of (u, v) by the pixel, for the distance from a line in pixels.
      const double ux = (h[0].x - u * h[0].z) / q.z, uy = (h[1].x - u * h[1].z) / q.z;
      const double vx = (h[0].y - v * h[0].z) / q.z, vy = (h[1].y - v * h[1].z) / q.z;
      const double per_u = 1.0 / std::sqrt(ux * ux + uy * uy), per_v = 1.0 / std::sqrt(vx * vx + vy * vy);
      double cover = 0.0;
      const auto family = [&](double at, double per, double spacing, double inverse, double weight) {
        const double pitch = spacing * per;  // pixels between lines
        // Lines closer than a few pixels would only shimmer.
        const double density = std::clamp((pitch - 3.0) / 6.0, 0.0, 1.0);
        const double away = std::abs(at - std::round(at * inverse) * spacing) * per;
        cover = std::max(cover, weight * density * std::clamp(half_width + 0.5 - away, 0.0, 1.0));
      };
      family(u, per_u, ground.spacing, inverse_spacing, 0.45);
      family(v, per_v, ground.spacing, inverse_spacing, 0.45);
      family(u, per_u, 5.0 * ground.spacing, 0.2 * inverse_spacing, 0.9);
      family(v, per_v, 5.0 * ground.spacing, 0.2 * inverse_spacing, 0.9);
      const float a = static_cast<float>(cover * fade);
      if (a <= 0.0f) continue;
      inked += static_cast<double>(a);
      std::uint8_t* p = &image.pixels[(std::size_t(y) * image.width + x) * image.channels];
      for (int k = 0; k < 3; ++k) {
        const float below = image.channels == 4 ? line[k] : static_cast<float>(linear[p[k]]);
        p[k] = srgb[rounded(4.0f * (below + (line[k] - below) * a))];
      }
      if (image.channels == 4) p[3] = static_cast<std::uint8_t>(rounded(255.0f * a));
    }
  }
  // A grid that can be counted has lines of some length: a tenth of the picture's side.
  return inked > 0.1 * std::min(frame.area.width, frame.area.height);
}

}  // namespace flexframe::render
