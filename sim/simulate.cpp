#include "sim/simulate.h"

#include "sim/accuracy/accuracy.h"

namespace flexframe::sim {

Results simulate(const Scene& scene, const SimulateOptions& options) { return simulate_as_asked(scene, options); }

}  // namespace flexframe::sim
