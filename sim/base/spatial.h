// Rigid-body kinematics in body-fixed components.
//
// A pose (R, p) of frame C in frame P: x_P = R x_C + p. A twist V = [v; w] holds the velocity of a frame's origin and its angular
// velocity, both in the frame's own axes; a wrench F = [f; m] the force and the moment about the origin. Accelerations are the time
// derivatives of the twist's components, so a frame at rest in a field of gravity g is treated as accelerated by [-R^T g; 0].
// Sources: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, 1994, ch. 2; Featherstone, Rigid Body Dynamics
// Algorithms, 2008, ch. 2 (with linear before angular parts, as in the SID).
#pragma once

#include "sim/base/types.h"

#include <cmath>

namespace flexframe::sim {

// skew(a) b = a x b.
inline Mat3 skew(const Vec3& a) {
  Mat3 s;
  s << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return s;
}

struct Pose {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();
};

inline Pose compose(const Pose& a, const Pose& b) { return {a.R * b.R, a.R * b.p + a.p}; }
inline Pose inverse(const Pose& a) { return {a.R.transpose(), -(a.R.transpose() * a.p)}; }

// Twist of C from the twist of P when C is fixed to P at `pose`: Ad(pose)^-1 V.
inline Vec6 to_child(const Pose& pose, const Vec6& V) {
  Vec6 out;
  const Vec3 w = V.tail<3>();
  out.head<3>().noalias() = pose.R.transpose() * (V.head<3>() + w.cross(pose.p));
  out.tail<3>().noalias() = pose.R.transpose() * w;
  return out;
}

// Twist of P from that of C: Ad(pose) V.
inline Vec6 to_parent(const Pose& pose, const Vec6& V) {
  Vec6 out;
  const Vec3 w = pose.R * V.tail<3>();
  out.head<3>() = pose.R * V.head<3>() - w.cross(pose.p);
  out.tail<3>() = w;
  return out;
}

// Wrench on P equal to a wrench on C: Ad(pose)^-T F.
inline Vec6 wrench_to_parent(const Pose& pose, const Vec6& F) {
  Vec6 out;
  out.head<3>().noalias() = pose.R * F.head<3>();
  out.tail<3>() = pose.R * F.tail<3>() + pose.p.cross(Vec3(out.head<3>()));
  return out;
}

// Wrench on C equal to a wrench on P: Ad(pose)^T F.
inline Vec6 wrench_to_child(const Pose& pose, const Vec6& F) {
  Vec6 out;
  const Vec3 f = F.head<3>();
  out.head<3>().noalias() = pose.R.transpose() * f;
  out.tail<3>().noalias() = pose.R.transpose() * (F.tail<3>() - pose.p.cross(f));
  return out;
}

// 6 x 6 matrix of to_child.
inline Mat6 child_matrix(const Pose& pose) {
  Mat6 X;
  X.topLeftCorner<3, 3>() = pose.R.transpose();
  X.topRightCorner<3, 3>().noalias() = -(pose.R.transpose() * skew(pose.p));
  X.bottomLeftCorner<3, 3>().setZero();
  X.bottomRightCorner<3, 3>() = pose.R.transpose();
  return X;
}

// ad(W) V: the rate at which the components of V change in a frame that moves with W, with the opposite sign.
inline Vec6 bracket(const Vec6& W, const Vec6& V) {
  Vec6 out;
  const Vec3 w = W.tail<3>(), u = W.head<3>(), a = V.tail<3>();
  out.head<3>() = w.cross(Vec3(V.head<3>())) + u.cross(a);
  out.tail<3>() = w.cross(a);
  return out;
}

// Parts of a twist or wrench, and a vector turned with a pose: what is written once for space and for the plane (plane.h) is written in
// these names.
inline Vec3 linear(const Vec6& V) { return V.head<3>(); }
inline Vec3 angular(const Vec6& V) { return V.tail<3>(); }
inline Vec6 joined(const Vec3& v, const Vec3& w) {
  Vec6 out;
  out.head<3>() = v;
  out.tail<3>() = w;
  return out;
}
inline Vec3 turn(const Pose& a, const Vec3& v) { return a.R * v; }
inline Vec3 turn_back(const Pose& a, const Vec3& v) { return a.R.transpose() * v; }
inline Vec3 cross(const Vec3& a, const Vec3& b) { return a.cross(b); }
inline double dot(const Vec3& a, const Vec3& b) { return a.dot(b); }
inline Vec3 as_angular(const Vec3& w) { return w; }

// Motion in space, for templates over the space in which a mechanism moves.
struct Space {
  using Pose = sim::Pose;
  using Linear = Vec3;
  using Angular = Vec3;
  using Twist = Vec6;
  using Inertia = Mat6;
  using Columns = Mat6X;                                     // twists or wrenches, one a coordinate
  static constexpr int linear = 3, angular = 3, tensor = 6;  // components of a vector, of a rotation, of an inertia tensor
  static Angular no_turn() { return Vec3::Zero(); }
};

// sin(a)/a, (1 - cos a)/a^2, (a - sin a)/a^3 and the derivatives of the last two divided by a, without cancellation.
struct RotationSeries {
  double s, b, c, db, dc;
  // a2: the angle squared, rad^2.
  explicit RotationSeries(double a2) {
    // Below 0.25 rad five terms of the series are exact to the last bit; above it the closed forms lose no digits that matter.
    if (a2 < 0.0625) {
      s = 1.0 + a2 * (-1.0 / 6 + a2 * (1.0 / 120 + a2 * (-1.0 / 5040 + a2 / 362880)));
      b = 0.5 + a2 * (-1.0 / 24 + a2 * (1.0 / 720 + a2 * (-1.0 / 40320 + a2 / 3628800)));
      c = 1.0 / 6 + a2 * (-1.0 / 120 + a2 * (1.0 / 5040 + a2 * (-1.0 / 362880 + a2 / 39916800)));
      db = -1.0 / 12 + a2 * (1.0 / 180 + a2 * (-1.0 / 6720 + a2 / 453600));
      dc = -1.0 / 60 + a2 * (1.0 / 1260 + a2 * (-1.0 / 60480 + a2 / 4989600));
    } else {
      const double a = std::sqrt(a2), sn = std::sin(a);
      s = sn / a;
      const double h = std::sin(0.5 * a);
      b = 2.0 * h * h / a2;
      c = (a - sn) / (a2 * a);
      db = (s - 2.0 * b) / a2;
      dc = (b - 3.0 * c) / a2;
    }
  }
};

// exp(skew(a)).
inline Mat3 rotation_exp(const Vec3& a) {
  const RotationSeries k(a.squaredNorm());
  const Mat3 A = skew(a);
  return Mat3::Identity() + k.s * A + k.b * A * A;
}

// The least rotation that turns the direction of `from` into that of `to`, neither of them zero. The bits of Eigen's FromTwoVectors, which
// for opposite directions compiles a singular value decomposition wherever it is called, seconds of each file. Here those, 1 + c being
// rounding, go half a turn about an axis across first.
inline Quat shortest_turn(const Vec3& from, const Vec3& to) {
  const Vec3 a = from.normalized(), b = to.normalized();
  const double c = b.dot(a);
  if (c < -1.0 + 1e-12) {
    const Vec3 across = a.unitOrthogonal();
    return shortest_turn(-a, b) * Quat(0.0, across.x(), across.y(), across.z());
  }
  const double s = std::sqrt((1.0 + c) * 2.0);
  Quat q;
  q.vec() = a.cross(b) * (1.0 / s);
  q.w() = s * 0.5;
  return q;
}

// Rotation vector of a unit quaternion or of R, |a| <= pi.
inline Vec3 rotation_log(Quat q) {
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double n = q.vec().norm();
  if (n < 1e-12) return 2.0 * q.vec();
  return (2.0 * std::atan2(n, q.w()) / n) * q.vec();
}
inline Vec3 rotation_log(const Mat3& R) { return rotation_log(Quat(R)); }

// Right Jacobian: the rotation exp(a) turns with the angular velocity J_r(a) da/dt in its own axes.
inline Mat3 right_jacobian(const Vec3& a, const RotationSeries& k) {
  const Mat3 A = skew(a);
  return Mat3::Identity() - k.b * A + k.c * A * A;
}

// d/dt(J_r(a)) da/dt, the part of the angular acceleration that is quadratic in the rates.
inline Vec3 right_jacobian_rate(const Vec3& a, const Vec3& ad, const RotationSeries& k) {
  const double aad = a.dot(ad);
  const Vec3 x = a.cross(ad);
  return -k.db * aad * x + k.dc * aad * a.cross(x) + k.c * ad.cross(x);
}

}  // namespace flexframe::sim
