#include "sim/run/run_scene.h"

#include "sim/results/recorder.h"
#include "sim/run/complete_inertia.h"
#include "sim/run/effect_report.h"
#include "sim/run/integrate_run.h"
#include "sim/run/model_check.h"
#include "sim/start/make_system.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Enough samples to see the largest difference of two histories; a full set costs as much as a loose run.
constexpr int estimate_samples = 400;

// What counts as an error where the scene asks for no accuracy.
constexpr double unasked_accuracy = 1e-2;

// into: how far the bodies were bent, unchecked; null: it is checked here.
Results simulate_once(const Scene& scene, const SimulateOptions& options, std::vector<LinearLimit>* into, int& indefinite) {
  System system = make_system(scene);
  const std::vector<EffectState> effects = effect_states(scene, system.model);
  if (options.tolerance) system.tolerance = *options.tolerance;
  const Method method = options.method.value_or(scene.simulation.method);
  const std::vector<double> times = sample_times(scene.simulation);

  Recorder recorder(system, times);
  SolverStatistics statistics = integrate(system, method, times, options.progress,
                                          [&](System& s, double t, const VecX& y) { recorder.record(s, t, y); }, indefinite);
  statistics.notes = system.notes;

  Results results = recorder.finish(system);
  results.statistics = statistics;
  const std::vector<LinearLimit> limits = linear_limits(scene, system.model, results);
  bool measured = false;

  if (options.estimate_error && !results.outputs.empty()) {
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
    if (options.check_effects && difference.column >= 0) {
      NeglectOptions check;
      check.tolerance = *loose.tolerance;
      check.floor = difference.largest;
      check.budget = std::max(check_price * statistics.cpu_seconds, least_check);
      check.method = options.method;
      check.run = &reference;
      check.run_tolerance = system.tolerance;
      check.run_error = results.statistics.error_estimate;
      report_neglected(scene, effects, base, check, unasked_accuracy, results.statistics);
    }
    if (options.check_effects && !into) {
      // Also where no output moves: another model's may.
      NeglectOptions beside;
      beside.tolerance = *loose.tolerance;
      beside.floor = difference.largest;
      beside.method = options.method;
      beside.run = &reference;
      beside.run_tolerance = system.tolerance;
      beside.run_error = std::max(0.0, results.statistics.error_estimate);
      check_models(scene, effects, limits, base, {unasked_accuracy, model_check_budget(statistics.cpu_seconds), beside}, results.statistics);
      measured = true;
    }
  }
  if (into) {
    *into = limits;
  } else if (!measured) {
    warn_of_linear_limits(scene, limits, unasked_accuracy, results.statistics.notes);
  }
  return results;
}

}  // namespace

Results run_scene(const Scene& scene, const SimulateOptions& options) {
  return with_complete_inertia(scene, [&](const Scene& s, int& indefinite) { return simulate_once(s, options, nullptr, indefinite); });
}

Results run_for_check(const Scene& scene, const SimulateOptions& options, std::vector<LinearLimit>& limits) {
  return with_complete_inertia(scene, [&](const Scene& s, int& indefinite) { return simulate_once(s, options, &limits, indefinite); });
}

}  // namespace flexframe::sim
