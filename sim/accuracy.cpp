#include "sim/accuracy.h"

#include "sim/accuracy_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

// Least order at which the error of time follows the tolerance when it has to be lowered (simulate.h: 0.2 to 1.2).
constexpr double cautious_order = 0.6;
// Shares of the asked accuracy: an effect that is on and worth less may go; effects that are off and together worth less stay out unasked;
// effects that stay out may be worth so much in all, if that is the cheaper way.
constexpr double little = 0.1, unasked = 1.0 / 3.0, most_left_out = 0.9;
// Bodies that an effect is weighed on one by one; more of them have it or have it not together.
constexpr size_t weighed_alone = 4;
// What saves so much of the CPU time by being off is tried without where it is worth more than little.
constexpr double cheaper = 0.8;
// A run with an effect switched that takes so many times as long as the one without is given up.
constexpr double dearest = 20.0;
// Settings that are tried for the run itself.
constexpr int most_rounds = 14;

Difference between(const Histories& a, const Histories& reference) { return compare_histories(a, reference, output_ranges(reference)); }
double apart(const Histories& a, const Histories& reference) { return between(a, reference).largest; }

// a - reference at the reference's samples, relative to the ranges of its outputs: columns x samples.
MatX relative(const Histories& a, const Histories& reference) {
  const VecX ranges = output_ranges(reference);
  MatX out = at_times(a, reference.times).values - reference.values;
  for (Eigen::Index c = 0; c < out.rows(); ++c) out.row(c) *= ranges[c] > 0.0 ? 1.0 / ranges[c] : 0.0;
  return out;
}
double largest(const MatX& m) { return m.size() > 0 ? m.cwiseAbs().maxCoeff() : 0.0; }

// The search as far as it has come.
struct Task {
  double accuracy;
  const SimulateOptions* options;
  Search search;
  Setting setting;
  Histories loose, coarse;         // one level below: at ten times the tolerance, and at it
  double time = 0.0;               // error of the latter
  double decade = 1.0;             // CPU time at a tenth of the tolerance
  // What is left out and what it would change, relative, columns x samples: stiff bodies' flexibility, effects of bodies.
  MatX rigid, left_out;
  std::vector<EffectState> without;
  std::vector<std::string> chosen;

  Setting below() const { return {search.has_levels() ? setting.level - 1 : setting.level, setting.tolerance}; }
  Setting loose_below() const { return {below().level, 10.0 * setting.tolerance}; }
  // Found again at another setting, in a run that is given up after so many CPU seconds.
  void find_left_out(const Setting& here, const Histories& run, double seconds) {
    Scene other = search.at(here);
    for (const EffectState& s : without) other = with_effect(other, search.states, s.owner, s.effect, true);
    const std::optional<Histories> with = search.run_within(other, seconds);
    if (with && with->columns == run.columns) left_out = relative(*with, run);
  }
  void leave_out(const std::vector<EffectState>& what, const MatX& change) {
    without.insert(without.end(), what.begin(), what.end());
    left_out += change;
  }
  // The latter at another setting, if it succeeds there.
  bool coarse_again() {
    std::optional<Histories> again = search.run_within(search.at(below()), 1e300);
    if (again) coarse = std::move(*again);
    return again.has_value();
  }
  // The two runs, at a tighter tolerance where they fail.
  void run_below() {
    // Too loose to hold the mechanism together, perhaps: such a run fails, or its steps become so small that it takes longer than a tighter one
    // by far. What fails at a tight tolerance as well fails.
    for (double longest = 1e300;;) {
      std::optional<Histories> wide = search.run_within(search.at(loose_below()), longest);
      if (wide) longest = 1.0 + 10.0 * wide->statistics.cpu_seconds;
      std::optional<Histories> narrow = wide ? search.run_within(search.at(below()), longest) : std::nullopt;
      if (narrow) {
        loose = std::move(*wide);
        coarse = std::move(*narrow);
        return;
      }
      if (setting.tolerance <= 1e-7) {
        loose = search.run(search.at(loose_below()));
        coarse = search.run(search.at(below()));
        return;
      }
      setting.tolerance *= wide ? 0.01 : 0.1;
    }
  }
};

// Time, one level below: the tolerance is lowered until half of the asked error is kept.
void settle_time(Task& t) {
  Search& search = t.search;
  const double accuracy = t.accuracy;
  search.method = t.options->method;
  t.run_below();
  // Methods that follow vibrations instead of stepping over them.
  struct Follower {
    Method method;
    double tolerance;
    bool pays = true;
    double time = 1.0;  // error of the tighter run
    std::optional<Histories> looser, tighter;
  };
  std::vector<Follower> followers;
  if (search.scene().simulation.method == Method::automatic && !search.method)
    for (const Method m : {Method::exponential, Method::erk}) followers.push_back({m, std::min(1e-5, 0.01 * accuracy), true, 1.0, {}, {}});
  for (int round = 0; round < 12; ++round) {
    t.time = error_of_difference * apart(t.loose, t.coarse);
    if (t.time <= 0.5 * accuracy || t.setting.tolerance <= 1e-11) break;
    // Vibrations whose phase is asked for have to be followed: there a method of sixth order is cheaper as long as what is kept of the bodies is not
    // stiff, and the exponential one where they ride on a slow motion. Each round lowers their tolerances by a decade, for as long as the next round
    // would take; of two that are good enough the cheaper one is taken.
    Follower* best = nullptr;
    for (Follower& f : followers) {
      if (!f.pays || t.coarse.statistics.method == method_name(f.method)) continue;
      search.method = f.method;
      const double longest = (round == 0 ? 20.0 : 4.0) * t.coarse.statistics.cpu_seconds;
      const auto run = [&](double tolerance) { return search.run_within(search.at({t.below().level, tolerance}), longest); };
      f.looser = f.tighter ? std::move(f.tighter) : run(10.0 * f.tolerance);
      f.tighter = f.looser ? run(f.tolerance) : std::nullopt;
      f.time = f.tighter ? error_of_difference * apart(*f.looser, *f.tighter) : 1.0;
      // Vibrations that nothing damps have to be followed to the end: more decades are tried while they help. Damped ones leave long steps to others.
      for (double before = 1.0; search.undamped && f.tighter && f.time > 0.5 * accuracy && f.time < 0.5 * before && f.tolerance > 1e-10;) {
        before = f.time;
        f.tolerance *= 0.1;
        f.looser = std::move(f.tighter);
        f.tighter = run(f.tolerance);
        if (f.tighter) f.time = error_of_difference * apart(*f.looser, *f.tighter);
      }
      f.pays = f.tighter.has_value();
      if (f.pays && f.time <= 0.5 * accuracy && (!best || f.tighter->statistics.cpu_seconds < best->tighter->statistics.cpu_seconds)) best = &f;
      search.method.reset();
    }
    if (best) {
      search.method = best->method;
      t.setting.tolerance = best->tolerance;
      t.time = best->time;
      t.loose = std::move(*best->looser);
      t.coarse = std::move(*best->tighter);
      break;
    }
    for (Follower& f : followers) f.tolerance *= 0.1;
    const double step = std::clamp(std::pow(0.4 * accuracy / t.time, 1.0 / cautious_order), 0.01, 0.2);
    const bool one_decade = step > 0.05;
    t.setting.tolerance = std::max(1e-11, one_decade ? 0.1 * t.setting.tolerance : step * t.setting.tolerance);
    // A step of a decade finds its looser run already there.
    t.loose = one_decade ? std::move(t.coarse) : search.run(search.at(t.loose_below()));
    if (t.coarse_again()) continue;
    // So few modes or elements cannot follow the motion.
    if (search.has_levels()) ++t.setting.level;
    t.run_below();
  }
  t.decade = std::max(1.05, t.coarse.statistics.cpu_seconds / std::max(t.loose.statistics.cpu_seconds, 1e-9));
}

// Stiff bodies are rigid unless that shows.
void settle_rigid(Task& t) {
  for (const std::string& name : t.search.rigid_at(t.below())) {
    t.search.flexible.insert(name);
    try {
      const Histories changed = t.search.run(t.search.at(t.loose_below()));
      const bool same = changed.columns == t.loose.columns;
      const MatX change = same ? relative(changed, t.loose) : MatX();
      const double share = same ? largest(change) : 1.0;
      if (share <= std::max(little * t.accuracy, t.time)) {
        // What is more than that is the error of time.
        t.rigid += change * std::min(1.0, little * t.accuracy / std::max(share, 1e-300));
        t.chosen.push_back(fmt::format("flexibility of '{}' worth {:.1g}", name, share));
        t.search.flexible.erase(name);
        continue;
      }
    } catch (const SimulationError&) {
      t.search.flexible.erase(name);
      continue;
    }
    t.run_below();
  }
}

// One effect of some bodies, all on or all off.
struct Item {
  std::vector<EffectState> members;
  MatX share;                      // with it less without it, relative: columns x samples; empty: it cannot be switched
  double worth = 0.0;              // the largest of them
  double price = 1.0;              // CPU time with it switched, as a multiple
  std::string name() const {
    std::vector<std::string> owners;
    for (const EffectState& s : members) owners.push_back("'" + s.owner + "'");
    return fmt::format("{} of {}", members.front().effect, fmt::join(owners, ", "));
  }
};

// Weighs effects by pairs of runs one level below, with and without.
class Scales {
 public:
  explicit Scales(Task& task) : task_(task), without_{task.loose, task.coarse} {}

  // What switching it changes. An effect that is off can seem to be worth more than it is, as vibrations that it adds are stepped over in other
  // ways at every tolerance: where that would decide, both runs are made at tighter tolerances until the share is small, or larger than what a
  // decade of tolerance changes in both. What never is counts as small: a share that cannot be told from errors of time speaks for nothing.
  void weigh(Item& item) {
    const double small = unasked * task_.accuracy;
    std::optional<Histories> now = with(item, 1);
    if (!take_share(item, now, 1) || item.members.front().on || item.worth <= small) return;
    std::optional<Histories> before = with(item, 0);
    for (size_t k = 1; now && k <= 4; ++k) {
      if (item.worth <= small || (before && item.worth > small + apart(*before, *now) + apart(without_[k - 1], without_[k]))) return;
      if (without_.size() == k + 1) {
        std::optional<Histories> next = task_.search.run_within(task_.search.at(setting(k + 1)), limit(k));
        if (!next) break;
        without_.push_back(std::move(*next));
      }
      before = std::move(now);
      now = with(item, k + 1);
      if (!take_share(item, now, k + 1)) break;
    }
    item.share *= small / std::max(item.worth, small);
    item.worth = std::min(item.worth, small);
  }

 private:
  // k decades below the loose run.
  Setting setting(size_t k) const { return {task_.below().level, task_.loose_below().tolerance * std::pow(0.1, static_cast<double>(k))}; }
  double limit(size_t k) const { return dearest * without_[k].statistics.cpu_seconds; }

  std::optional<Histories> with(const Item& item, size_t k) const {
    Scene other = task_.search.at(setting(k));
    for (const EffectState& s : item.members) other = with_effect(other, task_.search.states, s.owner, s.effect, !s.on);
    return task_.search.run_within(other, limit(k));
  }
  bool take_share(Item& item, const std::optional<Histories>& now, size_t k) const {
    if (!now || now->columns != without_[k].columns) return false;
    item.share = relative(*now, without_[k]) * (item.members.front().on ? -1.0 : 1.0);
    item.worth = largest(item.share);
    item.price = now->statistics.cpu_seconds / std::max(without_[k].statistics.cpu_seconds, 1e-9);
    return true;
  }

  Task& task_;
  std::vector<Histories> without_;  // runs of the scene as it stands, each a decade tighter
};

// Effects that the program decides. Returns those that may be left out or not.
std::vector<Item> settle_effects(Task& t) {
  std::vector<Item> groups;
  for (const EffectState& s : t.search.states) {
    if (!t.search.decides(s)) continue;
    const auto at = std::find_if(groups.begin(), groups.end(), [&](const Item& g) { return g.members.front().effect == s.effect && g.members.front().on == s.on; });
    if (at == groups.end()) groups.push_back({{s}, {}, 0.0, 1.0});
    else at->members.push_back(s);
  }
  Scales scales(t);
  std::vector<Item> items;
  for (Item& group : groups) {
    scales.weigh(group);
    const double enough = (group.members.front().on ? little : unasked) * t.accuracy;
    const bool whole = group.share.size() > 0 && group.worth <= enough;
    if (whole || group.members.size() == 1 || group.members.size() > weighed_alone) {
      items.push_back(group);
      continue;
    }
    for (const EffectState& s : group.members) {
      items.push_back({{s}, {}, 0.0, 1.0});
      scales.weigh(items.back());
    }
  }
  std::erase_if(items, [](const Item& i) { return i.share.size() == 0; });
  std::stable_sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.worth < b.worth; });

  std::vector<Item> open;
  MatX in_all = t.rigid;           // open ones included
  bool dropped = false, added = false;
  const auto set = [&](const Item& item, bool on) {
    for (const EffectState& s : item.members) t.search.set_effect(s, on);
    t.chosen.push_back(fmt::format("{} {} (worth {:.1g})", item.name(), on ? "on" : "off", item.worth));
  };
  for (const Item& item : items) {
    const double sum = largest(in_all + item.share);
    if (item.members.front().on) {
      if (item.price < cheaper && sum <= most_left_out * t.accuracy && (item.worth > little * t.accuracy || sum > unasked * t.accuracy)) {
        in_all += item.share;
        open.push_back(item);
        continue;
      }
      if (item.price > 1.1 || item.worth > little * t.accuracy || sum > unasked * t.accuracy) continue;
      set(item, false);
      dropped = true;
    } else if (sum > most_left_out * t.accuracy || item.price < 0.5) {
      set(item, true);
      added = true;
      continue;
    } else if (sum > unasked * t.accuracy) {
      in_all += item.share;
      open.push_back(item);
      continue;
    }
    in_all += item.share;
    t.leave_out(item.members, item.share);
  }
  // What was added may ask for other steps, or another method.
  if (added) settle_time(t);
  else if (dropped) t.run_below();
  return open;
}

// A run that keeps the accuracy, or comes as near as it can.
struct Finished {
  Results results;
  Setting setting;
  Histories looser, coarse;        // at ten times the tolerance, one level below
  double error = 0.0;              // of the output that is furthest off
  std::string column;
  double time = 0.0, space = 0.0, effects = 0.0;  // its parts
  double cpu() const { return results.statistics.cpu_seconds; }
};

// The run itself, checked against the one below; one level more as long as space is what lacks. Given up once a run of it takes `limit` CPU s.
std::optional<Finished> finish(Task& t, double limit) {
  Search& search = t.search;
  const double accuracy = t.accuracy;
  SimulateOptions last = *t.options;
  last.tolerance.reset();
  last.method = search.method;
  last.estimate_error = false;
  struct TooDear {};
  double start = 0.0;
  last.progress = [&](double time) {
    if (thread_seconds() - start > limit) throw TooDear{};
    if (t.options->progress) t.options->progress(time);
  };
  Finished out;
  const bool judged = search.has_levels() && follows_vibrations(search.method);
  std::optional<Histories> judge;  // what the level below was judged by
  double last_step = 0.0;   // difference of the two levels before
  for (int round = 0;; ++round) {
    const Scene chosen = search.at(t.setting);
    start = thread_seconds();
    try {
      out.results = simulate(chosen, last);
      out.looser = search.run(search.at({t.setting.level, 10.0 * t.setting.tolerance}));
    } catch (const TooDear&) {
      search.cpu += thread_seconds() - start;
      return std::nullopt;
    } catch (const SimulationError&) {
      // Too loose or too coarse to hold the mechanism together, perhaps.
      if (t.setting.tolerance <= 1e-7 || round == most_rounds) throw;
      t.setting.tolerance *= 0.1;
      t.setting.level += search.has_levels();
      t.coarse_again();
      continue;
    }
    const Histories fine = to_histories(out.results);
    const Histories thinned = at_times(fine, t.coarse.times);
    MatX space = relative(t.coarse, thinned);
    const double step = search.has_levels() ? largest(space) : 0.0;
    // A geometric series: what is still to come is the last step / (ratio - 1). The first ratio is taken for 3; free vibrations after a
    // release converge slowly, by 1.5 a level, unless a finer run tells.
    const double ratio = last_step > 0.0 && !judged ? std::clamp(last_step / std::max(step, 1e-300), 1.5, 6.0) : 3.0;
    space *= search.has_levels() ? 1.0 / (ratio - 1.0) : 0.0;
    // The error of time again, in the modes that the level below did not have.
    const MatX time = error_of_difference * relative(out.looser, thinned);
    // Errors of one output add up; those of space and of what is left out have nothing to do with each other, and add as squares.
    const auto add_up = [&](const MatX& effects) {
      if (time.size() == 0) return 0.0;
      const MatX sum = (space.cwiseAbs2() + effects.cwiseAbs2()).cwiseSqrt();
      Eigen::Index at = 0;
      out.error = VecX(sum.rowwise().maxCoeff() + time.cwiseAbs().rowwise().maxCoeff()).maxCoeff(&at);
      out.time = largest(time.row(at)), out.space = largest(space.row(at)), out.effects = largest(effects.row(at));
      out.column = fine.columns[static_cast<size_t>(at)];
      return out.error;
    };
    // Where what is left out decides, it is found again in these modes.
    bool found_again = t.without.empty();
    const auto total = [&] {
      if (!found_again && add_up(t.rigid) <= accuracy && add_up(t.rigid + t.left_out) > accuracy) {
        t.find_left_out(t.setting, thinned, dearest * out.cpu());
        found_again = true;
      }
      return add_up(t.rigid + t.left_out);
    };
    double error = total();
    const bool stuck = !judged && last_step > 0.0 && step > 0.5 * last_step;
    const double step_before = last_step;
    last_step = step;
    // Levels may differ in some bodies only, jumps of loads converge slowly in all of them, and two levels can agree by chance: a finer run tells.
    if (search.has_levels() && error <= accuracy) {
      const Scene finer = search.finer_than(t.setting);
      // The level below was judged by these modes and one more in bodies where this level has none more: do these matter?
      const bool more_matter = judge && apart(*judge, thinned) > unasked * accuracy;
      judge = search.run_within(finer, 1e300);
      // Where it tells more, its word counts.
      const MatX left = judge ? MatX(-relative(*judge, thinned)) : space;
      for (Eigen::Index c = 0; c < space.rows(); ++c)
        if (largest(left.row(c)) > largest(space.row(c))) space.row(c) = left.row(c);
      error = total();
      if (error > accuracy && more_matter) search.keep_at_least(finer);
    }
    if (round == most_rounds || error <= accuracy) break;
    if (!search.has_levels() && t.setting.tolerance <= 1e-11) break;
    search.cpu += out.cpu();
    // More modes that do not help are the error of time in them.
    if (!search.has_levels() || ((stuck || out.time > 0.5 * accuracy) && t.setting.tolerance > 1e-10)) {
      const double step_down = std::pow(0.4 * accuracy / std::max(out.time, 0.4 * accuracy), 1.0 / cautious_order);
      t.setting.tolerance = std::max(1e-11, t.setting.tolerance * std::clamp(step_down, 0.05, 0.3));
      t.coarse_again();
      last_step = stuck ? 0.0 : step_before;
      continue;
    }
    ++t.setting.level;
    t.coarse = thinned;
  }
  out.setting = t.setting;
  out.coarse = t.coarse;
  return out;
}

// Effects that are worth so much that they count, and so little that they may be left out: the cheaper way is taken. With them the run is
// tried for as long as it is the cheaper one.
Finished settle_open(Task& t, const std::vector<Item>& open) {
  Task with = t;
  bool off = false;
  for (const Item& item : open) {
    for (const EffectState& s : item.members)
      if (s.on) t.search.set_effect(s, false), off = true;
    t.leave_out(item.members, item.share);
    t.chosen.push_back(fmt::format("{} left out (worth {:.1g})", item.name(), item.worth));
    for (const EffectState& s : item.members) with.search.set_effect(s, true);
    with.chosen.push_back(fmt::format("{} on (worth {:.1g})", item.name(), item.worth));
  }
  if (off) t.run_below();
  Finished found = *finish(t, 1e300);
  if (open.empty()) return found;
  const bool kept = found.error <= t.accuracy;
  with.search.cpu = t.search.cpu;
  const double limit = kept ? found.cpu() : 1e300;
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
  t.search.cpu = with.search.cpu;
  if (!other || (kept ? other->error > t.accuracy || other->cpu() >= found.cpu() : other->error >= found.error)) {
    if (other) t.search.cpu += other->cpu();
    return found;
  }
  with.search.cpu += found.cpu();
  t = std::move(with);
  return *other;
}

}  // namespace

Results simulate_to_accuracy(const Scene& scene, double accuracy, const SimulateOptions& options) {
  Task t{accuracy, &options, Search(scene, options), {}, {}, {}, 0.0, 1.0, {}, {}, {}, {}};
  t.setting.tolerance = std::clamp(0.1 * accuracy, 1e-11, 1e-3);
  settle_time(t);
  t.rigid = t.left_out = MatX::Zero(t.coarse.values.rows(), t.coarse.values.cols());
  settle_rigid(t);
  const std::vector<Item> open = settle_effects(t);
  Finished found = settle_open(t, open);

  AccuracyStatement out;
  out.asked = accuracy;
  out.time = found.time;
  out.space = found.space;
  out.effects = found.effects;
  out.column = found.column;
  // What half the error would cost: the larger of the two errors has to shrink.
  const double finer_time = std::pow(t.decade, std::log10(2.0) / cautious_order);
  const double finer_space = std::max(1.0, found.cpu() / std::max(found.coarse.statistics.cpu_seconds, 1e-9));
  out.half_cost = found.time >= found.space ? finer_time : finer_space;
  out.chosen = t.search.describe(found.setting);
  out.chosen.insert(out.chosen.end(), t.chosen.begin(), t.chosen.end());
  out.search_cpu = t.search.cpu;
  SolverStatistics& s = found.results.statistics;
  s.error_estimate = found.error;
  s.error_column = found.column;
  if (s.error_estimate > accuracy)
    s.warnings.push_back(fmt::format("accuracy {:g} was asked; the estimated error is {:.1e} of the range of {}", accuracy, s.error_estimate, found.column));
  if (options.check_effects) {
    NeglectOptions check;
    check.tolerance = 10.0 * found.setting.tolerance;
    const Histories whole = to_histories(found.results);
    check.floor = std::max(found.time, apart(found.looser, whole));
    check.budget = std::max(check_price * s.cpu_seconds, least_check);
    check.method = t.search.method;
    check.run = &whole;
    check.run_tolerance = found.setting.tolerance;
    check.run_error = s.error_estimate;
    report_neglected(t.search.at(found.setting), t.search.states, found.looser, check, accuracy, s);
  }
  s.accuracy = out;
  return found.results;
}

}  // namespace flexframe::sim
