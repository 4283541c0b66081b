// Eigenvectors and linear systems of dense matrices by Eigen, compiled once: in every file that used Eigen's solvers themselves their
// templates took longer to compile than all the rest of it.
#pragma once

#include "interp/types.h"

namespace flexframe::interp {

// symmetric = axes diag(values) axes^T, values ascending.
struct PrincipalAxes {
  Vec3 values;
  Mat3 axes;
};
PrincipalAxes principal_axes(const Mat3& symmetric);

// Infinite or NaN where the matrix is singular. Row pivots are quicker, full pivots more exact.
Eigen::MatrixXd inverse_by_row_pivots(const Eigen::MatrixXd& a);
Eigen::MatrixXd inverse_by_full_pivots(const Eigen::MatrixXd& a);
Eigen::MatrixXd solve_by_full_pivots(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);  // a^-1 b

// The least x among those that make |a x - b| least is pseudo_inverse(a) b; pivots below threshold times the largest count as zero
// (0: Eigen's own choice).
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a, double threshold = 0.0);
Vec3 least_squares(const Mat3& a, const Vec3& b);

}  // namespace flexframe::interp
