#include "sim/run/second_run.h"

#include "sim/run/work_budget.h"

namespace flexframe::sim {
namespace {

// After a quarter of its budget a run that would take half as much again as it may is given up: steps are not as long everywhere.
bool takes_too_long(double taken, double done, double budget) {
  return taken > budget || (taken > 0.25 * budget && taken > 1.5 * budget * done);
}

}  // namespace

std::optional<Histories> simulated_within(const Scene& scene, SimulateOptions options, double budget, double& spent) {
  const double start = work_seconds();
  options.progress = [&, start](double time) {
    if (takes_too_long(work_seconds() - start, time / scene.simulation.duration, budget)) throw BudgetSpent{};
  };
  std::optional<Histories> out;
  try {
    out = simulate_histories(scene, options);
  } catch (const BudgetSpent&) {
    // None.
  } catch (...) {
    spent += work_seconds() - start;
    throw;
  }
  spent += work_seconds() - start;
  return out;
}

}  // namespace flexframe::sim
