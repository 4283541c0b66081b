#include "sim/run/second_run.h"

#include "sim/base/cpu_clock.h"

namespace flexframe::sim {
namespace {

struct BudgetSpent {};

// After a quarter of its budget a run that would take half as much again as it may is given up: steps are not as long everywhere.
bool takes_too_long(double taken, double done, double budget) {
  return taken > budget || (taken > 0.25 * budget && taken > 1.5 * budget * done);
}

}  // namespace

std::optional<Histories> simulated_within(const Scene& scene, SimulateOptions options, double budget, double& spent) {
  const double start = cpu_seconds();
  options.progress = [&, start](double time) {
    if (takes_too_long(cpu_seconds() - start, time / scene.simulation.duration, budget)) throw BudgetSpent{};
  };
  std::optional<Histories> out;
  try {
    out = simulate_histories(scene, options);
  } catch (const BudgetSpent&) {
    // None.
  } catch (...) {
    spent += cpu_seconds() - start;
    throw;
  }
  spent += cpu_seconds() - start;
  return out;
}

}  // namespace flexframe::sim
