// The complete kinetic energy of beams that bend and twist: against the truncated one where that holds, against a sum over particles,
// and its equations of motion against the conservation laws that they must keep.
#include "sim/base/spatial.h"
#include "sim/bodies/axis_mass.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/normal_modes.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <random>

namespace flexframe::sim::test_axis_mass {
namespace {

constexpr BeamEffects kAll = {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true};

// A thin beam: the section's radius is a thousandth of the length.
BeamDef thin_beam(Boundary boundary) {
  BeamDef def;
  def.length = 1.3;
  def.section.area = 2.1e-6;
  def.section.iy = 1.2e-12;
  def.section.iz = 2.0e-12;
  def.section.iyz = 0.3e-12;
  def.section.j = 1.5e-12;
  def.section.shear_y = 0.8;
  def.section.shear_z = 0.7;
  def.material = {2700.0, 7e10, 0.3};
  def.boundary = boundary;
  def.elements = 3;
  def.modes = {{"axial", {1}}, {"bending_xy", {1, 2, 4}}, {"bending_xz", {1, 3}}, {"torsion", {1, 2}}};
  return def;
}

struct Case {
  std::string name;
  FlexibleBody body;
};

// A stout one, whose tilted sections count.
Case stout_beam() {
  BeamDef def = thin_beam(Boundary::clamped_free);
  def.section.area = 2.1e-2;
  for (double* inertia : {&def.section.iy, &def.section.iz, &def.section.iyz, &def.section.j}) *inertia *= 1e8;
  BeamEffects shear = kAll;
  shear.shear = true;
  return {"stout elements with shear", make_fe_beam(def, shear)};
}

// Every maker, on the axes of two boundaries, in its own coordinates and in eigenmodes.
std::vector<Case> cases() {
  std::vector<Case> out;
  for (const Boundary boundary : {Boundary::clamped_free, Boundary::free_free}) {
    const std::string where = boundary == Boundary::free_free ? ", mean axes" : ", clamped";
    const BeamDef def = thin_beam(boundary);
    BeamEffects shear = kAll;
    shear.shear = true;
    out.push_back({"elements" + where, make_fe_beam(def, kAll)});
    out.push_back({"elements with shear" + where, make_fe_beam(def, shear)});
    out.push_back({"eigenforms" + where, make_modal_beam(def, kAll)});
    MatX modes;
    out.push_back({"eigenmodes" + where, to_normal_modes(out.front().body, modes)});
    if (boundary == Boundary::free_free) out.push_back({"volume" + where, make_modal_volume(def, kAll)});
  }
  // Each with u2 multiplied out too, where the program does that.
  for (size_t k = out.size(); k-- > 0;) {
    Case series = out[k];
    multiply_out(series.body.axis);
    if (!series.body.axis.series) continue;
    series.name += ", multiplied out";
    out.push_back(std::move(series));
  }
  return out;
}

VecX uniform(Eigen::Index n, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  VecX q(n);
  for (Eigen::Index i = 0; i < n; ++i) q[i] = number(generator);
  return q;
}

// Largest rotation of a node is `size`.
VecX slopes(const FlexibleBody& body, unsigned seed, double size) {
  const VecX q = uniform(body.n, seed);
  double largest = 0.0;
  for (const FlexibleNode& node : body.nodes) largest = std::max(largest, (node.psi * q).cwiseAbs().maxCoeff());
  return (size / largest) * q;
}

MatX whole(const FlexibleBody& body, const BodyTerms& t) {
  MatX M(6 + body.n, 6 + body.n);
  M << t.Mrr, t.Mre, t.Mre.transpose(), elastic_mass(body, t);
  return M;
}

MatX mass_at(const FlexibleBody& body, const VecX& q) {
  BodyTerms t;
  reserve(body, t);
  update_mass(body, q, t);
  return whole(body, t);
}

FlexibleBody truncated(const FlexibleBody& body) {
  FlexibleBody out = body;
  out.axis = {};
  return out;
}

TEST(AxisMass, AgreesWithTheTruncatedMatrixUpToTheOrdersThatItKeeps) {
  std::vector<Case> all = cases();
  all.push_back(stout_beam());
  for (const auto& [name, one] : all) {
    const FlexibleBody& body = one;  // clang 14 captures no structured bindings
    ASSERT_TRUE(has_axis_mass(body)) << name;
    const FlexibleBody series = truncated(body);
    const VecX at_rest = VecX::Zero(body.n);
    EXPECT_LT((mass_at(body, at_rest) - mass_at(series, at_rest)).cwiseAbs().maxCoeff(), 1e-12 * body.mass) << name;
    // Mrr to second order, Mre to first, Mee at rest: what is left falls by 8, 4, 2 when the deformation is halved.
    const VecX q = slopes(body, 3, 1.0);
    const auto left = [&](double size) {
      const MatX d = mass_at(body, size * q) - mass_at(series, size * q);
      return Vec3(d.topLeftCorner(6, 6).norm(), d.topRightCorner(6, body.n).norm(), d.bottomRightCorner(body.n, body.n).norm());
    };
    const Vec3 ratio = left(0.004).cwiseQuotient(left(0.002));
    EXPECT_NEAR(ratio[0], 8.0, 0.5) << name;
    EXPECT_NEAR(ratio[1], 4.0, 0.3) << name;
    EXPECT_NEAR(ratio[2], 2.0, 0.1) << name;
  }
}

TEST(AxisMass, IsTheSameMultipliedOut) {
  int compared = 0, smaller = 0;
  for (const Case& one : cases()) {
    FlexibleBody integrated = one.body;
    integrated.axis.series = nullptr;
    if (!one.body.axis.series) continue;
    ++compared;
    EXPECT_LE(one.body.axis.series->root_mass.size(), one.body.axis.x.size()) << one.name;
    if (one.body.axis.series->root_mass.size() < one.body.axis.x.size()) ++smaller;
    BodyTerms a, b;
    reserve(integrated, a);
    reserve(one.body, b);
    // Far beyond what a beam of its kind bears: u2 counts as much as the rest.
    for (const double size : {0.01, 1.0}) {
      const VecX q = slopes(integrated, 11, size), qd = slopes(integrated, 12, 20.0 * size);
      const Vec6 V = (Vec6() << 0.3, -2.0, 1.1, 4.0, -3.0, 7.0).finished();
      update_mass(integrated, q, a);
      update_mass(one.body, q, b);
      update_velocity_terms(integrated, V, qd, a);
      update_velocity_terms(one.body, V, qd, b);
      const MatX M = whole(integrated, a);
      EXPECT_LT((M - whole(one.body, b)).norm(), 1e-13 * M.norm()) << one.name;
      EXPECT_LT((a.cr - b.cr).norm(), 1e-12 * a.cr.norm()) << one.name;
      EXPECT_LT((a.ce - b.ce).norm(), 1e-12 * a.ce.norm()) << one.name;
    }
  }
  EXPECT_GE(compared, 4);
  EXPECT_GE(smaller, 1);  // few coordinates, many particles
}

TEST(AxisMass, IsTheSumOverParticles) {
  BeamDef def = thin_beam(Boundary::free_free);
  def.elements = 2;
  def.all_elements = true;  // the frames at the particles move no nodes
  const FlexibleBody axis = make_fe_beam(def, kAll);
  for (Eigen::Index p = 0; p < axis.axis.x.size(); ++p) def.frames[fmt::format("p{}", p)] = axis.axis.x[p] / def.length;
  const FlexibleBody body = make_fe_beam(def, kAll);
  const VecX q = slopes(body, 5, 0.3);
  MatX sum = MatX::Zero(6 + body.n, 6 + body.n);
  for (const FlexibleNode& node : body.nodes) {
    if (node.name.front() != 'p') continue;
    const Eigen::Index p = std::stoi(node.name.substr(1));
    Vec3 r = node.origin + node.phi * q;
    MatX J(3, 6 + body.n);
    J.rightCols(body.n) = node.phi;
    for (size_t a = 0; a < 3; ++a) {
      J.row(static_cast<Eigen::Index>(a)).tail(body.n) += (node.phi2[a] * q).transpose();
      r[static_cast<Eigen::Index>(a)] += 0.5 * q.dot(node.phi2[a] * q);
    }
    J.leftCols<3>().setIdentity();
    J.middleCols<3>(3) = -skew(r);
    sum += axis.axis.root_mass[p] * axis.axis.root_mass[p] * J.transpose() * J;
  }
  // the spin of the sections about x
  sum(3, 3) += 2700.0 * 3.2e-12 * def.length;
  sum.row(3).tail(body.n) += body.axis.Cr0.row(0);
  sum.col(3).tail(body.n) += body.axis.Cr0.row(0).transpose();
  sum.bottomRightCorner(body.n, body.n) += body.axis.Me;
  // within an element squared slopes are integrated as their interpolating cubic
  EXPECT_LT((mass_at(body, q) - sum).cwiseAbs().maxCoeff(), 2e-4 * sum.cwiseAbs().maxCoeff());
  const VecX straight = slopes(body, 5, 1e-3);
  EXPECT_GT((mass_at(body, q) - mass_at(body, straight)).cwiseAbs().maxCoeff(), 1e-2 * sum.cwiseAbs().maxCoeff());
}

TEST(AxisMass, StaysPositiveWhereTheTruncatedMatrixDoesNot) {
  for (const auto& [name, body] : cases()) {
    for (const double size : {0.01, 0.1, 0.5, 1.0}) {
      const VecX q = slopes(body, 9, size);
      const MatX M = mass_at(body, q);
      EXPECT_EQ(Eigen::LLT<MatX>(M).info(), Eigen::Success) << name << " at " << size;
      EXPECT_LT((M - M.transpose()).cwiseAbs().maxCoeff(), 1e-13 * M.cwiseAbs().maxCoeff()) << name;
      if (size >= 0.1) {
        EXPECT_NE(Eigen::LLT<MatX>(mass_at(truncated(body), q)).info(), Eigen::Success) << name << " at " << size;
      }
    }
  }
}

TEST(AxisMass, FreeMotionKeepsEnergyAndMomentum) {
  // M a + c = 0 without forces: rates of energy, momentum and angular momentum vanish, by central differences along the motion.
  std::vector<Case> all = cases();
  all.push_back(stout_beam());
  for (const auto& [name, one] : all) {
    const FlexibleBody& body = one;
    BodyTerms t;
    reserve(body, t);
    const VecX q = slopes(body, 21, 0.4), qd = slopes(body, 22, 3.0);
    Vec6 V;
    V << 0.3, -0.7, 0.5, 1.1, 0.4, -0.6;
    update_mass(body, q, t);
    update_velocity_terms(body, V, qd, t);
    VecX c(6 + body.n);
    c << t.cr, t.ce;
    const VecX a = -whole(body, t).ldlt().solve(c);
    // Frame of the world: at the body's now, then moved with V.
    const auto state = [&](double dt) {
      const VecX at = q + dt * qd + 0.5 * dt * dt * a.tail(body.n), rate = qd + dt * a.tail(body.n);
      const Vec6 twist = V + dt * a.head<6>();
      BodyTerms s;
      reserve(body, s);
      update_mass(body, at, s);
      const Vec6 P = s.Mrr * twist + s.Mre * rate;
      const Mat3 R = rotation_exp(dt * V.tail<3>());
      const Vec3 place = dt * V.head<3>();
      VecX out(7);
      out << kinetic_energy(body, s, twist, rate), R * P.head<3>(), R * P.tail<3>() + place.cross(Vec3(R * P.head<3>()));
      return out;
    };
    const double dt = 1e-5;
    const VecX near = state(dt) - state(-dt), far = state(2.0 * dt) - state(-2.0 * dt);
    const VecX rate = (8.0 * near - far) / (12.0 * dt), size = state(0.0);
    EXPECT_LT(std::abs(rate[0]), 1e-6 * size[0]) << name;
    EXPECT_LT(rate.segment(1, 3).norm(), 1e-6 * size.segment(1, 3).norm()) << name;
    EXPECT_LT(rate.tail(3).norm(), 1e-6 * size.tail(3).norm()) << name;
  }
}

TEST(AxisMass, ExistsOnlyWhereBendingMeetsTwist) {
  const BeamDef def = thin_beam(Boundary::clamped_free);
  EXPECT_FALSE(has_axis_mass(make_fe_beam(def, {.bending_xy = true, .bending_xz = true, .stiffening = true})));
  EXPECT_FALSE(has_axis_mass(make_fe_beam(def, {.bending_xy = true, .bending_xz = true, .torsion = true})));
  EXPECT_FALSE(has_axis_mass(make_fe_beam(def, {.torsion = true, .stiffening = true})));
  EXPECT_TRUE(has_axis_mass(make_fe_beam(def, {.bending_xy = true, .torsion = true, .stiffening = true})));
}

}  // namespace
}  // namespace flexframe::sim::test_axis_mass
