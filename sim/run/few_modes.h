// Bodies of too few modes, told by a second run: beams of which a scene keeps some with two more in each direction, bodies of files with
// the highest modes of the file heavier. (Eigenforms of modal beams are judged by model_check.)
#pragma once

#include "sim/bodies/further_shapes.h"
#include "sim/results/histories.h"
#include "sim/run/histories_run.h"
#include "sim/scene/scene.h"
#include "sim/time/system.h"

namespace flexframe::sim {

// A run to compare with: the outputs of the scene, with what tolerance, in how many samples (0: all) and with what error of time, relative
// to the outputs' ranges, they come; the largest deflection of a body, m, against which places that stand still count.
struct ComparedRun {
  const Histories& histories;
  double tolerance = 0.0;
  int samples = 0;
  double error = 0.0, deflection = 0.0;
};

// A warning where an output moves by more than `asked` of its range and than what the errors of time of two runs explain; a note where that
// is not known, as errors of time hide it or the second run fails or takes longer than check_price. Nothing where no beam has keep_modes.
// Bodies whose elastic coordinates are output or given keep theirs. options: those of the run itself, whose work is in `statistics`; the
// warning goes there.
void warn_of_few_modes(const Scene& scene, const SimulateOptions& options, const ComparedRun& run, double asked,
                       SolverStatistics& statistics);

// The further shapes of the scene's bodies of files, of those that have some and whose modes are moved by loads: a scene that gives the
// modes' start means just these.
FurtherOfBodies further_of_files(const Scene& scene, const Model& model);

// Files of `flexframe reduce` have further shapes of their model: a run with them tells what the coordinates leave out, none
// beside runs of more than half a second in which they are worth little. A warning where an output moves by more than `asked` of its range,
// beyond what the errors of time explain; a note where that run takes more than `allowed` CPU s (short ones: twice as much).
//
// Other bodies of files end at some frequency, and what a file does not hold cannot be run. But what its last modes do under loads is what
// the next ones would do: where the loads are slow they follow them at once, whatever they weigh, as static deflections do (also those of a
// reduction's interfaces, which no mode of the whole model is). So a run in which the highest third of each file's modes, and of those
// that move, weighs twice as much tells: a warning where an output moves by more than `asked` of its range, beyond what the error of time
// explains; runs of more than half a second only where these modes move; a note where the second run takes more than `allowed` CPU s.
// start: of the scene, not yet integrated; results: those of the run; the rest as above.
void warn_of_last_modes(const System& start, const Scene& scene, const SimulateOptions& options, const Histories& reference, double asked,
                        double allowed, Results& results);

}  // namespace flexframe::sim
