// Rigid-body kinematics of motion in a plane: spatial.h's functions with three components where space has six.
//
// Twist [vx, vy, w], wrench [fx, fy, m], pose (cos, sin, x, y), each in planar axes of its frame whose third axis is the plane's normal.
#pragma once

#include "sim/base/small_matrices.h"
#include "sim/base/spatial.h"

namespace flexframe::sim {

using Vec2 = Eigen::Vector2d;

struct PlanePose {
  double c = 1.0, s = 0.0;
  Vec2 p = Vec2::Zero();
};

inline Vec2 linear(const Vec3& V) { return V.head<2>(); }
inline double angular(const Vec3& V) { return V.z(); }
inline Vec3 joined(const Vec2& v, double w) { return {v.x(), v.y(), w}; }
inline Vec2 turn(const PlanePose& a, const Vec2& v) { return {a.c * v.x() - a.s * v.y(), a.s * v.x() + a.c * v.y()}; }
inline Vec2 turn_back(const PlanePose& a, const Vec2& v) { return {a.c * v.x() + a.s * v.y(), a.c * v.y() - a.s * v.x()}; }
inline double turn(const PlanePose&, double w) { return w; }
inline double turn_back(const PlanePose&, double w) { return w; }
// w x v; of two vectors of the plane along its normal; of two along the normal nothing.
inline Vec2 cross(double w, const Vec2& v) { return {-w * v.y(), w * v.x()}; }
inline Vec2 cross(const Vec2& v, double w) { return {w * v.y(), -w * v.x()}; }
inline double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }
inline double cross(double, double) { return 0.0; }
inline double as_angular(const Eigen::Matrix<double, 1, 1>& w) { return w[0]; }
inline double dot(double a, double b) { return a * b; }
inline double dot(const Vec2& a, const Vec2& b) { return a.dot(b); }

inline PlanePose compose(const PlanePose& a, const PlanePose& b) {
  return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s, a.p + turn(a, b.p)};
}
inline PlanePose inverse(const PlanePose& a) { return {a.c, -a.s, -turn_back(a, a.p)}; }

// A turn between two sets of planar axes; false if it leaves the plane by more than rounding.
inline bool rotation_in_plane(const Mat3& R, PlanePose& out) {
  if (std::abs(R(2, 2) - 1.0) > 1e-12 || std::hypot(R(0, 2), R(1, 2)) > 1e-9) return false;
  const double angle = std::atan2(R(1, 0), R(0, 0));
  out.c = std::cos(angle);
  out.s = std::sin(angle);
  return true;
}
// Axes whose third is n: the coordinate axes themselves where n is z.
inline Mat3 axes_about(const Vec3& n) {
  if (n.z() < -0.5) return axes_about(Vec3(-n)) * Vec3(1.0, -1.0, -1.0).asDiagonal();
  return shortest_turn(Vec3::UnitZ(), n).toRotationMatrix();
}

inline Vec3 to_child(const PlanePose& a, const Vec3& V) {
  const double w = V.z();
  return joined(turn_back(a, Vec2(V.x() - w * a.p.y(), V.y() + w * a.p.x())), w);
}
inline Vec3 to_parent(const PlanePose& a, const Vec3& V) {
  const double w = V.z();
  const Vec2 v = turn(a, linear(V));
  return {v.x() + w * a.p.y(), v.y() - w * a.p.x(), w};
}
inline Vec3 wrench_to_parent(const PlanePose& a, const Vec3& F) {
  const Vec2 f = turn(a, linear(F));
  return {f.x(), f.y(), F.z() + a.p.x() * f.y() - a.p.y() * f.x()};
}
inline Vec3 wrench_to_child(const PlanePose& a, const Vec3& F) {
  return joined(turn_back(a, linear(F)), F.z() - (a.p.x() * F.y() - a.p.y() * F.x()));
}
inline Mat3 child_matrix(const PlanePose& a) {
  Mat3 X;
  X << a.c, a.s, -a.c * a.p.y() + a.s * a.p.x(), -a.s, a.c, a.s * a.p.y() + a.c * a.p.x(), 0.0, 0.0, 1.0;
  return X;
}
inline Vec3 bracket(const Vec3& W, const Vec3& V) { return {-W.z() * V.y() + W.y() * V.z(), W.z() * V.x() - W.x() * V.z(), 0.0}; }

// Motion in a plane, beside Space.
struct Plane {
  using Pose = PlanePose;
  using Linear = Vec2;
  using Angular = double;
  using Twist = Vec3;
  using Inertia = Mat3;
  using Columns = MatX3;  // component by component: its kernels run along the coordinates
  static constexpr int linear = 2, angular = 1, tensor = 1;
  static Angular no_turn() { return 0.0; }
};

}  // namespace flexframe::sim
