// Private to the drawing: light on what a raster has found, on the processor: the formulas of the fragment shader (shaders.cpp), once a
// pixel where its samples show the same surface in the same direction and colour, else once for each of those that differ.
#pragma once

#include "render/draw/painter.h"
#include "render/draw/raster.h"

namespace flexframe::render {

// Colours and marks of all samples into samples.colors. moments: what the light sees, used if view.light is set.
void shade(const Raster& raster, const Picture& picture, const ViewState& view, const ShadowMoments& moments, Samples& samples);

}  // namespace flexframe::render
