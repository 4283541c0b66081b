#include "sim/dynamics/inverse_dynamics.h"

#include "sim/bodies/axis_mass.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Accelerations of the parts when independent coordinates accelerate as given, or not at all (gravity as an acceleration of ground).
void accelerate(const Model& model, const VecX* given, Work& work) {
  work.wdot.setZero();
  for (size_t at = 0; at < model.clusters.size(); ++at) {
    const Cluster& c = model.clusters[at];
    const ClusterWork& cw = work.clusters[at];
    if (given)
      for (int k : cw.partition.ind) work.wdot[c.v0 + k] = (*given)[c.v0 + k];
    for (size_t d = 0; d < cw.partition.dep.size(); ++d) {
      double& a = work.wdot[c.v0 + cw.partition.dep[d]];
      a = cw.gamma[static_cast<Eigen::Index>(d)];
      if (given)
        for (size_t k = 0; k < cw.partition.ind.size(); ++k) a += cw.E(d, k) * (*given)[c.v0 + cw.partition.ind[k]];
    }
    update_base_acceleration(model, static_cast<int>(at), work);
    update_cluster_accelerations(model, static_cast<int>(at), work);
  }
}

// Sums of the sizes of the terms of a part's forces and moments about its body frame, N and Nm, and of its elastic forces.
struct TermSizes {
  double force = 0.0, moment = 0.0;
  VecX elastic;

  // Wrench sizes seen from the other end of a pose.
  TermSizes moved(const Pose& pose) const { return {force, moment + pose.p.norm() * force, {}}; }
};

TermSizes sizes_of(const Vec6& a, const Vec6& b) {
  return {a.head<3>().norm() + b.head<3>().norm(), a.tail<3>().norm() + b.tail<3>().norm(), {}};
}

// Forces on the rates from what each part needs about its body frame (`need`) and its elastic coordinates (PartWork::fe): a joint supplies
// it and passes it on.
void to_coordinates(const Model& model, Work& work, std::vector<Vec6>& need, std::vector<TermSizes>& sizes, RestForces& out) {
  out.force = VecX::Zero(model.nv);
  out.size = VecX::Zero(model.nv);
  for (size_t i = model.parts.size(); i-- > 0;) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const TreeJoint& j = part.joint;
    const FrameWork& o = work.frames[j.outboard];
    const Vec6 F = wrench_to_child(o.pose, need[i]);
    const TermSizes at = sizes[i].moved(o.pose);
    for (int k = 0; k < j.nv; ++k) {
      const Vec6 S = p.joint.S.col(k);
      out.force[part.v0 + k] = p.tau[k] - S.dot(F);
      out.size[part.v0 + k] = std::abs(p.tau[k]) + S.head<3>().norm() * at.force + S.tail<3>().norm() * at.moment;
    }
    if (part.body.n > 0) {
      if (o.flexible) {
        p.fe.noalias() -= o.B.transpose() * F;
        sizes[i].elastic +=
            at.force * o.B.topRows<3>().colwise().norm().transpose() + at.moment * o.B.bottomRows<3>().colwise().norm().transpose();
      }
      out.force.segment(part.ev0, part.body.n) = -p.fe;
      out.size.segment(part.ev0, part.body.n) = sizes[i].elastic;
    }
    out.scale = std::max({out.scale, F.head<3>().norm(), F.tail<3>().norm() / model.size});
    if (j.nv > 0) out.scale = std::max(out.scale, p.tau.cwiseAbs().maxCoeff() / model.size);
    if (part.parent == ground) continue;
    const FrameWork& in = work.frames[j.inboard];
    const Vec6 back = wrench_to_parent(p.joint.pose, F);
    need[part.parent] += wrench_to_parent(in.pose, back);
    const TermSizes carried = at.moved(p.joint.pose), there = carried.moved(in.pose);
    sizes[part.parent].force += there.force;
    sizes[part.parent].moment += there.moment;
    if (in.flexible) {
      work.parts[part.parent].fe.noalias() += in.B.transpose() * back;
      sizes[part.parent].elastic += carried.force * in.B.topRows<3>().colwise().norm().transpose() +
                                    carried.moment * in.B.bottomRows<3>().colwise().norm().transpose();
    }
  }
}

}  // namespace

void rest_forces(const Model& model, Work& work, const std::vector<VecX>* elastic, RestForces& out, const VecX* accelerations) {
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
    joint_forces(model.parts[i], work.joints[i], work.q, work.w, p.tau);
  }
  add_flexure_moments(model, work);
  accelerate(model, accelerations, work);

  // What each part needs about its body frame, and its elastic coordinates.
  std::vector<Vec6> need(n);
  std::vector<TermSizes> sizes(n);
  for (size_t i = 0; i < n; ++i) {
    PartWork& p = work.parts[i];
    const Vec6 inertia = p.terms.Mrr * p.A + p.terms.cr;
    need[i] = inertia - p.load;
    sizes[i] = sizes_of(inertia, p.load);
    // Weight stands in the accelerations, where it may have cancelled.
    sizes[i].force += model.parts[i].body.mass * model.settings.gravity.norm();
    sizes[i].moment += p.terms.md.norm() * model.settings.gravity.norm();
    out.scale = std::max({out.scale, inertia.head<3>().norm(), p.load.head<3>().norm(), p.load.tail<3>().norm() / model.size});
    if (p.qdd.size() == 0) continue;
    const bool accelerates = !p.qdd.isZero(0.0);
    if (accelerates) need[i].noalias() += p.terms.Mre * p.qdd;
    const VecX carried = p.terms.Mre.transpose() * p.A;
    const VecX own = accelerates ? elastic_inertia(model.parts[i].body, p.terms, p.qdd) : VecX(VecX::Zero(p.qdd.size()));
    sizes[i].elastic = p.terms.ce.cwiseAbs() + p.elastic.cwiseAbs() + p.load_e.cwiseAbs() + carried.cwiseAbs() + own.cwiseAbs();
    p.fe = p.terms.ce + p.elastic - p.load_e + carried + own;
  }
  to_coordinates(model, work, need, sizes, out);
  out.unclosed = out.force;

  // Loops: virtual displacements of dependent coordinates follow the independent ones.
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const ClusterWork& cw = work.clusters[c];
    const int v0 = model.clusters[c].v0;
    for (size_t d = 0; d < cw.partition.dep.size(); ++d) {
      double& f = out.force[v0 + cw.partition.dep[d]];
      double& size = out.size[v0 + cw.partition.dep[d]];
      for (size_t k = 0; k < cw.partition.ind.size(); ++k) {
        out.force[v0 + cw.partition.ind[k]] += cw.E(d, k) * f;
        out.size[v0 + cw.partition.ind[k]] += std::abs(cw.E(d, k)) * size;
      }
      f = size = 0.0;
    }
  }
}

void applied_forces(const Model& model, Work& work, RestForces& out) {
  const size_t n = model.parts.size();
  out.scale = 0.0;
  update_loads(model, work);
  std::vector<Vec6> need(n);
  std::vector<TermSizes> sizes(n);
  for (size_t i = 0; i < n; ++i) {
    PartWork& p = work.parts[i];
    joint_forces(model.parts[i], work.joints[i], work.q, work.w, p.tau);
    need[i] = -p.load;
    p.fe = -p.load_e;
    sizes[i] = sizes_of(p.load, Vec6::Zero());
    sizes[i].elastic = p.fe.cwiseAbs();
    out.scale = std::max({out.scale, p.load.head<3>().norm(), p.load.tail<3>().norm() / model.size});
  }
  to_coordinates(model, work, need, sizes, out);
}

}  // namespace flexframe::sim
