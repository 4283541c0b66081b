#include "sim/reactions.h"

#include "sim/closure.h"
#include "sim/kinematics.h"

namespace flexframe::sim {

void compute_reactions(const Model& model, const Work& work, Reactions& out) {
  out.part.assign(model.parts.size(), Vec6::Zero());
  out.loop.assign(model.loops.size(), Vec6::Zero());
  // What each part needs beyond its loads, about its body frame.
  std::vector<Vec6> need(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const PartWork& p = work.parts[i];
    need[i] = p.terms.Mrr * p.A + p.terms.cr - p.load;
    if (p.qdd.size() > 0) need[i] += p.terms.Mre * p.qdd;
  }
  // Loop joints: G_dep^T lambda = what is left of the dependent coordinates' equations.
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const Cluster& c = model.clusters[k];
    const ClusterWork& cw = work.clusters[k];
    const int nd = static_cast<int>(cw.partition.dep.size());
    if (nd == 0) continue;
    const VecX left = cw.M * cw.wdot + cw.r + cw.Ib.transpose() * cw.base_A;
    VecX rhs(nd);
    for (int i = 0; i < nd; ++i) rhs[i] = left[cw.partition.dep[i]];
    const VecX lambda = cw.lu.transpose().solve(rhs);
    VecX all = VecX::Zero(closure_row_count(model, work, static_cast<int>(k)));
    for (int i = 0; i < nd; ++i) all[cw.partition.rows[i]] = lambda[i];
    int row = 0;
    for (int l : c.loops) {
      Vec6 on_a, on_b;
      closure_wrench(model, work, static_cast<int>(k), l, all.segment(row, static_cast<Eigen::Index>(model.loops[l].rows.size())), on_a, on_b);
      row += static_cast<int>(model.loops[l].rows.size());
      out.loop[l] = on_b;
      for (const auto& [frame, F] : {std::pair{model.loops[l].a, on_a}, std::pair{model.loops[l].b, on_b}}) {
        const FramePoint& f = model.frames[frame];
        if (f.part != ground) need[f.part] -= wrench_to_parent(work.frames[frame].pose, F);
      }
    }
  }
  // Leaves to root: the joint supplies what the part and everything on it needs.
  for (size_t i = model.parts.size(); i-- > 0;) {
    const Part& part = model.parts[i];
    const PartWork& p = work.parts[i];
    const Vec6 F = wrench_to_child(work.frames[part.joint.outboard].pose, need[i]);
    out.part[i] = F;
    if (part.parent == ground) continue;
    need[part.parent] += wrench_to_parent(work.frames[part.joint.inboard].pose, wrench_to_parent(p.joint.pose, F));
  }
}

double motion_power(const Model& model, const Work& work, const Reactions& reactions) {
  double power = 0.0;
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (model.parts[i].joint.motion >= 0) power += reactions.part[i].dot(work.parts[i].joint.W);
  return power;
}

}  // namespace flexframe::sim
