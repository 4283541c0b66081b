#include "sim/normal_modes.h"

#include "sim/spatial.h"

#include <fmt/format.h>

namespace flexframe::sim {

FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(body.Ke, body.Me);
  if (eigen.info() != Eigen::Success) throw SimulationError("the eigenmodes of an elastic body cannot be computed: its mass matrix is not positive definite");
  V = eigen.eigenvectors();
  // A sign that does not depend on the eigensolver: the largest entry positive.
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index at = 0;
    V.col(k).cwiseAbs().maxCoeff(&at);
    if (V(at, k) < 0.0) V.col(k) = -V.col(k);
  }
  const auto congruent = [&](const MatX& A) { return A.size() == 0 ? MatX() : MatX(V.transpose() * A * V); };
  FlexibleBody out = body;
  out.md1 = body.md1 * V;
  out.J1 = body.J1 * V;
  out.Cr0 = body.Cr0 * V;
  for (size_t a = 0; a < 3; ++a) {
    out.md2[a] = congruent(body.md2[a]);
    out.Cr1[a] = congruent(body.Cr1[a]);
  }
  for (size_t a = 0; a < 6; ++a) out.J2[a] = congruent(body.J2[a]);
  out.Me = MatX::Identity(body.n, body.n);
  out.Ke = eigen.eigenvalues().asDiagonal();
  out.stiffness = eigen.eigenvalues();
  out.De = congruent(body.De);
  if (body.ksigma.size() > 0) out.ksigma = V.transpose() * body.ksigma;
  out.labels.clear();
  for (Eigen::Index k = 0; k < body.n; ++k)
    out.labels.push_back(fmt::format("eigenmode {} ({:.6g} Hz)", k + 1, std::sqrt(std::max(0.0, eigen.eigenvalues()[k])) / (2.0 * EIGEN_PI)));
  for (FlexibleNode& node : out.nodes) {
    node.phi = Mat3X(node.phi * V);
    node.psi = Mat3X(node.psi * V);
    if (node.sigma.size() > 0) node.sigma = MatX(node.sigma * V);
    for (MatX& h : node.phi2) h = congruent(h);
  }
  return out;
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
  return A.completeOrthogonalDecomposition().solve(B).topRows(target.n);
}

}  // namespace flexframe::sim
