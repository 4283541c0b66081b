// From a scene to results: the door of this folder. Model, start, time integration with located events, sampling.
#pragma once

#include "sim/run/run_scene.h"

namespace flexframe::sim {

// A scene that asks for an accuracy is simulated by simulate_to_accuracy (sim/accuracy/accuracy.h), unless a tolerance is given here.
// Throws InputError for a scene that makes no mechanism, SimulationError when it cannot be integrated, with time and cause.
Results simulate(const Scene& scene, const SimulateOptions& options = {});

}  // namespace flexframe::sim
