#include "sim/bodies/state_space.h"

#include "sim/base/eigen_solvers.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// Numbers of a scene file carry some six digits.
constexpr double agreement = 1e-6;

[[noreturn]] void refuse_ports() {
  throw InputError(
      "sigma and theta do not match: the work of a force on a port is that force times the port's motion, so theta must be the transpose "
      "of sigma, up to a positive factor for every mode of omega");
}

// Symmetric positive M with M sigma = theta^T among the eigenvectors X of omega: block by block of equal eigenvalues.
MatX modal_mass(const StateSpaceDef& def) {
  const Eigen::Index n = def.omega.rows();
  const double size = std::max(def.omega.cwiseAbs().maxCoeff(), 1e-300);
  const double sigma_size = def.sigma.cwiseAbs().maxCoeff(), theta_size = def.theta.cwiseAbs().maxCoeff();
  const bool symmetric = (def.omega - def.omega.transpose()).cwiseAbs().maxCoeff() <= agreement * size;
  if (symmetric && (def.sigma.transpose() - def.theta).cwiseAbs().maxCoeff() <= agreement * std::max(sigma_size, theta_size))
    return MatX::Identity(n, n);

  const ComplexEigen eigen(def.omega);
  if (eigen.info() != Eigen::Success || eigen.eigenvalues().imag().cwiseAbs().maxCoeff() > agreement * size)
    throw InputError("omega has complex eigenvalues; the squares of natural frequencies are real");
  const MatX X = eigen.eigenvectors().real();
  const Eigen::PartialPivLU<MatX> lu(X);
  const MatX sigma = lu.solve(def.sigma), theta = def.theta * X;
  std::vector<Eigen::Index> order(n);
  for (Eigen::Index i = 0; i < n; ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index a, Eigen::Index b) { return eigen.eigenvalues()[a].real() < eigen.eigenvalues()[b].real(); });
  MatX M = MatX::Zero(n, n);
  for (size_t from = 0; from < order.size();) {
    size_t to = from + 1;
    while (to < order.size() && eigen.eigenvalues()[order[to]].real() - eigen.eigenvalues()[order[from]].real() <= agreement * size) ++to;
    const Eigen::Index k = static_cast<Eigen::Index>(to - from);
    MatX s(k, sigma.cols()), t(k, sigma.cols());
    for (Eigen::Index i = 0; i < k; ++i) {
      s.row(i) = sigma.row(order[from + i]);
      t.row(i) = theta.col(order[from + i]).transpose();
    }
    // Modes that no port moves or sees may have any mass.
    MatX block = MatX::Identity(k, k);
    if (s.norm() > 0.0 || t.norm() > 0.0) {
      block = least_squares(s.transpose(), MatX(t.transpose())).transpose();
      block = (0.5 * (block + block.transpose())).eval();
      if ((block * s - t).norm() > 10.0 * agreement * t.norm()) refuse_ports();
      const SymmetricEigen parts(block);
      const double top = parts.eigenvalues().cwiseAbs().maxCoeff();
      if (parts.eigenvalues().minCoeff() < -agreement * top || top == 0.0) refuse_ports();
      // directions of equal frequency that no port reaches
      const VecX held = parts.eigenvalues().array().max(0.0).matrix();
      block = parts.eigenvectors() * (held.array() > agreement * top).select(held, top).asDiagonal() * parts.eigenvectors().transpose();
    }
    for (Eigen::Index i = 0; i < k; ++i)
      for (Eigen::Index j = 0; j < k; ++j) M(order[from + i], order[from + j]) = block(i, j);
    from = to;
  }
  const MatX inverse = lu.inverse();
  return inverse.transpose() * M * inverse;
}

}  // namespace

FlexibleBody make_state_space_body(const StateSpaceDef& def, const FlexibleBody& carrier) {
  FlexibleBody body = carrier;
  const int n = static_cast<int>(def.omega.rows());
  body.n = n;
  body.md1 = Mat3X::Zero(3, n);
  body.J1 = Mat6X::Zero(6, n);
  body.Cr0 = Mat3X::Zero(3, n);
  body.Me = modal_mass(def);
  const auto symmetric = [](const MatX& A) { return MatX(0.5 * (A + A.transpose())); };
  body.Ke = symmetric(body.Me * def.omega);
  // the skew part of damping is gyroscopic and does no work; it stays
  body.De = 2.0 * body.Me * def.gamma;
  if (body.De.cwiseAbs().maxCoeff() == 0.0) body.De.resize(0, 0);
  const double lowest = GeneralizedEigen(body.Ke, body.Me).eigenvalues().minCoeff();
  if (lowest < -agreement * std::max(def.omega.cwiseAbs().maxCoeff(), 1e-300))
    throw InputError(
        fmt::format("omega has the negative eigenvalue {:.6g} 1/s^2: the body is unstable, its deformation would grow by itself", lowest));
  const Eigen::Index per_port = def.theta.rows() / static_cast<Eigen::Index>(def.ports.size());
  for (const auto& [name, position] : def.rigid.frames) {
    FlexibleNode node;
    node.name = name;
    node.origin = position;
    node.phi = Mat3X::Zero(3, n);
    node.psi = Mat3X::Zero(3, n);
    const auto port = std::find(def.ports.begin(), def.ports.end(), name);
    if (port != def.ports.end()) {
      const Eigen::Index row = per_port * (port - def.ports.begin());
      node.phi = def.theta.middleRows(row, 3);
      if (per_port == 6) node.psi = def.theta.middleRows(row + 3, 3);
    }
    body.nodes.push_back(std::move(node));
  }
  for (int k = 0; k < n; ++k) body.labels.push_back(fmt::format("eta {}", k + 1));
  return body;
}

}  // namespace flexframe::sim
