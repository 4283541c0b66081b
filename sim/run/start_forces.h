// Forces at t = 0 of loads that come at once. Nothing is strained yet, so that a joint holds nothing of a beam; of finite elements it holds
// what the first of them weighs, 0.29 of it, until the beam has moved.
#pragma once

#include "sim/run/effect_report.h"
#include "sim/scene/scene.h"

#include <limits>
#include <string>
#include <vector>

namespace flexframe::sim {

// Whether an output of this unit converges slowly with elements and modes: forces, moments, stresses and accelerations.
bool converges_slowly(const std::string& unit);

// An element of half the length at most beside each end of the beam, be its elements half or twice as many. sets_length: ends only beside
// which a named place lies nearer than so many elements. False: there is no such end.
bool halve_first_elements(BeamDef& beam, double sets_length = std::numeric_limits<double>::infinity());

// A warning where a force, a moment or an acceleration of the run at t = 0 is off by more than `asked` of its range, from the start of the
// same scene with shorter elements at the ends of its beams. Nothing is looked at where it starts in equilibrium.
void warn_of_start_forces(const Scene& scene, const std::vector<EffectState>& effects, const Histories& run, double asked, Notes& notes);

}  // namespace flexframe::sim
