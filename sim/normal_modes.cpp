#include "sim/normal_modes.h"

#include "sim/axis_mass.h"
#include "sim/eigen_solvers.h"
#include "sim/spatial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace flexframe::sim {

namespace {

// Coordinates in which mass is 1 and stiffness diagonal: old ones = T new ones.
FlexibleBody in_basis(const FlexibleBody& body, const MatX& T) {
  const auto congruent = [&](const MatX& A) { return A.size() == 0 ? MatX() : MatX(T.transpose() * A * T); };
  FlexibleBody out = body;
  out.n = static_cast<int>(T.cols());
  out.md1 = body.md1 * T;
  out.J1 = body.J1 * T;
  out.Cr0 = body.Cr0 * T;
  for (size_t a = 0; a < 3; ++a) {
    out.md2[a] = congruent(body.md2[a]);
    out.Cr1[a] = congruent(body.Cr1[a]);
  }
  for (size_t a = 0; a < 6; ++a) out.J2[a] = congruent(body.J2[a]);
  out.stiffness = (T.transpose() * body.Ke * T).diagonal();
  out.Me = MatX::Identity(out.n, out.n);
  out.Ke = out.stiffness.asDiagonal();
  out.De = congruent(body.De);
  if (body.ksigma.size() > 0) out.ksigma = T.transpose() * body.ksigma;
  out.axis = in_coordinates(body.axis, T);
  for (FlexibleNode& node : out.nodes) {
    node.phi = Mat3X(node.phi * T);
    node.psi = Mat3X(node.psi * T);
    if (node.sigma.size() > 0) node.sigma = MatX(node.sigma * T);
    for (MatX& h : node.phi2) h = congruent(h);
  }
  return out;
}

}  // namespace

FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V) {
  const GeneralizedEigen eigen(body.Ke, body.Me);
  if (eigen.info() != Eigen::Success) throw SimulationError("the eigenmodes of an elastic body cannot be computed: its mass matrix is not positive definite");
  V = eigen.eigenvectors();
  // A sign that does not depend on the eigensolver: the largest entry positive.
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index at = 0;
    V.col(k).cwiseAbs().maxCoeff(&at);
    if (V(at, k) < 0.0) V.col(k) = -V.col(k);
  }
  FlexibleBody out = in_basis(body, V);
  out.Ke = eigen.eigenvalues().asDiagonal();
  out.stiffness = eigen.eigenvalues();
  out.labels.clear();
  for (Eigen::Index k = 0; k < body.n; ++k)
    out.labels.push_back(fmt::format("eigenmode {} ({:.6g} Hz)", k + 1, std::sqrt(std::max(0.0, eigen.eigenvalues()[k])) / (2.0 * EIGEN_PI)));
  return out;
}

FlexibleBody keep_lowest(const FlexibleBody& body, int count, const std::vector<HeldPoint>& held, MatX& V) {
  std::array<int, 4> have{};
  std::vector<int> kept;
  std::vector<char> left(static_cast<size_t>(body.n), 1);
  for (int k = 0; k < body.n; ++k)
    if (have[static_cast<size_t>(coordinate_direction(body, k))]++ < count) kept.push_back(k), left[static_cast<size_t>(k)] = 0;

  // Static deflections of the modes left out, normalised.
  MatX residual(body.n, 0);
  const auto add = [&](const Eigen::RowVectorXd& unit) {
    VecX r = VecX::Zero(body.n);
    double whole = 0.0;
    for (int k = 0; k < body.n; ++k) {
      const double flexibility = unit[k] / body.stiffness[k];
      whole = std::max(whole, std::abs(flexibility));
      if (left[static_cast<size_t>(k)]) r[k] = flexibility;
    }
    // What the point cannot do (an in-plane beam out of its plane) is rounding.
    if (r.norm() <= 1e-12 * whole || whole == 0.0) return;
    residual.conservativeResize(Eigen::NoChange, residual.cols() + 1);
    residual.col(residual.cols() - 1) = r.normalized();
  };
  for (const HeldPoint& h : held)
    for (const FlexibleNode& node : body.nodes) {
      if (count == 0 || node.name != h.node) continue;
      const double size = std::max(node.phi.cwiseAbs().maxCoeff(), 1e-300), turn = std::max(node.psi.cwiseAbs().maxCoeff(), 1e-300);
      for (int a = 0; a < 3; ++a) {
        if (h.force && node.phi.row(a).cwiseAbs().maxCoeff() > 1e-9 * size) add(node.phi.row(a));
        if (h.moment && node.psi.row(a).cwiseAbs().maxCoeff() > 1e-9 * turn) add(node.psi.row(a));
      }
    }
  // An orthonormal basis of them (the mass matrix is 1), then its own modes.
  MatX T(body.n, static_cast<Eigen::Index>(kept.size()));
  T.setZero();
  for (size_t k = 0; k < kept.size(); ++k) T(kept[k], static_cast<Eigen::Index>(k)) = 1.0;
  if (residual.cols() > 0) {
    const MatX Q = orthonormal_columns(residual, 1e-6);
    const SymmetricEigen eigen(MatX(Q.transpose() * body.stiffness.asDiagonal() * Q));
    T.conservativeResize(Eigen::NoChange, T.cols() + Q.cols());
    T.rightCols(Q.cols()) = Q * eigen.eigenvectors();
  }

  FlexibleBody out = in_basis(body, T);
  out.labels.clear();
  for (int k = 0; k < out.n; ++k) out.labels.push_back(k < static_cast<int>(kept.size()) ? body.labels[static_cast<size_t>(kept[static_cast<size_t>(k)])] : "static deflection of the rest");
  V = MatX(V * T);
  return out;
}

int coordinate_direction(const FlexibleBody& body, int k) {
  double size = 0.0;
  Eigen::Vector4d moved = Eigen::Vector4d::Zero();
  for (const FlexibleNode& node : body.nodes) size = std::max(size, node.origin.norm());
  for (const FlexibleNode& node : body.nodes) {
    for (int a = 0; a < 3; ++a) moved[a] = std::max(moved[a], std::abs(node.phi(a, k)));
    // A twist moves what lies beside the axis only: it counts where nothing else does.
    moved[3] = std::max(moved[3], 1e-3 * size * std::abs(node.psi(0, k)));
  }
  Eigen::Index at = 0;
  moved.maxCoeff(&at);
  return static_cast<int>(at);
}

MatX same_deformation(const FlexibleBody& target, const FlexibleBody& source) {
  const Eigen::Index rows = 6 * static_cast<Eigen::Index>(target.nodes.size());
  double length = 0.0;
  for (const FlexibleNode& node : target.nodes) length = std::max(length, node.origin.norm());
  MatX A(rows, target.n + 6), B(rows, source.n);
  for (size_t i = 0; i < target.nodes.size(); ++i) {
    const Eigen::Index r = 6 * static_cast<Eigen::Index>(i);
    A.block(r, 0, 3, target.n) = target.nodes[i].phi;
    A.block(r + 3, 0, 3, target.n) = length * target.nodes[i].psi;
    A.block(r, target.n, 3, 3).setIdentity();
    A.block(r, target.n + 3, 3, 3) = -skew(target.nodes[i].origin) / length;
    A.block(r + 3, target.n, 3, 3).setZero();
    A.block(r + 3, target.n + 3, 3, 3).setIdentity();
    B.block(r, 0, 3, source.n) = source.nodes[i].phi;
    B.block(r + 3, 0, 3, source.n) = length * source.nodes[i].psi;
  }
  return least_squares(A, B).topRows(target.n);
}

}  // namespace flexframe::sim
