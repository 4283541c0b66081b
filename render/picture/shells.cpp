#include "render/picture/shells.h"

#include "render/picture/adjacency.h"
#include "render/picture/forest.h"

#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace flexframe::render {
namespace {

struct Shell {
  int first = 0;        // one of its triangles
  double volume = 0.0;  // m^3, negative: it looks inwards
  Bounds box;
};

glm::dvec3 corner(const Mesh& mesh, const glm::ivec3& t, int k) { return mesh.positions[t[k]]; }

// How often a mesh's triangles wind about a point: the sum of their solid angles over 4 pi (van Oosterom and Strackee 1983); 1 inside a
// part that looks outwards.
double winding(const Mesh& mesh, const std::vector<int>& shell_of, int without, const glm::dvec3& p) {
  double sum = 0.0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (shell_of[t] == without) continue;
    const glm::ivec3& v = mesh.triangles[t];
    const glm::dvec3 a = corner(mesh, v, 0) - p, b = corner(mesh, v, 1) - p, c = corner(mesh, v, 2) - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    sum += std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (2.0 * std::numbers::pi);
}

bool holds(const Bounds& outer, const Bounds& inner) {
  return glm::all(glm::lessThanEqual(outer.lower, inner.lower)) && glm::all(glm::greaterThanEqual(outer.upper, inner.upper));
}

// Triangles that hang together by their edges.
std::vector<Shell> find_shells(const Mesh& mesh, Forest& forest, std::vector<int>& shell_of) {
  std::vector<Shell> shells;
  shell_of.assign(mesh.triangles.size(), -1);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto root = static_cast<size_t>(forest.root(static_cast<int>(t)));
    if (shell_of[root] < 0) {
      shell_of[root] = static_cast<int>(shells.size());
      shells.push_back({.first = static_cast<int>(t), .volume = 0.0, .box = {}});
    }
    shell_of[t] = shell_of[root];
    Shell& shell = shells[static_cast<size_t>(shell_of[t])];
    // About one of its own corners: far from the origin the volume would be rounding.
    const glm::dvec3 at = corner(mesh, mesh.triangles[static_cast<size_t>(shell.first)], 0);
    const glm::ivec3& v = mesh.triangles[t];
    shell.volume += glm::dot(corner(mesh, v, 0) - at, glm::cross(corner(mesh, v, 1) - at, corner(mesh, v, 2) - at)) / 6.0;
    for (int k = 0; k < 3; ++k) shell.box.add(corner(mesh, v, k));
  }
  return shells;
}

void turn_over(Mesh& mesh, size_t t) {
  std::swap(mesh.triangles[t].y, mesh.triangles[t].z);
  std::swap(mesh.triangle_points[t].y, mesh.triangle_points[t].z);
  if (mesh.triangle_edges.empty()) return;
  const unsigned edges = mesh.triangle_edges[t];
  mesh.triangle_edges[t] = static_cast<std::uint8_t>((edges & 2u) | (edges & 1u) << 2 | (edges & 4u) >> 2);
}

}  // namespace

Shells turn_shells_outwards(Mesh& mesh) {
  Shells out;
  Forest forest(mesh.triangles.size());
  bool closed = true;
  for_each_edge(mesh.triangles, weld_equal(std::span<const glm::dvec3>(mesh.positions)), [&](int low, std::span<const EdgeSide> sides) {
    const bool flat = low == sides[0].high;  // of a triangle two of whose corners are one
    closed = closed && (flat ? sides.size() == 1 : sides.size() == 2 && sides[0].upwards != sides[1].upwards);
    for (const EdgeSide& side : sides) forest.join(sides[0].triangle, side.triangle);
  });
  if (!closed) return out;
  std::vector<int> shell_of;
  const std::vector<Shell> shells = find_shells(mesh, forest, shell_of);
  std::vector<char> turned(shells.size(), 0);
  // A foam has thousands of cavities: boxes tell of them then. 2e7 solid angles take a second.
  constexpr double most_angles = 2e7;
  double angles = 0.0;
  for (size_t s = 0; s < shells.size(); ++s) {
    if (shells[s].volume == 0.0) return out;  // a sheet with two faces
    if (shells[s].volume > 0.0) continue;
    bool cavity = false;
    if (shells.size() > 1 && (angles += static_cast<double>(mesh.triangles.size())) <= most_angles) {
      const glm::ivec3& t = mesh.triangles[static_cast<size_t>(shells[s].first)];
      const glm::dvec3 middle = (corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) / 3.0;
      cavity = winding(mesh, shell_of, static_cast<int>(s), middle) > 0.5;
    } else {
      for (size_t r = 0; r < shells.size() && !cavity; ++r) cavity = shells[r].volume > 0.0 && holds(shells[r].box, shells[s].box);
    }
    turned[s] = cavity ? 0 : 1;
    out.turned += cavity ? 0 : 1;
  }
  if (out.turned > 0)
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
      if (turned[static_cast<size_t>(shell_of[t])]) turn_over(mesh, t);
  out.closed = true;
  return out;
}

}  // namespace flexframe::render
