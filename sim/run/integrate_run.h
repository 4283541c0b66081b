// One run of a system from its assembled start: segments between known switches, located events, new partitions, choice of method.
#pragma once

#include "sim/results/results.h"
#include "sim/time/system.h"

#include <functional>
#include <vector>

namespace flexframe::sim {

// Integrates a system from its assembled start; calls sample at each of the times, in order. Where it fails, `indefinite` is the scene's body
// whose kinetic energy was found not to be positive, if one was.
SolverStatistics integrate(System& system, Method method, const std::vector<double>& times, const std::function<void(double)>& progress,
                           const std::function<void(System&, double, const VecX&)>& sample, int& indefinite);

}  // namespace flexframe::sim
