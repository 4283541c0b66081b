// Private to the drawing: ambient occlusion from the depth of the picture, on the processor, at half the resolution.
//
// After McGuire, Osman, Bukowski, Hennessy, "The Alchemy screen-space ambient obscurance algorithm", 2011: obscurance from
// samples on a spiral around the pixel, with a fixed 4 x 4 pattern of rotations that a 4 x 4 mean of like depths removes.
#pragma once

#include "render/frame/backdrop.h"
#include "render/frame/view.h"

#include <vector>

namespace flexframe::render {

// Share of ambient light that is left, 255: all, of the pixels in reach of surfaces. radius: reach, m.
// strength: 2.2 usual, more is darker. ground may be null; it darkens near surfaces although it has no depth of its own.
Mask compute_occlusion(const Samples& samples, const ViewFrame& frame, const GroundFrame* ground, double radius, double strength);

}  // namespace flexframe::render
