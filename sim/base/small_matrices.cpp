#include "sim/base/small_matrices.h"

#include "sim/base/four.h"
#include "sim/base/padded_factor.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Where a column's loop over rows k..n-1 starts, so that its length is a multiple of four and no remainder is left: up to three rows
// early, in the half that nobody reads.
inline int first_row(int k, int n) { return std::max(0, n - ((n - k + 3) & ~3)); }

// From so many rows on Eigen's solvers, which keep blocks in the cache, take a third of the time of the loops here.
constexpr Eigen::Index large = 160;

// clang compiles for wider registers only what no header declares before: the kernels themselves stand here.
FLEXFRAME_WIDE
void wide_add_symmetric(const MatX3& A, const MatX3& B, double* M, Eigen::Index stride) {
  const int n = static_cast<int>(A.rows());
  const double *const a0 = A.data(), *const a1 = a0 + n, *const a2 = a1 + n;
  const double *const b0 = B.data(), *const b1 = b0 + n, *const b2 = b1 + n;
  for (int k = 0; k < n; ++k) {
    double* const m = M + k * stride;
    const double x0 = b0[k], x1 = b1[k], x2 = b2[k], y0 = a0[k], y1 = a1[k], y2 = a2[k];
    int i = first_row(k, n);
    for (; i + 4 <= n; i += 4)
      four(m + i).v += ((x0 * four(a0 + i).v + x1 * four(a1 + i).v) + (x2 * four(a2 + i).v + y0 * four(b0 + i).v)) +
                       (y1 * four(b1 + i).v + y2 * four(b2 + i).v);
    for (; i < n; ++i) m[i] += ((x0 * a0[i] + x1 * a1[i]) + (x2 * a2[i] + y0 * b0[i])) + (y1 * b1[i] + y2 * b2[i]);
  }
}

FLEXFRAME_WIDE
void wide_set_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride) {
  const double *const f0 = F.data(), *const f1 = f0 + F.rows(), *const f2 = f1 + F.rows();
  const double *const g0 = G.data(), *const g1 = g0 + G.rows(), *const g2 = g1 + G.rows();
  for (Eigen::Index j = 0; j < G.rows(); ++j) {
    double* const m = M + j * stride;
    const double x = g0[j], y = g1[j], z = g2[j];
    Eigen::Index i = 0;
    for (; i + 4 <= n; i += 4) four(m + i).v = four(f0 + i).v * x + four(f1 + i).v * y + four(f2 + i).v * z;
    for (; i < n; ++i) m[i] = f0[i] * x + f1[i] * y + f2[i] * z;
  }
}

FLEXFRAME_WIDE
void wide_add_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride) {
  const double *const f0 = F.data(), *const f1 = f0 + F.rows(), *const f2 = f1 + F.rows();
  const double *const g0 = G.data(), *const g1 = g0 + G.rows(), *const g2 = g1 + G.rows();
  for (Eigen::Index j = 0; j < G.rows(); ++j) {
    double* const m = M + j * stride;
    const double x = g0[j], y = g1[j], z = g2[j];
    Eigen::Index i = 0;
    for (; i + 4 <= n; i += 4) four(m + i).v += four(f0 + i).v * x + four(f1 + i).v * y + four(f2 + i).v * z;
    for (; i < n; ++i) m[i] += f0[i] * x + f1[i] * y + f2[i] * z;
  }
}

FLEXFRAME_WIDE
void wide_add_rows(const MatX3& F, const Mat3& A, MatX3& out) {
  const Eigen::Index n = F.rows();
  const double *const f0 = F.data(), *const f1 = f0 + n, *const f2 = f1 + n;
  for (int r = 0; r < 3; ++r) {
    double* const o = out.data() + r * n;
    const double x = A(r, 0), y = A(r, 1), z = A(r, 2);
    Eigen::Index i = 0;
    for (; i + 4 <= n; i += 4) four(o + i).v += (four(f0 + i).v * x + four(f1 + i).v * y) + four(f2 + i).v * z;
    for (; i < n; ++i) o[i] += (f0[i] * x + f1[i] * y) + f2[i] * z;
  }
}

// Rows 0 to 7 of y = A x, and with three sums `last` to last + 3 too, last <= 8: sums of four rows side by side, in registers.
template <int Sums>
FLEXFRAME_INLINE void multiply_rows(const double* a, std::ptrdiff_t column, std::ptrdiff_t last, int n, const double* x, double* y) {
  const std::ptrdiff_t at[3] = {0, 4, last};
  Four sum[Sums]{};
  int k = 0;
  for (; k + 4 <= n; k += 4, a += 4 * column) {
    const double *const a1 = a + column, *const a2 = a1 + column, *const a3 = a2 + column;
    const double x0 = x[k], x1 = x[k + 1], x2 = x[k + 2], x3 = x[k + 3];
    for (int r = 0; r < Sums; ++r)
      sum[r] += (four(a + at[r]).v * x0 + four(a1 + at[r]).v * x1) + (four(a2 + at[r]).v * x2 + four(a3 + at[r]).v * x3);
  }
  for (; k < n; ++k, a += column)
    for (int r = 0; r < Sums; ++r) sum[r] += four(a + at[r]).v * x[k];
  for (int r = 0; r < Sums; ++r) four(y + at[r]).v = sum[r];
}

// The same of a square of nine to twelve rows, where the compiler knows how many.
template <int N>
FLEXFRAME_INLINE void multiply_square(const double* a, const double* x, double* y) {
  multiply_rows<3>(a, N, N - 4, N, x, y);
}

FLEXFRAME_WIDE
void wide_multiply(const MatX& A, const double* x, double* y) {
  const int m = static_cast<int>(A.rows()), n = static_cast<int>(A.cols());
  const std::ptrdiff_t column = m;
  if (m > 8 && m <= 12) {  // most bodies: no loop over rows
    if (m != n) return multiply_rows<3>(A.data(), column, m - 4, n, x, y);
    if (n == 9) return multiply_square<9>(A.data(), x, y);
    if (n == 10) return multiply_square<10>(A.data(), x, y);
    if (n == 11) return multiply_square<11>(A.data(), x, y);
    return multiply_square<12>(A.data(), x, y);
  }
  int i = 0;
  // Sums of twelve rows (nine at least, some of them twice) or eight stay in registers.
  while (m - i >= 8) {
    const int left = m - i, last = std::min(left - 4, 8);
    if (left >= 20 || (left > 8 && left <= 12)) {
      multiply_rows<3>(A.data() + i, column, last, n, x, y + i);
      i += last + 4;
    } else {
      multiply_rows<2>(A.data() + i, column, 0, n, x, y + i);
      i += 8;
    }
  }
  // Rows that are left over, with some of those before once more.
  for (; i < m && m >= 4; i += 4) {
    i = std::min(i, m - 4);
    Four s{};
    const double* a = A.data() + i;
    int k = 0;
    for (; k + 4 <= n; k += 4, a += 4 * column)
      s += (four(a).v * x[k] + four(a + column).v * x[k + 1]) + (four(a + 2 * column).v * x[k + 2] + four(a + 3 * column).v * x[k + 3]);
    for (; k < n; ++k, a += column) s += four(a).v * x[k];
    four(y + i).v = s;
  }
  for (; i < m; ++i) {
    double s = 0.0;
    const double* a = A.data() + i;
    int k = 0;
    for (; k + 4 <= n; k += 4, a += 4 * column)
      s += (*a * x[k] + a[column] * x[k + 1]) + (a[2 * column] * x[k + 2] + a[3 * column] * x[k + 3]);
    for (; k < n; ++k, a += column) s += *a * x[k];
    y[i] = s;
  }
}

// add_products of so many columns, whose factors stay in registers along a column of D.
template <int M>
FLEXFRAME_INLINE void add_few_products(const double* T, const double* E, const double* F, double* D, int n) {
  const std::ptrdiff_t stride = n;
  for (int k = 0; k < n; ++k) {
    double* const out = D + k * stride;
    double t[M], e[M];
    for (int d = 0; d < M; ++d) t[d] = T[d * stride + k], e[d] = E[d * stride + k];
    int i = first_row(k, n);
    for (; i + 4 <= n; i += 4) {
      Four s = four(out + i).v;
      for (int d = 0; d < M; ++d) s += t[d] * four(E + d * stride + i).v + e[d] * four(F + d * stride + i).v;
      four(out + i).v = s;
    }
    for (; i < n; ++i)
      for (int d = 0; d < M; ++d) out[i] += t[d] * E[d * stride + i] + e[d] * F[d * stride + i];
  }
}

FLEXFRAME_WIDE
void wide_add_products(const MatX& T, const MatX& E, const MatX& F, MatX& D) {
  const int n = static_cast<int>(T.rows()), m = static_cast<int>(T.cols());
  if (m == 1) return add_few_products<1>(T.data(), E.data(), F.data(), D.data(), n);
  if (m == 2) return add_few_products<2>(T.data(), E.data(), F.data(), D.data(), n);
  if (m == 3) return add_few_products<3>(T.data(), E.data(), F.data(), D.data(), n);
  if (m == 4) return add_few_products<4>(T.data(), E.data(), F.data(), D.data(), n);
  for (int k = 0; k < n; ++k) {
    double* const out = D.data() + static_cast<Eigen::Index>(k) * n;
    int i = first_row(k, n);
    for (; i + 4 <= n; i += 4) {
      Four s = four(out + i).v;
      for (int d = 0; d < m; ++d) s += T(k, d) * four(&E(i, d)).v + E(k, d) * four(&F(i, d)).v;
      four(out + i).v = s;
    }
    for (; i < n; ++i)
      for (int d = 0; d < m; ++d) out[i] += T(k, d) * E(i, d) + E(k, d) * F(i, d);
  }
}

}  // namespace

void add_symmetric(const MatX3& A, const MatX3& B, double* M, Eigen::Index stride) { wide_add_symmetric(A, B, M, stride); }

void set_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride) { wide_set_outer(F, n, G, M, stride); }

void add_outer(const MatX3& F, Eigen::Index n, const MatX3& G, double* M, Eigen::Index stride) { wide_add_outer(F, n, G, M, stride); }

void add_rows(const MatX3& F, const Mat3& A, MatX3& out) { wide_add_rows(F, A, out); }

void add_products(const MatX& T, const MatX& E, const MatX& F, MatX& D) { wide_add_products(T, E, F, D); }

namespace {

FLEXFRAME_WIDE bool factorise_padded(double* base, int n, int stride) { return factorise_columns(base, n, stride); }

// L = factor of D, n x n, by way of `base`, a square of `stride` rows and columns.
FLEXFRAME_WIDE
bool factorise_copied(const double* D, int n, int stride, double* base, double* L) {
  const std::ptrdiff_t rows = n;
  for (std::ptrdiff_t j = 0; j < stride; ++j) {
    double* const to = base + j * stride;
    for (std::ptrdiff_t i = 0; i < stride; i += 4) four(to + i).v = Four{};
    if (j < rows) copy_fours(D + j * (rows + 1), rows - j, to + j);
    else to[j] = 1.0;
  }
  if (!factorise_columns(base, n, stride)) return false;
  for (std::ptrdiff_t j = 0; j < rows; ++j) copy_fours(base + j * stride, rows, L + j * rows);
  return true;
}

}  // namespace

namespace {

// Rows of the square in which n are factorised. Along rows it reads a number of every column: columns that begin in few of the cache's
// sets push each other out, an odd number of its lines (eight numbers) spreads them over all. That matters where it does not fit.
int padded_rows(int n) {
  constexpr int fits = 64;
  return n <= fits ? (n + 3) & ~3 : ((n + 7) / 8 | 1) * 8;
}

}  // namespace

bool cholesky(const MatX& D, MatX& L) {
  const int n = static_cast<int>(D.rows()), stride = padded_rows(n);
  L.resize(n, n);
  if (n == 1) {
    L(0, 0) = std::sqrt(D(0, 0));
    return D(0, 0) > 0.0;
  }
  if (stride == n) {
    for (int j = 0; j < n; ++j) {
      double* const to = L.data() + static_cast<std::ptrdiff_t>(j) * n;
      std::fill_n(to, j, 0.0);
      copy_fours(&D(j, j), n - j, to + j);
    }
    return factorise_padded(L.data(), n, n);
  }
  static thread_local std::vector<double> padded;
  const size_t room = static_cast<size_t>(stride) * static_cast<size_t>(stride);
  if (padded.size() < room) padded.resize(room);
  return factorise_copied(D.data(), n, stride, padded.data(), L.data());
}

namespace {

FLEXFRAME_WIDE void solve_factor(const double* L, int n, double* v) { solve_columns(L, n, v); }

}  // namespace

void solve(const MatX& L, double* x) {
  const int n = static_cast<int>(L.rows());
  if (n == 1) {
    x[0] = x[0] / L(0, 0) / L(0, 0);
    return;
  }
  // Room behind the values.
  static thread_local std::vector<double> padded;
  padded.resize(std::max(padded.size(), static_cast<size_t>(n) + 3));
  std::copy_n(x, n, padded.data());
  solve_factor(L.data(), n, padded.data());
  std::copy_n(padded.data(), n, x);
}

namespace {

// Rows r to r + 4 Fours - 1 of Xt (L L^T)^-1, column by column, sums in registers. Columns before the first that is not zero stay as they
// are.
template <int Fours>
FLEXFRAME_INLINE void solve_rows_block(const double* l, double* x, int n, Eigen::Index m) {
  int start = 0;
  const auto zero = [&](int k) {
    for (int r = 0; r < 4 * Fours; ++r)
      if (x[k * m + r] != 0.0) return false;
    return true;
  };
  while (start < n && zero(start)) ++start;
  for (Eigen::Index j = start; j < n; ++j) {
    double* const xj = x + j * m;
    Four s[Fours];
    for (Eigen::Index b = 0; b < Fours; ++b) s[b] = four(xj + 4 * b).v;
    for (Eigen::Index k = start; k < j; ++k) {
      const double a = l[k * n + j];
      for (Eigen::Index b = 0; b < Fours; ++b) s[b] -= a * four(x + k * m + 4 * b).v;
    }
    const double inverse = 1.0 / l[j * (n + 1)];
    for (Eigen::Index b = 0; b < Fours; ++b) four(xj + 4 * b).v = s[b] * inverse;
  }
  for (Eigen::Index j = n; j-- > 0;) {
    double* const xj = x + j * m;
    const double* const lj = l + j * n;
    Four s[Fours];
    for (Eigen::Index b = 0; b < Fours; ++b) s[b] = four(xj + 4 * b).v;
    for (Eigen::Index k = n; --k > j;) {
      const double a = lj[k];
      for (Eigen::Index b = 0; b < Fours; ++b) s[b] -= a * four(x + k * m + 4 * b).v;
    }
    const double inverse = 1.0 / lj[j];
    for (Eigen::Index b = 0; b < Fours; ++b) four(xj + 4 * b).v = s[b] * inverse;
  }
}

FLEXFRAME_WIDE
void solve_rows_by_loops(const MatX& L, MatX& Xt) {
  const int n = static_cast<int>(L.rows()), m = static_cast<int>(Xt.rows());
  const double* const l = L.data();
  double* const x = Xt.data();
  int r = 0;
  for (; r + 16 <= m; r += 16) solve_rows_block<4>(l, x + r, n, m);
  for (; r + 8 <= m; r += 8) solve_rows_block<2>(l, x + r, n, m);
  for (; r + 4 <= m; r += 4) solve_rows_block<1>(l, x + r, n, m);
  for (; r < m; ++r) {
    for (int j = 0; j < n; ++j) {
      double s = x[static_cast<Eigen::Index>(j) * m + r];
      for (int k = 0; k < j; ++k) s -= l[static_cast<Eigen::Index>(k) * n + j] * x[static_cast<Eigen::Index>(k) * m + r];
      x[static_cast<Eigen::Index>(j) * m + r] = s * (1.0 / l[static_cast<Eigen::Index>(j) * (n + 1)]);
    }
    for (int j = n; j-- > 0;) {
      double s = x[static_cast<Eigen::Index>(j) * m + r];
      for (int k = n; --k > j;) s -= l[static_cast<Eigen::Index>(j) * n + k] * x[static_cast<Eigen::Index>(k) * m + r];
      x[static_cast<Eigen::Index>(j) * m + r] = s * (1.0 / l[static_cast<Eigen::Index>(j) * (n + 1)]);
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
  // A column of L with zeros where U stands: its product may be subtracted from there on too, which leaves those rows as they are.
  double masked[large];
  for (int k = 0; k < n; ++k) {
    double* const c = base + static_cast<Eigen::Index>(k) * n;
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
    const int first = first_row(k + 1, n);
    for (int i = first; i <= k; ++i) masked[i] = 0.0;
    const double inverse = 1.0 / c[k];
    for (int i = k + 1; i < n; ++i) masked[i] = c[i] *= inverse;
    for (int j = k + 1; j < n; ++j) {
      double* const a = base + static_cast<Eigen::Index>(j) * n;
      const double u = a[k];
      int i = first;
      for (; i + 4 <= n; i += 4) four(a + i).v -= four(masked + i).v * u;
      for (; i < n; ++i) a[i] -= masked[i] * u;
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
  double* const x = out;
  for (int i = 0; i < n; ++i) x[i] = b[order[i]];
  for (int k = 0; k < n; ++k) {
    const double* const l = lu + static_cast<Eigen::Index>(k) * n;
    const double a = x[k];
    int i = k + 1;
    for (; i + 4 <= n; i += 4) four(x + i).v -= four(l + i).v * a;
    for (; i < n; ++i) x[i] -= l[i] * a;
  }
  for (int k = n; k-- > 0;) {
    const double* const u = lu + static_cast<Eigen::Index>(k) * n;
    const double a = x[k] /= u[k];
    int i = 0;
    for (; i + 4 <= k; i += 4) four(x + i).v -= four(u + i).v * a;
    for (; i < k; ++i) x[i] -= u[i] * a;
  }
}

}  // namespace

void solve(const MatX& LU, const std::vector<int>& order, const double* b, double* x) {
  solve_factors(LU.data(), order.data(), static_cast<int>(LU.rows()), b, x);
}

namespace {

// As below, written out.
int invert_two(double* a) {
  const Eigen::Index p = std::abs(a[1]) > std::abs(a[0]) ? 1 : 0, r = 1 - p;
  const double pivot = a[p], right = a[2 + p], below = a[r];
  if (!(std::abs(pivot) > 0.0)) return 0;
  const double inverse = 1.0 / pivot, u = right * inverse, left = a[2 + r] - below * u;
  if (!(std::abs(left) > 0.0)) return 0;
  const double last = 1.0 / left, first = -below * inverse * last;
  // Columns as the rows stood.
  a[2 * p] = inverse - u * first;
  a[2 * p + 1] = first;
  a[2 * r] = -u * last;
  a[2 * r + 1] = last;
  return ((pivot > 0.0) == (left > 0.0)) == (p == 0) ? 1 : -1;
}

// y = A x of one to three rows.
template <int M>
void multiply_few(const double* a, Eigen::Index n, const double* x, double* y) {
  double sum[M] = {};
  for (Eigen::Index k = 0; k < n; ++k, a += M)
    for (int r = 0; r < M; ++r) sum[r] += a[r] * x[k];
  for (int r = 0; r < M; ++r) y[r] = sum[r];
}

// The same of four rows: what choosing the kernel for wider registers costs is more than this.
void multiply_four(const double* a, Eigen::Index n, const double* x, double* y) {
  Four s{};
  Eigen::Index k = 0;
  for (; k + 4 <= n; k += 4, a += 16)
    s += (four(a).v * x[k] + four(a + 4).v * x[k + 1]) + (four(a + 8).v * x[k + 2] + four(a + 12).v * x[k + 3]);
  for (; k < n; ++k, a += 4) s += four(a).v * x[k];
  four(y).v = s;
}

}  // namespace

void multiply(const MatX& A, const double* x, double* y) {
  if (A.rows() == 1) return multiply_few<1>(A.data(), A.cols(), x, y);
  if (A.rows() == 2) return multiply_few<2>(A.data(), A.cols(), x, y);
  if (A.rows() == 3) return multiply_few<3>(A.data(), A.cols(), x, y);
  if (A.rows() == 4) return multiply_four(A.data(), A.cols(), x, y);
  wide_multiply(A, x, y);
}

namespace {

// Of n rows and columns, N where they are known to the compiler, else 0; order: room for n numbers.
template <int N>
FLEXFRAME_INLINE int invert_square(double* a, Eigen::Index rows, Eigen::Index* order) {
  const Eigen::Index n = N > 0 ? N : rows;
  const auto A = [&](Eigen::Index i, Eigen::Index k) -> double& { return a[k * n + i]; };
  bool odd = false;  // so many row exchanges and negative pivots
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index pivot = k;
    for (Eigen::Index i = k + 1; i < n; ++i)
      if (std::abs(A(i, k)) > std::abs(A(pivot, k))) pivot = i;
    order[k] = pivot;
    // Not (>=), so that NaN counts as singular.
    if (!(std::abs(A(pivot, k)) > 0.0)) return 0;
    if (pivot != k)
      for (Eigen::Index j = 0; j < n; ++j) std::swap(A(k, j), A(pivot, j));
    odd ^= (pivot != k) ^ (A(k, k) < 0.0);
    const double inverse = 1.0 / A(k, k);
    A(k, k) = 1.0;
    for (Eigen::Index j = 0; j < n; ++j) A(k, j) *= inverse;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == k) continue;
      const double factor = A(i, k);
      A(i, k) = 0.0;
      for (Eigen::Index j = 0; j < n; ++j) A(i, j) -= factor * A(k, j);
    }
  }
  for (Eigen::Index k = n; k-- > 0;)
    if (order[k] != k)
      for (Eigen::Index i = 0; i < n; ++i) std::swap(A(i, k), A(i, order[k]));
  return odd ? -1 : 1;
}

}  // namespace

int invert(MatX& A) {
  const Eigen::Index n = A.rows();
  if (n == 2) return invert_two(A.data());
  Eigen::Index few[3];
  if (n == 3) return invert_square<3>(A.data(), n, few);
  static thread_local std::vector<Eigen::Index> order;
  order.resize(n);
  return invert_square<0>(A.data(), n, order.data());
}

}  // namespace flexframe::sim
