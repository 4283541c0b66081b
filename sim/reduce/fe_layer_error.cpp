// What layered shells leave out. See fe_layer_error.h.
#include "sim/reduce/fe_layer_error.h"

#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_sections.h"

namespace flexframe::sim {
namespace {

bool curved(const FeElement& e) { return e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8; }

// Without what stretching has of it.
Mat3 bending_alone(const FeShellLaw& law) { return law.D - law.B * law.A.inverse() * law.B; }

// Bending alone: of curved shells, which sum up layers, by two sheets and a third between them that takes away what they have together.
FeShellLaw bent_alone(FeShellLaw law) {
  law.D = bending_alone(law);
  law.A.setZero();
  law.B.setZero();
  law.twist = 0.0;
  const double height = 0.5 * (law.plies.back().upper - law.plies.front().lower);
  constexpr double thin = 1e-3;
  std::vector<FePly> sheets(3, law.plies.front());
  for (int k = 0; k < 3; ++k) {
    FePly& p = sheets[k];
    p.lower = (k - 1 - 0.5 * thin) * height;
    p.upper = (k - 1 + 0.5 * thin) * height;
    p.membrane = (k == 1 ? -1.0 : 0.5) / (thin * height * height * height) * law.D;
    p.shear.setZero();
  }
  law.plies = sheets;
  return law;
}

constexpr double step = 1e-3;

FeShellLaw sheared(FeShellLaw law) {
  law.S *= 1.0 + step;
  for (FePly& p : law.plies) p.shear *= 1.0 + step;
  return law;
}

// Energy of the motions u of a shell's nodes (6 rows each), times two; `change` makes another law of its own.
template <class Change>
VecX energy(const FeModel& model, const FeElement& e, const Mat3X& X, const MatX& u, const Change& change) {
  MatX K, M;
  if (curved(e)) {
    curved_shell_matrices(
        e.shape, X, [&](const Mat3& Q, const VecX& N) { return FeShellLaw(change(shell_law_at(model, e, Q, N))); }, e.id, K, M);
  } else {
    double area = 0.0;
    shell_matrices(e.shape, X, change(shell_law(model, e, shell_axes(e.shape, X, e.id, area))), e.id, K, M);
  }
  return u.cwiseProduct(K * u).colwise().sum().transpose();
}

// That of bending: of flat shells by their rotations, which are linear between the nodes.
VecX bending_energy(const FeModel& model, const FeElement& e, const Mat3X& X, const MatX& u) {
  if (curved(e)) return energy(model, e, X, u, bent_alone);
  VecX out = VecX::Zero(u.cols());
  for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) {
    MatX curvature = MatX::Zero(3, u.cols());
    for (Eigen::Index i = 0; i < e.count; ++i) {
      const MatX turn = p.axes.transpose() * u.middleRows(6 * i + 3, 3);
      curvature.row(0) += p.dN(i, 0) * turn.row(1);
      curvature.row(1) -= p.dN(i, 1) * turn.row(0);
      curvature.row(2) += p.dN(i, 1) * turn.row(1) - p.dN(i, 0) * turn.row(0);
    }
    out += p.area * curvature.cwiseProduct(bending_alone(shell_law(model, e, p.axes)) * curvature).colwise().sum().transpose();
  }
  return out;
}

// That of shear: by what it grows with the stiffness, but of triangles, whose rotations change with it, what bending leaves.
VecX shear_energy(const FeModel& model, const FeElement& e, const Mat3X& X, const MatX& u, const VecX& bending) {
  if (e.shape == FeShape::triangle3) return energy(model, e, X, u, bent_alone) - bending;
  const auto own = [](const FeShellLaw& law) { return law; };
  return (energy(model, e, X, u, sheared) - energy(model, e, X, u, own)) / step;
}

}  // namespace

VecX layer_error(const FeModel& model, const FeSystem& system, const MatX& U, const VecX& eigenvalues) {
  VecX bent = VecX::Zero(U.cols()), shear = bent, warped = bent;
  for (const FeElement& e : model.elements) {
    if (!fe_is_shell(e.shape) || e.section < 0 || model.layups[e.section].layers.size() < 2) continue;
    Mat3X X(3, e.count);
    for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
    double area = 0.0;
    const double warping = layer_warping(shell_law(model, e, shell_axes(e.shape, X, e.id, area)));
    MatX u = MatX::Zero(6 * Eigen::Index{e.count}, U.cols());
    for (int i = 0; i < e.count; ++i)
      for (int d = 0; d < 6; ++d)
        if (const int row = system.dof[model.connectivity[e.first + i]][d]; row >= 0) u.row(6 * Eigen::Index{i} + d) = U.row(row);
    const VecX bending = bending_energy(model, e, X, u), sliding = shear_energy(model, e, X, u, bending);
    bent += bending;
    shear += sliding;
    warped += warping * sliding;
  }
  VecX out = VecX::Zero(U.cols());
  for (Eigen::Index k = 0; k < out.size(); ++k)
    if (shear(k) > 0.0) {
      // Of shear energy beyond rounding of the rest.
      const double ratio = shear(k) / std::max(bent(k), 1e-6 * shear(k));
      out(k) = std::sqrt(1.0 + std::max(warped(k), 0.0) * ratio / eigenvalues(k)) - 1.0;
    }
  return out;
}

}  // namespace flexframe::sim
