// Private to the drawing: samples, shells and backdrop become pixels, in linear light.
#pragma once

#include "render/image.h"
#include "render/view.h"

#include <vector>

namespace flexframe::render {

struct ResolveInput {
  const Samples& samples;
  const std::vector<GhostLayer>& ghosts;
  const std::vector<std::uint8_t>& ground_shadow;  // a pixel of the area, 0..255 light taken; empty: none
  const std::vector<std::uint8_t>& occlusion;      // a pixel of the area, 255: all light left; empty: none
  bool ground = false;                             // occlusion darkens the backdrop too
};

// Box filter over the samples of each pixel, over the pixels of `image` (the backdrop) in the area. Shells are composed
// over each sample in order of depth (Porter, Duff, "Compositing digital images", 1984).
void resolve(Image& image, const PixelRect& area, const ResolveInput& input);

// Darkens samples of the surfaces in `outlined` (indexed by mark) that have a farther or no surface within `radius` samples.
void draw_silhouettes(Samples& samples, const std::vector<bool>& outlined, int radius);

}  // namespace flexframe::render
