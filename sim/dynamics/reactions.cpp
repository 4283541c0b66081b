#include "sim/dynamics/reactions.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/sized.h"
#include "sim/base/wide.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/plane_work.h"
#include "sim/dynamics/shared_reactions.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

VecX transposed_product(const Mat6X& A, const Vec6& f) { return A.transpose() * f; }
VecX transposed_product(const MatX3& A, const Vec3& f) { return A * f; }

// Power that a part's own coordinates take up, N as in sized.h, and what they add to the momentum's rate, `need`. mass: null for normal
// modes, whose stiffness is a diagonal: they have unit mass. momentum: scratch.
template <int N, class S>
FLEXFRAME_INLINE double elastic_power(const MatX* mass, const PartMotion<S>& p, VecX& momentum, typename S::Twist& need) {
  need += combine_sized<N>(p.terms.Mre, p.qdd);
  if (mass) multiply_sized<N>(*mass, p.qdd.data(), momentum.data());
  else sized<N>(momentum) = sized<N>(p.qdd);
  sized<N>(momentum) += sized<N>(p.terms.ce) + sized<N>(p.elastic) - sized<N>(p.load_e) + dots_sized<N>(p.terms.Mre, p.A);
  return sized<N>(momentum).dot(sized<N>(p.qd));
}

}  // namespace

template <class W>
VecX closure_multipliers(const Model& model, W& work, int cluster) {
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), rows = closure_row_count(model, work, cluster);
  VecX all = VecX::Zero(rows);
  if (nd == 0) return all;
  // G_dep^T lambda = what is left of the dependent coordinates' equations.
  const Cluster& c = model.clusters[cluster];
  const auto& base = work.bases[cluster];
  cw.M.template triangularView<Eigen::StrictlyUpper>() = cw.M.transpose();
  VecX left = cw.M * work.wdot.segment(c.v0, c.nv) + cw.r;
  // Where it stands on ground gravity is among the forces.
  if (c.parent != ground) left += transposed_product(base.Ib, base.A);
  VecX rhs(nd);
  for (int i = 0; i < nd; ++i) rhs[i] = left[part.dep[i]];
  const VecX basic = cw.Gd.transpose() * rhs;
  for (int i = 0; i < nd; ++i) all[part.rows[i]] = basic[i];
  return all;
}

namespace {

// What couplings do to a joint's coordinates is done by teeth, cams and ropes, not through the joint.
template <class W>
void leave_out_couplings(const Model& model, const W& work, int cluster, Reactions& out) {
  for (const int k : model.clusters[cluster].couplings)
    for (const CouplingRow::Term& term : model.couplings[k].terms) {
      typename W::In::Twist S = work.parts[term.part].joint.S.col(term.rate);
      // The coordinate of a screw is its angle: what acts on it is a moment about the axis.
      if (model.parts[term.part].joint.kind == JointKind::screw) S.template head<3>().setZero();
      const double force = out.coupling[k] * coupling_factor(model, work, term);
      out.part[term.part] -= in_space(work, model.parts[term.part].joint.outboard, typename W::In::Twist(S * (force / S.squaredNorm())));
    }
}

// Wrenches of the loop joints of a cluster with the multipliers `all` of their rows, taken from what the parts need, then, leaves to root,
// those of its tree joints: each supplies what its part and everything on it needs. Returns what the cluster needs of its carrier.
template <class W>
typename W::In::Twist cluster_wrenches(const Model& model, const W& work, int cluster, const VecX& all,
                                       std::vector<typename W::In::Twist>& need, Reactions& out) {
  using Twist = typename W::In::Twist;
  const Cluster& c = model.clusters[cluster];
  Twist carrier = Twist::Zero();
  const auto take = [&](int frame, const Twist& F) {
    const int part = model.frames[frame].part;
    if (part == ground) return;
    const Twist on_part = wrench_to_parent(work.frames[frame].pose, F);
    if (model.parts[part].cluster == cluster) need[part] -= on_part;
    else carrier -= on_part;
  };
  int row = 0;
  for (int l : c.loops) {
    const Eigen::Index rows = static_cast<Eigen::Index>(model.loops[l].rows.size());
    const auto [on_a, on_b] = closure_wrench(model, work, cluster, l, all.segment(row, rows));
    row += static_cast<int>(rows);
    out.loop[l] = in_space(work, model.loops[l].b, on_b);
    take(model.loops[l].a, on_a);
    take(model.loops[l].b, on_b);
  }
  for (const int k : c.couplings) {
    out.coupling[k] = all[row++];
    for (const auto& [frame, F] : coupling_wrenches(model, work, cluster, model.couplings[k], out.coupling[k])) take(frame, F);
  }
  for (size_t at = c.parts.size(); at-- > 0;) {
    const int i = c.parts[at];
    const Part& part = model.parts[i];
    const Twist F = wrench_to_child(work.frames[part.joint.outboard].pose, need[i]);
    out.part[i] = in_space(work, part.joint.outboard, F);
    if (part.parent == ground) continue;
    const Twist back = wrench_to_parent(work.frames[part.joint.inboard].pose, wrench_to_parent(work.parts[i].joint.pose, F));
    if (model.parts[part.parent].cluster == cluster) need[part.parent] += back;
    else carrier += back;
  }
  return carrier;
}

// Reactions of a cluster's joints in newtons, one column of numbers: moments over the cluster's size.
VecX in_newtons(const Model& model, int cluster, const Reactions& reactions) {
  const Cluster& c = model.clusters[cluster];
  VecX out(6 * (c.parts.size() + c.loops.size()));
  Eigen::Index at = 0;
  const auto add = [&](const Vec6& F) {
    out.segment<3>(at) = F.head<3>();
    out.segment<3>(at + 3) = F.tail<3>() / c.size;
    at += 6;
  };
  for (int i : c.parts) add(reactions.part[i]);
  for (int l : c.loops) add(reactions.loop[l]);
  return out;
}

// Multipliers of states of self-stress, a column for each redundant row: they press the joints of the loop against one another and move
// nothing.
template <class W>
MatX self_stresses(const Model& model, W& work, int cluster) {
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), rows = closure_row_count(model, work, cluster),
            loop_rows = rows - static_cast<int>(cw.locked.size());
  std::vector<int> redundant;
  for (int r = 0; r < loop_rows; ++r)
    if (std::find(part.rows.begin(), part.rows.end(), r) == part.rows.end()) redundant.push_back(r);
  MatX out = MatX::Zero(rows, static_cast<Eigen::Index>(redundant.size()));
  if (redundant.empty()) return out;
  update_closure_matrix(model, cluster, work);
  for (size_t k = 0; k < redundant.size(); ++k) {
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    out(redundant[k], column) = 1.0;
    if (nd == 0) continue;
    VecX g(nd);
    for (int d = 0; d < nd; ++d) g[d] = cw.G(redundant[k], part.dep[d]);
    const VecX balance = cw.Gd.transpose() * g;
    for (int d = 0; d < nd; ++d) out(part.rows[d], column) -= balance[d];
  }
  return out;
}

}  // namespace

template <class W>
void compute_reactions(const Model& model, W& work, Reactions& out, bool minimum_norm) {
  using Twist = typename W::In::Twist;
  out.part.assign(model.parts.size(), Vec6::Zero());
  out.loop.assign(model.loops.size(), Vec6::Zero());
  out.coupling.assign(model.couplings.size(), 0.0);
  // What each part needs beyond its loads, about its body frame.
  std::vector<Twist> need(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const auto& p = work.parts[i];
    need[i] = p.terms.Mrr * p.A + p.terms.cr - p.load;
    if (p.qdd.size() > 0) add_product(p.terms.Mre, p.qdd, need[i]);
  }
  for (size_t k = model.clusters.size(); k-- > 0;) {
    const int cluster = static_cast<int>(k);
    const Cluster& c = model.clusters[k];
    VecX all;
    if (has_closure(c)) all = closure_multipliers(model, work, cluster);
    const MatX stress = minimum_norm && !c.loops.empty() ? self_stresses(model, work, cluster) : MatX();
    if (stress.cols() > 0) {
      // The share of each state of self-stress that leaves the least sum of squares in all joints of the cluster.
      std::vector<Twist> at = need;
      cluster_wrenches(model, work, cluster, all, at, out);
      const VecX loaded = in_newtons(model, cluster, out);
      MatX pressed(loaded.size(), stress.cols());
      for (Eigen::Index s = 0; s < stress.cols(); ++s) {
        std::fill(at.begin(), at.end(), Twist(Twist::Zero()));
        cluster_wrenches(model, work, cluster, VecX(stress.col(s)), at, out);
        pressed.col(s) = in_newtons(model, cluster, out);
      }
      all -= stress * least_squares(pressed, loaded);
    }
    const Twist carrier = cluster_wrenches(model, work, cluster, all, need, out);
    leave_out_couplings(model, work, cluster, out);
    if (c.parent != ground) need[c.parent] += carrier;
  }
}

SharedReactions shared_reactions(const Model& model, Work& work, const Reactions& reactions) {
  SharedReactions out{std::vector<double>(model.parts.size(), 0.0), std::vector<double>(model.loops.size(), 0.0)};
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const int cluster = static_cast<int>(k);
    const Cluster& c = model.clusters[k];
    const MatX stress = c.loops.empty() ? MatX() : self_stresses(model, work, cluster);
    if (stress.cols() == 0) continue;
    const VecX carried = in_newtons(model, cluster, reactions);
    Reactions one = reactions;
    MatX pressed(carried.size(), stress.cols());
    for (Eigen::Index s = 0; s < stress.cols(); ++s) {
      std::vector<Vec6> none(model.parts.size(), Vec6::Zero());
      cluster_wrenches(model, work, cluster, VecX(stress.col(s)), none, one);
      pressed.col(s) = in_newtons(model, cluster, one);
    }
    pressed = orthonormal_columns(pressed, 1e-9);
    const double most = carried.cwiseAbs().maxCoeff();
    if (!(most > 0.0)) continue;
    const auto open = [&](Eigen::Index joint) {
      const auto rows = pressed.middleRows(6 * joint, 6);
      return (rows * (rows.transpose() * carried.segment<6>(6 * joint))).norm() / most;
    };
    Eigen::Index joint = 0;
    for (int i : c.parts) out.part[i] = open(joint++);
    for (int l : c.loops) out.loop[l] = open(joint++);
  }
  return out;
}

namespace {

// Work is done by the wrenches that parts need beyond their loads. Along the independent rates it is that of the joints' own forces, so
// that it is enough to look at the motion that is left while these rest: a twist of each part, unless deformations close loops.
template <class W>
FLEXFRAME_INLINE double power_of_parts(const Model& model, const W& work) {
  using Twist = typename W::In::Twist;
  bool deforms = false;
  for (const ClusterWork& cw : work.clusters) deforms = deforms || cw.plan.deforms;
  static thread_local VecX momentum;
  static thread_local std::vector<Twist> driven;
  driven.resize(model.parts.size());
  double power = 0.0;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    const int n = part.body.n;
    Twist& V = driven[i];
    if (deforms) {
      V = p.V;
      for (int k = 0; k < part.joint.nv; ++k) power -= p.tau[k] * work.w[part.v0 + k];
    } else {
      if (part.parent == ground) V.setZero();
      else V = to_child(p.in_carrier, driven[part.parent]);
      if (part.joint.motion >= 0) V += p.driven * work.motion[part.joint.motion].rate;
      const ClusterWork& cw = work.clusters[part.cluster];
      for (int k = 0; k < part.joint.nv && !cw.partition.dep.empty(); ++k) {
        const int d = -1 - cw.plan.place[part.v0 + k - model.clusters[part.cluster].v0];
        if (d < 0) continue;
        V += column(p.Hj, k) * cw.e0[d];
        power -= p.tau[k] * cw.e0[d];
      }
    }
    Twist need = p.terms.Mrr.lazyProduct(p.A) + p.terms.cr - p.load;
    if (deforms && n > 0) {
      const bool unit = part.body.stiffness.size() > 0 && p.terms.Mee.size() == 0;
      const MatX* const mass = unit ? nullptr : &elastic_mass(kinetic_body(model, work, static_cast<int>(i)), p.terms);
      momentum.resize(n);
      by_count(
          n, [&](auto count) __attribute__((always_inline)) { power += elastic_power<count()>(mass, p, momentum, need); });
    } else if (n > 0) {
      need += combine_few(p.terms.Mre, p.qdd);
    }
    power += need.dot(V);
  }
  return power;
}
FLEXFRAME_WIDE double wide_power(const Model& model, const Work& work) { return power_of_parts(model, work); }
FLEXFRAME_WIDE double wide_power(const Model& model, const PlaneWork& work) { return power_of_parts(model, work); }

}  // namespace

template <class W>
double motion_power(const Model& model, const W& work) {
  double fed = 0.0;
  for (const ClusterWork& cw : work.clusters) {
    if (!cw.fed_known) return wide_power(model, work);
    fed += cw.fed;
  }
  return fed;
}

#define FLEXFRAME_FOR(W)                                               \
  template VecX closure_multipliers(const Model&, W&, int);            \
  template void compute_reactions(const Model&, W&, Reactions&, bool); \
  template double motion_power(const Model&, const W&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

}  // namespace flexframe::sim
