#include "sim/run/missing_works.h"

#include "sim/run/effect_report.h"
#include "sim/run/integrate_run.h"
#include "sim/run/method_choice.h"
#include "sim/run/passes.h"
#include "sim/run/time_error.h"
#include "sim/start/make_system.h"

#include <optional>

namespace flexframe::sim {
namespace {

struct Works {
  VecX supplied, dissipated;
  SolverStatistics statistics;
};

Works works_of(const Scene& scene, const Results& run, const SimulateOptions& options, const std::vector<double>& known) {
  return with_narrowed_weights(known, [&](const std::vector<double>& shares, std::vector<double>& wanted) {
    System system = make_system(scene);
    system.tolerance = run.statistics.tolerance;
    system.weights.shares = shares;
    RunSpan span = whole_run(scene.simulation, std::vector<double>(run.times.begin(), run.times.end()));
    Works out{VecX::Zero(run.times.size()), VecX::Zero(run.times.size()), {}};
    RunWatch watch{options.progress, steps_allowed(scene, options), {}};
    watch.works = true;
    Eigen::Index row = 0;
    int indefinite = -1;
    const auto sample = [&](System&, double, const VecX& y) {
      out.supplied[row] = y[y.size() - 2];
      out.dissipated[row++] = y[y.size() - 1];
    };
    out.statistics = integrate(system, Method::exponential, span, watch, sample, indefinite);
    wanted = system.weights.narrowed(system);
    return out;
  });
}

}  // namespace

void add_missing_works(const Scene& scene, const SimulateOptions& options, const std::vector<double>& shares, Results& results) {
  const SolverStatistics& run = results.statistics;
  if (run.method != method_name(Method::exponential) || run.work > least_check) return;
  const EnergyGap before = missing_energy(results);
  if (!before.counts) return;
  try {
    const Works works = works_of(scene, results, options, shares);
    Results with = results;
    with.supplied = works.supplied;
    with.dissipated = works.dissipated;
    if (missing_energy(with).share < before.share) results.supplied = works.supplied, results.dissipated = works.dissipated;
  } catch (const SimulationError&) {
    // The warning of the gap stays.
  }
}

}  // namespace flexframe::sim
