// The springs of stops and contacts that are touched at a state, for the weights of the errors of what hits them.
#pragma once

#include "sim/time/system.h"

#include <vector>

namespace flexframe::sim {

// A stop that is touched: coordinate and rate in the state, and how fast its spring lets what hits it vibrate, rad/s. A blow is over within
// half such a vibration, and less deep than its speed over the frequency: an error of the depth that is small against the way makes a
// large one of the speed afterwards (a ball on 1e8 N/m gained 4e-6 of its energy in every blow at a tolerance of 1e-6). So the
// coordinate is asked for no less than its rate is.
struct StopSpring {
  Eigen::Index q = 0, rate = 0;
  double frequency = 0.0;
};

// All of them at (t, y). `system.work` is left beside the state.
std::vector<StopSpring> find_touched(System& system, double t, const VecX& y);

}  // namespace flexframe::sim
