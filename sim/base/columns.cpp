#include "sim/base/columns.h"

#include "sim/base/four.h"

#include <vector>

namespace flexframe::sim {

namespace {

// Columns of two vectors, v and w, to v' = R v + p x (R w), w' = R w, each times `sign`: twists seen from the frame in which theirs stands
// at the pose; wrenches with the force as w. v_first: v comes first. `out` may be `in`.
template <bool v_first>
FLEXFRAME_INLINE void turn_pairs(const Pose& a, double sign, const double* in, Eigen::Index n, double* out) {
  Four R[3], P[3];
  for (int c = 0; c < 3; ++c) {
    const Vec3 axis = sign * a.R.col(c), arm = a.p.cross(axis);
    R[c] = Four{axis[0], axis[1], axis[2], 0.0};
    P[c] = Four{arm[0], arm[1], arm[2], 0.0};
  }
  constexpr int at_v = v_first ? 0 : 3, at_w = 3 - at_v;
  for (Eigen::Index k = 0; k < n; ++k, in += 6, out += 6) {
    const double *const v = in + at_v, *const w = in + at_w;
    const Four moved = (R[0] * v[0] + R[1] * v[1] + R[2] * v[2]) + (P[0] * w[0] + P[1] * w[1] + P[2] * w[2]);
    const Four turned = R[0] * w[0] + R[1] * w[1] + R[2] * w[2];
    const Four first = v_first ? moved : turned, second = v_first ? turned : moved;
    four(out).v = Four{first[0], first[1], first[2], second[0]};
    out[4] = second[1], out[5] = second[2];
  }
}
FLEXFRAME_WIDE void wide_negative_to_parent(const Pose& a, const double* B, Eigen::Index n, double* C) {
  turn_pairs<true>(a, -1.0, B, n, C);
}
FLEXFRAME_WIDE void wide_wrenches_to_parent(const Pose& a, double* F, Eigen::Index n) { turn_pairs<false>(a, 1.0, F, n, F); }

// The products of a 6 x 6 matrix with n columns: rows 0 to 3 and 2 to 5 side by side.
FLEXFRAME_WIDE void wide_momenta(const double* I, const double* in, Eigen::Index n, double* out) {
  Four upper[6], lower[6];
  for (std::ptrdiff_t s = 0; s < 6; ++s) upper[s] = four(I + 6 * s).v, lower[s] = four(I + 6 * s + 2).v;
  for (Eigen::Index k = 0; k < n; ++k, in += 6, out += 6) {
    Four top = upper[0] * in[0], bottom = lower[0] * in[0];
    for (std::ptrdiff_t s = 1; s < 6; ++s) {
      top += upper[s] * in[s];
      bottom += lower[s] * in[s];
    }
    four(out).v = top;
    four(out + 2).v = bottom;
  }
}

}  // namespace

void set_momenta(const Mat6& I, const Mat6X& A, Mat6X& out) { wide_momenta(I.data(), A.data(), A.cols(), out.data()); }

void set_negative_to_parent(const Pose& a, const Mat6X& B, Mat6X& C) { wide_negative_to_parent(a, B.data(), B.cols(), C.data()); }
void set_negative_to_parent(const PlanePose& a, const MatX3& B, MatX3& C) {
  const Eigen::Index n = B.rows();
  const double *const x = B.data(), *const y = x + n, *const turn = y + n, px = a.p.x(), py = a.p.y();
  double *const to_x = C.data(), *const to_y = to_x + n, *const to_turn = to_y + n;
  Eigen::Index k = 0;
  for (; k + 4 <= n; k += 4) {
    const Four u = four(x + k).v, v = four(y + k).v, w = four(turn + k).v;
    four(to_x + k).v = -a.c * u + a.s * v - py * w;
    four(to_y + k).v = -a.s * u - a.c * v + px * w;
    four(to_turn + k).v = -w;
  }
  for (; k < n; ++k) {
    to_x[k] = -a.c * x[k] + a.s * y[k] - py * turn[k];
    to_y[k] = -a.s * x[k] - a.c * y[k] + px * turn[k];
    to_turn[k] = -turn[k];
  }
}

void wrenches_to_parent(const Pose& a, Mat6X& F, Eigen::Index n) { wide_wrenches_to_parent(a, F.data(), n); }
void wrenches_to_parent(const PlanePose& a, MatX3& F, Eigen::Index n) {
  for (Eigen::Index k = 0; k < n; ++k) {
    const double x = a.c * F(k, 0) - a.s * F(k, 1), y = a.s * F(k, 0) + a.c * F(k, 1);
    F(k, 2) += a.p.x() * y - a.p.y() * x;
    F(k, 0) = x;
    F(k, 1) = y;
  }
}

namespace {

// Lower half of M += A^T B + B^T A with A, B of six rows, n columns: products of [A; B] with [B; A], twelve rows in three registers.
// both: room for [A; B].
FLEXFRAME_WIDE
void wide_add_symmetric(const double* A, const double* B, int n, double* both, double* M, std::ptrdiff_t stride) {
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const double *const a = A + 6 * k, *const b = B + 6 * k;
    double* const to = both + 12 * k;
    four(to).v = four(a).v;
    four(to + 2).v = four(a + 2).v;
    four(to + 6).v = four(b).v;
    four(to + 8).v = four(b + 2).v;
  }
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const double* x = both + 12 * k;
    const Four first = four(x + 6).v, second = Four{x[10], x[11], x[0], x[1]}, third = four(x + 2).v;
    double* const m = M + k * stride;
    for (std::ptrdiff_t i = k; i < n; ++i, x += 12) {
      const Four s = (four(x).v * first + four(x + 4).v * second) + four(x + 8).v * third;
      m[i] += (s[0] + s[2]) + (s[1] + s[3]);
    }
  }
}

}  // namespace

void add_symmetric(const Mat6X& A, const Mat6X& B, MatX& M, Eigen::Index at) {
  static thread_local std::vector<double> both;
  const size_t room = 12 * static_cast<size_t>(A.cols());
  if (both.size() < room) both.resize(room);
  wide_add_symmetric(A.data(), B.data(), static_cast<int>(A.cols()), both.data(), &M(at, at), M.rows());
}
void set_outer(const Mat6X& F, Eigen::Index n, const Mat6X& G, MatX& M, Eigen::Index row, Eigen::Index col) {
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec6 f = F.col(k);
    for (Eigen::Index j = 0; j < G.cols(); ++j) M(row + k, col + j) = G.col(j).dot(f);
  }
}
void add_outer(const Mat6X& F, Eigen::Index n, const Mat6X& G, MatX& M, Eigen::Index row, Eigen::Index col) {
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec6 f = F.col(k);
    for (Eigen::Index j = 0; j < G.cols(); ++j) M(row + k, col + j) += G.col(j).dot(f);
  }
}

namespace {

// Y = Y L^-T of as many fours of rows, n columns; then product += Y Y^T, its first Rows rows.
template <int Rows, int Fours>
FLEXFRAME_INLINE void halve(const double* L, int n, double* Y, double* product) {
  constexpr int height = 4 * Fours;
  const std::ptrdiff_t stride = n;
  Four sum[Rows][Fours] = {};
  for (std::ptrdiff_t j = 0; j < n; ++j) {
    Four y[Fours];
    for (std::ptrdiff_t b = 0; b < Fours; ++b) y[b] = four(Y + height * j + 4 * b).v;
    const double* l = L + j;
    for (std::ptrdiff_t k = 0; k < j; ++k, l += stride)
      for (std::ptrdiff_t b = 0; b < Fours; ++b) y[b] -= *l * four(Y + height * k + 4 * b).v;
    const double inverse = 1.0 / *l;
    for (std::ptrdiff_t b = 0; b < Fours; ++b) four(Y + height * j + 4 * b).v = y[b] *= inverse;
    for (int r = 0; r < Rows; ++r)
      for (std::ptrdiff_t b = 0; b < Fours; ++b) sum[r][b] += Y[height * j + r] * y[b];
  }
  for (std::ptrdiff_t r = 0; r < Rows; ++r)
    for (std::ptrdiff_t b = 0; b < Fours; ++b) four(product + height * r + 4 * b).v = sum[r][b];
}
FLEXFRAME_WIDE void halve_six(const double* L, int n, double* Y, double* product) { halve<6, 2>(L, n, Y, product); }
FLEXFRAME_WIDE void halve_three(const double* L, int n, double* Y, double* product) { halve<3, 1>(L, n, Y, product); }

}  // namespace

// U (L L^T)^-1 [U^T h] = Y_U [Y_U^T Y_h] with Y = [U; h^T] L^-T.
void reduce_inertia(const MatX& L, const Mat6X& U, const VecX& h, MatX& work, Mat6& I, Vec6& p) {
  const Eigen::Index n = U.cols();
  work.resize(8, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    std::copy_n(U.data() + 6 * k, 6, work.data() + 8 * k);
    work(6, k) = h[k];
    work(7, k) = 0.0;
  }
  double product[6 * 8];
  halve_six(L.data(), static_cast<int>(n), work.data(), product);
  for (Eigen::Index r = 0; r < 6; ++r) {
    for (Eigen::Index s = 0; s < 6; ++s) I(s, r) -= product[8 * r + s];
    p[r] += product[8 * r + 6];
  }
}
void reduce_inertia(const MatX& L, const MatX3& U, const VecX& h, MatX& work, Mat3& I, Vec3& p) {
  const Eigen::Index n = U.rows();
  work.resize(4, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index r = 0; r < 3; ++r) work(r, k) = U(k, r);
    work(3, k) = h[k];
  }
  double product[3 * 4];
  halve_three(L.data(), static_cast<int>(n), work.data(), product);
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index s = 0; s < 3; ++s) I(s, r) -= product[4 * r + s];
    p[r] += product[4 * r + 3];
  }
}

namespace {

// R M R^T of the block of a 6 x 6 matrix that begins at m; p x M, column by column. Three by three, as rows of columns.
FLEXFRAME_INLINE void turn_block(const double* R, const double* m, double* out) {
  double left[9];
  for (std::ptrdiff_t c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) left[3 * c + r] = R[r] * m[6 * c] + R[3 + r] * m[6 * c + 1] + R[6 + r] * m[6 * c + 2];
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) out[3 * c + r] = left[r] * R[c] + left[3 + r] * R[3 + c] + left[6 + r] * R[6 + c];
}
FLEXFRAME_INLINE void cross_columns(const double* p, const double* m, double* out) {
  for (int c = 0; c < 3; ++c, m += 3, out += 3) {
    out[0] = p[1] * m[2] - p[2] * m[1];
    out[1] = p[2] * m[0] - p[0] * m[2];
    out[2] = p[0] * m[1] - p[1] * m[0];
  }
}

// X = [R^T, -R^T S; 0, R^T] with S = skew(p), I = [A B; B^T C]: A' = R A R^T, B' = R B R^T - A' S, C' = R C R^T + S B' - (R B R^T)^T S.
FLEXFRAME_WIDE
void wide_inertia_at_parent(const Pose& a, const double* I, double* out) {
  const double *const R = a.R.data(), *const p = a.p.data();
  double A[9], B[9], C[9], SA[9], SB0[9], SB[9];
  turn_block(R, I, A);
  turn_block(R, I + 18, B);
  turn_block(R, I + 21, C);
  cross_columns(p, A, SA);
  cross_columns(p, B, SB0);
  // A' is symmetric: A' S = -(S A')^T.
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) B[3 * c + r] += SA[3 * r + c];
  cross_columns(p, B, SB);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) {
      out[6 * c + r] = A[3 * c + r];
      out[6 * (c + 3) + r] = out[6 * r + c + 3] = B[3 * c + r];
      out[6 * (c + 3) + r + 3] = C[3 * c + r] + SB[3 * c + r] + SB0[3 * r + c];
    }
}

}  // namespace

Mat6 inertia_at_parent(const Pose& a, const Mat6& I) {
  Mat6 out;
  wide_inertia_at_parent(a, I.data(), out.data());
  return out;
}

Mat3 inertia_at_parent(const PlanePose& a, const Mat3& I) {
  const double c = a.c, s = a.s, x = a.p.x(), y = a.p.y();
  // The block of both directions and the column of the turn, in the parent's axes.
  const double xx = c * (c * I(0, 0) - s * I(0, 1)) - s * (c * I(1, 0) - s * I(1, 1));
  const double xy = s * (c * I(0, 0) - s * I(0, 1)) + c * (c * I(1, 0) - s * I(1, 1));
  const double yy = s * (s * I(0, 0) + c * I(0, 1)) + c * (s * I(1, 0) + c * I(1, 1));
  const double u = c * I(0, 2) - s * I(1, 2), v = s * I(0, 2) + c * I(1, 2);
  // The child's origin moves with (-y, x) per unit of the parent's turn.
  const double xt = u - y * xx + x * xy, yt = v - y * xy + x * yy;
  Mat3 out;
  out(0, 0) = xx;
  out(1, 1) = yy;
  out(0, 1) = out(1, 0) = xy;
  out(0, 2) = out(2, 0) = xt;
  out(1, 2) = out(2, 1) = yt;
  out(2, 2) = I(2, 2) + (x * v - y * u) + (x * yt - y * xt);
  return out;
}

}  // namespace flexframe::sim
