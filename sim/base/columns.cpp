#include "sim/base/columns.h"

namespace flexframe::sim {

void set_negative_to_parent(const Pose& a, const Mat6X& B, Mat6X& C) {
  for (Eigen::Index k = 0; k < B.cols(); ++k) C.col(k) = -to_parent(a, B.col(k));
}
void set_negative_to_parent(const PlanePose& a, const MatX3& B, MatX3& C) {
  C.col(0) = -a.c * B.col(0) + a.s * B.col(1) - a.p.y() * B.col(2);
  C.col(1) = -a.s * B.col(0) - a.c * B.col(1) + a.p.x() * B.col(2);
  C.col(2) = -B.col(2);
}

void wrenches_to_parent(const Pose& a, Mat6X& F, Eigen::Index n) {
  for (Eigen::Index k = 0; k < n; ++k) F.col(k) = wrench_to_parent(a, F.col(k));
}
void wrenches_to_parent(const PlanePose& a, MatX3& F, Eigen::Index n) {
  for (Eigen::Index k = 0; k < n; ++k) {
    const double x = a.c * F(k, 0) - a.s * F(k, 1), y = a.s * F(k, 0) + a.c * F(k, 1);
    F(k, 2) += a.p.x() * y - a.p.y() * x;
    F(k, 0) = x;
    F(k, 1) = y;
  }
}

void add_symmetric(const Mat6X& A, const Mat6X& B, MatX& M, Eigen::Index at) {
  const Eigen::Index n = A.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec6 a = A.col(k), b = B.col(k);
    for (Eigen::Index i = k; i < n; ++i) M(at + i, at + k) += A.col(i).dot(b) + B.col(i).dot(a);
  }
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

void reduce_inertia(const MatX& L, const Mat6X& U, const VecX& h, MatX& work, Mat6& I, Vec6& p) {
  work = U.transpose();
  for (Eigen::Index r = 0; r < 6; ++r) solve(L, work.col(r).data());
  I.noalias() -= U.lazyProduct(work);
  for (Eigen::Index r = 0; r < 6; ++r) p[r] += work.col(r).dot(h);
}
void reduce_inertia(const MatX& L, const MatX3& U, const VecX& h, MatX& work, Mat3& I, Vec3& p) {
  work = U;
  for (Eigen::Index r = 0; r < 3; ++r) solve(L, work.col(r).data());
  I.noalias() -= U.transpose().lazyProduct(work);
  p += Vec3(work.col(0).dot(h), work.col(1).dot(h), work.col(2).dot(h));
}

Mat6 inertia_at_parent(const Pose& a, const Mat6& I) {
  // X = [R^T, -R^T S; 0, R^T] with S = skew(p), I = [A B; B^T C]: A' = R A R^T, B' = R B R^T - A' S, C' = R C R^T + S B' - (R B R^T)^T S.
  const auto turned = [&](const Mat3& block) {
    const Mat3 left = a.R.lazyProduct(block);
    return Mat3(left.lazyProduct(a.R.transpose()));
  };
  const Mat3 S = skew(a.p), A = turned(I.topLeftCorner<3, 3>()), B0 = turned(I.topRightCorner<3, 3>());
  const Mat3 B = B0 - A.lazyProduct(S);
  Mat6 out;
  out.topLeftCorner<3, 3>() = A;
  out.topRightCorner<3, 3>() = B;
  out.bottomLeftCorner<3, 3>() = B.transpose();
  out.bottomRightCorner<3, 3>() = turned(I.bottomRightCorner<3, 3>()) + S.lazyProduct(B) - B0.transpose().lazyProduct(S);
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
