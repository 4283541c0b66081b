#include "render/draw/visible.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace flexframe::render {

std::span<const glm::uvec3> VisibleTriangles::select(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                                                     const glm::dmat4& clip_from_surface, int width, int height, Facing facing) {
  // To samples; what lies behind the viewer becomes NaN, for which every test below says: keep.
  const glm::dmat4& m = clip_from_surface;
  const double half_width = 0.5 * width, half_height = 0.5 * height;
  glm::vec4 x, y, w;
  for (int c = 0; c < 4; ++c) {
    x[c] = static_cast<float>(half_width * (m[c][0] + m[c][3]));
    y[c] = static_cast<float>(half_height * (m[c][1] + m[c][3]));
    w[c] = static_cast<float>(m[c][3]);
  }
  const float least = 1e-6f * (std::abs(w.x) + std::abs(w.y) + std::abs(w.z) + std::abs(w.w));
  projected_.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const glm::vec3 p = positions[i];
    const float depth = w.x * p.x + w.y * p.y + w.z * p.z + w.w;
    const float share = depth > least ? 1.0f / depth : std::numeric_limits<float>::quiet_NaN();
    projected_[i] = {(x.x * p.x + x.y * p.y + x.z * p.z + x.w) * share, (y.x * p.x + y.y * p.y + y.z * p.z + y.w) * share};
  }

  // What vertices may be off by: OpenGL rounds them to 1/256 sample, and a few roundings in float at the far end of the viewport.
  const float off = 1.0f / 64.0f + 16.0f * std::numeric_limits<float>::epsilon() * static_cast<float>(std::max(width, height));
  // Beyond this, rounding grows with the distance.
  const float reach = 4.0f * static_cast<float>(std::max(width, height));
  const glm::vec2 edge(static_cast<float>(width) + 3.0f, static_cast<float>(height) + 3.0f);
  const float side = facing == Facing::any ? 0.0f : facing == Facing::counterclockwise ? 1.0f : -1.0f;
  if (visible_.size() < triangles.size()) visible_.resize(triangles.size());
  if (indices_.size() < triangles.size()) indices_.resize(triangles.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::uvec3 t = triangles[i];
    const glm::vec2 a = projected_[t.x], b = projected_[t.y], c = projected_[t.z];
    const glm::vec2 lower = glm::min(glm::min(a, b), c), upper = glm::max(glm::max(a, b), c);
    // Both ends between the same two rows or columns of centres k + 0.5, or out of sight on the same side.
    // In this order of arguments a NaN becomes 0, which an int can hold.
    const glm::vec2 low = glm::min(glm::max(glm::vec2(0.0f), lower + (1.5f - off)), edge),
                    high = glm::min(glm::max(glm::vec2(0.0f), upper + (1.5f + off)), edge);
    const bool between = static_cast<int>(low.x) == static_cast<int>(high.x) || static_cast<int>(low.y) == static_cast<int>(high.y);
    const glm::vec2 ab = b - a, ac = c - a;
    const float area = side * (ab.x * ac.y - ac.x * ab.y);
    const float doubt = off * (std::abs(ab.x) + std::abs(ab.y) + std::abs(ac.x) + std::abs(ac.y) + off);
    const bool close = std::min(lower.x, lower.y) > -reach && std::max(upper.x, upper.y) < reach;
    const bool away = side != 0.0f && close && area < -doubt;
    visible_[n] = t;
    indices_[n] = static_cast<std::uint32_t>(i);
    // A NaN may be lost in min and max but not in the area.
    n += (between || away) && area == area ? 0u : 1u;
  }
  count_ = n;
  return {visible_.data(), n};
}

}  // namespace flexframe::render
