#include "interp/dense_solvers.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace flexframe::interp {

PrincipalAxes principal_axes(const Mat3& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::MatrixXd inverse_by_row_pivots(const Eigen::MatrixXd& a) { return a.partialPivLu().inverse(); }

Eigen::MatrixXd inverse_by_full_pivots(const Eigen::MatrixXd& a) { return a.fullPivLu().inverse(); }

Eigen::MatrixXd solve_by_full_pivots(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.fullPivLu().solve(b); }

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  if (threshold > 0.0) decomposition.setThreshold(threshold);
  decomposition.compute(a);
  return decomposition.pseudoInverse();
}

Vec3 least_squares(const Mat3& a, const Vec3& b) { return a.completeOrthogonalDecomposition().solve(b); }

}  // namespace flexframe::interp
