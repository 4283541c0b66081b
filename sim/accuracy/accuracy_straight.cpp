#include "sim/accuracy/accuracy_straight.h"
#include "sim/base/error.h"
#include "sim/base/work_clock.h"
#include "sim/run/coarse_beams.h"
#include "sim/run/few_modes.h"
#include "sim/run/judged_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace flexframe::sim {
namespace {

// Of what is left out no less than 0.4 of what is true is told (tests/trust/left_out.py).
constexpr double effects_margin = 2.5;
// Estimates of what one frame lacks were up to 1.25 times too low (linear_limit.cpp); where so much is kept too nothing is measured.
constexpr double bending_margin = 1.3, unmeasured = 1e300;
// A looser run that takes longer than so many times the run itself has lost its way (arm with a payload: 16 CPU s, five times the run);
// where runs take seconds it has to be the cheaper one that it should be.
constexpr double dearer_if_looser = 1.5, cheaper_if_looser = 0.6;

// CPU s for all of its runs, by what the first one takes: a decade of tolerance costs two to three times as much, and each run is judged by
// others. Beyond that the search begins, which does as much with fewer modes; where it may choose none it has nothing else to try.
double straight_allowance(double first, bool fewer_modes) {
  const double allowed = std::max(5.0, std::min(20.0 * first, 5.0 + 2.0 * first));
  return fewer_modes ? allowed : std::max(allowed, search_allowance(first));
}

}  // namespace

// Where a run of all coordinates is dear it is made with few modes, as many as outputs call for: those in pictures by how much of their
// sizes they move, which a loose run of the fewest tells. (Shaft of two beams with a disc, for 0.5 px: 1e-7 of the picture, which was begun
// with 104 modes and came to no end.)
void Straight::begin_with_few() {
  constexpr double loose = 1e-4, longest_look = 2.0;  // CPU s
  if (t_.search.pictures) {
    Scene scene = t_.search.with_modes(fewest_at_first, 2);
    scene.simulation.tolerance = loose;
    const double start = work_seconds();
    if (const std::optional<Histories> run = t_.search.run_within(scene, longest_look)) pictured_ = outputs_over_sizes(*run);
    looked_ = work_seconds() - start;
  }
  few_ = few_at_first();
}

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
    if (until_ > 1e299) until_ = start + straight_allowance(work_seconds() - start, t_.search.has_levels());
  } catch (const TooDear&) {
    return false;
  } catch (const SimulationError&) {
    return false;
  }
  timed_ = false;
  fine_ = to_histories(run_.results);
  pictured_ = outputs_over_sizes(fine_);
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

// What nothing above has judged: kept modes that the scene gives, elements on places that it names, bodies bent far, forms of other ends.
bool Straight::check(Finished& f) {
  SolverStatistics& s = f.results.statistics;
  const Histories whole = to_histories(f.results);
  s.error_estimate = f.error;
  if (warned(s.notes)) return false;
  ModelCheckOptions models;
  models.asked = t_.accuracy;
  models.budget = t_.search.pictures ? check_budget_of_pictures(s.work) : check_budget(s.work);
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
  for (const LinearLimit& l : limits) bent = std::max(bent, l.counts());
  const bool one_frame = std::all_of(limits.begin(), limits.end(), [](const LinearLimit& l) { return l.pieces == 1; });
  models.surely_small = one_frame && std::hypot(f.error, bending_margin * bent) <= t_.accuracy ? unmeasured : 0.25;
  // Where modes lack far more, the estimate of it is enough.
  const double before = f.error;
  if (before > 2.0 * t_.accuracy &&
      std::all_of(limits.begin(), limits.end(), [&](const LinearLimit& l) { return l.counts() < 0.5 * before; }))
    models.budget = 0.0;
  const ModelWorth worth = check_models(f.scene, run_.effects, limits, f.looser, models, s);
  bending_ = worth.bending;
  warn_of_coarse_beams(unmeasured_beams(coarse_beams(f.scene, run_.effects, f.results), f.scene, worth.measured), 0.5 * t_.accuracy,
                       s.notes);
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
  if (given_modes) warn_of_few_modes(f.scene, o, {whole, f.setting.tolerance, 0, f.time, deflection}, 0.5 * t_.accuracy, s);
  if (bending_.elements == 0) bending_.share *= bending_margin;
  f.space = std::hypot(f.space, bending_.share);
  f.error = s.error_estimate = std::hypot(f.error, bending_.share);
  return !warned(s.notes);
}

// Whether something is warned of that another setting may take away (mast of an L section, whose shear centre the model does not know: its
// search took 500 times the run and warned of the same): not a number of modes that the scene gives, which no search changes. misfits:
// eigenforms that are those of other ends, as the scene lists them, count: more of them, which is what a search has, would not fit either.
bool Straight::warned(const Notes& notes, bool misfits) const {
  const std::vector<Note>& of_scene = t_.search.warnings;
  return std::any_of(notes.all().begin(), notes.all().end(), [&](const Note& n) {
    return n.severity == Severity::warning && (misfits || !n.text.starts_with(misfit_words)) && !n.text.starts_with(unjudged_words) &&
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

Finished Straight::as_written() const {
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
  return f;
}

// Its error with these margins; none of time: what is told of it, not what a run is accepted by.
double Straight::add_up(Finished& f, double of_time, double of_space, double of_effects) const {
  const Histories thinned = at_times(fine_, looser_.times);
  const MatX effects = of_effects * left_out_by(shares_, thinned);
  return f.add_up(thinned, of_time > 0.0 ? MatX(of_time * time_) : told_, of_space * space_, effects);
}

// A run whose error is known and too large, for the case that no search comes nearer. (Rod that strikes another, asked for 0.02: a search
// of 26 CPU s in vain ended with the scene as written, 0.19 off, where 0.1 had been given a run 0.04 off.)
// by_energy: of time, what its energy says.
void Straight::keep_written(double by_energy) {
  if (!t_.written || (t_.search.has_levels() && !other_)) return;
  Finished f = as_written();
  if (add_up(f, 0.0, 1.0, 1.0) <= t_.accuracy) add_up(f, elastic_margin, space_margin_, effects_margin);  // refused for its margins
  f.error = std::hypot(f.error, by_energy), f.time = std::hypot(f.time, by_energy);
  if (f.error <= t_.accuracy || (*t_.written && (*t_.written)->error <= f.error)) return;
  f.results = run_.results;
  f.states = run_.effects;
  report_left_out(f.scene, run_.left_out, t_.accuracy, f.results.statistics);
  report_left_out(f.scene, run_.second_order, t_.accuracy, f.results.statistics);
  *t_.written = std::move(f);
}

// Pictures: the tightest run that came to its end, where the time ended before all of it was judged, with what its energy says of it. A
// search that begins anew comes no nearer than a run of seconds that misses by its margins, or whose events shift. (Arm exaggerated 20
// times for 0.3 px: 65 px told and 13 true after 30 CPU s; now 3.9 and 0.03 after 17.)
void Straight::keep_last() {
  constexpr double dear = 0.5;  // CPU s of the run
  if (few_ > 0 || !t_.search.pictures || !t_.written || fine_.columns.empty() || run_.called) return;
  if (run_.results.statistics.work < dear) return;
  t_.search.until = until_ = 1e300;
  if (timed_) {
    tolerance_ = judged_at_, looser_ = judge_;
  } else {
    tolerance_ = run_.results.statistics.tolerance, has_looser_ = false;
    judge_time(run_.scene);
    if (!timed_) return;
  }
  effects_ = 0.0;
  shares_.clear();
  for (const LeftOutWorth& w : run_.left_out)
    if (w.possible) leave({w.effect, w.owners, std::max(w.share, w.blow), w.columns});
  for (const LeftOutWorth& w : run_.second_order) leave({w.effect, w.owners, 2.0 * w.share, 2.0 * w.columns});
  judge_space();
  if (t_.search.has_levels() && !other_) return;
  Finished f = as_written();
  const bool by_margins = add_up(f, 0.0, 1.0, 1.0) <= t_.accuracy;
  keep_written(lost_);
  if (*t_.written) (*t_.written)->ends_search = by_margins || t_.search.touches;
}

std::optional<Finished> Straight::finish_as_written() {
  Finished f = as_written();
  const auto exceeds = [&](double margin, double of_effects) {
    if (!t_.search.has_levels()) margin = 1.0, of_effects = std::min(of_effects, 1.0);
    return add_up(f, margin, std::min(margin, space_margin_), of_effects) > t_.accuracy;
  };
  const bool without_effects = exceeds(elastic_margin, 0.0);
  short_of_effects_ = !without_effects && exceeds(effects_margin, effects_margin);
  short_of_margins_ = without_effects || short_of_effects_;
  add_up(f, 0.0, 1.0, 1.0);
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
  if (!out.finished) keep_written();
  return out;
}

std::optional<Finished> Straight::go(const Scene& as_given) {
  const Search search = t_.search;
  const auto tighten = [this](double last) {
    // One decade finds its looser run already there, be it that this one had none that came to an end.
    const bool decade = (has_looser_ || looser_.columns == fine_.columns) && step_ > 0.05 && step_ < half_a_decade;
    tolerance_ = std::max(1e-11, (decade ? 0.1 : step_) * last);
    if (begin_at_ < tolerance_) tolerance_ = begin_at_, has_looser_ = false;
    else if (decade) looser_ = at_times(fine_, looser_.times), has_looser_ = true;
    else has_looser_ = false;
  };
  if (few_ == 0 && t_.search.dear_as_given()) begin_with_few();
  tolerance_ = std::min(first_tolerance(), begin_at_);
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
      // A run so far from the motion calls for what its own errors look like; where the next one takes seconds it has that, not twice.
      const bool once = t_.search.pictures && next_work() > dear_if_exaggerated;
      if (by_time_ == Verdict::tighter && needed_ > far_off && !once) {
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
    if (verdict == Verdict::follow) return judge_effects(true) ? follow_vibrations(unlimited) : std::nullopt;
    if (verdict == Verdict::lost && !t_.search.smooth) return try_few(as_given, search, most_for_few());
    if (verdict == Verdict::lost) return std::nullopt;
    // Where tighter steps of all coordinates are dear, as vibrations that nothing damps come back with them, a few modes may do for less.
    if (t_.search.touches && t_.search.elastic && few_ == 0 && !tried_few_ && next_work() > dear_step) {
      tried_few_ = true;
      if (std::optional<Finished> f = try_few(as_given, t_.search, allowed_for_few())) return f;
    }
    // Where that does not do, tighter steps may.
    if (verdict == Verdict::rather_follow && may_try_following()) {
      if (std::optional<Finished> f = try_following()) return f;
      if (std::optional<Finished> f = try_few(as_given, search, few_or_try())) return f;
    }
    tighten(last);
    // One that would not come to its end is not begun.
    if (t_.search.pictures && run_.results.statistics.work > dear_run && work_seconds() + next_work() > until_) return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Finished> go_straight(Task& t, const Scene& as_given, std::optional<StraightRun>& left) {
  Straight straight(t);
  std::optional<Finished> found;
  try {
    found = straight.go(as_given);
  } catch (const SearchSpent&) {}
  try {
    if (!found) straight.keep_last();
  } catch (const SearchSpent&) {}
  left = std::move(straight.left);
  return found;
}

}  // namespace flexframe::sim
