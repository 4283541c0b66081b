#include "sim/accuracy/accuracy_task.h"
#include "sim/base/error.h"
#include "sim/base/work_clock.h"
#include "sim/run/coarse_beams.h"
#include "sim/run/few_modes.h"
#include "sim/run/judged_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace flexframe::sim {
namespace {

// Shares of the asked accuracy that time, space and what is left out may take each.
constexpr double share_of_time = 0.5, share_of_space = 0.5, share_of_effects = 0.5;
// Estimates of elastic scenes as written were up to 3.4 times too low (pendulums and released beams of tests/trust/kinds_asked.py).
constexpr double elastic_margin = 5.0;
// Of what a finer run tells of space.
constexpr double finer_margin = 2.0;
// Of what is left out no less than 0.4 of what is true is told (tests/trust/left_out.py).
constexpr double effects_margin = 2.5;
// Where so little is missing half a decade does, which with a looser run of its own costs less than a decade that costs so many times more.
constexpr double nearly = 1.5, dear_decade = 2.5, half_a_decade = 0.3;
// What is left out and worth less is not brought back where what is left out keeps a run from the accuracy.
constexpr double little = 0.1;
// What an event shifts can be worth a multiple of what is told along the motion (run_scene.cpp).
constexpr double may_shift_events = 5e-4;
// Vibrations that lost so much, of the range of an output, come back only at tolerances that cost more than following them does.
constexpr double mostly_lost = 0.2;
// How far the nearest run of those that follow vibrations may be off, in what is asked, at the end of their time: a round brings a third of
// that for twice the price. And how far one may be that a search would still bring there.
constexpr double surely_far = 5.0, within_reach = 2.0;
// A run as it is written is not waited for longer, CPU s; one that follows vibrations is never given up before (a search takes longer).
constexpr double longest = 120.0, shortest = 3.0;
// Estimates of what one frame lacks were up to 1.25 times too low (linear_limit.cpp); where so much is kept too nothing is measured.
constexpr double bending_margin = 1.3, unmeasured = 1e300;
// CPU s of a run as written whose effects are not called for by another one.
constexpr double dear_run = 1.0;
// The next run is not made where it costs that much, s, and so many times the last one (beam on a stop at 1e-3, its 30 coordinates followed
// at 1e-8: 2 CPU s and no end).
constexpr double dear_step = 0.3, dearer_step = 5.0;
// CPU s for few modes where events shift with tighter steps.
constexpr double few_allowance = 8.0;
// A looser run that takes longer than so many times the run itself has lost its way (arm with a payload: 16 CPU s, five times the run);
// where runs take seconds it has to be the cheaper one that it should be.
constexpr double dearer_if_looser = 1.5, cheaper_if_looser = 0.6;
// CPU s for all of its runs, by what the first one takes: a decade of tolerance costs two to three times as much, and each run is judged by
// others. Beyond that the search begins, which does as much with fewer modes.
double straight_allowance(double first) { return std::max(5.0, std::min(20.0 * first, 5.0 + 2.0 * first)); }

class Straight {
 public:
  explicit Straight(Task& task) : t_(task) {}
  std::optional<Finished> go(const Scene& as_given);
  std::optional<StraightRun> left;  // go_straight

 private:
  enum class Verdict { kept, tighter, rather_follow, follow, lost };

  bool run_pilot(const Scene& scene, bool again = true);
  bool run_few(const SimulateOptions& options, bool again);
  const Scene& as_run(const Scene& scene) const { return few_ > 0 ? few_scene_ : scene; }
  int more_than_few() const { return std::max(few_ + least_more, few_ + few_ / 2); }
  // What came of judging space: the end, with the run or a search that has to begin; effects that have come; or neither.
  struct Spaced {
    std::optional<Finished> finished;
    bool ends = false, more = false, resolved = false;
  };
  Spaced finish_in_space();
  bool refine_few();
  std::optional<Finished> try_few(const Scene& as_given, const Search& search, double within);
  double allowed_to_try() const;
  double allowed_for_few() const;
  double most_for_few() const;
  double few_or_try() const { return t_.search.touches ? std::max(allowed_to_try(), allowed_for_few()) : allowed_to_try(); }
  std::vector<std::string> described() const;
  StraightRun for_search(bool kept) const;
  Verdict verdict_as_called(const Scene& scene);
  std::optional<Finished> follow_first();
  std::optional<Finished> try_following();
  bool bring_what_shifts();
  bool bring(double worth);
  bool judge_space();
  bool judge_by_quarter();
  bool judge_by_doubled();
  bool space_by(const Scene& other, const ByKind& shares);
  bool by_program(const EffectState& s) const;
  bool decided(const LeftOutWorth& w) const;
  void set_aside_lacking();
  bool chosen_by_scene(const LeftOutWorth& w) const;
  bool leaves_out_more() const;
  bool judge_deformations(bool following);
  bool judge_effects(bool following = false);
  bool measure_effects(const std::optional<Method>& method, bool following);
  void leave(const std::string& effect, const std::vector<std::string>& owners, double worth);
  void report_chosen(Finished& f) const;
  std::optional<Finished> finish_as_written();
  std::optional<Finished> follow_vibrations(double within);
  std::optional<Finished> followed(double within) const;
  bool check(Finished& f);
  bool warned(const Notes& notes, bool misfits = true) const;
  double price_of_volumes(const Finished& f) const;
  double energy_share() const;
  double as_seen(double missing, double change) const;
  bool lacks_margin_of_time() const;
  double next_work() const;
  double next_allowed() const;
  VecX sizes_of(const Histories& h) const;
  std::optional<Histories> loose_run(const Scene& scene, double tolerance, const System* start = nullptr);
  Verdict judge_time(const Scene& scene);
  MatX constant_effects(const Histories& like) const;

  Task& t_;
  // Modes of bending that each beam keeps in these runs, with the static deflections of the rest, and the scene with them; 0: the scene as
  // it is written.
  int few_ = 0;
  // Of stretching and twist so many more than the two that they have; a run with twice as many judges them.
  int few_stiff_ = 0;
  Scene few_scene_;
  static constexpr int least_more = 2;
  double first_tolerance() const { return std::clamp(0.1 * t_.accuracy, 1e-9, 1e-3); }
  // Where forces at rest make most of what is seen, few modes bring the rest.
  int few_at_first() const { return std::max(3, static_cast<int>(std::ceil(0.5 * std::pow(t_.accuracy, -1.0 / 3.0)))); }
  int refined_ = 0;                       // times that it was too few
  double lacked_ = 0.0;                   // of space then
  bool refined_stiff_ = false;            // and what it was given more of
  bool short_of_margins_ = false;         // what the estimates say has to be several times smaller
  bool short_of_effects_ = false;         // what is left out has to be
  double space_margin_ = elastic_margin;  // by how much, of space
  double tolerance_ = 0.0;
  double judged_at_ = 1.0;                 // the last one that was judged
  double begin_at_ = 1.0;                  // looser ones were too loose for another way
  double before_ = 0.0, before_at_ = 0.0;  // what a decade changed at a looser tolerance, 0: not known, and this
  double missed_ = 0.0;                    // what the energy missing there could move (energy_share)
  JudgedRun run_;
  Histories fine_, looser_;
  bool has_looser_ = false;
  bool tried_ = false;                                    // to follow vibrations
  bool tried_few_ = false;                                // modes, beside dear steps
  double few_in_vain_ = 0.0;                              // CPU s that they had and were too few
  bool brought_ = false;                                  // what kept it from being judged
  std::set<std::pair<std::string, std::string>> pinned_;  // bodies and their effects that have been brought
  Verdict by_time_ = Verdict::kept;                       // of a run that called for more effects
  double needed_ = 0.0;                                   // how many times as near it has to be in time
  double lost_before_ = 0.0;                              // the same of the run before where that was too far off to tell, else 0
  MatX time_, space_;
  double likely_ = 1.0;              // of time_, what is told
  std::optional<Histories> other_;   // the last run by which space was judged
  double other_at_ = 0.0;            // its tolerance
  double allowed_ = longest;         // CPU s of the next run
  double until_ = 1e300;             // work_seconds() at which this ends
  double step_ = 0.1;                // by which the tolerance has to fall
  double effects_ = 0.0;             // what is left out is worth
  std::vector<Task::Share> shares_;  // of them
  BendingWorth bending_;             // in beams' own frames
};

// The run at the tolerance, with the effects that its motion needs; false where it fails or takes too long. Without `again` the scene has
// them, and the run does not.
bool Straight::run_pilot(const Scene& scene, bool again) {
  SimulateOptions o = *t_.options;
  o.tolerance = tolerance_;
  o.accuracy.reset();
  o.estimate_error = true;  // keeps the start for the looser run
  const double start = work_seconds();
  o.progress = [this, start](double time) {
    if (work_seconds() > until_) throw SearchSpent{};
    if (work_seconds() - start > allowed_) throw TooDear{};
    if (t_.options->progress) t_.options->progress(time);
  };
  try {
    if (few_ == 0) run_ = run_judged(scene, o, t_.accuracy, again);
    else if (!run_few(o, again)) return false;
    if (until_ > 1e299) until_ = start + straight_allowance(work_seconds() - start);
  } catch (const TooDear&) {
    return false;
  } catch (const SimulationError&) {
    return false;
  }
  fine_ = to_histories(run_.results);
  fine_.scales = run_.scales;
  set_aside_lacking();
  return true;
}

// What no setting brings is told beside the result, with its worth: nothing is looked for on its account. (An elastic slider-crank whose
// section has no shear areas, worth 4 % of its deflection: a search of 14 CPU s for 0.1 did not count it.)
void Straight::set_aside_lacking() {
  t_.lacking.clear();
  std::erase_if(run_.left_out, [&](const LeftOutWorth& w) {
    const bool lacks = w.effect == "shear" && !w.possible && decided(w);
    if (lacks) t_.lacking.push_back(w);
    return lacks;
  });
}

// With few modes, and the effects that the motion calls for; false where it calls for ever more. Without `again`: as run_pilot.
bool Straight::run_few(const SimulateOptions& options, bool again) {
  constexpr int most_calls = 4;
  for (int call = 0; call < most_calls; ++call) {
    few_scene_ = t_.search.with_modes(few_, few_stiff_);
    run_ = run_judged(few_scene_, options, t_.accuracy, false);
    run_.called = t_.search.adopt(run_.effects);
    if (!run_.called || !again) return true;
  }
  return false;
}

std::optional<Histories> Straight::loose_run(const Scene& scene, double tolerance, const System* start) {
  Scene loose = scene;
  loose.simulation.tolerance = tolerance;
  const double run = run_.results.statistics.work;
  return t_.search.run_within(loose, std::max(0.5, (run > dear_run ? cheaper_if_looser : dearer_if_looser) * run), start);
}

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

// What is likely of the difference to a run ten times looser; falls: the difference of the two runs before over this one, 0: not known.
// What a run is accepted by is larger. Why: 139 scenes of trust/run_trust at 1e-3 to 1e-6 beside runs at 1e-10; of Adams' methods a median
// of 0.15 is true, 0.02 to 0.05 in the lowest and 0.7 to 1.3 in the highest of twenty, however many steps more the tighter run takes; of
// bdf 0.25, of implicit steps over vibrations nearly all.
double likely_share(const std::string& method, double falls) {
  const double known = method == "adams" ? 0.2 : method == "bdf" ? error_of_difference : 1.0;
  if (falls <= 0.0) return known;
  return falls < 4.0 / 3.0 ? 3.0 : std::max(std::min(known, error_of_difference), 1.0 / (falls - 1.0));
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
  likely_ = likely_share(run_.results.statistics.method, falls) / factor;
  // Two loose runs of as many steps may be as far off, and alike in that (a Cardan joint: 98 steps at 1e-3 and 90 at 1e-4, 1.2e-3
  // and 1.1e-3 off, 1.9e-4 apart).
  constexpr double alike = 10.0;
  const bool as_many = before_ <= 0.0 && run_.results.statistics.steps <= looser_.statistics.steps && alike * change > t_.accuracy;
  before_ = change, before_at_ = tolerance_;
  const double missing = energy_share(), lost = decade ? as_seen(missing, change) : missing;
  missed_ = missing, judged_at_ = tolerance_;
  const double in_time = largest(time_) / (share_of_time * t_.accuracy), needed = needed_ = std::max(in_time, lost / t_.accuracy);
  if (needed <= 1.0) return as_many ? Verdict::tighter : Verdict::kept;
  // Where vibrations cannot be followed the next decade, of which this is the looser run, tells how much of the energy's word counts.
  step_ = std::clamp(std::pow(t_.search.smooth && t_.search.rings ? needed : in_time, -1.0 / cautious_order), 1e-2, 0.1);
  if (needed < nearly && next_work() > dear_decade * run_.results.statistics.work) step_ = half_a_decade;
  const bool vibrates = t_.search.smooth && t_.search.elastic && !follows_vibrations(t_.options->method);
  if (vibrates && t_.search.rings && needed > 30.0) return Verdict::follow;
  // With few modes that costs less than one more decade; where much lacks, less than the decades that it takes, damped or not.
  constexpr double far = 5.0;
  const bool short_steps = few_ > 0 ? t_.search.rings : lost > mostly_lost || needed > far;
  if (vibrates && short_steps) return Verdict::rather_follow;
  // With few modes a search finds as much for less.
  if (few_ == 0 && t_.search.elastic && t_.search.has_levels() &&
      next_work() > std::max(dear_step, dearer_step * run_.results.statistics.work))
    return Verdict::lost;
  // So far off a run tells nothing but that: cheap ones go on as long as they come nearer.
  constexpr double lost_from = 1000.0, nearer = 0.3;
  const bool goes_on = next_work() <= dear_step && (lost_before_ <= 0.0 || needed <= nearer * lost_before_);
  if (needed > lost_from && !goes_on) return Verdict::lost;
  lost_before_ = needed > lost_from ? needed : 0.0;
  return Verdict::tighter;
}

// Ranges of the outputs; what stands still counts against its size if that is more than rounding (moments of a hinge about its own axis:
// two runs were never alike in these), places against the largest deflection of a body.
VecX Straight::sizes_of(const Histories& h) const {
  double deflection = 0.0;
  for (const ResultBody& body : run_.results.bodies)
    if (body.displacement.size() > 0) deflection = std::max(deflection, body.displacement.cwiseAbs().maxCoeff());
  VecX out = output_ranges(h, fine_);
  const VecX rounding = rounding_of_outputs(h);
  for (Eigen::Index c = 0; c < out.size(); ++c) {
    if (out[c] > 0.0) continue;
    const double size = h.values.row(c).cwiseAbs().maxCoeff();
    out[c] = h.units[c] == "m" ? deflection : size > rounding[c] ? size : 0.0;
  }
  // A component of a vector that stands still counts against the whole vector.
  for (Eigen::Index c = 0; c < out.size(); ++c) {
    const std::string vector = h.columns[c].substr(0, h.columns[c].rfind('.'));
    for (Eigen::Index k = 0; k < out.size(); ++k)
      if (h.units[k] == h.units[c] && h.columns[k].substr(0, h.columns[k].rfind('.')) == vector) out[c] = std::max(out[c], out[k]);
  }
  return out;
}

// What this run lacks by another one, `other` of it in places, rates and forces each.
bool Straight::space_by(const Scene& other, const ByKind& shares) {
  const Histories thinned = at_times(fine_, looser_.times);
  for (const double at : {10.0 * tolerance_, tolerance_}) {
    const std::optional<Histories> run = loose_run(other, at);
    const Histories& against = at > tolerance_ ? looser_ : thinned;
    if (!run || run->columns != against.columns || run->times.size() != against.times.size()) return false;
    space_ = run->values - against.values;
    const VecX sizes = sizes_of(against);
    for (Eigen::Index c = 0; c < space_.rows(); ++c) {
      space_.row(c) *= sizes[c] > 0.0 ? of_kind(fine_.units[c], shares) / sizes[c] : 0.0;
    }
    const bool small = largest(space_) <= share_of_space * t_.accuracy;
    other_ = std::move(*run), other_at_ = at;
    if (small) return true;
  }
  return false;
}

// What a finer run changes, and what lies beyond it: twice the elements, or half as many modes more beside the shapes of forces at rest,
// bring more than half of what lacks in places, half in rates, a third in forces.
constexpr ByKind by_finer{1.5, 2.0, 3.0};

// Whether the margins of an estimate ask for tighter steps, whatever space takes, and these cost little enough (judge_time).
bool Straight::lacks_margin_of_time() const {
  return t_.search.elastic && t_.search.has_levels() && elastic_margin * largest(time_) > t_.accuracy &&
         next_work() <= std::max(dear_step, dearer_step * run_.results.statistics.work);
}

bool Straight::judge_space() {
  space_ = MatX::Zero(time_.rows(), time_.cols());
  space_margin_ = elastic_margin;
  other_.reset();
  if (!t_.search.has_levels()) return true;
  if (few_ > 0) {
    space_margin_ = finer_margin;
    return space_by(t_.search.with_modes(more_than_few(), least_more + 2 * few_stiff_), by_finer);
  }
  const int fewest = t_.search.fewest();
  const std::optional<Scene> half = t_.search.coarser();
  if (fewest < 2 || !half) return false;
  return space_by(*half, by_half(fewest));
}

// How fast half the elements brought it down from a quarter of them: they go on by no less. Of an order p, 1 / (2^p - 1) of the last change
// lacks; more than three times a step are not reckoned with, as few elements fall steeply at first. A run that costs a tenth of one with
// twice the elements.
bool Straight::judge_by_quarter() {
  constexpr int enough = 8;
  constexpr double slowest = 1.5, steepest = 3.0;
  if (few_ > 0 || space_.size() == 0 || !other_ || t_.search.fewest() < enough) return false;
  const std::optional<Scene> quarter = t_.search.coarser(4);
  const std::optional<Histories> run = quarter ? loose_run(*quarter, other_at_) : std::nullopt;
  const Histories fine = other_at_ > tolerance_ ? looser_ : at_times(fine_, looser_.times);
  if (!run || run->columns != fine.columns || run->times.size() != fine.times.size()) return false;
  const MatX first = run->values - other_->values, second = other_->values - fine.values;
  const VecX sizes = sizes_of(fine);
  for (Eigen::Index c = 0; c < space_.rows(); ++c) {
    const double last = largest(second.row(c)), falls = std::min(steepest, largest(first.row(c)) / std::max(last, 1e-300));
    if (falls < slowest || sizes[c] <= 0.0) continue;
    space_.row(c) = second.row(c) / ((falls - 1.0) * sizes[c]);
  }
  space_margin_ = finer_margin;
  return largest(space_) <= share_of_space * t_.accuracy;
}

// Where half the elements promise it, twice as many tell how far these are off: a run where a search makes fifty.
bool Straight::judge_by_doubled() {
  constexpr double promising = 2.0;
  if (few_ > 0 || space_.size() == 0 || largest(space_) > promising * t_.accuracy || run_.results.statistics.work > dear_run) return false;
  const std::optional<Scene> twice = t_.search.doubled();
  if (!twice) return false;
  space_margin_ = finer_margin;
  return space_by(*twice, by_finer);
}

// Worth more than may be left out, and off because the scene lists its effects: a search would not have it either.
bool Straight::chosen_by_scene(const LeftOutWorth& w) const { return w.share > 0.5 * t_.accuracy && !decided(w); }

// What the scene's own list leaves out is worth more than what is asked, surely: no search brings it there.
bool Straight::leaves_out_more() const {
  constexpr double surely = 2.0;
  const auto more = [&](const LeftOutWorth& w) { return w.share > surely * t_.accuracy && !decided(w); };
  return std::any_of(run_.left_out.begin(), run_.left_out.end(), more) ||
         std::any_of(run_.second_order.begin(), run_.second_order.end(), more);
}

// Deformations that are off, by what the motion says of them. following: what the scene's own list leaves out is told at the end.
bool Straight::judge_deformations(bool following) {
  effects_ = 0.0;
  shares_.clear();
  for (const LeftOutWorth& w : run_.left_out) {
    if (t_.search.touches && w.possible && w.share > may_shift_events) return false;
    if (following && chosen_by_scene(w)) continue;
    if (w.share > 0.5 * t_.accuracy) return false;
    if (decided(w)) leave(w.effect, w.owners, w.share);
  }
  return true;
}

bool Straight::by_program(const EffectState& s) const { return t_.search.decides(s) || (s.effect == "shear" && s.by == "program"); }

// Whether the program left it out, not the scene. A scene of few modes lists what the search has switched on as its own would.
bool Straight::decided(const LeftOutWorth& w) const {
  const std::vector<EffectState>& states = few_ > 0 ? t_.search.states : run_.effects;
  return std::all_of(w.owners.begin(), w.owners.end(), [&](const std::string& owner) {
    return std::any_of(states.begin(), states.end(), [&](const EffectState& s) {
      if (s.owner != owner || s.effect != w.effect) return false;
      return by_program(s);
    });
  });
}

void Straight::leave(const std::string& effect, const std::vector<std::string>& owners, double worth) {
  effects_ += worth;
  shares_.push_back({effect, owners, worth});
}

// What the motion says of the effects that are off; those that a pair of runs tells better by one where they may decide.
bool Straight::judge_effects(bool following) { return judge_deformations(following) && measure_effects(t_.options->method, following); }

// Deformations that may not be left out because events shift with them come, before a search begins that would bring them too; whether
// there were any.
bool Straight::bring_what_shifts() { return t_.search.touches && bring(may_shift_events); }

// Deformations that the program left out and that are worth more come on; whether there were any. What one beam has may change what the
// program decides for another (two beams in a loop whose length only one of them has to give), which then is pinned.
bool Straight::bring(double worth) {
  bool more = false;
  for (const LeftOutWorth& w : run_.left_out) {
    if (!w.possible || w.share <= worth || !decided(w)) continue;
    const std::vector<EffectState> states = t_.search.states;
    for (const EffectState& s : states)
      if (!pinned_.contains({s.owner, s.effect}) && s.effect == w.effect && by_program(s) &&
          std::find(w.owners.begin(), w.owners.end(), s.owner) != w.owners.end())
        t_.search.set_effect(s, true), pinned_.insert({s.owner, s.effect}), more = true;
  }
  return more;
}

// Of stiffening, gyroscopic terms and what shifts forces, beside the deformations; the method is that of the runs. following: as above.
bool Straight::measure_effects(const std::optional<Method>& method, bool following) {
  NeglectOptions check;
  check.tolerance = 10.0 * tolerance_;
  check.method = method;
  check.floor = largest(time_);
  check.budget = std::max(check_price * run_.results.statistics.work, 0.05);
  std::vector<std::string> measured;
  for (const LeftOutWorth& w : run_.second_order) {
    // No less is told than half of what is true.
    if (following && chosen_by_scene(w)) continue;
    if (2.0 * w.share > 0.2 * t_.accuracy) measured.push_back(w.effect);
    else if (decided(w)) leave(w.effect, w.owners, 2.0 * w.share);
  }
  // Forces that are read shift with what gives way inside.
  for (const LeftOutWorth& w : run_.left_out)
    if (w.possible && w.inside > 0.5 * t_.accuracy) measured.push_back(w.effect);
  check.further = measured;
  if (measured.empty()) return effects_ <= share_of_effects * t_.accuracy;
  const NeglectCheck found = check_neglected(run_.scene, run_.effects, looser_, check);
  if (!found.untried.empty()) return false;
  for (const Neglected& n : found.found)
    if (std::find(measured.begin(), measured.end(), n.effect) != measured.end()) leave(n.effect, n.owners, n.share);
  return effects_ <= share_of_effects * t_.accuracy;
}

MatX Straight::constant_effects(const Histories& like) const { return MatX::Constant(like.values.rows(), like.values.cols(), effects_); }

// What nothing above has judged: kept modes that the scene gives, elements on places that it names, bodies bent far, forms of other ends.
bool Straight::check(Finished& f) {
  SolverStatistics& s = f.results.statistics;
  const Histories whole = to_histories(f.results);
  s.error_estimate = f.error;
  if (warned(s.notes)) return false;
  warn_of_coarse_beams(coarse_beams(f.scene, run_.effects, f.results), 0.5 * t_.accuracy, s.notes);
  ModelCheckOptions models;
  models.asked = t_.accuracy;
  models.budget = check_budget(s.work);
  models.run.tolerance = f.loose_tolerance;
  models.run.floor = std::max(f.time, apart(f.looser, whole));
  models.run.method = f.method;
  models.run.run = &whole;
  models.run.run_tolerance = f.setting.tolerance;
  models.run.run_error = f.time;
  for (size_t b = 0; b < f.scene.bodies.size(); ++b)
    if (std::holds_alternative<BeamDef>(f.scene.bodies[b].kind) && !t_.search.chooses(b)) models.unjudged.push_back(b);
  std::vector<LinearLimit> limits = f.limits;
  std::erase_if(limits, [&](const LinearLimit& l) { return l.pieces > 1 && t_.search.chooses(static_cast<size_t>(l.body)); });
  double bent = 0.0;
  for (const LinearLimit& l : limits) bent = std::max(bent, l.error());
  const bool one_frame = std::all_of(limits.begin(), limits.end(), [](const LinearLimit& l) { return l.pieces == 1; });
  models.surely_small = one_frame && std::hypot(f.error, bending_margin * bent) <= t_.accuracy ? unmeasured : 0.25;
  // Where modes lack far more, the estimate of it is enough.
  const double before = f.error;
  if (before > 2.0 * t_.accuracy &&
      std::all_of(limits.begin(), limits.end(), [&](const LinearLimit& l) { return l.error() < 0.5 * before; }))
    models.budget = 0.0;
  bending_ = check_models(f.scene, run_.effects, limits, f.looser, models, s);
  // Modes that the search chose are judged.
  bool given_modes = false;
  for (size_t b = 0; b < f.scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&f.scene.bodies[b].kind);
    given_modes = given_modes || (beam && beam->keep_modes && !t_.search.chooses(b));
  }
  SimulateOptions o = *t_.options;
  o.method = f.method;
  double deflection = 0.0;
  for (const ResultBody& body : f.results.bodies)
    if (body.displacement.size() > 0) deflection = std::max(deflection, body.displacement.cwiseAbs().maxCoeff());
  if (given_modes) warn_of_few_modes(f.scene, o, whole, deflection, 0.5 * t_.accuracy, s);
  if (bending_.elements == 0) bending_.share *= bending_margin;
  f.space = std::hypot(f.space, bending_.share);
  f.error = s.error_estimate = std::hypot(f.error, bending_.share);
  return !warned(s.notes);
}

// Whether something is warned of that another setting may take away (mast of an L section, whose shear centre the model does not know: its
// search took 500 times the run and warned of the same). misfits: eigenforms that are those of other ends, as the scene lists them, count:
// more of them, which is what a search has, would not fit either.
bool Straight::warned(const Notes& notes, bool misfits) const {
  const std::vector<Note>& of_scene = t_.search.warnings;
  return std::any_of(notes.all().begin(), notes.all().end(), [&](const Note& n) {
    return n.severity == Severity::warning && (misfits || !n.text.starts_with(misfit_words)) &&
           std::find(of_scene.begin(), of_scene.end(), n) == of_scene.end();
  });
}

std::vector<std::string> Straight::described() const {
  if (few_ > 0) return t_.search.describe(few_scene_, tolerance_);
  return {fmt::format("the scene as written, tolerance {:.1e}", tolerance_)};
}

// What the search begins with.
StraightRun Straight::for_search(bool kept) const {
  StraightRun out{run_, as_run(run_.scene), {}, tolerance_, 0.0, described(), kept};
  if (few_ > 0) out.run.scene = t_.search.scene();
  if (kept) out.looser = looser_, out.time = largest(time_);
  return out;
}

std::optional<Finished> Straight::finish_as_written() {
  Finished f;
  f.scene = as_run(run_.scene);
  f.scene.simulation.tolerance = tolerance_;
  f.limits = run_.limits;
  f.method = t_.options->method;
  f.setting.tolerance = tolerance_;
  f.loose_tolerance = 10.0 * tolerance_;
  f.described = described();
  f.looser = looser_;
  f.coarse = looser_;
  const Histories thinned = at_times(fine_, looser_.times);
  const MatX none = MatX::Zero(thinned.values.rows(), thinned.values.cols()), left_out = constant_effects(thinned);
  const auto exceeds = [&](double margin, const MatX& effects) {
    if (!t_.search.has_levels()) margin = 1.0;
    return f.add_up(thinned, margin * time_, std::min(margin, space_margin_) * space_, margin * effects) > t_.accuracy;
  };
  const bool without_effects = exceeds(elastic_margin, none);
  short_of_effects_ = !without_effects && exceeds(effects_margin, left_out);
  short_of_margins_ = without_effects || short_of_effects_;
  f.add_up(thinned, std::min(1.0, likely_) * time_, space_, left_out);
  if (short_of_margins_) return std::nullopt;
  t_.decade = std::max(1.05, run_.results.statistics.work / std::max(looser_.statistics.work, 1e-9));
  f.results = run_.results;
  report_left_out(f.scene, run_.left_out, t_.accuracy, f.results.statistics);
  report_left_out(f.scene, run_.second_order, t_.accuracy, f.results.statistics);
  if (!check(f) && warned(f.results.statistics.notes, false)) return std::nullopt;
  if (f.error > t_.accuracy) return std::nullopt;
  // No search brings that down in its time.
  if (few_ == 0) {
    f.count_start(t_.search, fine_);
    f.results.statistics.error_estimate = f.error;
  }
  return f;
}

// Vibrations that have to be followed, within so many CPU s: exact for linear ones, with as many modes as convergence asks for. What a
// beam's eigenmodes beyond the n-th bring to its ends falls as n^-3 at least (beta^-4, times the tangent that it is measured from).
std::optional<Finished> Straight::followed(double within) const {
  Task task = t_;
  task.straight = true;
  task.search.method = Method::exponential;
  task.search.accuracy = t_.accuracy;
  const bool slow = fine_.units.empty() ? t_.search.reads_forces : std::any_of(fine_.units.begin(), fine_.units.end(), converges_slowly);
  // Of several bodies the stiffer ones get few modes.
  int bodies = 0;
  for (size_t b = 0; b < t_.search.scene().bodies.size(); ++b) bodies += t_.search.chooses(b);
  const double modes = (slow || bodies > 1 ? 1.5 : 0.7) * std::pow(t_.accuracy, -1.0 / 3.0);
  // Two modes of stretching for 5e-3, four for 1e-3: what bodies pass on to each other along their axes rings as long as bending does
  // (slider-crank: 2.2e-3 and 9e-4 off).
  constexpr double two_stiff = 4e-3;
  if (slow || (bodies > 1 && t_.accuracy < two_stiff)) task.search.stiff_at_first *= 2;
  // More than so many at first are judged for seconds where fewer tell that it is hopeless (slider-crank at 5e-4).
  constexpr double most_at_first = 16.0;
  // Where rates decay too, steps cost what the fastest vibration asks for, whatever the tolerance.
  const double tolerance = t_.search.undamped ? 3e-4 * t_.accuracy : std::min(3e-4 * t_.accuracy, 1e-5 * std::sqrt(t_.accuracy));
  // Where something stretches or twists, which sets the steps, the exponential method costs little more down to this (slider-crank, 1e-4 to
  // 3e-7: 0.11 to 0.19 CPU s), and errors of time do not hide what modes lack. Bending alone takes seven times the steps for it.
  // Below 2e-7 it samples what oscillates, at a multiple of the price: an accuracy of 1e-3 stays just above that.
  constexpr double free_at_least = 2.1e-7;
  const double nearly_free = std::clamp(1.5e-4 * t_.accuracy, free_at_least, 3e-7);
  const bool stiff = std::any_of(t_.search.states.begin(), t_.search.states.end(), [&](const EffectState& s) {
    return (s.effect == "axial" || s.effect == "torsion") && (s.on || (s.possible && t_.search.decides(s)));
  });
  const double clear = stiff ? std::min(tolerance, std::max(nearly_free, 3e-5 * t_.accuracy)) : tolerance;
  // Where each mode costs that much, rounds from few of them on cost less than one with too many. What is damped far has fast modes that
  // follow their loads, for which static shapes stand, and decays that set the steps (geared arm at 1e-3: two modes 5e-5 off in 0.002 CPU
  // s, sixteen 0.09).
  constexpr double few_at_first = 2.0;
  const bool few = few_ > 0 || !t_.search.rings;
  // Of what is damped a run ten times looser may do: its own looser one tells, for a third of its price. What rings undamped is off by
  // more, but for a tenth (pendulum, slider-crank at 1e-3: tried in vain, a quarter of the run's price), what samples by far less.
  constexpr double a_tenth = 0.05;
  task.clear = std::clamp(clear, 1e-10, 1e-4);
  const bool looser = task.clear >= free_at_least && (!t_.search.undamped || t_.accuracy >= a_tenth);
  const double start = looser ? std::min(10.0 * task.clear, 1e-4) : task.clear;
  task.setting = {Search::level_for_modes(few ? few_at_first : std::min(modes, most_at_first)), start};
  // However stiff, a body may carry what makes it bend, and no judge would see that it is rigid (three welded beams in space, the shortest
  // rigid: 0.53 of the range, told as 7e-4).
  for (const std::string& name : task.search.rigid_at(task.setting)) task.search.flexible.insert(name);
  task.coarse = task.loose = looser_;
  task.rigid = MatX::Zero(looser_.values.rows(), looser_.values.cols());
  task.left_out = constant_effects(looser_);
  task.shares = shares_;
  task.search.until = std::min(until_, work_seconds() + within);
  std::optional<Finished> f;
  try {
    f = finish_followed(task, std::max(shortest, 30.0 * run_.results.statistics.work));
  } catch (const SearchSpent&) {
    // So far off that a search, which takes the same way again, would not bring it there either.
    const std::optional<Finished>& nearest = *task.nearest;
    if (within >= unlimited && nearest && nearest->judged && nearest->error > surely_far * t_.accuracy) f = nearest;
  } catch (const SimulationError&) {
  } catch (const InputError&) {  // a scene that this method is not for
  }
  return f;
}

// CPU s of a search with volumes that would do as well as this run: volumes keep all of their elements' coordinates, of which six stand for
// a mode here (pendulum: 8 modes of 96 elements lack as much as 48 elements), evaluations cost their cube. The run itself, a finer and a
// looser one beside it, and coarser ones before. 0: not known.
double Straight::price_of_volumes(const Finished& f) const {
  constexpr double elements_a_mode = 6.0, of_tolerance = 2.0, runs = 6.0;
  if (bending_.elements == 0) return 0.0;
  double elements = 0.0;
  for (const BodyDef& b : f.scene.bodies)
    if (const auto* beam = std::get_if<BeamDef>(&b.kind)) elements = std::max(elements, elements_a_mode * beam->keep_modes.value_or(0));
  return runs * of_tolerance * bending_.cpu * std::pow(std::max(1.0, elements / bending_.elements), 3);
}

std::optional<Finished> Straight::follow_vibrations(double within) {
  std::optional<Finished> f = followed(within);
  if (!f || !f->judged) return std::nullopt;
  // The vibrations, followed, may ask for effects that the run which stepped over them did not show; what is left out is worth what it
  // is along the run that followed them.
  t_.search.adopt(f->judged->effects);
  run_ = *f->judged;
  set_aside_lacking();
  if (!judge_deformations(true)) return std::nullopt;
  const bool checked = check(*f);
  // More modes would not do in the time of a search, which would go the same way again; volumes are another way, where they can.
  if (f->error > t_.accuracy && bending_.share > 0.5 * f->error) {
    const double price = price_of_volumes(*f);
    if (price <= search_allowance(run_.results.statistics.work) && !leaves_out_more()) return std::nullopt;
    f->unreached = fmt::format(
        "; beams bend too far for one frame, and a search with volumes would take some {:.0f} CPU s: request less "
        "accuracy, or give volumes",
        price);
  }
  // Where runs are dear, those of a search have fewer modes yet: it brings what misses by little there (console of two beams in space).
  if (f->error > t_.accuracy && few_ > 0 && f->error <= within_reach * t_.accuracy) return std::nullopt;
  const auto chosen = [&](const LeftOutWorth& w) { return chosen_by_scene(w); };
  const bool by_choice = std::any_of(run_.left_out.begin(), run_.left_out.end(), chosen) ||
                         std::any_of(run_.second_order.begin(), run_.second_order.end(), chosen);
  if (f->error > t_.accuracy) {
    if (by_choice || leaves_out_more()) report_chosen(*f);
    return f;
  }
  if (!checked || std::hypot(f->error, effects_) > t_.accuracy) return std::nullopt;
  if (by_choice) report_chosen(*f);
  return f;
}

// What the scene's own list of effects leaves out, as a search would tell it of the run that it ends with.
void Straight::report_chosen(Finished& f) const {
  SolverStatistics& s = f.results.statistics;
  const Histories whole = to_histories(f.results);
  NeglectOptions check;
  check.tolerance = f.loose_tolerance;
  check.floor = std::max(f.time, apart(f.looser, whole));
  check.budget = std::max(check_price * s.work, least_check);
  check.method = f.method;
  check.run = &whole;
  check.run_tolerance = f.setting.tolerance;
  check.run_error = f.time;
  check.deformations = true;
  std::vector<LeftOutWorth> chosen;
  for (const LeftOutWorth& w : run_.left_out)
    if (chosen_by_scene(w)) chosen.push_back(w);
  check.told = &chosen;
  report_neglected(f.scene, run_.effects, f.looser, check, t_.accuracy, s);
  report_left_out(f.scene, chosen, t_.accuracy, s);  // those that it could not measure
}

// What the first run tells although its motion calls for more effects: where its vibrations are to be followed, which is another run, with
// them, nothing else has to be measured beside it. Else `tighter`.
Straight::Verdict Straight::verdict_as_called(const Scene& scene) {
  if (few_ == 0) t_.search = Search(run_.scene, *t_.options);
  t_.search.until = until_;
  const Verdict verdict = by_time_ = judge_time(as_run(scene));
  if ((verdict != Verdict::follow && (tried_ || verdict != Verdict::rather_follow)) || !run_.second_order.empty()) return Verdict::tighter;
  std::erase_if(run_.left_out, [&](const LeftOutWorth& w) {
    return std::any_of(run_.effects.begin(), run_.effects.end(), [&](const EffectState& s) {
      return s.on && s.effect == w.effect && std::find(w.owners.begin(), w.owners.end(), s.owner) != w.owners.end();
    });
  });
  const bool open = std::any_of(run_.left_out.begin(), run_.left_out.end(),
                                [&](const LeftOutWorth& w) { return w.possible && w.inside > 0.5 * t_.accuracy; });
  return open ? Verdict::tighter : verdict;
}

// CPU s for another way where what rings little is damped.
double Straight::allowed_to_try() const {
  constexpr double least_try = 0.03, dearer_try = 3.0;
  return least_try + dearer_try * run_.results.statistics.work;
}

// CPU s for few modes in place of the next run of all coordinates, which is judged by others that cost as much again. (Slider-crank with
// friction of finite elements at 0.1 and 1e-2: cut off by the price of that run alone, it went on to searches of 14 and 25 CPU s.)
double Straight::allowed_for_few() const {
  constexpr double with_judges = 2.5;
  return std::min(with_judges * next_work(), most_for_few());
}

double Straight::most_for_few() const {
  constexpr double runs = 3.0;
  return std::max(few_allowance, runs * run_.results.statistics.work);
}

// Follows them for a while; where that does not keep the accuracy all is as it was before.
std::optional<Finished> Straight::try_following() {
  tried_ = true;
  // What is damped far may have decays so fast that the method takes a step for each: tighter steps of an implicit one are the other way.
  const double begun = work_seconds(), run = run_.results.statistics.work;
  const JudgedRun stepped = run_;
  const Search search = t_.search;
  if (judge_effects(true))
    if (std::optional<Finished> f = follow_vibrations(few_ > 0          ? shortest
                                                      : t_.search.rings ? std::max(0.3, run)
                                                                        : allowed_to_try());
        f && f->error <= t_.accuracy)
      return f;
  run_ = stepped;
  t_.search = search;
  until_ += work_seconds() - begun;
  t_.search.until = until_;
  return std::nullopt;
}

// Without a run before it: where runs of few modes are dear too, each of an implicit method costs as much as all that follow vibrations.
// What is left out is told by the run itself.
std::optional<Finished> Straight::follow_first() {
  if (!t_.search.smooth || !t_.search.rings || !t_.search.elastic || follows_vibrations(t_.options->method)) return std::nullopt;
  if (t_.search.scene().simulation.method != Method::automatic || t_.options->method) return std::nullopt;
  const Search search = t_.search;
  const double asked_for = tolerance_;
  std::optional<Finished> f = follow_vibrations(shortest);
  if (f && f->error <= t_.accuracy) {
    looser_ = f->looser;
    time_ = MatX::Constant(1, 1, f->time);
    tolerance_ = 0.1 * f->loose_tolerance;
    if (measure_effects(f->method, true)) {
      f->effects = std::hypot(f->effects, effects_);
      f->error = std::max(std::hypot(f->error, effects_), f->time + std::hypot(f->space, f->effects));
      if (f->error <= t_.accuracy) {
        f->results.statistics.error_estimate = f->error;
        return f;
      }
    }
  }
  run_ = {}, looser_ = {}, time_ = MatX(), tolerance_ = asked_for, effects_ = 0.0, shares_.clear();
  t_.search = search;
  return std::nullopt;
}

// More modes where these are what keeps a run from the accuracy, or what its margins ask for; false where there are enough of them. More of
// bending, or of stretching and twist where the others did not bring it down (rod that falls on a stop: 5 to 10 of bending 1.5e-3 each).
bool Straight::refine_few() {
  constexpr int most_refinements = 4;
  constexpr double brings = 0.7;
  const double lacks = largest(space_);
  if (few_ == 0 || lacks <= largest(time_) || ++refined_ > most_refinements) return false;
  const bool stretches = std::any_of(t_.search.states.begin(), t_.search.states.end(),
                                     [](const EffectState& s) { return s.on && (s.effect == "axial" || s.effect == "torsion"); });
  if (refined_ > 1 && lacks > brings * lacked_) refined_stiff_ = !refined_stiff_ && stretches;
  if (refined_stiff_) few_stiff_ += least_more + few_stiff_;
  else few_ = more_than_few();
  lacked_ = lacks;
  has_looser_ = false, before_ = 0.0;
  return true;
}

// Few modes in place of all coordinates, by an implicit method as before: what is damped lets it take long steps in them.
std::optional<Finished> Straight::try_few(const Scene& as_given, const Search& search, double within) {
  if (few_ > 0 || (t_.search.rings && t_.search.smooth) || !t_.search.all_in_elements()) return std::nullopt;
  // What has come to no end within the half of it does not now.
  if (within < 2.0 * few_in_vain_) return std::nullopt;
  const double begun = work_seconds();
  Task task = t_;
  task.search = search;
  Straight few(task);
  few.few_ = few_at_first();
  few.tried_ = true;  // to follow vibrations
  few.begin_at_ = judged_at_;
  few.until_ = begun + within;
  std::optional<Finished> f;
  try {
    f = few.go(as_given);
  } catch (const SearchSpent&) {
    few_in_vain_ = within;
  }
  if (f) t_ = std::move(task);
  else begin_at_ = few.judged_at_;
  until_ += work_seconds() - begun;
  t_.search.until = until_;
  return f;
}

// A run that keeps the accuracy in time, judged by what it leaves out and in space by whatever it takes, each dearer than the one before.
Straight::Spaced Straight::finish_in_space() {
  Spaced out;
  const auto finished = [&] {
    out.resolved = true;
    out.finished = finish_as_written();
    out.ends = out.finished || !short_of_margins_;
    return out.ends;
  };
  if (!judge_effects()) {
    // What no run called for, as it is worth something beside others only, comes before a search begins too.
    out.more = !std::exchange(brought_, true) && (bring_what_shifts() || bring(share_of_effects * t_.accuracy));
    out.ends = !out.more;
    return out;
  }
  short_of_effects_ = false;
  // Beside few modes they cost little.
  out.more = few_ > 0 && effects_margin * effects_ > share_of_effects * t_.accuracy && bring(little * t_.accuracy);
  if (out.more || (judge_space() && finished())) return out;
  out.more = short_of_effects_ && bring(little * t_.accuracy);
  if (!out.more && !(judge_by_quarter() && finished()) && judge_by_doubled()) finished();
  return out;
}

std::optional<Finished> Straight::go(const Scene& as_given) {
  const Search search = t_.search;
  const auto tighten = [this](double last) {
    // One decade finds its looser run already there.
    const bool decade = has_looser_ && step_ > 0.05 && step_ < half_a_decade;
    tolerance_ = std::max(1e-11, (decade ? 0.1 : step_) * last);
    if (begin_at_ < tolerance_) tolerance_ = begin_at_, has_looser_ = false;
    else if (decade) looser_ = at_times(fine_, looser_.times);
    else has_looser_ = false;
  };
  tolerance_ = std::min(first_tolerance(), begin_at_);
  if (t_.search.dear_as_given()) few_ = few_at_first();
  if (few_ > 0 && !tried_)
    if (std::optional<Finished> f = follow_first()) return f;
  Scene scene = as_given;
  constexpr int most_tries = 8;
  constexpr double far_off = 30.0;
  for (int k = 0; k < most_tries; ++k) {
    double last = tolerance_;
    const Search uncalled = t_.search;
    bool ran = run_pilot(scene, false);
    if (ran && run_.called) {
      const Verdict called = verdict_as_called(scene);
      if (called == Verdict::follow) return judge_effects(true) ? follow_vibrations(unlimited) : std::nullopt;
      if (called == Verdict::rather_follow) {
        if (std::optional<Finished> f = try_following()) return f;
        if (std::optional<Finished> f = try_few(as_given, t_.search, few_or_try())) return f;
      }
      // A run so far from the motion calls for what its own errors look like.
      if (by_time_ == Verdict::tighter && needed_ > far_off) {
        t_.search = uncalled;
        allowed_ = next_allowed();
        tighten(last);
        continue;
      }
      has_looser_ = false, before_ = 0.0;
      last = tolerance_ = std::min(tolerance_, begin_at_);
      ran = run_pilot(run_.scene);
    }
    if (!ran) {
      // Too loose to hold the mechanism together, perhaps.
      if (allowed_ < longest) return t_.search.smooth ? std::nullopt : try_few(as_given, search, most_for_few());
      tolerance_ *= 0.1;
      has_looser_ = false, before_ = 0.0;
      continue;
    }
    if (few_ == 0) {
      t_.search = Search(run_.scene, *t_.options);
      scene = run_.scene;
    }
    t_.search.until = until_;
    if (few_ > 0 || run_.results.statistics.work > dear_run) left = for_search(false);
    const Verdict verdict = judge_time(as_run(scene));
    allowed_ = next_allowed();
    if (verdict == Verdict::kept) {
      left = for_search(true);
      if (lacks_margin_of_time()) {
        tighten(last);
        continue;
      }
      Spaced space = finish_in_space();
      if (space.ends) return std::move(space.finished);
      if (space.more) {
        scene = t_.search.scene();
        has_looser_ = false, before_ = 0.0;
        --k;
        continue;
      }
      if (refine_few()) {
        --k;  // the tolerance is the same
        continue;
      }
      // Its elements do not tell: modes do, before a search.
      const bool may_follow = t_.search.smooth && t_.search.elastic && !follows_vibrations(t_.options->method);
      if (!space.resolved && !may_follow && few_ == 0 && !std::exchange(tried_few_, true))
        if (std::optional<Finished> f = try_few(as_given, t_.search, most_for_few())) return f;
      if (!space.resolved && (tried_ || !may_follow)) return std::nullopt;
      if (!space.resolved) return try_following();
    }
    if (verdict == Verdict::follow) {
      if (!judge_effects(true)) return std::nullopt;
      return follow_vibrations(unlimited);
    }
    if (verdict == Verdict::lost && !t_.search.smooth) return try_few(as_given, search, most_for_few());
    if (verdict == Verdict::lost) return std::nullopt;
    // Where tighter steps of all coordinates are dear, as vibrations that nothing damps come back with them, a few modes may do for less.
    if (t_.search.touches && t_.search.elastic && few_ == 0 && !tried_few_ && next_work() > dear_step) {
      tried_few_ = true;
      if (std::optional<Finished> f = try_few(as_given, t_.search, allowed_for_few())) return f;
    }
    // Where that does not do, tighter steps may.
    if (verdict == Verdict::rather_follow && !tried_) {
      if (std::optional<Finished> f = try_following()) return f;
      if (std::optional<Finished> f = try_few(as_given, search, few_or_try())) return f;
    }
    tighten(last);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Finished> go_straight(Task& t, const Scene& as_given, std::optional<StraightRun>& left) {
  Straight straight(t);
  std::optional<Finished> found;
  try {
    found = straight.go(as_given);
  } catch (const SearchSpent&) {}
  left = std::move(straight.left);
  return found;
}

}  // namespace flexframe::sim
