#include "render/import/rotations.h"

#include "sim/base/spatial.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::imports {
namespace {

// Numbers of a file with few digits; what is further off is no rotation.
constexpr double tolerance = 1e-3;

sim::Quat from_matrix(const sim::Mat3& R, const std::string& what) {
  const double off = (R.transpose() * R - sim::Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= tolerance))
    throw sim::InputError(fmt::format("{}is no rotation matrix: its columns are off from length 1 and right angles by {:.2g}", what, off));
  if (R.determinant() < 0.0)
    throw sim::InputError(
        fmt::format("{}mirrors: its determinant is -1, that of a rotation is 1 (left-handed axes, or swapped columns?)", what));
  return sim::Quat(R).normalized();
}

}  // namespace

int turn_count(TurnForm form) {
  static constexpr int counts[] = {0, 4, 3, 9, 3, 1};
  return counts[static_cast<int>(form)];
}

sim::Quat to_quaternion(const TurnWriting& writing, const std::array<double, 9>& n, const std::string& what) {
  sim::Quat turn = sim::Quat::Identity();
  switch (writing.form) {
    case TurnForm::none:
      break;
    case TurnForm::quaternion: {
      turn = writing.scalar_last ? sim::Quat(n[3], n[0], n[1], n[2]) : sim::Quat(n[0], n[1], n[2], n[3]);
      if (!(std::abs(turn.norm() - 1.0) <= tolerance))
        throw sim::InputError(fmt::format("{}is no unit quaternion: its norm is {:.6g}", what, turn.norm()));
      turn.normalize();
      break;
    }
    case TurnForm::euler:
      for (size_t k = 0; k < 3; ++k) {
        const sim::Quat one(Eigen::AngleAxisd(n[k], sim::Vec3::Unit(writing.sequence[k] - 'x')));
        turn = writing.fixed_axes ? one * turn : turn * one;
      }
      break;
    case TurnForm::matrix: {
      sim::Mat3 R;
      for (int k = 0; k < 9; ++k) (writing.by_columns ? R(k % 3, k / 3) : R(k / 3, k % 3)) = n[k];
      turn = from_matrix(R, what);
      break;
    }
    case TurnForm::vector:
      turn = sim::Quat(sim::rotation_exp({n[0], n[1], n[2]}));
      break;
    case TurnForm::angle:
      turn = sim::Quat(Eigen::AngleAxisd(n[0], writing.axis));
      break;
  }
  if (!turn.coeffs().allFinite()) throw sim::InputError(what + "holds numbers too large for angles");
  return writing.world_to_body ? turn.conjugate() : turn;
}

void keep_hemisphere(Eigen::MatrixX4d& orientation) {
  for (Eigen::Index i = 1; i < orientation.rows(); ++i)
    if (orientation.row(i).dot(orientation.row(i - 1)) < 0.0) orientation.row(i) *= -1.0;
}

}  // namespace flexframe::imports
