// Private to the drawing: what lies behind all surfaces, one value a pixel: gradient, ground grid, shadow on the ground.
#pragma once

#include "render/frame/view.h"
#include "render/image/image.h"

namespace flexframe::render {

// Gradient over the whole picture, 3 channels, or 4 all zero if the background is transparent.
Image paint_background(const Picture& picture);

// Where the ground is seen: the point of the ground behind pixel (x, y) is origin + u * axis_u + v * axis_v with
// (u, v, 1) ~ homography * (x, y, 1); the third component is positive where the ground is in view.
struct GroundFrame {
  glm::dvec3 origin, axis_u, axis_v, normal;
  glm::dmat3 pixel_to_ground{1.0};
  double spacing = 0.1;      // m
  double fade_radius = 1.0;  // m around the origin
  bool visible = false;      // false: seen from below or edge on
};
// Between the grid's lines, m.
double grid_spacing(const Ground& ground, const Bounds& bounds);
GroundFrame make_ground(const Ground& ground, const ViewFrame& frame, const Bounds& bounds);

// Grid lines over the view's area of the image; line_scale: pixels of a line of width 1.
bool paint_grid(Image& image, const GroundFrame& ground, const ViewFrame& frame, const Ground& settings, double line_scale);

// 1-2-5 step that gives about `count` steps over `extent`.
double nice_step(double extent, double count);

}  // namespace flexframe::render
