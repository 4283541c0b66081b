#include "sim/reactions.h"

#include "sim/closure.h"
#include "sim/kinematics.h"

#include <algorithm>

namespace flexframe::sim {

VecX closure_multipliers(const Model& model, Work& work, int cluster, bool minimum_norm) {
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), rows = closure_row_count(model, work, cluster);
  VecX all = VecX::Zero(rows);
  if (nd == 0) return all;
  // G_dep^T lambda = what is left of the dependent coordinates' equations.
  const VecX left = cw.M * cw.wdot + cw.r + cw.Ib.transpose() * cw.base_A;
  VecX rhs(nd);
  for (int i = 0; i < nd; ++i) rhs[i] = left[part.dep[i]];
  const VecX basic = cw.lu.transpose().solve(rhs);
  for (int i = 0; i < nd; ++i) all[part.rows[i]] = basic[i];
  const int locks = static_cast<int>(cw.locked.size());
  std::vector<int> redundant;
  for (int r = 0; r < rows - locks; ++r)
    if (std::find(part.rows.begin(), part.rows.end(), r) == part.rows.end()) redundant.push_back(r);
  if (!minimum_norm || redundant.empty()) return all;

  // Row r of the redundant ones is L_r times the independent ones: basic = lambda_independent + L^T lambda_redundant.
  update_closure_matrix(model, cluster, work, true);
  const int nr = static_cast<int>(redundant.size());
  MatX Gr(nr, nd);
  for (int i = 0; i < nr; ++i)
    for (int k = 0; k < nd; ++k) Gr(i, k) = cw.G(redundant[i], part.dep[k]);
  const MatX Lt = cw.lu.transpose().solve(Gr.transpose());
  // Newtons: moments divided by the size.
  VecX weight = VecX::Ones(rows);
  int row = 0;
  for (int l : model.clusters[cluster].loops)
    for (const ClosureRow& r : model.loops[l].rows) weight[row++] = r.kind == ClosureRow::angle ? model.clusters[cluster].size : 1.0;
  MatX A(nd, nd + nr);
  A.setZero();
  for (int i = 0; i < nd; ++i) A(i, i) = weight[part.rows[i]];
  for (int i = 0; i < nr; ++i) A.col(nd + i) = weight[redundant[i]] * Lt.col(i);
  const VecX shared = A.transpose() * (A * A.transpose()).llt().solve(basic);
  for (int i = 0; i < nd; ++i) all[part.rows[i]] = weight[part.rows[i]] * shared[i];
  for (int i = 0; i < nr; ++i) all[redundant[i]] = weight[redundant[i]] * shared[nd + i];
  return all;
}

void compute_reactions(const Model& model, Work& work, Reactions& out, bool minimum_norm) {
  out.part.assign(model.parts.size(), Vec6::Zero());
  out.loop.assign(model.loops.size(), Vec6::Zero());
  // What each part needs beyond its loads, about its body frame.
  std::vector<Vec6> need(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const PartWork& p = work.parts[i];
    need[i] = p.terms.Mrr * p.A + p.terms.cr - p.load;
    if (p.qdd.size() > 0) need[i] += p.terms.Mre * p.qdd;
  }
  // Loop joints.
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const Cluster& c = model.clusters[k];
    const ClusterWork& cw = work.clusters[k];
    if (cw.partition.dep.empty() || c.loops.empty()) continue;
    const VecX all = closure_multipliers(model, work, static_cast<int>(k), minimum_norm);
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
