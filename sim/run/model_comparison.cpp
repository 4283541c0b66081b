#include "sim/run/model_comparison.h"

#include "sim/run/second_run.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

struct Exceeded {};

// The same outputs of both, by their names.
Histories only(const Histories& h, const std::vector<std::string>& columns) {
  Histories out = h;
  out.columns = columns;
  out.units.clear();
  out.values.resize(static_cast<Eigen::Index>(columns.size()), h.values.cols());
  if (h.sizes.size() > 0) out.sizes.resize(static_cast<Eigen::Index>(columns.size()));
  for (size_t k = 0; k < columns.size(); ++k) {
    const auto at = std::find(h.columns.begin(), h.columns.end(), columns[k]) - h.columns.begin();
    out.units.push_back(h.units[at]);
    out.values.row(static_cast<Eigen::Index>(k)) = h.values.row(at);
    if (h.sizes.size() > 0) out.sizes[static_cast<Eigen::Index>(k)] = h.sizes[at];
  }
  return out;
}

std::optional<OutputChange> between(const Histories& richer_run, const Histories& run, double deflection) {
  std::vector<std::string> common;
  for (const std::string& c : richer_run.columns)
    if (std::find(run.columns.begin(), run.columns.end(), c) != run.columns.end()) common.push_back(c);
  const Histories a = only(richer_run, common), b = only(run, common);
  const Difference d = compare_histories(a, b, common_ranges(a, b, deflection));
  if (d.column < 0) return std::nullopt;
  return OutputChange{d.largest, common[d.column]};
}

}  // namespace

Comparison::Comparison(Scene scene, Scene rich, std::optional<Scene> plain, double budget, const NeglectOptions& run, double asked)
    : scene_(std::move(scene)),
      rich_(std::move(rich)),
      plain_(std::move(plain)),
      budget_(budget),
      asked_(asked),
      run_(run),
      method_(run.method) {}

std::optional<OutputChange> Comparison::measure(const Histories& base) {
  try {
    try {
      return by_steps(base);
    } catch (const Exceeded&) {
      // Vibrations that the run's steps follow may be few, the richer model's many.
      if (follows() || followed_ || spent_ >= budget_) throw;
      if (std::optional<OutputChange> found = followed_by_both()) return found;
      throw;
    }
  } catch (const Exceeded&) {
    too_long_ = true;
  } catch (const std::runtime_error&) {}
  return std::nullopt;
}

// The run by its own method, step by step tighter.
std::optional<OutputChange> Comparison::by_steps(const Histories& base) {
  std::optional<OutputChange> found = at(run_.tolerance, base);
  if (!found || found->share <= asked_) return found;
  // Where vibrations are followed, what a looser run is off by tells what this one is.
  if (follows() && run_.floor > 0.0 && found->share > 4.0 * run_.floor) return found;
  if (found->share > run_.floor) unconfirmed_ = found;
  // Loose runs step over vibrations in different ways: the same at the run's tolerance, where a run ten times looser is at hand of both.
  const Histories loose = rich_run_;
  if (spent_ * growth_to(run_.run_tolerance) > budget_ - spent_) throw Exceeded{};
  found = at(run_.run_tolerance, *run_.run);
  if (!found || found->share <= asked_ || is_resolved(*found, loose)) return found;
  if (steps_over_vibrations())
    if (const std::optional<OutputChange> followed = followed_by_both()) return followed;
  // Steps over vibrations err by the root of the tolerance: two decades more tell what one does not.
  double tolerance = run_.run_tolerance;
  for (int decade = 0; decade < 3; ++decade) {
    const Histories looser = rich_run_;
    tolerance *= 0.1;
    found = between(simulate_rich(tolerance), simulated(plain_ ? *plain_ : scene_, tolerance), run_.deflection);
    if (!found || found->share <= asked_ || is_resolved(*found, looser)) return found;
  }
  return std::nullopt;
}

bool Comparison::follows() const { return run_.method == Method::exponential || run_.method == Method::erk; }

bool Comparison::steps_over_vibrations() const {
  const std::string& method = rich_run_.statistics.method;
  return method == method_name(Method::dirk) || method == method_name(Method::bdf);
}

// Of runs that follow vibrations, where the method has them and their own errors of time do not hide what they tell.
std::optional<OutputChange> Comparison::followed_by_both() {
  method_ = Method::exponential, followed_ = true;
  std::optional<OutputChange> found;
  try {
    const Histories loose = simulate_rich(10.0 * run_.run_tolerance);
    found = between(simulate_rich(run_.run_tolerance), simulated(plain_ ? *plain_ : scene_, run_.run_tolerance), run_.deflection);
    if (found && found->share > asked_ && !is_resolved(*found, loose)) found.reset();
  } catch (const std::runtime_error&) {}
  method_ = run_.method;
  return found;
}

// How many times what it took so far the same takes at another tolerance, at least: with implicit methods steps grow by some 2.5 a
// decade.
double Comparison::growth_to(double tolerance) const {
  const std::string& method = rich_run_.statistics.method;
  const bool implicit = method == method_name(Method::dirk) || method == method_name(Method::bdf);
  return std::pow(implicit ? 2.0 : 1.2, std::log10(rich_run_.statistics.tolerance / tolerance));
}

Histories Comparison::simulated(const Scene& scene, double tolerance) {
  SimulateOptions o;
  o.tolerance = tolerance;
  o.method = method_;
  o.samples = samples_;
  double spent = 0.0;
  std::optional<Histories> h = simulated_within(scene, o, budget_ - spent_, spent);
  spent_ += spent;
  if (!h) throw Exceeded{};
  return std::move(*h);
}

const Histories& Comparison::simulate_rich(double tolerance) { return rich_run_ = simulated(rich_, tolerance); }

std::optional<OutputChange> Comparison::at(double tolerance, const Histories& run) {
  samples_ = static_cast<int>(run.times.size());
  simulate_rich(tolerance);
  return plain_ ? between(rich_run_, simulated(*plain_, tolerance), run_.deflection) : between(rich_run_, run, run_.deflection);
}

// Whether a share is larger than the errors of time: of the run, and of the richer one as its looser run tells it.
bool Comparison::is_resolved(const OutputChange& found, const Histories& looser) const {
  const std::optional<OutputChange> drift = between(looser, rich_run_, run_.deflection);
  return found.share > 3.0 * run_.run_error && (!drift || found.share > 2.0 * drift->share);
}

}  // namespace flexframe::sim
