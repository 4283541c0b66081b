// Products of tall dense matrices by BLAS (Eigen's own kernels are built for the smallest processor here).
#pragma once

#include "sim/base/types.h"
#include "sim/reduce/sparse_libraries.h"

namespace flexframe::sim {

// A^T B.
inline MatX product_tn(const Eigen::Ref<const MatX>& A, const Eigen::Ref<const MatX>& B) {
  MatX C(A.cols(), B.cols());
  if (C.size() == 0 || A.rows() == 0) return MatX::Zero(A.cols(), B.cols());
  openblas().dgemm(CblasColMajor, CblasTrans, CblasNoTrans, static_cast<int>(A.cols()), static_cast<int>(B.cols()),
                   static_cast<int>(A.rows()), 1.0, A.data(), static_cast<int>(A.outerStride()), B.data(),
                   static_cast<int>(B.outerStride()), 0.0, C.data(), static_cast<int>(C.rows()));
  return C;
}

// C += factor A B.
inline void add_product(Eigen::Ref<MatX> C, double factor, const Eigen::Ref<const MatX>& A, const Eigen::Ref<const MatX>& B) {
  if (C.size() == 0 || A.cols() == 0) return;
  openblas().dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(C.rows()), static_cast<int>(C.cols()),
                   static_cast<int>(A.cols()), factor, A.data(), static_cast<int>(A.outerStride()), B.data(),
                   static_cast<int>(B.outerStride()), 1.0, C.data(), static_cast<int>(C.outerStride()));
}

}  // namespace flexframe::sim
