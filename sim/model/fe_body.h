// Beams of finite elements as bodies of the model, made once for runs that leave them as they are.
#pragma once

#include "sim/bodies/beam_kept.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// A beam as its part of the model has it.
struct FeBody {
  FlexibleBody body;
  ShownFrame shown;
  bool fewer = false;  // elements than the scene gives
};

// The beam with these effects on its mean axes, in its modes where it has up to 150 coordinates or keeps few of them (keep_modes).
// held: where joints and loads take hold of it, for the static shapes beside kept modes. damped: damping ratios are added afterwards.
// The bodies made last are kept, a thread's own, and given again where all of the beam is the same. Throws SimulationError where modes
// cannot be found.
FeBody fe_body(const BeamDef& beam, const BeamEffects& effects, const std::vector<HeldPoint>& held, bool damped);

// Whether a damping ratio other than 0 is given.
bool has_ratio(const Damping& damping);

}  // namespace flexframe::sim
