// Private to the drawing: triangles that can touch a sample. Software OpenGL sets up every triangle it is given, for about the price of
// twenty tests like these; of a fine mesh most face away or fall between the samples.
#pragma once

#include <glm/glm.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace flexframe::render {

enum class Facing { any, counterclockwise, clockwise };

// Keeps its memory from mesh to mesh.
class VisibleTriangles {
 public:
  // Those of `triangles`, in their order, that may cover the centre of a sample of a viewport of width x height, seen by
  // clip_from_surface; with a facing, only those that may wind that way as seen. Triangles that are left out would not have
  // changed a sample: rounding of the vertices (to 1/256 sample) is allowed for. Those with a vertex behind the viewer stay.
  // The result lives until the next call.
  std::span<const glm::uvec3> select(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                                     const glm::dmat4& clip_from_surface, int width, int height, Facing facing);
  // Their indices in `triangles`, one each.
  std::span<const std::uint32_t> indices() const { return {indices_.data(), count_}; }

 private:
  std::size_t count_ = 0;
  std::vector<glm::vec2> projected_;
  std::vector<glm::uvec3> visible_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace flexframe::render
