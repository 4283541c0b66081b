// The run that keeps an asked accuracy where vibrations are followed.
//
// The difference to a looser run is all that is wrong in time, and only the modes left out are wrong in space. Jumps of loads excite all
// modes and are seen elsewhere in the mechanism, so that neither frequencies nor levels tell where modes are missing: each body is judged
// by a run with more modes in it alone, and those that lack most get them.
#include "sim/accuracy/accuracy_task.h"
#include "sim/base/error.h"
#include "sim/base/work_clock.h"
#include "sim/run/start_forces.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

constexpr double tightest = 1e-11;
// Where events shift with what a body lacks, its run with more modes tells half of it at least.
constexpr double shifted = 2.25;
// What lies beyond the next modes too, where nothing damps the vibrations: shares that fall by 1.6 a mode add as squares.
// Of stretching and twist under a force at the end it is as much again as twice the modes have brought: they fall as 1/n.
// Where a round brought what lacks down by more than such a fall does, it was bending that lacked.
constexpr double tail_undamped = 1.28, tail_stiff = 2.0, faster_than_stiff = 2.3;
// Forces at a clamp after a blow: shares of the modes fall as 1/n. Undamped they add as squares, of which a third of the modes more show a
// half; damped they count as long as all are in phase, of which g times the modes show 1 - 1/g, and in the first samples after it up to
// 1.4 times as much. (134 clamped beams whose load comes at once: true was up to 1.5 times, damped 3.5 times what tail_undamped told.)
constexpr double tail_of_forces = 2.0, after_a_blow = 1.4;
// What two loose runs may be apart in time, of what is asked, for them to tell of space at a quarter of the price.
// Nearer to what is asked than `clearly` they would tell too much (bending slider-crank at 1e-2: 8.1e-3 where 1.4e-3 is true).
// Below `surely` they may tell what is only time, and the tight run decides (disc on a shaft at 1e-3: 1.1e-3 where 4e-5 is true, and a
// search of 16 CPU s).
constexpr double loosely_judged = 0.3, clearly = 0.7, surely = 2.0;
// What a run looser than `clear` may err by in time, of what is asked: loose runs judge modes then too.
constexpr double small_in_time = 0.05, small_in_pictures = 0.12;
// The elements behind half as many modes more are twice as many with this: they err by their number's square or its fourth power.
constexpr double more_elements = 4.0 / 3.0;
// What a round of refinement is thought to bring, however little the last one did (every second mode may have no part in the motion), and
// where none is known: half as many modes more, of which what lacks falls as n^-3. Its price then: twice the one before.
constexpr double least_fall = 1.2, best_fall = 3.4, usual_growth = 2.0;
// By which the tolerance falls where time is what lacks. Below the second one the exponential method samples what oscillates
// (exponential.cpp), at three to six times the price (slider-cranks of several sizes, 3e-7 to 3e-8).
constexpr double tighter = 0.2, sampled_below = 2e-7, dear_sampled = 6.0;
// A run that samples is judged by one that does too, if that is so many times looser at least: one that does not is off by a hundred times
// as much, all of which would be told as the error of time.
constexpr double just_sampled = 0.95 * sampled_below, least_looser = 4.0;
// One that does not sample is not sure to be nearer the truth than its looser judge: of what they are apart by that much is its own, if
// both are as far off and in their own way (arm of two beams at 3e-7: half, where a third was told).
constexpr double equally_off = 0.70710678;

// What two runs with different modes are apart by, less the squares of what their errors of time may make of it. These are thought larger
// than they are: what they could hide altogether is still half there (bridge of seed 6: 3.4e-4 beside 3.0e-4 of time was taken for
// nothing, the result 1.08e-3 off where 9.0e-4 was told).
double beyond_time(double apart, double of_time) {
  constexpr double seen = 0.5;
  return std::max(seen * apart, std::sqrt(std::max(0.0, apart * apart - of_time)));
}

struct Followed {
  Task& t;
  double limit;
  Search& search = t.search;
  Setting& setting = t.setting;
  std::vector<Refinement> list = search.refinements(setting);
  Finished out;
  std::optional<Histories> here;                       // the run at the setting
  MatX time, space;                                    // errors, columns x samples
  MatX told_space;                                     // what is likely of space, where it is accepted by more; else empty
  double brought = 0.0;                                // by all modes more, a round before; 0: not known
  double worst = 0.0;                                  // of the bodies' errors of space
  double lacked = 0.0;                                 // of space, a round before; 0: not known
  double before_round = search.cpu, last_round = 0.0;  // CPU s
  double share = error_of_difference;                  // of the difference to the looser run, that is error
  bool found_again = t.without.empty();

  bool only_time = false;  // the run before had the same modes, which are judged
  bool whole = false;      // out.judged is the run at the setting: nothing is run again at the end

  Followed(Task& task, double most) : t(task), limit(most) {}
  std::optional<Histories> run_here();
  std::optional<Histories> run_within_limit();
  std::optional<Histories> run_whole();
  void let_judge();
  bool judge_all_at_once();
  std::optional<bool> judge_loosely(Search& finer, const Setting& next);
  bool judge_stiff_apart(const MatX& by_all);
  bool several() const;
  double tail(double left) const;
  MatX with_tail(double beyond, const MatX& left) const;
  void tell_space(Search& finer, const Setting& next, double beyond, const MatX& left, const MatX& of_time);
  void call_effects();
  void find_what_lacks();
  bool hopeless();
  bool too_dear_in_time();
  bool bends_too_far(double error) const;
  double looser_than(double tolerance) const;
  bool settle_time(double timely);
  void judge_space();
  double add_up(const MatX& in_time, const MatX& effects);
  double total(const MatX& in_time);
  void take_looser();
  bool add_static();
  bool refine();
};

// Effects that the vibrations ask for, by a loose run with half of the modes: the run itself, made for nothing, costs several times as
// much.
void Followed::call_effects() {
  if (std::none_of(search.states.begin(), search.states.end(), [&](const EffectState& s) { return !s.on && search.decides(s); })) return;
  const double start = work_seconds();
  SimulateOptions o = *t.options;
  o.tolerance = 10.0 * setting.tolerance;
  o.accuracy.reset();
  o.estimate_error = false;
  o.method = search.method;
  o.progress = [&](double) {
    if (work_seconds() > search.until) throw SearchSpent{};
    if (work_seconds() - start > limit) throw TooDear{};
  };
  try {
    const bool called = search.adopt(run_judged(search.with_half(setting), o, t.accuracy, false).effects);
    if (search.spread_stiff() || called) list = search.refinements(setting);
    t.drop_shares_of_what_is_on();
  } catch (const TooDear&) {
  } catch (const SimulationError&) {
    // The run itself says what there is to say.
  }
  search.cpu += work_seconds() - start;
}

// The run as a result, with what its motion says of effects; those that it asks for are on from then on.
std::optional<Histories> Followed::run_whole() {
  const double start = work_seconds();
  SimulateOptions o = *t.options;
  o.tolerance.reset();
  o.accuracy.reset();
  o.estimate_error = true;
  o.method = search.method;
  o.progress = [this, start](double at) {
    const double now = work_seconds();
    if (now > search.until) throw SearchSpent{};
    if (now - start > limit) throw TooDear{};
    if (t.options->progress) t.options->progress(at);
  };
  whole = false;
  std::optional<Histories> run;
  constexpr int most_calls = 3;
  try {
    for (int call = 0; call < most_calls && !run; ++call) {
      out.judged = run_judged(search.at(setting), o, t.accuracy, false);
      if (search.adopt(out.judged->effects)) search.spread_stiff(), list = search.refinements(setting), t.drop_shares_of_what_is_on();
      else run = to_histories(out.judged->results);
    }
  } catch (const TooDear&) {
  } catch (const SimulationError&) {}
  search.cpu += work_seconds() - start;
  whole = run.has_value();
  return run;
}

std::optional<Histories> Followed::run_within_limit() { return t.straight ? run_whole() : search.run_within(search.at(setting), limit); }

// Tighter where it fails; none where it is too dear.
std::optional<Histories> Followed::run_here() {
  for (;;) {
    std::optional<Histories> run = run_within_limit();
    if (run || limit < unlimited) return run;
    // Too loose to hold the mechanism together, perhaps.
    if (setting.tolerance <= 1e-7) return search.run(search.at(setting));
    setting.tolerance *= 0.1;
  }
}

// The tolerance of the run that judges the time of one with this tolerance.
double Followed::looser_than(double tolerance) const {
  const double ten_times = 10.0 * tolerance;
  const bool samples = t.straight && search.method == Method::exponential && ten_times >= sampled_below;
  return samples && least_looser * tolerance <= just_sampled ? just_sampled : ten_times;
}

// Lowers the tolerance until a run ten times looser, or nearly that, is `timely` near, and a run above `clear` far nearer; false where that
// is too dear.
bool Followed::settle_time(double timely) {
  for (std::optional<Histories> looser;;) {
    if (!looser) {
      out.loose_tolerance = looser_than(setting.tolerance);
      const Scene loose = search.at({setting.level, out.loose_tolerance});
      looser = search.run_within(loose, unlimited, whole && out.judged->start ? &*out.judged->start : nullptr);
      if (!looser && setting.tolerance <= tightest) looser = search.run(loose);
    }
    double step = 0.1;
    if (looser) {
      out.looser = std::move(*looser);
      here = at_times(*here, out.looser.times);
      const double looser_by = out.loose_tolerance / setting.tolerance;
      share = looser_by > 9.9 ? error_of_difference : 1.0 / (std::pow(looser_by, cautious_order) - 1.0);
      if (t.coarse.values.size() == 0) t.coarse = out.looser;
      if (t.rigid.size() == 0) t.rigid = t.left_out = MatX::Zero(out.looser.values.rows(), out.looser.values.cols());
      time = share * relative(out.looser, *here);
      const double small = search.pictures ? small_in_pictures : small_in_time;
      const double enough = setting.tolerance > 1.01 * t.clear ? std::min(small * t.accuracy, timely) : timely;
      if (largest(time) <= enough || setting.tolerance <= tightest) break;
      step = std::pow(0.25 * t.accuracy / largest(time), 1.0 / cautious_order);
    }
    const double before = setting.tolerance;
    const bool decade = t.straight && looser && (step <= 0.3 || before > 1.01 * t.clear);
    looser.reset();
    setting.tolerance = std::max(tightest, before * (decade ? 0.1 : std::clamp(step, 0.1, 0.5)));
    // One decade finds its looser run already there.
    if (decade && setting.tolerance == 0.1 * before) looser = std::move(here), out.loose_tolerance = before;
    here = run_here();
    if (!here) return false;
    if (setting.tolerance != 0.1 * before) looser.reset();
  }
  return true;
}

bool Followed::several() const {
  return std::any_of(list.begin(), list.end(), [&](const Refinement& r) { return r.body != list.front().body; });
}

// What lies beyond the next finer run too, as a multiple of what that one changes, `left` at most.
double Followed::tail(double left) const {
  const bool stiff = std::any_of(list.begin(), list.end(), [](const Refinement& r) { return r.stiff; });
  const bool falls = brought > 0.0 && left * faster_than_stiff < brought;
  const double of_one = stiff && !falls ? tail_stiff : tail_undamped;
  if (search.touches) return 3.0 * of_one;
  // Bodies pass what they lack on to each other. (Slider-crank with an elastic crank: 1.5 times what one more round changes, and 0.5 to 1.2
  // times in random ones, once errors of time are small and the crank stretches where the rod does.)
  return several() ? tail_stiff : of_one;
}

// What lacks, by what a finer run changes (columns x samples).
MatX Followed::with_tail(double beyond, const MatX& left) const {
  double growth = 2.0;  // of the finer run's modes, where that is least
  for (const Refinement& r : list)
    if (!r.stiff && r.growth > 1.0) growth = std::min(growth, r.growth);
  const double of_forces = search.undamped ? tail_of_forces : std::max(tail_of_forces, after_a_blow / (1.0 - 1.0 / growth));
  MatX lacking = beyond * left;
  for (Eigen::Index c = 0; c < lacking.rows(); ++c)
    if (converges_slowly(here->units[static_cast<size_t>(c)])) lacking.row(c) *= std::max(1.0, of_forces / beyond);
  return lacking;
}

// The same by a run as loose as the one that judged time. What both may be off in time, which has nothing to do with what modes lack, comes
// on top as squares do. None where that leaves open whether the accuracy is kept.
std::optional<bool> Followed::judge_loosely(Search& finer, const Setting& next) {
  if (search.touches) return std::nullopt;
  if (tail_stiff * largest(time) > loosely_judged * share * t.accuracy) return std::nullopt;
  const std::optional<Histories> judge = finer.run_within(finer.at({next.level, out.loose_tolerance}), unlimited);
  if (!judge) return std::nullopt;
  const MatX left = relative(*judge, out.looser).cwiseAbs(), of_time = time.cwiseAbs() / share;
  const double beyond = tail(largest(left));
  space = with_tail(beyond, (left.cwiseAbs2() - of_time.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt());
  const double seen = total(0.3 * time);
  const bool lacks = seen > t.accuracy;
  if (lacks && seen < surely * t.accuracy) return std::nullopt;
  space = with_tail(beyond, (left.cwiseAbs2() + of_time.cwiseAbs2()).cwiseSqrt());
  if (!lacks && total(time) > clearly * t.accuracy) return std::nullopt;
  brought = largest(left);
  if (!lacks) tell_space(finer, next, beyond, left, of_time);
  return !lacks;
}

// Of what two loose runs are apart by most may be time: it is accepted by all of that and told as what is left, three tenths at least.
// Where a run costs little a tight one tells (a crank's rod: 2.0e-4 was told where 7e-7 is true). left, of_time: differences of the loose
// runs and what they may be off in time, no signs.
void Followed::tell_space(Search& finer, const Setting& next, double beyond, const MatX& left, const MatX& of_time) {
  constexpr double cheap = 0.015, hidden = 0.3;  // CPU s
  const std::optional<Histories> tight =
      here->statistics.work <= cheap ? finer.run_within(finer.at(next), 10.0 * cheap) : std::optional<Histories>();
  if (tight && tight->columns == here->columns) told_space = with_tail(beyond, relative(*tight, *here).cwiseAbs());
  else told_space = with_tail(beyond, (left.cwiseAbs2() - of_time.cwiseAbs2()).cwiseMax(hidden * hidden * left.cwiseAbs2()).cwiseSqrt());
}

// The first run that has kept its time is judged in space though the search ends meanwhile: runs of known price, without which it was made
// for nothing. (Arm on a driven one, exaggerated five times for 0.2 px: 5 CPU s ended before its judge, and a search of 14 more in vain.)
void Followed::let_judge() {
  constexpr double judge = 4.0, longest = 8.0;  // times as long as the run; CPU s
  search.until = std::max(search.until, work_seconds() + std::min(judge * here->statistics.work, longest));
}

// One run with more modes of every kind in all bodies tells what there is to tell; false where it tells too much.
bool Followed::judge_all_at_once() {
  space = MatX::Zero(time.rows(), time.cols());
  told_space.resize(0, 0);
  if (list.empty()) return total(time) <= t.accuracy;  // what the scene gives is judged by twice of it, at the end
  Search finer = search;
  Setting next = setting;
  finer.refine_all(list, next);
  finer.fineness *= more_elements;
  if (const std::optional<bool> kept = judge_loosely(finer, next)) {
    search.cpu = finer.cpu;
    return *kept;
  }
  const std::optional<Histories> judge = finer.run_within(finer.at(next), unlimited);
  search.cpu = finer.cpu;
  if (!judge) {
    space = MatX::Constant(time.rows(), time.cols(), 2.0 * t.accuracy);
    return false;
  }
  const MatX left = relative(*judge, *here);
  const double of_space = beyond_time(largest(left), 2.0 * std::pow(largest(time), 2));
  const MatX by_all = of_space > 0.0 ? MatX(left * (of_space / largest(left))) : MatX::Zero(time.rows(), time.cols());
  const double beyond = tail(largest(left));
  space = with_tail(beyond, by_all);
  brought = largest(left);
  if (total(time) <= t.accuracy) return true;
  return !several() && !search.touches && beyond > tail_undamped && judge_stiff_apart(by_all);
}

// What stretching and twist lack falls slowly, but of one body it is a part only of what all modes more change: a loose run with more of
// these alone tells which, with all that both runs may be off in time. Whether the accuracy is kept by that.
bool Followed::judge_stiff_apart(const MatX& by_all) {
  const MatX slow = space;
  space = with_tail(tail_undamped, by_all);
  if (total(time) <= t.accuracy) {
    Search finer = search;
    Setting next = setting;
    for (const Refinement& r : list)
      if (r.stiff) finer.refine(r, next);
    next.tolerance = out.loose_tolerance;
    const std::optional<Histories> judge = finer.run_within(finer.at(next), unlimited);
    search.cpu = finer.cpu;
    if (judge) {
      const MatX of_stiff = relative(*judge, out.looser).cwiseAbs() + time.cwiseAbs() / share;
      space = with_tail(tail_undamped, by_all.cwiseAbs()) + (tail_stiff - tail_undamped) * of_stiff;
      if (total(time) <= t.accuracy) return true;
    }
  }
  space = slow;
  return false;
}

// Which bodies lack modes: runs as loose as the one that judges time are enough to tell, where their errors of time do not hide it.
void Followed::find_what_lacks() {
  const bool hidden = largest(time) / share > 0.3 * brought;
  worst = 0.0;
  for (Refinement& r : list) {
    if (list.size() > 1) {
      Search finer = search;
      Setting next = setting;
      r.growth = finer.refine(r, next);
      if (!hidden) next.tolerance = out.loose_tolerance;
      const std::optional<Histories> judge = finer.run_within(finer.at(next), unlimited);
      search.cpu = finer.cpu;
      r.left = judge ? apart(*judge, hidden ? *here : out.looser) : std::max(largest(space), r.before);
    } else {
      r.left = largest(space);
    }
    worst = std::max(worst, r.error());
  }
}

// Whether the search's time will not do, by how fast rounds have brought what lacks down and by what they cost. What time takes is not left
// for modes: tighter steps cost too.
bool Followed::hopeless() {
  const double spent = search.cpu - before_round, lacks = largest(space);
  const double fell = lacked > 0.0 ? std::max(least_fall, lacked / std::max(lacks, 1e-300)) : best_fall;
  const double grew = last_round > 0.0 ? std::max(1.0, spent / last_round) : usual_growth;
  before_round = search.cpu, lacked = lacks, last_round = spent;
  constexpr double least_left = 0.1;
  const double left = std::max(least_left * t.accuracy, t.accuracy - largest(time));
  const double rounds = std::ceil(std::log(std::max(1.0, lacks / left)) / std::log(fell));
  double price = 0.0, next = spent;
  for (int k = 0; k < static_cast<int>(rounds); ++k) price += next *= grew;
  return work_seconds() + price > search.until;
}

// Whether nothing but tighter steps is missing, and these take longer than there is time for.
bool Followed::too_dear_in_time() {
  if (total(0.3 * time) > t.accuracy || total(time) <= t.accuracy) return false;
  const double next = tighter * setting.tolerance;
  const double factor = next < sampled_below && setting.tolerance >= sampled_below ? dear_sampled : usual_growth;
  if (work_seconds() + factor * here->statistics.work <= search.until) return false;
  out.unreached = "; steps that follow its vibrations so closely would take too long: request less accuracy, or remove this output";
  return true;
}

// Whether more modes in one frame would not do, and what they lack, of an error of so much, is little beside that.
bool Followed::bends_too_far(double error) const {
  return out.judged && std::any_of(out.judged->limits.begin(), out.judged->limits.end(),
                                   [&](const LinearLimit& l) { return l.counts() > std::max(2.0 * t.accuracy, 0.5 * error); });
}

void Followed::judge_space() {
  MatX squares = MatX::Zero(time.rows(), time.cols());  // bodies vibrate at frequencies of their own
  worst = 0.0;
  for (Refinement& r : list) {
    Search finer = search;
    Setting next = setting;
    r.growth = finer.refine(r, next);
    const std::optional<Histories> judge = finer.run_within(finer.at(next), unlimited);
    search.cpu = finer.cpu;
    if (!judge) {
      // Nobody knows: it counts as what keeps the accuracy from being claimed.
      squares.array() += std::pow(std::max(2.0 * t.accuracy, r.before), 2);
      continue;
    }
    const MatX left = relative(*judge, *here);
    // Both runs bring their errors of time, which have nothing to do with each other where modes vibrate; volumes that turn far are wrong
    // in the same way in both (a cantilever let go under 40 m/s^2: 3.0e-3 told where 1.2e-2 was true).
    const double of_time = r.body ? 2.0 * std::pow(largest(time), 2) : 0.0;
    r.left = beyond_time(largest(left), of_time);
    if (r.left > 0.0) squares += (left * (r.error() / largest(left))).cwiseAbs2();
    worst = std::max(worst, r.error());
  }
  space = squares.cwiseSqrt();
  // After a contact or a stop the next one comes at another time: modes do not add up then, and two runs may differ by less than either is
  // wrong (a flap on a stop: half of what was true was told).
  if (search.touches) space *= shifted;
}

double Followed::add_up(const MatX& in_time, const MatX& effects) {
  const bool may_not_fall = t.straight && search.method == Method::exponential && setting.tolerance >= sampled_below;
  return out.add_up(*here, in_time, space, effects, may_not_fall ? equally_off / share : 0.0);
}

// The error with what is left out, which is found again at this setting where it decides.
double Followed::total(const MatX& in_time) {
  if (!found_again && add_up(in_time, t.rigid) <= t.accuracy && add_up(in_time, t.rigid + t.left_out) > t.accuracy) {
    t.find_left_out(setting, *here, dearest * here->statistics.work);
    found_again = true;
  }
  return add_up(in_time, t.rigid + t.left_out);
}

// A looser run may do as well, if its difference to this one is small enough: the one that has judged time, ten times looser; else one or
// two whose difference should be, between the two.
void Followed::take_looser() {
  const double tight = setting.tolerance;
  // This one is not the truth: what it is wrong by comes on top.
  const MatX of_this = time.cwiseAbs(), of_looser = relative(out.looser, *here).cwiseAbs();
  const auto keeps = [&](const MatX& apart_by) { return total(apart_by + of_this) <= t.accuracy; };
  if (keeps(of_looser)) {
    setting.tolerance = 10.0 * tight;
    return;
  }
  int tries = 2;
  for (const double factor : {6.0, 4.0, 2.5}) {
    if (!keeps((factor - 1.0) / 9.0 * of_looser)) continue;
    if (tries-- == 0) break;
    const std::optional<Histories> other = search.run_within(search.at({setting.level, factor * tight}), 2.0 * here->statistics.work);
    if (!other || 10 * other->statistics.evaluations >= 9 * here->statistics.evaluations) break;
    if (!keeps(relative(*other, *here).cwiseAbs())) continue;
    setting.tolerance = factor * tight;
    return;
  }
  total(of_this);
}

// Where nothing but stretching or twist lacks, forces at the ends have the shape that they make beside the modes, of which each brings a
// part of it that falls as 1/n only (rod pulled at once: 32 modes for 6e-3). Whether there is a body that did not have it.
bool Followed::add_static() {
  if (!std::all_of(list.begin(), list.end(), [&](const Refinement& r) { return r.stiff ? r.body.has_value() : r.error() < 0.1 * worst; }))
    return false;
  bool more = false;
  for (const Refinement& r : list)
    if (r.stiff && r.error() >= 0.5 * worst) more = search.with_static.insert(*r.body).second || more;
  return more;
}

// Tighter or with more modes, whichever lacks; false where neither is possible, and what there is has to do.
bool Followed::refine() {
  const Search before = search;
  const Setting at_before = setting;
  if ((t.straight ? largest(space) : worst) <= 0.5 * largest(time) || total(0.3 * time) <= t.accuracy) {
    if (setting.tolerance <= tightest) return false;
    setting.tolerance *= tighter;
    only_time = total(0.3 * time) <= t.accuracy;  // what space takes is known
  } else {
    only_time = false;
    t.coarse = *here;
    const bool added = add_static();
    for (Refinement& r : list) {
      if (added || r.error() < 0.5 * worst) continue;
      r.grown = search.refine(r, setting);
      r.before = r.left;
    }
  }
  std::optional<Histories> next = run_within_limit();
  if (!next && (t.straight || limit == unlimited)) {
    // Finer than the bodies can be, for one.
    const double spent = search.cpu;
    search = before;
    search.cpu = spent;
    setting = at_before;
    whole = t.straight;
    return false;
  }
  here = std::move(next);
  return true;
}

}  // namespace

namespace {

// What run_itself would fill in, from the run that is there, of which `judged` keeps all but the histories: these are megabytes.
void take_whole(const Task& t, const Setting& setting, Finished& out) {
  out.scene = t.search.at(setting);
  out.results = std::move(out.judged->results);
  out.judged->results = {};
  out.judged->results.statistics = out.results.statistics;
  out.limits = out.judged->limits;
  out.setting = setting;
  out.method = t.search.method;
  out.described = t.search.describe(setting);
  out.chosen = t.chosen;
}

}  // namespace

std::optional<Finished> finish_followed(Task& t, double limit) {
  Followed f(t, limit);
  double lacking = 10.0 * t.accuracy;  // of space
  Finished last;                       // judged
  try {
    if (t.straight) f.call_effects();
    f.here = f.run_here();
    for (int round = 0; f.here; ++round) {
      // While modes lack, time need not be better than they are.
      if (!f.settle_time(std::max(0.35 * t.accuracy, 0.1 * lacking))) {
        // Too dear: the one before, of which it is known how far it is off, is as near as this way comes.
        if (!t.straight || !last.judged || last.error < 0.0) return std::nullopt;
        take_whole(t, last.setting, last);
        last.coarse = t.coarse;
        return last;
      }
      if (round == 0 && t.straight) f.let_judge();
      if (!t.straight) f.judge_space();
      else if (!f.only_time && !f.judge_all_at_once() && f.total(0.3 * f.time) > t.accuracy) {
        const double error = f.total(f.time);
        if (f.hopeless() || f.bends_too_far(error)) break;
        f.find_what_lacks();
      }
      lacking = largest(f.space);
      if (f.total(f.time) <= t.accuracy) {
        if (!t.straight) f.take_looser();
        break;
      }
      if (t.straight && f.too_dear_in_time()) break;
      last = f.out;
      last.setting = f.setting;
      if (round == most_rounds || !f.refine()) break;
    }
  } catch (const SearchSpent&) {
    // The last one that was judged, made in full: a run of known price.
    if (last.error < 0.0) throw;
    t.search.until = 1e300;
    if (last.judged) take_whole(t, last.setting, last);
    else run_itself(t, last.setting, unlimited, last);
    last.coarse = t.coarse;
    t.keep(last);
    throw;
  }
  if (!f.here) return std::nullopt;
  if (f.told_space.cols() == f.time.cols() && f.told_space.size() > 0 && f.out.error <= t.accuracy) {
    f.space = f.told_space;
    f.total(f.time);
  }

  if (f.whole) {
    take_whole(t, f.setting, f.out);
  } else {
    const double loose = f.out.loose_tolerance;
    // What was found is not lost where the search's time ends now: a run of known price.
    const double until = std::exchange(t.search.until, 1e300);
    run_itself(t, f.setting, unlimited, f.out);
    t.search.until = until;
    f.out.loose_tolerance = loose;  // that of the run which is there
  }
  f.out.coarse = t.coarse;
  // One that keeps the accuracy is wanted as the result alone.
  if (t.straight && t.nearest && f.out.error <= t.accuracy) t.nearest->reset();
  else t.keep(f.out);
  return std::move(f.out);
}

}  // namespace flexframe::sim
