#include "sim/accuracy/accuracy_straight.h"
#include "sim/base/error.h"
#include "sim/base/work_clock.h"
#include "sim/run/judged_run.h"
#include "sim/run/start_forces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace flexframe::sim {
namespace {

// How far the nearest run of those that follow vibrations may be off, in what is asked, at the end of their time: a round brings a third of
// that for twice the price. And how far one may be that a search would still bring there.
constexpr double surely_far = 5.0, within_reach = 2.0;
// CPU s for few modes where events shift with tighter steps.
constexpr double few_allowance = 8.0;
// The same where vibrations are followed first, as a multiple of a loose run of the fewest modes: the run and those that judge it take
// that. (Three driven joints and a fore-arm exaggerated 1000 times for 1 px: 5 CPU s; ended after 3 a search of 17 CPU s came no nearer
// than 2.8 px.)
constexpr double loose_looks = 25.0, longest_first = 10.0;

// Whether most of the error is what forces or accelerations lack of modes, of which a search with more of them brings hardly anything.
// (Load that comes at once on a clamped beam, its section force asked for 8e-2: 28 CPU s, and nothing nearer than 8.6e-2.)
bool lacks_in_forces(const Finished& f) {
  const auto at = std::find(f.looser.columns.begin(), f.looser.columns.end(), f.column);
  return at != f.looser.columns.end() && converges_slowly(f.looser.units[static_cast<size_t>(at - f.looser.columns.begin())]) &&
         f.space > 0.5 * f.error;
}

}  // namespace

// Vibrations that have to be followed, within so many CPU s: exact for linear ones, with as many modes as convergence asks for. What a
// beam's eigenmodes beyond the n-th bring to its ends falls as n^-3 at least (beta^-4, times the tangent that it is measured from).
std::optional<Finished> Straight::followed(double within) const {
  Task task = t_;
  task.straight = true;
  task.search.method = Method::exponential;
  const double asked = this->asked();
  task.search.accuracy = asked;
  const bool slow = fine_.units.empty() ? t_.search.reads_forces : std::any_of(fine_.units.begin(), fine_.units.end(), converges_slowly);
  // Of several bodies the stiffer ones get few modes.
  int bodies = 0;
  for (size_t b = 0; b < t_.search.scene().bodies.size(); ++b) bodies += t_.search.chooses(b);
  const double modes = (slow || (bodies > 1 && pictured_ >= 1.0) ? 1.5 : 0.7) * std::pow(asked, -1.0 / 3.0);
  // Two modes of stretching for 5e-3, four for 1e-3: what bodies pass on to each other along their axes rings as long as bending does
  // (slider-crank: 2.2e-3 and 9e-4 off).
  constexpr double two_stiff = 4e-3;
  if (slow || (bodies > 1 && asked < two_stiff)) task.search.stiff_at_first *= 2;
  // More than so many at first are judged for seconds where fewer tell that it is hopeless (slider-crank at 5e-4).
  constexpr double most_at_first = 16.0;
  // Where rates decay too, steps cost what the fastest vibration asks for, whatever the tolerance.
  const double tolerance = t_.search.undamped ? 3e-4 * asked : std::min(3e-4 * asked, 1e-5 * std::sqrt(asked));
  // Where something stretches or twists, which sets the steps, the exponential method costs little more down to this (slider-crank, 1e-4 to
  // 3e-7: 0.11 to 0.19 CPU s), and errors of time do not hide what modes lack. Bending alone takes seven times the steps for it.
  // Below 2e-7 it samples what oscillates, at a multiple of the price: an accuracy of 1e-3 stays just above that.
  constexpr double free_at_least = 2.1e-7;
  const double nearly_free = std::clamp(1.5e-4 * asked, free_at_least, 3e-7);
  const bool stiff = std::any_of(t_.search.states.begin(), t_.search.states.end(), [&](const EffectState& s) {
    return (s.effect == "axial" || s.effect == "torsion") && (s.on || (s.possible && t_.search.decides(s)));
  });
  const double clear = stiff ? std::min(tolerance, std::max(nearly_free, 3e-5 * asked)) : tolerance;
  // Where each mode costs that much, rounds from few of them on cost less than one with too many. What is damped far has fast modes that
  // follow their loads, for which static shapes stand, and decays that set the steps (geared arm at 1e-3: two modes 5e-5 off in 0.002 CPU
  // s, sixteen 0.09).
  constexpr double few_at_first = 2.0;
  // So do those of scenes whose run of all coordinates is dear: eight modes of each half of a rotor in space make 40 times as dear a run as
  // two, which do (1e-2: 5.9 and 0.8 CPU s in all; 1e-3, where sixteen came to no end: 15 and 1.2).
  constexpr double dear_in_all = 0.3;  // CPU s
  const bool few = few_ > 0 || !t_.search.rings || run_.results.statistics.work > dear_in_all;
  // Of what is damped a run ten times looser may do: its own looser one tells, for a third of its price. What rings undamped is off by
  // more, but for a tenth (pendulum, slider-crank at 1e-3: tried in vain, a quarter of the run's price), what samples by far less.
  constexpr double a_tenth = 0.05;
  task.clear = std::clamp(clear, 1e-10, 1e-4);
  // What is exaggerated in pictures is asked for more than what it moves by: there one that just does not sample is tried first, as it may
  // be far nearer than such accuracies take (arm of the template for 1 px: 0.4 CPU s a run in place of 0.8).
  const bool looser = !t_.search.undamped ? task.clear >= free_at_least || exaggerated() : task.clear >= free_at_least && asked >= a_tenth;
  const double start = looser ? std::clamp(10.0 * task.clear, free_at_least, 1e-4) : task.clear;
  task.setting = {Search::level_for_modes(few ? few_at_first : std::min(modes, most_at_first)), start};
  // However stiff, a body may carry what makes it bend, and no judge would see that it is rigid (three welded beams in space, the shortest
  // rigid: 0.53 of the range, told as 7e-4).
  for (const std::string& name : task.search.rigid_at(task.setting)) task.search.flexible.insert(name);
  task.coarse = task.loose = looser_;
  task.rigid = MatX::Zero(looser_.values.rows(), looser_.values.cols());
  task.left_out = left_out_by(shares_, looser_);
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
  if (!judge_deformations(true) || !judge_forces(*f)) return std::nullopt;
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
  if (f->error > t_.accuracy && few_ > 0 && f->error <= within_reach * t_.accuracy && !lacks_in_forces(*f)) return std::nullopt;
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

double Straight::allowed_to_follow() const {
  if (few_ > 0) return shortest;
  // What is exaggerated is asked for so much that the other ways are decades of tighter steps and a search.
  constexpr double least = 0.3, least_exaggerated = 1.5;
  return t_.search.rings ? std::max(exaggerated() ? least_exaggerated : least, run_.results.statistics.work) : allowed_to_try();
}

// Once; where no search could do with fewer modes, again for several times as long, as the steps over vibrations have become that dear.
// (Damped spatial loop of elastic links, asked for 1e-2: 0.14 CPU s beside a run at 1e-3 were too few, and a search of 23 CPU s left it
// 0.18 off; the method takes 1.4 CPU s.)
bool Straight::may_try_following() const {
  constexpr double longer = 3.0;
  return !tried_ || (!t_.search.has_levels() && allowed_to_follow() > longer * tried_for_);
}

// Follows them for a while; where that does not keep the accuracy all is as it was before.
std::optional<Finished> Straight::try_following() {
  tried_ = true;
  tried_for_ = allowed_to_follow();
  // What is damped far may have decays so fast that the method takes a step for each: tighter steps of an implicit one are the other way.
  const double begun = work_seconds();
  const JudgedRun stepped = run_;
  const Search search = t_.search;
  if (judge_effects(true))
    if (std::optional<Finished> f = follow_vibrations(tried_for_)) {
      const bool slowly = search.undamped && f->error > t_.accuracy && lacks_in_forces(*f);
      constexpr double more_modes = 10.0;  // times as long: less than a search
      if (std::optional<Finished> more = slowly ? follow_vibrations(more_modes * tried_for_) : std::nullopt; more && more->error < f->error)
        f = std::move(more);
      if (slowly || f->error <= t_.accuracy) return f;
    }
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
  std::optional<Finished> f = follow_vibrations(std::clamp(loose_looks * looked_, shortest, longest_first));
  const auto ends = [&] { return f->error <= t_.accuracy || lacks_in_forces(*f); };
  if (f && ends()) {
    NeglectOptions check;
    check.tolerance = f->loose_tolerance;
    check.method = f->method;
    check.floor = f->time;
    check.further = to_measure(true);
    if (leave_out_measured(check, f->looser, least_check) && effects_ <= share_of_effects * t_.accuracy) {
      count_effects(*f);
      if (ends()) {
        f->results.statistics.error_estimate = f->error;
        return f;
      }
    }
  }
  run_ = {}, effects_ = 0.0, shares_.clear();
  t_.search = search;
  return std::nullopt;
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
  few.pictured_ = pictured_;
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

}  // namespace flexframe::sim
