// Keeps a run in the way in which its loops are assembled. Too long a step may foretell a place from which a loop closes in another way
// than the one in which it is, and the motion would go on there, smooth and wrong. The sign of the determinant of what closes a loop tells:
// along a motion it changes in a change point only (a parallelogram that lies flat), for partitions are renewed long before they are
// singular themselves.
#pragma once

#include "sim/dynamics/closure.h"
#include "sim/time/system.h"

#include <algorithm>
#include <string>

namespace flexframe::sim {

// A state (system.h) at its time.
struct StateAt {
  double t;
  const double* y;
};

// Whether the loops of some cluster were closed last beyond a singular position of its partition (closure.h: crossed).
inline bool any_crossed(const System& system) {
  return std::any_of(system.work.clusters.begin(), system.work.clusters.end(), [](const ClusterWork& c) { return crossed(c); });
}

// Whether a cluster's loops come from one state to another without a gap: the way between, its independent coordinates straight on, is
// halved to where the determinant changes its sign, and there the dependent ones have to meet. `system.work` is left elsewhere.
bool leads_on(System& system, int cluster, const StateAt& from, const StateAt& to);

// What a run that cannot be kept from it is told; t: when, s.
std::string assembly_gap(const System& system, int cluster, double t);

}  // namespace flexframe::sim
