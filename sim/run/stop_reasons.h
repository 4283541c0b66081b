// Why an integration cannot go on: half sentences for its last words.
#pragma once

#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// What most likely makes the steps small at (t, y), where the run has come to; `complaint`: of the evaluation that failed last, where none
// has succeeded since. Never empty.
std::string likely_cause(const System& system, double t, const VecX& y, const std::string& complaint);

// The part whose second-order kinetic energy deformation has taken at (t, y), or with it that of the whole mechanism along some direction:
// not positive any more, or less than a tenth of what it is along the same direction with the masses of undeformed bodies.
// Accelerations then grow without bound and the steps become too small. -1 if none.
int lost_inertia(System system, double t, const VecX& y);

// The body whose material turns farthest in its frame at (t, y), by more than a radian, and what to use instead; empty if none. What cannot
// be closed or integrated there may be so for this alone.
std::string bent_too_far(System system, double t, const VecX& y);

// What finds no phase that holds: joints whose friction or stop has a direction below zero (EventWatch::directions).
std::string unsettled_phases(const System& system, const std::vector<int>& directions);

}  // namespace flexframe::sim
