#include "sim/base/small_matrices.h"

#include "sim/base/wide.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Where a column's loop over rows k..n-1 starts, so that its length is a multiple of four and no remainder is left: up to three rows
// early, in the half that nobody reads.
inline int first_row(int k, int n) { return std::max(0, n - ((n - k + 3) & ~3)); }

// From so many rows on Eigen's solvers, which keep blocks in the cache, take a third of the time of the loops here.
constexpr Eigen::Index large = 160;

}  // namespace

FLEXFRAME_WIDE
void add_symmetric(const MatX3& A, const MatX3& B, double* M, Eigen::Index stride) {
  const int n = static_cast<int>(A.rows());
  const double *const a0 = A.data(), *const a1 = a0 + n, *const a2 = a1 + n;
  const double *const b0 = B.data(), *const b1 = b0 + n, *const b2 = b1 + n;
  for (int k = 0; k < n; ++k) {
    double* __restrict const m = M + k * stride;
    const double x0 = b0[k], x1 = b1[k], x2 = b2[k], y0 = a0[k], y1 = a1[k], y2 = a2[k];
    for (int i = first_row(k, n); i < n; ++i) m[i] += ((x0 * a0[i] + x1 * a1[i]) + (x2 * a2[i] + y0 * b0[i])) + (y1 * b1[i] + y2 * b2[i]);
  }
}

FLEXFRAME_WIDE
void set_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride) {
  const double *const f0 = F.data(), *const f1 = f0 + F.rows(), *const f2 = f1 + F.rows();
  const double *const g0 = G.data(), *const g1 = g0 + G.rows(), *const g2 = g1 + G.rows();
  for (Eigen::Index j = 0; j < G.rows(); ++j) {
    double* __restrict const m = M + j * stride;
    const double x = g0[j], y = g1[j], z = g2[j];
    for (Eigen::Index i = 0; i < n; ++i) m[i] = f0[i] * x + f1[i] * y + f2[i] * z;
  }
}

FLEXFRAME_WIDE
void add_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride) {
  const double *const f0 = F.data(), *const f1 = f0 + F.rows(), *const f2 = f1 + F.rows();
  const double *const g0 = G.data(), *const g1 = g0 + G.rows(), *const g2 = g1 + G.rows();
  for (Eigen::Index j = 0; j < G.rows(); ++j) {
    double* __restrict const m = M + j * stride;
    const double x = g0[j], y = g1[j], z = g2[j];
    for (Eigen::Index i = 0; i < n; ++i) m[i] += f0[i] * x + f1[i] * y + f2[i] * z;
  }
}

FLEXFRAME_WIDE
void add_rows(const MatX3& F, const Mat3& A, MatX3& out) {
  const Eigen::Index n = F.rows();
  const double *const f0 = F.data(), *const f1 = f0 + n, *const f2 = f1 + n;
  for (int r = 0; r < 3; ++r) {
    double* __restrict const o = out.data() + r * n;
    const double x = A(r, 0), y = A(r, 1), z = A(r, 2);
    for (Eigen::Index i = 0; i < n; ++i) o[i] += (f0[i] * x + f1[i] * y) + f2[i] * z;
  }
}

FLEXFRAME_WIDE
void multiply(const MatX& A, const double* x, double* y) {
  const int m = static_cast<int>(A.rows()), n = static_cast<int>(A.cols());
  double* __restrict const out = y;
  for (int i = 0; i < m; ++i) out[i] = 0.0;
  const double* a = A.data();
  int k = 0;
  for (; k + 4 <= n; k += 4, a += 4 * static_cast<std::ptrdiff_t>(m)) {
    const double *const a1 = a + m, *const a2 = a1 + m, *const a3 = a2 + m;
    const double x0 = x[k], x1 = x[k + 1], x2 = x[k + 2], x3 = x[k + 3];
    for (int i = 0; i < m; ++i) out[i] += (a[i] * x0 + a1[i] * x1) + (a2[i] * x2 + a3[i] * x3);
  }
  for (; k < n; ++k, a += m)
    for (int i = 0; i < m; ++i) out[i] += a[i] * x[k];
}

FLEXFRAME_WIDE
void add_products(const MatX& T, const MatX& E, const MatX& F, MatX& D) {
  const int n = static_cast<int>(T.rows()), m = static_cast<int>(T.cols());
  for (int k = 0; k < n; ++k) {
    double* __restrict const out = D.data() + static_cast<Eigen::Index>(k) * n;
    const int first = first_row(k, n);
    for (int d = 0; d < m; ++d) {
      const double t = T(k, d), e = E(k, d);
      const double *const E0 = &E(0, d), *const F0 = &F(0, d);
      for (int i = first; i < n; ++i) out[i] += t * E0[i] + e * F0[i];
    }
  }
}

FLEXFRAME_WIDE
bool cholesky(MatX& D) {
  const int n = static_cast<int>(D.rows());
  double* const base = D.data();
  for (int j = 0; j < n; ++j) {
    double* __restrict const c = base + static_cast<Eigen::Index>(j) * n;
    const double diagonal = c[j];
    const int first = first_row(j, n);
    int k = 0;
    for (; k + 4 <= j; k += 4) {
      const double* const l0 = base + static_cast<Eigen::Index>(k) * n;
      const double *const l1 = l0 + n, *const l2 = l1 + n, *const l3 = l2 + n;
      const double a0 = l0[j], a1 = l1[j], a2 = l2[j], a3 = l3[j];
      for (int i = first; i < n; ++i) c[i] -= (a0 * l0[i] + a1 * l1[i]) + (a2 * l2[i] + a3 * l3[i]);
    }
    for (; k < j; ++k) {
      const double* const l = base + static_cast<Eigen::Index>(k) * n;
      const double a = l[j];
      for (int i = first; i < n; ++i) c[i] -= a * l[i];
    }
    // 1e-14: what is left of a diagonal after it has cancelled.
    if (!(c[j] > 1e-14 * diagonal)) return false;
    const double root = std::sqrt(c[j]), inverse = 1.0 / root;
    for (int i = first; i < n; ++i) c[i] *= inverse;
    c[j] = root;
  }
  return true;
}

FLEXFRAME_WIDE
void solve(const MatX& L, double* x) {
  const int n = static_cast<int>(L.rows());
  double* __restrict const v = x;
  for (int k = 0; k < n; ++k) {
    const double* const l = L.data() + static_cast<Eigen::Index>(k) * n;
    const double a = v[k] /= l[k];
    for (int i = k + 1; i < n; ++i) v[i] -= a * l[i];
  }
  for (int k = n; k-- > 0;) {
    const double* const l = L.data() + static_cast<Eigen::Index>(k) * n;
    // Four sums: the order is part of the result.
    double s[4] = {};
    int i = k + 1;
    for (; i + 4 <= n; i += 4)
      for (int a = 0; a < 4; ++a) s[a] += l[i + a] * v[i + a];
    for (; i < n; ++i) s[0] += l[i] * v[i];
    v[k] = (v[k] - ((s[0] + s[1]) + (s[2] + s[3]))) / l[k];
  }
}

namespace {

FLEXFRAME_WIDE
void solve_rows_by_loops(const MatX& L, MatX& Xt) {
  const int n = static_cast<int>(L.rows()), m = static_cast<int>(Xt.rows());
  const double* const l = L.data();
  double* const x = Xt.data();
  // Column j of Xt minus a times column k.
  for (int k = 0; k < n; ++k) {
    double* const xk = x + static_cast<Eigen::Index>(k) * m;
    const double inverse = 1.0 / l[static_cast<Eigen::Index>(k) * n + k];
    for (int r = 0; r < m; ++r) xk[r] *= inverse;
    for (int j = k + 1; j < n; ++j) {
      double* __restrict const xj = x + static_cast<Eigen::Index>(j) * m;
      const double a = l[static_cast<Eigen::Index>(k) * n + j];
      for (int r = 0; r < m; ++r) xj[r] -= a * xk[r];
    }
  }
  for (int k = n; k-- > 0;) {
    double* const xk = x + static_cast<Eigen::Index>(k) * m;
    const double inverse = 1.0 / l[static_cast<Eigen::Index>(k) * n + k];
    for (int r = 0; r < m; ++r) xk[r] *= inverse;
    for (int j = 0; j < k; ++j) {
      double* __restrict const xj = x + static_cast<Eigen::Index>(j) * m;
      const double a = l[static_cast<Eigen::Index>(j) * n + k];
      for (int r = 0; r < m; ++r) xj[r] -= a * xk[r];
    }
  }
}

}  // namespace

void solve_rows(const MatX& L, MatX& Xt) {
  if (L.rows() < large) return solve_rows_by_loops(L, Xt);
  const auto lower = L.triangularView<Eigen::Lower>();
  lower.transpose().solveInPlace<Eigen::OnTheRight>(Xt);
  lower.solveInPlace<Eigen::OnTheRight>(Xt);
}

namespace {

FLEXFRAME_WIDE
double factorise_by_loops(MatX& A, std::vector<int>& order) {
  const int n = static_cast<int>(A.rows());
  double* const base = A.data();
  order.resize(n);
  for (int i = 0; i < n; ++i) order[i] = i;
  double smallest = HUGE_VAL;
  for (int k = 0; k < n; ++k) {
    double* __restrict const c = base + static_cast<Eigen::Index>(k) * n;
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(c[i]) > std::abs(c[pivot])) pivot = i;
    // Not (>=), so that NaN counts as singular.
    if (!(std::abs(c[pivot]) > 0.0)) return 0.0;
    smallest = std::min(smallest, std::abs(c[pivot]));
    if (pivot != k) {
      std::swap(order[pivot], order[k]);
      for (int j = 0; j < n; ++j) std::swap(base[static_cast<Eigen::Index>(j) * n + k], base[static_cast<Eigen::Index>(j) * n + pivot]);
    }
    const double inverse = 1.0 / c[k];
    for (int i = k + 1; i < n; ++i) c[i] *= inverse;
    for (int j = k + 1; j < n; ++j) {
      double* __restrict const a = base + static_cast<Eigen::Index>(j) * n;
      const double u = a[k];
      for (int i = k + 1; i < n; ++i) a[i] -= c[i] * u;
    }
  }
  return smallest;
}

}  // namespace

double factorise(MatX& A, std::vector<int>& order) {
  if (A.rows() < large) return factorise_by_loops(A, order);
  const Eigen::PartialPivLU<MatX> lu(A);
  A = lu.matrixLU();
  order.resize(A.rows());
  // Eigen's P sends row i to indices()[i].
  for (Eigen::Index i = 0; i < A.rows(); ++i) order[lu.permutationP().indices()[i]] = static_cast<int>(i);
  const double smallest = A.diagonal().cwiseAbs().minCoeff();
  return smallest > 0.0 ? smallest : 0.0;
}

namespace {

FLEXFRAME_WIDE
void solve_factors(const double* lu, const int* order, int n, const double* b, double* out) {
  double* __restrict const x = out;
  for (int i = 0; i < n; ++i) x[i] = b[order[i]];
  for (int k = 0; k < n; ++k) {
    const double* const l = lu + static_cast<Eigen::Index>(k) * n;
    const double a = x[k];
    for (int i = k + 1; i < n; ++i) x[i] -= l[i] * a;
  }
  for (int k = n; k-- > 0;) {
    const double* const u = lu + static_cast<Eigen::Index>(k) * n;
    const double a = x[k] /= u[k];
    for (int i = 0; i < k; ++i) x[i] -= u[i] * a;
  }
}

}  // namespace

void solve(const MatX& LU, const std::vector<int>& order, const double* b, double* x) {
  solve_factors(LU.data(), order.data(), static_cast<int>(LU.rows()), b, x);
}

void solve(const Eigen::PartialPivLU<MatX>& A, const MatX& B, MatX& X) {
  const int n = static_cast<int>(B.rows());
  X.resize(n, B.cols());
  // Eigen's P sends entry i to indices()[i].
  Eigen::VectorXi order(n);
  for (int i = 0; i < n; ++i) order[A.permutationP().indices()[i]] = i;
  for (Eigen::Index c = 0; c < B.cols(); ++c) solve_factors(A.matrixLU().data(), order.data(), n, B.col(c).data(), X.col(c).data());
}

}  // namespace flexframe::sim
