#include "sim/accuracy/accuracy.h"

#include "sim/accuracy/accuracy_task.h"

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
  return kept ? a->cpu() < b->cpu() : a->error < b->error;
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
    t.chosen.push_back(fmt::format("{} left out (worth {:.1g})", item.name(), item.worth));
    for (const EffectState& s : item.members) with.search.set_effect(s, true);
    with.chosen.push_back(fmt::format("{} on (worth {:.1g})", item.name(), item.worth));
  }
  if (off) t.run_below();
  std::optional<Finished> found = finish(t, limit);
  if (open.empty()) return found;
  const bool kept = found && found->error <= t.accuracy;
  with.search.cpu = t.search.cpu;
  if (kept) limit = found->cpu();
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
    with.search.cpu += found ? found->cpu() : 0.0;
    t = std::move(with);
    return other;
  }
  t.search.cpu = with.search.cpu + (other ? other->cpu() : 0.0);
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

// What is cheap at the coarse level may be dear with more modes: all ways are gone in runs of a limited length, which grows until one comes to the
// end; the others may be cheaper still.
Finished take_cheapest(const std::vector<Way>& ways, Task& taken) {
  double spent = ways.front().task.search.cpu, limit = unlimited;
  for (const Way& way : ways) limit = std::min(limit, 0.01 + 10.0 * way.task.coarse.statistics.cpu_seconds);
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
    spent = task.search.cpu + (one ? one->cpu() : 0.0);
    if (!better(task.accuracy, one, found)) return;
    found = std::move(one);
    taken = std::move(task);
  };
  constexpr int most_limits = 8;
  for (int k = 0; k < most_limits && ways.size() > 1 && !found; ++k, limit *= 4.0)
    for (const Way& way : ways) go(way, found && found->error <= way.task.accuracy ? found->cpu() : limit);
  if (!found) go(ways.front(), unlimited);
  taken.search.cpu = spent - found->cpu();
  return std::move(*found);
}

}  // namespace

Results simulate_to_accuracy(const Scene& scene, double accuracy, const SimulateOptions& options) {
  Task t{accuracy, &options, Search(scene, options), {}, {}, {}, 0.0, 1.0, {}, {}, {}, {}};
  t.setting.tolerance = std::clamp(0.1 * accuracy, 1e-11, 1e-3);
  const Finished found = take_cheapest(find_ways(t), t);

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
  Results results = found.results;
  SolverStatistics& s = results.statistics;
  s.error_estimate = found.error;
  s.error_column = found.column;
  if (s.error_estimate > accuracy)
    s.notes.warn("", fmt::format("accuracy {:g} was asked; the estimated error is {:.1e} of the range of {}{}", accuracy, s.error_estimate, found.column,
                                     t.weary(found.cpu()) ? fmt::format("; the search ended after {:.0f} CPU s: ask for less, or without this output", t.search.cpu) : ""));
  if (options.check_effects) {
    NeglectOptions check;
    check.tolerance = found.loose_tolerance;
    const Histories whole = to_histories(results);
    check.floor = std::max(found.time, apart(found.looser, whole));
    check.budget = std::max(check_price * s.cpu_seconds, least_check);
    check.method = t.search.method;
    check.run = &whole;
    check.run_tolerance = found.setting.tolerance;
    check.run_error = s.error_estimate;
    report_neglected(t.search.at(found.setting), t.search.states, found.looser, check, accuracy, s);
  }
  s.accuracy = out;
  return results;
}

}  // namespace flexframe::sim
