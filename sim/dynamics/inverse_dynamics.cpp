#include "sim/dynamics/inverse_dynamics.h"

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Accelerations of the parts when independent coordinates do not accelerate (gravity as an acceleration of ground).
void accelerate_at_rest(const Model& model, Work& work) {
  work.wdot.setZero();
  for (size_t at = 0; at < model.clusters.size(); ++at) {
    const Cluster& c = model.clusters[at];
    const ClusterWork& cw = work.clusters[at];
    for (size_t k = 0; k < cw.partition.dep.size(); ++k) work.wdot[c.v0 + cw.partition.dep[k]] = cw.gamma[static_cast<Eigen::Index>(k)];
    update_base_acceleration(model, static_cast<int>(at), work);
    update_cluster_accelerations(model, static_cast<int>(at), work);
  }
}

// Forces on the rates from what each part needs about its body frame (`need`) and its elastic coordinates (PartWork::fe): a joint supplies it and
// passes it on.
void to_coordinates(const Model& model, Work& work, std::vector<Vec6>& need, RestForces& out) {
  out.force = VecX::Zero(model.nv);
  for (size_t i = model.parts.size(); i-- > 0;) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const TreeJoint& j = part.joint;
    const FrameWork& o = work.frames[j.outboard];
    const Vec6 F = wrench_to_child(o.pose, need[i]);
    for (int k = 0; k < j.nv; ++k) out.force[part.v0 + k] = p.tau[k] - p.joint.S.col(k).dot(F);
    if (part.body.n > 0) {
      if (o.flexible) p.fe.noalias() -= o.B.transpose() * F;
      out.force.segment(part.ev0, part.body.n) = -p.fe;
    }
    out.scale = std::max({out.scale, F.head<3>().norm(), F.tail<3>().norm() / model.size});
    if (j.nv > 0) out.scale = std::max(out.scale, p.tau.cwiseAbs().maxCoeff() / model.size);
    if (part.parent == ground) continue;
    const FrameWork& in = work.frames[j.inboard];
    const Vec6 back = wrench_to_parent(p.joint.pose, F);
    need[part.parent] += wrench_to_parent(in.pose, back);
    if (in.flexible) work.parts[part.parent].fe.noalias() += in.B.transpose() * back;
  }
}

}  // namespace

void rest_forces(const Model& model, Work& work, const std::vector<VecX>* elastic, RestForces& out) {
  const size_t n = model.parts.size();
  out.scale = 0.0;
  update_loads(model, work);
  for (size_t i = 0; i < n; ++i) {
    const FlexibleBody& body = model.parts[i].body;
    PartWork& p = work.parts[i];
    update_velocity_terms(body, p.V, p.qd, p.terms);
    if (body.n > 0) {
      if (elastic) p.elastic = (*elastic)[i];
      else elastic_force(body, p.q, p.qd, p.elastic);
    }
    joint_forces(model.parts[i], p, work, p.tau);
  }
  accelerate_at_rest(model, work);

  // What each part needs about its body frame, and its elastic coordinates.
  std::vector<Vec6> need(n);
  for (size_t i = 0; i < n; ++i) {
    PartWork& p = work.parts[i];
    const Vec6 inertia = p.terms.Mrr * p.A + p.terms.cr;
    need[i] = inertia - p.load;
    out.scale = std::max({out.scale, inertia.head<3>().norm(), p.load.head<3>().norm(), p.load.tail<3>().norm() / model.size});
    if (p.qdd.size() == 0) continue;
    need[i].noalias() += p.terms.Mre * p.qdd;
    p.fe = p.terms.ce + p.elastic - p.load_e;
    p.fe.noalias() += p.terms.Mre.transpose() * p.A + elastic_mass(model.parts[i].body, p.terms) * p.qdd;
  }
  to_coordinates(model, work, need, out);

  // Loops: virtual displacements of dependent coordinates follow the independent ones.
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const ClusterWork& cw = work.clusters[c];
    const int v0 = model.clusters[c].v0;
    for (size_t d = 0; d < cw.partition.dep.size(); ++d) {
      double& f = out.force[v0 + cw.partition.dep[d]];
      for (size_t k = 0; k < cw.partition.ind.size(); ++k) out.force[v0 + cw.partition.ind[k]] += cw.E(d, k) * f;
      f = 0.0;
    }
  }
}

void applied_forces(const Model& model, Work& work, RestForces& out) {
  const size_t n = model.parts.size();
  out.scale = 0.0;
  update_loads(model, work);
  std::vector<Vec6> need(n);
  for (size_t i = 0; i < n; ++i) {
    PartWork& p = work.parts[i];
    joint_forces(model.parts[i], p, work, p.tau);
    need[i] = -p.load;
    p.fe = -p.load_e;
    out.scale = std::max({out.scale, p.load.head<3>().norm(), p.load.tail<3>().norm() / model.size});
  }
  to_coordinates(model, work, need, out);
}

}  // namespace flexframe::sim
