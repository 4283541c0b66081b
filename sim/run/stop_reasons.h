// Why an integration cannot go on: half sentences for its last words.
#pragma once

#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// What most likely makes the steps small at (t, y); `complaint`: of the last evaluation that failed, if one did.
std::string likely_cause(System system, double t, const VecX& y, const std::string& complaint);

// The part of whose inertia deformation has taken most, if all but a thousandth along some coordinate (the steps then become too small): -1
// if none.
int lost_inertia(System& system);

// What finds no phase that holds: joints whose friction or stop has a direction below zero (EventWatch::directions).
std::string unsettled_phases(const System& system, const std::vector<int>& directions);

}  // namespace flexframe::sim
