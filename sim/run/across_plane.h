// Beams that rest in a plane and would leave it: columns whose weak way lies across the plane, deep narrow beams that tip over sideways.
#pragma once

#include "sim/base/notes.h"
#include "sim/model/model.h"
#include "sim/scene/scene.h"
#include "sim/time/system.h"

#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// A static start whose beams with automatic effects bend in a plane only, because the scene moves in one; and, at the same place, that of
// the same scene whose beams bend across the plane and twist as well. There all that leads out of the plane is in balance, stable or not.
struct RestInSpace {
  std::vector<std::string> beams;  // that are let out
  System flat, wide;
};
// effects: of the run. Empty where no beam is held in a plane. Throws as make_system does.
std::optional<RestInSpace> rest_in_space(const Scene& scene, const std::vector<EffectState>& effects);

// Whether such a start is stable in space too, by the small motions about it (linearise.h): warns if not. Where it would go instead is not
// sought: that search took a thousand times the run. Costs nothing elsewhere, and gives scenes of more than some hundred coordinates up.
void warn_of_leaving_plane(const Scene& scene, const std::vector<EffectState>& effects, Notes& notes);

}  // namespace flexframe::sim
