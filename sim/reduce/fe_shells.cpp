// Flat shell elements. See fe_elements.h. A warped quadrangle is flat in its mean plane, beside which its nodes lie.
#include "sim/base/spatial.h"
#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

namespace flexframe::sim {
namespace {

using Vec2 = Eigen::Vector2d;

void quadrangle_functions(const Vec2& q, Eigen::Vector4d& N, Eigen::Matrix<double, 4, 2>& dN) {
  static constexpr double sx[4] = {-1, 1, 1, -1}, sy[4] = {-1, -1, 1, 1};
  for (Eigen::Index i = 0; i < 4; ++i) {
    N(i) = (1 + sx[i] * q.x()) * (1 + sy[i] * q.y()) / 4;
    dN.row(i) << sx[i] * (1 + sy[i] * q.y()) / 4, sy[i] * (1 + sx[i] * q.x()) / 4;
  }
}

// Local motions per node: u v w rx ry rz. x: n x 2 in the plane.
void add_drilling(const MatX& dN, const VecX& N, double weight, MatX& K) {
  const Eigen::Index n = dN.rows();
  VecX b = VecX::Zero(6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    b(6 * i) = 0.5 * dN(i, 1);
    b(6 * i + 1) = -0.5 * dN(i, 0);
    b(6 * i + 5) = N(i);
  }
  K += weight * b * b.transpose();
}

// Strains of a quadrangle at a point from its 24 motions: membrane, curvature (strain is height times it), and the incompatible modes' four
// amplitudes.
struct QuadranglePoint {
  Eigen::Vector4d N;
  MatX D, Bm, Bb, Bi;
  Eigen::Matrix2d inverse;  // d(xi, eta) / d(x, y)
  double area = 0.0;
};

QuadranglePoint quadrangle_point(const Eigen::Matrix<double, 4, 2>& x, const Vec2& q, int id) {
  QuadranglePoint p;
  Eigen::Matrix<double, 4, 2> dN;
  quadrangle_functions({0, 0}, p.N, dN);
  const Eigen::Matrix2d J0 = x.transpose() * dN;
  const Eigen::Matrix2d inverse0 = J0.inverse();
  quadrangle_functions(q, p.N, dN);
  const Eigen::Matrix2d J = x.transpose() * dN;  // d(x, y) / d(xi, eta)
  p.area = J.determinant();
  if (!(p.area > 0.0)) throw InputError(fmt::format("element {} (4-node shell) is too distorted: its Jacobian is not positive", id));
  p.inverse = J.inverse();
  p.D = dN * p.inverse;
  p.Bm = p.Bb = MatX::Zero(3, 24);
  p.Bi = MatX::Zero(3, 4);
  for (Eigen::Index i = 0; i < 4; ++i) {
    p.Bm(0, 6 * i) = p.Bm(2, 6 * i + 1) = p.D(i, 0);
    p.Bm(1, 6 * i + 1) = p.Bm(2, 6 * i) = p.D(i, 1);
    p.Bb(0, 6 * i + 4) = p.D(i, 0);
    p.Bb(1, 6 * i + 3) = -p.D(i, 1);
    p.Bb(2, 6 * i + 4) = p.D(i, 1);
    p.Bb(2, 6 * i + 3) = -p.D(i, 0);
  }
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Eigen::RowVector2d e = -2.0 * q(k) * inverse0.row(k) * (J0.determinant() / p.area);
    p.Bi(0, 2 * k) = p.Bi(2, 2 * k + 1) = e(0);
    p.Bi(1, 2 * k + 1) = p.Bi(2, 2 * k) = e(1);
  }
  return p;
}

constexpr double gauss = 0.57735026918962576451;
const std::array<Vec2, 4>& quadrangle_rule() {
  static const std::array<Vec2, 4> points{Vec2(-gauss, -gauss), Vec2(gauss, -gauss), Vec2(gauss, gauss), Vec2(-gauss, gauss)};
  return points;
}

void quadrangle(const Eigen::Matrix<double, 4, 2>& x, const FeShellLaw& law, int id, MatX& K) {
  Eigen::Vector4d N;
  Eigen::Matrix<double, 4, 2> dN;
  // Covariant shear strain along direction k at the middles of the edges, gamma_k = w,k + beta . x,k with beta = (ry, -rx).
  const auto covariant = [&](const Vec2& q, int k) {
    quadrangle_functions(q, N, dN);
    const Eigen::Matrix2d J = x.transpose() * dN;
    Eigen::RowVectorXd b = Eigen::RowVectorXd::Zero(24);
    for (Eigen::Index i = 0; i < 4; ++i) {
      b(6 * i + 2) = dN(i, k);
      b(6 * i + 4) = N(i) * J(0, k);
      b(6 * i + 3) = -N(i) * J(1, k);
    }
    return b;
  };
  const Eigen::RowVectorXd a = covariant({0, -1}, 0), c = covariant({0, 1}, 0), d = covariant({-1, 0}, 1), b = covariant({1, 0}, 1);

  MatX coupling = MatX::Zero(4, 24);
  Eigen::Matrix4d inner = Eigen::Matrix4d::Zero();
  const double held = drilling_share(law, 4.0 * quadrangle_point(x, {0, 0}, id).area) * law.twist;
  for (const Vec2& q : quadrangle_rule()) {
    const QuadranglePoint p = quadrangle_point(x, q, id);
    MatX Bs(2, 24);
    Bs.row(0) = 0.5 * ((1 - q.y()) * a + (1 + q.y()) * c);
    Bs.row(1) = 0.5 * ((1 - q.x()) * d + (1 + q.x()) * b);
    const MatX shear = p.inverse.transpose() * Bs;
    K += p.area * (p.Bm.transpose() * law.A * p.Bm + p.Bb.transpose() * law.D * p.Bb + shear.transpose() * law.S * shear);
    const MatX mixed = p.area * p.Bm.transpose() * law.B * p.Bb;
    K += mixed + mixed.transpose();
    coupling += p.area * p.Bi.transpose() * (law.A * p.Bm + law.B * p.Bb);
    inner += p.area * p.Bi.transpose() * law.A * p.Bi;
    add_drilling(p.D, p.N, held * p.area, K);
  }
  K -= coupling.transpose() * inner.ldlt().solve(coupling);
}

// Stress xx yy xy at the corners on a face, 3 x 4. u: 24 local motions.
MatX quadrangle_stress(const Eigen::Matrix<double, 4, 2>& x, const FeShellLaw& law, const FeFace& face, const VecX& u, int id) {
  MatX coupling = MatX::Zero(4, 24), at_points(3, 4);
  Eigen::Matrix4d inner = Eigen::Matrix4d::Zero();
  std::vector<QuadranglePoint> points;
  for (const Vec2& q : quadrangle_rule()) {
    const QuadranglePoint& p = points.emplace_back(quadrangle_point(x, q, id));
    coupling += p.area * p.Bi.transpose() * (law.A * p.Bm + law.B * p.Bb);
    inner += p.area * p.Bi.transpose() * law.A * p.Bi;
  }
  const Eigen::Vector4d amplitude = -inner.ldlt().solve(coupling * u);
  for (Eigen::Index k = 0; k < 4; ++k)
    at_points.col(k) = face.membrane * (points[k].Bm * u + points[k].Bi * amplitude) + face.bending * (points[k].Bb * u);
  // The Gauss points are the corners of a smaller parent element.
  MatX out(3, 4);
  for (Eigen::Index i = 0; i < 4; ++i) {
    Eigen::Vector4d N;
    Eigen::Matrix<double, 4, 2> dN;
    quadrangle_functions(quadrangle_rule()[i] / (gauss * gauss), N, dN);
    out.col(i) = at_points * N;
  }
  return out;
}

// Discrete Kirchhoff-Mindlin triangle (I. Katili, IJNME 36 (1993)) on w, rx, ry per node: rotations are linear and have a quadratic part
// along each side, of the size that a beam along it has, with the share of its shear; without shear Batoz' Kirchhoff triangle (1980).
class BentTriangle {
 public:
  BentTriangle(const Eigen::Matrix<double, 3, 2>& p, const MatX& gradients, const FeShellLaw& law) : D(gradients) {
    const Mat3 bending = law.B.isZero(0.0) ? law.D : Mat3(law.D - law.B * law.A.inverse() * law.B);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Index i = k, j = (k + 1) % 3;
      const Vec2 side = (p.row(j) - p.row(i)).transpose();
      const double L = side.norm();
      along.col(k) = side / L;
      const double c = along(0, k), s = along(1, k);
      const Vec3 bent(c * c, s * s, 2 * c * s);
      const double held = along.col(k).dot(law.S * along.col(k));
      share(k) = held > 0.0 ? std::max(12.0 * bent.dot(bending * bent) / (held * L * L), 0.0) : 0.0;
      extra.row(k).setZero();
      extra(k, 3 * j) = 1.0;
      extra(k, 3 * i) = -1.0;
      for (const Eigen::Index n : {i, j}) {
        extra(k, 3 * n + 1) = -0.5 * L * s;
        extra(k, 3 * n + 2) = 0.5 * L * c;
      }
      extra.row(k) *= -1.5 / (L * (1.0 + share(k)));
    }
  }

  // xx yy xy at the place of the area coordinates N.
  MatX curvature(const Vec3& N) const {
    MatX B = MatX::Zero(3, 9);
    for (Eigen::Index i = 0; i < 3; ++i) {
      B(0, 3 * i + 2) = D(i, 0);
      B(1, 3 * i + 1) = -D(i, 1);
      B(2, 3 * i + 2) = D(i, 1);
      B(2, 3 * i + 1) = -D(i, 0);
    }
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Index i = k, j = (k + 1) % 3;
      const Eigen::RowVector2d slope = 4.0 * (N(i) * D.row(j) + N(j) * D.row(i));
      const double c = along(0, k), s = along(1, k);
      B += Vec3(slope(0) * c, slope(1) * s, slope(1) * c + slope(0) * s) * extra.row(k);
    }
    return B;
  }

  // xz yz there: along the sides what their beams have, between them linear from corner to corner.
  MatX shear(const Vec3& N) const {
    MatX B = MatX::Zero(2, 9);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Eigen::Index before = (i + 2) % 3;
      Eigen::Matrix2d sides;
      sides << along.col(i).transpose(), along.col(before).transpose();
      MatX own(2, 9);
      own.row(0) = -2.0 / 3.0 * share(i) * extra.row(i);
      own.row(1) = -2.0 / 3.0 * share(before) * extra.row(before);
      B += N(i) * sides.inverse() * own;
    }
    return B;
  }

 private:
  MatX D;                             // gradients of the area coordinates, 3 x 2
  Eigen::Matrix<double, 2, 3> along;  // of the side from corner k to the next
  Vec3 share;                         // 12 D / (S L^2) of each side
  Eigen::Matrix<double, 3, 9> extra;  // the quadratic part in the middle of each side
};

MatX triangle_gradients(const Eigen::Matrix<double, 3, 2>& p, double& twice_area) {
  Eigen::Matrix2d J;
  J << p(1, 0) - p(0, 0), p(2, 0) - p(0, 0), p(1, 1) - p(0, 1), p(2, 1) - p(0, 1);
  twice_area = J.determinant();
  MatX parent(3, 2);
  parent << -1, -1, 1, 0, 0, 1;
  return parent * J.inverse();
}

void triangle(const Eigen::Matrix<double, 3, 2>& p, const FeShellLaw& law, MatX& K) {
  double twice_area = 0.0;
  const MatX D = triangle_gradients(p, twice_area);
  const BentTriangle bent(p, D, law);
  MatX Bm = MatX::Zero(3, 18);
  for (Eigen::Index i = 0; i < 3; ++i) {
    Bm(0, 6 * i) = Bm(2, 6 * i + 1) = D(i, 0);
    Bm(1, 6 * i + 1) = Bm(2, 6 * i) = D(i, 1);
  }
  K += 0.5 * twice_area * Bm.transpose() * law.A * Bm;
  const auto spread = [](const MatX& B9) {
    MatX B = MatX::Zero(B9.rows(), 18);
    for (Eigen::Index i = 0; i < 3; ++i)
      for (Eigen::Index k = 0; k < 3; ++k) B.col(6 * i + 2 + k) = B9.col(3 * i + k);
    return B;
  };
  // Half of what quadrangles have: the membrane's turn is one over the triangle, and what the rotations differ from it is held too.
  const double held = drilling_share(law, 2.0 * twice_area) * law.twist;
  // Quadratic integrand: the middles of the edges are exact.
  for (const Vec3& N : {Vec3(0.5, 0.5, 0), Vec3(0, 0.5, 0.5), Vec3(0.5, 0, 0.5)}) {
    const MatX B = spread(bent.curvature(N)), shear = spread(bent.shear(N));
    const MatX mixed = twice_area / 6.0 * Bm.transpose() * law.B * B;
    K += twice_area / 6.0 * (B.transpose() * law.D * B + shear.transpose() * law.S * shear) + mixed + mixed.transpose();
    add_drilling(D, N, held * twice_area / 6.0, K);
  }
}

MatX triangle_stress(const Eigen::Matrix<double, 3, 2>& p, const FeShellLaw& law, const FeFace& face, const VecX& u) {
  double twice_area = 0.0;
  const MatX D = triangle_gradients(p, twice_area);
  const BentTriangle bent(p, D, law);
  Vec3 membrane = Vec3::Zero();
  VecX bending(9);
  for (Eigen::Index i = 0; i < 3; ++i) {
    membrane += Vec3(D(i, 0) * u(6 * i), D(i, 1) * u(6 * i + 1), D(i, 1) * u(6 * i) + D(i, 0) * u(6 * i + 1));
    bending.segment<3>(3 * i) = u.segment<3>(6 * i + 2);
  }
  MatX out(3, 3);
  for (Eigen::Index i = 0; i < 3; ++i) out.col(i) = face.membrane * membrane + face.bending * (bent.curvature(Vec3::Unit(i)) * bending);
  return out;
}

// Corners in the plane of the local axes, about their middle.
MatX shell_corners(const Mat3X& X, const Mat3& Q) {
  const Vec3 middle = X.rowwise().mean();
  return (Q.leftCols(2).transpose() * (X.colwise() - middle)).transpose();
}

// Local motions of the corners in the shell's plane from those of its nodes in space, 6n x 6n. Nodes of a warped quadrangle lie beside the
// plane (h): where the element turns, their motion h times the turn is none of the corners in the plane. The turn is that of the plane
// fitted to the deflections, so that forces in the plane, which act beside each other at the nodes, are balanced by forces across it as in
// R. H. MacNeal, A simple quadrilateral shell element, Computers & Structures 8 (1978).
MatX motions_in_plane(const Mat3X& X, const Mat3& Q, const MatX& local) {
  const Eigen::Index n = X.cols();
  MatX turn = MatX::Zero(6 * n, 6 * n);
  for (Eigen::Index i = 0; i < 2 * n; ++i) turn.block<3, 3>(3 * i, 3 * i) = Q.transpose();
  if (n == 3) return turn;
  const Vec3 middle = X.rowwise().mean();
  MatX plane(n, 3);  // deflection of a turning plane: constant, about x, about y
  plane << VecX::Ones(n), local.col(1), -local.col(0);
  const MatX fit = (plane.transpose() * plane).ldlt().solve(plane.transpose());
  MatX flat = MatX::Identity(6 * n, 6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double h = Q.col(2).dot(X.col(i) - middle);
    for (Eigen::Index k = 0; k < n; ++k) {
      flat(6 * i, 6 * k + 2) = -h * fit(2, k);
      flat(6 * i + 1, 6 * k + 2) = h * fit(1, k);
    }
  }
  return flat * turn;
}

}  // namespace

// The rotation about the normal is tied to the membrane's by a share of the shear modulus (Hughes and Brezzi 1989): where elements meet at
// an angle, moments that bend or twist one have a part about the other's normal. Of the size of the bending stiffness over an element,
// (t / h)^2, it leaves a share of the angle's square over twelve of that part unheld; with a thousandth alone a thick strip twisted by 90
// degrees was a third too soft, however fine. No more than the whole, and no less than a thousandth against rounding.
double drilling_share(const FeShellLaw& law, double square) { return std::clamp(12.0 * law.D(2, 2) / (law.A(2, 2) * square), 1e-3, 1.0); }

Mat3 shell_axes(FeShape shape, const Mat3X& X, int id, double& area) {
  const Vec3 normal = fe_faces(shape)[0].size() == 3 ? Vec3((X.col(1) - X.col(0)).cross(X.col(2) - X.col(0)))
                                                     : Vec3((X.col(2) - X.col(0)).cross(X.col(3) - X.col(1)));
  area = 0.5 * normal.norm();
  if (!(area > 0.0)) throw InputError(fmt::format("element {} ({}) has no area", id, fe_name(shape)));
  Mat3 Q;
  Q.col(2) = normal.normalized();
  Q.col(0) = (X.col(1) - X.col(0)) - Q.col(2).dot(X.col(1) - X.col(0)) * Q.col(2);
  if (!(Q.col(0).norm() > 0.0)) throw InputError(fmt::format("element {} ({}) is degenerate", id, fe_name(shape)));
  Q.col(0).normalize();
  Q.col(1) = Q.col(2).cross(Q.col(0));
  return Q;
}

void shell_matrices(FeShape shape, const Mat3X& X, const FeShellLaw& law, int id, MatX& K, MatX& M) {
  const Eigen::Index n = X.cols();
  double area = 0.0;
  const Mat3 Q = shell_axes(shape, X, id, area);
  const MatX local = shell_corners(X, Q);
  MatX Kl = MatX::Zero(6 * n, 6 * n);
  if (n == 3) triangle(local, law, Kl);
  else quadrangle(local, law, id, Kl);
  const MatX turn = motions_in_plane(X, Q, local);
  K = turn.transpose() * Kl * turn;
  K = (0.5 * (K + K.transpose())).eval();
  M = MatX::Zero(6 * n, 6 * n);
  const double share = area / static_cast<double>(n);
  // Turning about the normal moves no mass: with inertia the weak stiffness against it would make frequencies of its own.
  const Mat3 rotary = share * law.m2 * (Mat3::Identity() - Q.col(2) * Q.col(2).transpose());
  // The mass beside the nodes' surface moves by rotation x m1 n.
  const Mat3 lever = -law.m1 * share * skew(Q.col(2));
  for (Eigen::Index i = 0; i < n; ++i) {
    M.diagonal().segment<3>(6 * i).setConstant(share * law.m0);
    M.block<3, 3>(6 * i + 3, 6 * i + 3) = rotary;
    if (!law.coupled()) continue;
    M.block<3, 3>(6 * i, 6 * i + 3) = lever;
    M.block<3, 3>(6 * i + 3, 6 * i) = lever.transpose();
  }
}

MatX shell_nodal_stress(FeShape shape, const Mat3X& X, const FeShellLaw& law, const MatX& u, int id, bool other_face) {
  const Eigen::Index n = X.cols();
  double area = 0.0;
  const Mat3 Q = shell_axes(shape, X, id, area);
  const MatX local = shell_corners(X, Q);
  const VecX motions = motions_in_plane(X, Q, local) * u.reshaped();
  const FeFace& face = other_face ? law.lower : law.upper;
  const MatX plane = n == 3 ? triangle_stress(local, law, face, motions) : quadrangle_stress(local, law, face, motions, id);
  MatX out(6, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Mat3 S = Mat3::Zero();
    S(0, 0) = plane(0, i);
    S(1, 1) = plane(1, i);
    S(0, 1) = S(1, 0) = plane(2, i);
    S = Q * S * Q.transpose();
    out.col(i) << S(0, 0), S(1, 1), S(2, 2), S(0, 1), S(1, 2), S(0, 2);
  }
  return out;
}

}  // namespace flexframe::sim
