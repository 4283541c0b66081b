// Beams of which a scene keeps too few modes, told by a second run with two more in each direction. (Eigenforms of modal beams are judged
// by model_check.)
#pragma once

#include "sim/results/histories.h"
#include "sim/run/histories_run.h"
#include "sim/scene/scene.h"

namespace flexframe::sim {

// A warning where an output moves by more than `asked` of its range, beyond what the run's error of time explains; nothing where no beam
// has keep_modes, or the second run fails. Bodies whose elastic coordinates are output or given keep theirs. options: those of the
// run; reference: its outputs; deflection: the largest of a body, m, against which places that stand still count; the run's tolerance and
// estimated error are in `statistics`, the warning goes there.
void warn_of_few_modes(const Scene& scene, const SimulateOptions& options, const Histories& reference, double deflection, double asked,
                       SolverStatistics& statistics);

}  // namespace flexframe::sim
