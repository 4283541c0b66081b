#include "render/picture/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace flexframe::render {

std::vector<std::uint8_t> compute_feature_edges(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles, double angle) {
  // One number for all positions that coincide.
  std::vector<unsigned> order(positions.size()), same(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto less = [&](unsigned a, unsigned b) {
    const glm::vec3 &p = positions[a], &q = positions[b];
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
  };
  std::sort(order.begin(), order.end(), less);
  for (std::size_t i = 0; i < order.size(); ++i)
    same[order[i]] = i > 0 && positions[order[i]] == positions[order[i - 1]] ? same[order[i - 1]] : order[i];

  // Edges sorted by their ends: the triangles of one edge lie side by side.
  struct Edge {
    unsigned a, b, triangle;
    int corner;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  std::vector<glm::vec3> normal(triangles.size());
  for (unsigned t = 0; t < triangles.size(); ++t) {
    const glm::uvec3& v = triangles[t];
    const glm::vec3 n = glm::cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]);
    const float l = glm::length(n);
    normal[t] = l > 0.0f ? n / l : glm::vec3(0.0f);
    for (int k = 0; k < 3; ++k) {
      const unsigned p = same[v[k]], q = same[v[(k + 1) % 3]];
      edges.push_back({std::min(p, q), std::max(p, q), t, k});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) {
    return p.a != q.a ? p.a < q.a : p.b != q.b ? p.b < q.b : p.triangle < q.triangle;
  });

  std::vector<std::uint8_t> flags(triangles.size(), 0);
  const float limit = static_cast<float>(std::cos(glm::radians(angle)));
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t j = i;
    while (j < edges.size() && edges[j].a == edges[i].a && edges[j].b == edges[i].b) ++j;
    const bool sharp = j - i != 2 || glm::dot(normal[edges[i].triangle], normal[edges[i + 1].triangle]) < limit;
    if (sharp && edges[i].a != edges[i].b)
      for (std::size_t k = i; k < j; ++k)
        flags[edges[k].triangle] = static_cast<std::uint8_t>(flags[edges[k].triangle] | 1 << edges[k].corner);
    i = j;
  }
  return flags;
}

}  // namespace flexframe::render
