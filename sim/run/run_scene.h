// One run of a scene as it stands: results with the estimated error of time and the check of what was left out.
#pragma once

#include "sim/results/results.h"
#include "sim/run/histories_run.h"

namespace flexframe::sim {

// An accuracy in the options or the scene is not looked at (sim/simulate.h does).
// Throws InputError for a scene that makes no mechanism, SimulationError when it cannot be integrated, with time and cause.
Results run_scene(const Scene& scene, const SimulateOptions& options = {});

}  // namespace flexframe::sim
