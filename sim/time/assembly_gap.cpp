#include "sim/time/assembly_gap.h"

#include "sim/base/small_matrices.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/loop_descent.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// A place in which a cluster's loops are closed, and the side of the partition's singular positions on which it lies.
struct Place {
  double t = 0.0;
  VecX q;
  int side = 0;
};

// At the positions in work.
Place place_here(const Model& model, int cluster, double t, Work& work) {
  update_closure_matrix(model, cluster, work);
  const ClusterWork& cw = work.clusters[cluster];
  MatX D = cw.G(cw.partition.rows, cw.partition.dep);
  return {t, work.q, invert(D)};
}

// The farthest that a coordinate of a cluster's joints goes from one place to the other, in metres.
double distance(const Model& model, const Cluster& c, const VecX& a, const VecX& b) {
  double out = 0.0;
  for (const int i : c.parts) {
    const Part& p = model.parts[i];
    for (int k = 0; k < p.joint.nq; ++k)
      out = std::max(out, std::abs(a[p.q0 + k] - b[p.q0 + k]) * (is_length(p.joint.kind, k) ? 1.0 : c.size));
  }
  return out;
}

// The loops of one cluster closed halfway between two places, the independent coordinates and the time in the middle; false where that
// fails.
bool halfway(Model& model, int cluster, const Place& a, const Place& b, Work& work, Place& out) {
  const Cluster& c = model.clusters[cluster];
  std::vector<int> columns;
  for (const int k : work.clusters[cluster].partition.dep)
    if (rate_scale(model, cluster, k) > 0.0) columns.push_back(k);
  const double t = 0.5 * (a.t + b.t);
  update_expressions(model, t, work);
  work.q = 0.5 * (a.q + b.q);
  // Redundant conditions of elastic bodies may stay open by more: then steps become short instead.
  if (descend(model, cluster, columns, work) > 1e-6 * c.size) return false;
  out = place_here(model, cluster, t, work);
  return true;
}

}  // namespace

bool leads_on(System& system, int cluster, const StateAt& from, const StateAt& to) {
  Model& model = system.model;
  const Cluster& c = model.clusters[cluster];
  // Loops are closed to 3e-13 of the size, beside a singular position their coordinates to the square root of that.
  const double together = 1e-6 * c.size;
  try {
    set_state(system, from.t, from.y, false);
    Place a = place_here(model, cluster, from.t, system.work);
    set_state(system, to.t, to.y, false);
    Place b = place_here(model, cluster, to.t, system.work), middle;
    // The state that the step sets out from closes beyond by itself, or exactly there.
    if (a.side != system.work.clusters[static_cast<size_t>(cluster)].partition.side) return distance(model, c, a.q, b.q) <= together;
    // Where the way has no gap, halves are half as long.
    constexpr double too_long = 0.75;
    constexpr int too_often = 3;
    double last = 2.0 * distance(model, c, a.q, b.q);
    for (int slow = 0; a.side != b.side;) {
      const double apart = distance(model, c, a.q, b.q);
      if (apart <= together) return true;
      if (apart > too_long * last && ++slow > too_often) return false;
      last = apart;
      if (!halfway(model, cluster, a, b, system.work, middle)) return false;
      (middle.side == b.side ? b : a) = middle;
    }
    return true;
  } catch (const SimulationError&) {
    return false;
  }
}

std::string assembly_gap(const System& system, int cluster, double t) {
  return fmt::format(
      "the loop of {} cannot be closed at t = {:.6g} s in the way in which it is assembled, only in another one: the mechanism reaches a "
      "dead point there, the limit of its reach; if it should go on, another way to assemble its loop may be meant: choose it by initial "
      "= {{ guess = ... }}",
      closure_of(system.model, system.model.clusters[cluster]), t);
}

}  // namespace flexframe::sim
