// One run of a system from its assembled start: segments between known switches, located events, new partitions, choice of method.
#pragma once

#include "sim/results/results.h"
#include "sim/time/system.h"

#include <functional>
#include <string>
#include <vector>

namespace flexframe::sim {

// Who is told of a run while it goes on; either may be empty.
struct RunWatch {
  std::function<void(double time)> progress;           // now and then the simulated time, s; may throw to stop
  double most_steps = 1e300;                           // a run that would take more ends with a sentence that says why
  std::function<void(const std::string& words)> tell;  // a sentence, where the run will take long: what it spends its steps on
  // Samples that one step passes, two to four of them at once: their times, their number, and their coordinates, which the first so many
  // rows of 4 x size begin with (the others repeat the last). Empty, or false: they are taken one by one, with their rates.
  std::function<bool(System&, const double* times, int count, const MatX& states)> samples{};
  // Works that samples are handed are those along the solution also where the exponential method takes long steps (time/step_works.h).
  bool works = false;
};

// What is integrated: from the assembled start, or on from where an earlier call left the same system, to `to`.
struct RunSpan {
  std::vector<double> times;  // s, ascending, within: where it is sampled
  double from = 0.0, to = 0.0;
  bool goes_on = false;  // from `state`, as the call before left it, with the phases of friction and stops as they are
  VecX state;            // afterwards that at `to`
};
// A whole run of a scene.
inline RunSpan whole_run(const SimulationSettings& settings, std::vector<double> times) {
  return {std::move(times), 0.0, settings.duration, false, {}};
}

// Integrates a system over a span; calls sample at each of its times, in order: that looks at the loops itself (require_sample_closed, in
// time/sample_state.h), which are looked at here at the end of steps that pass no sample. Where it fails, `indefinite` is the scene's
// body whose kinetic energy was found not to be positive, if one was. Throws SimulationError with time and cause where the integration
// cannot go on, and where it would take more than watch.most_steps steps: as soon as that is certain.
SolverStatistics integrate(System& system, Method method, RunSpan& span, const RunWatch& watch,
                           const std::function<void(System&, double, const VecX&)>& sample, int& indefinite);

}  // namespace flexframe::sim
