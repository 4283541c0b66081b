// Shells of six and eight nodes as degenerated solids: points on the normals through the nodes move as u + rotation x (height n). See
// fe_elements.h.
#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace flexframe::sim {
namespace {

using Vec2 = Eigen::Vector2d;

struct PlaneRule {
  std::vector<Vec2> points;
  std::vector<double> weights;
};

const PlaneRule& plane_rule(FeShape shape) {
  static const double g = 1.0 / std::sqrt(3.0);
  static const PlaneRule square{{{-g, -g}, {g, -g}, {g, g}, {-g, g}}, {1, 1, 1, 1}};
  static const PlaneRule middle{{{1.0 / 3, 1.0 / 3}}, {0.5}};
  static const PlaneRule three{{{1.0 / 6, 1.0 / 6}, {2.0 / 3, 1.0 / 6}, {1.0 / 6, 2.0 / 3}}, {1.0 / 6, 1.0 / 6, 1.0 / 6}};
  return shape == FeShape::triangle3 ? middle : shape == FeShape::triangle6 ? three : square;
}

// For the mass, exact for straight edges: 3 x 3 points, six of degree four (G. R. Cowper, Gaussian quadrature formulas for triangles, IJNME
// 7, 1973).
const PlaneRule& mass_rule(FeShape shape) {
  static const PlaneRule square = [] {
    PlaneRule r;
    const double a = std::sqrt(0.6);
    const std::array<double, 3> x = {-a, 0.0, a}, w = {5.0 / 9, 8.0 / 9, 5.0 / 9};
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j) {
        r.points.emplace_back(x[i], x[j]);
        r.weights.push_back(w[i] * w[j]);
      }
    return r;
  }();
  static const PlaneRule triangle = [] {
    PlaneRule r;
    for (const auto& [a, w] : {std::pair(0.445948490915965, 0.111690794839005), std::pair(0.091576213509771, 0.054975871827661)}) {
      const double b = 1.0 - 2.0 * a;
      for (const Vec2& p : {Vec2(a, a), Vec2(b, a), Vec2(a, b)}) {
        r.points.push_back(p);
        r.weights.push_back(w);
      }
    }
    return r;
  }();
  return shape == FeShape::triangle6 ? triangle : square;
}

// Corners, then middles; places in the parent of quadrangles.
constexpr double corner_x[8] = {-1, 1, 1, -1, 0, 1, 0, -1}, corner_y[8] = {-1, -1, 1, 1, -1, 0, 1, 0};

}  // namespace

void surface_functions(FeShape shape, const Vec2& q, VecX& N, MatX& dN) {
  const int n = fe_node_count(shape);
  N.resize(n);
  dN.resize(n, 2);
  const double x = q.x(), y = q.y();
  if (shape == FeShape::triangle3) {
    N << 1 - x - y, x, y;
    dN << -1, -1, 1, 0, 0, 1;
  } else if (shape == FeShape::triangle6) {
    const double L[3] = {1 - x - y, x, y};
    const Eigen::RowVector2d g[3] = {{-1, -1}, {1, 0}, {0, 1}};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      N(i) = L[i] * (2 * L[i] - 1);
      dN.row(i) = (4 * L[i] - 1) * g[i];
      N(3 + i) = 4 * L[i] * L[j];
      dN.row(3 + i) = 4 * (L[i] * g[j] + L[j] * g[i]);
    }
  } else {
    for (int i = 0; i < n; ++i) {
      const double a = corner_x[i], b = corner_y[i], fx = 1 + a * x, fy = 1 + b * y;
      if (n == 4) {
        N(i) = fx * fy / 4;
        dN.row(i) << a * fy / 4, b * fx / 4;
      } else if (i < 4) {
        const double s = a * x + b * y - 1;
        N(i) = fx * fy * s / 4;
        dN.row(i) << a * fy * (s + fx) / 4, b * fx * (s + fy) / 4;
      } else if (a == 0) {
        N(i) = (1 - x * x) * fy / 2;
        dN.row(i) << -x * fy, b * (1 - x * x) / 2;
      } else {
        N(i) = (1 - y * y) * fx / 2;
        dN.row(i) << a * (1 - y * y) / 2, -y * fx;
      }
    }
  }
}

namespace {

[[noreturn]] void folded(FeShape shape, int id) {
  throw InputError(
      fmt::format("element {} ({}) is too distorted: its Jacobian is not positive; check the order of its nodes", id, fe_name(shape)));
}

FeShellPoint surface_point(FeShape shape, const Mat3X& X, const Vec2& q, double weight, int id) {
  FeShellPoint p;
  MatX d;
  surface_functions(shape, q, p.N, d);
  const Eigen::Matrix<double, 3, 2> J = X * d;
  const Vec3 normal = J.col(0).cross(J.col(1));
  p.area = weight * normal.norm();
  if (!(p.area > 0.0)) folded(shape, id);
  p.axes.col(2) = normal.normalized();
  p.axes.col(0) = J.col(0).normalized();
  p.axes.col(1) = p.axes.col(2).cross(p.axes.col(0));
  const Eigen::Matrix2d local = p.axes.leftCols<2>().transpose() * J;
  p.dN = d * local.inverse();
  return p;
}

// Of node i in the element's own coordinates.
Vec2 node_place(FeShape shape, int i) {
  if (shape != FeShape::triangle6) return {corner_x[i], corner_y[i]};
  static constexpr double x[6] = {0, 1, 0, 0.5, 0.5, 0}, y[6] = {0, 0, 1, 0, 0.5, 0.5};
  return {x[i], y[i]};
}

// Strains xx yy xy and xz yz at a height, in the point's axes, 5 x 6n, and the volume per area and height.
struct SolidPoint {
  MatX B;
  double stretch = 1.0;
};

SolidPoint solid_point(const FeShellPoint& p, const Mat3X& X, const Mat3X& normals, double z) {
  const Eigen::Index n = X.cols();
  // Place x(s, t, z) = sum N (X + z n): derivatives along the surface's two directions and the height.
  Mat3 J;
  J.leftCols<2>() = X * p.dN + z * (normals * p.dN);
  J.col(2) = normals * p.N;
  const Mat3 inverse = J.inverse();  // rows: gradients of s, t, z in space
  SolidPoint out;
  out.stretch = J.determinant();
  out.B = MatX::Zero(5, 6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 flat = p.axes.transpose() * (inverse.topRows<2>().transpose() * p.dN.row(i).transpose());
    const Vec3 high = z * flat + p.N(i) * (p.axes.transpose() * inverse.row(2).transpose());
    const Vec3 normal = p.axes.transpose() * normals.col(i);
    for (int k = 0; k < 6; ++k) {
      // The motion's direction in the point's axes and its gradient.
      const Vec3 e = p.axes.row(k % 3).transpose();
      const Vec3 move = k < 3 ? e : Vec3(e.cross(normal));
      const Vec3& g = k < 3 ? flat : high;
      out.B.col(6 * i + k) << move.x() * g.x(), move.y() * g.y(), move.x() * g.y() + move.y() * g.x(), move.x() * g.z() + move.z() * g.x(),
          move.y() * g.z() + move.z() * g.y();
    }
  }
  return out;
}

void add_drilling(const FeShellPoint& p, double weight, MatX& K) {
  const Eigen::Index n = p.N.size();
  VecX b(6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    b.segment<3>(6 * i) = 0.5 * (p.dN(i, 1) * p.axes.col(0) - p.dN(i, 0) * p.axes.col(1));
    b.segment<3>(6 * i + 3) = p.N(i) * p.axes.col(2);
  }
  K += weight * b * b.transpose();
}

}  // namespace

Mat3X curved_shell_normals(FeShape shape, const Mat3X& X, int id) {
  Mat3X out(3, X.cols());
  for (int i = 0; i < X.cols(); ++i) {
    const Vec2 q = node_place(shape, i);
    out.col(i) = surface_point(shape, X, q, 1.0, id).axes.col(2);
    // A fold inside of the element shows as a normal that points back.
    if (i > 0 && !(out.col(i).dot(out.col(0)) > 0.0)) folded(shape, id);
  }
  return out;
}

std::vector<FeShellPoint> shell_points(FeShape shape, const Mat3X& X, int id) {
  const PlaneRule& rule = plane_rule(shape);
  std::vector<FeShellPoint> out;
  for (size_t i = 0; i < rule.points.size(); ++i) out.push_back(surface_point(shape, X, rule.points[i], rule.weights[i], id));
  return out;
}

void curved_shell_matrices(FeShape shape, const Mat3X& X, const FeLawAt& law_at, int id, MatX& K, MatX& M) {
  const Eigen::Index n = X.cols();
  const Mat3X normals = curved_shell_normals(shape, X, id);
  K.setZero(6 * n, 6 * n);
  M.setZero(6 * n, 6 * n);
  const double g = 1.0 / std::sqrt(3.0);
  double square = 0.0;  // of its size
  for (const FeShellPoint& p : shell_points(shape, X, id)) {
    square += n == 6 ? 2.0 * p.area : p.area;
    const FeShellLaw law = law_at(p.axes, p.N);
    for (const FePly& ply : law.plies)
      for (const double side : {-g, g}) {
        const double half = 0.5 * (ply.upper - ply.lower), z = 0.5 * (ply.upper + ply.lower) + side * half;
        const SolidPoint s = solid_point(p, X, normals, z);
        if (!(s.stretch > 0.0)) folded(shape, id);
        const double volume = p.area * half * s.stretch;
        K += volume * (s.B.topRows(3).transpose() * ply.membrane * s.B.topRows(3) +
                       5.0 / 6.0 * s.B.bottomRows(2).transpose() * ply.shear * s.B.bottomRows(2));
      }
  }
  const PlaneRule& rule = mass_rule(shape);
  for (size_t k = 0; k < rule.points.size(); ++k) {
    const FeShellPoint p = surface_point(shape, X, rule.points[k], rule.weights[k], id);
    const FeShellLaw law = law_at(p.axes, p.N);
    // At all these points: with fewer there are rotations about the normal that none of them sees.
    add_drilling(p, drilling_share(law, square) * law.twist * p.area, K);
    Mat3 lever;
    const Vec3 normal = law.m1 * p.axes.col(2);
    // As in flat shells, turning about the normal moves no mass.
    const Mat3 rotary = law.m2 * (Mat3::Identity() - p.axes.col(2) * p.axes.col(2).transpose());
    lever << 0, normal.z(), -normal.y(), -normal.z(), 0, normal.x(), normal.y(), -normal.x(), 0;
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) {
        const double share = p.area * p.N(i) * p.N(j);
        M.block<3, 3>(6 * i, 6 * j).diagonal().array() += share * law.m0;
        M.block<3, 3>(6 * i + 3, 6 * j + 3) += share * rotary;
        if (!law.coupled()) continue;
        M.block<3, 3>(6 * i, 6 * j + 3) += share * lever;
        M.block<3, 3>(6 * i + 3, 6 * j) += share * lever.transpose();
      }
  }
  K = (0.5 * (K + K.transpose())).eval();
}

MatX curved_shell_nodal_stress(FeShape shape, const Mat3X& X, const FeLawAt& law_at, const MatX& u, int id, bool other_face) {
  const Eigen::Index n = X.cols();
  const Mat3X normals = curved_shell_normals(shape, X, id);
  const PlaneRule& rule = plane_rule(shape);
  const VecX motions = Eigen::Map<const VecX>(u.data(), u.size());
  const std::vector<FeShellPoint> points = shell_points(shape, X, id);
  Mat6X at(6, points.size());
  MatX basis(points.size(), points.size());
  const auto terms = [&](const Vec2& q) {
    VecX b(points.size());
    if (points.size() == 3) b << 1, q.x(), q.y();
    else b << 1, q.x(), q.y(), q.x() * q.y();
    return b;
  };
  for (size_t k = 0; k < points.size(); ++k) {
    const Eigen::Index col = static_cast<Eigen::Index>(k);
    const FeShellLaw law = law_at(points[k].axes, points[k].N);
    const FeFace& face = other_face ? law.lower : law.upper;
    const Vec3 plane = face.membrane * (solid_point(points[k], X, normals, face.height).B.topRows(3) * motions);
    Mat3 S = Mat3::Zero();
    S(0, 0) = plane(0);
    S(1, 1) = plane(1);
    S(0, 1) = S(1, 0) = plane(2);
    S = points[k].axes * S * points[k].axes.transpose();
    at.col(col) << S(0, 0), S(1, 1), S(2, 2), S(0, 1), S(1, 2), S(0, 2);
    basis.col(col) = terms(rule.points[k]);
  }
  const MatX coefficients = at * basis.inverse();
  MatX out(6, n);
  for (int i = 0; i < n; ++i) {
    const Vec2 q = node_place(shape, i);
    out.col(i) = coefficients * terms(q);
  }
  return out;
}

}  // namespace flexframe::sim
