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

bool factorise_mass(Space, MatX& L) {
  const Eigen::LLT<Eigen::Ref<MatX>> llt(L);
  return llt.info() == Eigen::Success;
}
void solve_mass(Space, const MatX& L, VecX& x) {
  L.triangularView<Eigen::Lower>().solveInPlace(x);
  L.triangularView<Eigen::Lower>().adjoint().solveInPlace(x);
}

void reduce_inertia(const MatX& L, const Mat6X& U, const VecX& h, MatX& work, Mat6& I, Vec6& p) {
  work = U.transpose();
  L.triangularView<Eigen::Lower>().solveInPlace(work);
  L.triangularView<Eigen::Lower>().adjoint().solveInPlace(work);
  I.noalias() -= U * work;
  p.noalias() += work.transpose() * h;
}
void reduce_inertia(const MatX& L, const MatX3& U, const VecX& h, MatX& work, Mat3& I, Vec3& p) {
  work = U;
  for (Eigen::Index r = 0; r < 3; ++r) solve(L, work.col(r).data());
  I.noalias() -= U.transpose().lazyProduct(work);
  p += Vec3(work.col(0).dot(h), work.col(1).dot(h), work.col(2).dot(h));
}

}  // namespace flexframe::sim
