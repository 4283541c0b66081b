// Shading points: which corners of a mesh share a normal. From the normals of the file where it has them (two corners at one place
// share iff their normals agree), else by the angle between the triangles at each edge.
#include "render/picture/adjacency.h"
#include "render/picture/forest.h"
#include "render/picture/mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

namespace flexframe::render {
void compute_shading_points(Mesh& mesh, const std::vector<glm::vec3>& corner_normals, double crease_angle) {
  const size_t corners = 3 * mesh.triangles.size();
  const std::vector<int> welded = weld_equal(std::span<const glm::dvec3>(mesh.positions));
  auto position_of = [&](size_t c) { return mesh.triangles[c / 3][static_cast<int>(c % 3)]; };
  auto place_of = [&](size_t c) { return welded[position_of(c)]; };
  Forest forest(corners);

  // Corners by place, in the order of the file.
  std::vector<int> begin(mesh.positions.size() + 1, 0), at(corners);
  for (size_t c = 0; c < corners; ++c) ++begin[place_of(c) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int> fill(begin.begin(), begin.end() - 1);
  for (size_t c = 0; c < corners; ++c) at[fill[place_of(c)]++] = static_cast<int>(c);

  if (!corner_normals.empty()) {
    // Within 1 degree is the same normal: files round to a few digits.
    const float same = std::cos(std::numbers::pi_v<float> / 180.0f);
    for (size_t p = 0; p + 1 < begin.size(); ++p) {
      // Each corner joins the first kept one that agrees; a place has few different normals.
      std::vector<int> kept;
      for (int i = begin[p]; i < begin[p + 1]; ++i) {
        const int c = at[i];
        bool found = false;
        for (const int k : kept)
          if (glm::dot(corner_normals[c], corner_normals[k]) >= same) {
            forest.join(c, k);
            found = true;
            break;
          }
        if (!found) kept.push_back(c);
      }
    }
  } else {
    // Two triangles at an edge share the normals of its ends unless they meet at more than the crease angle.
    const double limit = std::cos(crease_angle * std::numbers::pi / 180.0);
    std::vector<glm::dvec3> normal(mesh.triangles.size());
    for (size_t t = 0; t < normal.size(); ++t) {
      const glm::ivec3 v = mesh.triangles[t];
      const glm::dvec3 a = mesh.positions[v.x];
      const glm::dvec3 n = glm::cross(mesh.positions[v.y] - a, mesh.positions[v.z] - a);
      const double length = glm::length(n);
      normal[t] = length > 0.0 ? n / length : glm::dvec3(0.0);
    }
    for_each_edge(mesh.triangles, welded, [&](int, std::span<const EdgeSide> sides) {
      // Edges of many triangles (fans of a non-manifold mesh) compare all pairs, a few at most.
      const size_t most = std::min<size_t>(sides.size(), 8);
      for (size_t a = 0; a < most; ++a)
        for (size_t b = a + 1; b < most; ++b) {
          const EdgeSide &p = sides[a], &q = sides[b];
          const glm::dvec3 na = normal[p.triangle], nb = normal[q.triangle];
          const bool flat = na == glm::dvec3(0.0) || nb == glm::dvec3(0.0);
          if (!flat && glm::dot(na, nb) < limit) continue;
          // The corners at the edge's two ends.
          const int p0 = 3 * p.triangle + p.corner, p1 = 3 * p.triangle + (p.corner + 1) % 3;
          const int q0 = 3 * q.triangle + q.corner, q1 = 3 * q.triangle + (q.corner + 1) % 3;
          forest.join(p.upwards ? p0 : p1, q.upwards ? q0 : q1);
          forest.join(p.upwards ? p1 : p0, q.upwards ? q1 : q0);
        }
    });
  }

  // Groups are numbered by their first corner; a point is a position in a group, of one material: colours end at its borders.
  std::vector<int> group_number(corners, -1);
  mesh.normal_groups = 0;
  mesh.point_position.clear();
  mesh.point_group.clear();
  mesh.triangle_points.resize(mesh.triangles.size());
  std::vector<int> first_point(mesh.positions.size(), -1), next_point, point_material;
  for (size_t c = 0; c < corners; ++c) {
    const size_t root = forest.root(static_cast<int>(c));
    if (group_number[root] < 0) group_number[root] = mesh.normal_groups++;
    const int group = group_number[root], position = position_of(c);
    int point = first_point[position];
    const int material = mesh.triangle_material[c / 3];
    while (point >= 0 && (mesh.point_group[point] != group || point_material[point] != material)) point = next_point[point];
    if (point < 0) {
      point = static_cast<int>(mesh.point_position.size());
      mesh.point_position.push_back(position);
      mesh.point_group.push_back(group);
      point_material.push_back(material);
      next_point.push_back(first_point[position]);
      first_point[position] = point;
    }
    mesh.triangle_points[c / 3][static_cast<int>(c % 3)] = point;
  }
}

}  // namespace flexframe::render
