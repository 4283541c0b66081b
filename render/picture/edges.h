// Which edges of a triangle mesh are worth a line: boundaries and creases.
#pragma once

#include <glm/glm.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace flexframe::render {

// Flags for Surface::edge_flags: an edge is flagged if its two triangles meet at more than `angle` degrees, or it has not
// exactly two. Positions that coincide to the bit count as one, so that meshes split for their normals keep their edges.
// Compute once on the undeformed mesh.
std::vector<std::uint8_t> compute_feature_edges(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                                                double angle = 30.0);

}  // namespace flexframe::render
