#include "sim/model/joint_motion.h"

#include "sim/scene/joint_kinds.h"

namespace flexframe::sim {
namespace {

Quat quaternion(const double* q) { return Quat(q[0], q[1], q[2], q[3]).normalized(); }

// dq/dt = 1/2 q o [0, w]; every reader normalises, so the length may drift freely.
void quaternion_rate(const double* q, const Vec3& w, double* qd) {
  const Quat a(q[0], q[1], q[2], q[3]);
  const Quat d = a * Quat(0.0, w.x(), w.y(), w.z());
  qd[0] = 0.5 * d.w(), qd[1] = 0.5 * d.x(), qd[2] = 0.5 * d.y(), qd[3] = 0.5 * d.z();
}

void turn_quaternion(double* q, const Vec3& a) {
  const double angle = a.norm();
  const double k = angle > 0.0 ? std::sin(0.5 * angle) / angle : 0.5;
  const Quat r = (quaternion(q) * Quat(std::cos(0.5 * angle), k * a.x(), k * a.y(), k * a.z())).normalized();
  q[0] = r.w(), q[1] = r.x(), q[2] = r.y(), q[3] = r.z();
}

}  // namespace

int rate_count(JointKind kind) { return rates_of(kind); }
int position_count(JointKind kind) { return rates_of(kind) + has_orientation(kind); }
bool is_tree_kind(JointKind kind) { return traits(kind).place != nullptr; }

JointAxes joint_axes(const Vec3& axis) {
  const auto [x, y] = axis_normals(axis);
  return {x, y, axis};
}

void update_joint_position(const TreeJoint& joint, const double* q, JointMotion& out) {
  out.pose = Pose{};
  out.S.setZero();
  traits(joint.kind).place(joint.axis, joint.pitch, q, out.pose, out.S);
  if (!joint.reversed) return;
  // Twist of A relative to B in A's axes: -Ad(pose) S.
  for (int i = 0; i < rates_of(joint.kind); ++i) out.S.col(i) = -to_parent(out.pose, out.S.col(i));
  out.pose = inverse(out.pose);
}

void update_joint_velocity(const TreeJoint& joint, const double* q, const double* w, JointMotion& out) {
  out.W.setZero();
  for (int i = 0; i < rates_of(joint.kind); ++i) out.W += out.S.col(i) * w[i];
  out.bias.setZero();
  const auto bias = traits(joint.kind).bias;
  if (!bias) return;
  bias(joint.axis, q, w, out.bias);
  // out.pose is already the inverse: -Ad(pose) of the forward bias.
  if (joint.reversed) out.bias = -to_parent(inverse(out.pose), out.bias);
}

void coordinate_rates(JointKind kind, const double* q, const double* w, double* qd) {
  const int at = traits(kind).quaternion;
  if (at < 0) {
    for (int i = 0; i < rates_of(kind); ++i) qd[i] = w[i];
    return;
  }
  if (at > 0) {
    const Vec3 v = quaternion(q + at) * Vec3(w[0], w[1], w[2]);
    qd[0] = v.x(), qd[1] = v.y(), qd[2] = v.z();
  }
  quaternion_rate(q + at, Vec3(w[at], w[at + 1], w[at + 2]), qd + at);
}

void move_coordinates(JointKind kind, double* q, const double* dw) {
  const int at = traits(kind).quaternion;
  if (at < 0) {
    for (int i = 0; i < rates_of(kind); ++i) q[i] += dw[i];
    return;
  }
  if (at > 0) {
    const Vec3 d = quaternion(q + at) * Vec3(dw[0], dw[1], dw[2]);
    for (int i = 0; i < 3; ++i) q[i] += d[i];
  }
  turn_quaternion(q + at, Vec3(dw[at], dw[at + 1], dw[at + 2]));
}

void zero_coordinates(JointKind kind, double* q) {
  for (int i = 0; i < position_count(kind); ++i) q[i] = 0.0;
  if (has_orientation(kind)) q[traits(kind).quaternion] = 1.0;
}

}  // namespace flexframe::sim
