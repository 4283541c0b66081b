// One run with what is known of it from the motion itself, before anybody speaks of it: for searches that decide by it.
#pragma once

#include "sim/results/results.h"
#include "sim/run/histories_run.h"
#include "sim/run/left_out.h"
#include "sim/run/linear_limit.h"
#include "sim/scene/scene.h"
#include "sim/time/system.h"

#include <optional>
#include <vector>

namespace flexframe::sim {

struct JudgedRun {
  Scene scene;  // as it was simulated: with what its beams with automatic effects need (with_called_effects)
  Results results;
  std::vector<EffectState> effects;
  bool called = false;                     // scene and effects have more than the run had (without `again`)
  std::vector<LinearLimit> limits;         // how far its bodies were bent
  std::vector<LeftOutWorth> left_out;      // deformations that beams go without
  std::vector<LeftOutWorth> second_order;  // stiffening and gyroscopic terms, which a pair of runs tells better
  std::vector<double> shares;              // of its trees' weights (ErrorWeights), for runs beside it
  std::optional<System> start;             // of the scene, where options.estimate_error: for a looser run (simulate_histories_from)
};

// run_scene without the runs beside it: no estimate of time, nothing reported. Every beam is judged, whoever chose its effects; beams with
// automatic effects get what is worth more than a third of `asked`: the run is made again with that, or, without `again`, out.scene and
// out.effects have it and the run does not. Throws what run_scene throws.
JudgedRun run_judged(const Scene& scene, const SimulateOptions& options, double asked, bool again = true);

}  // namespace flexframe::sim
