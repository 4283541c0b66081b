#include "interp/patch.h"

#include "interp/dense_solvers.h"
#include "interp/watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::interp {
namespace {

double kernel_value(KernelType kernel, double r2) {
  switch (kernel) {
    case KernelType::cubic:
      return r2 * std::sqrt(r2);
    case KernelType::linear:
      return std::sqrt(r2);
    case KernelType::thin_plate:
      return r2 > 0.0 ? 0.5 * r2 * std::log(r2) : 0.0;
  }
  return 0.0;
}

// Derivative by r divided by r: the gradient is this times (x - c).
double kernel_slope(KernelType kernel, double r2) {
  switch (kernel) {
    case KernelType::cubic:
      return 3.0 * std::sqrt(r2);
    case KernelType::linear:
      return r2 > 0.0 ? 1.0 / std::sqrt(r2) : 0.0;
    case KernelType::thin_plate:
      return r2 > 0.0 ? std::log(r2) + 1.0 : 0.0;
  }
  return 0.0;
}

// Kernel and polynomial values at scaled coordinates.
void basis(const Patch& patch, const Vec3& y, Eigen::VectorXd& out) {
  const Eigen::Index k = patch.y.cols();
  out.resize(k + 1 + patch.directions);
  for (Eigen::Index i = 0; i < k; ++i) out[i] = (patch.y.col(i) - y).squaredNorm();
  if (patch.repair == Repair::local_residual) {
    // Inverse distance weights 1 / r^4 (Shepard 1968): positive, of sum one, whatever the nodes' spacing.
    const double nearest2 = out.head(k).minCoeff();
    out.head(k) = nearest2 > 0.0 ? Eigen::VectorXd((nearest2 / out.head(k).array()).square())
                                 : Eigen::VectorXd((out.head(k).array() == 0.0).cast<double>());
    out.head(k) /= out.head(k).sum();
  } else {
    for (Eigen::Index i = 0; i < k; ++i) out[i] = kernel_value(patch.kernel, out[i]);
  }
  out[k] = 1.0;
  for (int d = 0; d < patch.directions; ++d) out[k + 1 + d] = y[d];
}

Vec3 coordinates(const Patch& patch, const Vec3& x) {
  Vec3 y = patch.frame.transpose() * (x - patch.origin) / patch.scale;
  if (patch.flat)
    for (int d = patch.directions; d < 3; ++d) y[d] = 0.0;
  return y;
}

}  // namespace

Patch make_patch(const Points& nodes, std::span<const int> chosen, const Points& vertices, std::span<const int> evaluated,
                 const PatchKind& kind) {
  Patch patch;
  const Repair repair = kind.repair;
  patch.node.assign(chosen.begin(), chosen.end());
  patch.kernel = kind.kernel;
  patch.repair = repair;
  const auto k = static_cast<Eigen::Index>(chosen.size());
  for (const int i : chosen) patch.origin += nodes.row(i).transpose();
  patch.origin /= static_cast<double>(k);

  // Principal directions of the nodes, largest first; extents of nodes and vertices along them.
  Eigen::Matrix3Xd local(3, k);
  for (Eigen::Index i = 0; i < k; ++i) local.col(i) = nodes.row(chosen[i]).transpose() - patch.origin;
  const PrincipalAxes principal = principal_axes(local * local.transpose());
  patch.frame = principal.axes.rowwise().reverse();
  if (patch.frame.determinant() < 0.0) patch.frame.col(2) = -patch.frame.col(2);
  const Eigen::Matrix3Xd along = patch.frame.transpose() * local;
  const Vec3 node_extent = along.rowwise().maxCoeff() - along.rowwise().minCoeff();
  Vec3 lower = along.rowwise().minCoeff(), upper = along.rowwise().maxCoeff();
  for (const int v : evaluated) {
    const Vec3 x = patch.frame.transpose() * (vertices.row(v).transpose() - patch.origin);
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
  }
  const Vec3 extent = upper - lower;
  patch.scale = 0.5 * node_extent[0];
  patch.directions = 0;
  const double least = repair == Repair::none ? 1e-3 : 0.2;
  for (int d = 0; d < 3; ++d)
    if (patch.directions == d && k > d + 1 && node_extent[d] > least * node_extent[0] && node_extent[d] >= extent[d] / 3.0)
      ++patch.directions;
  if (kind.sheet) patch.directions = std::min(patch.directions, 2);
  // Nodes that extend in one direction always span it: a line is better than a point.
  if (patch.directions == 0 && k > 1 && node_extent[0] > 0.0) patch.directions = 1;
  if (!(patch.scale > 0.0)) patch.scale = 1.0;

  patch.y = along / patch.scale;
  // Nodes above each other along a dropped direction must stay apart for the kernel: then distances count it.
  if (patch.directions < 3 && k > 1) {
    double nearest2 = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < k; ++i)
      for (Eigen::Index j = 0; j < i; ++j)
        nearest2 = std::min(nearest2, (patch.y.col(i) - patch.y.col(j)).head(patch.directions).squaredNorm());
    const double spacing = std::pow(static_cast<double>(k), -1.0 / patch.directions);
    patch.flat = nearest2 > 1e-4 * spacing * spacing;
  }
  if (patch.flat) patch.y.bottomRows(3 - patch.directions).setZero();
  patch.off.resize(3, k);
  const auto dropped = patch.frame.rightCols(3 - patch.directions);
  patch.off = dropped * (dropped.transpose() * local);
  if (patch.directions < 3) {
    for (const int v : evaluated) {
      look();
      const Vec3 x = vertices.row(v).transpose() - patch.origin;
      const Vec3 beside = dropped * (dropped.transpose() * x);
      for (Eigen::Index i = 0; i < k; ++i) patch.arm = std::max(patch.arm, (beside - patch.off.col(i)).norm());
    }
    // Rounding of coplanar input is no arm.
    if (patch.arm < 1e-9 * patch.scale) patch.arm = 0.0;
  }

  const Eigen::Index p = 1 + patch.directions;
  if (repair == Repair::local_residual) {
    // Affine part by least squares, its residual by inverse distances: the weights stay bounded however the nodes cluster.
    Eigen::MatrixXd poly(k, p);
    Eigen::VectorXd row;
    for (Eigen::Index i = 0; i < k; ++i) {
      basis(patch, patch.y.col(i), row);
      poly.row(i) = row.tail(p).transpose();
    }
    const Eigen::MatrixXd fit = pseudo_inverse(poly);  // p x k
    patch.inverse.resize(k, k + p);
    patch.inverse.leftCols(k) = (Eigen::MatrixXd::Identity(k, k) - poly * fit).transpose();
    patch.inverse.rightCols(p) = fit.transpose();
    patch.inverse_diagonal = Eigen::VectorXd::Constant(k, std::numeric_limits<double>::quiet_NaN());
    return patch;
  }
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(k + p, k + p);
  Eigen::VectorXd row;
  for (Eigen::Index i = 0; i < k; ++i) {
    basis(patch, patch.y.col(i), row);
    a.row(i) = row.transpose();
    a.block(k, i, p, 1) = row.tail(p);
  }
  Eigen::MatrixXd inverse = k > 64 ? inverse_by_row_pivots(a) : inverse_by_full_pivots(a);
  // One Newton step brings the reproduction of rigid motion down to rounding.
  inverse += inverse * (Eigen::MatrixXd::Identity(k + p, k + p) - a * inverse);
  patch.inverse = inverse.topRows(k);
  patch.inverse_diagonal = inverse.diagonal().head(k);
  return patch;
}

void patch_weights(const Patch& patch, const Vec3& x, Eigen::VectorXd& scratch, Eigen::Ref<Eigen::VectorXd> weights) {
  basis(patch, coordinates(patch, x), scratch);
  weights.noalias() = patch.inverse * scratch;
}

Eigen::MatrixXd patch_gradient(const Patch& patch, const Vec3& x) {
  const Vec3 y = coordinates(patch, x);
  const Eigen::Index k = patch.y.cols();
  Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(k + 1 + patch.directions, patch.directions);
  for (Eigen::Index i = 0; i < k; ++i) {
    const Vec3 d = y - patch.y.col(i);
    const double r2 = d.squaredNorm();
    // The residual of inverse distances is flat at the nodes, where gradients are asked.
    const double factor = patch.repair == Repair::local_residual ? 0.0 : kernel_slope(patch.kernel, r2);
    slope.row(i) = factor * d.head(patch.directions).transpose();
  }
  for (int d = 0; d < patch.directions; ++d) slope(k + 1 + d, d) = 1.0;
  return (patch.inverse * slope).transpose() / patch.scale;
}

}  // namespace flexframe::interp
