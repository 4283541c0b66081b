// Solid elements: shape functions, quadrature, stiffness, mass, stress. See fe_elements.h.
#include "sim/reduce/fe_elements.h"

#include "sim/base/eigen_solvers.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::sim {
namespace {

struct Rule {
  std::vector<Vec3> points;
  std::vector<double> weights;
};

enum class Family { tetrahedron, hexahedron, wedge };
Family family(FeShape s) {
  if (s == FeShape::tetrahedron4 || s == FeShape::tetrahedron10) return Family::tetrahedron;
  if (s == FeShape::hexahedron8 || s == FeShape::hexahedron20) return Family::hexahedron;
  return Family::wedge;
}

// Gauss-Legendre on [-1, 1] with 2 or 3 points.
Rule line_rule(int n) {
  if (n == 2) {
    const double a = 1.0 / std::sqrt(3.0);
    return {{Vec3(-a, 0, 0), Vec3(a, 0, 0)}, {1.0, 1.0}};
  }
  const double a = std::sqrt(0.6);
  return {{Vec3(-a, 0, 0), Vec3(0, 0, 0), Vec3(a, 0, 0)}, {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0}};
}

// Unit triangle, area 1/2: 1 point, 3 points of degree 2, 7 points of degree 5 (Radon).
Rule triangle_rule(int n) {
  Rule r;
  const auto orbit = [&](double a, double w) {
    const double b = 1.0 - 2.0 * a;
    for (const auto& [x, y] : {std::pair(a, a), std::pair(b, a), std::pair(a, b)}) {
      r.points.emplace_back(x, y, 0.0);
      r.weights.push_back(w);
    }
  };
  if (n == 1) {
    r.points.emplace_back(1.0 / 3.0, 1.0 / 3.0, 0.0);
    r.weights.push_back(0.5);
  } else if (n == 3) {
    orbit(1.0 / 6.0, 1.0 / 6.0);
  } else {
    const double s = std::sqrt(15.0);
    r.points.emplace_back(1.0 / 3.0, 1.0 / 3.0, 0.0);
    r.weights.push_back(9.0 / 80.0);
    orbit((6.0 - s) / 21.0, (155.0 - s) / 2400.0);
    orbit((6.0 + s) / 21.0, (155.0 + s) / 2400.0);
  }
  return r;
}

// Unit tetrahedron, volume 1/6: 1 (degree 1), 4 (degree 2), 15 points (degree 5, Keast).
Rule tetrahedron_rule(int n) {
  Rule r;
  const auto centre = [&](double w) {
    r.points.emplace_back(0.25, 0.25, 0.25);
    r.weights.push_back(w);
  };
  const auto orbit4 = [&](double a, double w) {
    const double b = 1.0 - 3.0 * a;
    for (const Vec3& p : {Vec3(a, a, a), Vec3(b, a, a), Vec3(a, b, a), Vec3(a, a, b)}) {
      r.points.push_back(p);
      r.weights.push_back(w);
    }
  };
  const auto orbit6 = [&](double a, double w) {
    const double b = 0.5 - a;
    for (const Vec3& p : {Vec3(a, a, b), Vec3(a, b, a), Vec3(b, a, a), Vec3(a, b, b), Vec3(b, a, b), Vec3(b, b, a)}) {
      r.points.push_back(p);
      r.weights.push_back(w);
    }
  };
  if (n == 1) {
    centre(1.0 / 6.0);
  } else if (n == 4) {
    orbit4((5.0 - std::sqrt(5.0)) / 20.0, 1.0 / 24.0);
  } else {
    const double s = std::sqrt(15.0);
    centre(8.0 / 405.0);
    orbit4((7.0 - s) / 34.0, (2665.0 + 14.0 * s) / 226800.0);
    orbit4((7.0 + s) / 34.0, (2665.0 - 14.0 * s) / 226800.0);
    orbit6((10.0 - 2.0 * s) / 40.0, 5.0 / 567.0);
  }
  return r;
}

Rule product(const Rule& plane, const Rule& line, bool three) {
  Rule r;
  if (three) {
    for (size_t i = 0; i < line.points.size(); ++i)
      for (size_t j = 0; j < line.points.size(); ++j)
        for (size_t k = 0; k < line.points.size(); ++k) {
          r.points.emplace_back(line.points[i].x(), line.points[j].x(), line.points[k].x());
          r.weights.push_back(line.weights[i] * line.weights[j] * line.weights[k]);
        }
    return r;
  }
  for (size_t i = 0; i < plane.points.size(); ++i)
    for (size_t k = 0; k < line.points.size(); ++k) {
      r.points.emplace_back(plane.points[i].x(), plane.points[i].y(), line.points[k].x());
      r.weights.push_back(plane.weights[i] * line.weights[k]);
    }
  return r;
}

const Rule& rule(FeShape shape, FeFormulation formulation, FeRule what) {
  static const Rule tet1 = tetrahedron_rule(1), tet4 = tetrahedron_rule(4), tet15 = tetrahedron_rule(15);
  static const Rule hex8 = product({}, line_rule(2), true), hex27 = product({}, line_rule(3), true);
  static const Rule wedge2 = product(triangle_rule(1), line_rule(2), false), wedge6 = product(triangle_rule(3), line_rule(2), false),
                    wedge9 = product(triangle_rule(3), line_rule(3), false), wedge21 = product(triangle_rule(7), line_rule(3), false);
  const bool mass = what == FeRule::mass;
  switch (shape) {
    case FeShape::tetrahedron4:
      return mass ? tet4 : tet1;
    case FeShape::tetrahedron10:
      return mass ? tet15 : tet4;
    case FeShape::hexahedron8:
      return hex8;
    case FeShape::hexahedron20:
      return formulation == FeFormulation::reduced ? hex8 : hex27;
    case FeShape::wedge6:
      return mass ? wedge6 : wedge2;
    default:
      return mass ? wedge21 : wedge9;
  }
}

// Shape functions at the points of a rule, computed once.
struct Tabulated {
  std::vector<VecX> N;
  std::vector<MatX> dN;
  std::vector<double> weights;
};

const Tabulated& tabulated(FeShape shape, FeFormulation formulation, FeRule what) {
  constexpr int shapes = 6, formulations = 3;  // the solids are the first of FeShape
  static const std::vector<Tabulated> all = [] {
    std::vector<Tabulated> tables(size_t{2} * shapes * formulations);
    for (int s = 0; s < shapes; ++s) {
      if (!fe_is_solid(static_cast<FeShape>(s))) continue;
      for (int f = 0; f < formulations; ++f)
        for (int w = 0; w < 2; ++w) {
          Tabulated& t = tables[(s * formulations + f) * 2 + w];
          const Rule& r = rule(static_cast<FeShape>(s), static_cast<FeFormulation>(f), static_cast<FeRule>(w));
          t.weights = r.weights;
          t.N.resize(r.points.size());
          t.dN.resize(r.points.size());
          for (size_t i = 0; i < r.points.size(); ++i) shape_functions(static_cast<FeShape>(s), r.points[i], t.N[i], t.dN[i]);
        }
    }
    return tables;
  }();
  return all[(static_cast<int>(shape) * formulations + static_cast<int>(formulation)) * 2 + static_cast<int>(what)];
}

[[noreturn]] void inside_out(int id, FeShape shape) {
  throw InputError(
      fmt::format("element {} ({}) is inside out or too distorted: its Jacobian is not positive; check the order of its nodes or the mesh",
                  id, fe_name(shape)));
}

// K += volume B^T C B for isotropic C, block by block: lambda a_i b_j + mu (a_j b_i + delta_ij a . b).
void add_stiffness(const MatX& dN, double volume, double lambda, double mu, MatX& K) {
  const Eigen::Index n = dN.rows();
  const double l = volume * lambda, m = volume * mu;
  for (Eigen::Index b = 0; b < n; ++b) {
    const double bx = dN(b, 0), by = dN(b, 1), bz = dN(b, 2);
    for (Eigen::Index a = b; a < n; ++a) {
      const double ax = dN(a, 0), ay = dN(a, 1), az = dN(a, 2);
      const double dot = m * (ax * bx + ay * by + az * bz);
      double* k = &K(3 * a, 3 * b);
      const auto stride = K.outerStride();
      k[0] += (l + m) * ax * bx + dot;
      k[1] += l * ay * bx + m * ax * by;
      k[2] += l * az * bx + m * ax * bz;
      k += stride;
      k[0] += l * ax * by + m * ay * bx;
      k[1] += (l + m) * ay * by + dot;
      k[2] += l * az * by + m * ay * bz;
      k += stride;
      k[0] += l * ax * bz + m * az * bx;
      k[1] += l * ay * bz + m * az * by;
      k[2] += (l + m) * az * bz + dot;
    }
  }
}

MatX strain_matrix(const MatX& dN) {
  const Eigen::Index n = dN.rows();
  MatX B = MatX::Zero(6, 3 * n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const double x = dN(a, 0), y = dN(a, 1), z = dN(a, 2);
    B(0, 3 * a) = B(3, 3 * a + 1) = B(5, 3 * a + 2) = x;
    B(1, 3 * a + 1) = B(3, 3 * a) = B(4, 3 * a + 2) = y;
    B(2, 3 * a + 2) = B(4, 3 * a + 1) = B(5, 3 * a) = z;
  }
  return B;
}

// Three incompatible modes 1 - xi^2, 1 - eta^2, 1 - zeta^2 with the centre's Jacobian (passes the patch test). At the stiffness points:
// strains of the nodes' motions and of the nine amplitudes; amplitudes = -inner^-1 coupling u.
struct IncompatibleModes {
  std::vector<MatX> B, Bi;  // 6 x 24, 6 x 9
  MatX coupling = MatX::Zero(9, 24), inner = MatX::Zero(9, 9);
};

IncompatibleModes incompatible_modes(const Mat3X& X, const Mat6& C, int id) {
  VecX N;
  MatX dN;
  shape_functions(FeShape::hexahedron8, Vec3::Zero(), N, dN);
  const Mat3 J0 = X * dN;
  const double det0 = J0.determinant();
  const Mat3 inverse = J0.inverse();
  const Rule& r = rule(FeShape::hexahedron8, FeFormulation::full, FeRule::stiffness);
  IncompatibleModes out;
  for (size_t i = 0; i < r.points.size(); ++i) {
    shape_functions(FeShape::hexahedron8, r.points[i], N, dN);
    const Mat3 J = X * dN;
    const double det = J.determinant();
    if (!(det > 0.0)) inside_out(id, FeShape::hexahedron8);
    out.B.push_back(strain_matrix(dN * J.inverse()));
    MatX dI = MatX::Zero(3, 3);
    for (int k = 0; k < 3; ++k) dI.row(k) = -2.0 * r.points[i](k) * inverse.row(k) * (det0 / det);
    out.Bi.push_back(strain_matrix(dI));
    const double volume = det * r.weights[i];
    out.coupling += volume * out.Bi.back().transpose() * C * out.B.back();
    out.inner += volume * out.Bi.back().transpose() * C * out.Bi.back();
  }
  return out;
}

void condense_incompatible(const Mat3X& X, const FeMaterial& material, int id, MatX& K) {
  const IncompatibleModes modes = incompatible_modes(X, elasticity(material), id);
  K -= modes.coupling.transpose() * solve_symmetric(modes.inner, modes.coupling);
}

// Motions of a C3D20R (or a C3D6) that none of its eight (two) points sees have no stiffness; through a single layer of elements they run
// on. A thousandth of the full element's stiffness in the place of its own holds them: it changes frequencies by some 1e-5 (not where
// single nodes are loaded or held: hourglass_energy).
constexpr double hourglass_share = 1e-3;

void hold_hourglass(FeShape shape, const Mat3X& X, const FeMaterial& material, int id, MatX& K) {
  const Mat6 C = elasticity(material);
  K *= 1.0 - hourglass_share;
  for (const FePoint& p : solid_points(shape, FeFormulation::full, FeRule::mass, X, id)) {
    const MatX B = strain_matrix(p.dN);
    K.noalias() += hourglass_share * p.volume * B.transpose() * C * B;
  }
}

}  // namespace

Mat3X parent_nodes(FeShape shape) {
  Mat3X p(3, fe_node_count(shape));
  const auto middle = [&](int i, int a, int b) { p.col(i) = 0.5 * (p.col(a) + p.col(b)); };
  switch (family(shape)) {
    case Family::tetrahedron:
      p.leftCols(4) << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
      if (shape == FeShape::tetrahedron10) {
        middle(4, 0, 1);
        middle(5, 1, 2);
        middle(6, 2, 0);
        middle(7, 0, 3);
        middle(8, 1, 3);
        middle(9, 2, 3);
      }
      break;
    case Family::hexahedron:
      p.leftCols(8) << -1, 1, 1, -1, -1, 1, 1, -1, -1, -1, 1, 1, -1, -1, 1, 1, -1, -1, -1, -1, 1, 1, 1, 1;
      if (shape == FeShape::hexahedron20)
        for (int i = 0; i < 4; ++i) {
          middle(8 + i, i, (i + 1) % 4);
          middle(12 + i, 4 + i, 4 + (i + 1) % 4);
          middle(16 + i, i, i + 4);
        }
      break;
    case Family::wedge:
      p.leftCols(6) << 0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, -1, -1, -1, 1, 1, 1;
      if (shape == FeShape::wedge15)
        for (int i = 0; i < 3; ++i) {
          middle(6 + i, i, (i + 1) % 3);
          middle(9 + i, 3 + i, 3 + (i + 1) % 3);
          middle(12 + i, i, i + 3);
        }
      break;
  }
  return p;
}

void shape_functions(FeShape shape, const Vec3& q, VecX& N, MatX& dN) {
  const int n = fe_node_count(shape);
  N.resize(n);
  dN.resize(n, 3);
  const double x = q.x(), y = q.y(), z = q.z();
  switch (shape) {
    case FeShape::tetrahedron4:
      N << 1 - x - y - z, x, y, z;
      dN << -1, -1, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1;
      break;
    case FeShape::tetrahedron10: {
      const double L[4] = {1 - x - y - z, x, y, z};
      const Eigen::RowVector3d g[4] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      for (int i = 0; i < 4; ++i) {
        N(i) = L[i] * (2 * L[i] - 1);
        dN.row(i) = (4 * L[i] - 1) * g[i];
      }
      static constexpr int edge[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
      for (int i = 0; i < 6; ++i) {
        const auto [a, b] = std::pair(edge[i][0], edge[i][1]);
        N(4 + i) = 4 * L[a] * L[b];
        dN.row(4 + i) = 4 * (L[a] * g[b] + L[b] * g[a]);
      }
      break;
    }
    case FeShape::hexahedron8:
    case FeShape::hexahedron20: {
      static const Mat3X corners = parent_nodes(FeShape::hexahedron20);
      for (int i = 0; i < n; ++i) {
        const Vec3 c = corners.col(i);
        const Vec3 f(1 + c.x() * x, 1 + c.y() * y, 1 + c.z() * z);
        if (i < 8) {
          const double s = c.x() * x + c.y() * y + c.z() * z - 2;
          if (n == 8) {
            N(i) = f.prod() / 8;
            dN.row(i) << c.x() * f.y() * f.z() / 8, c.y() * f.x() * f.z() / 8, c.z() * f.x() * f.y() / 8;
          } else {
            N(i) = f.prod() * s / 8;
            dN.row(i) << c.x() * f.y() * f.z() * (s + f.x()) / 8, c.y() * f.x() * f.z() * (s + f.y()) / 8,
                c.z() * f.x() * f.y() * (s + f.z()) / 8;
          }
          continue;
        }
        // A mid-edge node: quadratic along the direction in which its parent coordinate is zero.
        const int k = c.x() == 0 ? 0 : c.y() == 0 ? 1 : 2, a = (k + 1) % 3, b = (k + 2) % 3;
        const double bubble = 1 - q(k) * q(k);
        N(i) = bubble * f(a) * f(b) / 4;
        dN(i, k) = -2 * q(k) * f(a) * f(b) / 4;
        dN(i, a) = bubble * c(a) * f(b) / 4;
        dN(i, b) = bubble * f(a) * c(b) / 4;
      }
      break;
    }
    case FeShape::wedge6:
    case FeShape::wedge15: {
      const double L[3] = {1 - x - y, x, y};
      const double gx[3] = {-1, 1, 0}, gy[3] = {-1, 0, 1};
      for (int i = 0; i < 6; ++i) {
        const int a = i % 3;
        const double c = i < 3 ? -1.0 : 1.0, f = 1 + c * z;
        if (n == 6) {
          N(i) = L[a] * f / 2;
          dN.row(i) << gx[a] * f / 2, gy[a] * f / 2, L[a] * c / 2;
        } else {
          // Serendipity: L f (2 L - 2 + c z) / 2.
          const double s = 2 * L[a] - 2 + c * z;
          N(i) = L[a] * f * s / 2;
          const double dL = f * (s + 2 * L[a]) / 2;
          dN.row(i) << gx[a] * dL, gy[a] * dL, L[a] * c * (s + f) / 2;
        }
      }
      if (n == 15)
        for (int i = 0; i < 3; ++i) {
          const int a = i, b = (i + 1) % 3;
          for (Eigen::Index layer = 0; layer < 2; ++layer) {
            const double c = layer == 0 ? -1.0 : 1.0, f = 1 + c * z;
            N(6 + 3 * layer + i) = 2 * L[a] * L[b] * f;
            dN.row(6 + 3 * layer + i) << 2 * (gx[a] * L[b] + L[a] * gx[b]) * f, 2 * (gy[a] * L[b] + L[a] * gy[b]) * f, 2 * L[a] * L[b] * c;
          }
          N(12 + i) = L[i] * (1 - z * z);
          dN.row(12 + i) << gx[i] * (1 - z * z), gy[i] * (1 - z * z), -2 * z * L[i];
        }
      break;
    }
    default:
      break;
  }
}

Mat6 elasticity(const FeMaterial& m) {
  if (m.elasticity) return *m.elasticity;
  const double mu = m.youngs_modulus / (2 * (1 + m.poisson)), lambda = 2 * mu * m.poisson / (1 - 2 * m.poisson);
  Mat6 C = Mat6::Zero();
  C.topLeftCorner<3, 3>().setConstant(lambda);
  C.diagonal() << lambda + 2 * mu, lambda + 2 * mu, lambda + 2 * mu, mu, mu, mu;
  return C;
}

std::vector<FePoint> solid_points(FeShape shape, FeFormulation formulation, FeRule what, const Mat3X& X, int id) {
  const Tabulated& t = tabulated(shape, formulation, what);
  std::vector<FePoint> out(t.N.size());
  for (size_t i = 0; i < t.N.size(); ++i) {
    const Mat3 J = X * t.dN[i];
    const double det = J.determinant();
    if (!(det > 0.0)) inside_out(id, shape);
    out[i].N = t.N[i];
    out[i].dN.noalias() = t.dN[i] * J.inverse();
    out[i].volume = det * t.weights[i];
  }
  return out;
}

void solid_stiffness(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, int id, MatX& K) {
  const Tabulated& t = tabulated(shape, formulation, FeRule::stiffness);
  const Eigen::Index n = X.cols();
  const double mu = material.youngs_modulus / (2 * (1 + material.poisson)), lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
  K.setZero(3 * n, 3 * n);
  MatX dN(n, 3);
  for (size_t i = 0; i < t.N.size(); ++i) {
    const Mat3 J = X * t.dN[i];
    const double det = J.determinant();
    if (!(det > 0.0)) inside_out(id, shape);
    dN.noalias() = t.dN[i] * J.inverse();
    if (material.elasticity) {
      const MatX B = strain_matrix(dN);
      K.noalias() += (det * t.weights[i]) * B.transpose() * *material.elasticity * B;
    } else {
      add_stiffness(dN, det * t.weights[i], lambda, mu, K);
    }
  }
  if (fe_is_held_by_share(shape, formulation)) hold_hourglass(shape, X, material, id, K);
  // Mirror the lower block triangle.
  for (Eigen::Index c = 0; c < 3 * n; ++c)
    for (Eigen::Index r = 0; r < c; ++r) K(r, c) = K(c, r);
  if (shape == FeShape::hexahedron8 && formulation == FeFormulation::incompatible) condense_incompatible(X, material, id, K);
}

bool fe_is_held_by_share(FeShape shape, FeFormulation formulation) {
  return (shape == FeShape::hexahedron20 && formulation == FeFormulation::reduced) || shape == FeShape::wedge6;
}

VecX hourglass_energy(FeShape shape, const Mat3X& X, const FeMaterial& material, int id, const MatX& u) {
  const Mat6 C = elasticity(material);
  VecX out = VecX::Zero(u.cols());
  for (const FePoint& p : solid_points(shape, FeFormulation::full, FeRule::mass, X, id)) {
    const MatX strain = strain_matrix(p.dN) * u;
    out += hourglass_share * p.volume * strain.cwiseProduct(C * strain).colwise().sum().transpose();
  }
  return out;
}

void solid_mass(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, int id, MatX& M) {
  const Tabulated& t = tabulated(shape, formulation, FeRule::mass);
  M.setZero(X.cols(), X.cols());
  for (size_t i = 0; i < t.N.size(); ++i) {
    const double det = Mat3(X * t.dN[i]).determinant();
    if (!(det > 0.0)) inside_out(id, shape);
    M.noalias() += (material.density * det * t.weights[i]) * t.N[i] * t.N[i].transpose();
  }
}

namespace {

// Monomials in which a solid's stress is extrapolated.
VecX stress_terms(FeShape shape, size_t points, const Vec3& q) {
  VecX b;
  switch (family(shape)) {
    case Family::tetrahedron:
      b.resize(4);
      b << 1, q.x(), q.y(), q.z();
      break;
    case Family::hexahedron:
      b.resize(points == 27 ? 20 : 8);
      b.head(8) << 1, q.x(), q.y(), q.z(), q.x() * q.y(), q.y() * q.z(), q.x() * q.z(), q.prod();
      // Of three points a side the terms of the element's own shape functions, as CalculiX has them.
      if (points == 27) {
        b.segment(8, 3) = q.cwiseAbs2();
        b.segment(11, 6) << b(8) * q.y(), b(8) * q.z(), b(9) * q.x(), b(9) * q.z(), b(10) * q.x(), b(10) * q.y();
        b.tail(3) = q.prod() * q;
      }
      break;
    case Family::wedge:
      b.resize(points == 2 ? 2 : 6);
      if (points == 2) b << 1, q.z();
      else b << 1, q.x(), q.y(), q.z(), q.x() * q.z(), q.y() * q.z();
      break;
  }
  return b;
}

// Values at the nodes from those at the stiffness points, nodes x points: by least squares.
MatX extrapolation(FeShape shape, FeFormulation formulation) {
  const Rule& r = rule(shape, formulation, FeRule::stiffness);
  const size_t count = r.points.size();
  const Mat3X nodes = parent_nodes(shape);
  if (count == 1) return MatX::Ones(nodes.cols(), 1);
  const Eigen::Index terms = stress_terms(shape, count, Vec3::Zero()).size();
  MatX at_points(count, terms), at_nodes(nodes.cols(), terms);
  for (size_t i = 0; i < count; ++i) at_points.row(static_cast<Eigen::Index>(i)) = stress_terms(shape, count, r.points[i]).transpose();
  for (Eigen::Index k = 0; k < nodes.cols(); ++k) at_nodes.row(k) = stress_terms(shape, count, nodes.col(k)).transpose();
  return at_nodes * fit(at_points, MatX::Identity(at_points.rows(), at_points.rows()));
}

}  // namespace

MatX solid_stress_matrix(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, int id) {
  const Mat6 C = elasticity(material);
  const Eigen::Index n = X.cols();
  std::vector<MatX> strains;
  if (shape == FeShape::hexahedron8 && formulation == FeFormulation::incompatible) {
    IncompatibleModes modes = incompatible_modes(X, C, id);
    const MatX amplitudes = -solve_symmetric(modes.inner, modes.coupling);
    for (size_t i = 0; i < modes.B.size(); ++i) strains.push_back(modes.B[i] + modes.Bi[i] * amplitudes);
  } else {
    for (const FePoint& p : solid_points(shape, formulation, FeRule::stiffness, X, id)) strains.push_back(strain_matrix(p.dN));
  }
  const MatX E = extrapolation(shape, formulation);
  MatX out = MatX::Zero(6 * n, 3 * n);
  for (size_t i = 0; i < strains.size(); ++i) {
    const MatX stress = C * strains[i];
    for (Eigen::Index k = 0; k < n; ++k) out.middleRows(6 * k, 6) += E(k, static_cast<Eigen::Index>(i)) * stress;
  }
  return out;
}

MatX solid_nodal_stress(FeShape shape, FeFormulation formulation, const Mat3X& X, const FeMaterial& material, const Mat3X& u, int id) {
  const VecX stress = solid_stress_matrix(shape, formulation, X, material, id) * u.reshaped();
  return stress.reshaped(6, X.cols());
}

}  // namespace flexframe::sim
