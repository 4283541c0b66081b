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
    if (dof[0] < 0) continue;
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

Mat3X positions(const FeModel& model, const FeElement& e) {
  Mat3X X(3, e.count);
  for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
  return X;
}

// Plane points of a shell: derivatives along its tangents t (3 x 2), from the middle surface.
struct ShellPoint {
  MatX dN;             // n x 2
  Eigen::Matrix<double, 3, 2> t;
  double area = 0.0;
};

std::vector<ShellPoint> shell_points(const FeElement& e, const Mat3X& X) {
  std::vector<ShellPoint> out;
  const double g = 1.0 / std::sqrt(3.0);
  const bool triangle = e.shape == FeShape::triangle3;
  const std::vector<Eigen::Vector2d> places = triangle ? std::vector<Eigen::Vector2d>{{1.0 / 3, 1.0 / 3}} : std::vector<Eigen::Vector2d>{{-g, -g}, {g, -g}, {g, g}, {-g, g}};
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

MatX second_order_loads(const FeModel& model, const FeSystem& system, const MatX& U) {
  const int n = static_cast<int>(U.cols()), pairs = n * (n + 1) / 2;
  MatX g = MatX::Zero(system.size, pairs);
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::point_mass) continue;
    const FeMaterial& material = model.materials[e.material];
    const Mat3X X = positions(model, e);
    std::vector<Mat3X> u;
    for (int k = 0; k < n; ++k) u.push_back(field_at(model, system, e, U, k));
    std::vector<MatX> forces(pairs, MatX::Zero(3, e.count));
    if (fe_is_shell(e.shape)) {
      const double c = material.youngs_modulus / (1 - material.poisson * material.poisson) * e.thickness;
      for (const ShellPoint& p : shell_points(e, X)) {
        std::vector<Eigen::Matrix<double, 3, 2>> H;
        for (int k = 0; k < n; ++k) H.push_back(u[k] * p.dN);
        for (int k = 0, pair = 0; k < n; ++k)
          for (int j = 0; j <= k; ++j, ++pair) {
            const Eigen::Matrix2d E = 0.5 * (H[j].transpose() * H[k] + H[k].transpose() * H[j]);
            Eigen::Matrix2d N = c * ((1 - material.poisson) * E + material.poisson * E.trace() * Eigen::Matrix2d::Identity());
            forces[pair] += p.area * p.t * N * p.dN.transpose();
          }
      }
    } else {
      const double mu = material.youngs_modulus / (2 * (1 + material.poisson)), lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
      for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::stiffness, X, e.id)) {
        std::vector<Mat3> H;
        for (int k = 0; k < n; ++k) H.push_back(u[k] * p.dN);
        for (int k = 0, pair = 0; k < n; ++k)
          for (int j = 0; j <= k; ++j, ++pair) {
            const Mat3 E = 0.5 * (H[j].transpose() * H[k] + H[k].transpose() * H[j]);
            const Mat3 S = 2 * mu * E + lambda * E.trace() * Mat3::Identity();
            forces[pair].noalias() += p.volume * S * p.dN.transpose();
          }
      }
    }
    for (int pair = 0; pair < pairs; ++pair)
      for (int i = 0; i < e.count; ++i)
        for (int d = 0; d < 3; ++d) g(system.dof[model.connectivity[e.first + i]][d], pair) += forces[pair](d, i);
  }
  return g;
}

std::vector<MatX> nodal_stress(const FeModel& model, const FeSystem& system, const MatX& U, const std::vector<int>& nodes) {
  const int n = static_cast<int>(U.cols());
  std::unordered_map<int, int> place;
  for (size_t i = 0; i < nodes.size(); ++i) place.emplace(nodes[i], static_cast<int>(i));
  std::vector<MatX> sum(nodes.size(), MatX::Zero(6, n));
  std::vector<int> count(nodes.size(), 0);
  for (const FeElement& e : model.elements) {
    if (!fe_is_solid(e.shape)) continue;
    bool wanted = false;
    for (int i = 0; i < e.count; ++i) wanted = wanted || place.contains(model.connectivity[e.first + i]);
    if (!wanted) continue;
    const Mat3X X = positions(model, e);
    for (int k = 0; k < n; ++k) {
      const MatX stress = solid_nodal_stress(e.shape, e.formulation, X, model.materials[e.material], field_at(model, system, e, U, k), e.id);
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
