#include "sim/run/second_run.h"

#include "sim/run/work_budget.h"

namespace flexframe::sim {

std::optional<Histories> simulated_within(const Scene& scene, SimulateOptions options, double budget, double& spent) {
  const double start = work_seconds();
  options.progress = [&, start](double time) {
    const double taken = work_seconds() - start, done = time / scene.simulation.duration;
    if (shows_too_long(taken, taken * (1.0 - done) / done, budget)) throw BudgetSpent{};
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
