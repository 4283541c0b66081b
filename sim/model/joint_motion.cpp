#include "sim/model/joint_motion.h"

namespace flexframe::sim {
namespace {

Quat quaternion(const double* q) { return Quat(q[0], q[1], q[2], q[3]).normalized(); }

// dq/dt = 1/2 q o [0, w]; every reader normalises, so the length may drift freely.
void quaternion_rate(const double* q, const Vec3& w, double* qd) {
  const Quat a(q[0], q[1], q[2], q[3]);
  const Quat d = a * Quat(0.0, w.x(), w.y(), w.z());
  qd[0] = 0.5 * d.w(), qd[1] = 0.5 * d.x(), qd[2] = 0.5 * d.y(), qd[3] = 0.5 * d.z();
}

// Rotation vector of a flexure, or its rate: all three components, or the two that are not along the joint's axis.
Vec3 flexure_vector(const TreeJoint& joint, const double* q) {
  Vec3 out = Vec3::Zero();
  for (int a = 0, at = 0; a < 3; ++a)
    if (joint.kind == JointKind::flexure || joint.axis[a] == 0.0) out[a] = q[at++];
  return out;
}

void turn_quaternion(double* q, const Vec3& a) {
  const double angle = a.norm();
  const double k = angle > 0.0 ? std::sin(0.5 * angle) / angle : 0.5;
  const Quat r = (quaternion(q) * Quat(std::cos(0.5 * angle), k * a.x(), k * a.y(), k * a.z())).normalized();
  q[0] = r.w(), q[1] = r.x(), q[2] = r.y(), q[3] = r.z();
}

}  // namespace

int position_count(JointKind kind) {
  switch (kind) {
    case JointKind::revolute: case JointKind::prismatic: case JointKind::screw: return 1;
    case JointKind::cylindrical: case JointKind::universal: case JointKind::flexure_pair: return 2;
    case JointKind::planar: case JointKind::flexure: return 3;
    case JointKind::spherical: return 4;
    case JointKind::free: return 7;
    default: return 0;
  }
}

int rate_count(JointKind kind) {
  switch (kind) {
    case JointKind::spherical: return 3;
    case JointKind::free: return 6;
    default: return position_count(kind);
  }
}

bool is_tree_kind(JointKind kind) {
  return kind != JointKind::point_on_line && kind != JointKind::point_on_plane && kind != JointKind::distance;
}

JointAxes joint_axes(const Vec3& axis) {
  // The coordinate axis that is least along the joint's gives the first normal; for a joint about z: x, y.
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(axis[i]) < std::abs(axis[least])) least = i;
  JointAxes f;
  f.z = axis;
  f.x = (Vec3::Unit(least) - axis[least] * axis).normalized();
  f.y = f.z.cross(f.x);
  return f;
}

void update_joint_position(const TreeJoint& joint, const double* q, JointMotion& out) {
  const Vec3& a = joint.axis;
  out.pose = Pose{};
  out.S.setZero();
  switch (joint.kind) {
    case JointKind::revolute:
      out.pose.R = rotation_exp(a * q[0]);
      out.S.col(0).tail<3>() = a;
      break;
    case JointKind::prismatic:
      out.pose.p = a * q[0];
      out.S.col(0).head<3>() = a;
      break;
    case JointKind::screw:
      out.pose.R = rotation_exp(a * q[0]);
      out.pose.p = a * (joint.pitch * q[0]);
      out.S.col(0).head<3>() = joint.pitch * a;
      out.S.col(0).tail<3>() = a;
      break;
    case JointKind::cylindrical:
      out.pose.R = rotation_exp(a * q[1]);
      out.pose.p = a * q[0];
      out.S.col(0).head<3>() = a;
      out.S.col(1).tail<3>() = a;
      break;
    case JointKind::universal: {
      const Vec3 b = joint_axes(a).x;
      const Mat3 R2 = rotation_exp(b * q[1]);
      out.pose.R = rotation_exp(a * q[0]) * R2;
      out.S.col(0).tail<3>() = R2.transpose() * a;
      out.S.col(1).tail<3>() = b;
      break;
    }
    case JointKind::planar: {
      const JointAxes f = joint_axes(a);
      out.pose.R = rotation_exp(a * q[2]);
      out.pose.p = f.x * q[0] + f.y * q[1];
      out.S.col(0).head<3>() = out.pose.R.transpose() * f.x;
      out.S.col(1).head<3>() = out.pose.R.transpose() * f.y;
      out.S.col(2).tail<3>() = a;
      break;
    }
    case JointKind::flexure: case JointKind::flexure_pair: {
      const Vec3 theta = flexure_vector(joint, q);
      const RotationSeries k(theta.squaredNorm());
      out.pose.R = rotation_exp(theta);
      const Mat3 J = right_jacobian(theta, k);
      for (int i = 0, at = 0; i < 3; ++i)
        if (joint.kind == JointKind::flexure || joint.axis[i] == 0.0) out.S.col(at++).tail<3>() = J.col(i);
      break;
    }
    case JointKind::spherical:
      out.pose.R = quaternion(q).toRotationMatrix();
      out.S.block<3, 3>(3, 0).setIdentity();
      break;
    case JointKind::free:
      out.pose.p = Vec3(q[0], q[1], q[2]);
      out.pose.R = quaternion(q + 3).toRotationMatrix();
      out.S.setIdentity();
      break;
    default: break;
  }
  if (joint.reversed) {
    // Twist of A relative to B in A's axes: -Ad(pose) S.
    for (int i = 0; i < rate_count(joint.kind); ++i) out.S.col(i) = -to_parent(out.pose, out.S.col(i));
    out.pose = inverse(out.pose);
  }
}

void update_joint_velocity(const TreeJoint& joint, const double* q, const double* w, JointMotion& out) {
  const int nv = rate_count(joint.kind);
  out.W.setZero();
  for (int i = 0; i < nv; ++i) out.W += out.S.col(i) * w[i];
  out.bias.setZero();
  const Vec3& a = joint.axis;
  if (joint.kind == JointKind::universal) {
    const Vec3 b = joint_axes(a).x;
    out.bias.tail<3>() = -w[1] * w[0] * b.cross(Vec3(rotation_exp(b * -q[1]) * a));
  } else if (joint.kind == JointKind::planar) {
    const JointAxes f = joint_axes(a);
    out.bias.head<3>() = -w[2] * a.cross(Vec3(rotation_exp(a * -q[2]) * (f.x * w[0] + f.y * w[1])));
  } else if (joint.kind == JointKind::flexure || joint.kind == JointKind::flexure_pair) {
    const Vec3 theta = flexure_vector(joint, q);
    out.bias.tail<3>() = right_jacobian_rate(theta, flexure_vector(joint, w), RotationSeries(theta.squaredNorm()));
  }
  if (joint.reversed) {
    // out.pose is already the inverse: -Ad(pose) of the forward bias.
    const Pose forward = inverse(out.pose);
    out.bias = -to_parent(forward, out.bias);
  }
}

void coordinate_rates(JointKind kind, const double* q, const double* w, double* qd) {
  switch (kind) {
    case JointKind::spherical: quaternion_rate(q, Vec3(w[0], w[1], w[2]), qd); break;
    case JointKind::free: {
      const Vec3 v = quaternion(q + 3) * Vec3(w[0], w[1], w[2]);
      qd[0] = v.x(), qd[1] = v.y(), qd[2] = v.z();
      quaternion_rate(q + 3, Vec3(w[3], w[4], w[5]), qd + 3);
      break;
    }
    default:
      for (int i = 0; i < rate_count(kind); ++i) qd[i] = w[i];
  }
}

void move_coordinates(JointKind kind, double* q, const double* dw) {
  switch (kind) {
    case JointKind::spherical: turn_quaternion(q, Vec3(dw[0], dw[1], dw[2])); break;
    case JointKind::free: {
      const Vec3 d = quaternion(q + 3) * Vec3(dw[0], dw[1], dw[2]);
      for (int i = 0; i < 3; ++i) q[i] += d[i];
      turn_quaternion(q + 3, Vec3(dw[3], dw[4], dw[5]));
      break;
    }
    default:
      for (int i = 0; i < rate_count(kind); ++i) q[i] += dw[i];
  }
}

void zero_coordinates(JointKind kind, double* q) {
  for (int i = 0; i < position_count(kind); ++i) q[i] = 0.0;
  if (kind == JointKind::spherical) q[0] = 1.0;
  if (kind == JointKind::free) q[3] = 1.0;
}

}  // namespace flexframe::sim
