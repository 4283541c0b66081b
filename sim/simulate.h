// From a scene to results: model, assembly, integration with located events, sampling.
#pragma once

#include "sim/results.h"

#include <functional>
#include <optional>

namespace flexframe::sim {

struct SimulateOptions {
  std::optional<double> tolerance;   // overrides the scene's
  std::optional<Method> method;
  bool estimate_error = true;        // runs the scene once more ten times looser and compares (less than half the run's cost)
  // Called now and then with the simulated time (s); may throw to stop.
  std::function<void(double time)> progress;
};

// Throws InputError for a scene that makes no mechanism, SimulationError when it cannot be integrated, with time and cause.
Results simulate(const Scene& scene, const SimulateOptions& options = {});

const char* method_name(Method method);

}  // namespace flexframe::sim
