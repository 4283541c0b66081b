// A run beside another that may take only so much work.
#pragma once

#include "sim/base/work_clock.h"

#include <functional>
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

}  // namespace flexframe::sim
