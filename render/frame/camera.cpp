#include "render/frame/camera.h"

#include "render/frame/backdrop.h"
#include "render/frame/layout.h"
#include "sim/base/error.h"

#include <algorithm>
#include <cmath>

namespace flexframe::render {
namespace {

// Right, up, back of a camera that looks along direction; any up that is not parallel.
glm::dmat3 camera_axes(const glm::dvec3& direction, const glm::dvec3& up) {
  const double length = glm::length(direction);
  const glm::dvec3 back = length > 0.0 ? -direction / length : glm::dvec3(0, 0, 1);
  glm::dvec3 right = glm::cross(up, back);
  if (glm::length(right) < 1e-9 * std::max(1e-300, glm::length(up)))
    right = glm::cross(std::abs(back.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1), back);
  right = glm::normalize(right);
  return {right, glm::cross(back, right), back};
}

}  // namespace

glm::dmat4 view_matrix(const Camera& camera) {
  const glm::dmat3 axes = camera_axes(camera.target - camera.position, camera.up);
  const glm::dmat3 world = glm::transpose(axes);
  glm::dmat4 view(world);
  view[3] = glm::dvec4(-(world * camera.position), 1.0);
  return view;
}

void append_corners(std::vector<glm::dvec3>& points, const Bounds& b) {
  if (b.empty()) return;
  for (int i = 0; i < 8; ++i)
    points.emplace_back(i & 1 ? b.upper.x : b.lower.x, i & 2 ? b.upper.y : b.lower.y, i & 4 ? b.upper.z : b.lower.z);
}

Camera fit_camera(std::span<const glm::dvec3> points, Size size, const FitOptions& options) {
  // Points in the camera's axes, about their centre.
  const glm::dmat3 axes = camera_axes(options.direction, options.up);
  const glm::dmat3 world = glm::transpose(axes);
  Bounds bounds;
  for (const glm::dvec3& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) bounds.add(p);
  glm::dvec3 centre(0.0);
  const double bounds_radius = !bounds.empty() && bounds.radius() > 0.0 ? bounds.radius() : 1.0;
  std::vector<glm::dvec3> local;
  if (!bounds.empty() && bounds.radius() > 0.0) {
    centre = bounds.centre();
    for (const glm::dvec3& p : points)
      if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) local.push_back(world * (p - centre));
  } else {
    if (!bounds.empty()) centre = bounds.centre();
    for (int i = 0; i < 8; ++i) local.emplace_back(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
  }

  // Free rectangle in normalised coordinates -1..1; overlays never squeeze it below a quarter of the picture.
  const auto free_range = [&](double low, double high) {
    low = std::clamp(low, 0.0, 0.75);
    high = std::clamp(high, 0.0, 0.75 - low);
    const double a = -1.0 + 2.0 * low, b = 1.0 - 2.0 * high, m = std::clamp(options.margin, 0.0, 0.4) * (b - a);
    return glm::dvec2(a + m, b - m);
  };
  const glm::dvec2 fx = free_range(options.insets.left, options.insets.right), fy = free_range(options.insets.bottom, options.insets.top);
  const double aspect = double(size.width) / size.height;

  Camera camera;
  camera.up = options.up;
  camera.fov = options.fov;
  camera.projection = options.projection;
  glm::dvec3 eye(0.0);
  if (options.projection == Projection::orthographic) {
    glm::dvec3 lower(1e300), upper(-1e300);
    for (const glm::dvec3& p : local) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
    const double half = std::max((upper.x - lower.x) / (fx.y - fx.x) / aspect, (upper.y - lower.y) / (fy.y - fy.x));
    camera.height = 2.0 * half;
    eye.x = 0.5 * (lower.x + upper.x) - 0.5 * (fx.x + fx.y) * half * aspect;
    eye.y = 0.5 * (lower.y + upper.y) - 0.5 * (fy.x + fy.y) * half;
    eye.z = upper.z + 2.0 * half + (upper.z - lower.z);
  } else {
    // A point stays within x/d <= tx iff p.x + tx p.z <= e.x + tx e.z, likewise on the other sides; the two bounds of
    // each direction meet at the smallest distance of that direction.
    const double t = std::tan(glm::radians(0.5 * options.fov));
    const auto solve = [&](int k, double low, double high) {
      double a = 1e300, b = -1e300;
      for (const glm::dvec3& p : local) {
        a = std::min(a, p[k] + low * p.z);
        b = std::max(b, p[k] + high * p.z);
      }
      return std::array<double, 3>{(b - a) / (high - low), a, b};
    };
    const auto x = solve(0, fx.x * t * aspect, fx.y * t * aspect), y = solve(1, fy.x * t, fy.y * t);
    double nearest = -1e300;
    for (const glm::dvec3& p : local) nearest = std::max(nearest, p.z);
    eye.z = std::max({x[0], y[0], nearest + 1e-6 * bounds_radius});
    // In the direction with room to spare, centred between its two bounds.
    eye.x = 0.5 * (x[1] - fx.x * t * aspect * eye.z + x[2] - fx.y * t * aspect * eye.z);
    eye.y = 0.5 * (y[1] - fy.x * t * eye.z + y[2] - fy.y * t * eye.z);
    camera.height = 2.0 * t * eye.z;
  }
  camera.position = centre + axes * eye;
  camera.target = centre + axes * glm::dvec3(eye.x, eye.y, 0.0);
  return camera;
}

namespace {

// A rectangle of the scene area, pixels, that a point of them falls into.
bool any_within(std::span<const glm::dvec3> points, const Camera& camera, Size size, const PixelRect& box) {
  const glm::dmat4 view = view_matrix(camera);
  const bool flat = camera.projection == Projection::orthographic;
  const double t = flat ? 0.5 * camera.height : std::tan(glm::radians(0.5 * camera.fov)), aspect = double(size.width) / size.height;
  return std::any_of(points.begin(), points.end(), [&](const glm::dvec3& p) {
    const glm::dvec3 q(view * glm::dvec4(p, 1.0));
    const double depth = flat ? 1.0 : -q.z;
    if (!(depth > 0.0)) return false;
    const double x = 0.5 * size.width * (1.0 + q.x / (t * aspect * depth)), y = 0.5 * size.height * (1.0 - q.y / (t * depth));
    return x > box.x && x < box.x + box.width && y > box.y && y < box.y + box.height;
  });
}

}  // namespace

Camera fit_camera(const Picture& picture, std::span<const glm::dvec3> points, FitOptions options) {
  const Layout layout = make_layout(picture);
  const Size size{layout.scene.width, layout.scene.height};
  options.insets = layout.insets;
  const Camera camera = fit_camera(points, size, options);
  if (!layout.has_bar || layout.bar.words.empty()) return camera;
  // The bar's label is wider than the bar. Where it would lie over what is seen, the fit stays beside or below it, whichever shows more,
  // unless that costs more of the size than it is worth.
  constexpr double most = 1.12;
  const TextLine& label = layout.bar.words.front();
  const int room = static_cast<int>(label.size), left = static_cast<int>(label.x) - room;
  const PixelRect box{left, static_cast<int>(label.y) - 2 * room, size.width - left, 3 * room};
  if (!any_within(points, camera, size, box)) return camera;
  FitOptions beside = options, below = options;
  beside.insets.right = std::max(options.insets.right, 1.0 - double(box.x) / size.width);
  below.insets.top = std::max(options.insets.top, double(box.y + box.height) / size.height);
  const Camera a = fit_camera(points, size, beside), b = fit_camera(points, size, below);
  const Camera& better = a.height <= b.height ? a : b;
  return better.height <= most * camera.height ? better : camera;
}

FitOptions default_view(std::span<const glm::dvec3> points, const glm::dvec3& gravity) {
  Bounds bounds;
  for (const glm::dvec3& p : points) bounds.add(p);
  const glm::dvec3 extent = bounds.empty() ? glm::dvec3(1.0) : bounds.upper - bounds.lower;
  int thin = 0;
  for (int k = 1; k < 3; ++k)
    if (extent[k] < extent[thin]) thin = k;
  const double widest = std::max({extent.x, extent.y, extent.z}), middle = extent.x + extent.y + extent.z - widest - extent[thin];
  const bool planar = extent[thin] < 0.3 * middle || middle <= 0.0;

  FitOptions options;
  const double g = glm::length(gravity);
  if (g > 0.0) {
    options.up = -gravity / g;
    // Along an axis of the world where it is nearly one.
    for (int k = 0; k < 3; ++k)
      if (std::abs(options.up[k]) > 0.99) {
        const double s = options.up[k] > 0.0 ? 1.0 : -1.0;
        options.up = glm::dvec3(0.0);
        options.up[k] = s;
      }
  } else {
    options.up = (planar && thin == 2) || extent.y >= extent.z ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
  }
  if (planar) {
    glm::dvec3 normal(0.0);
    normal[thin] = thin == 1 ? -1.0 : 1.0;  // seen from +z, +x, -y: the right-handed drawing planes
    if (std::abs(glm::dot(normal, options.up)) < 0.5) {
      const glm::dvec3 right = glm::cross(options.up, normal);
      options.direction = -normal - 0.34 * options.up + 0.22 * right;
    } else {
      // The plane lies flat: from above, three quarters.
      const glm::dvec3 toward = std::abs(options.up.z) > 0.5 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1);
      // A little from the side: no two axes of the world lie over each other.
      options.direction = -options.up + 0.9 * toward - 0.25 * glm::cross(toward, options.up);
    }
  } else {
    const glm::dvec3 front = std::abs(options.up.z) > 0.5 ? glm::dvec3(0, -1, 0) : glm::dvec3(0, 0, 1);
    const glm::dvec3 right = glm::cross(options.up, front);
    options.direction = -front - 0.62 * right - 0.55 * options.up;
  }
  options.direction = glm::normalize(options.direction);
  return options;
}

Ground default_ground(std::span<const glm::dvec3> points, const glm::dvec3& up) {
  Ground ground;
  const double length = glm::length(up);
  ground.normal = length > 0.0 ? up / length : glm::dvec3(0, 1, 0);
  double lowest = 1e300;
  Bounds bounds;
  for (const glm::dvec3& p : points) {
    lowest = std::min(lowest, glm::dot(p, ground.normal));
    bounds.add(p);
  }
  if (bounds.empty()) return ground;
  ground.point = ground.normal * (lowest - 0.03 * bounds.radius());
  return ground;
}

Camera orbit_camera(const Camera& camera, double degrees) {
  const glm::dvec3 axis = glm::normalize(camera.up), d = camera.position - camera.target;
  const double a = glm::radians(degrees);
  Camera turned = camera;
  turned.position = camera.target + std::cos(a) * d + std::sin(a) * glm::cross(axis, d) + (1.0 - std::cos(a)) * glm::dot(axis, d) * axis;
  return turned;
}

Camera shift_camera(const Camera& camera, const glm::dvec3& displacement) {
  Camera shifted = camera;
  shifted.position += displacement;
  shifted.target += displacement;
  return shifted;
}

Camera camera_on_path(std::span<const CameraKey> keys, double t) {
  if (keys.empty()) throw ArgumentError("a camera path needs at least one key");
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (!(keys[i].t > keys[i - 1].t))
      throw ArgumentError("the times of a camera path must rise: key " + std::to_string(i + 1) + " does not");
  if (t <= keys.front().t) return keys.front().camera;
  if (t >= keys.back().t) return keys.back().camera;
  std::size_t i = 0;
  while (keys[i + 1].t <= t) ++i;
  const double h = keys[i + 1].t - keys[i].t, s = (t - keys[i].t) / h;
  // Cubic Hermite with slopes by finite differences over the neighbours.
  const auto blend = [&](auto value) {
    const auto slope = [&](std::size_t k) {
      const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, keys.size() - 1);
      return (value(keys[b].camera) - value(keys[a].camera)) / (keys[b].t - keys[a].t);
    };
    return (2 * s * s * s - 3 * s * s + 1) * value(keys[i].camera) + (s * s * s - 2 * s * s + s) * h * slope(i) +
           (-2 * s * s * s + 3 * s * s) * value(keys[i + 1].camera) + (s * s * s - s * s) * h * slope(i + 1);
  };
  Camera camera = keys[i].camera;
  camera.position = blend([](const Camera& c) { return c.position; });
  camera.target = blend([](const Camera& c) { return c.target; });
  camera.up = blend([](const Camera& c) { return c.up; });
  camera.fov = std::clamp(blend([](const Camera& c) { return c.fov; }), 1.0, 170.0);
  camera.height = std::max(blend([](const Camera& c) { return c.height; }), 1e-300);
  return camera;
}

std::vector<View> make_views(const Picture& picture, std::span<const glm::dvec3> points, const glm::dvec3& up,
                             std::span<const ViewKind> kinds) {
  const PixelRect inner = make_layout(picture).inner;
  const bool z_up = std::abs(up.z) > std::abs(up.y);
  const glm::dvec3 front = z_up ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1);
  const glm::dvec3 side(-1, 0, 0), down = -up;
  struct Choice {
    const char* label;
    glm::dvec3 direction, up;
  };
  const Choice choices[] = {
      {"front", front, up}, {"side", side, up}, {"top", down, front}, {"iso", glm::normalize(0.8 * front + 0.55 * side + 0.5 * down), up}};
  const int count = static_cast<int>(kinds.size()), columns = count > 1 ? 2 : 1, rows = count > 2 ? 2 : 1;
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const Choice& choice = choices[static_cast<int>(kinds[i])];
    FitOptions options;
    options.direction = choice.direction;
    options.up = choice.up;
    options.projection = kinds[i] != ViewKind::iso ? Projection::orthographic : Projection::perspective;
    options.margin = 0.08;
    View view;
    // The last of three has the lower row for itself.
    const bool wide = count == 3 && i == 2;
    const int row = i / columns;
    view.left = wide ? 0.0 : double(i % columns) / columns;
    view.top = double(row) / rows;
    view.width = wide ? 1.0 : 1.0 / columns;
    view.height = 1.0 / rows;
    view.label = choice.label;
    view.camera = fit_camera(
        points, {std::max(1, static_cast<int>(inner.width * view.width)), std::max(1, static_cast<int>(inner.height * view.height))},
        options);
    views.push_back(view);
  }
  // Square views have one scale, as on a drawing: lengths can be compared from view to view.
  double metres = 0.0;  // of the picture's height
  for (const View& view : views)
    if (view.camera.projection == Projection::orthographic) metres = std::max(metres, view.camera.height / view.height);
  for (View& view : views)
    if (view.camera.projection == Projection::orthographic) view.camera.height = metres * view.height;
  return views;
}

glm::dvec3 default_light(const Camera& camera, const glm::dvec3& up_direction) {
  const glm::dmat4 view = view_matrix(camera);
  const glm::dvec3 right(view[0][0], view[1][0], view[2][0]), upward(view[0][1], view[1][1], view[2][1]),
      back(view[0][2], view[1][2], view[2][2]);
  const glm::dvec3 up = glm::normalize(up_direction);
  glm::dvec3 level = back - glm::dot(back, up) * up;
  if (glm::length(level) < 0.1) level = upward - glm::dot(upward, up) * up;
  return glm::normalize(1.0 * up - 0.42 * right + 0.5 * glm::normalize(level));
}

}  // namespace flexframe::render
