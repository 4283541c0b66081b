// Two levels of a mesh. See fe_two_level.h.
#include "sim/reduce/fe_two_level.h"

#include "sim/base/eigen_solvers.h"
#include "sim/reduce/dense_products.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Columns that are worked on together: a matrix is read once for all of them.
constexpr int together = 8;

// z = (D + L)^-T D (D + L)^-1 r for A = L + D + L^T, lower triangle stored, r: n x k. Steps forth and back over the unknowns.
MatX gauss_seidel(const SparseMatrix& lower, const MatX& r) {
  const int *outer = lower.outerIndexPtr(), *inner = lower.innerIndexPtr();
  const double* value = lower.valuePtr();
  MatX out(r.rows(), r.cols());
  for (Eigen::Index first = 0; first < r.cols(); first += together) {
    const Eigen::Index count = std::min<Eigen::Index>(together, r.cols() - first);
    Eigen::Matrix<double, together, Eigen::Dynamic> z(together, r.rows());  // an unknown's values lie beside each other
    z.setZero();
    z.topRows(count) = r.middleCols(first, count).transpose();
    // The diagonal comes first in a column.
    for (Eigen::Index c = 0; c < lower.cols(); ++c) {
      const Eigen::Matrix<double, together, 1> own = z.col(c) / value[outer[c]];
      z.col(c) = own;
      for (int k = outer[c] + 1; k < outer[c + 1]; ++k) z.col(inner[k]) -= value[k] * own;
    }
    for (Eigen::Index c = lower.cols() - 1; c >= 0; --c) {
      Eigen::Matrix<double, together, 1> sum = Eigen::Matrix<double, together, 1>::Zero();
      for (int k = outer[c] + 1; k < outer[c + 1]; ++k) sum += value[k] * z.col(inner[k]);
      z.col(c) -= sum / value[outer[c]];
    }
    out.middleCols(first, count) = z.topRows(count).transpose();
  }
  return out;
}

// Vectors with K and M times each: the best m, twice as many directions, and m that the best ones last went along. These are the memory of
// the iteration, and stay where they are.
struct Iteration {
  Iteration(Eigen::Index n, Eigen::Index count) : m(count), x(n, 4 * m), Kx(n, 4 * m), Mx(n, 4 * m) {}
  Eigen::Index m, used = 0;
  MatX x, Kx, Mx;

  void put(Eigen::Index first, const MatX& some, const SparseMatrix& K, const SparseMatrix& M) {
    x.middleCols(first, some.cols()) = some;
    Kx.middleCols(first, some.cols()) = symmetric_product(K, some);
    Mx.middleCols(first, some.cols()) = symmetric_product(M, some);
    used = std::max(used, first + some.cols());
  }

  // The best become the first times C; what of them is not of the best before becomes the way that they went.
  void take(const MatX& C) {
    constexpr Eigen::Index strip = 1024;  // rows at a time, in the cache
    MatX both = MatX::Zero(used, 2 * m);
    both.leftCols(m) = C;
    both.rightCols(m).bottomRows(used - m) = C.bottomRows(used - m);
    for (MatX* A : {&x, &Kx, &Mx})
      for (Eigen::Index row = 0; row < A->rows(); row += strip) {
        const Eigen::Index count = std::min(strip, A->rows() - row);
        MatX next = MatX::Zero(count, 2 * m);
        add_product(next, 1.0, A->block(row, 0, count, used), both);
        A->block(row, 0, count, m) = next.leftCols(m);
        A->block(row, 3 * m, count, m) = next.rightCols(m);
      }
    if (used > m) used = 4 * m;
  }
};

class TwoLevels {
 public:
  TwoLevels(const FeSolver& c, const FeFine& f) : coarse(c), fine(f), K(f.reduced.K()), M(f.reduced.M()), R(f.rigid) {
    if (R.cols() == 0) return;
    const MatX gram = product_tn(R, symmetric_product(M, R));
    const SymmetricEigen eigen(0.5 * (gram + gram.transpose()));
    R = (R * eigen.eigenvectors() * eigen.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal()).eval();
    MR = symmetric_product(M, R);
  }

  // Motions of the finer reduced system.
  MatX prolong(const MatX& q) const {
    const MatX u = fine.from_coarse * coarse.system.expand(q);
    if (fine.reduced.identity) return u;
    MatX out(fine.reduced.size(), u.cols());
    for (Eigen::Index c = 0; c < out.rows(); ++c) out.row(c) = u.row(fine.reduced.own[c]);
    return out;
  }

  void take_out_rigid(MatX& u) const {
    if (R.cols() > 0) add_product(u, -1.0, R, product_tn(MR, u));
  }

  // What the smoother makes of the residual r, and, in further columns, what the coarse mesh makes of the rest, smoothed again.
  MatX directions(const MatX& r) const {
    const MatX first = gauss_seidel(K, r);
    MatX second = prolong(coarse.approximate(restrict(r - symmetric_product(K, first))));
    second -= gauss_seidel(K, symmetric_product(K, second));
    MatX out(r.rows(), 2 * r.cols());
    out << first, second;
    take_out_rigid(out);
    return out;
  }

 private:
  MatX restrict(const MatX& p) const {
    if (fine.reduced.identity) return coarse.system.restrict(fine.from_coarse.transpose() * p);
    MatX all = MatX::Zero(fine.from_coarse.rows(), p.cols());
    for (Eigen::Index c = 0; c < p.rows(); ++c) all.row(fine.reduced.own[c]) = p.row(c);
    return coarse.system.restrict(fine.from_coarse.transpose() * all);
  }

  const FeSolver& coarse;
  const FeFine& fine;
  const SparseMatrix &K, &M;
  MatX R, MR;  // M-orthonormal
};

// The best vectors in the span of S (Rayleigh and Ritz): what to multiply S by, and the squared frequencies.
std::pair<MatX, VecX> best_in(const Iteration& S) {
  MatX G = product_tn(S.x.leftCols(S.used), S.Mx.leftCols(S.used));
  const VecX scale = G.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  G = (scale.asDiagonal() * G * scale.asDiagonal()).eval();
  const SymmetricEigen mass(0.5 * (G + G.transpose()));
  // Directions that rounding makes of others are left out.
  const Eigen::Index keep = (mass.eigenvalues().array() > 1e-10 * mass.eigenvalues().maxCoeff()).count();
  const MatX T =
      scale.asDiagonal() * mass.eigenvectors().rightCols(keep) * mass.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatX H = T.transpose() * product_tn(S.x.leftCols(S.used), S.Kx.leftCols(S.used)) * T;
  const SymmetricEigen ritz(0.5 * (H + H.transpose()));
  const Eigen::Index found = std::min(S.m, keep);
  return {T * ritz.eigenvectors().leftCols(found), ritz.eigenvalues().head(found)};
}

}  // namespace

std::optional<FeModes> two_level_modes(const FeSolver& coarse, const FeFine& fine, const FeModes& start, int wanted,
                                       const std::function<void()>& ask) {
  constexpr int most_steps = 24;
  // A tenth of what is looked for; a thousandth of a squared frequency is 0.05 % of the frequency, far below what is told.
  constexpr double share = 0.1, small = 1e-3;
  const TwoLevels levels(coarse, fine);
  const SparseMatrix &K = fine.reduced.K(), &M = fine.reduced.M();
  const Eigen::Index m = start.vectors.cols();
  Iteration S(fine.reduced.size(), m);
  {
    MatX first = levels.prolong(start.vectors);
    levels.take_out_rigid(first);
    S.put(0, first, K, M);
  }
  VecX values, change;
  for (int step = 0; step <= most_steps; ++step) {
    if (ask) ask();
    if (step > 0) S.put(m, levels.directions(S.Kx.leftCols(m) - S.Mx.leftCols(m) * values.asDiagonal()), K, M);
    const auto [C, found] = best_in(S);
    if (found.size() < m) return std::nullopt;
    S.take(C);
    bool enough = step > 1;
    if (step > 0) {
      // Steps shrink geometrically: what is left is the last one times q / (1 - q).
      const VecX now = (values - found).cwiseAbs();
      for (int k = 0; k < wanted && enough; ++k) {
        const double q = std::min(0.9, now(k) / std::max(change(k), 1e-300));
        enough = now(k) * q / (1.0 - q) < std::max(share * std::abs(start.eigenvalues(k) - found(k)), small * found(k));
      }
      change = now;
    }
    values = found;
    if (enough) return FeModes{values, S.x.leftCols(m), step};
  }
  return std::nullopt;
}

}  // namespace flexframe::sim
