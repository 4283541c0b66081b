// A run beside another that may take only so much work.
#pragma once

#include "sim/base/work_clock.h"

#include <functional>
#include <memory>
#include <utility>

namespace flexframe::sim {

// What ends a run that has taken more than it may: no error, and caught where the budget was given.
struct BudgetSpent {};

// For SimulateOptions::progress, which is `told` besides: from now on so many CPU s of work, then BudgetSpent.
inline std::function<void(double)> give_up_after(double seconds, std::function<void(double)> told = {}) {
  return [until = work_seconds() + seconds, told = std::move(told)](double time) {
    if (told) told(time);
    if (work_seconds() > until) throw BudgetSpent{};
  };
}

// Whether a run shows that it will take more than its budget: after a quarter of it by half as much again, as steps are not as long
// everywhere. taken: of it so far; to_come: what its end is away at the pace so far.
inline bool shows_too_long(double taken, double to_come, double budget) {
  return taken > budget || (taken > 0.25 * budget && taken + to_come > 1.5 * budget);
}

// As give_up_after, and already where the run shows that it will take longer: by its pace since it last began anew, as runs are made again
// with other weights or effects. duration: of the run, s.
inline std::function<void(double)> give_up_when_late(double seconds, double duration, std::function<void(double)> told = {}) {
  struct Pass {
    double begun, time = 0.0;
  };
  const double start = work_seconds();
  // Copies are told of one and the same run.
  return [=, told = std::move(told), pass = std::make_shared<Pass>(Pass{start})](double time) {
    if (told) told(time);
    const double now = work_seconds();
    if (time < pass->time) pass->begun = now;
    pass->time = time;
    const double to_come = time > 0.0 ? (now - pass->begun) * (duration - time) / time : 0.0;
    if (shows_too_long(now - start, to_come, seconds)) throw BudgetSpent{};
  };
}

}  // namespace flexframe::sim
