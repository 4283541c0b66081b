#include "sim/time/system.h"

#include "sim/base/sized.h"
#include "sim/base/work_clock.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/dynamics/stops.h"
#include "sim/model/joint_motion.h"
#include "sim/time/unpack.h"

#include <algorithm>
#include <cmath>
#include <variant>

namespace flexframe::sim {

namespace {

// Independent rates of all clusters out of `from` into their places among all rates, and back from what was evaluated.
const double* take_rates(System& system, const double* from, VecX& rates) {
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const Cluster& cluster = system.model.clusters[c];
    ClusterWork& cw = system.work.clusters[c];
    double* const to = rates.data() + cluster.v0;
    if (cluster.nv == 1 && cw.partition.dep.empty()) *to = *from++;
    else if (cw.partition.dep.empty()) from = (copy_few(from, cluster.nv, to), from + cluster.nv);
    else
      for (const auto& [first, n] : plan_of(system.model, static_cast<int>(c), cw).runs) from = (copy_few(from, n, to + first), from + n);
  }
  return from;
}
double* give_rates(const System& system, const VecX& rates, double* to) {
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const Cluster& cluster = system.model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    const double* const from = rates.data() + cluster.v0;
    if (cluster.nv == 1 && cw.partition.dep.empty()) *to++ = *from;
    else if (cw.partition.dep.empty()) to = (copy_few(from, cluster.nv, to), to + cluster.nv);
    else
      for (const auto& [first, n] : cw.plan.runs) to = (copy_few(from + first, n, to), to + n);
  }
  return to;
}

}  // namespace

void unpack_state(System& system, const double* y) {
  Work& work = system.work;
  std::copy_n(y, system.model.nq, work.q.data());
  const double* const w = take_rates(system, y + system.model.nq, work.w);
  if (system.model.nz > 0) work.signals.z = Eigen::Map<const VecX>(w, system.model.nz);
}

int state_size(const System& system) {
  size_t n = system.model.nq;
  for (const ClusterWork& c : system.work.clusters) n += c.partition.ind.size();
  return static_cast<int>(n) + system.model.nz + (system.quadrature ? 2 : 0);
}

VecX pack_state(const System& system, const Eigen::Vector2d& work_done) {
  VecX y(state_size(system));
  y.head(system.model.nq) = system.work.q;
  VecX w = system.work.w;
  reduce_rates(system.model, w);
  int at = system.model.nq;
  for (size_t c = 0; c < system.model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) y[at++] = w[system.model.clusters[c].v0 + k];
  y.segment(at, system.model.nz) = system.work.signals.z;
  if (system.quadrature) y.tail<2>() = work_done;
  return y;
}

namespace {

template <class W>
void accelerate(System& system, W& work) {
  if (system.friction.points.empty()) update_accelerations(system.model, work);
  else update_friction_accelerations(system.model, system.friction, work);
}

// Positions and velocities from the state in `work`. In a plane everything has inertia (make_system).
template <class W>
void move(const Model& model, W& work) {
  update_positions(model, work);
  update_velocities(model, work);
  if constexpr (std::is_same_v<W, Work>) expand_rates(model, work);
}

// Everything from the state in `work` on, W supplied and dissipated too.
template <class W>
void evaluate(System& system, W& work, double& supplied, double& dissipated) {
  move(system.model, work);
  if (system.friction.points.empty()) update_accelerations_alone(system.model, work);
  else update_friction_accelerations(system.model, system.friction, work, true);
  if (!system.quadrature) return;
  supplied = work.applied;
  if (system.driven) {
    supplied += motion_power(system.model, work);
  }
  dissipated = dissipated_power(system.model, work);
}

}  // namespace

void set_state(System& system, double t, const double* y, bool accelerations) {
  unpack_state(system, y);
  update_expressions(system.model, t, system.work);
  move(system.model, system.work);
  if (accelerations) update_system_accelerations(system);
}

void set_rates(System& system, double t, const double* y) {
  if (!system.plane) return set_state(system, t, y, false);
  unpack_state(system, y);
  update_expressions(system.model, t, system.work);
  PlaneWork work(system.work, *system.plane);
  move(system.model, work);
}

void require_closed_loops(System& system, double t, const double* y) {
  const Model& model = system.model;
  const auto require_all = [&](auto& work) {
    for (size_t c = 0; c < model.clusters.size(); ++c) require_closed(model, static_cast<int>(c), work);
  };
  if (!system.plane) {
    set_state(system, t, y, false);
    return require_all(system.work);
  }
  unpack_state(system, y);
  update_expressions(system.model, t, system.work);
  PlaneWork work(system.work, *system.plane);
  update_positions(model, work);
  require_all(work);
}

void update_system_accelerations(System& system) { accelerate(system, system.work); }

VecX repack_state(System& system, const VecX& old, const std::vector<Partition>& before) {
  VecX y = pack_state(system, system.quadrature ? Eigen::Vector2d(old.tail<2>()) : Eigen::Vector2d(0.0, 0.0));
  system.weights.repack(system, before, old.size(), y.size());
  return y;
}

void state_rate(System& system, double t, const double* y, double* dy) {
  ++system.evaluations;
  count_work(system.price);
  unpack_state(system, y);
  update_expressions(system.model, t, system.work);
  double supplied = 0.0, dissipated = 0.0;
  if (system.plane) {
    PlaneWork work(system.work, *system.plane);
    evaluate(system, work, supplied, dissipated);
  } else {
    evaluate(system, system.work, supplied, dissipated);
  }
  const Work& work = system.work;
  for (const Part& p : system.model.parts) {
    // Where they are as many, and no orientation is among them, rates are derivatives of coordinates.
    if (p.joint.nq == 1 && p.joint.nv == 1) dy[p.q0] = work.w[p.v0];
    else if (p.joint.nq == p.joint.nv)
      for (int k = 0; k < p.joint.nv; ++k) dy[p.q0 + k] = work.w[p.v0 + k];
    else coordinate_rates(p.joint.kind, y + p.q0, work.w.data() + p.v0, dy + p.q0);
    if (p.body.n > 0) copy_few(work.w.data() + p.ev0, p.body.n, dy + p.eq0);
  }
  double* dw = give_rates(system, work.wdot, dy + system.model.nq);
  for (int k = 0; k < system.model.nz; ++k) *dw++ = work.signals.zdot[k];
  if (system.quadrature) {
    *dw++ = supplied;
    *dw++ = dissipated;
  }
}

void accelerate_beside(System& system, const double* y, bool masses, double* wdot) {
  ++system.evaluations;
  count_work(system.price);
  Work& own = system.work;
  take_rates(system, y + system.model.nq, own.w);
  const auto make = [&](auto& work) {
    update_velocities(system.model, work);
    if (masses) update_accelerations(system.model, work);
    else update_accelerations_alone(system.model, work);
  };
  if (system.plane) {
    PlaneWork work(own, *system.plane);
    make(work);
  } else {
    make(own);
  }
  give_rates(system, own.wdot, wdot);
}

namespace {

bool time_enters(const Model& model) {
  for (const Part& p : model.parts)
    if (p.joint.motion >= 0) return true;
  for (const Load& load : model.loads)
    if (load.expression >= 0 || load.rest >= 0) return true;
  return !model.blocks.empty();
}

}  // namespace

void keep_load_responses(System& system, VecX& kept) {
  kept.resize(0);
  // Friction follows the reactions, and with them the loads.
  if (system.model.loads.empty() || !system.friction.points.empty() || !all_have_inertia(system.model)) return;
  if (!system.plane) return load_responses(system.model, system.work, kept);
  PlaneWork work(system.work, *system.plane);
  load_responses(system.model, work, kept);
}

bool follow_loads(System& system, double t0, double t, const VecX& kept, double* dy) {
  const Model& model = system.model;
  if (!time_enters(model)) return true;
  if (kept.size() == 0 || !model.blocks.empty()) return false;
  const Eigen::Index loads = static_cast<Eigen::Index>(model.loads.size()), n = kept.size() / loads - 1;
  for (Eigen::Index i = 0; i < loads; ++i) {
    const Load& load = model.loads[i];
    if (load.rest >= 0 || (load.function >= 0 && model.functions[load.function].expression.depends_on_time())) return false;
    if (load.expression < 0) continue;
    const double change = model.expressions[load.expression].value(t) - model.expressions[load.expression].value(t0);
    if (change == 0.0) continue;
    const auto column = kept.segment(i * (n + 1), n + 1);
    if (std::isnan(column[n])) return false;
    Eigen::Map<VecX>(dy + model.nq, n) += change * column.head(n);
    if (system.quadrature) dy[model.nq + n] += change * column[n];
  }
  return true;
}

void update_massless_accelerations(System& system, double t, const VecX& y) {
  const Model& model = system.model;
  if (all_have_inertia(model)) return;
  VecX dy(y.size());
  state_rate(system, t, y.data(), dy.data());
  // Short against what is output, long against the rounding of the rates (1e-12 of them).
  const double h = std::clamp(1e-5 * model.settings.duration, 1e-7, 1e-4);
  const auto rates_beside = [&](double s) {
    const VecX at = y + s * dy;
    set_state(system, t + s, at.data(), false);
    return system.work.w;
  };
  const VecX before = rates_beside(-h), after = rates_beside(h);
  set_state(system, t, y.data(), true);
  system.work.wdot += massless_part(model, after - before) / (2.0 * h);
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    update_base_acceleration(model, static_cast<int>(c), system.work);
    update_cluster_accelerations(model, static_cast<int>(c), system.work);
  }
}

bool renew_partitions(System& system, double t, const VecX& y) {
  bool changed = false, here = false;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const int cluster = static_cast<int>(c);
    ClusterWork& cw = system.work.clusters[c];
    if (cw.partition.dep.empty()) continue;
    if (partition_growth(system.model, cluster, system.work) < largest_growth) continue;
    if (!here) set_state(system, t, y.data(), false);
    here = true;
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

bool stays_in_equilibrium(const System& system) {
  const Scene& scene = system.scene;
  const Model& model = system.model;
  const auto given = [](const BodyDef& body) {
    return std::visit(
        [](const auto& kind) {
          if constexpr (requires { kind.initial; }) return !kind.initial.q.empty() || !kind.initial.qd.empty();
          else return false;
        },
        body.kind);
  };
  return scene.simulation.static_start && model.functions.empty() && model.blocks.empty() &&
         std::all_of(model.expressions.begin(), model.expressions.end(), [](const TimeFunction& f) { return f.constant(); }) &&
         std::none_of(model.loads.begin(), model.loads.end(), [](const Load& l) { return l.def.kind == ForceKind::user; }) &&
         std::none_of(scene.joints.begin(), scene.joints.end(), [](const JointDef& j) { return j.initial.value || j.initial.rate; }) &&
         std::none_of(scene.bodies.begin(), scene.bodies.end(), given);
}

}  // namespace flexframe::sim
