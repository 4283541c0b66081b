#include "sim/dynamics/closure.h"

#include "sim/base/four.h"
#include "sim/base/sized.h"
#include "sim/dynamics/chain.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/places.h"
#include "sim/dynamics/velocities.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <numeric>
#include <span>

namespace flexframe::sim {
namespace {

// Pose of frame b in frame a.
template <class W>
typename W::In::Pose relative_pose(const Model& model, const W& work, int cluster, int a, int b) {
  return compose(inverse(frame_in_base(model, work, cluster, a)), frame_in_base(model, work, cluster, b));
}

double row_residual(const ClosureRow& row, const Pose& r) {
  switch (row.kind) {
    case ClosureRow::translation:
      return row.u.dot(r.p);
    case ClosureRow::angle:
      return row.u.dot(r.R * row.b);
    default:
      return (r.p.squaredNorm() - row.length * row.length) / (2.0 * row.length);
  }
}
double row_residual(const PlaneRow& row, const PlanePose& r) {
  switch (row.kind) {
    case ClosureRow::translation:
      return row.u.dot(r.p) + row.constant;
    case ClosureRow::angle:
      return row.u.dot(turn(r, row.b)) + row.constant;
    default:
      return (r.p.squaredNorm() + row.height2 - row.length * row.length) / (2.0 * row.length);
  }
}

// As LoopRow has them.
template <class S>
struct RowDirection {
  typename S::Linear lv;
  typename S::Angular lw;
};
template <class S, class Row>
FLEXFRAME_INLINE RowDirection<S> row_direction(const Row& row, const typename S::Pose& r) {
  RowDirection<S> out{S::Linear::Zero(), S::no_turn()};
  if (row.kind == ClosureRow::translation) out.lv = row.u;
  if (row.kind == ClosureRow::distance) out.lv = r.p / row.length;
  if (row.kind == ClosureRow::angle) out.lw = cross(turn(r, row.b), row.u);
  return out;
}

// A force and moment on b (axes of a, about b's origin) and their reaction on a, each in its frame's axes.
template <class PoseIn, class Linear, class Angular, class Twist>
void row_wrench(const PoseIn& r, const Linear& force, const Angular& moment, Twist& on_a, Twist& on_b) {
  on_b = joined(turn_back(r, force), turn_back(r, moment));
  on_a = joined(Linear(-force), Angular(-(moment + cross(r.p, force))));
}

// Coordinate of a coupling's term or its function of that, the rate, and the acceleration as far as no rate's acceleration makes it.
template <class W>
TimeJet coupled(const Model& model, const W& work, const CouplingRow::Term& term) {
  const Part& part = model.parts[term.part];
  TimeJet x{work.q[part.q0 + term.rate], work.w[part.v0 + term.rate], 0.0};
  if (part.joint.motion >= 0) x = work.motion[part.joint.motion];
  if (!term.of) return x;
  const TimeJet f = term.of->jet(x.value);
  return {f.value, f.rate * x.rate, f.acceleration * x.rate * x.rate + f.rate * x.acceleration};
}

// Change of the term per change of its coordinate.
template <class W>
double coupled_slope(const W& work, const Part& part, const CouplingRow::Term& term) {
  return term.factor * (term.of ? term.of->jet(work.q[part.q0 + term.rate]).rate : 1.0);
}

// Calls on_stretch(frame a, frame b, pose of b in a, unit vector from a to b in the axes of a, length) for the stretches of a rope. Where
// two of its frames meet there is no direction, and none is pulled.
template <class W, class OnStretch>
void for_stretches(const Model& model, const W& work, int cluster, const CouplingRow& rope, OnStretch&& on_stretch) {
  for (size_t k = 1; k < rope.frames.size(); ++k) {
    const int a = rope.frames[k - 1], b = rope.frames[k];
    const auto rel = relative_pose(model, work, cluster, a, b);
    const double length = rel.p.norm();
    if (length > 0.0) on_stretch(a, b, rel, typename W::In::Linear(rel.p / length), length);
  }
}

// Wrenches on the frames of a rope for a unit of its multiplier, which pushes them apart: on_frame(frame, wrench in its axes).
template <class W, class OnFrame>
void rope_wrenches(const Model& model, const W& work, int cluster, const CouplingRow& rope, OnFrame&& on_frame) {
  using S = typename W::In;
  for_stretches(model, work, cluster, rope, [&](int a, int b, const auto& rel, const auto& u, double) {
    on_frame(a, typename S::Twist(joined(typename S::Linear(-u), S::no_turn())));
    on_frame(b, typename S::Twist(joined(turn_back(rel, u), S::no_turn())));
  });
}

// Per rate of the cluster into ClusterWork::line.
template <class W>
void coupling_line(const Model& model, int cluster, const CouplingRow& coupling, W& work, bool elastic) {
  VecX& line = work.clusters[cluster].line;
  line.setZero();
  for (const CouplingRow::Term& term : coupling.terms)
    if (const Part& part = model.parts[term.part]; part.joint.motion < 0)
      line[part.v0 + term.rate - model.clusters[cluster].v0] += coupled_slope(work, part, term);
  rope_wrenches(model, work, cluster, coupling, [&](int frame, const auto& F) {
    project_wrench(model, work, cluster, {frame, F}, elastic, line);
  });
}

template <class S>
using LoopPoses = std::vector<LoopPose<S>>;

template <class W>
FLEXFRAME_INLINE void update_loop_poses(const Model& model, const W& work, int cluster, LoopPoses<typename W::In>& poses) {
  const std::vector<int>& loops = model.clusters[cluster].loops;
  poses.resize(loops.size());
  for (size_t k = 0; k < loops.size(); ++k) {
    const LoopJoint& loop = model.loops[loops[k]];
    poses[k].a = frame_in_base(model, work, cluster, loop.a);
    poses[k].b = frame_in_base(model, work, cluster, loop.b);
    poses[k].relative = compose(inverse(poses[k].a), poses[k].b);
  }
}

// Rows of a cluster: all, or those of its partition.
struct WhichRows {
  int cluster;
  bool all;
};

// Calls on_loop(row, index of the loop in the cluster, row of that loop), on_coupling(row, coupling) and on_lock(row, index of the locked
// rate) in the order of all rows, or of the partition's, where `row` is the index there.
template <class W, class OnLoop, class OnCoupling, class OnLock>
void for_rows(const Model& model, const W& work, const WhichRows& which, OnLoop&& on_loop, OnCoupling&& on_coupling, OnLock&& on_lock) {
  const Cluster& c = model.clusters[which.cluster];
  const ClusterWork& cw = work.clusters[which.cluster];
  const auto visit = [&](int index, size_t row) {
    for (size_t k = 0; k < c.loops.size(); ++k) {
      const size_t count = model.loops[c.loops[k]].rows.size();
      if (row < count) return on_loop(index, static_cast<int>(k), static_cast<int>(row));
      row -= count;
    }
    if (row < c.couplings.size()) on_coupling(index, model.couplings[c.couplings[row]]);
    else on_lock(index, row - c.couplings.size());
  };
  if (which.all) {
    const int total = closure_row_count(model, work, which.cluster);
    for (int row = 0; row < total; ++row) visit(row, static_cast<size_t>(row));
    return;
  }
  int index = 0;
  for (const int row : cw.partition.rows) visit(index++, static_cast<size_t>(row));
}

// Calls on_coupling and on_lock of for_rows for the partition's rows that are not among those of loops.
template <class W, class OnCoupling, class OnLock>
FLEXFRAME_INLINE void for_other_rows(const Model& model, const W& work, int cluster, const LoopMotion<typename W::In>& loops,
                                     OnCoupling&& on_coupling, OnLock&& on_lock) {
  if (loops.rows.size() < work.clusters[cluster].partition.rows.size())
    for_rows(
        model, work, {cluster, false}, [](int, int, int) {}, on_coupling, on_lock);
}

template <class W>
const LoopJoint& loop_joint(const Model& model, const W&, int cluster, int loop) {
  return model.loops[model.clusters[cluster].loops[static_cast<size_t>(loop)]];
}
template <class W>
const auto& closure_row(const Model& model, const W& work, int cluster, int loop, int at) {
  return loop_rows(model, work, model.clusters[cluster].loops[static_cast<size_t>(loop)])[static_cast<size_t>(at)];
}

// Which rows of loops the partition has, and their constants; all of their other fields follow from poses (update_rows).
template <class W>
void list_rows(const Model& model, const W& work, int cluster, LoopMotion<typename W::In>& out) {
  out.rows.clear();
  out.runs.clear();
  for_rows(
      model, work, {cluster, false},
      [&](int row, int loop, int at) {
        if (out.runs.empty() || out.runs.back().loop != loop) out.runs.push_back({loop, static_cast<int>(out.rows.size()), 0});
        ++out.runs.back().count;
        auto& entry = out.rows.emplace_back();
        entry.row = row, entry.loop = loop, entry.at = at;
        entry.closure = closure_row(model, work, cluster, loop, at);
      },
      [](int, const CouplingRow&) {}, [](int, size_t) {});
}

// Of a row's unit multiplier, on frames a and b.
template <class W>
LoopWrenches<W> unit_wrenches(const RowDirection<typename W::In>& d, const typename W::In::Pose& rel) {
  LoopWrenches<W> out;
  row_wrench(rel, d.lv, d.lw, out.on_a, out.on_b);
  return out;
}

// Everything of the rows that list_rows has found.
template <class S>
FLEXFRAME_INLINE void update_rows(LoopMotion<S>& out) {
  for (LoopRow<S>& row : out.rows) {
    const LoopPose<S>& at = out.poses[static_cast<size_t>(row.loop)];
    const RowDirection<S> d = row_direction<S>(row.closure, at.relative);
    row.lv = d.lv;
    row.lw = d.lw;
    const typename S::Linear force = turn_back(at.relative, d.lv);
    const typename S::Angular moment = turn_back(at.relative, d.lw);
    row.on_b = wrench_to_parent(at.b, joined(force, moment));
  }
}

// The rates of a row with these unit wrenches per rate of the cluster, in ClusterWork::line.
template <class W>
void closure_line(const Model& model, W& work, int cluster, const LoopJoint& loop, const LoopWrenches<W>& unit, bool elastic) {
  VecX& line = work.clusters[cluster].line;
  line.setZero();
  project_wrench(model, work, cluster, {loop.b, unit.on_b}, elastic, line);
  project_wrench(model, work, cluster, {loop.a, unit.on_a}, elastic, line);
}

// The part and joint rate behind rate k of a cluster; elastic rates give rate -1.
std::pair<int, int> rate_owner(const Model& model, int cluster, int k) {
  const Cluster& c = model.clusters[cluster];
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    const int v = c.v0 + k;
    if (v >= p.v0 && v < p.v0 + p.joint.nv) return {i, v - p.v0};
    if (v >= p.ev0 && v < p.ev0 + p.body.n) return {i, -1};
  }
  return {-1, -1};
}

int depth(const Model& model, int part) {
  int d = 0;
  for (int i = model.parts[part].parent; i != ground; i = model.parts[i].parent) ++d;
  return d;
}

}  // namespace

std::string closure_row_name(const Model& model, const ClusterWork& work, int cluster, int row) {
  for (int l : model.clusters[cluster].loops) {
    const LoopJoint& loop = model.loops[l];
    const int n = static_cast<int>(loop.rows.size());
    if (row < n) return loop.name;
    row -= n;
  }
  const std::vector<int>& couplings = model.clusters[cluster].couplings;
  if (row < static_cast<int>(couplings.size())) return model.couplings[couplings[row]].name;
  row -= static_cast<int>(couplings.size());
  return model.parts[rate_owner(model, cluster, work.locked[row]).first].joint.name;
}

template <class W>
VecX closure_row_scales(const Model& model, const W& work, int cluster) {
  const Cluster& c = model.clusters[cluster];
  VecX s = VecX::Ones(closure_row_count(model, work, cluster));
  Eigen::Index row = 0;
  for (int l : c.loops)
    for (const ClosureRow& r : model.loops[l].rows) s[row++] = r.kind == ClosureRow::angle ? c.size : 1.0;
  for (int k : c.couplings) s[row++] = model.couplings[k].length ? 1.0 : c.size;
  return s;
}

bool deformation_closes(const Model& model, const Partition& partition, int cluster) {
  const Cluster& c = model.clusters[cluster];
  for (const int i : c.parts) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    for (const int k : partition.dep)
      if (const int e = c.v0 + k - p.ev0; e >= 0 && e < p.body.n) return true;
  }
  return false;
}

void make_plan(const Model& model, int cluster, ClusterWork& cw) {
  const Cluster& c = model.clusters[cluster];
  Partition& now = cw.partition;
  PartitionPlan& plan = cw.plan;
  // Of no other plan of the process: states are copied, and what was listed by one must not pass for another's.
  static std::atomic<int> plans{0};
  plan.made = now.plan = ++plans;
  plan.deforms = deformation_closes(model, now, cluster);
  plan.place.assign(static_cast<size_t>(c.nv), 0);
  plan.runs.clear();
  for (size_t k = 0; k < now.ind.size(); ++k) {
    const int rate = now.ind[k];
    plan.place[static_cast<size_t>(rate)] = static_cast<int>(k);
    if (!plan.runs.empty() && plan.runs.back().first + plan.runs.back().second == rate) ++plan.runs.back().second;
    else plan.runs.emplace_back(rate, 1);
  }
  for (size_t d = 0; d < now.dep.size(); ++d) plan.place[static_cast<size_t>(now.dep[d])] = -1 - static_cast<int>(d);
  const auto dependent = [&](int i) {
    const Part& part = model.parts[i];
    for (int k = 0; k < part.joint.nv; ++k)
      if (plan.place[static_cast<size_t>(part.v0 - c.v0 + k)] < 0) return true;
    return false;
  };
  plan.first = static_cast<size_t>(std::find_if(c.parts.begin(), c.parts.end(), dependent) - c.parts.begin());
}

double rate_scale(const Model& model, int cluster, int rate) { return model.clusters[cluster].joint_reach[static_cast<size_t>(rate)]; }

namespace {

// Residual of a row of a loop into its place; the largest so far in metres: angles count by the cluster's size (closure_row_scales).
template <class Row, class PoseIn>
FLEXFRAME_INLINE void take_residual(const Row& closure, const PoseIn& relative, double size, double& out, double& largest) {
  out = row_residual(closure, relative);
  largest = std::max(largest, std::abs(out) * (closure.kind == ClosureRow::angle ? size : 1.0));
}

// Of couplings and locks the same.
template <class W>
auto coupling_residuals(const Model& model, const W& work, int cluster, VecX& out, double& largest) {
  return [&model, &work, &out, &largest, cluster](int row, const CouplingRow& coupling) {
    out[row] = -coupling.value;
    for (const CouplingRow::Term& term : coupling.terms) out[row] += term.factor * coupled(model, work, term).value;
    for_stretches(model, work, cluster, coupling, [&](int, int, const auto&, const auto&, double length) { out[row] += length; });
    largest = std::max(largest, std::abs(out[row]) * (coupling.length ? 1.0 : model.clusters[cluster].size));
  };
}
template <class W>
auto lock_residuals(const Model& model, const W& work, int cluster, VecX& out, double& largest) {
  return [&model, &work, &out, &largest, cluster](int row, size_t lock) {
    const ClusterWork& cw = work.clusters[cluster];
    const auto [part, k] = rate_owner(model, cluster, cw.locked[lock]);
    // An orientation has no coordinate of its own for a rate: it stays because its rate does.
    // What is carried along stands where its coordinates say.
    const TreeJoint& joint = model.parts[part].joint;
    out[row] = joint.nq == joint.nv && lock >= static_cast<size_t>(cw.carried)
                   ? work.q[model.parts[part].q0 + k] - cw.lock_value[static_cast<Eigen::Index>(lock)]
                   : 0.0;
    largest = std::max(largest, std::abs(out[row]) * rate_scale(model, cluster, cw.locked[lock]));
  };
}

// Residuals of the partition's rows, into a column of as many. Returns the largest in metres.
template <class W>
FLEXFRAME_INLINE double closure_residual(const Model& model, const W& work, int cluster, const LoopMotion<typename W::In>& loops,
                                         VecX& out) {
  const double size = model.clusters[cluster].size;
  double largest = 0.0;
  for (const auto& row : loops.rows)
    take_residual(row.closure, loops.poses[static_cast<size_t>(row.loop)].relative, size, out[row.row], largest);
  for_other_rows(model, work, cluster, loops, coupling_residuals(model, work, cluster, out, largest),
                 lock_residuals(model, work, cluster, out, largest));
  return largest;
}

// Twist and acceleration at zero coordinate accelerations of a frame, also where it is fixed to what carries the cluster.
template <class W>
FLEXFRAME_INLINE void loop_frame_motion(const Model& model, int cluster, int frame, W& work, typename W::In::Twist& V,
                                        typename W::In::Twist& A) {
  const FramePoint& f = model.frames[frame];
  if (f.part != ground && model.parts[f.part].cluster == cluster) {
    const auto& at = work.frames[frame];
    if (!at.flexible) {
      V = to_child(at.pose, work.parts[f.part].V);
      A = to_child(at.pose, work.parts[f.part].A0);
      return;
    }
    update_frame_velocity(model, frame, work);
    V = at.V;
    A = to_child(at.pose, work.parts[f.part].A0) + at.bias;
  } else {
    V = to_child(compose(inverse(work.frames[model.clusters[cluster].base].pose), work.frames[frame].pose), work.bases[cluster].V);
    A.setZero();
  }
}

// Motion of frame b relative to frame a, in the axes of a: velocity, acceleration at zero coordinate accelerations, angular ones.
template <class S>
struct RelativeMotion {
  typename S::Linear pd = S::Linear::Zero(), pdd = S::Linear::Zero();
  typename S::Angular w = S::no_turn(), wd = S::no_turn();
};

template <class W>
FLEXFRAME_INLINE RelativeMotion<typename W::In> relative_motion(const Model& model, int cluster, W& work, int a, int b,
                                                                const typename W::In::Pose& rel) {
  using S = typename W::In;
  typename S::Twist Va, Aa, Vb, Ab;
  loop_frame_motion(model, cluster, a, work, Va, Aa);
  loop_frame_motion(model, cluster, b, work, Vb, Ab);
  const typename S::Linear vb = turn(rel, linear(Vb));
  const typename S::Angular wa = angular(Va), wb = turn(rel, angular(Vb)), wad = angular(Aa);
  RelativeMotion<S> m;
  m.w = wb - wa;
  m.pd = vb - linear(Va) - cross(wa, rel.p);
  m.pdd = turn(rel, linear(Ab)) + cross(m.w, vb) - linear(Aa) - cross(wad, rel.p) - cross(wa, m.pd);
  m.wd = turn(rel, angular(Ab)) + cross(m.w, wb) - wad;
  return m;
}

// Of the partition's rows: rate and acceleration at zero coordinate accelerations.
template <class W>
FLEXFRAME_INLINE void closure_rates(const Model& model, int cluster, W& work, const LoopMotion<typename W::In>& loops) {
  using S = typename W::In;
  ClusterWork& cw = work.clusters[cluster];
  VecX &rate = cw.rate, &bias = cw.bias;
  rate.resize(static_cast<Eigen::Index>(cw.partition.rows.size()));
  bias.resize(rate.size());
  int have = -1;
  RelativeMotion<S> m;
  for (const LoopRow<S>& row : loops.rows) {
    const typename S::Pose& rel = loops.poses[static_cast<size_t>(row.loop)].relative;
    if (have != row.loop) {
      const LoopJoint& loop = loop_joint(model, work, cluster, row.loop);
      m = relative_motion(model, cluster, work, loop.a, loop.b, rel);
    }
    have = row.loop;
    double value = dot(row.lv, m.pdd) + dot(row.lw, m.wd);
    const auto& closure = row.closure;
    if (closure.kind == ClosureRow::angle) value += dot(m.w, cross(cross(m.w, turn(rel, closure.b)), closure.u));
    if (closure.kind == ClosureRow::distance) value += m.pd.squaredNorm() / closure.length;
    rate[row.row] = dot(row.lv, m.pd) + dot(row.lw, m.w);
    bias[row.row] = value;
  }
  for_other_rows(
      model, work, cluster, loops,
      [&](int row, const CouplingRow& coupling) {
        rate[row] = bias[row] = 0.0;
        for (const CouplingRow::Term& term : coupling.terms) {
          const TimeJet at = coupled(model, work, term);
          rate[row] += term.factor * at.rate;
          bias[row] += term.factor * at.acceleration;
        }
        for_stretches(model, work, cluster, coupling, [&](int a, int b, const auto& rel, const auto& u, double length) {
          const RelativeMotion<S> r = relative_motion(model, cluster, work, a, b, rel);
          const double along = u.dot(r.pd);
          rate[row] += along;
          bias[row] += u.dot(r.pdd) + (r.pd.squaredNorm() - along * along) / length;
        });
      },
      [&](int row, size_t lock) {
        rate[row] = work.w[model.clusters[cluster].v0 + cw.locked[lock]];
        bias[row] = 0.0;
      });
}

}  // namespace

template <class W>
void update_closure_rates(const Model& model, int cluster, W& work) {
  LoopMotion<typename W::In> loops;
  update_loop_poses(model, work, cluster, loops.poses);
  list_rows(model, work, cluster, loops);
  update_rows(loops);
  closure_rates(model, cluster, work, loops);
}

template <class W>
void update_closure_residual(const Model& model, int cluster, W& work) {
  VecX& out = work.clusters[cluster].residual;
  out.setZero(closure_row_count(model, work, cluster));
  LoopPoses<typename W::In> poses;
  update_loop_poses(model, work, cluster, poses);
  double largest = 0.0;
  for_rows(
      model, work, {cluster, true},
      [&](int row, int loop, int at) {
        take_residual(closure_row(model, work, cluster, loop, at), poses[static_cast<size_t>(loop)].relative, model.clusters[cluster].size,
                      out[row], largest);
      },
      coupling_residuals(model, work, cluster, out, largest), lock_residuals(model, work, cluster, out, largest));
}

template <class W>
void update_closure_matrix(const Model& model, int cluster, W& work) {
  ClusterWork& cw = work.clusters[cluster];
  const int nv = model.clusters[cluster].nv;
  cw.G.setZero(closure_row_count(model, work, cluster), nv);
  cw.line.resize(nv);
  LoopPoses<typename W::In> poses;
  update_loop_poses(model, work, cluster, poses);
  for_rows(
      model, work, {cluster, true},
      [&](int row, int loop, int at) {
        const typename W::In::Pose& rel = poses[static_cast<size_t>(loop)].relative;
        const auto direction = row_direction<typename W::In>(closure_row(model, work, cluster, loop, at), rel);
        closure_line(model, work, cluster, loop_joint(model, work, cluster, loop), unit_wrenches<W>(direction, rel), true);
        cw.G.row(row) = cw.line.transpose();
      },
      [&](int row, const CouplingRow& coupling) {
        coupling_line(model, cluster, coupling, work, true);
        cw.G.row(row) = cw.line.transpose();
      },
      [&](int row, size_t lock) { cw.G(row, cw.locked[lock]) = 1.0; });
}

namespace {
// A joint that moves so many times as far as the deformation that moves it stands beside its dead point: the deformation follows it
// instead.
constexpr double beside_dead_point = 50.0, least_of_joints = 1.0 / beside_dead_point;
}  // namespace

Partition choose_partition(const Model& model, int cluster, Work& work, bool strict) {
  const Cluster& c = model.clusters[cluster];
  update_closure_matrix(model, cluster, work);
  const ClusterWork& cw = work.clusters[cluster];
  const int rows = static_cast<int>(cw.G.rows());

  // Everything in metres: angle rows and rotary columns scaled by the cluster's size, elastic columns by the displacement they cause.
  MatX scaled = closure_row_scales(model, work, cluster).asDiagonal() * cw.G;
  std::vector<int> joint_columns, elastic_columns, preference(c.nv, 0);
  for (int k = 0; k < c.nv; ++k) {
    const auto [part, rate] = rate_owner(model, cluster, k);
    if (rate < 0) {
      const double reach = c.elastic_reach[static_cast<size_t>(k)];
      if (reach > 0.0) scaled.col(k) /= reach;
      elastic_columns.push_back(k);
    } else {
      scaled.col(k) /= c.joint_reach[static_cast<size_t>(k)];
      joint_columns.push_back(k);
      preference[k] = depth(model, part);
    }
  }
  for (int k : cw.locked) preference[k] = std::numeric_limits<int>::max();

  // Complete pivoting of the given rows over joint columns first; what they cannot close is closed by deformation, unless that does less
  // than `least`. A joint's pivot below 1e-7 of the entries' size is rounding or a singular position, not a way to close the loop.
  const auto eliminate = [&](const std::vector<int>& from, double least) {
    Partition out;
    MatX A = scaled;
    std::vector<char> row_used(rows, 1), column_used(c.nv, 0);
    for (int r : from) row_used[r] = 0;
    for (const std::vector<int>* columns : {&joint_columns, &elastic_columns}) {
      const double floor = columns == &elastic_columns ? least : 1e-7;
      while (true) {
        double largest = 0.0;
        for (int k : *columns)
          if (!column_used[k])
            for (int r = 0; r < rows; ++r)
              if (!row_used[r] && std::abs(A(r, k)) > floor) largest = std::max(largest, std::abs(A(r, k)));
        if (largest == 0.0) break;
        if (columns == &joint_columns && largest < least_of_joints) {
          // Beside a dead point, where what deforms closes the loop instead: two elastic bars pushed through their line.
          double deformed = 0.0;
          for (int k : elastic_columns)
            for (int r = 0; r < rows; ++r)
              if (!row_used[r]) deformed = std::max(deformed, std::abs(A(r, k)));
          if (largest < least_of_joints * deformed) break;
        }
        // A sound pivot (a fifth of the largest at least) of the deepest joint. Of alike ones, as both sides of a symmetric frame have, the
        // first: rounding is not to choose between them.
        constexpr double alike = 1.0 + 1e-9;
        int best_row = -1, best = -1;
        for (int k : *columns) {
          if (column_used[k]) continue;
          for (int r = 0; r < rows; ++r) {
            if (row_used[r]) continue;
            const double a = std::abs(A(r, k));
            if (a <= floor || a < (strict ? 1.0 : 0.2) * largest) continue;
            if (best < 0 || preference[k] > preference[best] ||
                (preference[k] == preference[best] && a > alike * std::abs(A(best_row, best))))
              best_row = r, best = k;
          }
        }
        row_used[best_row] = column_used[best] = 1;
        out.side = (out.side < 0) == (A(best_row, best) < 0.0) ? 1 : -1;
        out.rows.push_back(best_row);
        out.dep.push_back(best);
        for (int r = 0; r < rows; ++r)
          if (!row_used[r] && A(r, best) != 0.0) A.row(r) -= (A(r, best) / A(best_row, best)) * A.row(best_row);
      }
    }
    for (int k = 0; k < c.nv; ++k)
      if (!column_used[k]) out.ind.push_back(k);
    return out;
  };
  // Deformation that does less than a fiftieth is the asymmetry of a mesh: a planar loop of a body that bends in the plane leaves it a
  // little, and closing its redundant conditions by that would lock the body.
  std::vector<int> loop_rows(static_cast<size_t>(rows) - cw.locked.size());
  std::iota(loop_rows.begin(), loop_rows.end(), 0);
  Partition out = eliminate(loop_rows, 0.02);
  if (cw.locked.empty()) return out;
  // What is locked (a joint that sticks) is not redundant, and takes away a way to close the loop: the conditions that hold without locks
  // are to hold with them, by deformation however little it does. A slider that sticks beside its dead centre leaves nothing else. A lock
  // that takes away the last way to close a condition (a slider exactly in its dead centre, which holds it already) gives way to it.
  const size_t loops = out.rows.size();
  std::vector<int> needed = out.rows;
  for (int r = static_cast<int>(loop_rows.size()); r < rows; ++r) needed.push_back(r);
  const auto closes = [&](const Partition& p) {
    return static_cast<size_t>(
               std::count_if(p.rows.begin(), p.rows.end(), [&](int r) { return r < static_cast<int>(loop_rows.size()); })) == loops;
  };
  Partition all = eliminate(needed, 1e-7);
  for (size_t lock = loops; !closes(all) && lock < needed.size();) {
    // One lock at a time, each only if everything before it still holds.
    std::vector<int> with(needed.begin(), needed.begin() + static_cast<std::ptrdiff_t>(lock) + 1);
    if (closes(eliminate(with, 1e-7))) ++lock;
    else needed.erase(needed.begin() + static_cast<std::ptrdiff_t>(lock));
    all = eliminate(needed, 1e-7);
  }
  return all;
}

namespace {

// Which columns of the partition's rows of G are made: those of dep, or all; of joints, or of what deforms too.
struct WhichColumns {
  bool all, elastic;
};

// Per part of a cluster the pose of its joint's outboard frame in the base frame, where that moves in the part, and the twists of what
// hangs on the joint per unit of its rates, about the origin and in the axes of the base frame.
template <class S>
struct JointInBase {
  typename S::Pose outboard;
  typename S::Inertia twists;
};
template <class W>
FLEXFRAME_INLINE const std::vector<JointInBase<typename W::In>>& joints_in_base(const Model& model, const W& work, int cluster,
                                                                                const WhichColumns& columns) {
  using Twist = typename W::In::Twist;
  static thread_local std::vector<JointInBase<typename W::In>> joints;
  if (joints.size() < model.parts.size()) joints.resize(model.parts.size());
  const Cluster& c = model.clusters[cluster];
  const std::vector<int>& place = work.clusters[cluster].plan.place;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    if (part.joint.nv + part.body.n == 0) continue;
    const auto& p = work.parts[i];
    auto& joint = joints[i];
    const bool fixed = work.carrying.fixed[i] != Carrying::moving;
    if (!fixed) joint.outboard = compose(p.in_base, work.frames[part.joint.outboard].pose);
    for (int k = 0; k < part.joint.nv; ++k) {
      if (!columns.all && place[part.v0 - c.v0 + k] >= 0) continue;
      joint.twists.col(k) = fixed ? to_parent(p.in_base, Twist(column(p.Hj, k))) : to_parent(joint.outboard, Twist(p.joint.S.col(k)));
    }
  }
  return joints;
}

// The partition's rows of G, column by column, and by what they are made.
template <class S>
struct RowsOfG {
  const std::vector<JointInBase<S>>& joints;
  const std::vector<int>& place;  // PartitionPlan::place: where a rate's column stands, counted from the first independent one
  int cluster;
  bool deforms;  // PartitionPlan::deforms
  WhichColumns which;
  Eigen::Index rows;
  double* G;  // column of the first independent rate
};
// A loop's frame, its pose in the base frame, and the sense in which the rows' forces act on it.
template <class S>
struct LoopEnd {
  int frame;
  const typename S::Pose& pose;
  double sense;
};

// g[k * stride] += b_k . f of the columns of B, N as in sized.h.
template <int N>
FLEXFRAME_INLINE void add_spread(const Mat6X& B, const Vec6& f, double* g, Eigen::Index stride) {
  const Eigen::Index n = N > 0 ? N : B.cols();
  for (Eigen::Index k = 0; k < n; ++k) g[k * stride] += B.col(k).dot(f);
}
template <int N>
FLEXFRAME_INLINE void add_spread(const MatX3& B, const Vec3& f, double* g, Eigen::Index stride) {
  const Eigen::Index n = N > 0 ? N : B.rows();
  const double *const x = B.data(), *const y = x + n, *const turn = y + n, fx = f[0], fy = f[1], m = f[2];
  Eigen::Index k = 0;
  for (; k + 4 <= n; k += 4) {
    const Four s = four(x + k).v * fx + four(y + k).v * fy + four(turn + k).v * m;
    double* const to = g + k * stride;
    to[0] += s[0], to[stride] += s[1], to[2 * stride] += s[2], to[3 * stride] += s[3];
  }
  for (; k < n; ++k) g[k * stride] += x[k] * fx + y[k] * fy + turn[k] * m;
}

// Adds the products of some rows' wrench on a part with its twists per elastic rate, B at the pose in the base frame.
template <class W>
FLEXFRAME_INLINE void add_elastic_columns(const typename W::In::Columns& B, const typename W::In::Pose& pose, int first,
                                          std::span<const LoopRow<typename W::In>> forces, const LoopEnd<typename W::In>& end,
                                          const RowsOfG<typename W::In>& out) {
  for (const auto& force : forces) {
    const typename W::In::Twist on_frame = wrench_to_child(pose, typename W::In::Twist(end.sense * force.on_b));
    const int* const to = out.place.data() + first;
    if (out.deforms) {
      for (Eigen::Index k = 0; k < count(B); ++k) out.G[to[k] * out.rows + force.row] += column(B, k).dot(on_frame);
      continue;
    }
    // All of them are independent, one after the other.
    by_count(
        count(B), [&](auto n)
                      __attribute__((always_inline)) { add_spread<n()>(B, on_frame, out.G + to[0] * out.rows + force.row, out.rows); });
  }
}

// What the rows of one loop make of the rates between one of its frames and what carries the cluster.
template <class W>
FLEXFRAME_INLINE void add_path(const Model& model, const W& work, std::span<const LoopRow<typename W::In>> forces,
                               const LoopEnd<typename W::In>& end, const RowsOfG<typename W::In>& out) {
  const int v0 = model.clusters[out.cluster].v0;
  int at = end.frame;
  for (int i = model.frames[at].part; i != ground && model.parts[i].cluster == out.cluster; i = model.parts[i].parent) {
    const Part& part = model.parts[i];
    const auto& joint = out.joints[i];
    for (int k = 0; k < part.joint.nv; ++k) {
      const int place = out.place[part.v0 - v0 + k];
      if (!out.which.all && place >= 0) continue;
      double* const g = out.G + place * out.rows;
      for (const auto& force : forces) g[force.row] += end.sense * joint.twists.col(k).dot(force.on_b);
    }
    if (out.which.elastic && part.body.n > 0) {
      const auto &f = work.frames[at], &o = work.frames[part.joint.outboard];
      if (f.flexible)
        add_elastic_columns<W>(f.B, at == end.frame ? end.pose : compose(work.parts[i].in_base, f.pose), part.ev0 - v0, forces, end, out);
      if (o.flexible) add_elastic_columns<W>(o.B, joint.outboard, part.ev0 - v0, forces, {at, end.pose, -end.sense}, out);
    }
    at = part.joint.inboard;
  }
}

// out = A x, of at least one column. Of two or three conditions, as most loops have, here: a call costs more than the product.
template <int N>
FLEXFRAME_INLINE void set_product_few(const MatX& A, const double* x, double* out) {
  using Column = Eigen::Matrix<double, N, 1>;
  const double* a = A.data();
  Column sum = Eigen::Map<const Column>(a) * x[0];
  for (Eigen::Index k = 1; k < A.cols(); ++k) sum += Eigen::Map<const Column>(a += N) * x[k];
  Eigen::Map<Column>{out} = sum;
}
FLEXFRAME_INLINE void multiply_into(const MatX& A, const double* x, VecX& out) {
  if (out.size() != A.rows()) out.resize(A.rows());
  if (A.cols() == 0) out.setZero();
  else if (A.rows() == 2) set_product_few<2>(A, x, out.data());
  else if (A.rows() == 3) set_product_few<3>(A, x, out.data());
  else multiply(A, x, out.data());
}

// C = -A B, column by column.
template <int N>
FLEXFRAME_INLINE void set_negative_few(const MatX& A, const double* b, MatX& C) {
  double a[N * N];
  std::copy_n(A.data(), N * N, a);
  double* c = C.data();
  for (Eigen::Index k = 0; k < C.cols(); ++k, b += N, c += N)
    for (int r = 0; r < N; ++r) {
      double sum = a[r] * b[0];
      for (int s = 1; s < N; ++s) sum += a[r + N * s] * b[s];
      c[r] = -sum;
    }
}
FLEXFRAME_INLINE void set_negative_product(const MatX& A, const double* b, MatX& C) {
  const Eigen::Index n = A.rows();
  if (n == 2) return set_negative_few<2>(A, b, C);
  if (n == 3) return set_negative_few<3>(A, b, C);
  for (Eigen::Index k = 0; k < C.cols(); ++k, b += n) {
    double* const c = C.data() + k * n;
    multiply(A, b, c);
    for (Eigen::Index r = 0; r < n; ++r) c[r] = -c[r];
  }
}

// Calls on_loop(rows, loop joint, its pose) for the rows of one loop that follow one another: they go their way together.
template <class W, class OnLoop>
FLEXFRAME_INLINE void for_loops(const Model& model, const W& work, int cluster, const LoopMotion<typename W::In>& loops, OnLoop&& on_loop) {
  const LoopRow<typename W::In>* const rows = loops.rows.data();
  for (const auto& run : loops.runs)
    on_loop(std::span(rows + run.from, static_cast<size_t>(run.count)), loop_joint(model, work, cluster, run.loop),
            loops.poses[static_cast<size_t>(run.loop)]);
}

// The partition's rows of G: the inverse of their columns dep into Gd, with all columns E too.
template <class W>
FLEXFRAME_INLINE void factorise_closure(const Model& model, int cluster, W& work, const WhichColumns& columns) {
  using S = typename W::In;
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  LoopMotion<S>& loops = work.loops[cluster];
  update_rows(loops);
  const Eigen::Index nd = static_cast<Eigen::Index>(cw.partition.dep.size()), ni = static_cast<Eigen::Index>(cw.partition.ind.size());
  static thread_local std::vector<double> G;
  const size_t entries = static_cast<size_t>(nd * (nd + ni));
  if (G.size() < entries + 3) G.resize(entries + 3);
  for (size_t k = 0; k < entries; k += 4) four(G.data() + k).v = Four{};
  const std::vector<int>& place = cw.plan.place;
  double* const independent = G.data() + nd * nd;
  for_other_rows(
      model, work, cluster, loops,
      [&](int row, const CouplingRow& coupling) {
        cw.line.resize(c.nv);
        coupling_line(model, cluster, coupling, work, columns.elastic);
        for (int k = 0; k < c.nv; ++k) independent[place[k] * nd + row] = cw.line[k];
      },
      [&](int row, size_t lock) { independent[place[cw.locked[lock]] * nd + row] = 1.0; });
  const RowsOfG<S> out{joints_in_base(model, work, cluster, columns), place, cluster, cw.plan.deforms, columns, nd, independent};
  for_loops(
      model, work, cluster, loops, [&](const auto& rows, const LoopJoint& loop, const LoopPose<S>& at) __attribute__((always_inline)) {
        add_path<W>(model, work, rows, {loop.b, at.b, 1.0}, out);
        add_path<W>(model, work, rows, {loop.a, at.a, -1.0}, out);
      });
  if (cw.Gd.rows() != nd) cw.Gd.resize(nd, nd);
  double* to = cw.Gd.data();
  if (nd == 2) {
    to[0] = independent[-2], to[1] = independent[-1], to[2] = independent[-4], to[3] = independent[-3];
  } else {
    for (Eigen::Index d = 0; d < nd; ++d, to += nd) copy_fours(independent - (1 + d) * nd, nd, to);
  }
  // A singular one leaves nothing finite, and the loop is found to stay open.
  cw.side = invert(cw.Gd);
  if (cw.side == 0) cw.Gd.setConstant(std::numeric_limits<double>::infinity());
  if (!columns.all) return;
  if (cw.E.rows() != nd || cw.E.cols() != ni) cw.E.resize(nd, ni);
  set_negative_product(cw.Gd, independent, cw.E);
}

// The rate of a row's wrench on a frame along the prescribed motions between the frame and what carries the cluster.
template <class W>
double driven_rate(const Model& model, const W& work, int cluster, int frame, typename W::In::Twist force) {
  double rate = 0.0;
  for (int i = model.frames[frame].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent) {
    const TreeJoint& joint = model.parts[i].joint;
    const auto& p = work.parts[i];
    const auto on_joint = wrench_to_child(work.frames[joint.outboard].pose, wrench_to_parent(work.frames[frame].pose, force));
    if (joint.motion >= 0) rate += p.joint.S.col(0).dot(on_joint) * work.motion[joint.motion].rate;
    force = wrench_to_parent(p.joint.pose, on_joint);
    frame = joint.inboard;
  }
  return rate;
}

// Adds the rates of the rows of one loop along the prescribed motions between one of its frames and what carries the cluster.
template <class W>
FLEXFRAME_INLINE void add_driven_rates(const Model& model, const W& work, int cluster, std::span<const LoopRow<typename W::In>> forces,
                                       const LoopEnd<typename W::In>& end, VecX& rate) {
  for (int i = model.frames[end.frame].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent) {
    const TreeJoint& joint = model.parts[i].joint;
    if (joint.motion < 0) continue;
    const auto& p = work.parts[i];
    const auto twist = to_parent(p.in_base, p.driven);
    for (const auto& force : forces) rate[force.row] += end.sense * twist.dot(force.on_b) * work.motion[joint.motion].rate;
  }
}

// Of the partition's rows: rates while every rate rests and only prescribed motions go on, into ClusterWork::rate.
template <class W>
FLEXFRAME_INLINE void update_driven_rates(const Model& model, int cluster, W& work) {
  const LoopMotion<typename W::In>& loops = work.loops[cluster];
  VecX& rate = work.clusters[cluster].rate;
  rate.setZero(static_cast<Eigen::Index>(work.clusters[cluster].partition.rows.size()));
  for_other_rows(
      model, work, cluster, loops,
      [&](int row, const CouplingRow& coupling) {
        for (const CouplingRow::Term& term : coupling.terms)
          if (model.parts[term.part].joint.motion >= 0) rate[row] += term.factor * coupled(model, work, term).rate;
        rope_wrenches(model, work, cluster, coupling,
                      [&](int frame, const auto& F) { rate[row] += driven_rate(model, work, cluster, frame, F); });
      },
      [](int, size_t) {});
  for_loops(model, work, cluster, loops, [&](const auto& rows, const LoopJoint& loop, const LoopPose<typename W::In>& at) {
    add_driven_rates<W>(model, work, cluster, rows, {loop.b, at.b, 1.0}, rate);
    add_driven_rates<W>(model, work, cluster, rows, {loop.a, at.a, -1.0}, rate);
  });
}

// Moves the dependent coordinates by -ClusterWork::step, joint by joint.
template <class W>
void move_dependent(const Model& model, int cluster, W& work) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    double dw[6] = {};
    bool moved = false;
    for (size_t k = 0; k < cw.partition.dep.size(); ++k) {
      const int v = c.v0 + cw.partition.dep[k];
      const double step = cw.step[static_cast<Eigen::Index>(k)];
      if (v >= p.v0 && v < p.v0 + p.joint.nv) dw[v - p.v0] = -step, moved = true;
      if (v >= p.ev0 && v < p.ev0 + p.body.n) work.q[p.eq0 + v - p.ev0] -= step;
    }
    if (moved) move_coordinates(p.joint.kind, work.q.data() + p.q0, dw);
  }
}

// rates: what closes the loops' rates is wanted as well.
template <class W>
FLEXFRAME_INLINE void close_loops(const Model& model, int cluster, W& work, bool rates) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  bend_frames(model, cluster, work);
  place_chain(model, cluster, 0, work);
  const Partition& part = cw.partition;
  const PartitionPlan& plan = plan_of(model, cluster, cw);
  const int nd = static_cast<int>(part.dep.size());
  const auto update_jacobians = [&]() {
    for (int f : work.carrying.bent[static_cast<size_t>(cluster)]) update_frame_jacobian(model, f, work);
  };
  if (nd == 0) {
    if (rates) update_jacobians();
    return;
  }
  // Deformations that close a loop move the frames in their bodies as well.
  const bool elastic = plan.deforms;
  const double closed = elastic ? 2e-16 : 3e-13;
  cw.res.resize(nd);
  double last = std::numeric_limits<double>::infinity();
  bool fresh = false, whole = false;  // the conditions' matrix serves; it is that of the present place, with all columns
  LoopMotion<typename W::In>& loops = work.loops[cluster];
  if (loops.listed != plan.made) {
    list_rows(model, work, cluster, loops);
    loops.listed = plan.made;
  }
  update_loop_poses(model, work, cluster, loops.poses);
  for (int iteration = 0;; ++iteration) {
    const double open = closure_residual(model, work, cluster, loops, cw.res);
    if (!fresh) {
      // Closed as it stands: nothing will move, and what the end needs is made at once.
      whole = rates && open <= closed * c.size;
      if (elastic || whole) update_jacobians();
      factorise_closure(model, cluster, work, {whole, elastic || whole});
      fresh = true;
    }
    multiply_into(cw.Gd, cw.res.data(), cw.step);
    ++work.closure_iterations;
    // Size of the step in metres; elastic coordinates count by the closure error they mend. No scale is larger than `largest`.
    const double largest = std::max(1.0, c.size);
    double size = open, moved = 0.0, sum = 0.0;
    for (int k = 0; k < nd; ++k) {
      const double step = std::abs(cw.step[k]);
      sum += step;
      moved = std::max(moved, step);
    }
    if (!std::isfinite(sum)) size = std::numeric_limits<double>::infinity();
    else if (size <= closed * c.size && moved * largest <= closed * c.size) break;
    else
      for (int k = 0; k < nd; ++k) size = std::max(size, std::abs(cw.step[k]) * rate_scale(model, cluster, part.dep[k]));
    // 3e-13 of the size is a few hundred roundings of the poses: closed. A step that no longer shrinks at 1e-10 is rounding too.
    // A deformation that closes the loop is a force: one rounding off is as good as it gets.
    if (size <= closed * c.size || (size <= 1e-10 * c.size && size > 0.25 * last)) break;
    if (!std::isfinite(size) || iteration == 40 || (iteration > 4 && size > c.size)) {
      int worst = 0;
      cw.res.cwiseAbs().maxCoeff(&worst);
      throw SimulationError(fmt::format(
          "joint '{}' cannot be closed at t = {:.6g} s: the mechanism reaches a dead point there, the limit of its reach; if it "
          "should go on, another way to assemble its loop may be meant: choose it by initial = {{ guess = ... }}",
          closure_row_name(model, cw, cluster, part.rows[worst]), work.time));
    }
    move_dependent(model, cluster, work);
    whole = false;
    if (elastic) update_cluster_frames(model, cluster, work);
    update_chain_from(model, cluster, elastic ? 0 : plan.first, work);
    update_loop_poses(model, work, cluster, loops.poses);
    // With the matrix of the start the error shrinks by about its own size over the mechanism's each time: what two steps have shown
    // tells whether a third is needed, and whether the matrix still serves.
    if (std::isfinite(last) ? size <= 1e-3 * last && size * size / last <= 1e-15 * c.size : size <= 1e-10 * c.size) break;
    if (size > 1e-3 * std::min(last, c.size)) fresh = false;
    last = size;
  }
  if (rates && !whole) {
    update_jacobians();
    factorise_closure(model, cluster, work, {true, true});
  }
}

FLEXFRAME_WIDE void wide_close_loops(const Model& model, int cluster, Work& work, bool rates) { close_loops(model, cluster, work, rates); }
FLEXFRAME_WIDE void wide_close_loops(const Model& model, int cluster, PlaneWork& work, bool rates) {
  close_loops(model, cluster, work, rates);
}

}  // namespace

template <class W>
void close_positions(const Model& model, int cluster, W& work) {
  wide_close_loops(model, cluster, work, true);
}

template <class W>
void close_places(const Model& model, int cluster, W& work) {
  wide_close_loops(model, cluster, work, false);
}

template <class W>
void require_closed(const Model& model, int cluster, W& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const int total = closure_row_count(model, work, cluster);
  if (static_cast<int>(cw.partition.rows.size()) == total) return;
  update_closure_residual(model, cluster, work);
  double worst = 0.0;
  int open = 0;
  const VecX scale = closure_row_scales(model, work, cluster);
  for (int row = 0; row < total - static_cast<int>(cw.locked.size()); ++row)
    if (const double e = std::abs(cw.residual[row]) * scale[row]; e > worst) worst = e, open = row;
  // A ten-thousandth of the size: far above what rounding or an assembly to 1e-9 grows to near a singular position, below what a picture
  // shows. Elastic bodies add what a slightly unsymmetric mesh lets conditions open that deformation is not asked to close
  // (choose_partition).
  double allowed = 1e-4 * c.size;
  if (worst <= allowed) return;
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    for (const FlexibleNode& node : p.body.nodes) {
      const auto q = work.q.segment(p.eq0, p.body.n);
      allowed = std::max(allowed, 0.1 * ((node.phi * q).norm() + c.size * (node.psi * q).norm()));
    }
  }
  if (worst <= allowed) return;
  std::string motions;
  int driven = 0;
  bool bends = false;
  for (int i : c.parts) bends = bends || model.parts[i].body.n > 0 || model.parts[i].joint.link >= 0;
  for (int i : c.parts)
    if (model.parts[i].joint.motion >= 0) motions += fmt::format("{}'{}'", driven++ ? ", " : "", model.parts[i].joint.name);
  if (driven > 1)
    throw SimulationError(fmt::format(
        "joint '{}' opens by {:.3g} m at t = {:.6g} s: the motions of the joints {} contradict one another in its loop; remove one motion",
        closure_row_name(model, cw, cluster, open), work.time, worst, motions));
  throw SimulationError(
      fmt::format("joint '{}' opens by {:.3g} m at t = {:.6g} s: closure conditions of its loop that were redundant at the start no longer "
                  "are. The mechanism starts in a change point, from which it can move in more than one way: start it away from that "
                  "position, or give initial rates for one of the ways{}",
                  closure_row_name(model, cw, cluster, open), work.time, worst,
                  bends ? "; or the loop prevents a bending beam from shortening: switch its effect axial on" : ""));
}

namespace {

// for_accelerations: what they need of the rates is made too.
template <class W>
FLEXFRAME_INLINE void close_rates(const Model& model, int cluster, W& work, bool for_accelerations) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  if (nd == 0) {
    update_cluster_velocities(model, cluster, work);
    return;
  }
  double* const w = work.w.data() + c.v0;
  const double* ind = w;
  if (cw.plan.runs.size() == 1) {
    ind += cw.plan.runs.front().first;
  } else {
    cw.ind_rate.resize(ni);
    for (int k = 0; k < ni; ++k) cw.ind_rate[k] = w[part.ind[k]];
    ind = cw.ind_rate.data();
  }
  multiply_into(cw.E, ind, cw.step);
  VecX& dep = cw.step;
  if (cw.carried > 0 || work.carrying.follows[static_cast<size_t>(cluster)]) {
    update_driven_rates(model, cluster, work);
    VecX& rate = cw.rate;
    if (cw.carried > 0) {
      const int loop_rows = closure_row_count(model, work, cluster) - static_cast<int>(cw.locked.size());
      for (int i = 0; i < nd; ++i)
        if (const int lock = part.rows[i] - loop_rows; lock >= 0 && lock < cw.carried) rate[i] -= cw.lock_rate[lock];
    }
    multiply_into(cw.Gd, rate.data(), cw.e0);
    for (int k = 0; k < nd; ++k) {
      cw.e0[k] = -cw.e0[k];
      dep[k] += cw.e0[k];
    }
  } else {
    cw.e0.setZero(nd);
  }
  for (int k = 0; k < nd; ++k) w[part.dep[k]] = dep[k];
  update_cluster_velocities(model, cluster, work);
  if (!for_accelerations) return;
  closure_rates(model, cluster, work, work.loops[cluster]);
  multiply_into(cw.Gd, cw.bias.data(), cw.gamma);
  for (int k = 0; k < nd; ++k) cw.gamma[k] = -cw.gamma[k];
}

FLEXFRAME_WIDE void wide_close_rates(const Model& model, int cluster, Work& work, bool for_accelerations) {
  close_rates(model, cluster, work, for_accelerations);
}
FLEXFRAME_WIDE void wide_close_rates(const Model& model, int cluster, PlaneWork& work, bool for_accelerations) {
  close_rates(model, cluster, work, for_accelerations);
}

}  // namespace

template <class W>
void close_velocities(const Model& model, int cluster, W& work) {
  wide_close_rates(model, cluster, work, true);
}

template <class W>
void close_velocities_alone(const Model& model, int cluster, W& work) {
  wide_close_rates(model, cluster, work, false);
}

template <class W>
LoopWrenches<W> closure_wrench(const Model& model, const W& work, int cluster, int loop, const VecX& lambda) {
  using S = typename W::In;
  LoopWrenches<W> out;
  const typename S::Pose rel = relative_pose(model, work, cluster, model.loops[loop].a, model.loops[loop].b);
  typename S::Linear force = S::Linear::Zero();
  typename S::Angular moment = S::no_turn();
  Eigen::Index r = 0;
  for (const auto& row : loop_rows(model, work, loop)) {
    const RowDirection<S> d = row_direction<S>(row, rel);
    force += lambda[r] * d.lv;
    moment += lambda[r++] * d.lw;
  }
  row_wrench(rel, force, moment, out.on_a, out.on_b);
  return out;
}

template <class W>
std::vector<WrenchAt<W>> coupling_wrenches(const Model& model, const W& work, int cluster, const CouplingRow& coupling, double lambda) {
  std::vector<WrenchAt<W>> out;
  rope_wrenches(model, work, cluster, coupling, [&](int frame, const auto& F) {
    out.push_back({frame, typename W::In::Twist(lambda * F)});
  });
  return out;
}

template <class W>
double coupling_factor(const Model& model, const W& work, const CouplingRow::Term& term) {
  const Part& part = model.parts[term.part];
  if (part.joint.motion < 0) return coupled_slope(work, part, term);
  return term.factor * (term.of ? term.of->jet(work.motion[part.joint.motion].value).rate : 1.0);
}

double partition_growth(const Model& model, int cluster, const Work& work) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  const auto elastic_scale = [&c](int rate) { return c.elastic_reach[static_cast<size_t>(rate)]; };
  double growth = 0.0;
  static thread_local std::vector<double> scale;  // of the dependent rates: this runs after every step
  scale.clear();
  for (const int rate : cw.partition.dep) scale.push_back(rate_scale(model, cluster, rate));
  for (size_t i = 0; i < cw.partition.ind.size(); ++i) {
    const double joint = rate_scale(model, cluster, cw.partition.ind[i]);
    const double elastic = joint == 0.0 ? elastic_scale(cw.partition.ind[i]) : 0.0;
    for (size_t d = 0; d < cw.partition.dep.size(); ++d) {
      const double ratio = std::abs(cw.E(d, i)), sd = scale[d];
      if (sd > 0.0 && joint > 0.0) growth = std::max(growth, ratio * sd / joint);
      // A joint that follows a deformation counts beside its dead point only: there the deformation is to follow the joint.
      if (sd > 0.0 && elastic > 0.0) growth = std::max(growth, ratio * sd / elastic * (largest_growth / beside_dead_point));
      // A deformation that closes the loop is measured against the others that could.
      if (sd == 0.0 && elastic > 0.0) growth = std::max(growth, ratio * elastic_scale(cw.partition.dep[d]) / elastic);
    }
  }
  return growth;
}

#define FLEXFRAME_FOR(W)                                                                                        \
  template void update_closure_residual(const Model&, int, W&);                                                 \
  template void update_closure_matrix(const Model&, int, W&);                                                   \
  template void update_closure_rates(const Model&, int, W&);                                                    \
  template void close_positions(const Model&, int, W&);                                                         \
  template void close_places(const Model&, int, W&);                                                            \
  template void close_velocities(const Model&, int, W&);                                                        \
  template void close_velocities_alone(const Model&, int, W&);                                                  \
  template void require_closed(const Model&, int, W&);                                                          \
  template VecX closure_row_scales(const Model&, const W&, int);                                                \
  template std::vector<WrenchAt<W>> coupling_wrenches(const Model&, const W&, int, const CouplingRow&, double); \
  template double coupling_factor(const Model&, const W&, const CouplingRow::Term&);                            \
  template LoopWrenches<W> closure_wrench(const Model&, const W&, int, int, const VecX&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

}  // namespace flexframe::sim
