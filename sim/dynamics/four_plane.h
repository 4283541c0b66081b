// plane.h's poses of four places of a mechanism at once, each place in a lane of its own: the same formulas, for samples of a run, which do
// not depend on each other.
#pragma once

#include "sim/base/four.h"
#include "sim/base/plane.h"
#include "sim/base/sines_cosines.h"
#include "sim/dynamics/plane_work.h"

#include <vector>

namespace flexframe::sim {

// A coordinate at four places.
struct FourNumbers {
  Four v{};
};

struct FourVector {
  Four x{}, y{};
};

struct FourPose {
  Four c{}, s{};
  FourVector p;
};

// Of a twist [v w] or wrench [f m].
struct FourTwist {
  FourVector v;
  Four w{};
};

// The same in all lanes.
FLEXFRAME_INLINE FourPose four_times(const PlanePose& a) { return {Four{} + a.c, Four{} + a.s, {Four{} + a.p.x(), Four{} + a.p.y()}}; }
inline PlanePose lane_of(const FourPose& a, int lane) { return {a.c[lane], a.s[lane], Vec2(a.p.x[lane], a.p.y[lane])}; }

// P: FourPose or PlanePose, V: FourVector or Vec2's numbers.
template <class P, class N>
FLEXFRAME_INLINE FourVector turned(const P& a, const N& x, const N& y) {
  return {a.c * x - a.s * y, a.s * x + a.c * y};
}
FLEXFRAME_INLINE FourVector turned_back(const FourPose& a, const FourVector& v) { return {a.c * v.x + a.s * v.y, a.c * v.y - a.s * v.x}; }

FLEXFRAME_INLINE FourPose compose(const FourPose& a, const FourPose& b) {
  const FourVector p = turned(a, b.p.x, b.p.y);
  return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s, {a.p.x + p.x, a.p.y + p.y}};
}
FLEXFRAME_INLINE FourPose compose(const PlanePose& a, const FourPose& b) { return compose(four_times(a), b); }
FLEXFRAME_INLINE FourPose inverse(const FourPose& a) {
  const FourVector p = turned_back(a, a.p);
  return {a.c, -a.s, {-p.x, -p.y}};
}
FLEXFRAME_INLINE FourTwist to_parent(const FourPose& a, const FourTwist& V) {
  const FourVector v = turned(a, V.v.x, V.v.y);
  return {{v.x + V.w * a.p.y, v.y - V.w * a.p.x}, V.w};
}

// What the recursions of chain.h meet of a mechanism at four places. Frames that move in nothing stand there from the beginning.
struct FourPlane {
  using Pose = FourPose;
};
struct FourFrame {
  FourPose pose;
};
struct FourPart {
  struct {
    FourPose pose;
  } joint;
  FourPose step, in_base, in_carrier, world;  // as PartMotion has them
};
struct FourMotion {
  FourNumbers value;
};
struct FourWork {
  using In = FourPlane;
  const Carrying& carrying;
  const PlaneMotion& plane;
  std::vector<FourNumbers> q;      // of the model
  std::vector<FourMotion> motion;  // by expression
  std::vector<FourFrame> frames;
  std::vector<FourPart> parts;
};
inline const PlaneJoint& tree_joint(const Model&, const FourWork& work, int part) { return work.plane.tree[part]; }
inline const PlanePose& entry_pose(const Model&, const FourWork& work, int cluster, size_t entry) {
  return work.plane.entries[cluster][entry];
}

// joint_motion.h: the pose across a joint.
template <class Joint>
FLEXFRAME_INLINE void place_joint(const PlaneJoint& joint, const FourNumbers* q, Joint& out) {
  Four angle{};
  FourVector along;
  for (size_t k = 0; k < static_cast<size_t>(joint.rates); ++k) {
    angle += joint.sense[k] * q[k].v;
    along.x += joint.direction[k].x() * q[k].v;
    along.y += joint.direction[k].y() * q[k].v;
  }
  out.pose = four_times(joint.zero);
  if (joint.rates == 0) return;
  if (joint.turns) {
    FourPose turn;
    sine_cosine(angle, turn.s, turn.c);
    out.pose = compose(turn, out.pose);
  }
  out.pose.p = along;
  if (joint.reversed) out.pose = inverse(out.pose);
}
template <class Joint>
FLEXFRAME_INLINE void update_joint_position(const PlaneJoint& joint, const FourNumbers* q, Joint& out) {
  place_joint(joint, q, out);
}

}  // namespace flexframe::sim
