#include "sim/reduce/fe_further.h"

#include "sim/base/eigen_solvers.h"
#include "sim/reduce/dense_products.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace flexframe::sim {
namespace {

constexpr Eigen::Index most_shapes = 60;  // in a file
constexpr double of_no_account = 1e-5;    // of G
constexpr double frequency_right = 1e-3;

// The share of each column's own energy that has to be left when U is taken out: below is what the solutions leave open.
constexpr double left_of_one = 1e-12;

// Takes out what the fields have in common with U in stiffness; columns of which nothing is left go. KC = K C with them.
void take_out(const FeModes& basis, const SparseMatrix& K, MatX& C, MatX& KC) {
  KC = symmetric_product(K, C);
  const VecX before = C.cwiseProduct(KC).colwise().sum();
  for (int pass = 0; pass < 2; ++pass) {
    add_product(C, -1.0, basis.vectors, basis.eigenvalues.cwiseInverse().asDiagonal() * product_tn(basis.vectors, KC));
    KC = symmetric_product(K, C);
  }
  const VecX after = C.cwiseProduct(KC).colwise().sum();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < C.cols(); ++k)
    if (after(k) > left_of_one * before(k)) kept.push_back(k);
  for (size_t k = 0; k < kept.size(); ++k) {
    const double scale = 1.0 / std::sqrt(after(kept[k]));
    C.col(static_cast<Eigen::Index>(k)) = scale * C.col(kept[k]);
    KC.col(static_cast<Eigen::Index>(k)) = scale * KC.col(kept[k]);
  }
  C.conservativeResize(Eigen::NoChange, std::ssize(kept));
  KC.conservativeResize(Eigen::NoChange, std::ssize(kept));
}

// The highest of the reduced model's eigenvalues, of the first one on, that the further shapes leave as they are.
double right_up_to(const FeModes& basis, const FeFurther& further) {
  const Eigen::Index n = basis.eigenvalues.size(), m = further.shapes.eigenvalues.size();
  MatX M = MatX::Identity(n + m, n + m), K = MatX::Zero(n + m, n + m);
  M.topRightCorner(n, m) = further.coupling;
  M.bottomLeftCorner(m, n) = further.coupling.transpose();
  K.diagonal() << basis.eigenvalues, further.shapes.eigenvalues;
  const GeneralizedEigen richer(K, M, Eigen::EigenvaluesOnly);
  if (richer.info() != Eigen::Success) return 0.0;
  double out = 0.0;
  for (Eigen::Index k = 0; k < n && basis.eigenvalues(k) <= (1.0 + 2.0 * frequency_right) * richer.eigenvalues()(k); ++k)
    out = basis.eigenvalues(k);
  return out;
}

}  // namespace

FeFurther further_fields(const FeSolver& solver, const FeModes& basis, MatX statics) {
  const SparseMatrix &K = solver.system.K(), &M = solver.system.M();
  // The shift of the factor changes the shapes by a thousandth.
  const MatX inertial = solver.approximate(symmetric_product(M, statics));
  MatX C(statics.rows(), 2 * statics.cols());
  C << statics, inertial;
  statics.resize(0, 0);
  MatX KC;
  take_out(basis, K, C, KC);
  FeFurther out;
  if (C.cols() == 0) return out;
  // Directions in which they depend on each other go.
  const MatX stiff = product_tn(C, KC);
  const SymmetricEigen gram(0.5 * (stiff + stiff.transpose()));
  const VecX& d = gram.eigenvalues();
  const Eigen::Index keep = (d.array() > 1e-9 * d(d.size() - 1)).count();
  const MatX S = gram.eigenvectors().rightCols(keep) * d.tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatX MC = symmetric_product(M, C), mass = product_tn(C, MC);
  const SymmetricEigen ritz(S.transpose() * (0.5 * (mass + mass.transpose())) * S);
  // Of unit stiffness so far: the eigenvalues are 1 / omega^2.
  const VecX inverse = ritz.eigenvalues();
  const MatX all = S * ritz.eigenvectors();
  const MatX coupling = product_tn(basis.vectors, MC) * all;
  const VecX parts = coupling.colwise().squaredNorm();
  std::vector<Eigen::Index> order(static_cast<size_t>(keep));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return parts(a) > parts(b); });
  std::erase_if(order, [&](Eigen::Index k) { return !(inverse(k) > 0.0) || parts(k) <= of_no_account * parts.maxCoeff(); });
  if (std::ssize(order) > most_shapes) order.resize(most_shapes);
  const VecX scale = VecX(inverse(order)).cwiseSqrt().cwiseInverse();
  out.shapes.eigenvalues = VecX(inverse(order)).cwiseInverse();
  out.shapes.vectors = MatX::Zero(C.rows(), std::ssize(order));
  add_product(out.shapes.vectors, 1.0, C, all(Eigen::all, order) * scale.asDiagonal());
  out.coupling = coupling(Eigen::all, order) * scale.asDiagonal();
  out.right_up_to = right_up_to(basis, out);
  return out;
}

}  // namespace flexframe::sim
