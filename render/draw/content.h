// Private to the drawing: what a picture holds, checked, with the boxes that say where on the picture it lies.
#pragma once

#include "render/frame/view.h"
#include "render/picture/shapes.h"

#include <span>
#include <vector>

namespace flexframe::render {

// Surfaces of the picture, then its arrows and triads turned into surfaces.
struct Content {
  std::vector<Surface> surfaces;
  std::vector<Bounds> boxes;  // one a surface, in its own frame: tighter on the picture than a box of the world
  std::vector<Shape> shapes;  // memory of arrows
  Bounds all;                 // world; of surfaces, lines and markers
  Bounds casters;             // world; of what throws shadows
};

// Throws ArgumentError if the picture is inconsistent.
Content gather_content(const Picture& picture);

// The picture in other units of length, everything times `factor`: rooms of single precision and fixed small numbers are made for
// machines of metres. unit_scale: a power of two that makes the picture of that size, 1 (today's bits) from centimetres to kilometres.
double unit_scale(const Content& content, const Bounds& motion);
// bounds: what the ground's grid is measured by, unscaled: its steps are round in the picture's own metres.
Picture scaled_picture(const Picture& picture, double factor, const Bounds& bounds);

bool all_finite(std::span<const glm::vec3> values);
inline bool casts(const Surface& s) { return s.casts_shadow && s.opacity >= 1.0f && !s.triangles.empty(); }
bool translucent(const Lines& lines);

// Samples of the view (from its lower left corner) that a posed box may cover, with a rim of `extra` samples; empty if it is out of sight.
// per_pixel: samples along a pixel's side.
PixelRect covered(const Bounds& box, const glm::dmat4& pose, const ViewFrame& frame, int per_pixel, double extra);

// The same of everything in the content and the picture's lines and markers; unit: samples of one pixel at 720 lines.
// surfaces: only those; empty: all.
PixelRect covered(const Content& content, const Picture& picture, const ViewFrame& frame, int per_pixel, double unit,
                  const std::vector<bool>& surfaces = {});

}  // namespace flexframe::render
