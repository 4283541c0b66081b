#include "sim/bodies/plane_body.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

double largest(const MatX& A) { return A.size() == 0 ? 0.0 : A.cwiseAbs().maxCoeff(); }
// 1e-12: rounding of the axes that the scene gives.
bool small(const MatX& A, double scale) { return largest(A) <= 1e-12 * scale; }

// The rod's axes in the planar ones.
Eigen::Matrix2d rod_axes(const Mat3& Q, int towards) {
  Eigen::Matrix2d out;
  out << Q(0, 0), Q(towards, 0), Q(0, 1), Q(towards, 1);
  return out;
}

// Component a (in the axes Q) of a vector-valued quadratic form; empty where it vanishes.
MatX component(const std::array<MatX, 3>& forms, const Mat3& Q, int a, Eigen::Index n) {
  MatX out;
  for (int k = 0; k < 3; ++k) {
    if (forms[k].size() == 0 || Q(k, a) == 0.0) continue;
    if (out.size() == 0) out = MatX::Zero(n, n);
    out += Q(k, a) * forms[k];
  }
  return out;
}

}  // namespace

PlaneBody in_plane(const FlexibleBody& body, const Mat3& Q) {
  PlaneBody b;
  b.n = body.n;
  b.mass = body.mass;
  b.md0 = (Q.transpose() * body.md0).head<2>();
  const Vec3 n = Q.col(2);
  // Tensor elements xx yy zz xy xz yz in n . J n.
  Vec6 weight;
  weight << n.x() * n.x(), n.y() * n.y(), n.z() * n.z(), 2.0 * n.x() * n.y(), 2.0 * n.x() * n.z(), 2.0 * n.y() * n.z();
  b.J0[0] = weight.dot(body.J0);
  if (b.n == 0) return b;
  b.md1 = (Q.transpose() * body.md1).topRows<2>().transpose();
  b.J1 = body.J1.transpose() * weight;
  b.Cr0 = body.Cr0.transpose() * n;
  b.md2 = {component(body.md2, Q, 0, b.n), component(body.md2, Q, 1, b.n)};
  b.Cr1 = {component(body.Cr1, Q, 2, b.n)};
  if (b.Cr1[0].size() > 0) {
    b.Cr1_difference = b.Cr1[0] - b.Cr1[0].transpose();
    if (small(b.Cr1_difference, largest(b.Cr1[0]))) b.Cr1_difference.resize(0, 0);
  }
  for (int s = 0; s < 6; ++s) {
    if (body.J2[s].size() == 0 || weight[s] == 0.0) continue;
    if (b.J2[0].size() == 0) b.J2[0] = MatX::Zero(b.n, b.n);
    b.J2[0] += weight[s] * body.J2[s];
  }
  b.Me = body.Me;
  b.Ke = body.Ke;
  b.De = body.De;
  b.stiffness = body.stiffness;
  b.ksigma = body.ksigma;
  if (body.rod) {
    b.rod = body.rod;
    b.rod_axes = rod_axes(Q, body.rod->towards);
    b.rod_sense = b.rod_axes.determinant() < 0.0 ? -1.0 : 1.0;
    b.rod_J0 = weight.dot(body.rod->J0);
    b.rod_Cr0 = body.rod->Cr0.transpose() * n;
  }
  return b;
}

PlaneNode in_plane(const FlexibleNode& node, const Mat3& Q, const Mat3& node_axes, int towards) {
  const Mat3 R = Q.transpose() * node.rotation * node_axes;
  PlaneNode out;
  out.origin = (Q.transpose() * node.origin).head<2>();
  out.angle = std::atan2(R(1, 0), R(0, 0));
  out.phi = (Q.transpose() * node.phi).topRows<2>().transpose();
  out.psi = (Q.transpose() * node.psi).row(2).transpose();
  for (int a = 0; a < 2; ++a) out.phi2[a] = component(node.phi2, Q, a, node.phi.cols());
  out.along = node.along;
  if (node.along.size() > 0) out.rod_axes = rod_axes(Q, towards);
  return out;
}

bool leaves_plane(const FlexibleNode& node, const Mat3& Q) {
  const Eigen::Index n = node.phi.cols();
  const MatX phi = Q.transpose() * node.phi, psi = Q.transpose() * node.psi;
  if (!small(phi.row(2), largest(phi)) || !small(psi.topRows<2>(), largest(psi))) return true;
  // Second order of its rotation is not followed in the plane: there is none where beams bend alone, in rings there is.
  constexpr double solved = 1e-5;  // reductions solve for it to a tenth of that
  for (int a = 0; a < 3; ++a)
    if (largest(component(node.psi2, Q, a, n)) > solved * std::pow(largest(psi), 2)) return true;
  return !small(component(node.phi2, Q, 2, n), std::max(largest(component(node.phi2, Q, 0, n)), largest(component(node.phi2, Q, 1, n))));
}

}  // namespace flexframe::sim
