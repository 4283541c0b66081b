// Private to the drawing: soft shadows from one depth map of the key light.
//
// Bodies: exponential variance shadow map, filtered once, one look-up a fragment (Donnelly, Lauritzen, "Variance shadow
// maps", 2006; Lauritzen, McCool, "Layered variance shadow maps", 2008). Ground: coverage of the map, blurred the wider
// the higher the occluder.
#pragma once

#include "render/frame/backdrop.h"
#include "render/frame/view.h"

#include <span>
#include <vector>

namespace flexframe::render {

constexpr int shadow_size = 1024;   // texels of the depth along each side
constexpr int filtered_size = 512;  // of the filtered map
// Steep surfaces are seen across many depths within the filter's width: a larger warp would see only the farthest, with hard, jagged edges.
constexpr float shadow_warp = 5.0f;

// Orthographic light: map coordinates (0..1, 0..1, depth 0..1 from the light) of a world point.
struct LightFrame {
  glm::dmat4 map_from_world{1.0};
  glm::dvec3 to_light{0.0, 1.0, 0.0};  // world, unit
  double texel = 0.0;                  // m
  double depth_range = 0.0;            // m
};
LightFrame make_light(const glm::dvec3& to_light, const Bounds& bounds);

// The part of the map that may hold casters, texel by texel of the filtered map.
struct ShadowMap {
  int x = 0, y = 0, width = 0, height = 0;  // texels of the depth, multiples of shadow_size / filtered_size; rows from t = 0
  struct Texel {
    float cover = 0.0f;  // share with a caster
    float depth = 0.0f;  // mean of the casters', 0..1 from the light
  };
  std::vector<Texel> texels;
};

// Depth of casters seen from the light, on the processor: one number a texel needs no shader, no copy back and less set-up for each of
// many small triangles than OpenGL. Keeps its memory from picture to picture.
class CasterDepth {
 public:
  // Empty, of the part of the map that `part` names.
  void start(const ShadowMap& part);
  // Of a closed mesh the sides towards the light, which throw the whole shadow; else both. A texel has what lies at its centre.
  void add(const Surface& surface, const LightFrame& light);
  // Means of the casters' depths and their share, texel by texel.
  void reduce(ShadowMap& map) const;

 private:
  void fill(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, float area);
  int x_ = 0, y_ = 0, width_ = 0, height_ = 0;
  std::vector<float> depths_;         // 1: no caster
  std::vector<glm::vec3> projected_;  // texels of the part, depth
};

// Part of the map that posed boxes may cover, still empty.
ShadowMap shadow_part(std::span<const Surface> surfaces, std::span<const Bounds> boxes, const LightFrame& light);

// Filtered exp(w (depth - 1/2)) and its square, two floats a texel of the filtered map; beyond the rim all is empty.
struct ShadowMoments {
  int x = 0, y = 0, width = 0, height = 0;  // texels; may lie beyond the map's
  std::vector<float> values;
};
ShadowMoments filter_shadow(const ShadowMap& map, const LightFrame& light, double radius);

// Light taken from the ground, 255: all, of the pixels in reach.
Mask ground_shadow(const ShadowMap& map, const LightFrame& light, const GroundFrame& ground, const ViewFrame& frame, double radius);

}  // namespace flexframe::render
