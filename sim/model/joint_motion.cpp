#include "sim/model/joint_motion.h"

#include "sim/base/sine_cosine.h"
#include "sim/scene/curve.h"
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
  if (joint.curve) {
    const SpaceCurve::Jet at = joint.curve->at(q[0]);
    out.pose.p = at.place;
    out.S.col(0).head<3>() = at.tangent;
  } else {
    traits(joint.kind).place(joint.axis, joint.pitch, q, out.pose, out.S);
  }
  if (!joint.reversed) return;
  // Twist of A relative to B in A's axes: -Ad(pose) S.
  for (int i = 0; i < rates_of(joint.kind); ++i) out.S.col(i) = -to_parent(out.pose, out.S.col(i));
  out.pose = inverse(out.pose);
}

void update_joint_pose(const TreeJoint& joint, const double* q, JointMotion& out) {
  if (joint.reversed || (joint.kind != JointKind::revolute && joint.kind != JointKind::prismatic))
    return update_joint_position(joint, q, out);
  if (joint.kind == JointKind::prismatic) {
    out.pose.R.setIdentity();
    out.pose.p = joint.axis * q[0];
    return;
  }
  out.pose.R = Eigen::AngleAxisd(q[0], joint.axis).toRotationMatrix();
  out.pose.p.setZero();
}

void update_joint_velocity(const TreeJoint& joint, const double* q, const double* w, JointMotion& out) {
  out.W.setZero();
  for (int i = 0; i < rates_of(joint.kind); ++i) out.W += out.S.col(i) * w[i];
  out.bias.setZero();
  const auto bias = traits(joint.kind).bias;
  if (joint.curve) out.bias.head<3>() = joint.curve->at(q[0]).bend * (w[0] * w[0]);
  else if (bias) bias(joint.axis, q, w, out.bias);
  else return;
  // out.pose is already the inverse: -Ad(pose) of the forward bias.
  if (joint.reversed) out.bias = -to_parent(inverse(out.pose), out.bias);
}

bool in_plane(const TreeJoint& joint, const Mat3& QA, const Mat3& QB, PlaneJoint& out) {
  out.reversed = joint.reversed;
  out.rates = rates_of(joint.kind);
  if (out.rates > 3 || !rotation_in_plane(QA.transpose() * QB, out.zero)) return false;
  // What each rate does at the origin tells what it does everywhere, if the joint is one of those in a plane: that is tried at some place.
  const auto place = [&](const double* q, Pose& pose, Mat6& S) {
    pose = Pose{};
    S.setZero();
    traits(joint.kind).place(joint.axis, joint.pitch, q, pose, S);
  };
  Pose pose;
  Mat6 S;
  const double origin[6] = {}, somewhere[3] = {0.3, 0.7, 0.2};
  if (has_orientation(joint.kind)) return false;
  place(origin, pose, S);
  double angle = 0.0;
  Vec3 along = Vec3::Zero();
  for (int k = 0; k < out.rates; ++k) {
    const Vec3 v = QA.transpose() * S.col(k).head<3>(), w = QA.transpose() * S.col(k).tail<3>();
    if (std::abs(v.z()) > 1e-9 || w.head<2>().norm() > 1e-9 || (std::abs(w.z()) > 1e-9) == (v.norm() > 1e-9)) return false;
    const size_t at = k;
    out.direction[at] = v.head<2>();
    out.sense[at] = std::abs(w.z()) > 1e-9 ? std::copysign(1.0, w.z()) : 0.0;
    (out.sense[at] == 0.0 ? out.slides : out.turns) = true;
    angle += out.sense[at] * somewhere[k];
    along += v * somewhere[k];
  }
  place(somewhere, pose, S);
  const Mat3 turned = rotation_exp(Vec3(angle * QA.col(2)));
  if ((pose.p - QA * along).norm() > 1e-9 || (pose.R - turned).norm() > 1e-9) return false;
  if (out.rates == 0 && joint.reversed) out.zero = inverse(out.zero);
  return true;
}

void update_joint_position(const PlaneJoint& joint, const double* q, JointMotionIn<Plane>& out) {
  out.pose = joint.zero;
  if (joint.rates == 0) return;
  if (joint.rates == 1 && joint.turns && !joint.reversed) {
    // A hinge, as below.
    double s, c;
    sine_cosine(joint.sense[0] * q[0], s, c);
    out.pose = {c * joint.zero.c - s * joint.zero.s, s * joint.zero.c + c * joint.zero.s, Vec2::Zero()};
    out.S.col(0) = Vec3(0.0, 0.0, joint.sense[0]);
    return;
  }
  double angle = 0.0;
  Vec2 along = Vec2::Zero();
  for (size_t k = 0; k < static_cast<size_t>(joint.rates); ++k) {
    angle += joint.sense[k] * q[k];
    along += joint.direction[k] * q[k];
  }
  if (joint.turns) out.pose = compose(PlanePose{std::cos(angle), std::sin(angle), Vec2::Zero()}, joint.zero);
  out.pose.p = along;
  for (size_t k = 0; k < static_cast<size_t>(joint.rates); ++k)
    out.S.col(static_cast<Eigen::Index>(k)) = joined(turn_back(out.pose, joint.direction[k]), joint.sense[k]);
  if (!joint.reversed) return;
  for (int k = 0; k < joint.rates; ++k) out.S.col(k) = -to_parent(out.pose, out.S.col(k));
  out.pose = inverse(out.pose);
}

void update_joint_velocity(const PlaneJoint& joint, const double*, const double* w, JointMotionIn<Plane>& out) {
  out.bias.setZero();
  if (joint.rates == 1) {
    out.W = out.S.col(0) * w[0];
    return;
  }
  out.W.setZero();
  for (int k = 0; k < joint.rates; ++k) out.W += out.S.col(k) * w[k];
  if (!joint.slides || !joint.turns) return;
  const PlanePose forward = joint.reversed ? inverse(out.pose) : out.pose;
  double turning = 0.0;
  Vec2 along = Vec2::Zero();
  for (size_t k = 0; k < static_cast<size_t>(joint.rates); ++k) {
    turning += joint.sense[k] * w[k];
    along += joint.direction[k] * w[k];
  }
  out.bias = joined(-cross(turning, turn_back(forward, along)), 0.0);
  if (joint.reversed) out.bias = -to_parent(forward, out.bias);
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
