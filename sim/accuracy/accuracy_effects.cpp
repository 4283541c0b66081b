#include "sim/accuracy/accuracy_task.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

// Shares of the asked accuracy: an effect that is on and worth less may go; effects that are off and together worth less than `unasked`
// stay out; effects that stay out may be worth so much in all, if that is the cheaper way.
constexpr double little = 0.1, most_left_out = 0.9;
// Bodies that an effect is weighed on one by one; more of them have it or have it not together.
constexpr size_t weighed_alone = 4;
// What saves so much of the CPU time by being off is tried without where it is worth more than little.
constexpr double cheaper = 0.8;
// What is off and would save so much by being on comes.
constexpr double far_cheaper = 0.2;

// Weighs effects by pairs of runs one level below, with and without.
class Scales {
 public:
  explicit Scales(Task& task) : task_(task), without_{task.loose, task.coarse} {}

  // What switching it changes. An effect that is off can seem to be worth more than it is, as vibrations that it adds are stepped over in
  // other ways at every tolerance, and so can one that is on and dear: where that would decide, both runs are made at tighter tolerances
  // until the share is small, or larger than what a decade of tolerance changes in both. What never is counts as small if it is off: a
  // share that cannot be told from errors of time speaks for nothing.
  void weigh(Item& item) {
    const bool on = item.members.front().on;
    const double small = (on ? most_left_out : unasked) * task_.accuracy;
    std::optional<Histories> now = with(item, 1);
    if (!take_share(item, now, 1) || item.worth <= small || (on && item.price >= cheaper)) return;
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
    if (on) return;
    item.share *= small / std::max(item.worth, small);
    item.worth = std::min(item.worth, small);
  }

 private:
  // k decades below the loose run.
  Setting setting(size_t k) const { return {task_.below().level, task_.loose_below().tolerance * std::pow(0.1, static_cast<double>(k))}; }
  double limit(size_t k) const { return dearest * without_[k].statistics.work; }

  std::optional<Histories> with(const Item& item, size_t k) const {
    Scene other = task_.search.at(setting(k));
    for (const EffectState& s : item.members) other = with_effect(other, task_.search.states, s.owner, s.effect, !s.on);
    return task_.search.run_within(other, limit(k));
  }
  bool take_share(Item& item, const std::optional<Histories>& now, size_t k) const {
    if (!now || now->columns != without_[k].columns) return false;
    item.share = relative(*now, without_[k]) * (item.members.front().on ? -1.0 : 1.0);
    item.worth = largest(item.share);
    item.price = now->statistics.work / std::max(without_[k].statistics.work, 1e-9);
    return true;
  }

  Task& task_;
  std::vector<Histories> without_;  // runs of the scene as it stands, each a decade tighter
};

}  // namespace

std::string Item::name() const {
  std::vector<std::string> owners;
  for (const EffectState& s : members) owners.push_back("'" + s.owner + "'");
  return fmt::format("{} of {}", members.front().effect, fmt::join(owners, ", "));
}

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
        t.chosen.push_back(fmt::format("'{}' rigid (influence of its flexibility {:.1g})", name, share));
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

std::vector<Item> settle_effects(Task& t) {
  std::vector<Item> groups;
  for (const EffectState& s : t.search.states) {
    if (!t.search.decides(s)) continue;
    const auto at = std::find_if(groups.begin(), groups.end(),
                                 [&](const Item& g) { return g.members.front().effect == s.effect && g.members.front().on == s.on; });
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
  MatX in_all = t.rigid;  // open ones included
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
    } else if (sum > most_left_out * t.accuracy) {
      set(item, true);
      added = true;
      continue;
    } else if (sum > unasked * t.accuracy || item.price < far_cheaper) {
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

}  // namespace flexframe::sim
