#include "sim/run/time_error.h"

#include "sim/run/run_scene.h"
#include "sim/run/second_run.h"
#include "sim/run/work_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace flexframe::sim {
namespace {

bool of_forces(const std::string& unit) { return unit == "N" || unit == "N m" || unit == "m/s^2"; }

// The share of the difference that counts as the run's error.
double share_of_difference(const std::string& unit, const std::string& method) {
  // Adams' methods step over nothing, and their errors fall faster: median of true errors over differences 0.15, also of forces.
  if (method == "adams") return 0.2;
  return of_forces(unit) ? 0.5 : error_of_difference;
}

// With the tolerance.
bool order_rises(const std::string& method) { return method == method_name(Method::bdf) || method == method_name(Method::adams); }

// The largest of what an output of places, angles, their rates or energies is made of: columns of its unit, the mechanism and its speed.
// 0: of others.
double made_of(const std::string& unit, const Histories& run) {
  const double length = run.scales.length > 0.0 ? run.scales.length : 1.0;
  const std::map<std::string, double> scales = {
      {"m", run.scales.length}, {"rad", 1.0}, {"m/s", run.scales.speed}, {"rad/s", run.scales.speed / length}, {"J", 0.0}};
  const auto scale = scales.find(unit);
  if (scale == scales.end()) return 0.0;
  double out = scale->second;
  for (Eigen::Index k = 0; k < run.values.rows(); ++k)
    if (run.units[static_cast<size_t>(k)] == unit) out = std::max(out, run.values.row(k).cwiseAbs().maxCoeff());
  return out;
}

// Outputs that stand still: they move by no more than the errors of all steps add up to (each is the tolerance, of what they are made of),
// and otherwise in the other run. Their own range is error then, and no measure. 1e-8 at most: a small motion that a tolerance is too loose
// for is to be warned of.
void tell_still(const Difference& difference, const VecX& ranges, const Histories& run, SolverStatistics& out, VecX& errors) {
  constexpr double alike = 0.3, most = 1e-8;
  const double added_up = std::min(static_cast<double>(out.steps) * out.tolerance, most);
  std::vector<std::string> still;
  for (Eigen::Index k = 0; k < errors.size(); ++k) {
    if (errors[k] < 0.0 || difference.columns[k] <= alike) continue;
    const std::string &column = run.columns[static_cast<size_t>(k)], &unit = run.units[static_cast<size_t>(k)];
    if (ranges[k] > added_up * made_of(unit, run) || (run.sizes.size() > 0 && run.sizes[k] > 0.0)) continue;
    errors[k] = -1.0;
    still.push_back(fmt::format("{} (to {:.1g} {})", column, ranges[k], unit));
  }
  if (still.empty()) return;
  const size_t shown = std::min<size_t>(still.size(), 3);
  const std::string more = still.size() > shown ? fmt::format(" and {} more outputs", still.size() - shown) : "";
  out.notes.tell("", fmt::format("{}{} stand still: what moves in them is error of the time integration",
                                 fmt::join(still.begin(), still.begin() + static_cast<long>(shown), ", "), more));
}

// What the outputs' errors are: the largest into `out`, warned of where it is above unasked_accuracy.
void tell_errors(const VecX& errors, const Histories& run, SolverStatistics& out) {
  struct Large {
    double error;
    std::string column;
  };
  std::map<std::string, Large> vectors;  // of each its component that is furthest off
  double worst = -1.0;
  for (Eigen::Index k = 0; k < errors.size(); ++k) {
    if (errors[k] < 0.0) continue;
    const std::string& column = run.columns[static_cast<size_t>(k)];
    if (errors[k] > worst) worst = out.error_estimate = errors[k], out.error_column = column;
    if (errors[k] <= unasked_accuracy) continue;
    Large& most = vectors.insert({column.substr(0, column.rfind('.')) + run.units[static_cast<size_t>(k)], {-1.0, ""}}).first->second;
    if (errors[k] > most.error) most = {errors[k], column};
  }
  if (vectors.empty()) return;
  std::vector<Large> all;
  for (const auto& [vector, most] : vectors) all.push_back(most);
  std::stable_sort(all.begin(), all.end(), [](const Large& a, const Large& b) { return a.error > b.error; });
  std::vector<std::string> large;
  for (const Large& one : all) large.push_back(fmt::format("{:.2g} of the range of {}", one.error, one.column));
  const size_t shown = std::min<size_t>(large.size(), 3);
  const std::string more = large.size() > shown ? fmt::format(" and {} more outputs", large.size() - shown) : "";
  out.notes.warn("", fmt::format("the estimated error of the time integration is {}{}: take tolerance = {:.0e}",
                                 fmt::join(large.begin(), large.begin() + static_cast<long>(shown), ", "), more,
                                 advised_tolerance(out.tolerance, worst)));
}

// A tighter run is made where it is known to take less than about so many microseconds. Of methods whose order rises with the tolerance it
// costs little more than a looser one, and tells far more, so that it may take longer, by the run's own work. Adams' at a tight tolerance
// follows vibrations at the edge of stability, where its errors are 1e-2 at one tolerance and 1e-7 at the next, and "auto" steps over them
// ten times looser (a rod on a hinge, let go: 6.5e-3 off at 1e-7, 3e-7 at 1e-8).
constexpr double cheap_look = 1e6, of_high_order = 3e6;
// What is tighter still is rounding.
constexpr double tightest = 1e-12;

}  // namespace

double growth_of_steps(const std::string& method, double from, double to) {
  const double of_a_decade = order_rises(method) ? 1.5 : 2.5;
  return std::pow(of_a_decade, std::log10(from / to));
}

double price_at(const Results& run, double tolerance) {
  double evaluation = 3.0;
  for (const ResultBody& body : run.bodies) evaluation += 1.0 + static_cast<double>(body.q.cols());
  return evaluation * static_cast<double>(run.statistics.evaluations) *
         growth_of_steps(run.statistics.method, run.statistics.tolerance, tolerance);
}

bool is_loose(const SolverStatistics& run) {
  constexpr double loose_tolerance = 1e-4;
  constexpr long few_steps = 1000;
  return run.tolerance >= loose_tolerance && run.steps <= few_steps;
}

bool is_looked_at_tighter(const Results& run) {
  const SolverStatistics& s = run.statistics;
  const double tolerance = 0.1 * s.tolerance;
  if (tolerance < tightest || std::find(method_words().begin(), method_words().end(), s.method) == method_words().end()) return false;
  if (price_at(run, tolerance) <= cheap_look) return true;
  return order_rises(s.method) && 1e6 * s.work * growth_of_steps(s.method, s.tolerance, tolerance) <= of_high_order;
}

std::optional<Histories> tighter_run(const System& start, const Scene& scene, const SimulateOptions& options, const Results& run) {
  if (!is_looked_at_tighter(run)) return {};
  const SolverStatistics& s = run.statistics;
  SimulateOptions tight = options;
  tight.tolerance = 0.1 * s.tolerance;
  tight.method = static_cast<Method>(std::find(method_words().begin(), method_words().end(), s.method) - method_words().begin());
  // What turns out to need many times the steps, or the work, is given up: a step that follows vibrations may take any number of
  // evaluations.
  tight.progress = give_up_after(std::max(2.0, 4.0 * growth_of_steps(s.method, s.tolerance, tight.tolerance.value()) * s.work));
  // Where "auto" came to Adams' method through long implicit steps, these say nothing of Adams' own, which take two evaluations.
  double steps = 6.0 * static_cast<double>(s.steps);
  if (s.method == method_name(Method::adams)) steps = std::max(steps, 3.0 * static_cast<double>(s.evaluations));
  tight.max_steps = std::min(steps + 1000.0, steps_allowed(scene, options));
  try {
    return simulate_histories_from(start, scene, tight);
  } catch (const SimulationError&) {
    return {};
  } catch (const BudgetSpent&) {
    return {};
  }
}

double advised_tolerance(double tolerance, double error) {
  // Errors fall with the 0.6th power of the tolerance (error_of_difference).
  const double decades = std::clamp(std::ceil(std::log10(error / unasked_accuracy) / 0.6), 1.0, 4.0);
  return std::max(1e-12, tolerance * std::pow(10.0, -decades));
}

namespace {

// Estimated errors of the columns from the difference to a looser run; -1: does not move. method: of the looser one, which "auto" may have
// made by another than the run.
VecX errors_by_looser(const Difference& difference, const VecX& ranges, const Histories& run, const std::string& method,
                      const SolverStatistics& s) {
  VecX errors = VecX::Constant(ranges.size(), -1.0);
  for (Eigen::Index k = 0; k < ranges.size(); ++k) {
    if (ranges[k] <= 0.0) continue;
    errors[k] = share_of_difference(run.units[static_cast<size_t>(k)], method.empty() ? s.method : method) * difference.columns[k];
    // What an event's place is wrong by two runs may share: a run with events is not told to be better than its tolerance.
    if (s.events > 0 && errors[k] > 0.0) errors[k] = std::max(errors[k], 0.8 * s.tolerance);
  }
  return errors;
}

}  // namespace

Difference estimate_time_error(const Histories& looser, const Histories& run, SolverStatistics& out) {
  const VecX ranges = output_ranges(run);
  Difference difference = compare_histories(looser, run, ranges);
  VecX errors = errors_by_looser(difference, ranges, run, looser.statistics.method, out);
  tell_still(difference, ranges, run, out, errors);
  tell_errors(errors, run, out);
  return difference;
}

Difference estimate_by_tighter(const Histories& tighter, const Histories* looser, const Histories& run, SolverStatistics& out) {
  const VecX ranges = output_ranges(run);
  const Difference to_tighter = compare_histories(tighter, run, ranges);
  VecX errors = (ranges.array() > 0.0).select(to_tighter.columns, -1.0);
  tell_still(to_tighter, ranges, run, out, errors);
  Difference difference;
  if (looser) {
    difference = compare_histories(*looser, run, ranges);
    const VecX by_looser = errors_by_looser(difference, ranges, run, looser->statistics.method, out);
    if (is_loose(out)) errors = (errors.array() < 0.0).select(errors, errors.cwiseMax(by_looser));
  }
  tell_errors(errors, run, out);
  return difference;
}

EnergyGap missing_energy(const Results& results) {
  if (results.kinetic.size() == 0) return {};
  const VecX sum = results.kinetic + results.strain + results.potential - results.supplied + results.dissipated;
  const double gap = (sum.array() - sum[0]).abs().maxCoeff();
  const auto largest = [](const VecX& e) { return e.cwiseAbs().maxCoeff(); };
  const double turned =
      std::max({largest(results.kinetic), largest(results.strain), results.potential.maxCoeff() - results.potential.minCoeff(),
                largest(results.supplied), largest(results.dissipated)});
  const double rounding = 1e-9 * largest(results.potential);
  const double allowed = unasked_accuracy + 5.0 * std::max(0.0, results.statistics.error_estimate);
  return {gap / turned, gap > allowed * turned + rounding};
}

void tell_of_energies(Results& results, bool asked) {
  SolverStatistics& run = results.statistics;
  const EnergyGap gap = missing_energy(results);
  if (!gap.counts) return;
  const std::string words = fmt::format(
      "the energies of the results do not balance: {:.2g} of the largest is missing in kinetic, strain and potential energy less work "
      "supplied plus dissipated; where they matter, take {}",
      gap.share, asked ? "them as outputs" : fmt::format("tolerance = {:.0e}", advised_tolerance(run.tolerance, gap.share)));
  if (asked) run.notes.tell("", words);
  else run.notes.warn("", words);
}

}  // namespace flexframe::sim
