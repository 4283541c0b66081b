// Eigenvalues and linear systems of dense matrices by Eigen, compiled once: in every file that used Eigen's solvers themselves their
// templates took longer to compile than all the rest of it.
#pragma once

#include "sim/base/types.h"

#include <Eigen/Cholesky>

namespace flexframe::sim {

// A = V diag(values) V^T, values ascending; A: n x n, its lower half is read.
class SymmetricEigen {
 public:
  explicit SymmetricEigen(const MatX& A, int options = Eigen::ComputeEigenvectors);  // or Eigen::EigenvaluesOnly
  const VecX& eigenvalues() const { return values_; }
  const MatX& eigenvectors() const { return vectors_; }
  Eigen::ComputationInfo info() const { return info_; }

 private:
  VecX values_;
  MatX vectors_;
  Eigen::ComputationInfo info_;
};

// K V = M V diag(values), V^T M V = 1, values ascending; K symmetric, M positive definite (info() says if it is not).
class GeneralizedEigen {
 public:
  GeneralizedEigen(const MatX& K, const MatX& M, int options = Eigen::ComputeEigenvectors);  // or Eigen::EigenvaluesOnly
  const VecX& eigenvalues() const { return values_; }
  const MatX& eigenvectors() const { return vectors_; }
  Eigen::ComputationInfo info() const { return info_; }

 private:
  VecX values_;
  MatX vectors_;
  Eigen::ComputationInfo info_;
};

// Of any square matrix.
class ComplexEigen {
 public:
  explicit ComplexEigen(const MatX& A);
  const Eigen::VectorXcd& eigenvalues() const { return values_; }
  const Eigen::MatrixXcd& eigenvectors() const { return vectors_; }
  Eigen::MatrixXcd left_eigenvectors() const;  // rows, the inverse of the above: not finite where A is defective
  Eigen::ComputationInfo info() const { return info_; }

 private:
  Eigen::VectorXcd values_;
  Eigen::MatrixXcd vectors_;
  Eigen::ComputationInfo info_ = Eigen::Success;
};

// A = U diag(s) V^T by Jacobi rotations, s descending; U: m x k, V: n x k, k = min(m, n).
class ThinSvd {
 public:
  explicit ThinSvd(const MatX& A);
  const VecX& singularValues() const { return values_; }
  const MatX& matrixU() const { return U_; }
  const MatX& matrixV() const { return V_; }

 private:
  VecX values_;
  MatX U_, V_;
};

// A = L L^T, A: symmetric; info() says if it is not positive definite.
class Cholesky {
 public:
  explicit Cholesky(const MatX& A);
  Eigen::ComputationInfo info() const { return llt_.info(); }
  MatX solve(const MatX& B) const;                   // A^-1 B
  MatX solve_lower(const MatX& B) const;             // L^-1 B
  VecX solve_lower_transposed(const VecX& b) const;  // L^-T b

 private:
  Eigen::LLT<MatX> llt_;
};

// The least X among those that make |A X - B| least; pivots below threshold times the largest count as zero (0: Eigen's own choice).
MatX least_squares(const MatX& A, const MatX& B, double threshold = 0.0);
VecX least_squares(const MatX& A, const VecX& b);

// The same where the columns of A are known to be independent, at half the work.
MatX fit(const MatX& A, const MatX& B);

// Orthonormal columns that span those of A, and as many of A's own columns that are independent; pivots below threshold times the largest
// count as zero.
MatX orthonormal_columns(const MatX& A, double threshold);
MatX independent_columns(const MatX& A, double threshold);

// Orthonormal columns, orthogonal to those of A, that span the rest of the space; all of it where A has no column or is zero.
MatX orthogonal_complement(const MatX& A, double threshold);

// A^-1 B with partial pivoting; infinite or NaN where A is singular.
MatX solve_square(const MatX& A, const MatX& B);

// A^-1 B of a symmetric A, definite or not.
MatX solve_symmetric(const MatX& A, const MatX& B);

}  // namespace flexframe::sim
