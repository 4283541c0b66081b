// Bodies of too few modes, told by a second run: beams of which a scene keeps some with two more in each direction, bodies of files with
// the highest modes of the file heavier. (Eigenforms of modal beams are judged by model_check.)
#pragma once

#include "sim/results/histories.h"
#include "sim/run/histories_run.h"
#include "sim/scene/scene.h"
#include "sim/time/system.h"

namespace flexframe::sim {

// A warning where an output moves by more than `asked` of its range, beyond what the run's error of time explains; nothing where no beam
// has keep_modes, or the second run fails; a note where it takes too long, as of runs of more than 2 CPU s. Bodies whose elastic
// coordinates are output or given keep theirs. options: those of the run; reference: its outputs; deflection: the largest of a body, m,
// against which places that stand still count; the run's tolerance and estimated error are in `statistics`, the warning goes there.
void warn_of_few_modes(const Scene& scene, const SimulateOptions& options, const Histories& reference, double deflection, double asked,
                       SolverStatistics& statistics);

// Bodies of files end at some frequency, and what a file does not hold cannot be run. But what its last modes do under loads is what the
// next ones would do: where the loads are slow they follow them at once, whatever they weigh, as static deflections do (also those of a
// reduction's interfaces, which no mode of the whole model is). So a run in which the highest third of each file's modes weighs twice as
// much tells: a warning where an output moves by more than `asked` of its range, beyond what the error of time explains; runs of more
// than half a second only where these modes move. start: of the scene, not yet integrated; results: those of the run; the rest
// as above.
void warn_of_last_modes(const System& start, const Scene& scene, const SimulateOptions& options, const Histories& reference, double asked,
                        Results& results);

}  // namespace flexframe::sim
