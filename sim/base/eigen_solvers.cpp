#include "sim/base/eigen_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

template class Eigen::PartialPivLU<Eigen::MatrixXd>;

namespace flexframe::sim {

SymmetricEigen::SymmetricEigen(const MatX& A, int options) {
  const Eigen::SelfAdjointEigenSolver<MatX> solver(A, options);
  info_ = solver.info();
  values_ = solver.eigenvalues();
  if (options == Eigen::ComputeEigenvectors) vectors_ = solver.eigenvectors();
}

GeneralizedEigen::GeneralizedEigen(const MatX& K, const MatX& M, int options) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> solver(K, M, options);
  info_ = solver.info();
  values_ = solver.eigenvalues();
  if (options == Eigen::ComputeEigenvectors) vectors_ = solver.eigenvectors();
}

ComplexEigen::ComplexEigen(const MatX& A) {
  // Eigen's would read the first number of an empty matrix.
  if (A.size() == 0) return;
  const Eigen::EigenSolver<MatX> solver(A);
  info_ = solver.info();
  values_ = solver.eigenvalues();
  if (info_ == Eigen::Success) vectors_ = solver.eigenvectors();
}

Eigen::MatrixXcd ComplexEigen::left_eigenvectors() const { return vectors_.inverse(); }

ThinSvd::ThinSvd(const MatX& A) {
  const Eigen::JacobiSVD<MatX> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  values_ = svd.singularValues();
  U_ = svd.matrixU();
  V_ = svd.matrixV();
}

Cholesky::Cholesky(const MatX& A) : llt_(A) {}

// Eigen's triangular solvers form a reference to the first number of a right side, also of one without columns or rows: those are answered
// here.
MatX Cholesky::solve(const MatX& B) const { return B.size() == 0 ? B : MatX(llt_.solve(B)); }

MatX Cholesky::solve_lower(const MatX& B) const { return B.size() == 0 ? B : MatX(llt_.matrixL().solve(B)); }

VecX Cholesky::solve_lower_transposed(const VecX& b) const { return b.size() == 0 ? b : VecX(llt_.matrixU().solve(b)); }

MatX least_squares(const MatX& A, const MatX& B, double threshold) {
  if (B.cols() == 0) return MatX(A.cols(), 0);
  Eigen::CompleteOrthogonalDecomposition<MatX> decomposition;
  if (threshold > 0.0) decomposition.setThreshold(threshold);
  return decomposition.compute(A).solve(B);
}

VecX least_squares(const MatX& A, const VecX& b) { return A.completeOrthogonalDecomposition().solve(b); }

MatX fit(const MatX& A, const MatX& B) { return B.cols() == 0 ? MatX(A.cols(), 0) : MatX(A.colPivHouseholderQr().solve(B)); }

MatX orthonormal_columns(const MatX& A, double threshold) {
  Eigen::ColPivHouseholderQR<MatX> qr(A);
  qr.setThreshold(threshold);
  return MatX(qr.householderQ()).leftCols(qr.rank());
}

MatX orthogonal_complement(const MatX& A, double threshold) {
  if (A.cols() == 0 || A.rows() == 0) return MatX::Identity(A.rows(), A.rows());
  Eigen::ColPivHouseholderQR<MatX> qr(A);
  qr.setThreshold(threshold);
  return MatX(qr.householderQ()).rightCols(A.rows() - qr.rank());
}

MatX independent_columns(const MatX& A, double threshold) {
  Eigen::ColPivHouseholderQR<MatX> qr(A);
  qr.setThreshold(threshold);
  return A * MatX(qr.colsPermutation()).leftCols(qr.rank());
}

MatX solve_square(const MatX& A, const MatX& B) { return B.size() == 0 ? B : MatX(A.partialPivLu().solve(B)); }

MatX solve_symmetric(const MatX& A, const MatX& B) { return B.size() == 0 ? B : MatX(A.ldlt().solve(B)); }

}  // namespace flexframe::sim
