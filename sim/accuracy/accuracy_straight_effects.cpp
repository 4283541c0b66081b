#include "sim/accuracy/accuracy_straight.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {
namespace {

// What an event shifts can be worth a multiple of what is told along the motion (run_scene.cpp).
constexpr double may_shift_events = 5e-4;
// CPU s that second runs may take in any case where a run is judged that may not be the last.
constexpr double least_look = 0.05;

}  // namespace

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
    if (t_.search.touches && w.possible && std::max(w.share, w.blow) > may_shift_events) return false;
    if (following && chosen_by_scene(w)) continue;
    if (w.share > 0.5 * t_.accuracy) return false;
    if (decided(w)) leave({w.effect, w.owners, w.share, w.columns});
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

void Straight::leave(const Task::Share& share) {
  effects_ += share.worth;
  shares_.push_back(share);
}

// What the motion says of the effects that are off; those that a pair of runs tells better by one where they may decide. following: forces
// wait for the run that follows vibrations (judge_forces), as one that steps over them has lost what they depend on.
bool Straight::judge_effects(bool following) {
  if (!judge_deformations(following)) return false;
  NeglectOptions check;
  check.tolerance = 10.0 * tolerance_;
  check.method = t_.options->method;
  check.floor = largest(time_);
  check.further = to_measure(following);
  if (!following)
    for (const std::string& effect : shift_forces()) check.further.push_back(effect);
  return leave_out_measured(check, looser_, least_look).has_value() && effects_ <= share_of_effects * t_.accuracy;
}

// What shifts the forces of a run that has followed its vibrations, counted in its error.
bool Straight::judge_forces(Finished& f) {
  const Histories whole = to_histories(f.results);
  NeglectOptions check;
  check.tolerance = f.loose_tolerance;
  check.method = f.method;
  check.floor = f.time;
  check.run = &whole;
  check.run_tolerance = f.setting.tolerance;
  check.run_error = f.time;
  check.confirm_above = share_of_effects * t_.accuracy;
  check.second_order = false;
  check.further = shift_forces();
  const double before = std::exchange(effects_, 0.0);
  const std::optional<std::vector<Neglected>> found = leave_out_measured(check, f.looser, least_check);
  const bool little = found && effects_ <= share_of_effects * t_.accuracy;
  count_effects(f);
  effects_ = before;
  for (const Neglected& n : found.value_or(std::vector<Neglected>())) tell_neglected(n, check.floor, f.results.statistics.notes);
  return little;
}

// What is left out, in the error of a run that did not count it.
void Straight::count_effects(Finished& f) const {
  f.effects = std::hypot(f.effects, effects_);
  f.error = std::max(std::hypot(f.error, effects_), f.time + std::hypot(f.space, f.effects));
}

// Deformations that may not be left out because events shift with them come, before a search begins that would bring them too; whether
// there were any.
bool Straight::bring_what_shifts() { return t_.search.touches && bring(may_shift_events, true); }

// Deformations that the program left out and that are worth more come on; whether there were any. What one beam has may change what the
// program decides for another (two beams in a loop whose length only one of them has to give), which then is pinned.
bool Straight::bring(double worth, bool blows) {
  bool more = false;
  for (const LeftOutWorth& w : run_.left_out) {
    if (!w.possible || std::max(w.share, blows ? w.blow : 0.0) <= worth || !decided(w)) continue;
    const std::vector<EffectState> states = t_.search.states;
    for (const EffectState& s : states)
      if (!pinned_.contains({s.owner, s.effect}) && s.effect == w.effect && by_program(s) &&
          std::find(w.owners.begin(), w.owners.end(), s.owner) != w.owners.end())
        t_.search.set_effect(s, true), pinned_.insert({s.owner, s.effect}), more = true;
  }
  return more;
}

// Of stiffening, gyroscopic terms and the like what has to be measured; what is worth little counts by what the motion says. following: as
// above.
std::vector<std::string> Straight::to_measure(bool following) {
  std::vector<std::string> out;
  for (const LeftOutWorth& w : run_.second_order) {
    // No less is told than half of what is true.
    if (following && chosen_by_scene(w)) continue;
    if (2.0 * w.share > 0.2 * t_.accuracy) out.push_back(w.effect);
    else if (decided(w)) leave({w.effect, w.owners, 2.0 * w.share, 2.0 * w.columns});
  }
  return out;
}

// Deformations that forces that are read shift with, as what gives way inside.
std::vector<std::string> Straight::shift_forces() const {
  std::vector<std::string> out;
  for (const LeftOutWorth& w : run_.left_out)
    if (w.possible && w.inside > 0.5 * t_.accuracy) out.push_back(w.effect);
  return out;
}

// The effects in check.further, by a second run each beside `base`; none where one could not be measured. least: CPU s that this may take
// in any case.
std::optional<std::vector<Neglected>> Straight::leave_out_measured(NeglectOptions check, const Histories& base, double least) {
  if (check.further.empty()) return std::vector<Neglected>();
  check.budget = std::max(check_price * run_.results.statistics.work, least);
  NeglectCheck found = check_neglected(run_.scene, run_.effects, base, check);
  if (!found.untried.empty()) return std::nullopt;
  std::erase_if(found.found,
                [&](const Neglected& n) { return std::find(check.further.begin(), check.further.end(), n.effect) == check.further.end(); });
  for (const Neglected& n : found.found) leave({n.effect, n.owners, n.share});
  return std::move(found.found);
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

}  // namespace flexframe::sim
