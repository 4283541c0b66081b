#include "sim/run/time_error.h"

#include "sim/run/histories_run.h"
#include "sim/run/run_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
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

}  // namespace

double advised_tolerance(double tolerance, double error) {
  // Errors fall with the 0.6th power of the tolerance (error_of_difference).
  const double decades = std::clamp(std::ceil(std::log10(error / unasked_accuracy) / 0.6), 1.0, 4.0);
  return std::max(1e-12, tolerance * std::pow(10.0, -decades));
}

Difference estimate_time_error(const Histories& looser, const Histories& run, SolverStatistics& out) {
  const VecX ranges = output_ranges(run);
  Difference difference = compare_histories(looser, run, ranges);
  if (difference.column < 0) return difference;
  std::set<std::string> named;
  std::vector<std::string> large;
  double worst = -1.0;
  for (Eigen::Index k = 0; k < ranges.size(); ++k) {
    if (ranges[k] <= 0.0) continue;
    const size_t at = k;
    double error = share_of_difference(run.units[at], out.method) * difference.columns[k];
    // What an event's place is wrong by two runs may share: a run with events is not told to be better than its tolerance.
    if (out.events > 0 && error > 0.0) error = std::max(error, 0.8 * out.tolerance);
    if (error > worst) {
      worst = out.error_estimate = error;
      out.error_column = run.columns[at];
    }
    const std::string& column = run.columns[at];
    if (error > unasked_accuracy && named.insert(column.substr(0, column.rfind('.')) + run.units[at]).second)
      large.push_back(fmt::format("{:.2g} of the range of {}", error, column));
  }
  if (large.empty()) return difference;
  const size_t shown = std::min<size_t>(large.size(), 3);
  const std::string more = large.size() > shown ? fmt::format(" and {} more outputs", large.size() - shown) : "";
  out.notes.warn("", fmt::format("the estimated error of the time integration is {}{}: take tolerance = {:.0e}",
                                 fmt::join(large.begin(), large.begin() + static_cast<long>(shown), ", "), more,
                                 advised_tolerance(out.tolerance, worst)));
  return difference;
}

}  // namespace flexframe::sim
