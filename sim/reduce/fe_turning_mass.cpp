// Inertia that turns with nodes. See fe_turning_mass.h.
#include "sim/reduce/fe_turning_mass.h"

#include "sim/base/spatial.h"
#include "sim/reduce/dense_products.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_sections.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace flexframe::sim {
namespace {

constexpr int row_of[6] = {0, 1, 2, 0, 0, 1}, column_of[6] = {0, 1, 2, 1, 2, 2};

Vec6 as_rows(const Mat3& J) {
  Vec6 out;
  for (int r = 0; r < 6; ++r) out(r) = J(row_of[r], column_of[r]);
  return out;
}

// Derivative of the inertia of two particles' products: 2 a . b 1 - a b^T - b a^T.
Mat3 spread(const Vec3& a, const Vec3& b) { return 2.0 * a.dot(b) * Mat3::Identity() - a * b.transpose() - b * a.transpose(); }

// Half the inertia of a beam's sections at each of its nodes.
void add_beam(const FeModel& model, const FeElement& e, std::vector<TurningMass>& out) {
  const FeBeamSection& s = model.beam_sections[e.section];
  if (s.truss) return;
  const int* nodes = &model.connectivity[e.first];
  const Vec3 axis = model.nodes[nodes[1]] - model.nodes[nodes[0]], t = axis.normalized();
  const Vec3 n1 = (s.n1 - t.dot(s.n1) * t).normalized(), n2 = t.cross(n1);
  const Mat3 J = (s.I11 + s.I22) * t * t.transpose() + s.I11 * n1 * n1.transpose() + s.I22 * n2 * n2.transpose() -
                 s.I12 * (n1 * n2.transpose() + n2 * n1.transpose());
  const double half = 0.5 * axis.norm() * model.materials[e.material].density;
  for (int k = 0; k < 2; ++k) out.push_back({nodes[k], Vec3::Zero(), half * J});
}

// Of shells whose mass lies beside their nodes (offsets, layers that are not alike on both sides), summed up at each node; the own
// thickness of others is left out.
void add_shell(const FeModel& model, const FeElement& e, std::map<int, TurningMass>& out) {
  if (e.section < 0) return;
  Mat3X X(3, e.count);
  for (int k = 0; k < e.count; ++k) X.col(k) = model.nodes[model.connectivity[e.first + k]];
  const auto add = [&](const FeShellLaw& law, const Vec3& normal, const VecX& areas) {
    const double thickness = law.plies.back().upper - law.plies.front().lower;
    if (!(std::abs(law.m1) > 1e-9 * law.m0 * thickness)) return;
    const Mat3 across = Mat3::Identity() - normal * normal.transpose();
    for (int k = 0; k < e.count; ++k) {
      TurningMass& m = out[model.connectivity[e.first + k]];
      m.node = model.connectivity[e.first + k];
      m.s += areas(k) * law.m1 * normal;
      m.J += areas(k) * law.m2 * across;
    }
  };
  if (e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8) {
    for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) add(shell_law_at(model, e, p.axes, p.N), p.axes.col(2), p.area * p.N);
    return;
  }
  double area = 0.0;
  const Mat3 Q = shell_axes(e.shape, X, e.id, area);
  add(shell_law(model, e, Q), Q.col(2), VecX::Constant(e.count, area / e.count));
}

// Motions of a mass's node in the fields, 6 x n.
MatX motions_of(const FeSystem& system, int node, const MatX& U) {
  MatX out = MatX::Zero(6, U.cols());
  for (int d = 0; d < 6; ++d)
    if (const int row = system.dof[node][d]; row >= 0) out.row(d) = U.row(row);
  return out;
}

// Column d: first order of the inertia in the node's rotation d.
Eigen::Matrix<double, 6, 3> turned_once(const Vec3& place, const TurningMass& m) {
  Eigen::Matrix<double, 6, 3> out;
  for (int d = 0; d < 3; ++d) {
    const Vec3 theta = Vec3::Unit(d);
    const Mat3 turned = skew(theta) * m.J - m.J * skew(theta) + spread(place, theta.cross(m.s));
    out.col(d) = as_rows(turned);
  }
  return out;
}

// Second order in the motions a (of the rate j) and b (k) of the node, translation and rotation: md, Cr, J.
Eigen::Matrix<double, 12, 1> turned_twice(const Vec3& place, const TurningMass& m, const Vec6& a, const Vec6& b) {
  const Vec3 u = a.head<3>(), v = b.head<3>(), theta = a.tail<3>(), phi = b.tail<3>();
  const Vec3 moved = 0.5 * (theta.cross(Vec3(phi.cross(m.s))) + phi.cross(Vec3(theta.cross(m.s))));
  const Mat3 both = 0.5 * (skew(theta) * skew(phi) + skew(phi) * skew(theta));
  const Mat3 products = 0.5 * m.J.trace() * Mat3::Identity() - m.J;  // int r r^T dm
  const Mat3 J = both * m.J + m.J * both - skew(theta) * m.J * skew(phi) - skew(phi) * m.J * skew(theta) + spread(u, phi.cross(m.s)) +
                 spread(v, theta.cross(m.s)) + spread(place, moved);
  Eigen::Matrix<double, 12, 1> out;
  out.head<3>() = moved;
  out.segment<3>(3) = products * phi.cross(theta) + Vec3(phi.cross(m.s)).cross(u) + place.cross(moved) +
                      0.5 * (phi.cross(Vec3(m.J * theta)) + theta.cross(Vec3(m.J * phi)));
  out.tail<6>() = as_rows(J);
  return out;
}

}  // namespace

std::vector<TurningMass> turning_masses(const FeModel& model, const FeSystem& system) {
  std::vector<TurningMass> out;
  if (model.matrices) return out;
  std::map<int, TurningMass> shells;
  for (const FeElement& e : model.elements) {
    if (e.shape == FeShape::beam2) add_beam(model, e, out);
    if (fe_is_shell(e.shape)) add_shell(model, e, shells);
    if (e.shape != FeShape::lumped || e.count != 1 || !model.lumps[e.section].turns) continue;
    const MatX& M = model.lumps[e.section].M;
    const Mat3 lever = 0.5 * (M.topRightCorner<3, 3>() - M.topRightCorner<3, 3>().transpose());  // -skew(s)
    TurningMass m{model.connectivity[e.first], Vec3(-lever(2, 1), -lever(0, 2), -lever(1, 0)), M.bottomRightCorner<3, 3>()};
    if (!m.s.isZero(0.0) || !m.J.isZero(0.0)) out.push_back(m);
  }
  for (const auto& [node, m] : shells) out.push_back(m);
  std::erase_if(out, [&](const TurningMass& m) { return system.dof[m.node][3] < 0; });
  return out;
}

Mat6X turned_inertia(const FeModel& model, const FeSystem& system, const std::vector<TurningMass>& masses, const MatX& U) {
  Mat6X out = Mat6X::Zero(6, U.cols());
  for (const TurningMass& m : masses) out += turned_once(model.nodes[m.node], m) * motions_of(system, m.node, U).bottomRows(3);
  return out;
}

void add_turning_loads(const FeModel& model, const FeSystem& system, const std::vector<TurningMass>& masses, Eigen::Ref<MatX> loads) {
  for (const TurningMass& m : masses) {
    const Eigen::Matrix<double, 6, 3> turned = turned_once(model.nodes[m.node], m);
    for (int d = 0; d < 3; ++d) loads.row(system.dof[m.node][3 + d]) += turned.col(d).transpose();
  }
}

TurnedMass turned_mass(const FeModel& model, const FeSystem& system, const std::vector<TurningMass>& masses, const MatX& U) {
  constexpr size_t group = 500;  // nodes at a time, which bounds the memory
  const Eigen::Index n = U.cols();
  TurnedMass out;
  if (masses.empty()) return out;
  std::array<MatX, 12> sums;
  sums.fill(MatX::Zero(n, n));
  for (size_t from = 0; from < masses.size(); from += group) {
    const auto count = static_cast<Eigen::Index>(std::min(group, masses.size() - from));
    MatX motions(6 * count, n);
    std::array<MatX, 12> turned;
    turned.fill(MatX(6 * count, n));
    for (Eigen::Index i = 0; i < count; ++i) {
      const TurningMass& m = masses[from + static_cast<size_t>(i)];
      const MatX own = motions_of(system, m.node, U);
      motions.middleRows(6 * i, 6) = own;
      std::array<Mat6, 12> kernel;
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b) {
          const auto twice = turned_twice(model.nodes[m.node], m, Vec6::Unit(a), Vec6::Unit(b));
          for (int c = 0; c < 12; ++c) kernel[c](a, b) = twice(c);
        }
      for (int c = 0; c < 12; ++c) turned[c].middleRows(6 * i, 6) = kernel[c] * own;
    }
    for (int c = 0; c < 12; ++c) sums[c] += product_tn(motions, turned[c]);
  }
  const bool beside = std::any_of(masses.begin(), masses.end(), [](const TurningMass& m) { return !m.s.isZero(0.0); });
  for (int c = 0; c < 3; ++c) {
    if (beside) out.md[c] = std::move(sums[c]);
    out.Cr[c] = std::move(sums[3 + c]);
  }
  for (int c = 0; c < 6; ++c) out.J[c] = std::move(sums[6 + c]);
  return out;
}

}  // namespace flexframe::sim
