// One run of a scene as it stands: results with the estimated error of time and the check of what was left out.
#pragma once

#include "sim/results/results.h"
#include "sim/run/histories_run.h"

namespace flexframe::sim {

// What counts as an error where the scene asks for no accuracy, relative to an output's range.
inline constexpr double unasked_accuracy = 1e-2;

// An accuracy in the options or the scene is not looked at (sim/simulate.h does).
// Throws InputError for a scene that makes no mechanism, SimulationError when it cannot be integrated, with time and cause.
Results run_scene(const Scene& scene, const SimulateOptions& options = {});

// The scene with what its beams with automatic effects need beyond what is decided before a run, as run_scene simulates it: what is worth
// more than a third of `asked` along the motion of a run with these options (left_out.h). As it stands where it cannot be simulated.
Scene with_called_effects(const Scene& scene, const SimulateOptions& options, double asked);

}  // namespace flexframe::sim
