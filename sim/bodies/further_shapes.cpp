#include "sim/bodies/further_shapes.h"

#include <cmath>

namespace flexframe::sim {
namespace {

bool same(const Eigen::Ref<const MatX>& a, const Eigen::Ref<const MatX>& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && (a.array() == b.array()).all();
}

// [A B], of zeros where there are none.
template <class Matrix>
void append(Matrix& A, const Eigen::Ref<const MatX>& B, Eigen::Index n) {
  const Eigen::Index before = A.cols();
  A.conservativeResize(B.rows(), n + B.cols());
  if (before < n) A.middleCols(before, n - before).setZero();
  A.rightCols(B.cols()) = B;
}

// A with zeros on the right and below.
void enlarge(MatX& A, Eigen::Index size) {
  if (A.size() == 0) return;
  const Eigen::Index before = A.rows();
  MatX out = MatX::Zero(size, size);
  out.topLeftCorner(before, before) = A;
  A = std::move(out);
}

}  // namespace

bool FurtherShapes::operator==(const FurtherShapes& other) const {
  return same(stiffness, other.stiffness) && same(coupling, other.coupling) && same(md, other.md) && same(Cr, other.Cr) &&
         same(J, other.J) && same(motion, other.motion);
}

bool is_sound(const FurtherShapes& shapes, Eigen::Index coordinates, Eigen::Index nodes) {
  const Eigen::Index m = shapes.count();
  const auto fits = [m](const Eigen::Ref<const MatX>& A, Eigen::Index rows) { return A.rows() == rows && A.cols() == m && A.allFinite(); };
  return fits(shapes.stiffness.transpose(), 1) && (shapes.stiffness.array() > 0.0).all() && fits(shapes.coupling, coordinates) &&
         fits(shapes.md, 3) && fits(shapes.Cr, 3) && fits(shapes.J, 6) && fits(shapes.motion, 6 * nodes);
}

FurtherShapes some_of(const FurtherShapes& all, const std::vector<int>& which) {
  FurtherShapes out;
  out.stiffness = all.stiffness(which);
  out.coupling = all.coupling(Eigen::all, which);
  out.md = all.md(Eigen::all, which);
  out.Cr = all.Cr(Eigen::all, which);
  out.J = all.J(Eigen::all, which);
  out.motion = all.motion(Eigen::all, which);
  return out;
}

void add_shapes(const FurtherShapes& shapes, FlexibleBody& body) {
  const Eigen::Index n = body.n, m = shapes.count(), all = n + m;
  const double ratio = body.De.size() > 0 && n > 0 && body.Ke(n - 1, n - 1) > 0.0 && body.Me(n - 1, n - 1) > 0.0
                           ? 0.5 * body.De(n - 1, n - 1) / std::sqrt(body.Ke(n - 1, n - 1) * body.Me(n - 1, n - 1))
                           : 0.0;
  append(body.md1, shapes.md, n);
  append(body.Cr0, shapes.Cr, n);
  append(body.J1, shapes.J, n);
  for (MatX& A : body.md2) enlarge(A, all);
  for (MatX& A : body.J2) enlarge(A, all);
  for (MatX& A : body.Cr1) enlarge(A, all);
  enlarge(body.De, all);
  if (body.De.size() > 0) body.De.diagonal().tail(m) = 2.0 * ratio * shapes.stiffness.cwiseSqrt();
  enlarge(body.Me, all);
  enlarge(body.Ke, all);
  body.Me.topRightCorner(n, m) = shapes.coupling;
  body.Me.bottomLeftCorner(m, n) = shapes.coupling.transpose();
  body.Me.bottomRightCorner(m, m).setIdentity();
  body.Ke.diagonal().tail(m) = shapes.stiffness;
  body.stiffness.resize(0);  // masses in common: no eigenmodes
  if (body.ksigma.size() > 0) {
    body.ksigma.conservativeResize(all);
    body.ksigma.tail(m).setZero();
  }
  if (!body.labels.empty()) body.labels.resize(static_cast<size_t>(all));
  for (size_t i = 0; i < body.nodes.size(); ++i) {
    FlexibleNode& node = body.nodes[i];
    append(node.phi, shapes.motion.middleRows(6 * static_cast<Eigen::Index>(i), 3), n);
    append(node.psi, shapes.motion.middleRows(6 * static_cast<Eigen::Index>(i) + 3, 3), n);
    for (MatX& A : node.phi2) enlarge(A, all);
    for (MatX& A : node.psi2) enlarge(A, all);
    if (node.sigma.size() > 0) {
      node.sigma.conservativeResize(Eigen::NoChange, all);
      node.sigma.rightCols(m).setZero();
    }
  }
  body.n = static_cast<int>(all);
}

}  // namespace flexframe::sim
