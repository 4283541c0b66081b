// Beams that rest in a plane and would leave it: columns whose weak way lies across the plane, deep narrow beams that tip over sideways.
#pragma once

#include "sim/base/notes.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// Of a static start whose beams with automatic effects bend in a plane only, because the scene moves in one: the same start with bending
// across the plane and twist, whose small motions tell whether it is stable there. Warns if not. Costs nothing elsewhere, and gives
// scenes of more than some hundred coordinates up.
void warn_of_leaving_plane(const Scene& scene, const std::vector<EffectState>& effects, Notes& notes);

}  // namespace flexframe::sim
