#include "interp/rotation.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include <cmath>

namespace flexframe::interp {

Mat3 rotation_matrix(const Vec3& v) {
  const double a2 = v.squaredNorm(), a = std::sqrt(a2);
  const double s = a > 1e-4 ? std::sin(a) / a : 1.0 - a2 / 6.0;
  const double half = 0.5 * a, c = half > 1e-4 ? 0.5 * std::pow(std::sin(half) / half, 2) : 0.5 - a2 / 24.0;
  const Mat3 k = skew(v);
  return Mat3::Identity() + s * k + c * (k * k);
}

Vec3 rotation_vector(const Mat3& r) {
  const Eigen::AngleAxisd turn(r);
  return turn.angle() * turn.axis();
}

Mat3 shortest_rotation(const Vec3& a, const Vec3& b) { return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix(); }

Mat3 nearest_rotation(const Mat3& f) {
  const Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 sign(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0);
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace flexframe::interp
