// Fewer triangles for meshes that are finer than a picture's pixels: chosen once from the shape at rest by meshoptimizer, between vertices
// that stay, and looked at again in every picture. A vertex that no triangle has any more knows the triangle that stands for it; where any
// lies farther from it than half a pixel, or has another colour, more triangles are drawn. Vertices, their values and what is read from
// them are those of the whole mesh.
#pragma once

#include "render/picture/picture.h"

#include <glm/glm.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace flexframe::film {

struct DetailLevel {
  struct LeftOut {
    std::uint32_t point = 0;
    std::array<std::uint32_t, 3> corners{};
    glm::vec3 shares{0.0f};  // of the corners: the point of the triangle nearest to it at rest
  };
  std::vector<glm::uvec3> triangles;
  std::vector<LeftOut> left_out;
  double away = 0.0;  // m, farthest of them at rest
};

// Triangles of all bodies from which on any are left out.
inline constexpr std::size_t detail_from = 300000;

// Of a mesh of points (two or more may lie at one place: creases) at rest: an eighth and a 64th of the triangles, coarsest first; empty
// where that cannot be had. Bits do not depend on threads. pieces_from: triangles from which on the finer of the two is made piece by
// piece.
std::vector<DetailLevel> make_levels(std::span<const glm::vec3> rest, std::span<const glm::uvec3> triangles,
                                     std::size_t pieces_from = 2000000);

// Metres across which nothing is seen: half a pixel of the finest of a picture's views and insets, where it shows the nearest of these
// points; 0 where one lies behind a viewer.
double unseen_length(const render::Picture& picture, const glm::dmat4& pose, std::span<const glm::vec3> positions);

// The coarsest level whose left out points lie within `length` m of what stands for them, and have scalars within `value` of its; null:
// none. moved: the points are not where they were at rest.
const DetailLevel* fitting_level(std::span<const DetailLevel> levels, std::span<const glm::vec3> positions, bool moved, double length,
                                 std::span<const float> scalars, double value);

}  // namespace flexframe::film
