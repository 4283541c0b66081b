#include "sim/accuracy/accuracy_task.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

// A method that follows vibrations instead of stepping over them, and its runs one level below, at ten times its tolerance and at it.
struct Follower {
  Method method;
  double tolerance;
  bool pays = true;
  double time = 1.0;  // error of the tighter run
  std::optional<Histories> looser, tighter;

  double cpu() const { return tighter->statistics.work; }
  void run(Search& search, int level, double seconds) {
    search.method = method;
    const auto at = [&](double x) { return search.run_within(search.at({level, x}), seconds); };
    looser = tighter ? std::move(tighter) : at(10.0 * tolerance);
    tighter = looser ? at(tolerance) : std::nullopt;
    time = tighter ? error_of_difference * apart(*looser, *tighter) : 1.0;
    pays = tighter.has_value();
    search.method.reset();
  }
};

}  // namespace

void settle_time(Task& t, std::vector<Task>* others) {
  Search& search = t.search;
  // Two tolerances may err alike: without elements or modes, where runs are short, even three times the estimate has to be kept.
  const double enough = (search.has_levels() ? 0.5 : 0.15) * t.accuracy;
  search.method = t.options->method;
  t.run_below();
  // A method of sixth order is cheap as long as what is kept of the bodies is not stiff, the exponential one where they ride on a slow
  // motion.
  std::vector<Follower> followers;
  if (search.scene().simulation.method == Method::automatic && !search.method)
    for (const Method m : {Method::exponential, Method::erk})
      followers.push_back({m, std::min(1e-5, 0.01 * t.accuracy), true, 1.0, {}, {}});
  const auto best = [&]() {
    Follower* out = nullptr;
    for (Follower& f : followers)
      if (f.pays && f.time <= enough && (!out || f.cpu() < out->cpu())) out = &f;
    return out;
  };
  bool followed = false;
  for (int round = 0; round < 12; ++round) {
    t.time = error_of_difference * apart(t.loose, t.coarse);
    const bool settled = t.time <= enough || t.setting.tolerance <= 1e-11;
    if (settled && (round > 0 || !others)) break;
    // Each round lowers the followers' tolerances by a decade, for as long as the next round would take.
    for (Follower& f : followers) {
      if (followed || !f.pays || t.coarse.statistics.method == method_name(f.method)) continue;
      const double longest = (round == 0 ? 20.0 : 4.0) * t.coarse.statistics.work;
      f.run(search, t.below().level, longest);
      // Vibrations that nothing damps have to be followed to the end: more decades are tried while they help. Damped ones leave long steps
      // to others.
      for (double before = 1.0; search.undamped && f.pays && f.time > enough && f.time < 0.5 * before && f.tolerance > 1e-10;) {
        before = f.time;
        f.tolerance *= 0.1;
        f.run(search, t.below().level, longest);
      }
    }
    const Follower* const found = best();
    followed = found != nullptr;
    if (settled) break;
    if (followed && (!others || t.coarse.statistics.work > found->cpu())) break;
    if (!followed)
      for (Follower& f : followers) f.tolerance *= 0.1;
    const double step = std::clamp(std::pow(0.4 * t.accuracy / t.time, 1.0 / cautious_order), 0.01, 0.2);
    const bool one_decade = step > 0.05;
    t.setting.tolerance = std::max(1e-11, one_decade ? 0.1 * t.setting.tolerance : step * t.setting.tolerance);
    // A step of a decade finds its looser run already there.
    t.loose = one_decade ? std::move(t.coarse) : search.run(search.at(t.loose_below()));
    if (t.coarse_again()) continue;
    // So few modes or elements cannot follow the motion.
    if (search.has_levels()) ++t.setting.level;
    t.run_below();
  }
  const auto decade = [](Task& task) {
    task.decade = std::max(1.05, task.coarse.statistics.work / std::max(task.loose.statistics.work, 1e-9));
  };
  decade(t);
  if (!followed) return;
  // Of two methods that follow vibrations one that is far dearer already stays so: its runs lengthen with the fastest mode even more.
  const double longest = 4.0 * best()->cpu();
  std::vector<Task> ways;
  for (Follower& f : followers) {
    while (others && f.pays && f.time > enough && f.tolerance > 1e-10) {
      f.tolerance *= 0.1;
      f.run(search, t.below().level, longest);
    }
    if (!f.pays || f.time > enough || f.cpu() > longest) continue;
    Task& way = ways.emplace_back(t);
    way.search.method = f.method;
    way.setting.tolerance = f.tolerance;
    way.time = f.time;
    way.loose = std::move(*f.looser);
    way.coarse = std::move(*f.tighter);
    decade(way);
  }
  if (t.time <= enough) ways.push_back(t);
  t = ways.front();
  if (others) others->assign(ways.begin() + 1, ways.end());
}

}  // namespace flexframe::sim
