// Blocks of twists or wrenches, one a coordinate, as the recursions over a mechanism use them: 6 x n in space, n x 3 in the plane. The
// same names for both; sums are taken in the order in which they stand.
#pragma once

#include "sim/base/plane.h"

#include <algorithm>

namespace flexframe::sim {

template <class S>
typename S::Columns zero_columns(Eigen::Index n);
template <>
inline Mat6X zero_columns<Space>(Eigen::Index n) {
  return Mat6X::Zero(6, n);
}
template <>
inline MatX3 zero_columns<Plane>(Eigen::Index n) {
  return MatX3::Zero(n, 3);
}

inline Eigen::Index count(const Mat6X& A) { return A.cols(); }
inline Eigen::Index count(const MatX3& A) { return A.rows(); }
inline auto column(Mat6X& A, Eigen::Index k) { return A.col(k); }
inline auto column(MatX3& A, Eigen::Index k) { return A.row(k).transpose(); }
inline auto column(const Mat6X& A, Eigen::Index k) { return A.col(k); }
inline auto column(const MatX3& A, Eigen::Index k) { return A.row(k).transpose(); }

// A x, by columns.
template <int Rows>
Eigen::Matrix<double, Rows, 1> combine(const Eigen::Matrix<double, Rows, Eigen::Dynamic>& A, const VecX& x) {
  // A general product's set-up costs more than the work here.
  double sum[Rows] = {};
  const double* a = A.data();
  for (Eigen::Index k = 0; k < x.size(); ++k, a += Rows) {
    const double factor = x[k];
    for (int r = 0; r < Rows; ++r) sum[r] += a[r] * factor;
  }
  return Eigen::Map<const Eigen::Matrix<double, Rows, 1>>(sum);
}
inline Vec3 combine(const MatX3& A, const VecX& x) { return {A.col(0).dot(x), A.col(1).dot(x), A.col(2).dot(x)}; }
// out += A x, out -= A x.
inline void add_product(const Mat6X& A, const VecX& x, Vec6& out) { out.noalias() += A * x; }
inline void add_product(const MatX3& A, const VecX& x, Vec3& out) { out += combine(A, x); }
inline void subtract_product(const Mat6X& A, const VecX& x, Vec6& out) { out.noalias() -= A * x; }
inline void subtract_product(const MatX3& A, const VecX& x, Vec3& out) { out -= combine(A, x); }

// out_k += a_k . f, or -=.
inline void add_dots(const Mat6X& A, const Vec6& f, double* out) {
  for (Eigen::Index k = 0; k < A.cols(); ++k) out[k] += A.col(k).dot(f);
}
inline void add_dots(const MatX3& A, const Vec3& f, double* out) {
  Eigen::Map<VecX>(out, A.rows()) += A.col(0) * f[0] + A.col(1) * f[1] + A.col(2) * f[2];
}
inline void subtract_dots(const Mat6X& A, const Vec6& f, double* out) {
  for (Eigen::Index k = 0; k < A.cols(); ++k) out[k] -= A.col(k).dot(f);
}
inline void subtract_dots(const MatX3& A, const Vec3& f, double* out) { add_dots(A, -f, out); }
// The same as a product of matrices.
inline void add_transposed(const Mat6X& A, const Vec6& f, VecX& out) { out.noalias() += A.transpose() * f; }
inline void add_transposed(const MatX3& A, const Vec3& f, VecX& out) { add_dots(A, f, out.data()); }
// M(row + k, col) = h . f_k of the first n columns of F.
inline void set_dots(const Mat6X& F, Eigen::Index n, const Vec6& h, MatX& M, Eigen::Index row, Eigen::Index col) {
  for (Eigen::Index k = 0; k < n; ++k) M(row + k, col) = h.dot(F.col(k));
}
inline void set_dots(const MatX3& F, Eigen::Index n, const Vec3& h, MatX& M, Eigen::Index row, Eigen::Index col) {
  double* const m = &M(row, col);
  const double *const x = F.data(), *const y = x + F.rows(), *const z = y + F.rows();
  for (Eigen::Index k = 0; k < n; ++k) m[k] = x[k] * h[0] + y[k] * h[1] + z[k] * h[2];
}

// out = I A.
void set_momenta(const Mat6& I, const Mat6X& A, Mat6X& out);
inline void set_momenta(const Mat3& I, const MatX3& A, MatX3& out) {
  if (A.rows() > 3) {
    out.setZero();
    return add_rows(A, I, out);
  }
  for (Eigen::Index k = 0; k < A.rows(); ++k)
    for (Eigen::Index r = 0; r < 3; ++r) out(k, r) = (A(k, 0) * I(r, 0) + A(k, 1) * I(r, 1)) + A(k, 2) * I(r, 2);
}

// out += the first n columns of F.
inline void add_columns(const Mat6X& F, Eigen::Index n, Mat6X& out) { out += F.leftCols(n); }
inline void add_columns(const MatX3& F, Eigen::Index n, MatX3& out) {
  for (Eigen::Index r = 0; r < 3; ++r)
    for (Eigen::Index k = 0; k < n; ++k) out(k, r) += F(k, r);
}

// Twists or wrenches seen from the frame in which theirs stands at the pose: C = -to_parent(a, B), and the first n columns of F as
// wrenches.
void set_negative_to_parent(const Pose& a, const Mat6X& B, Mat6X& C);
void set_negative_to_parent(const PlanePose& a, const MatX3& B, MatX3& C);
void wrenches_to_parent(const Pose& a, Mat6X& F, Eigen::Index n);
void wrenches_to_parent(const PlanePose& a, MatX3& F, Eigen::Index n);

// Lower half of the square block of M at (at, at) += A^T B + B^T A. Entries above the diagonal are spoilt.
void add_symmetric(const Mat6X& A, const Mat6X& B, MatX& M, Eigen::Index at);
inline void add_symmetric(const MatX3& A, const MatX3& B, MatX& M, Eigen::Index at) { add_symmetric(A, B, &M(at, at), M.rows()); }
// Block of M at (row, col) = or += F^T G of the first n columns of F.
void set_outer(const Mat6X& F, Eigen::Index n, const Mat6X& G, MatX& M, Eigen::Index row, Eigen::Index col);
void add_outer(const Mat6X& F, Eigen::Index n, const Mat6X& G, MatX& M, Eigen::Index row, Eigen::Index col);
inline void set_outer(const MatX3& F, Eigen::Index n, const MatX3& G, MatX& M, Eigen::Index row, Eigen::Index col) {
  set_outer(F, n, G, &M(row, col), M.rows());
}
inline void add_outer(const MatX3& F, Eigen::Index n, const MatX3& G, MatX& M, Eigen::Index row, Eigen::Index col) {
  add_outer(F, n, G, &M(row, col), M.rows());
}

inline void size_columns(Mat6X& A, Eigen::Index n) { A.resize(6, n); }
inline void size_columns(MatX3& A, Eigen::Index n) { A.resize(n, 3); }
// A's columns += v x_k.
template <class X>
void add_multiples(const Vec6& v, const X& x, Mat6X& A) {
  for (Eigen::Index k = 0; k < A.cols(); ++k) A.col(k) += v * x[k];
}
template <class X>
void add_multiples(const Vec3& v, const X& x, MatX3& A) {
  for (int r = 0; r < 3; ++r) A.col(r) += x * v[r];
}

// F's columns from `from` on = the first n of A.
inline void place_columns(const Mat6X& A, Eigen::Index n, Mat6X& F, Eigen::Index from) {
  std::copy_n(A.data(), 6 * n, F.data() + 6 * from);
}
inline void place_columns(const MatX3& A, Eigen::Index n, MatX3& F, Eigen::Index from) {
  // Blocks of as few entries cost a library more than the copy.
  for (Eigen::Index r = 0; r < 3; ++r) std::copy_n(A.data() + r * A.rows(), n, F.data() + r * F.rows() + from);
}

// I -= U (L L^T)^-1 U^T and p += U (L L^T)^-1 h; work: as large as U.
void reduce_inertia(const MatX& L, const Mat6X& U, const VecX& h, MatX& work, Mat6& I, Vec6& p);
void reduce_inertia(const MatX& L, const MatX3& U, const VecX& h, MatX& work, Mat3& I, Vec3& p);

// Inertia I of what is fixed at the pose, about the frame in which that stands: X^T I X with X = child_matrix. I is symmetric.
Mat6 inertia_at_parent(const Pose& a, const Mat6& I);
Mat3 inertia_at_parent(const PlanePose& a, const Mat3& I);

}  // namespace flexframe::sim
