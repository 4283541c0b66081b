#include "sim/accuracy/accuracy.h"

#include "sim/accuracy/accuracy_task.h"
#include "sim/base/cpu_clock.h"
#include "sim/run/across_plane.h"
#include "sim/run/coarse_beams.h"
#include "sim/run/few_modes.h"
#include "sim/run/held_warping.h"
#include "sim/run/idle_bending.h"
#include "sim/run/missing_stiffening.h"
#include "sim/run/missing_works.h"
#include "sim/run/run_scene.h"
#include "sim/run/time_error.h"
#include "sim/run/work_budget.h"
#include "sim/run/zero_displacements.h"
#include "sim/start/make_system.h"
#include "sim/time/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

// Which of two runs to take: the cheaper one of those that keep the accuracy, or what comes nearer to it.
bool better(double accuracy, const std::optional<Finished>& a, const std::optional<Finished>& b) {
  if (!a || !b) return a.has_value();
  const bool kept = b->error <= accuracy;
  if ((a->error <= accuracy) != kept) return !kept;
  return kept ? a->work() < b->work() : a->error < b->error;
}

// Effects that are worth so much that they count, and so little that they may be left out: the cheaper way is taken. With them the run is
// tried for as long as it is the cheaper one.
std::optional<Finished> settle_open(Task& t, const std::vector<Item>& open, double limit) {
  Task with = t;
  bool off = false;
  for (const Item& item : open) {
    for (const EffectState& s : item.members)
      if (s.on) t.search.set_effect(s, false), off = true;
    t.leave_out(item.members, item.share);
    t.chosen.push_back(fmt::format("{} left out (influence {:.1g})", item.name(), item.worth));
    for (const EffectState& s : item.members) with.search.set_effect(s, true);
    with.chosen.push_back(fmt::format("{} on (influence {:.1g})", item.name(), item.worth));
  }
  if (off) t.run_below();
  std::optional<Finished> found = finish(t, limit);
  if (open.empty()) return found;
  const bool kept = found && found->error <= t.accuracy;
  with.search.cpu = t.search.cpu;
  if (kept) limit = found->work();
  std::optional<Finished> other;
  try {
    if (kept) {
      std::optional<Histories> coarse = with.search.run_within(with.search.at(with.below()), limit);
      if (coarse) with.coarse = std::move(*coarse), other = finish(with, limit);
    } else {
      settle_time(with);
      other = finish(with, limit);
    }
  } catch (const SimulationError&) {
    // With them the scene cannot be simulated.
  }
  if (better(t.accuracy, other, found)) {
    with.search.cpu += found ? found->work() : 0.0;
    t = std::move(with);
    return other;
  }
  t.search.cpu = with.search.cpu + (other ? other->work() : 0.0);
  return found;
}

// A way to the accuracy before the run itself, and effects that are left to decide there.
struct Way {
  Task task;
  std::vector<Item> open;
};

// All ways that keep the accuracy at the coarse level.
std::vector<Way> find_ways(Task t) {
  std::vector<Task> tasks;
  settle_time(t, &tasks);
  tasks.insert(tasks.begin(), std::move(t));
  std::vector<Way> ways;
  double spent = tasks.front().search.cpu;
  for (Task& task : tasks) {
    task.search.cpu = spent;
    task.rigid = task.left_out = MatX::Zero(task.coarse.values.rows(), task.coarse.values.cols());
    try {
      settle_rigid(task);
      std::vector<Item> open = settle_effects(task);
      spent = task.search.cpu;
      ways.push_back({std::move(task), std::move(open)});
    } catch (const SimulationError&) {
      if (ways.empty() && &task == &tasks.back()) throw;
    }
  }
  for (Way& way : ways) way.task.search.cpu = spent;
  return ways;
}

// What is cheap at the coarse level may be dear with more modes: all ways are gone in runs of a limited length, which grows until one comes
// to the end; the others may be cheaper still.
Finished take_cheapest(const std::vector<Way>& ways, Task& taken) {
  double spent = ways.front().task.search.cpu, limit = unlimited;
  for (const Way& way : ways) limit = std::min(limit, 0.01 + 10.0 * way.task.coarse.statistics.work);
  std::optional<Finished> found;
  const auto go = [&](const Way& way, double longest) {
    Task task = way.task;
    task.search.cpu = spent;
    std::optional<Finished> one;
    try {
      one = settle_open(task, way.open, longest);
    } catch (const SimulationError&) {
      if (longest == unlimited) throw;
    }
    spent = task.search.cpu + (one ? one->work() : 0.0);
    if (!better(task.accuracy, one, found)) return;
    found = std::move(one);
    taken = std::move(task);
  };
  constexpr int most_limits = 8;
  for (int k = 0; k < most_limits && ways.size() > 1 && !found; ++k, limit *= 4.0)
    for (const Way& way : ways) go(way, found && found->error <= way.task.accuracy ? found->work() : limit);
  if (!found) go(ways.front(), unlimited);
  taken.search.cpu = spent - found->work();
  return std::move(*found);
}

// CPU time that a search may take where no run tells.
constexpr double unknown_allowance = 30.0;
// And at least for the scene as written where it finds nothing, beside what it took itself.
constexpr double least_plain_budget = 15.0;
// A run as the scene stands is not waited for longer: one of few modes that follows vibrations takes a hundredth of it (arm with a payload:
// 15 and 6 CPU s for two runs as written of dirk, 3 for the 40 runs of the search).
constexpr double longest_as_given = 4.0;
// How much finer than a beam's the runs are that judge models: a beam that bends too far for a third of the asked error is made of volumes.
constexpr double bending_share = 1.0 / 3.0;
// CPU s for that at least: a model that does not fit costs a whole search, which ends with a warning.
constexpr double least_model_budget = 4.0;

// CPU s of a search that nobody asks about, however short the run is.
constexpr double dear_search = 0.25;

// The scene as it stands, at the default tolerance: what the search is measured against, and what is taken where it finds nothing better.
struct AsGiven {
  std::optional<Finished> run;
  std::optional<Histories> loose;
  double time = 0.0;  // error of time
};

AsGiven run_as_given(Task& t) {
  AsGiven out;
  Scene scene = t.search.scene();
  SimulateOptions o = *t.options;
  o.tolerance.reset();
  o.estimate_error = false;
  const double start = work_seconds();
  o.progress = [&t, start](double time) {
    if (work_seconds() - start > longest_as_given) throw TooDear{};
    if (t.options->progress) t.options->progress(time);
  };
  try {
    Finished f;
    f.scene = scene;
    f.results = run_for_check(scene, o, f.limits);
    f.method = t.options->method;
    f.setting.tolerance = default_tolerance;
    f.loose_tolerance = 10.0 * default_tolerance;
    f.described.push_back(fmt::format("the scene as written, tolerance {:.0e}", default_tolerance));
    out.run = std::move(f);
    scene.simulation.tolerance = 10.0 * default_tolerance;
    out.loose = t.search.run_within(scene, std::max(1.0, 3.0 * out.run->work()));
    if (out.loose) out.time = error_of_difference * apart(*out.loose, to_histories(out.run->results));
  } catch (const TooDear&) {
  } catch (const SimulationError&) {}
  t.search.cpu += work_seconds() - start;
  return out;
}

// The same from runs that are there.
AsGiven given_by(const StraightRun& left, const SimulateOptions& options) {
  AsGiven out;
  Finished f;
  f.scene = left.as_run;
  f.scene.simulation.accuracy.reset();
  f.scene.simulation.tolerance = left.tolerance;
  f.results = left.run.results;
  f.limits = left.run.limits;
  f.method = options.method;
  f.setting.tolerance = left.tolerance;
  f.loose_tolerance = 10.0 * left.tolerance;
  f.described = left.described;
  out.run = std::move(f);
  out.loose = left.looser;
  out.time = left.time;
  return out;
}

double together(const std::vector<LeftOutWorth>& left_out) {
  double out = 0.0;
  for (const LeftOutWorth& w : left_out) out += w.share;
  return out;
}

// Beams whose own models keep a run from the accuracy become richer ones, if all outputs can be kept: bent too far for one frame, or in
// forms of other ends.
std::optional<Scene> with_fit_models(const Task& t, const AsGiven& given) {
  if (!given.run || !given.loose) return std::nullopt;
  ModelCheckOptions check;
  check.asked = bending_share * t.accuracy;
  check.budget = std::max(least_model_budget, check_budget(given.run->work()));
  const Histories whole = to_histories(given.run->results);
  check.run.tolerance = given.run->loose_tolerance;
  check.run.floor = 3.0 * given.time;
  check.run.method = t.options->method;
  check.run.run = &whole;
  check.run.run_tolerance = given.run->setting.tolerance;
  check.run.run_error = given.time;
  Scene scene = t.search.scene();  // with all of its coordinates
  scene.simulation.tolerance = given.run->setting.tolerance;
  return with_richer_models(scene, t.search.states, given.run->limits, *given.loose, check);
}

// The scene as it stands, judged: by a looser run in time, by one of half the elements, modes or volumes in space. (A third of what these
// change in forces too: strip let go, 9.8e-4 of its clamp's force where 3.6e-3 is true.)
std::optional<Finished> judged_as_given(Task& t, AsGiven& given) {
  if (!given.run || !given.loose) return std::nullopt;
  Finished& f = *given.run;
  const Histories fine = at_times(to_histories(f.results), given.loose->times);
  const MatX time = error_of_difference * relative(*given.loose, fine);
  MatX space = MatX::Zero(time.rows(), time.cols());
  if (const std::optional<Scene> half = t.search.coarser()) {
    const std::optional<Histories> coarse = t.search.run_within(*half, std::max(1.0, 3.0 * f.work()));
    if (coarse && coarse->columns == fine.columns && coarse->times.size() == fine.times.size()) {
      space = relative(*coarse, fine);
      for (Eigen::Index c = 0; c < space.rows(); ++c) space.row(c) *= of_kind(fine.units[c], by_half(t.search.fewest()));
    } else space.setConstant(2.0 * t.accuracy);  // nobody knows
  }
  f.looser = *given.loose;
  f.coarse = *given.loose;
  f.add_up(fine, time, space, MatX::Zero(time.rows(), time.cols()));
  f.count_start(t.search, fine);
  return f;
}

// What the search finds in its time, none where it finds nothing.
std::optional<Finished> found_by_search(Task& t) {
  constexpr int coarsest = 1, most_levels = 4;
  for (int level = coarsest; level < coarsest + most_levels; ++level) {
    t.setting = {level, std::clamp(0.1 * t.accuracy, 1e-11, 1e-3)};
    try {
      Task taken = t;
      Finished found = take_cheapest(find_ways(taken), taken);
      t = std::move(taken);
      return found;
    } catch (const SearchSpent&) {
      break;
    } catch (const SimulationError&) {
      // So few modes or elements cannot carry the motion, perhaps.
      if (!t.search.has_levels()) break;
    }
  }
  return *t.nearest;
}

// What bending in one frame is worth.
double check_result(const Task& t, const Finished& found, double accuracy, Results& results) {
  SolverStatistics& s = results.statistics;
  NeglectOptions check;
  check.tolerance = found.loose_tolerance;
  const Histories whole = to_histories(results);
  check.floor = std::max(found.time, apart(found.looser, whole));
  check.budget = std::max(check_price * s.work, least_check);
  check.method = found.method;
  check.run = &whole;
  check.run_tolerance = found.setting.tolerance;
  check.run_error = found.time;  // both runs of a pair have the same modes
  check.deformations = true;
  report_neglected(found.scene, t.search.states, found.looser, check, accuracy, s);
  // Volumes that the search chose were judged by a few more of them, all beams at once: where each still bends far, twice as many tell.
  const std::vector<LinearLimit>& limits = found.limits;
  // Of one that is warned of in any case the models are not worth as much as it took.
  constexpr double in_all = 8.0;  // CPU s
  const double budget = found.ends_search   ? std::max(0.0, in_all - s.work)
                        : t.search.pictures ? check_budget_of_pictures(s.work)
                                            : check_budget(s.work);
  ModelCheckOptions models{accuracy, budget, check, {}};
  for (size_t b = 0; b < found.scene.bodies.size(); ++b)
    if (std::holds_alternative<BeamDef>(found.scene.bodies[b].kind) && !t.search.chooses(b)) models.unjudged.push_back(b);
  const BendingWorth worth = check_models(found.scene, t.search.states, limits, found.looser, models, s).bending;
  return std::any_of(limits.begin(), limits.end(), [](const LinearLimit& l) { return l.pieces > 1; }) ? 0.0 : worth.share;
}

}  // namespace

namespace {

// Makes the run of settings that were found before; its statement of the error is the search's.
Results run_as_found(const RememberedSettings& kept, const Scene& scene, const SimulateOptions& options) {
  SimulateOptions o = options;
  o.tolerance.reset();
  o.method = kept.method;
  o.estimate_error = false;
  std::vector<LinearLimit> limits;
  Results results = run_for_check(scene, o, limits);
  SolverStatistics& s = results.statistics;
  s.error_estimate = kept.statistics.error_estimate;
  s.error_column = kept.statistics.error_column;
  s.accuracy = kept.statistics.accuracy;
  s.accuracy->search_cpu = 0.0;
  s.notes = kept.statistics.notes;
  return results;
}

// The run that an earlier search ended with; none where it does not come to the same numbers.
std::optional<Results> run_again(const RememberedSettings& kept, const SettingsMemory& memory, const SimulateOptions& options) {
  try {
    Results results = run_as_found(kept, kept.scene, options);
    if (outputs_fingerprint(results) != kept.outputs) return std::nullopt;
    if (memory.found) *memory.found = kept;
    results.statistics.notes.tell(
        "", fmt::format("settings of an earlier search are used: {}; --fresh searches anew", memory.file.filename().string()));
    return results;
  } catch (const SimulationError&) {
    return std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

// Of the beams of `lacking` those that are lumped or made of eigenforms, whatever their sections say.
std::vector<std::string> without_shear_by_model(const Scene& scene, const std::vector<LeftOutWorth>& lacking) {
  std::vector<std::string> out;
  for (const BodyDef& body : scene.bodies) {
    const auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || (beam->model != BeamModel::lumped && beam->modes.empty())) continue;
    if (std::any_of(lacking.begin(), lacking.end(), [&](const LeftOutWorth& w) {
          return w.effect == "shear" && std::find(w.owners.begin(), w.owners.end(), body.name) != w.owners.end();
        }))
      out.push_back(body.name);
  }
  return out;
}

// What no setting brings (Task::lacking) is left out of the result too, unless it is on in the scene as it was run.
void count_lacking(Task& t, Finished& found) {
  std::erase_if(t.lacking, [&](const LeftOutWorth& w) {
    return std::any_of(t.search.states.begin(), t.search.states.end(), [&](const EffectState& s) {
      return s.on && s.effect == w.effect && std::find(w.owners.begin(), w.owners.end(), s.owner) != w.owners.end();
    });
  });
  if (t.lacking.empty()) return;
  const double lacks = together(t.lacking);
  if (lacks > found.error) found.column = t.lacking.front().column;
  if (lacks > 0.5 * std::max(t.accuracy, found.error)) {
    const std::vector<std::string> without = without_shear_by_model(found.scene, t.lacking);
    found.unreached = without.empty() ? "; most of it is the shear that sections without shear_y and shear_z leave out"
                                      : fmt::format(
                                            "; most of it is the shear that the model of '{}' cannot have: take model = "
                                            "\"finite-element\" without 'modes'",
                                            fmt::join(without, "', '"));
  }
  found.error = std::hypot(std::max(0.0, found.error), lacks);
  found.effects = std::hypot(found.effects, lacks);
}

// No setting reaches beyond the modes that bodies of files have. Whether they keep what is asked is worth its time, whatever the run takes.
void judge_last_modes(const Task& t, const Finished& found, Results& results) {
  SimulateOptions options = *t.options;
  options.method = found.method;
  const double told = results.statistics.error_estimate;
  results.statistics.error_estimate = found.time;  // both runs have the same modes
  warn_of_last_modes(make_system(found.scene), found.scene, options, to_histories(results), t.accuracy,
                     std::max(4.0 * least_check, 4.0 * results.statistics.work), results);
  results.statistics.error_estimate = told;
}

// What a search has come to, for the words about it.
struct Searched {
  double start = 0.0, begun = 0.0;   // cpu_seconds() and work_seconds() at which it began
  double allowed = 0.0, run = 0.0;   // CPU s that it might take; of the scene as written, 0: not known
  std::vector<std::string> changed;  // models
  bool checked = false;              // what is left out and the models are judged already
};

// Loads that come at once leave the first sample off where nothing else is (Finished::after_start). Empty where it is more than `asked` and
// not far less than at first, or not known.
std::string only_at_first(const Finished& found, double asked) {
  constexpr double far_less = 0.2;
  const double rest = found.after_start();
  if (found.error <= asked || rest < 0.0 || rest > std::max(asked, far_less * found.error)) return "";
  return fmt::format("; it is in the first instants, after them {:.1e} at most", rest);
}

Results stated(Task& t, Finished found, const Searched& searched, const SettingsMemory* memory) {
  const double accuracy = t.accuracy;
  count_lacking(t, found);
  const bool spent = searched.allowed > 0.0 && work_seconds() > searched.begun + searched.allowed;
  AccuracyStatement out;
  out.asked = accuracy;
  out.time = found.time;
  out.space = found.space;
  out.effects = found.effects;
  out.column = found.column;
  // What half the error would cost: the larger of the two errors has to shrink.
  const double finer_time = std::pow(t.decade, std::log10(2.0) / cautious_order);
  const double finer_space = std::max(1.0, found.work() / std::max(found.coarse.statistics.work, 1e-9));
  out.half_cost = found.time >= found.space ? finer_time : finer_space;
  out.chosen = found.described;
  out.chosen.insert(out.chosen.end(), searched.changed.begin(), searched.changed.end());
  out.chosen.insert(out.chosen.end(), found.chosen.begin(), found.chosen.end());
  const double cpu = found.cpu();
  Results results = std::move(found.results);
  add_missing_works(found.scene, *t.options, {}, results);
  out.search_cpu = cpu_seconds() - searched.start - cpu;
  SolverStatistics& s = results.statistics;
  s.error_estimate = found.error;
  s.error_column = found.column;
  tell_of_energies(results, true);
  tell_of_zero_displacements(found.scene, results);
  warn_of_tipping(found.scene, t.search.states, results, s.notes);
  warn_of_held_warping(found.scene, t.search.states, results, accuracy, s.notes);
  std::vector<int> all;
  for (size_t b = 0; b < found.scene.bodies.size(); ++b)
    if (std::holds_alternative<ModalDef>(found.scene.bodies[b].kind)) all.push_back(static_cast<int>(b));
  warn_of_missing_stiffening(found.scene, all, results, accuracy, s.notes);
  if (t.options->check_effects && !all.empty()) judge_last_modes(t, found, results);
  if (t.options->check_effects) warn_of_leaving_plane(found.scene, t.search.states, s.notes);
  report_left_out(found.scene, t.lacking, accuracy, s);
  const std::string times_as_written =
      searched.run > 0.0 ? fmt::format(", {:.0f} times the CPU time of the scene as written", searched.allowed / searched.run) : "";
  if (s.error_estimate > accuracy)
    s.notes.warn("", fmt::format("the requested accuracy of {:g} was not reached: the estimated error is {:.1e} of the range of {}{}{}",
                                 accuracy, s.error_estimate, found.column, found.unreached.empty() ? only_at_first(found, accuracy) : "",
                                 spent && found.unreached.empty()
                                     ? fmt::format("; the search ended after {:.0f} CPU s{}: request less accuracy, or remove this output",
                                                   out.search_cpu, times_as_written)
                                 : !found.unreached.empty() ? found.unreached
                                 : found.judged             ? "; its vibrations converge so slowly with more modes that a search would not "
                                                              "bring it there: request less accuracy, or remove this output"
                                                            : ""));
  if (out.search_cpu > dear_search && out.search_cpu > 10.0 * cpu)
    s.notes.tell(
        "", fmt::format("the search took {:.0f} times the CPU time of the run that it ended with{}", out.search_cpu / std::max(cpu, 1e-9),
                        memory && !memory->file.empty() ? ", whose settings are kept for the next time" : ""));
  if (!found.scene.simulation.static_start && nothing_counts(to_histories(results), found.looser))
    s.notes.warn("",
                 "no output moves by more than what rounding could make of the mechanism's size: the accuracy is not judged; take outputs "
                 "that move, or a tighter tolerance");
  if (t.options->check_effects && !searched.checked) {
    const double bending = check_result(t, found, accuracy, results), before = s.error_estimate;
    s.error_estimate = std::hypot(before, bending), out.space = std::hypot(out.space, bending);
    if (before <= accuracy && s.error_estimate > accuracy)
      s.notes.warn("",
                   fmt::format("the requested accuracy of {:g} was not reached: the estimated error is {:.1e} of the range of {}, of which "
                               "{:.1e} that beams bend too far for one frame: give volumes",
                               accuracy, s.error_estimate, found.column, bending));
  }
  s.accuracy = out;
  if (memory) {
    const RememberedSettings kept{found.scene, found.method, s, outputs_fingerprint(results), found.sizes};
    remember_settings(*memory, kept);
    if (memory->found) *memory->found = kept;
  }
  return results;
}

// Where the search was in vain: the scene as it stands by the default settings, whose tolerance is tightened where its error of time calls
// for it. That of a run judged by one decade is not. Taken where it comes surely nearer, or where there is nothing else; none otherwise.
// (RSCR loop of elastic links asked for 1e-2: 0.86 off after 25 CPU s, where a plain run of 4 CPU s is 4e-3 off.)
std::optional<Results> nearer_as_written(const Task& t, const Scene& scene, const std::optional<Finished>& best, const AsGiven& given,
                                         const Searched& searched) {
  constexpr double surely_nearer = 0.3, worth_repeating = 0.01;  // of the error; that a plain run makes again (run_scene)
  if (best && given.run && given.time <= worth_repeating) return std::nullopt;
  // What elements and modes lack there nobody would know.
  if (best && best->space > 0.5 * best->error) return std::nullopt;
  const double taken = cpu_seconds() - searched.start;
  Scene as_written = scene;  // by a tolerance that nobody chose
  as_written.simulation.tolerance.reset();
  as_written.simulation.accuracy.reset();
  SimulateOptions plain = *t.options;
  plain.tolerance.reset();
  plain.estimate_error = true;
  if (best) plain.progress = give_up_after(std::max(least_plain_budget, work_seconds() - searched.begun), t.options->progress);
  std::optional<Results> results;
  try {
    results = run_scene(as_written, plain);
  } catch (const BudgetSpent&) {
    return std::nullopt;
  } catch (const SimulationError&) {
    if (!best) throw;  // neither came to an end: what it says says why
    return std::nullopt;
  }
  SolverStatistics& s = results->statistics;
  if (best && !(s.error_estimate < surely_nearer * best->error)) return std::nullopt;
  AccuracyStatement out;
  out.asked = t.accuracy;
  out.time = s.error_estimate;
  out.column = s.error_column;
  out.search_cpu = taken;
  out.chosen = {fmt::format("the scene as written, tolerance {:.1e}", s.tolerance)};
  s.accuracy = out;
  const std::string in_vain = best ? fmt::format("a search of {:.0f} CPU s came no nearer than {:.1e}", taken, best->error)
                                   : fmt::format("no run of a search of {:.0f} CPU s came to an end", taken);
  s.notes.warn("", fmt::format("the requested accuracy of {:g} is not judged: {}, and the result is the scene as written, whose estimated "
                               "error of the time integration is {:.1e}; elements, modes and effects are judged as without a request: "
                               "request less accuracy, or simulate with a tolerance",
                               t.accuracy, in_vain, s.error_estimate));
  return results;
}

}  // namespace

Results simulate_to_accuracy(const Scene& as_given, double accuracy, const SimulateOptions& options, const SettingsMemory* memory) {
  if (memory)
    if (const std::optional<RememberedSettings> kept = recall_settings(*memory, as_given))
      if (std::optional<Results> again = run_again(*kept, *memory, options)) return std::move(*again);
  const double start = cpu_seconds(), begun = work_seconds();
  const auto task_for = [&](const Scene& of) {
    Task t{accuracy, &options, Search(of, options), {}, {}, {}, 0.0, 1.0, {}, {}, {}, {}, {}, {}, {}, {}};
    t.nearest = std::make_shared<std::optional<Finished>>();
    t.written = std::make_shared<std::optional<Finished>>();
    t.search.accuracy = accuracy;
    return t;
  };
  std::optional<StraightRun> left;
  std::vector<LeftOutWorth> lacking;
  std::shared_ptr<std::optional<Finished>> nearest, written;  // of the straight way
  {
    Task straight = task_for(as_given);
    nearest = straight.nearest, written = straight.written;
    if (std::optional<Finished> found = go_straight(straight, as_given, left))
      return stated(straight, std::move(*found), {start, begun, 0.0, 0.0, {}, true}, memory);
    if (*written && (*written)->ends_search) {
      straight.search.states = (*written)->states;
      return stated(straight, std::move(**written), {start, begun, 0.0, 0.0, {}}, memory);
    }
    lacking = std::move(straight.lacking);
  }
  // What the motion needs of the effects that are "auto", told by a loose run: the search weighs these and the others by pairs.
  SimulateOptions first = options;
  first.progress = {};
  first.tolerance = std::clamp(0.1 * accuracy, 1e-6, 1e-4);
  const bool kept = left && left->kept && left->tolerance <= *first.tolerance, called = kept || (left && !left->kept);
  const Scene scene = called ? left->run.scene : with_called_effects(as_given, first, accuracy);
  Task t = task_for(scene);
  const double search_start = work_seconds();
  std::optional<AsGiven> given = kept ? given_by(*left, options) : run_as_given(t);
  const double as_written = given->run ? std::max(given->run->work(), 1e-3) : 0.0;
  const double allowed = given->run ? search_allowance(given->run->work()) : unknown_allowance;
  std::vector<std::string> changed;
  if (const std::optional<Scene> richer = with_fit_models(t, *given)) {
    for (size_t b = 0; b < scene.bodies.size(); ++b) {
      const auto *before = std::get_if<BeamDef>(&scene.bodies[b].kind), *after = std::get_if<BeamDef>(&richer->bodies[b].kind);
      if (before && after && before->model != after->model)
        changed.push_back(
            fmt::format("'{}' model \"{}\"", scene.bodies[b].name, after->model == BeamModel::mixed ? "mixed" : "finite-element"));
    }
    // With them what failed the straight way is gone; it costs a part of what a search does. Effects are those that the scene gives.
    Scene as_richer = *richer;
    for (size_t b = 0; b < as_richer.bodies.size(); ++b)
      if (auto* beam = std::get_if<BeamDef>(&as_richer.bodies[b].kind)) {
        const auto& as_told = std::get<BeamDef>(as_given.bodies[b].kind);
        beam->effects = as_told.effects;
        beam->chosen.effects = as_told.chosen.effects;
      }
    Task straight = task_for(as_richer);
    std::optional<StraightRun> again;
    if (std::optional<Finished> found = go_straight(straight, as_richer, again))
      return stated(straight, std::move(*found), {start, begun, 0.0, 0.0, changed, true}, memory);
    lacking = std::move(straight.lacking);
    t = task_for(*richer);
    given.reset();  // with all of its coordinates it takes as long as the search does: only where that finds nothing
  }
  t.search.until = search_start + allowed;
  // Where what no setting brings is worth more than what is asked a search is in vain.
  constexpr double surely = 2.0;
  std::optional<Finished> best;
  if (together(lacking) <= surely * accuracy || !given || !given->run || !given->loose) best = found_by_search(t);
  if (!best || best->error > accuracy) {
    t.search.until = 1e300;
    if (!given) given = run_as_given(t);
    std::optional<Finished> other = judged_as_given(t, *given);
    if (other && (!best || other->error < best->error)) best = std::move(other);
    // One that seemed to keep the accuracy was refused for what its error does not say.
    if (*nearest && (*nearest)->judged && (*nearest)->error > accuracy && (!best || (*nearest)->error < best->error)) best = **nearest;
    if (*written && (!best || (*written)->error < best->error)) best = std::move(**written);
    if (best && !best->states.empty()) t.search.states = best->states;
    if (!best || best->error > accuracy)
      if (std::optional<Results> plain = nearer_as_written(t, scene, best, *given, {start, begun, allowed, as_written, {}}))
        return std::move(*plain);
  }
  t.lacking = std::move(lacking);
  return stated(t, std::move(*best), {start, begun, allowed, as_written, std::move(changed)}, memory);
}

Results run_with_settings(const RememberedSettings& found, double output_rate, const SimulateOptions& options) {
  Scene scene = found.scene;
  scene.simulation.output_rate = output_rate;
  return run_as_found(found, scene, options);
}

Results simulate_as_asked(const Scene& as_given, const SimulateOptions& options, const SettingsMemory* memory) {
  if (options.tolerance && !(*options.tolerance >= 1e-13 && *options.tolerance <= 0.1))
    throw ArgumentError(fmt::format("the tolerance must be a number from 1e-13 to 0.1, found {:g}", *options.tolerance));
  if (options.accuracy && !(*options.accuracy >= 1e-12 && *options.accuracy <= 0.5))
    throw ArgumentError(fmt::format("the accuracy asked for must be a number from 1e-12 to 0.5, found {:g}", *options.accuracy));
  const bool asked = !options.tolerance && (options.accuracy || as_given.simulation.accuracy);
  const Scene scene = options.check_effects ? without_idle_bending(as_given, asked) : as_given;
  if (scene.simulation.picture_accuracy && !options.tolerance && !options.accuracy) {
    Results results = run_scene(scene, options);
    results.statistics.notes.warn("",
                                  fmt::format("accuracy = \"{}\" is kept where pictures are known (flexframe run and simulate); this run "
                                              "has the tolerance {:g}, and whether it keeps that distance is not known",
                                              scene.simulation.picture_accuracy->words, results.statistics.tolerance));
    return results;
  }
  if (const std::optional<double> accuracy = options.tolerance  ? std::nullopt
                                             : options.accuracy ? options.accuracy
                                                                : scene.simulation.accuracy) {
    SimulateOptions inner = options;
    inner.accuracy.reset();
    return simulate_to_accuracy(scene, *accuracy, inner, memory);
  }
  return run_scene(scene, options);
}

}  // namespace flexframe::sim
