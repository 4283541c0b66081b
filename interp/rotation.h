// Rotation vectors and matrices, the small part the map needs.
#pragma once

#include "interp/types.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::interp {

inline Mat3 skew(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Rodrigues: R = I + sin(a)/a [v]x + (1 - cos a)/a^2 [v]x^2, a = |v|; series below 1e-4, where the next term is under 1e-18.
inline Mat3 rotation_matrix(const Vec3& v) {
  const double a2 = v.squaredNorm(), a = std::sqrt(a2);
  const double s = a > 1e-4 ? std::sin(a) / a : 1.0 - a2 / 6.0;
  const double half = 0.5 * a, c = half > 1e-4 ? 0.5 * std::pow(std::sin(half) / half, 2) : 0.5 - a2 / 24.0;
  const Mat3 k = skew(v);
  return Mat3::Identity() + s * k + c * (k * k);
}

// Inverse of rotation_matrix, |v| <= pi.
inline Vec3 rotation_vector(const Mat3& r) {
  const Eigen::AngleAxisd turn(r);
  return turn.angle() * turn.axis();
}

// Shortest rotation that takes unit vector a to unit vector b; for opposite vectors half a turn about some normal of a.
inline Mat3 shortest_rotation(const Vec3& a, const Vec3& b) { return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix(); }

// Best rotation of the polar decomposition of a gradient, proper even for mirrored or flat ones.
inline Mat3 nearest_rotation(const Mat3& f) {
  const Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 sign(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0);
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace flexframe::interp
