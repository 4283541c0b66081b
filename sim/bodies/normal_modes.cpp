#include "sim/bodies/normal_modes.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/bodies/axis_mass.h"
#include "sim/bodies/rod_axis.h"

#include <fmt/format.h>

#include <algorithm>

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
  out.rod = in_coordinates(body.rod, T);
  // All nodes in one product: three rows at a time take several times as long.
  const auto nodes = static_cast<Eigen::Index>(out.nodes.size());
  MatX motions(6 * nodes, body.n);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    motions.middleRows(6 * i, 3) = body.nodes[static_cast<size_t>(i)].phi;
    motions.middleRows(6 * i + 3, 3) = body.nodes[static_cast<size_t>(i)].psi;
  }
  motions = MatX(motions * T);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    FlexibleNode& node = out.nodes[static_cast<size_t>(i)];
    node.phi = motions.middleRows(6 * i, 3);
    node.psi = motions.middleRows(6 * i + 3, 3);
    if (node.sigma.size() > 0) node.sigma = MatX(node.sigma * T);
    for (MatX& h : node.phi2) h = congruent(h);
    for (MatX& h : node.psi2) h = congruent(h);
  }
  return out;
}

}  // namespace

FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V) {
  const GeneralizedEigen eigen(body.Ke, body.Me);
  if (eigen.info() != Eigen::Success)
    throw SimulationError("the eigenmodes of an elastic body cannot be computed: its mass matrix is not positive definite");
  const VecX& stiffness = eigen.eigenvalues();
  V = eigen.eigenvectors();
  // A sign that does not depend on the eigensolver: the largest entry positive.
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index at = 0;
    V.col(k).cwiseAbs().maxCoeff(&at);
    if (V(at, k) < 0.0) V.col(k) = -V.col(k);
  }
  FlexibleBody out = in_basis(body, V);
  out.Ke = stiffness.asDiagonal();
  out.stiffness = stiffness;
  out.labels.clear();
  for (Eigen::Index k = 0; k < body.n; ++k)
    out.labels.push_back(fmt::format("eigenmode {} ({:.6g} Hz)", k + 1, std::sqrt(std::max(0.0, stiffness[k])) / (2.0 * EIGEN_PI)));
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
