// Mass integrals, second-order loads, stresses. See fe_integrals.h.
#include "sim/reduce/fe_integrals.h"

#include "sim/reduce/dense_products.h"
#include "sim/reduce/fe_elements.h"

#include <unordered_map>

namespace flexframe::sim {
namespace {

constexpr int tensor_row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

// e_a x u at the nodes' translations; rotations have no second order here.
MatX crossed(const FeSystem& system, int a, const MatX& U) {
  MatX out = MatX::Zero(U.rows(), U.cols());
  const int b = (a + 1) % 3, c = (a + 2) % 3;
  for (const auto& dof : system.dof) {
    if (dof[b] >= 0 && dof[c] >= 0) {
      out.row(dof[b]) = -U.row(dof[c]);
      out.row(dof[c]) = U.row(dof[b]);
    }
  }
  return out;
}

Mat3X field_at(const FeModel& model, const FeSystem& system, const FeElement& e, const MatX& U, int column) {
  Mat3X u(3, e.count);
  for (int i = 0; i < e.count; ++i)
    for (int d = 0; d < 3; ++d) u(d, i) = U(system.dof[model.connectivity[e.first + i]][d], column);
  return u;
}

// All six motions of a shell's nodes.
MatX motions_at(const FeModel& model, const FeSystem& system, const FeElement& e, const MatX& U, int column) {
  MatX u(6, e.count);
  for (int i = 0; i < e.count; ++i)
    for (int d = 0; d < 6; ++d) u(d, i) = U(system.dof[model.connectivity[e.first + i]][d], column);
  return u;
}

Mat3X positions(const FeModel& model, const FeElement& e) {
  Mat3X X(3, e.count);
  for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
  return X;
}

// Plane points of a shell: derivatives along its tangents t (3 x 2), from the middle surface.
struct ShellPoint {
  MatX dN;  // n x 2
  Eigen::Matrix<double, 3, 2> t;
  double area = 0.0;
};

std::vector<ShellPoint> shell_points(const FeElement& e, const Mat3X& X) {
  std::vector<ShellPoint> out;
  const double g = 1.0 / std::sqrt(3.0);
  const bool triangle = e.shape == FeShape::triangle3;
  const std::vector<Eigen::Vector2d> places =
      triangle ? std::vector<Eigen::Vector2d>{{1.0 / 3, 1.0 / 3}} : std::vector<Eigen::Vector2d>{{-g, -g}, {g, -g}, {g, g}, {-g, g}};
  for (const Eigen::Vector2d& q : places) {
    MatX d(e.count, 2);
    if (triangle) {
      d << -1, -1, 1, 0, 0, 1;
    } else {
      static constexpr double sx[4] = {-1, 1, 1, -1}, sy[4] = {-1, -1, 1, 1};
      for (int i = 0; i < 4; ++i) d.row(i) << sx[i] * (1 + sy[i] * q.y()) / 4, sy[i] * (1 + sx[i] * q.x()) / 4;
    }
    const Eigen::Matrix<double, 3, 2> J = X * d;
    ShellPoint p;
    const Vec3 normal = J.col(0).cross(J.col(1));
    p.area = normal.norm() * (triangle ? 0.5 : 1.0);
    p.t.col(0) = J.col(0).normalized();
    p.t.col(1) = normal.normalized().cross(p.t.col(0));
    const Eigen::Matrix2d local = p.t.transpose() * J;
    p.dN = d * local.inverse();
    out.push_back(std::move(p));
  }
  return out;
}

}  // namespace

RigidMass rigid_mass(const FeModel& model, const FeSystem& system) {
  const MatX R = rigid_motions(model, system);
  const MatX G = product_tn(R, symmetric_product(system.M, R));
  RigidMass out;
  out.mass = G.topLeftCorner<3, 3>().trace() / 3.0;
  // Row a: int e_a . (e_b x c) dm.
  out.md = 0.5 * Vec3(G(2, 4) * 1.0 - G(1, 5), G(0, 5) - G(2, 3), G(1, 3) - G(0, 4)) * -1.0;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) out.J(tensor_row[a][b]) = G(3 + a, 3 + b);
  return out;
}

LinearMass linear_mass(const FeModel& model, const FeSystem& system, const MatX& U) {
  const MatX R = rigid_motions(model, system);
  const MatX MR = symmetric_product(system.M, R);
  LinearMass out;
  const MatX both = product_tn(MR, U);
  out.md = both.topRows(3);
  out.Cr = both.bottomRows(3);
  // (e_a x c) . (e_b x u) + (e_b x c) . (e_a x u).
  out.J = Mat6X::Zero(6, U.cols());
  for (int b = 0; b < 3; ++b) {
    const MatX turned = product_tn(MR, crossed(system, b, U));
    for (int a = 0; a < 3; ++a) out.J.row(tensor_row[a][b]) += (a == b ? 2.0 : 1.0) * turned.row(3 + a);
  }
  return out;
}

MatX linear_mass_loads(const FeModel& model, const FeSystem& system) {
  const MatX MR = symmetric_product(system.M, rigid_motions(model, system));
  MatX out = MatX::Zero(system.size, 12);
  out.leftCols(6) = MR;
  // Turning is skew: its adjoint is its negative.
  for (int b = 0; b < 3; ++b) {
    const MatX turned = crossed(system, b, MR.rightCols(3));
    for (int a = 0; a < 3; ++a) out.col(6 + tensor_row[a][b]) -= (a == b ? 2.0 : 1.0) * turned.col(a);
  }
  return out;
}

QuadraticMass quadratic_mass(const FeModel&, const FeSystem& system, const MatX& U) {
  QuadraticMass out;
  const MatX MU = symmetric_product(system.M, U);
  std::array<MatX, 3> E, ME;
  for (int a = 0; a < 3; ++a) {
    E[a] = crossed(system, a, U);
    ME[a] = symmetric_product(system.M, E[a]);
    // (u_k x u_j)_a = (e_a x u_k) . u_j.
    out.Cr1[a] = product_tn(MU, E[a]);
  }
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) {
      const MatX G = product_tn(E[a], ME[b]);
      out.J2[tensor_row[a][b]] = G + G.transpose();
    }
  return out;
}

namespace {

// The pair's two fields, in the order of second_order_loads.
struct Pairs {
  std::vector<int> j, k;
  Pairs(int n, int first, int count) {
    for (int b = 0, at = 0; b < n; ++b)
      for (int a = 0; a <= b; ++a, ++at)
        if (at >= first && at < first + count) {
          j.push_back(a);
          k.push_back(b);
        }
  }
  int size() const { return static_cast<int>(j.size()); }
};

// Calls visit(element, dN (nodes x 3), volume, S) at each integration point; S: six rows xx yy zz xy yz xz of the stress of sym(grad u_j^T
// grad u_k) per pair, for shells the membrane stress in space axes.
template <class Visit>
void each_second_order_stress(const FeModel& model, const FeSystem& system, const MatX& U, const Pairs& pairs, const Visit& visit) {
  const Eigen::Index n = U.cols(), count = pairs.size();
  // One row per component, so that the loops over pairs and fields run over neighbours in memory.
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Rows fields = U;
  Rows H(9, n), S(6, count);
  MatX local, gradients;
  constexpr Eigen::Index first_of[6] = {0, 1, 2, 0, 1, 0}, second_of[6] = {0, 1, 2, 1, 2, 2};
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::point_mass) continue;
    const FeMaterial& material = model.materials[e.material];
    const Mat3X X = positions(model, e);
    local.resize(3 * n, e.count);
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      for (Eigen::Index d = 0; d < 3; ++d) local.col(i).segment(d * n, n) = fields.row(dof[d]).transpose();
    }
    const auto point = [&](const MatX& dN, double volume, double lambda, double mu) {
      // H(3 b + d, k): derivative of displacement d in direction b.
      gradients.noalias() = local * dN;
      for (Eigen::Index b = 0; b < 3; ++b)
        for (Eigen::Index d = 0; d < 3; ++d) H.row(3 * b + d) = gradients.col(b).segment(d * n, n).transpose();
      for (int c = 0; c < 6; ++c) {
        const double *a0 = &H(3 * first_of[c], 0), *a1 = &H(3 * first_of[c] + 1, 0), *a2 = &H(3 * first_of[c] + 2, 0);
        const double *b0 = &H(3 * second_of[c], 0), *b1 = &H(3 * second_of[c] + 1, 0), *b2 = &H(3 * second_of[c] + 2, 0);
        double* s = &S(c, 0);
        for (int p = 0; p < count; ++p) {
          const int j = pairs.j[p], k = pairs.k[p];
          s[p] = mu * (a0[j] * b0[k] + a1[j] * b1[k] + a2[j] * b2[k] + b0[j] * a0[k] + b1[j] * a1[k] + b2[j] * a2[k]);
        }
      }
      // mu (...) on the diagonal is 2 mu E; the trace of E from it.
      for (int p = 0; p < count; ++p) {
        const double pressure = lambda / (2.0 * mu) * (S(0, p) + S(1, p) + S(2, p));
        for (int c = 0; c < 3; ++c) S(c, p) += pressure;
      }
      visit(e, dN, volume, S);
    };
    if (fe_is_shell(e.shape)) {
      // Plane stress in the shell's plane: the gradient has no part along the normal, so neither has E.
      const double mu = material.youngs_modulus / (2 * (1 + material.poisson)),
                   lambda = material.youngs_modulus * material.poisson / (1 - material.poisson * material.poisson);
      // The pressure's part along the normal does no work on gradients in the plane.
      for (const ShellPoint& p : shell_points(e, X)) point(p.dN * p.t.transpose(), p.area * e.thickness, lambda, mu);
    } else {
      const double mu = material.youngs_modulus / (2 * (1 + material.poisson)),
                   lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
      for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::stiffness, X, e.id)) point(p.dN, p.volume, lambda, mu);
    }
  }
}

constexpr int stress_row[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

}  // namespace

MatX second_order_loads(const FeModel& model, const FeSystem& system, const MatX& U, int first, int count) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Pairs pairs(static_cast<int>(U.cols()), first, count);
  Rows g = Rows::Zero(system.size, pairs.size());
  each_second_order_stress(model, system, U, pairs, [&](const FeElement& e, const MatX& dN, double volume, const auto& S) {
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      const double x = volume * dN(i, 0), y = volume * dN(i, 1), z = volume * dN(i, 2);
      for (int d = 0; d < 3; ++d) g.row(dof[d]) += x * S.row(stress_row[d][0]) + y * S.row(stress_row[d][1]) + z * S.row(stress_row[d][2]);
    }
  });
  return g;
}

MatX second_order_work(const FeModel& model, const FeSystem& system, const MatX& U, const MatX& W) {
  const int n = static_cast<int>(U.cols()), loads = static_cast<int>(W.cols());
  const Pairs pairs(n, 0, n * (n + 1) / 2);
  MatX out = MatX::Zero(pairs.size(), loads);
  if (loads == 0) return out;
  MatX strain(6, loads);
  each_second_order_stress(model, system, U, pairs, [&](const FeElement& e, const MatX& dN, double volume, const auto& S) {
    strain.setZero();
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      for (int d = 0; d < 3; ++d)
        for (int b = 0; b < 3; ++b) strain.row(stress_row[d][b]) += volume * dN(i, b) * W.row(dof[d]);
    }
    out.noalias() += S.transpose() * strain;
  });
  return out;
}

std::vector<MatX> nodal_stress(const FeModel& model, const FeSystem& system, const MatX& U, const std::vector<int>& nodes) {
  const int n = static_cast<int>(U.cols());
  std::unordered_map<int, int> place;
  for (size_t i = 0; i < nodes.size(); ++i) place.emplace(nodes[i], static_cast<int>(i));
  std::vector<MatX> sum(nodes.size(), MatX::Zero(6, n));
  std::vector<int> count(nodes.size(), 0);
  for (const FeElement& e : model.elements) {
    const bool shell = fe_is_shell(e.shape);
    if (!shell && !fe_is_solid(e.shape)) continue;
    bool wanted = false;
    for (int i = 0; i < e.count; ++i) wanted = wanted || place.contains(model.connectivity[e.first + i]);
    if (!wanted) continue;
    const Mat3X X = positions(model, e);
    for (int k = 0; k < n; ++k) {
      const FeMaterial& material = model.materials[e.material];
      const MatX stress = shell ? shell_nodal_stress(e.shape, X, e.thickness, material, motions_at(model, system, e, U, k), e.id)
                                : solid_nodal_stress(e.shape, e.formulation, X, material, field_at(model, system, e, U, k), e.id);
      for (int i = 0; i < e.count; ++i)
        if (const auto it = place.find(model.connectivity[e.first + i]); it != place.end()) sum[it->second].col(k) += stress.col(i);
    }
    for (int i = 0; i < e.count; ++i)
      if (const auto it = place.find(model.connectivity[e.first + i]); it != place.end()) ++count[it->second];
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (count[i] > 0) sum[i] /= count[i];
    else sum[i].resize(6, 0);
  }
  return sum;
}

}  // namespace flexframe::sim
