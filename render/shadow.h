// Private to the drawing: soft shadows from one depth map of the key light.
//
// Bodies: exponential variance shadow map, filtered once, one look-up a fragment (Donnelly, Lauritzen, "Variance shadow
// maps", 2006; Lauritzen, McCool, "Layered variance shadow maps", 2008). Ground: coverage of the map, blurred the wider
// the higher the occluder.
#pragma once

#include "render/backdrop.h"
#include "render/view.h"

#include <vector>

namespace flexframe::render {

constexpr int shadow_size = 1024;       // texels of the depth along each side
constexpr int filtered_size = 512;      // of the filtered map
constexpr float shadow_warp = 30.0f;

// Orthographic light: map coordinates (0..1, 0..1, depth 0..1 from the light) of a world point.
struct LightFrame {
  glm::dmat4 map_from_world{1.0};
  glm::dvec3 to_light{0.0, 1.0, 0.0};  // world, unit
  double texel = 0.0;                  // m
  double depth_range = 0.0;            // m
};
LightFrame make_light(const glm::dvec3& to_light, const Bounds& bounds);

// filtered_size^2 texels of two floats: filtered exp(w (depth - 1/2)) and its square. depth: shadow_size^2 values, 1 where empty.
std::vector<float> filter_shadow(const std::vector<float>& depth, const LightFrame& light, double radius);

// Share of light taken from the ground, 0..255 a pixel of the view's area, rows from the top.
std::vector<std::uint8_t> ground_shadow(const std::vector<float>& depth, const LightFrame& light, const GroundFrame& ground,
                                        const ViewFrame& frame, double radius);

}  // namespace flexframe::render
