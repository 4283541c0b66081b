// Effects: which elastic coordinates and terms a beam gets. What is not called for is not in the model at all.
#pragma once

#include "sim/beam.h"
#include "sim/scene.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct EffectDecision {
  BeamEffects effects;
  std::vector<std::string> why;   // one sentence an effect
};

// Whether the scene moves in a plane by symmetry (all axes normal to one direction, loads in the plane): exact and free.
// normal: unit, world axes, or zero when the scene is spatial. orientation: of every body at the start, world axes.
Vec3 plane_normal(const Scene& scene, const std::vector<Mat3>& orientation);

// Joints and forces that act on a body.
int attachment_count(const Scene& scene, const std::string& body);

// Effects of one beam. `normal_in_body`: the plane's normal in body axes, zero when spatial. `attachments`: joints and forces on it.
EffectDecision decide_effects(const BodyDef& body, const BeamDef& beam, const Vec3& normal_in_body, int attachments);

}  // namespace flexframe::sim
