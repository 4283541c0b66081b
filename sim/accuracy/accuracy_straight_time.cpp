#include "sim/accuracy/accuracy_straight.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace flexframe::sim {
namespace {

// Vibrations that lost so much, of the range of an output, come back only at tolerances that cost more than following them does.
constexpr double mostly_lost = 0.2;

// What is likely of the difference to a run ten times looser; falls: the difference of the two runs before over this one, 0: not known.
// What a run is accepted by is larger. Why: 139 scenes of trust/run_trust at 1e-3 to 1e-6 beside runs at 1e-10; of Adams' methods a median
// of 0.15 is true, 0.02 to 0.05 in the lowest and 0.7 to 1.3 in the highest of twenty, however many steps more the tighter run takes; of
// bdf 0.25, of implicit steps over vibrations nearly all.
double likely_share(const std::string& method, double falls) {
  const double known = method == "adams" ? 0.2 : method == "bdf" ? error_of_difference : 1.0;
  if (falls <= 0.0) return known;
  return falls < 4.0 / 3.0 ? 3.0 : std::max(std::min(known, error_of_difference), 1.0 / (falls - 1.0));
}

}  // namespace

// What vibrations that the method damped instead of following them would move the outputs by, relative to their ranges. Two runs that step
// over them look alike, but the energy is missing: in a vibration that holds all of it the speed is sqrt(gap / kinetic energy) of the run's
// (times 3: a tenth of the mass vibrates), and the displacement sqrt(gap / strain energy) of the deflection. Measured: pendulum let go,
// 1e-4 to 1e-7: 0.78, 0.27, 0.09, 0.036 of its deflection; by a looser run it is off by 0.14, 0.14, 0.03 at 1e-4 to 1e-6.
double Straight::energy_share() const {
  const Results& r = run_.results;
  if (r.strain.size() == 0 || r.strain.maxCoeff() <= 0.0) return 0.0;
  const VecX balance = r.kinetic + r.strain + r.potential - r.supplied + r.dissipated;
  const double gap = (balance.array() - balance[0]).abs().maxCoeff();
  const double amplitude = std::min(1.0, std::sqrt(gap / r.strain.maxCoeff()));
  double deflection = 0.0;
  for (const ResultBody& body : r.bodies)
    if (body.displacement.size() > 0) deflection = std::max(deflection, body.displacement.cwiseAbs().maxCoeff());
  const VecX ranges = output_ranges(fine_, looser_);
  double out = 0.0;
  for (Eigen::Index c = 0; c < ranges.size(); ++c) {
    if (ranges[c] <= 0.0) continue;
    const std::string& unit = fine_.units[c];
    double share = amplitude;
    if (unit == "m/s" || unit == "rad/s") share = std::min(amplitude, 3.0 * std::sqrt(gap / r.kinetic.maxCoeff()));
    if (unit == "m") share = std::min(amplitude, amplitude * deflection / ranges[c]);
    if (unit == "rad" && fine_.scales.length > 0.0)
      share = std::min(amplitude, amplitude * deflection / (0.1 * fine_.scales.length * ranges[c]));
    if (unit == "J") share = gap / ranges[c];
    out = std::max(out, share);
  }
  return out;
}

// What of it counts where a decade brought most of the energy back: what came back moved the outputs by `change`, and what is still missing
// moves them in proportion, within elastic_margin. The bound above holds where one vibration has all of it;
// most of what is missing after a blow is the blow's own error (flap on a stop at 1e-7: 1e-2 by its energy where 6e-5 is true; it was run
// down to 1e-10). Vibrations that both runs step over miss the same energy in both.
double Straight::as_seen(double missing, double change) const {
  constexpr double mostly_back = 2.0;
  if (missed_ < mostly_back * missing) return missing;
  const double back = std::sqrt(missed_ * missed_ - missing * missing);
  return missing * std::min(1.0, elastic_margin * change / back);
}

// What the next run may take: of elements of which a few modes would do, where events shift with tighter steps, no more than what would
// have kept it from being made; a method that has to follow all that they vibrate takes a multiple of what the last decade tells.
double Straight::next_allowed() const {
  const double run = run_.results.statistics.work;
  if (t_.search.touches && t_.search.elastic && t_.search.has_levels() && few_ == 0) return std::max(dear_step, dearer_step * run);
  return 0.5 + 20.0 * run;
}

// Work of the run whose tolerance has fallen by step_, by what the last decade has cost more.
double Straight::next_work() const {
  const auto here = static_cast<double>(run_.results.statistics.evaluations), before = static_cast<double>(looser_.statistics.evaluations);
  return run_.results.statistics.work * std::pow(before > 0.0 ? std::max(1.0, here / before) : 1.0, -std::log10(step_));
}

// Where a tighter run costs next to nothing, it tells what this one is off by, and the looser one how far that is from the truth; false
// where none is made. Why: of two runs that are both loose the difference was a hundredth to twice of what is true (crank and rocker at
// 1e-2 and 1e-3: 1.1e-3 and 1.9e-3 off, 8e-4 apart).
bool Straight::look_tighter(const Scene& scene, const Histories& thinned, double change) {
  constexpr double cheap = 0.01, tightest = 1e-12, most = 2.0;  // CPU s; tolerance; of the difference
  if (run_.results.statistics.work > cheap || 0.1 * tolerance_ < tightest) return false;
  const std::optional<Histories> tight = loose_run(scene, 0.1 * tolerance_, run_.start ? &*run_.start : nullptr);
  if (!tight || tight->columns != thinned.columns) return false;
  const Histories there = at_times(*tight, thinned.times);
  if (there.times.size() != thinned.times.size()) return false;
  told_ = relative(thinned, there);
  const double falls = change / std::max(largest(told_), 1e-300);
  told_ *= falls > most / (most - 1.0) ? falls / (falls - 1.0) : most;
  return true;
}

// A run ten times looser tells the error: a third of the difference (error_of_difference), more where three of them show that it falls
// slowly, all of it where there are only two.
Straight::Verdict Straight::judge_time(const Scene& scene) {
  if (!has_looser_) {
    std::optional<Histories> loose = loose_run(scene, 10.0 * tolerance_, run_.start ? &*run_.start : nullptr);
    step_ = 0.1;
    // Few modes do in the time of one such run what it takes several of them to find.
    if (!loose && run_.results.statistics.work > dear_run && t_.search.has_levels()) return Verdict::lost;
    if (!loose || loose->columns != fine_.columns) return Verdict::tighter;
    looser_ = std::move(*loose);
    has_looser_ = true;
  }
  const Histories thinned = at_times(fine_, looser_.times);
  time_ = relative(looser_, thinned);
  // Motions of picometres that the two runs do not agree on.
  step_ = 0.1;
  if (!run_.scene.simulation.static_start && nothing_counts(fine_, looser_)) return Verdict::tighter;
  const double change = largest(time_), decades = before_ > 0.0 ? std::max(1.0, std::log10(before_at_ / tolerance_)) : 1.0;
  // This looser run is the one before, or looser.
  const bool decade = before_ > 0.0 && before_at_ < 1.01 * 10.0 * tolerance_;
  const double falls = before_ > 0.0 ? std::pow(before_ / std::max(change, 1e-300), 1.0 / decades) : 0.0;
  const double factor = before_ <= 0.0 ? 1.0 : falls < 4.0 / 3.0 ? 3.0 : std::max(error_of_difference, 1.0 / (falls - 1.0));
  time_ *= factor;
  told_ = std::min(1.0, likely_share(run_.results.statistics.method, falls) / factor) * time_;
  // Two loose runs of as many steps may be as far off, and alike in that (a Cardan joint: 98 steps at 1e-3 and 90 at 1e-4, 1.2e-3
  // and 1.1e-3 off, 1.9e-4 apart).
  constexpr double alike = 10.0;
  const bool as_many = before_ <= 0.0 && run_.results.statistics.steps <= looser_.statistics.steps && alike * change > t_.accuracy;
  before_ = change, before_at_ = tolerance_;
  const double missing = energy_share(), lost = decade ? as_seen(missing, change) : missing;
  missed_ = missing, judged_at_ = tolerance_;
  timed_ = true, lost_ = lost;
  if (t_.search.pictures) judge_ = looser_;
  const double in_time = largest(time_) / (share_of_time * t_.accuracy), needed = needed_ = std::max(in_time, lost / t_.accuracy);
  // Pictures of what has nothing else to judge: where the next run takes seconds a share that leaves a little to the rest will do.
  const bool enough = t_.search.pictures && !t_.search.has_levels() && next_work() > dear_if_exaggerated && lost <= t_.accuracy &&
                      largest(time_) <= most_of_time * t_.accuracy;
  if (needed <= 1.0 || enough) {
    const bool looked = look_tighter(scene, thinned, change);
    return (looked ? largest(told_) > share_of_time * t_.accuracy : as_many) ? Verdict::tighter : Verdict::kept;
  }
  // Where vibrations cannot be followed the next decade, of which this is the looser run, tells how much of the energy's word counts.
  step_ = std::clamp(std::pow(t_.search.smooth && t_.search.rings ? needed : in_time, -1.0 / cautious_order), 1e-2, 0.1);
  if (needed < nearly && next_work() > dear_decade * run_.results.statistics.work) step_ = half_a_decade;
  const bool vibrates = t_.search.smooth && t_.search.elastic && !follows_vibrations(t_.options->method);
  if (vibrates && t_.search.rings && needed > 30.0) return Verdict::follow;
  // With few modes that costs less than one more decade; where much lacks, less than the decades that it takes, damped or not.
  constexpr double far = 5.0;
  const bool dear = next_work() > std::max(exaggerated() ? dear_if_exaggerated : dear_step, dearer_step * run_.results.statistics.work);
  const bool short_steps = few_ > 0 ? t_.search.rings : lost > mostly_lost || needed > far || (dear && exaggerated() && !tried_);
  if (vibrates && short_steps) return Verdict::rather_follow;
  // With few modes a search finds as much for less.
  if (few_ == 0 && t_.search.elastic && t_.search.has_levels() && dear) return Verdict::lost;
  // So far off a run tells nothing but that: cheap ones go on as long as they come nearer.
  constexpr double lost_from = 1000.0, nearer = 0.3;
  const bool goes_on = next_work() <= dear_step && (lost_before_ <= 0.0 || needed <= nearer * lost_before_);
  if (needed > lost_from && !goes_on) return Verdict::lost;
  lost_before_ = needed > lost_from ? needed : 0.0;
  return Verdict::tighter;
}

}  // namespace flexframe::sim
