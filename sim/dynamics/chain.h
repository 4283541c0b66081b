// The places of a cluster's parts one after the other, as a part of functions that are compiled for wider registers (wide.h).
#pragma once

#include "sim/base/sine_cosine.h"
#include "sim/base/sized.h"
#include "sim/dynamics/kinematics.h"

namespace flexframe::sim {

// The pose of a joint whose twists are constant (Carrying::fixed).
FLEXFRAME_INLINE void place_joint(const TreeJoint& joint, const double* q, JointMotion& out) { update_joint_pose(joint, q, out); }
FLEXFRAME_INLINE void place_joint(const PlaneJoint& joint, const double* q, JointMotionIn<Plane>& out) {
  if (joint.rates != 1 || joint.reversed) return update_joint_position(joint, q, out);
  if (!joint.turns) {
    out.pose = {joint.zero.c, joint.zero.s, joint.direction[0] * q[0]};
    return;
  }
  double s, c;
  sine_cosine(joint.sense[0] * q[0], s, c);
  out.pose = {c * joint.zero.c - s * joint.zero.s, s * joint.zero.c + c * joint.zero.s, Vec2::Zero()};
}

// update_cluster_frames (kinematics.h).
template <class W>
FLEXFRAME_INLINE void bend_frames(const Model& model, int cluster, W& work) {
  for (int i : model.clusters[cluster].parts) {
    const Part& part = model.parts[i];
    if (part.body.n > 0) copy_few(work.q.data() + part.eq0, part.body.n, work.parts[i].q.data());
  }
  for (int f : work.carrying.bent[static_cast<size_t>(cluster)]) update_frame_pose(model, f, work);
}

// update_chain_from (kinematics.h).
template <class W>
FLEXFRAME_INLINE void place_chain(const Model& model, int cluster, size_t first, W& work) {
  const Cluster& c = model.clusters[cluster];
  size_t entry = 0;
  for (size_t at = 0; at < first; ++at) entry += !work.carrying.inside[static_cast<size_t>(c.parts[at])];
  for (size_t at = first; at < c.parts.size(); ++at) {
    const int i = c.parts[at];
    const Part& part = model.parts[i];
    auto& p = work.parts[i];
    const TreeJoint& j = part.joint;
    const Carrying::Fixed fixed = work.carrying.fixed[static_cast<size_t>(i)];
    const auto* const q = j.motion >= 0 ? &work.motion[j.motion].value : work.q.data() + part.q0;
    if (fixed != Carrying::moving) place_joint(tree_joint(model, work, i), q, p.joint);
    else update_joint_position(tree_joint(model, work, i), q, p.joint);
    if (fixed == Carrying::at_body) p.step = p.joint.pose;
    else p.step = compose(p.joint.pose, inverse(work.frames[j.outboard].pose));
    if (!work.carrying.inside[static_cast<size_t>(i)]) {
      p.in_base = compose(entry_pose(model, work, cluster, entry++), p.step);
      continue;
    }
    p.in_carrier = compose(work.frames[j.inboard].pose, p.step);
    p.in_base = compose(work.parts[part.parent].in_base, p.in_carrier);
  }
}

}  // namespace flexframe::sim
