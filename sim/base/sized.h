// Vectors and blocks of which the compiler knows the number of coordinates, N, where it is small (by_count): loops of three or four cost
// more than what they do. Eigen::Dynamic: any number.
#pragma once

#include "sim/base/columns.h"
#include "sim/base/wide.h"

#include <algorithm>
#include <type_traits>

namespace flexframe::sim {

// Calls with(number), a constant where it is small. `with` is to be inlined, so that it is compiled for the registers of its caller.
template <class With>
FLEXFRAME_INLINE void by_count(Eigen::Index n, const With& with) {
  switch (n) {
    case 1:
      return with(std::integral_constant<int, 1>());
    case 2:
      return with(std::integral_constant<int, 2>());
    case 3:
      return with(std::integral_constant<int, 3>());
    case 4:
      return with(std::integral_constant<int, 4>());
    case 5:
      return with(std::integral_constant<int, 5>());
    case 6:
      return with(std::integral_constant<int, 6>());
    default:
      return with(std::integral_constant<int, Eigen::Dynamic>());
  }
}

// The same up to twelve, as many modes as most bodies have: for the loops that take longest in them, which get code of their own for each.
template <class With>
FLEXFRAME_INLINE void by_larger_count(Eigen::Index n, const With& with) {
  switch (n) {
    case 7:
      return with(std::integral_constant<int, 7>());
    case 8:
      return with(std::integral_constant<int, 8>());
    case 9:
      return with(std::integral_constant<int, 9>());
    case 10:
      return with(std::integral_constant<int, 10>());
    case 11:
      return with(std::integral_constant<int, 11>());
    case 12:
      return with(std::integral_constant<int, 12>());
    default:
      return by_count(n, with);
  }
}

// to = n numbers from `from`.
FLEXFRAME_INLINE void copy_few(const double* from, Eigen::Index n, double* to) {
  by_count(
      n, [&](auto count) __attribute__((always_inline)) {
        if constexpr (count() > 0)
          Eigen::Map<Eigen::Matrix<double, count(), 1>>{to} = Eigen::Map<const Eigen::Matrix<double, count(), 1>>{from};
        else std::copy_n(from, n, to);
      });
}

template <int N>
auto sized(const VecX& x) {
  return Eigen::Map<const Eigen::Matrix<double, N, 1>>(x.data(), x.size());
}
template <int N>
auto sized(VecX& x) {
  return Eigen::Map<Eigen::Matrix<double, N, 1>>(x.data(), x.size());
}
// Of N columns.
template <int N, int Rows>
auto sized(const Eigen::Matrix<double, Rows, Eigen::Dynamic>& A) {
  static_assert(Rows > 0, "a square matrix: multiply_sized");
  return Eigen::Map<const Eigen::Matrix<double, Rows, N>>(A.data(), Rows, A.cols());
}
template <int N, int Rows>
auto sized(Eigen::Matrix<double, Rows, Eigen::Dynamic>& A) {
  static_assert(Rows > 0, "a square matrix: multiply_sized");
  return Eigen::Map<Eigen::Matrix<double, Rows, N>>(A.data(), Rows, A.cols());
}

// A whole block of twists or wrenches.
template <int N>
auto sized_columns(const Mat6X& M) {
  return sized<N>(M);
}
template <int N>
auto sized_columns(Mat6X& M) {
  return sized<N>(M);
}
template <int N>
auto sized_columns(const MatX3& M) {
  return Eigen::Map<const Eigen::Matrix<double, N, 3>>(M.data(), M.rows(), 3);
}
template <int N>
auto sized_columns(MatX3& M) {
  return Eigen::Map<Eigen::Matrix<double, N, 3>>(M.data(), M.rows(), 3);
}

// Component a of a block of twists or wrenches, per coordinate.
template <int N>
auto component_of(Mat6X& M, int a) {
  return Eigen::Map<Eigen::Matrix<double, N, 1>, 0, Eigen::InnerStride<6>>(M.data() + a, M.cols());
}
template <int N, int Columns>
auto component_of(Eigen::Matrix<double, Eigen::Dynamic, Columns>& M, int a) {
  return Eigen::Map<Eigen::Matrix<double, N, 1>>(M.data() + a * M.rows(), M.rows());
}
template <int N, int Columns>
auto component_of(const Eigen::Matrix<double, Eigen::Dynamic, Columns>& M, int a) {
  return Eigen::Map<const Eigen::Matrix<double, N, 1>>(M.data() + a * M.rows(), M.rows());
}

// y = A x, A: n x n, y: not x.
template <int N>
FLEXFRAME_INLINE void multiply_sized(const MatX& A, const double* x, double* y) {
  if constexpr (N > 0 && N <= 6) {
    const Eigen::Map<const Eigen::Matrix<double, N, N>> M(A.data());
    Eigen::Map<Eigen::Matrix<double, N, 1>>(y).noalias() = M.lazyProduct(Eigen::Map<const Eigen::Matrix<double, N, 1>>(x));
  } else {
    multiply(A, x, y);
  }
}
// y += A x.
template <int N>
FLEXFRAME_INLINE void add_sized(const MatX& A, const VecX& x, VecX& y) {
  if constexpr (N > 0) {
    const Eigen::Map<const Eigen::Matrix<double, N, N>> M(A.data());
    sized<N>(y) += M.lazyProduct(sized<N>(x));
  } else {
    y.noalias() += A * x;
  }
}

// A x of a block of twists or of vectors.
template <int N, int Rows>
FLEXFRAME_INLINE Eigen::Matrix<double, Rows, 1> combine_sized(const Eigen::Matrix<double, Rows, Eigen::Dynamic>& A, const VecX& x) {
  if constexpr (N > 0) return sized<N>(A).lazyProduct(sized<N>(x));
  else return combine(A, x);
}
template <int N>
FLEXFRAME_INLINE Vec3 combine_sized(const MatX3& A, const VecX& x) {
  return {component_of<N>(A, 0).dot(sized<N>(x)), component_of<N>(A, 1).dot(sized<N>(x)), component_of<N>(A, 2).dot(sized<N>(x))};
}

// The same of any number.
FLEXFRAME_INLINE Vec6 combine_few(const Mat6X& A, const VecX& x) {
  Vec6 out;
  by_larger_count(
      A.cols(), [&](auto n) __attribute__((always_inline)) { out = combine_sized<n()>(A, x); });
  return out;
}
FLEXFRAME_INLINE Vec3 combine_few(const MatX3& A, const VecX& x) {
  Vec3 out;
  by_larger_count(
      A.rows(), [&](auto n) __attribute__((always_inline)) { out = combine_sized<n()>(A, x); });
  return out;
}

// Of every coordinate's twist or wrench the product with f, which is to stay while the result is used.
template <int N>
auto dots_sized(const Mat6X& A, const Vec6& f) {
  return sized<N>(A).transpose().lazyProduct(f);
}
template <int N>
auto dots_sized(const MatX3& A, const Vec3& f) {
  return component_of<N>(A, 0) * f[0] + component_of<N>(A, 1) * f[1] + component_of<N>(A, 2) * f[2];
}

}  // namespace flexframe::sim
