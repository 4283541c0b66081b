#include "sim/simulate.h"

#include "sim/accuracy/accuracy.h"

namespace flexframe::sim {

Results simulate(const Scene& scene, const SimulateOptions& options) {
  if (const std::optional<double> accuracy = options.tolerance  ? std::nullopt
                                             : options.accuracy ? options.accuracy
                                                                : scene.simulation.accuracy) {
    SimulateOptions inner = options;
    inner.accuracy.reset();
    return simulate_to_accuracy(scene, *accuracy, inner);
  }
  return run_scene(scene, options);
}

}  // namespace flexframe::sim
