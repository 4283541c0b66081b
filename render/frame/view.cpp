#include "render/frame/view.h"

#include "render/frame/camera.h"

#include <algorithm>
#include <cmath>

namespace flexframe::render {

Bounds compute_bounds(std::span<const glm::vec3> positions, const glm::dmat4& pose) {
  Bounds bounds;
  for (const glm::vec3& p : positions)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) bounds.add(glm::dvec3(pose * glm::dvec4(p, 1.0)));
  return bounds;
}

PixelRect joined(const PixelRect& a, const PixelRect& b) {
  if (a.width < 1 || a.height < 1) return b;
  if (b.width < 1 || b.height < 1) return a;
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

ViewFrame make_view(const Camera& camera, const PixelRect& area, const Bounds& bounds) {
  ViewFrame f;
  f.area = area;
  f.view = view_matrix(camera);
  f.orthographic = camera.projection == Projection::orthographic;
  const double half = f.orthographic ? 0.5 * camera.height : std::tan(glm::radians(0.5 * camera.fov));
  const double aspect = double(area.width) / area.height;
  f.pixel = 2.0 * half / area.height;

  // Distances of the corners of the bounds along the view.
  double nearest = 1e300, farthest = -1e300;
  if (!bounds.empty())
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 corner(i & 1 ? bounds.upper.x : bounds.lower.x, i & 2 ? bounds.upper.y : bounds.lower.y,
                              i & 4 ? bounds.upper.z : bounds.lower.z);
      const double d = -(f.view * glm::dvec4(corner, 1.0)).z;
      nearest = std::min(nearest, d);
      farthest = std::max(farthest, d);
    }
  const double reach = std::max(glm::length(camera.target - camera.position), 1e-9);
  if (nearest > farthest) nearest = farthest = reach;
  const double slack = 0.01 * (farthest - nearest) + 1e-3 * reach;
  f.far = farthest + slack;
  f.near = nearest - slack;
  if (!f.orthographic) {
    // Reversed float depth keeps its resolution over five decades.
    f.far = std::max(f.far, 1e-3 * reach);
    f.near = std::max(f.near, 1e-5 * f.far);
  }
  const double n = f.near, r = f.far;
  f.clip = glm::dmat4(0.0);
  f.clip[0][0] = 1.0 / (half * aspect);
  f.clip[1][1] = 1.0 / half;
  if (f.orthographic) {
    f.clip[2][2] = 1.0 / (r - n);
    f.clip[3][2] = r / (r - n);
    f.clip[3][3] = 1.0;
  } else {
    f.clip[2][2] = n / (r - n);
    f.clip[3][2] = n * r / (r - n);
    f.clip[2][3] = -1.0;
  }
  return f;
}

Camera inset_camera(const Camera& first, const ViewFrame& frame, const Inset& inset, const PixelRect& area) {
  Camera camera = first;
  camera.target = inset.point;
  if (frame.orthographic) {
    camera.position = inset.point + (first.position - first.target);
    camera.height = area.height * frame.pixel / inset.zoom;
    return camera;
  }
  // Equal lengths at the point: off the axis of the first view it lies deeper than its distance from that plane says.
  const double deep = -(frame.view * glm::dvec4(inset.point, 1.0)).z, away = glm::length(inset.point - first.position);
  if (!(deep > 0.0)) return camera;
  camera.fov = glm::degrees(2.0 * std::atan(0.5 * area.height * frame.pixel * deep / (away * inset.zoom)));
  return camera;
}

bool project(const ViewFrame& frame, const glm::dvec3& world, glm::dvec2& pixel) {
  const glm::dvec4 p = frame.clip * (frame.view * glm::dvec4(world, 1.0));
  if (p.w <= 0.0) return false;
  pixel = {frame.area.x + (0.5 + 0.5 * p.x / p.w) * frame.area.width, frame.area.y + (0.5 - 0.5 * p.y / p.w) * frame.area.height};
  return true;
}

}  // namespace flexframe::render
