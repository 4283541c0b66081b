#include "sim/run/stop_springs.h"

#include "sim/dynamics/contacts.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// The same of what contacts press: every coordinate that moves one of the bodies that meet.
void add_contacts(const System& system, std::vector<StopSpring>& out) {
  const Model& model = system.model;
  std::vector<Eigen::Index> place(model.nv, -1);
  Eigen::Index at = model.nq;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (const int k : system.work.clusters[c].partition.ind) place[model.clusters[c].v0 + k] = at++;
  for (size_t k = 0; k < model.contacts.size(); ++k) {
    if (system.work.signals.contacts[k].phase == ContactPhase::apart) continue;
    const double frequency = contact_frequency(model, system.work, static_cast<int>(k));
    const Load& load = model.loads[model.contacts[k].load];
    for (const int frame : {load.on, load.from})
      for (int i = model.frames[frame].part; i != ground; i = model.parts[i].parent) {
        const Part& part = model.parts[i];
        for (int c = 0; c < std::min(part.joint.nq, part.joint.nv); ++c)
          if (const Eigen::Index rate = place[part.v0 + c]; rate >= 0) out.push_back({part.q0 + c, rate, frequency});
      }
  }
}

}  // namespace

std::vector<StopSpring> find_touched(System& system, double t, const VecX& y) {
  std::vector<StopSpring> out;
  VecX beside = y, rates, pushed;
  for (const int i : system.stops) {
    const Part& part = system.model.parts[i];
    if (system.work.joints[i].stop == StopPhase::free) continue;
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
  add_contacts(system, out);
  return out;
}

}  // namespace flexframe::sim
