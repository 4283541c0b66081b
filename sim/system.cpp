#include "sim/system.h"

#include "sim/assembly.h"
#include "sim/closure.h"
#include "sim/dynamics.h"
#include "sim/joint_motion.h"
#include "sim/kinematics.h"
#include "sim/loads.h"
#include "sim/model_build.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Whether anything supplies or takes out energy besides gravity and springs.
bool has_power(const Model& model) {
  if (!model.loads.empty()) return true;
  for (const Part& p : model.parts)
    if (p.body.De.size() > 0 || p.joint.spring || p.joint.stop || p.joint.friction || p.joint.bending_damping.size() > 0) return true;
  return false;
}

// Extent of a body's nodes, m.
double part_reach(const FlexibleBody& body) {
  Eigen::AlignedBox3d box;
  for (const FlexibleNode& node : body.nodes) box.extend(node.origin);
  return body.nodes.empty() ? 0.0 : box.diagonal().norm();
}

// Largest displacement of a node per unit of each elastic coordinate, m; for pure twists the rotation times the body's size.
VecX displacement_per_coordinate(const FlexibleBody& body, double size) {
  VecX out = VecX::Zero(body.n), turn = VecX::Zero(body.n);
  for (const FlexibleNode& node : body.nodes) {
    out = out.cwiseMax(node.phi.colwise().norm().transpose());
    turn = turn.cwiseMax(size * node.psi.colwise().norm().transpose());
  }
  for (int k = 0; k < body.n; ++k)
    if (out[k] < 1e-6 * turn[k]) out[k] = turn[k];
    else if (out[k] == 0.0) out[k] = 1.0;
  return out;
}

// Whether coordinate k of a joint is a length (else an angle or part of a quaternion).
bool length_coordinate(JointKind kind, int k) {
  return kind == JointKind::prismatic || (kind == JointKind::cylindrical && k == 0) || (kind == JointKind::planar && k < 2) ||
         (kind == JointKind::free && k < 3);
}

void unpack(System& system, const double* y) {
  Work& work = system.work;
  work.q = Eigen::Map<const VecX>(y, system.model.nq);
  const double* w = y + system.model.nq;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const int v0 = system.model.clusters[c].v0;
    for (int k : work.clusters[c].partition.ind) work.w[v0 + k] = *w++;
  }
}

}  // namespace

System make_system(const Scene& scene) {
  System system;
  system.scene = scene;
  system.model = build_model(scene);
  system.work = make_work(system.model);
  system.notes = system.model.notes;
  for (Expression& e : system.model.expressions) {
    const std::vector<double> switches = e.switch_times(0.0, scene.simulation.duration);
    const double end = switches.empty() ? scene.simulation.duration : switches.front();
    e.freeze(0.5 * end);
  }
  assemble(system.model, system.scene, system.work, system.notes);
  system.quadrature = has_power(system.model);
  system.tolerance = scene.simulation.tolerance.value_or(default_tolerance);
  return system;
}

int rate_offset(const System& system) { return system.model.nq; }

int state_size(const System& system) {
  size_t n = system.model.nq;
  for (const ClusterWork& c : system.work.clusters) n += c.partition.ind.size();
  return static_cast<int>(n) + (system.quadrature ? 2 : 0);
}

VecX pack_state(const System& system, const Eigen::Vector2d& work_done) {
  VecX y(state_size(system));
  y.head(system.model.nq) = system.work.q;
  int at = system.model.nq;
  for (size_t c = 0; c < system.model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) y[at++] = system.work.w[system.model.clusters[c].v0 + k];
  if (system.quadrature) y.tail<2>() = work_done;
  return y;
}

void set_state(System& system, double t, const double* y, bool accelerations) {
  unpack(system, y);
  update_expressions(system.model, t, system.work);
  update_positions(system.model, system.work);
  update_velocities(system.model, system.work);
  if (accelerations) update_accelerations(system.model, system.work);
}

void state_rate(System& system, double t, const double* y, double* dy) {
  set_state(system, t, y, true);
  const Work& work = system.work;
  for (const Part& p : system.model.parts) {
    if (p.joint.nq > 0) coordinate_rates(p.joint.kind, y + p.q0, work.w.data() + p.v0, dy + p.q0);
    for (int k = 0; k < p.body.n; ++k) dy[p.eq0 + k] = work.w[p.ev0 + k];
  }
  double* dw = dy + system.model.nq;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const int v0 = system.model.clusters[c].v0;
    for (int k : work.clusters[c].partition.ind) *dw++ = work.wdot[v0 + k];
  }
  if (system.quadrature) {
    *dw++ = applied_power(system.model, work);
    *dw++ = dissipated_power(system.model, work);
  }
}

// Sizes by group, so that a coordinate passing through zero is not resolved to nothing, and a small one beside large ones not to
// more than its share: joint coordinates one by one, elastic coordinates by the displacement they cause, against the largest
// elastic displacement in the same mechanism.
//
// An error in the rate of something of frequency f becomes one of rate / f in its position. Rates of fast vibration are asked for
// their position's accuracy only, else the integrator resolves vibrations that nobody can see; and so are the rates of joints on
// vibrating bodies, which shake along.
void update_scale(System& system, const VecX& y) {
  const Model& model = system.model;
  VecX& scale = system.scale;
  if (scale.size() != y.size()) scale = VecX::Zero(y.size());
  std::vector<int> rate_of(model.nv, -1);
  int at = model.nq;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) rate_of[model.clusters[c].v0 + k] = at++;
  // A run's slowest rate of interest: sizes of rates start at (size of the coordinate) / duration.
  const double slow = 1.0 / model.settings.duration;

  // Parts that shake each other: trees that hang on ground.
  std::vector<int> tree(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) tree[i] = model.parts[i].parent == ground ? static_cast<int>(i) : tree[model.parts[i].parent];
  for (const Cluster& c : model.clusters)
    for (int i : c.parts) tree[i] = tree[c.parts.front()];
  std::vector<double> shake(model.parts.size(), 0.0);  // rad/s
  std::vector<double> moved(model.parts.size(), 0.0), speed(model.parts.size(), 0.0);  // largest elastic displacement (m) and rate of a tree
  std::vector<VecX> reaches(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    const double size = std::max(part_reach(p.body), 1e-300);
    reaches[i] = displacement_per_coordinate(p.body, size);
    double& m = moved[tree[i]];
    double& s = speed[tree[i]];
    // A hundred-thousandth of the body is the least deformation worth resolving to the relative tolerance.
    m = std::max(m, 1e-5 * size);
    s = std::max(s, 1e-5 * size * slow);
    for (int k = 0; k < p.body.n; ++k) {
      m = std::max(m, reaches[i][k] * std::abs(y[p.eq0 + k]));
      if (rate_of[p.ev0 + k] >= 0) s = std::max(s, reaches[i][k] * std::abs(y[rate_of[p.ev0 + k]]));
    }
  }
  // The tolerance is one of positions, relative to the mechanism's size; elastic displacements are much smaller and would go
  // uncontrolled at loose tolerances, so that they are asked for tolerance^(2/3) of their own range at least.
  const double loosest = std::cbrt(1.0 / system.tolerance);
  for (double& m : moved) m *= std::clamp(model.size / std::max(m, 1e-300), 1.0, loosest);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    const VecX& reach = reaches[i];
    const double size = std::max(part_reach(p.body), 1e-300);
    for (int k = 0; k < p.body.n; ++k) {
      double& q = scale[p.eq0 + k];
      q = std::max(q, moved[tree[i]] / reach[k]);
      const double frequency = std::sqrt(std::max(0.0, p.body.Ke(k, k)) / p.body.Me(k, k));
      shake[tree[i]] = std::max(shake[tree[i]], frequency * q * reach[k] / size);
      if (rate_of[p.ev0 + k] < 0) continue;
      double& rate = scale[rate_of[p.ev0 + k]];
      rate = std::max({rate, speed[tree[i]] / reach[k], frequency * q});
    }
  }
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    const double cluster_size = model.clusters[p.cluster].size;
    for (int k = 0; k < p.joint.nq; ++k) {
      // A thousandth of a radian, or of the mechanism, is the least motion worth resolving to the relative tolerance.
      const double least = 1e-3 * (length_coordinate(p.joint.kind, k) ? cluster_size : 1.0);
      scale[p.q0 + k] = std::max({scale[p.q0 + k], least, std::abs(y[p.q0 + k])});
    }
    for (int k = 0; k < p.joint.nv; ++k) {
      const int r = rate_of[p.v0 + k];
      if (r < 0) continue;
      const double unit = length_coordinate(p.joint.kind, k) ? cluster_size : 1.0;
      scale[r] = std::max({scale[r], 1e-3 * slow * unit, shake[tree[i]] * unit, std::abs(y[r])});
    }
  }
  // Work is integrated along, but takes no part in choosing steps: nothing depends on it.
  if (system.quadrature) scale.tail<2>().setConstant(1e100);
}

void error_weights(const System& system, const double*, double* weight) {
  for (int i = 0; i < system.scale.size(); ++i) weight[i] = 1.0 / (system.tolerance * system.scale[i]);
}

bool renew_partitions(System& system) {
  bool changed = false;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const int cluster = static_cast<int>(c);
    ClusterWork& cw = system.work.clusters[c];
    if (cw.partition.dep.empty()) continue;
    // Dependent coordinates that run ten times as fast as the independent ones amplify their error as much.
    if (partition_growth(system.model, cluster, system.work) < 10.0) continue;
    const Partition next = choose_partition(system.model, cluster, system.work, true);
    if (next.dep.size() != cw.partition.dep.size()) continue;
    std::vector<int> a = next.dep, b = cw.partition.dep;
    std::sort(a.begin(), a.end());
    std::sort(b.begin(), b.end());
    if (a == b) continue;
    cw.partition = next;
    close_positions(system.model, cluster, system.work);
    changed = true;
  }
  return changed;
}

}  // namespace flexframe::sim
