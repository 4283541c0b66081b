#include "sim/eigen_solvers.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace flexframe::sim {

SymmetricEigen::SymmetricEigen(const MatX& A, int options) {
  const Eigen::SelfAdjointEigenSolver<MatX> solver(A, options);
  info_ = solver.info();
  values_ = solver.eigenvalues();
  if (options == Eigen::ComputeEigenvectors) vectors_ = solver.eigenvectors();
}

GeneralizedEigen::GeneralizedEigen(const MatX& K, const MatX& M) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> solver(K, M);
  info_ = solver.info();
  values_ = solver.eigenvalues();
  vectors_ = solver.eigenvectors();
}

ComplexEigen::ComplexEigen(const MatX& A) {
  const Eigen::EigenSolver<MatX> solver(A);
  info_ = solver.info();
  values_ = solver.eigenvalues();
  if (info_ == Eigen::Success) vectors_ = solver.eigenvectors();
}

ThinSvd::ThinSvd(const MatX& A) {
  const Eigen::JacobiSVD<MatX> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  values_ = svd.singularValues();
  U_ = svd.matrixU();
  V_ = svd.matrixV();
}

MatX least_squares(const MatX& A, const MatX& B, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<MatX> decomposition;
  if (threshold > 0.0) decomposition.setThreshold(threshold);
  return decomposition.compute(A).solve(B);
}

MatX solve_square(const MatX& A, const MatX& B) { return A.partialPivLu().solve(B); }

}  // namespace flexframe::sim
