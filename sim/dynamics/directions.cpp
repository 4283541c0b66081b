#include "sim/dynamics/directions.h"

#include "sim/dynamics/closure.h"
#include "sim/model/joint_motion.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Largest displacement of a node per unit of an elastic coordinate, m. Pure twists displace no node of the axis: their rotation times the
// cluster's size.
double elastic_scale(const Part& part, int k, double size) {
  double reach = 0.0, turn = 0.0;
  for (const FlexibleNode& node : part.body.nodes) {
    reach = std::max(reach, node.phi.col(k).norm());
    turn = std::max(turn, node.psi.col(k).norm());
  }
  if (reach < 1e-6 * size * turn) reach = size * turn;
  return reach > 0.0 ? reach : 1.0;
}

}  // namespace

VecX rate_sizes(const Model& model) {
  VecX out(model.nv);
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int i : model.clusters[c].parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nv; ++k) out[p.v0 + k] = rate_scale(model, static_cast<int>(c), p.v0 + k - model.clusters[c].v0);
      for (int k = 0; k < p.body.n; ++k) out[p.ev0 + k] = elastic_scale(p, k, model.clusters[c].size);
    }
  return out;
}

std::vector<Direction> independent_directions(const Model& model, const Work& work) {
  std::vector<Direction> out;
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const Cluster& cluster = model.clusters[c];
    for (int k : work.clusters[c].partition.ind) {
      const int v = cluster.v0 + k;
      Direction d;
      d.v = v;
      for (int i : cluster.parts) {
        const Part& p = model.parts[i];
        if (v >= p.v0 && v < p.v0 + p.joint.nv) {
          d.part = i;
          d.rate = v - p.v0;
          d.scale = rate_scale(model, static_cast<int>(c), k);
        } else if (v >= p.ev0 && v < p.ev0 + p.body.n) {
          d.part = i;
          d.rate = -1 - (v - p.ev0);
          d.scale = elastic_scale(p, v - p.ev0, cluster.size);
        }
      }
      out.push_back(d);
    }
  }
  return out;
}

void move_along(const Model& model, const Direction& d, double step, Work& work) {
  const Part& p = model.parts[d.part];
  if (d.rate < 0) {
    work.q[p.eq0 - 1 - d.rate] += step;
    return;
  }
  double dw[6] = {};
  dw[d.rate] = step;
  move_coordinates(p.joint.kind, work.q.data() + p.q0, dw);
}

}  // namespace flexframe::sim
