// A second run of a scene beside a run, from the start that the first one made.
#pragma once

#include "sim/run/histories_run.h"
#include "sim/time/system.h"

#include <optional>

namespace flexframe::sim {

// A start of its own: copies of a System share what they compute of a motion in a plane.
System copy_start(const System& system);

// As simulate_histories(scene, options), bit for bit, without making bodies, modes and the assembled start once more. start:
// make_system(scene), not yet integrated.
Histories simulate_histories_from(const System& start, const Scene& scene, const SimulateOptions& options);

// As simulate_histories, within so many CPU s: none where it takes longer, of which a run is given up as soon as it shows that. spent: what
// it took is added, whatever comes of it. options.progress is not called.
std::optional<Histories> simulated_within(const Scene& scene, SimulateOptions options, double budget, double& spent);

}  // namespace flexframe::sim
