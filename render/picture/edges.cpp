#include "render/picture/edges.h"

#include "render/picture/adjacency.h"

#include <cmath>
#include <span>
#include <vector>

namespace flexframe::render {

std::vector<std::uint8_t> compute_feature_edges(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles, double angle) {
  std::vector<glm::vec3> normal(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const glm::uvec3& v = triangles[t];
    const glm::vec3 n = glm::cross(positions[v.y] - positions[v.x], positions[v.z] - positions[v.x]);
    const float l = glm::length(n);
    normal[t] = l > 0.0f ? n / l : glm::vec3(0.0f);
  }
  std::vector<std::uint8_t> flags(triangles.size(), 0);
  const float limit = static_cast<float>(std::cos(glm::radians(angle)));
  for_each_edge(triangles, weld_equal(positions), [&](int low, std::span<const EdgeSide> sides) {
    const auto normal_of = [&](std::size_t k) { return normal[sides[k].triangle]; };
    const bool sharp = sides.size() != 2 || glm::dot(normal_of(0), normal_of(1)) < limit;
    if (!sharp || low == sides[0].high) return;
    for (const EdgeSide& side : sides) {
      std::uint8_t& flag = flags[side.triangle];
      flag = static_cast<std::uint8_t>(flag | 1 << side.corner);
    }
  });
  return flags;
}

}  // namespace flexframe::render
