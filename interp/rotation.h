// Rotation vectors and matrices, the small part the map needs. Compiled once: Eigen's decompositions behind them take seconds a file.
#pragma once

#include "interp/types.h"

namespace flexframe::interp {

inline Mat3 skew(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Rodrigues: R = I + sin(a)/a [v]x + (1 - cos a)/a^2 [v]x^2, a = |v|; series below 1e-4, where the next term is under 1e-18.
Mat3 rotation_matrix(const Vec3& v);

// Inverse of rotation_matrix, |v| <= pi.
Vec3 rotation_vector(const Mat3& r);

// Shortest rotation that takes unit vector a to unit vector b; for opposite vectors half a turn about some normal of a.
Mat3 shortest_rotation(const Vec3& a, const Vec3& b);

// Best rotation of the polar decomposition of a gradient, proper even for mirrored or flat ones.
Mat3 nearest_rotation(const Mat3& f);

}  // namespace flexframe::interp
