#include "render/picture/shapes.h"

#include "sim/base/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::render {
namespace {

using std::numbers::pi;

// Surface of revolution about x: profile points (x, r) with the normal (nx, nr) each; consecutive pairs are joined.
struct ProfilePoint {
  double x, r, nx, nr;
};

void revolve(Shape& shape, std::span<const ProfilePoint> profile, int sides) {
  for (std::size_t i = 0; i + 1 < profile.size(); i += 2) {
    const auto base = static_cast<unsigned>(shape.positions.size());
    for (const ProfilePoint& p : {profile[i], profile[i + 1]})
      for (int s = 0; s < sides; ++s) {
        const double a = 2.0 * pi * s / sides;
        shape.positions.emplace_back(p.x, p.r * std::cos(a), p.r * std::sin(a));
        shape.normals.emplace_back(p.nx, p.nr * std::cos(a), p.nr * std::sin(a));
      }
    const auto n = static_cast<unsigned>(sides);
    for (unsigned s = 0; s < n; ++s) {
      const unsigned a = base + s, b = base + (s + 1) % n, c = a + n, d = b + n;
      shape.triangles.emplace_back(a, b, c);
      shape.triangles.emplace_back(b, d, c);
    }
  }
}

}  // namespace

void Shape::append(const Shape& other) {
  const auto base = static_cast<unsigned>(positions.size());
  positions.insert(positions.end(), other.positions.begin(), other.positions.end());
  normals.insert(normals.end(), other.normals.begin(), other.normals.end());
  for (const glm::uvec3& t : other.triangles) triangles.push_back(t + base);
}

Shape make_arrow(double length, double radius, int sides) {
  const double r = radius > 0.0 ? radius : 0.025 * length;
  const double head = std::min(8.0 * r, 0.5 * length), wide = 3.0 * r, neck = length - head;
  const double slope = std::hypot(head, wide);
  Shape shape;
  const ProfilePoint profile[] = {{0, 0, -1, 0},
                                  {0, r, -1, 0},
                                  {0, r, 0, 1},
                                  {neck, r, 0, 1},
                                  {neck, r, -1, 0},
                                  {neck, wide, -1, 0},
                                  {neck, wide, wide / slope, head / slope},
                                  {length, 0, wide / slope, head / slope}};
  revolve(shape, profile, sides);
  return shape;
}

Shape make_cylinder(double radius, double length, int sides) {
  const double h = 0.5 * length;
  Shape shape;
  const ProfilePoint profile[] = {{-h, 0, -1, 0},    {-h, radius, -1, 0}, {-h, radius, 0, 1},
                                  {h, radius, 0, 1}, {h, radius, 1, 0},   {h, 0, 1, 0}};
  revolve(shape, profile, sides);
  // From the x axis to the z axis (cyclic, keeps the winding).
  for (auto* list : {&shape.positions, &shape.normals})
    for (glm::vec3& p : *list) p = glm::vec3(p.y, p.z, p.x);
  return shape;
}

Shape make_tube(std::span<const glm::dvec3> points, double radius, int sides) {
  // A point that repeats would fold the surface.
  std::vector<glm::dvec3> path;
  for (const glm::dvec3& p : points)
    if (path.empty() || p != path.back()) path.push_back(p);
  if (path.size() < 2) throw ArgumentError("a tube needs at least two different points");
  const std::size_t count = path.size();
  const auto direction = [](const glm::dvec3& d, const glm::dvec3& otherwise) {
    const double l = glm::length(d);
    return l > 0.0 ? d / l : otherwise;
  };
  // Tangents: of the neighbours' chord; ends: of the end segment.
  std::vector<glm::dvec3> tangent(count, glm::dvec3(1, 0, 0));
  for (std::size_t i = 0; i < count; ++i)
    tangent[i] = direction(path[std::min(i + 1, count - 1)] - path[i > 0 ? i - 1 : 0], i > 0 ? tangent[i - 1] : glm::dvec3(1, 0, 0));
  const glm::dvec3 reference = std::abs(tangent[0].z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  glm::dvec3 r = glm::normalize(glm::cross(reference, tangent[0]));

  Shape shape;
  const auto ring = [&](const glm::dvec3& centre, const glm::dvec3& t, const glm::dvec3* cap) {
    const glm::dvec3 s = glm::cross(t, r);
    for (int k = 0; k < sides; ++k) {
      const double a = 2.0 * pi * k / sides;
      const glm::dvec3 n = std::cos(a) * r + std::sin(a) * s;
      shape.positions.emplace_back(centre + radius * n);
      shape.normals.emplace_back(cap ? *cap : n);
    }
  };
  const auto n = static_cast<unsigned>(sides);
  const auto cap = [&](const glm::dvec3& centre, const glm::dvec3& t, bool front) {
    const glm::dvec3 outward = front ? t : -t;
    const auto base = static_cast<unsigned>(shape.positions.size());
    ring(centre, t, &outward);
    shape.positions.emplace_back(centre);
    shape.normals.emplace_back(outward);
    for (unsigned k = 0; k < n; ++k) {
      const unsigned a = base + k, b = base + (k + 1) % n;
      if (front) shape.triangles.emplace_back(base + n, a, b);
      else shape.triangles.emplace_back(base + n, b, a);
    }
  };

  cap(path[0], tangent[0], false);
  const auto base = static_cast<unsigned>(shape.positions.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) {
      // Double reflection.
      const glm::dvec3 v1 = path[i] - path[i - 1];
      const double c1 = glm::dot(v1, v1);
      if (c1 > 0.0) {
        const glm::dvec3 rl = r - (2.0 / c1) * glm::dot(v1, r) * v1, tl = tangent[i - 1] - (2.0 / c1) * glm::dot(v1, tangent[i - 1]) * v1;
        const glm::dvec3 v2 = tangent[i] - tl;
        const double c2 = glm::dot(v2, v2);
        r = c2 > 0.0 ? rl - (2.0 / c2) * glm::dot(v2, rl) * v2 : rl;
      }
      r = direction(r - glm::dot(r, tangent[i]) * tangent[i], r);
    }
    ring(path[i], tangent[i], nullptr);
  }
  for (unsigned i = 0; i + 1 < count; ++i)
    for (unsigned k = 0; k < n; ++k) {
      const unsigned a = base + i * n + k, b = base + i * n + (k + 1) % n, c = a + n, d = b + n;
      shape.triangles.emplace_back(a, b, c);
      shape.triangles.emplace_back(b, d, c);
    }
  cap(path[count - 1], tangent[count - 1], true);
  return shape;
}

Shape make_spring(const glm::dvec3& from, const glm::dvec3& to, double coil_radius, double wire_radius, int turns) {
  const double length = glm::length(to - from);
  const glm::dvec3 x = length > 0.0 ? (to - from) / length : glm::dvec3(1, 0, 0);
  const glm::dvec3 reference = std::abs(x.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  const glm::dvec3 y = glm::normalize(glm::cross(reference, x)), z = glm::cross(x, y);
  const int steps = turns * 20;
  std::vector<glm::dvec3> path;
  path.push_back(from);
  for (int i = 0; i <= steps; ++i) {
    const double t = double(i) / steps, a = 2.0 * pi * turns * t;
    // The coil opens and closes over half a turn, so that the ends lie on the axis.
    const double open = std::min({1.0, t * turns * 2.0, (1.0 - t) * turns * 2.0});
    path.push_back(from + (0.1 + 0.8 * t) * length * x + open * coil_radius * (std::cos(a) * y + std::sin(a) * z));
  }
  path.push_back(to);
  return make_tube(path, wire_radius, 10);
}

}  // namespace flexframe::render
