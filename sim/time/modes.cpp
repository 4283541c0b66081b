#include "sim/time/modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/four.h"
#include "sim/base/small_matrices.h"

#include <algorithm>
#include <cmath>
#include <complex>

namespace flexframe::sim {
namespace {

// Of the squares of two frequencies: closer ones are left as they are, coupled.
constexpr double close = 1e-3;
// Corrections of shapes beyond that are not small.
constexpr double small_correction = 0.2;
// Of gauges times shapes less one.
constexpr double most_inverse_error = 1e-9;
// Amounts of a state by that many times its size: shapes so nearly parallel (a body that flies and falls has its rotations' turned to
// displacements) that of sixteen digits four are left.
constexpr double largest_amounts = 1e12;
// Coupled to another mode by more than that share of itself, it is no mode.
constexpr double coupled = 0.1;

// C = A B, n x n: tiles of 8 x 4 numbers stay in registers; what is left over at the edges is computed twice.
FLEXFRAME_WIDEST
void multiply_square(const double* A, const double* B, double* C, int size) {
  typedef double V __attribute__((vector_size(64), aligned(8)));
  const std::ptrdiff_t n = size;
  for (std::ptrdiff_t j0 = 0; j0 < n; j0 += 4) {
    const std::ptrdiff_t j = std::min(j0, n - 4);
    const double *const b0 = B + j * n, *const b1 = b0 + n, *const b2 = b1 + n, *const b3 = b2 + n;
    for (std::ptrdiff_t i0 = 0; i0 < n; i0 += 8) {
      const std::ptrdiff_t i = std::min(i0, n - 8);
      V s0{}, s1{}, s2{}, s3{};
      const double* a = A + i;
      for (std::ptrdiff_t k = 0; k < n; ++k, a += n) {
        const V x = *reinterpret_cast<const V*>(a);
        s0 += x * b0[k];
        s1 += x * b1[k];
        s2 += x * b2[k];
        s3 += x * b3[k];
      }
      double* const c = C + j * n + i;
      *reinterpret_cast<V*>(c) = s0;
      *reinterpret_cast<V*>(c + n) = s1;
      *reinterpret_cast<V*>(c + 2 * n) = s2;
      *reinterpret_cast<V*>(c + 3 * n) = s3;
    }
  }
}

// The same of fewer than eight rows, which are made eight: what a general product sets up costs more than that.
FLEXFRAME_WIDEST
void multiply_few(const double* A, const double* B, double* C, int n) {
  typedef double V __attribute__((vector_size(64), aligned(8)));
  double padded[7 * 8] = {}, column[8];
  for (int k = 0; k < n; ++k) copy_fours(A + k * n, n, padded + 8 * k);
  for (int j = 0; j < n; ++j) {
    V sum{};
    for (int k = 0; k < n; ++k) sum += *reinterpret_cast<const V*>(padded + 8 * k) * B[j * n + k];
    *reinterpret_cast<V*>(column) = sum;
    copy_fours(column, n, C + j * n);
  }
}

MatX product(const MatX& A, const MatX& B) {
  MatX C(A.rows(), B.cols());
  (A.rows() < 8 ? multiply_few : multiply_square)(A.data(), B.data(), C.data(), static_cast<int>(A.rows()));
  return C;
}

bool invert_better(Modes& m) {
  const Eigen::Index n = m.shapes.rows();
  for (int k = 0; k < 3; ++k) {
    MatX residual = -product(m.gauges, m.shapes);
    residual.diagonal().array() += 1.0;
    const double error = residual.cwiseAbs().maxCoeff();
    if (!(error < 0.5)) return false;
    if (error < 1e-12 * static_cast<double>(n)) return true;
    m.gauges += product(residual, m.gauges);
    if (error * error < most_inverse_error) return m.gauges.allFinite();
  }
  return false;
}

}  // namespace

VecX times(const MatX& A, const Eigen::Ref<const VecX>& x) {
  VecX y(A.rows());
  multiply(A, x.data(), y.data());
  return y;
}

void times_into(const MatX& A, const VecX& x, VecX& y) {
  y.resize(A.rows());
  multiply(A, x.data(), y.data());
}

bool find_modes(const MatX& A, Modes& modes) {
  const Eigen::Index n = A.rows();
  if (n == 0 || !A.allFinite()) return false;
  const ComplexEigen eigen(A);
  if (eigen.info() != Eigen::Success) return false;
  modes.shapes.resize(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const bool pair = eigen.eigenvalues()[k].imag() != 0.0 && k + 1 < n;
    modes.shapes.col(k) = eigen.eigenvectors().col(k).real();
    if (!pair) continue;
    modes.shapes.col(k + 1) = eigen.eigenvectors().col(k).imag();
    ++k;
  }
  modes.gauges = solve_square(modes.shapes, MatX::Identity(n, n));
  const auto amounts = modes.gauges.rowwise().norm().array() * modes.shapes.colwise().norm().transpose().array();
  return modes.gauges.allFinite() && amounts.maxCoeff() < largest_amounts && invert_better(modes);
}

namespace {

bool are_close(double one, double other) { return std::abs(one - other) < close * std::max(std::abs(one), std::abs(other)); }

}  // namespace

double mixing(const Modes& modes) {
  const MatX& A = modes.A;
  double largest = 0.0;
  // Whatever the units of the amounts.
  for (Eigen::Index j = 0; j < A.cols(); ++j)
    for (Eigen::Index i = 0; i < j; ++i) {
      const double apart = A(j, j) - A(i, i), product = std::abs(A(i, j) * A(j, i));
      if (product > largest * apart * apart && !are_close(A(i, i), A(j, j))) largest = product / (apart * apart);
    }
  return std::sqrt(largest);
}

bool renew_modes(Modes& modes) {
  if (!(mixing(modes) < small_correction)) return false;
  MatX X = modes.A;
  const VecX own = X.diagonal();
  for (Eigen::Index j = 0; j < X.cols(); ++j)
    for (Eigen::Index i = 0; i < X.rows(); ++i) X(i, j) = i == j || are_close(own[i], own[j]) ? 0.0 : X(i, j) / (own[j] - own[i]);
  modes.shapes += product(modes.shapes, X);
  modes.gauges -= product(X, modes.gauges);
  return modes.shapes.allFinite() && invert_better(modes);
}

void express_matrix(const MatX& A, Modes& m) { m.A = product(m.gauges, product(A, m.shapes)); }

void express_others(const MatX& B, const MatX& A1, Modes& m) {
  m.B = product(m.gauges, product(B, m.shapes));
  m.A1 = product(m.gauges, product(A1, m.shapes));
  const Eigen::Index n = m.A.rows();
  m.frequencies = VecX::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double square = -m.A(k, k);
    double others = 0.0;
    for (Eigen::Index j = 0; j < n; ++j)
      if (j != k) others = std::max(others, std::abs(m.A(k, j) * m.A(j, k)));
    if (square > 0.0 && std::sqrt(others) < coupled * square) m.frequencies[k] = std::sqrt(square);
  }
}

void held_at(const Modes& m, const VecX& fast, const ModalState& z, VecX& u, VecX& v) {
  // Twice and more in every step: the room stays.
  static thread_local VecX slow, w, p, by_B, by_A, by_A1, A1p, load, rate;
  slow = VecX::Ones(fast.size()) - fast;
  w = slow.cwiseProduct(z.w);
  p = slow.cwiseProduct(z.p);
  times_into(m.A1, p, A1p);
  times_into(m.B, w, by_B);
  times_into(m.A, p, by_A);
  load = z.load_w + by_B + by_A + z.tau * A1p;
  w = slow.cwiseProduct(load);
  p = slow.cwiseProduct(z.w + z.load_p);
  times_into(m.B, w, by_B);
  times_into(m.A, p, by_A);
  times_into(m.A1, p, by_A1);
  rate = z.rate_w + by_B + by_A + z.tau * by_A1 + A1p;
  u.setZero(fast.size());
  v.setZero(fast.size());
  for (Eigen::Index k = 0; k < fast.size(); ++k) {
    if (fast[k] == 0.0) continue;
    const double square = -(m.A(k, k) + z.tau * m.A1(k, k));
    u[k] = (load[k] + z.rate_p[k]) / square;
    v[k] = (rate[k] + m.A1(k, k) * u[k]) / square - z.load_p[k];
    u[k] += m.B(k, k) * v[k] / square;
  }
}

}  // namespace flexframe::sim
