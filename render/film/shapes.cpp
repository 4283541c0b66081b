#include "render/film/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::film {
namespace {

constexpr int rings_along = 64;  // a beam that spans the picture bends smoothly with this many
constexpr int circle_sides = 48;

// Two unit vectors that make (u, v, w) right-handed.
std::pair<glm::dvec3, glm::dvec3> normals_of(const glm::dvec3& w) {
  const glm::dvec3 other = std::abs(w.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(other, w));
  return {u, glm::cross(w, u)};
}

}  // namespace

void Build::add(const Build& part) {
  const int first = static_cast<int>(positions.size());
  positions.insert(positions.end(), part.positions.begin(), part.positions.end());
  for (const glm::ivec3& t : part.triangles) triangles.push_back(t + first);
}

Loop circle(double radius) {
  Loop loop;
  for (int i = 0; i < circle_sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / circle_sides;
    loop.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return loop;
}

Build sweep(std::vector<Loop> loops, const std::vector<double>& stations, const glm::dvec3& origin, const glm::dvec3& w,
            const glm::dvec3& u, const glm::dvec3& v) {
  for (size_t l = 0; l < loops.size(); ++l)
    if ((signed_area(loops[l]) > 0.0) != (l == 0)) std::reverse(loops[l].begin(), loops[l].end());
  Build out;
  int ring = 0;
  for (const Loop& loop : loops) ring += static_cast<int>(loop.size());
  for (double x : stations)
    for (const Loop& loop : loops)
      for (const Eigen::Vector2d& p : loop) out.positions.push_back(origin + x * w + p.x() * u + p.y() * v);

  // Sides: seen from outside, a loop's edge and the way to the next ring.
  for (int s = 0; s + 1 < static_cast<int>(stations.size()); ++s) {
    int first = s * ring;
    for (const Loop& loop : loops) {
      const int n = static_cast<int>(loop.size());
      for (int i = 0; i < n; ++i) {
        const int a = first + i, b = first + (i + 1) % n;
        out.triangles.push_back({a, b, b + ring});
        out.triangles.push_back({a, b + ring, a + ring});
      }
      first += n;
    }
  }
  // Ends: the last looks along w, the first against it.
  const int last = static_cast<int>(stations.size() - 1) * ring;
  for (const auto& t : triangulate_polygon(loops)) {
    out.triangles.push_back({last + t[0], last + t[1], last + t[2]});
    out.triangles.push_back({t[0], t[2], t[1]});
  }
  return out;
}

Build cylinder(const glm::dvec3& a, const glm::dvec3& b, double radius) {
  const double length = glm::length(b - a);
  const glm::dvec3 w = (b - a) / length;
  const auto [u, v] = normals_of(w);
  return sweep({circle(radius)}, {0.0, length}, a, w, u, v);
}

namespace {

// An even number of steps a side, so that its middle is a point; none of an outline that is round.
Loop divide_sides(const Loop& loop) {
  if (loop.size() > 16) return loop;
  double around = 0.0;
  for (size_t i = 0; i < loop.size(); ++i) around += (loop[(i + 1) % loop.size()] - loop[i]).norm();
  Loop out;
  for (size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d step = loop[(i + 1) % loop.size()] - loop[i];
    const int steps = 2 * std::clamp(static_cast<int>(std::ceil(20.0 * step.norm() / around)), 1, 5);
    for (int k = 0; k < steps; ++k) out.push_back(loop[i] + step * k / steps);
  }
  return out;
}

}  // namespace

render::Mesh make_beam_mesh(const sim::Section& section, double length, std::span<const double> stations, const std::string& name,
                            bool divided) {
  std::vector<Loop> loops(section.outline.begin(), section.outline.end());
  if (loops.empty()) loops = {circle(section.area > 0.0 ? std::sqrt(section.area / std::numbers::pi) : 0.01 * length)};

  if (divided)
    for (Loop& loop : loops) loop = divide_sides(loop);

  // Fine circles of slender beams: half the corners, of the same area, are within a fifth of a pixel of a beam that spans the picture.
  for (Loop& loop : loops) {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    double reach = 0.0;
    for (const Eigen::Vector2d& p : loop) {
      centre += p / static_cast<double>(loop.size());
      reach = std::max(reach, p.norm());
    }
    if (loop.size() < 48 || loop.size() % 2 != 0 || reach > length / 30.0) continue;
    Loop half;
    for (size_t i = 0; i < loop.size(); i += 2) half.push_back(loop[i]);
    const double stretch = std::sqrt(signed_area(loop) / signed_area(half));
    for (Eigen::Vector2d& p : half) p = centre + stretch * (p - centre);
    loop = std::move(half);
  }

  // Stations within the beam, its ends among them; those nearer than a thousandth of the beam are one.
  std::vector<double> marks = {0.0, length};
  for (double x : stations)
    if (x > 0.0 && x < length) marks.push_back(x);
  std::sort(marks.begin(), marks.end());
  std::vector<double> rings = {0.0};
  for (double x : marks) {
    const double from = rings.back();
    if (x - from < 1e-3 * length) continue;
    const int steps = std::max(1, static_cast<int>(std::ceil((x - from) * rings_along / length - 1e-9)));
    for (int k = 1; k <= steps; ++k) rings.push_back(from + (x - from) * k / steps);
  }
  rings.back() = length;
  const Build build = sweep(std::move(loops), rings, glm::dvec3(0.0), {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  return render::make_mesh(build.positions, build.triangles, name);
}

Build box(const glm::dvec3& centre, const glm::dvec3& half) {
  // The section's corners and both ends are bevelled, so that every edge catches light.
  const double bevel = 0.08 * std::min({half.x, half.y, half.z});
  const auto outline = [&](double inset) {
    const double y = half.y - inset, z = half.z - inset, b = bevel;
    return Loop{{y - b, -z}, {y, b - z}, {y, z - b}, {y - b, z}, {b - y, z}, {-y, z - b}, {-y, b - z}, {b - y, -z}};
  };
  const std::array<std::pair<double, double>, 4> rings = {
      {{-half.x, bevel}, {bevel - half.x, 0.0}, {half.x - bevel, 0.0}, {half.x, bevel}}};
  Build build;
  for (const auto& [x, inset] : rings)
    for (const Eigen::Vector2d& p : outline(inset)) build.positions.push_back(centre + glm::dvec3(x, p.x(), p.y()));
  for (int s = 0; s < 3; ++s)
    for (int i = 0; i < 8; ++i) {
      const int a = 8 * s + i, b = 8 * s + (i + 1) % 8;
      build.triangles.push_back({a, b, b + 8});
      build.triangles.push_back({a, b + 8, a + 8});
    }
  for (int i = 1; i + 1 < 8; ++i) {
    build.triangles.push_back({24, 24 + i, 25 + i});
    build.triangles.push_back({0, i + 1, i});
  }
  return build;
}

Build capsule(const glm::dvec3& centre, double radius, double length) {
  // Rings of latitude between two poles.
  constexpr int around = circle_sides, down = circle_sides / 2;
  const glm::dvec3 shift(0.0, 0.0, 0.5 * length);
  Build build;
  build.positions.push_back(centre + shift + glm::dvec3(0, 0, radius));
  for (int i = 1; i < down; ++i)
    for (int k = 0; k < around; ++k) {
      const double polar = std::numbers::pi * i / down, turn = 2.0 * std::numbers::pi * k / around;
      build.positions.push_back(centre + (2 * i <= down ? shift : -shift) +
                                radius * glm::dvec3(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)));
    }
  build.positions.push_back(centre - shift - glm::dvec3(0, 0, radius));
  const int south = static_cast<int>(build.positions.size()) - 1;
  const auto at = [](int ring, int k) { return 1 + ring * around + k % around; };
  for (int k = 0; k < around; ++k) {
    build.triangles.push_back({0, at(0, k), at(0, k + 1)});
    build.triangles.push_back({south, at(down - 2, k + 1), at(down - 2, k)});
    for (int i = 0; i + 1 < down - 1; ++i) {
      build.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      build.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return build;
}

render::Mesh make_sphere(const glm::dvec3& centre, double radius, const std::string& name) {
  const Build build = capsule(centre, radius, 0.0);
  return render::make_mesh(build.positions, build.triangles, name);
}

render::Mesh make_cylinder(const glm::dvec3& a, const glm::dvec3& b, double radius, const std::string& name) {
  const Build build = cylinder(a, b, radius);
  return render::make_mesh(build.positions, build.triangles, name);
}

}  // namespace flexframe::film
