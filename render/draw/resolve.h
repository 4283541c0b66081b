// Private to the drawing: samples, shells and backdrop become pixels, in linear light.
#pragma once

#include "render/frame/view.h"
#include "render/image/image.h"

#include <vector>

namespace flexframe::render {

// Shadow (0..255 light taken) and occlusion (255: all light left) of the ground onto the backdrop.
void darken_backdrop(Image& image, const PixelRect& area, const Mask& shadow, const Mask& occlusion);

// Box filter over the samples of each pixel, over the pixels of `image` (the backdrop) in the area. Shells are composed
// over each sample in order of depth (Porter, Duff, "Compositing digital images", 1984). occlusion: as above, for surfaces.
void resolve(Image& image, const PixelRect& area, const Samples& samples, const std::vector<GhostLayer>& ghosts, const Mask& occlusion);

// A backdrop with alpha in linear light of 16 bits.
Image16 linear_backdrop(const Image& backdrop);

// The same as resolve from the samples' 16 bits (Samples::fine) into linear light with alpha; the backdrop in bytes lies under them.
void resolve_linear(Image16& image, const Image& backdrop, const PixelRect& area, const Samples& samples,
                    const std::vector<GhostLayer>& ghosts, const Mask& occlusion);

// Darkens samples of the surfaces in `outlined` (indexed by mark) that have a farther or no surface within `radius` samples.
void draw_silhouettes(Samples& samples, const std::vector<bool>& outlined, int radius);

}  // namespace flexframe::render
