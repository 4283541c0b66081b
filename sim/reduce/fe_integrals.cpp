// Mass integrals, second-order loads, stresses. See fe_integrals.h.
#include "sim/reduce/fe_integrals.h"

#include "sim/base/spatial.h"
#include "sim/reduce/dense_products.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_turning_mass.h"

#include <array>

namespace flexframe::sim {
namespace {

constexpr int tensor_row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

// e_a x u at the nodes' translations; what rotations add is in fe_turning_mass.
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

}  // namespace

RigidMass rigid_mass(const FeModel& model, const FeSystem& system) {
  const MatX R = rigid_motions(model, system);
  const MatX G = product_tn(R, symmetric_product(system.M, R));
  RigidMass out;
  out.mass = G.topLeftCorner<3, 3>().trace() / 3.0;
  out.directions = G.diagonal().head<3>();
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
  out.J += turned_inertia(model, system, turning_masses(model, system), U);
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
  add_turning_loads(model, system, turning_masses(model, system), out.rightCols(6));
  return out;
}

QuadraticMass quadratic_mass(const FeModel& model, const FeSystem& system, const MatX& U) {
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
  const std::vector<TurningMass> masses = turning_masses(model, system);
  if (masses.empty()) return out;
  TurnedMass turned = turned_mass(model, system, masses, U);
  out.md2 = std::move(turned.md);
  for (int a = 0; a < 3; ++a) out.Cr1[a] += turned.Cr[a];
  for (int r = 0; r < 6; ++r) out.J2[r] += turned.J[r];
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

// Membrane forces of a shell, and the moments that come with them where the nodes lie beside its middle or layers are not alike on both
// sides: plane stress in its plane. The gradient has no part along the normal, so neither has the strain.
template <class Point, class ShellPoint>
void shell_second_order(const FeModel& model, const FeElement& e, const Mat3X& X, const Point& point, const ShellPoint& shell_point) {
  const bool plain = e.section < 0 && !model.materials[e.material].elasticity;
  for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) {
    const MatX dN = p.dN * p.axes.leftCols<2>().transpose();
    if (plain) {
      const FeMaterial& m = model.materials[e.material];
      // The pressure's part along the normal does no work on gradients in the plane.
      point(dN, p.area * e.thickness, m.youngs_modulus * m.poisson / (1 - m.poisson * m.poisson), m.youngs_modulus / (2 * (1 + m.poisson)));
      continue;
    }
    const FeShellLaw law = shell_law(model, e, p.axes);
    constexpr std::array<int, 3> plane = {0, 1, 3};
    Mat6 A = Mat6::Zero(), B = Mat6::Zero();
    A(plane, plane) = law.A;
    B(plane, plane) = law.B;
    const Mat6 T = stress_turn(p.axes);
    shell_point(dN, p.area, T * A * T.transpose(), T * B * T.transpose(), p.axes.col(2));
  }
}

bool bends(const FeModel& model, const FeElement& e) { return e.shape == FeShape::beam2 && !model.beam_sections[e.section].truss; }

// Second order of a beam's strains in its fields (u', theta, theta'), a section turned by the rotation vector theta (J. C. Simo, A finite
// strain beam formulation, CMAME 49 (1985), expanded): of the line and its shear, of twist and bending; fibres beside the axis are
// stretched by twist.
Vec6 beam_strain(const Eigen::Matrix<double, 9, 1>& f, double spread) {
  const Vec3 slope = f.head<3>(), theta = f.segment<3>(3), bend = f.tail<3>();
  Vec6 out;
  out.head<3>() = 0.5 * theta.cross(Vec3(theta.cross(Vec3(Vec3::UnitX())))) - theta.cross(slope);
  out.tail<3>() = -0.5 * theta.cross(bend);
  out(0) += 0.5 * spread * bend.x() * bend.x();
  return out;
}

// Calls visit(element, point, S) at each point of each beam; S: second derivatives of the six strains, a column per pair.
template <class Visit>
void each_beam_strain(const FeModel& model, const FeSystem& system, const MatX& U, const Pairs& pairs, const Visit& visit) {
  MatX S(6, pairs.size());
  for (const FeElement& e : model.elements) {
    if (!bends(model, e)) continue;
    MatX motions(12, U.cols());
    for (Eigen::Index i = 0; i < 2; ++i)
      for (int d = 0; d < 6; ++d) motions.row(6 * i + d) = U.row(system.dof[model.connectivity[e.first + i]][d]);
    for (const FeBeamPoint& p : beam_points(model.beam_sections[e.section], model.materials[e.material], positions(model, e), e.id)) {
      const MatX fields = p.fields * motions;
      Mat6X alone(6, U.cols());
      for (Eigen::Index k = 0; k < U.cols(); ++k) alone.col(k) = beam_strain(fields.col(k), p.spread);
      for (int c = 0; c < pairs.size(); ++c)
        S.col(c) = beam_strain(fields.col(pairs.j[c]) + fields.col(pairs.k[c]), p.spread) - alone.col(pairs.j[c]) - alone.col(pairs.k[c]);
      visit(e, p, S);
    }
  }
}

// Calls visit(element, dN (nodes x 3), volume, S) at each integration point; S: six rows xx yy zz xy yz xz of the stress of sym(grad u_j^T
// grad u_k) per pair, for shells the membrane stress in space axes. turn(element, dN, area, M, normal): likewise moments of shells, which
// bend them as the gradient of rotation x normal.
template <class Visit, class Turn>
void each_second_order_stress(const FeModel& model, const FeSystem& system, const MatX& U, const Pairs& pairs, const Visit& visit,
                              const Turn& turn) {
  const Eigen::Index n = U.cols(), count = pairs.size();
  // One row per component, so that the loops over pairs and fields run over neighbours in memory.
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Rows fields = U;
  Rows H(9, n), S(6, count);
  MatX local, gradients;
  constexpr Eigen::Index first_of[6] = {0, 1, 2, 0, 1, 0}, second_of[6] = {0, 1, 2, 1, 2, 2};
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::point_mass || e.shape == FeShape::lumped || bends(model, e)) continue;
    const Mat3X X = positions(model, e);
    local.resize(3 * n, e.count);
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      for (Eigen::Index d = 0; d < 3; ++d) local.col(i).segment(d * n, n) = fields.row(dof[d]).transpose();
    }
    // Twice the strains on the diagonal, engineering shear strains beside it, times mu.
    const auto strains = [&](const MatX& dN, double mu) {
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
    };
    const auto point = [&](const MatX& dN, double volume, double lambda, double mu) {
      strains(dN, mu);
      // mu (...) on the diagonal is 2 mu E; the trace of E from it.
      for (int p = 0; p < count; ++p) {
        const double pressure = lambda / (2.0 * mu) * (S(0, p) + S(1, p) + S(2, p));
        for (int c = 0; c < 3; ++c) S(c, p) += pressure;
      }
      visit(e, dN, volume, S);
    };
    // Any elasticity: C in space axes.
    const auto matrix_point = [&](const MatX& dN, double volume, const Mat6& C) {
      strains(dN, 1.0);
      S.topRows(3) *= 0.5;
      S = (C * S).eval();
      visit(e, dN, volume, S);
    };
    const auto shell_point = [&](const MatX& dN, double area, const Mat6& A, const Mat6& B, const Vec3& normal) {
      strains(dN, 1.0);
      S.topRows(3) *= 0.5;
      if (!B.isZero(0.0)) turn(e, dN, area, Rows(B * S), normal);
      S = (A * S).eval();
      visit(e, dN, area, S);
    };
    if (e.shape == FeShape::beam2) {
      // A rod: the axial force alone, strain du/ds . du/ds / 2, stress E along the axis.
      const Vec3 axis = X.col(1) - X.col(0);
      const double L = axis.norm(), E = model.materials[e.material].youngs_modulus;
      MatX dN(2, 3);
      dN << -axis.transpose() / (L * L), axis.transpose() / (L * L);
      point(dN, model.beam_sections[e.section].area * L, 0.0, 0.5 * E);
    } else if (fe_is_shell(e.shape)) {
      shell_second_order(model, e, X, point, shell_point);
    } else if (model.materials[e.material].elasticity) {
      const Mat6 C = elasticity(material_in_space(model, e));
      for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::stiffness, X, e.id)) matrix_point(p.dN, p.volume, C);
    } else {
      const FeMaterial& material = model.materials[e.material];
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
  const auto push = [&](const FeElement& e, const MatX& dN, double volume, const auto& S) {
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      const double x = volume * dN(i, 0), y = volume * dN(i, 1), z = volume * dN(i, 2);
      for (int d = 0; d < 3; ++d) g.row(dof[d]) += x * S.row(stress_row[d][0]) + y * S.row(stress_row[d][1]) + z * S.row(stress_row[d][2]);
    }
  };
  const auto turn = [&](const FeElement& e, const MatX& dN, double area, const auto& M, const Vec3& normal) {
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      const Mat3 lever = area * skew(normal);
      for (int d = 0; d < 3; ++d)
        for (int b = 0; b < 3; ++b)
          for (int a = 0; a < 3; ++a)
            if (lever(d, a) != 0.0) g.row(dof[3 + d]) += lever(d, a) * dN(i, b) * M.row(stress_row[a][b]);
    }
  };
  each_second_order_stress(model, system, U, pairs, push, turn);
  each_beam_strain(model, system, U, pairs, [&](const FeElement& e, const FeBeamPoint& p, const MatX& S) {
    const MatX forces = p.weight * p.forces.transpose() * S;
    for (Eigen::Index i = 0; i < 2; ++i)
      for (int d = 0; d < 6; ++d) g.row(system.dof[model.connectivity[e.first + i]][d]) += forces.row(6 * i + d);
  });
  return g;
}

MatX second_order_work(const FeModel& model, const FeSystem& system, const MatX& U, const MatX& W) {
  const int n = static_cast<int>(U.cols()), loads = static_cast<int>(W.cols());
  const Pairs pairs(n, 0, n * (n + 1) / 2);
  MatX out = MatX::Zero(pairs.size(), loads);
  if (loads == 0) return out;
  MatX strain(6, loads);
  const auto push = [&](const FeElement& e, const MatX& dN, double volume, const auto& S) {
    strain.setZero();
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      for (int d = 0; d < 3; ++d)
        for (int b = 0; b < 3; ++b) strain.row(stress_row[d][b]) += volume * dN(i, b) * W.row(dof[d]);
    }
    out.noalias() += S.transpose() * strain;
  };
  const auto turn = [&](const FeElement& e, const MatX& dN, double area, const auto& M, const Vec3& normal) {
    strain.setZero();
    const Mat3 lever = area * skew(normal);
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      for (int d = 0; d < 3; ++d)
        for (int b = 0; b < 3; ++b)
          for (int a = 0; a < 3; ++a)
            if (lever(d, a) != 0.0) strain.row(stress_row[a][b]) += lever(d, a) * dN(i, b) * W.row(dof[3 + d]);
    }
    out.noalias() += M.transpose() * strain;
  };
  each_second_order_stress(model, system, U, pairs, push, turn);
  each_beam_strain(model, system, U, pairs, [&](const FeElement& e, const FeBeamPoint& p, const MatX& S) {
    MatX motions(12, loads);
    for (Eigen::Index i = 0; i < 2; ++i)
      for (int d = 0; d < 6; ++d) motions.row(6 * i + d) = W.row(system.dof[model.connectivity[e.first + i]][d]);
    out.noalias() += p.weight * S.transpose() * (p.forces * motions);
  });
  return out;
}

namespace {

MatX shell_stress(const FeModel& model, const FeElement& e, const Mat3X& X, const MatX& motions, bool other_face) {
  if (e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8)
    return curved_shell_nodal_stress(
        e.shape, X, [&](const Mat3& Q, const VecX& N) { return shell_law_at(model, e, Q, N); }, motions, e.id, other_face);
  double area = 0.0;
  return shell_nodal_stress(e.shape, X, shell_law(model, e, shell_axes(e.shape, X, e.id, area)), motions, e.id, other_face);
}

}  // namespace

MatX element_stress(const FeModel& model, const FeSystem& system, const FeElement& e, const MatX& U, bool other_face) {
  const Eigen::Index n = U.cols();
  const Mat3X X = positions(model, e);
  if (!fe_is_shell(e.shape)) {
    MatX u(3 * static_cast<Eigen::Index>(e.count), n);
    for (int i = 0; i < e.count; ++i)
      for (int d = 0; d < 3; ++d) u.row(3 * i + d) = U.row(system.dof[model.connectivity[e.first + i]][d]);
    return solid_stress_matrix(e.shape, e.formulation, X, material_in_space(model, e), e.id) * u;
  }
  MatX out(6 * static_cast<Eigen::Index>(e.count), n);
  for (int k = 0; k < n; ++k) out.col(k) = shell_stress(model, e, X, motions_at(model, system, e, U, k), other_face).reshaped();
  return out;
}

}  // namespace flexframe::sim
