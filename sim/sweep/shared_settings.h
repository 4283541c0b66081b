// Settings of an asked accuracy that all points of a sweep share: tolerance, method, modes and elements, effects.
//
// A search for every point costs many times the run that it ends with. Where a design has many points the settings are searched for at a
// few of them: the middle one, and those where a key is smallest or largest. Each of these is simulated to half of the asked accuracy; a
// run with half as many modes and elements more, at a tenth of the tolerance, judges it and all that follows. The settings of one place
// that keep the accuracy against these runs at all places are made cheaper (looser, fewer modes, fewer elements) for as long as they keep
// half of it, what the judges themselves may be off counted in. What is found is written to the sweep's folder once, whoever
// comes first, so that rows do not depend on workers, shards and kills.
//
// Errors are those of the outputs that responses read. A point that is not like the places searched is simulated to the accuracy by itself,
// as without shared settings: other choices in the scene, an output whose range, or a body whose deformation, is far from theirs, many more
// steps than they took, a run that fails, or one that differs from a run ten times tighter by more than what is asked leaves to time (not
// looked at where no errors are estimated). Every fiftieth point, or twenty of a large design, is judged by the settings that were found
// before they were made cheaper, with fewer elements and looser as far as that keeps a third of the accuracy, and says where the shared
// ones do not keep it.
#pragma once

#include "sim/results/histories.h"
#include "sim/sweep/sweep.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

struct SharedSettings {
  Scene written;        // of the first place, as it is written
  Scene chosen, finer;  // the same with the shared settings, and with those that judge
  std::optional<Method> method;
  std::vector<long> places;           // points where they were searched for
  double asked = 0.0, error = 0.0;    // accuracy; the largest error at the places
  double finer_error = 0.0;           // the largest error there of the settings that judge, as it was estimated
  std::string column;                 // of `error`
  VecX low, high;                     // ranges of the columns that are read, over the places
  VecX swings;                        // of the bodies, the largest over the places (SeenBeside)
  long steps = 0;                     // the most
  std::vector<std::string> warnings;  // of the place that warned most
};

// None where the sweep asks for no accuracy or has too few points for it to pay, or where no settings keep it. Written to, and taken from,
// the sweep's folder, which must be there. tick: called now and then, may throw to stop.
std::shared_ptr<const SharedSettings> find_shared_settings(const Sweep& sweep, const std::function<void()>& tick);

// What a run of a point with them gives; none where the point has to be simulated by itself. judged: by the settings before they were made
// cheaper, too.
struct SharedRun {
  Histories histories;
  double error = 0.0;
  std::string column;
  bool judged = false;
  std::vector<std::string> warnings;
};
std::optional<SharedRun> run_with_shared(const Sweep& sweep, const SharedSettings& shared, const Scene& scene, long point,
                                         const SimulateOptions& options);

// A sentence on what is shared and where it was searched for.
std::string shared_settings_text(const SharedSettings& shared);

}  // namespace flexframe::sim
