#include "sim/run/stop_springs.h"

#include <cmath>

namespace flexframe::sim {

std::vector<StopSpring> find_touched(System& system, double t, const VecX& y) {
  std::vector<StopSpring> out;
  VecX beside = y, rates, pushed;
  for (const int i : system.stops) {
    const Part& part = system.model.parts[static_cast<size_t>(i)];
    if (system.work.joints[static_cast<size_t>(i)].stop == StopPhase::free) continue;
    Eigen::Index rate = -1, at = system.model.nq;
    for (size_t c = 0; c < system.model.clusters.size(); ++c)
      for (const int k : system.work.clusters[c].partition.ind) {
        if (system.model.clusters[c].v0 + k == part.v0) rate = at;
        ++at;
      }
    if (rate < 0) continue;
    // The spring is linear: any step shows its stiffness over the mass that moves with it.
    const double step = 1e-6 * system.weights.size(part.q0);
    rates.resize(y.size());
    pushed.resize(y.size());
    state_rate(system, t, y.data(), rates.data());
    beside[part.q0] += step;
    state_rate(system, t, beside.data(), pushed.data());
    beside[part.q0] = y[part.q0];
    if (const double square = (rates[rate] - pushed[rate]) / step; square > 0.0) out.push_back({part.q0, rate, std::sqrt(square)});
  }
  return out;
}

}  // namespace flexframe::sim
