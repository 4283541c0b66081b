// Private to the drawing: which triangle is nearest at each sample, on the processor. Software OpenGL sets up and shades every fragment it
// is given; here a sample costs a comparison of depths, and what is seen is shaded afterwards (shading.h), once.
#pragma once

#include "render/draw/visible.h"
#include "render/frame/view.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace flexframe::render {

// A vertex as seen: sample coordinates, depth, one over the clip coordinate w.
struct Seen {
  float x = 0.0f, y = 0.0f, z = 0.0f, inverse_w = 1.0f;
};

// Keeps its memory from picture to picture.
class Raster {
 public:
  // Triangles of one surface, numbered from `first` on.
  struct Part {
    const Surface* surface = nullptr;
    int mark = 0;
    std::uint32_t first = 0;
    std::vector<Seen> seen;  // one a position
  };

  // Nothing seen yet in samples.width x samples.height samples, which begin at (x, y) from the lower left of a view of view_width x
  // view_height. Depths go to samples.depth, reversed: 0 is nothing.
  void start(Samples& samples, int x, int y, int view_width, int view_height);

  // False: a vertex lies behind the viewer or too far beside the view, and nothing is drawn. An equal depth leaves what is there. Vertices
  // are rounded to 1/256 sample; a centre on an edge belongs to one of the triangles that meet there.
  bool add(const Surface& surface, int mark, const glm::dmat4& clip_from_surface, Facing facing);

  std::span<const Part> parts() const { return {parts_.data(), used_}; }
  // By sample, rows from the bottom; 0: nothing, else one more than the triangle's number.
  std::span<const std::uint32_t> triangles() const { return triangles_; }
  // The part that a triangle's number belongs to.
  const Part& part_of(std::uint32_t triangle) const;

 private:
  struct Corner {
    std::int32_t x = 0, y = 0;  // 1/256 sample from the first centre
  };
  bool project(const Surface& surface, const glm::dmat4& clip_from_surface, Part& part);
  void fill(const Seen* const (&corners)[3], const Corner (&fixed)[3], std::uint32_t triangle);

  std::vector<Part> parts_;
  std::size_t used_ = 0;
  std::uint32_t next_ = 0;
  std::vector<Corner> fixed_;
  std::vector<std::uint32_t> triangles_;
  float* depth_ = nullptr;
  int x_ = 0, y_ = 0, width_ = 0, height_ = 0, view_width_ = 0, view_height_ = 0;
};

}  // namespace flexframe::render
