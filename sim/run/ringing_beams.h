// Beams that ring: a load comes at once, a stop strikes, a beam is let go, and what it vibrates with shows in the outputs.
#pragma once

#include "sim/results/histories.h"
#include "sim/run/effect_report.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// Indices of bodies: beams of finite elements, mixed and lumped ones, also those of which modes are kept, whose own vibrations, as fast as
// an output goes to and fro by more than half of `asked` of its range, are waves that their elements do not carry well: a wave number k
// with k h above a half for bending (cubic elements of length h vibrate too fast by (k h)^4 / 2880), above a fifth for lumped ones and for
// waves along the axis, of twist and of shear (linear ones, (k h)^2 / 24). Forces, moments and stresses lose more by that than the
// deflection does, from which coarse_beams.h judges: mode k of a span whose weight comes at once has the share 1 / k^5 of its deflection, 1
// / k^2 of its support's force. Whether the elements are too few is told by other numbers of them (model_check.h). A vibration faster than
// the samples counts where an output turns at every second sample.
std::vector<size_t> beams_that_ring(const Scene& scene, const std::vector<EffectState>& effects, const Histories& run, double asked);

// Radians a second of the fastest vibration that one of the outputs shows: of two cycles in the shortest time, each half of which moves it
// by more than `share` of its range. 0: none goes to and fro so often.
double fastest_vibration(const Histories& run, double share);

}  // namespace flexframe::sim
