// What tests of drawn pictures share: a renderer, a view from the front in which pixels are known, a look at one of them.
#pragma once

#include "render/draw/renderer.h"
#include "render/picture/shapes.h"

namespace flexframe::render {

inline Renderer& renderer() {
  static Renderer r;
  return r;
}

inline Surface surface_of(const Shape& shape) {
  Surface s;
  s.positions = shape.positions;
  s.normals = shape.normals;
  s.triangles = shape.triangles;
  s.two_sided = false;
  return s;
}

// Camera at z = 5, one unit is 100 pixels.
inline Picture front_view() {
  Picture p;
  p.size = {400, 300};
  p.camera.projection = Projection::orthographic;
  p.camera.height = 3.0;
  p.camera.position = {0, 0, 5};
  p.background.top = p.background.bottom = glm::vec3(1.0f);
  p.look = plain_look();
  return p;
}

// Clip coordinates of samples, so that positions are samples: x, y in [0, size]; depth is z.
inline glm::dmat4 clip_of(int width, int height) {
  glm::dmat4 m(1.0);
  m[0][0] = 2.0 / width;
  m[1][1] = 2.0 / height;
  m[3] = glm::dvec4(-1.0, -1.0, 0.0, 1.0);
  return m;
}

inline glm::ivec3 at(const Image& image, int x, int y) {
  const std::uint8_t* p = &image.pixels[(std::size_t(y) * image.width + x) * image.channels];
  return {p[0], p[1], p[2]};
}

}  // namespace flexframe::render
