// Private to the drawing: one camera's numbers for one rectangle of the picture, and the arrays that go from step to step.
#pragma once

#include "render/picture/picture.h"

#include <cstdint>
#include <vector>

namespace flexframe::render {

// Rectangle of pixels from the upper left corner of the picture.
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
  bool operator==(const PixelRect&) const = default;
};

// Smallest rectangle around both.
PixelRect joined(const PixelRect& a, const PixelRect& b);

// Depth is reversed: 1 at the near plane, 0 at the far plane and where nothing is drawn.
struct ViewFrame {
  PixelRect area;
  glm::dmat4 view{1.0};          // camera from world
  glm::dmat4 clip{1.0};          // clip from camera
  double near = 0.1, far = 1.0;  // m
  bool orthographic = false;
  double pixel = 0.0;  // size of a pixel: m at 1 m distance (perspective), m (orthographic)

  // Distance from the camera's plane, m, of a depth.
  double distance(double depth) const { return orthographic ? far - depth * (far - near) : near * far / (near + depth * (far - near)); }
};

// Near and far enclose the bounds (world); never empty.
ViewFrame make_view(const Camera& camera, const PixelRect& area, const Bounds& bounds);

// The camera of an inset that covers `area`: from where the first view's camera is, at the inset's point, its zoom times as large.
Camera inset_camera(const Camera& first, const ViewFrame& frame, const Inset& inset, const PixelRect& area);

// Pixel position (from the upper left of the picture, y down) of a world point; false if it is behind the camera.
bool project(const ViewFrame& frame, const glm::dvec3& world, glm::dvec2& pixel);

// One byte a pixel for a part of a view's area (from its upper left corner), rows from the top.
struct Mask {
  PixelRect part;
  std::vector<std::uint8_t> values;  // empty: `outside` everywhere
  // First value of a row of the area; null: all outside.
  const std::uint8_t* row(int y) const {
    return values.empty() || y < part.y || y >= part.y + part.height ? nullptr : &values[std::size_t(y - part.y) * part.width];
  }
  std::uint8_t at(int x, int y, std::uint8_t outside) const {
    x -= part.x;
    y -= part.y;
    return values.empty() || x < 0 || y < 0 || x >= part.width || y >= part.height ? outside : values[std::size_t(y) * part.width + x];
  }
};

// Samples as drawn: rows from the bottom, RGBA with square roots of linear light; alpha 0: nothing, else the mark of the surface
// (1 + index modulo 254; 255: lines and markers).
struct Samples {
  PixelRect part;             // of the view's area (from its upper left corner): the pixels these samples belong to
  int width = 0, height = 0;  // part's times per_pixel
  int per_pixel = 1;          // along each axis
  std::vector<std::uint8_t> colors;
  std::vector<std::uint16_t> fine;  // the same in 16 bits, of a picture in linear light only
  std::vector<float> depth;         // of these samples only if asked for
};

// One translucent shell: a rectangle of samples, straight alpha, colours as in Samples.
struct GhostLayer {
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<std::uint8_t> colors;
  std::vector<float> depth;  // empty for a single layer
};

}  // namespace flexframe::render
