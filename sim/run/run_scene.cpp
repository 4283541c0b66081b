#include "sim/run/run_scene.h"

#include "sim/results/recorder.h"
#include "sim/run/complete_inertia.h"
#include "sim/run/effect_report.h"
#include "sim/run/integrate_run.h"
#include "sim/run/left_out.h"
#include "sim/run/model_check.h"
#include "sim/start/make_system.h"
#include "sim/start/statics.h"

#include <algorithm>
#include <optional>

namespace flexframe::sim {
namespace {

// Enough samples to see the largest difference of two histories; a full set costs as much as a loose run.
constexpr int estimate_samples = 400;

// A scene with effects that a run turned out to need.
struct Called {
  Scene scene;
  Notes notes;
  double asked = unasked_accuracy;
  bool more = false;
};

// Effects that the program leaves out are judged in every run, those that the scene leaves out where errors are estimated.
bool judges_effects(const Scene& scene, const SimulateOptions& options) {
  if (!options.check_effects || scene.outputs.empty()) return false;
  return options.estimate_error || std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& b) {
    const auto* beam = std::get_if<BeamDef>(&b.kind);
    return beam && beam->effects.automatic;
  });
}

// A second, looser run: the error of time, what is of second order and left out, and what the models cannot show. True if the latter were measured.
bool estimate(const Scene& scene, const SimulateOptions& options, const System& system, const std::vector<LinearLimit>& limits, bool models, Results& results) {
  const std::vector<EffectState> effects = effect_states(scene, system.model);
  SimulateOptions loose = options;
  loose.tolerance = std::min(10.0 * system.tolerance, 0.1);
  loose.progress = {};
  loose.samples = estimate_samples;
  const Histories reference = to_histories(results);
  const VecX ranges = output_ranges(reference);
  const Histories base = simulate_histories(scene, loose);
  const Difference difference = compare_histories(base, reference, ranges);
  if (difference.column >= 0) {
    results.statistics.error_estimate = error_of_difference * difference.largest;
    results.statistics.error_column = reference.columns[static_cast<size_t>(difference.column)];
  }
  if (!options.check_effects) return false;
  NeglectOptions check;
  check.tolerance = *loose.tolerance;
  check.floor = difference.largest;
  check.method = options.method;
  check.run = &reference;
  check.run_tolerance = system.tolerance;
  check.run_error = std::max(0.0, results.statistics.error_estimate);
  if (models) {
    // Also where no output moves: another model's may.
    check_models(scene, effects, limits, base, {unasked_accuracy, model_check_budget(results.statistics.cpu_seconds), check}, results.statistics);
  }
  if (difference.column >= 0) {
    check.budget = std::max(check_price * results.statistics.cpu_seconds, least_check);
    report_neglected(scene, effects, base, check, unasked_accuracy, results.statistics);
  }
  return models;
}

// into: how far the bodies were bent, unchecked; null: it is checked here. called: what beams with automatic effects turn out to need; then nothing more is done
// with the run.
Results simulate_once(const Scene& scene, const SimulateOptions& options, std::vector<LinearLimit>* into, Called* called, int& indefinite) {
  System system = make_system(scene);
  if (options.tolerance) system.tolerance = *options.tolerance;
  const Method method = options.method.value_or(scene.simulation.method);
  const std::vector<double> times = sample_times(scene.simulation);

  Recorder recorder(system, times);
  std::optional<LeftOut> left_out;
  if (!into && judges_effects(scene, options)) left_out.emplace(system, system.model.effects);
  std::vector<size_t> looks;
  if (left_out && !left_out->empty()) looks = left_out->looks(system, times);
  size_t sample = 0, next = 0;
  SolverStatistics statistics = integrate(
      system, method, times, options.progress,
      [&](System& s, double t, const VecX& y) {
        recorder.record(s, t, y);
        if (next < looks.size() && looks[next] == sample++) left_out->look(s, t, y), ++next;
      },
      indefinite);
  statistics.notes = system.notes;

  Results results = recorder.finish(system);
  results.statistics = statistics;
  std::vector<LeftOutWorth> found;
  if (left_out) found = left_out->worth(results, wants_statics(scene));
  if (called && call_for(found, called->asked, called->scene, called->notes)) {
    called->more = true;
    return results;
  }
  report_left_out(scene, found, unasked_accuracy, results.statistics);
  const std::vector<LinearLimit> limits = linear_limits(scene, system.model, results);
  bool measured = false;
  if (options.estimate_error && !results.outputs.empty()) measured = estimate(scene, options, system, limits, !into, results);
  if (into) {
    *into = limits;
  } else if (!measured) {
    warn_of_linear_limits(scene, limits, unasked_accuracy, results.statistics.notes);
  }
  return results;
}

// Each time at least one effect of a beam is added; three times are more than any scene has needed.
constexpr int most_calls = 3;

// The run, made again with what its beams with automatic effects turn out to need. `called` is the scene as it was simulated.
Results simulate_as_called(const SimulateOptions& options, Called& called) {
  for (int round = 0;; ++round) {
    called.more = false;
    const Scene now = called.scene;
    Results results = with_complete_inertia(now, [&](const Scene& s, int& indefinite) { return simulate_once(s, options, nullptr, round < most_calls ? &called : nullptr, indefinite); });
    if (called.more) continue;
    results.statistics.notes.prepend(called.notes);
    return results;
  }
}

}  // namespace

Results run_scene(const Scene& scene, const SimulateOptions& options) {
  Called called{scene, {}, unasked_accuracy, false};
  return simulate_as_called(options, called);
}

Scene with_called_effects(const Scene& scene, const SimulateOptions& options, double asked) {
  SimulateOptions plain = options;
  plain.estimate_error = false;
  plain.check_effects = true;
  Called called{scene, {}, asked, false};
  try {
    if (judges_effects(scene, plain)) simulate_as_called(plain, called);
  } catch (const SimulationError&) {
    // What cannot be simulated as it stands shows nothing.
  }
  return called.scene;
}

Results run_for_check(const Scene& scene, const SimulateOptions& options, std::vector<LinearLimit>& limits) {
  return with_complete_inertia(scene, [&](const Scene& s, int& indefinite) { return simulate_once(s, options, &limits, nullptr, indefinite); });
}

}  // namespace flexframe::sim
