#include "sim/accuracy/accuracy_straight.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {
namespace {

// What an event shifts can be worth a multiple of what is told along the motion (run_scene.cpp).
constexpr double may_shift_events = 5e-4;

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

// What the motion says of the effects that are off; those that a pair of runs tells better by one where they may decide.
bool Straight::judge_effects(bool following) { return judge_deformations(following) && measure_effects(t_.options->method, following); }

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
    else if (decided(w)) leave({w.effect, w.owners, 2.0 * w.share, 2.0 * w.columns});
  }
  // Forces that are read shift with what gives way inside.
  for (const LeftOutWorth& w : run_.left_out)
    if (w.possible && w.inside > 0.5 * t_.accuracy) measured.push_back(w.effect);
  check.further = measured;
  if (measured.empty()) return effects_ <= share_of_effects * t_.accuracy;
  const NeglectCheck found = check_neglected(run_.scene, run_.effects, looser_, check);
  if (!found.untried.empty()) return false;
  for (const Neglected& n : found.found)
    if (std::find(measured.begin(), measured.end(), n.effect) != measured.end()) leave({n.effect, n.owners, n.share});
  return effects_ <= share_of_effects * t_.accuracy;
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
