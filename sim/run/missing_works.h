// Works supplied and dissipated that the exponential method's long steps miss.
#pragma once

#include "sim/run/histories_run.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// Where the energies of a run by the exponential method do not balance (time_error.h), its works are those of a run made again that follows
// them within the steps (time/step_works.h), if that closes the gap: no output feels them, so no step is made for them. Not where the run
// took longer than a check may beside it (least_check). scene, options: of the run; shares: of its weights, empty where not known.
void add_missing_works(const Scene& scene, const SimulateOptions& options, const std::vector<double>& shares, Results& results);

}  // namespace flexframe::sim
