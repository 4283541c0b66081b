// The beam makers' FlexibleBody against first principles: positions against the exact kinematics of a rod, inertia terms and kinetic
// energy against a sum over particles.
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/beam_boundary.h"
#include "sim/bodies/beam_terms.h"
#include "sim/bodies/sid.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <random>

namespace flexframe::sim::test_beam_body {
namespace {

constexpr std::array<Boundary, 6> kBoundaries = {Boundary::clamped_free, Boundary::supported_supported, Boundary::supported_free,
                                                 Boundary::free_free,    Boundary::clamped_clamped,     Boundary::clamped_supported};
constexpr BeamEffects kAll = {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true};

// An unsymmetric section, so that no term hides behind another.
BeamDef general_beam(Boundary boundary) {
  BeamDef def;
  def.length = 1.3;
  def.section.area = 2.1e-4;
  def.section.iy = 3.0e-9;
  def.section.iz = 5.0e-9;
  def.section.iyz = 1.1e-9;
  def.section.j = 4.0e-9;
  def.section.shear_y = 0.8;
  def.section.shear_z = 0.7;
  def.material = {2700.0, 7e10, 0.3};
  def.boundary = boundary;
  def.elements = 3;
  def.modes = {{"axial", {1, 2}}, {"bending_xy", {1, 2, 4}}, {"bending_xz", {1, 3}}, {"torsion", {1, 2}}};
  return def;
}

struct Maker {
  std::string name;
  FlexibleBody (*make)(const BeamDef&, const BeamEffects&);
  bool shear = false;
};

const std::array<Maker, 3> kMakers = {{{"fe", make_fe_beam, false}, {"modal", make_modal_beam, false}, {"fe shear", make_fe_beam, true}}};

VecX random_coordinates(int n, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  VecX q(n);
  for (int i = 0; i < n; ++i) q[i] = uniform(generator);
  return q;
}

// Coordinates whose largest slope is 1, so that the size of q is the size of the rotations.
VecX unit_slopes(const FlexibleBody& body, unsigned seed) {
  VecX q = random_coordinates(body.n, seed);
  double largest = 0.0;
  for (const FlexibleNode& node : body.nodes) largest = std::max(largest, (node.psi * q).cwiseAbs().maxCoeff());
  return q / largest;
}

double quadratic(const MatX& m, const VecX& a, const VecX& b) { return m.size() == 0 ? 0.0 : a.dot(m * b); }

Vec3 second(const FlexibleNode& node, const VecX& a, const VecX& b) {
  return {quadratic(node.phi2[0], a, b), quadratic(node.phi2[1], a, b), quadratic(node.phi2[2], a, b)};
}

const FlexibleNode& node_named(const FlexibleBody& body, const std::string& name) {
  for (const FlexibleNode& node : body.nodes)
    if (node.name == name) return node;
  throw std::runtime_error("no node " + name);
}

Mat3 skew(const Vec3& a) { return (Mat3() << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0).finished(); }
Mat3 turn(const Vec3& a) { return a.norm() == 0.0 ? Mat3::Identity() : Eigen::AngleAxisd(a.norm(), a.normalized()).toRotationMatrix(); }

TEST(BeamBody, SecondOrderPositionsMatchTheExactKinematicsOfARod) {
  // R' = R skew(kappa), r' = R (e1 + gamma), kappa = psi', gamma = phi' - psi x e1: the strains of the linear field, finite rotations
  constexpr int intervals = 600;
  for (const Maker& maker : kMakers)
    for (const Boundary boundary : kBoundaries) {
      BeamDef def = general_beam(boundary);
      for (int i = 0; i <= intervals; ++i) def.frames[fmt::format("s{}", i)] = static_cast<double>(i) / intervals;
      def.all_elements = true;  // these frames move no nodes
      BeamEffects effects = kAll;
      effects.shear = maker.shear;
      const FlexibleBody body = maker.make(def, effects);
      std::vector<const FlexibleNode*> nodes;
      for (int i = 0; i <= intervals; ++i) nodes.push_back(&node_named(body, fmt::format("s{}", i)));
      const VecX direction = unit_slopes(body, 7);
      std::vector<double> errors;
      for (const double size : {0.2, 0.1, 0.05}) {
        const VecX q = size * direction;
        Mat3 R = turn(nodes[0]->psi * q);
        Vec3 r = nodes[0]->phi * q;
        double error = 0.0;
        for (int i = 0; i < intervals; ++i) {
          const FlexibleNode &a = *nodes[i], &b = *nodes[i + 1];
          const double h = b.origin.x() - a.origin.x();
          const Vec3 dpsi = (b.psi - a.psi) * q, psi = 0.5 * (a.psi + b.psi) * q;
          Vec3 gamma = (b.phi - a.phi) * q / h - psi.cross(Vec3::UnitX());
          // u' is the mean of the fibres: those of a twisted section are helices, and the axis shortens (Weber's effect).
          gamma.x() -= 0.5 * (def.section.iy + def.section.iz) / def.section.area * std::pow(dpsi.x() / h, 2);
          r += h * (R * turn(0.5 * dpsi) * (Vec3::UnitX() + gamma));
          R = R * turn(dpsi);
          const Vec3 u = b.phi * q + 0.5 * second(b, q, q);
          error = std::max(error, (r - b.origin - u).norm());
        }
        errors.push_back(error);
      }
      // what is left is of third order: a factor 8 for each halving
      EXPECT_NEAR(errors[0] / errors[1], 8.0, 1.2) << maker.name << " boundary " << static_cast<int>(boundary);
      EXPECT_NEAR(errors[1] / errors[2], 8.0, 1.2) << maker.name << " boundary " << static_cast<int>(boundary);
      EXPECT_LT(errors[2], 1e-3 * def.length);
    }
}

// Particles of the centre line at Gauss points fine enough for the shape functions.
struct Particles {
  FlexibleBody body;
  std::vector<const FlexibleNode*> nodes;
  std::vector<double> length;  // of beam that each stands for
};

Particles particles(const Maker& maker, BeamDef def, BeamEffects effects) {
  constexpr int panels = 12;
  const beam::GaussRule rule = beam::gauss_rule(12);
  Particles out;
  def.all_elements = true;  // these frames move no nodes
  for (int e = 0; e < panels; ++e)
    for (std::size_t g = 0; g < rule.x.size(); ++g) {
      def.frames[fmt::format("p{}", out.length.size())] = (e + rule.x[g]) / panels;
      out.length.push_back(rule.w[g] * def.length / panels);
    }
  effects.shear = maker.shear;
  out.body = maker.make(def, effects);
  for (std::size_t i = 0; i < out.length.size(); ++i) out.nodes.push_back(&node_named(out.body, fmt::format("p{}", i)));
  return out;
}

Mat3 tensor(const Vec6& t) { return (Mat3() << t[0], t[3], t[4], t[3], t[1], t[5], t[4], t[5], t[2]).finished(); }
Mat3 inertia(const Vec3& r) { return r.squaredNorm() * Mat3::Identity() - r * r.transpose(); }

// Per length. Without shear what is alike about all axes across the beam is left out.
Mat3 tensor_of_sections(const BeamDef& def, bool shear) {
  const Section& s = def.section;
  const double alike = shear ? 0.0 : 0.5 * (s.iy + s.iz) - std::hypot(0.5 * (s.iy - s.iz), s.iyz);
  Mat3 out;
  out << s.iy + s.iz, 0.0, 0.0, 0.0, s.iy - alike, -s.iyz, 0.0, -s.iyz, s.iz - alike;
  return def.material.density * out;
}
// Sections turn with their slopes only where they have rotary inertia.
Vec3 turned(const Vec3& angles, bool shear) { return shear ? angles : Vec3(angles.x(), 0.0, 0.0); }

TEST(BeamBody, InertiaTermsAreThoseOfTheParticles) {
  for (const Maker& maker : kMakers)
    for (const Boundary boundary : kBoundaries) {
      SCOPED_TRACE(maker.name + fmt::format(" boundary {}", static_cast<int>(boundary)));
      const BeamDef def = general_beam(boundary);
      const Particles p = particles(maker, def, kAll);
      const FlexibleBody& body = p.body;
      const VecX q = random_coordinates(body.n, 3), qd = random_coordinates(body.n, 4);
      const double mu = def.material.density * def.section.area;
      const Mat3 section = tensor_of_sections(def, maker.shear);
      double mass = 0.0, energy = 0.0;
      Vec3 md0 = Vec3::Zero(), md1 = md0, md2 = md0, cr0 = md0, cr1 = md0;
      Mat3 j0 = Mat3::Zero(), j1 = j0, j2 = j0;
      for (std::size_t i = 0; i < p.nodes.size(); ++i) {
        const FlexibleNode& node = *p.nodes[i];
        const double dm = mu * p.length[i];
        const Vec3 c = node.origin, u1 = node.phi * q, u2 = second(node, q, q), rate = node.phi * qd, rate2 = second(node, q, qd);
        const Vec3 psi = turned(node.psi * q, maker.shear), spin = turned(node.psi * qd, maker.shear);
        const Mat3 A = skew(psi);
        mass += dm;
        md0 += dm * c;
        md1 += dm * u1;
        md2 += dm * u2;
        j0 += dm * inertia(c) + p.length[i] * section;
        j1 += dm * (inertia(c + u1) - inertia(c - u1)) / 2.0;
        j1 += p.length[i] * (A * section - section * A);
        j2 += 2.0 * dm * inertia(u1) + dm * (inertia(c + u2) - inertia(c - u2)) / 2.0;
        cr0 += dm * c.cross(rate) + p.length[i] * section * spin;
        cr1 += dm * (u1.cross(rate) + c.cross(rate2));
        j2 += p.length[i] * (A * A * section + section * A * A - 2.0 * A * section * A);
        cr1 += p.length[i] * ((A * section - section * A) * spin + 0.5 * section * psi.cross(spin));
        energy += dm * rate.squaredNorm() + p.length[i] * spin.dot(section * spin);
      }
      const auto q2 = [&](const auto& blocks) {
        Eigen::VectorXd out(blocks.size());
        for (std::size_t a = 0; a < blocks.size(); ++a) out[static_cast<Eigen::Index>(a)] = quadratic(blocks[a], q, q);
        return out;
      };
      const double L = def.length, tiny = 1e-12;
      EXPECT_NEAR(body.mass, mass, tiny * mass);
      EXPECT_LT((body.md0 - md0).norm(), tiny * mass * L);
      EXPECT_LT((body.md1 * q - md1).norm(), tiny * mass * L);
      EXPECT_LT((q2(body.md2) - md2).norm(), tiny * (1.0 + md2.norm()));
      EXPECT_LT((tensor(body.J0) - j0).norm(), tiny * j0.norm());
      EXPECT_LT((tensor(body.J1 * q) - j1).norm(), tiny * (mass * L * L));
      EXPECT_LT((tensor(Vec6(q2(body.J2))) - j2).norm(), tiny * (1.0 + j2.norm()));
      EXPECT_LT((body.Cr0 * qd - cr0).norm(), tiny * mass * L * L);
      Vec3 cr1_body;
      for (std::size_t a = 0; a < 3; ++a) cr1_body[static_cast<Eigen::Index>(a)] = quadratic(body.Cr1[a], qd, q);
      EXPECT_LT((cr1_body - cr1).norm(), tiny * (1.0 + cr1.norm()));
      EXPECT_NEAR(qd.dot(body.Me * qd), energy, tiny * energy);
      for (const MatX& m : {body.Me, body.Ke, body.md2[0], body.md2[1], body.J2[1], body.J2[5]})
        EXPECT_LT((m - m.transpose()).norm(), 1e-13 * (1e-300 + m.norm()));
      EXPECT_GT(SymmetricEigen(body.Ke).eigenvalues()[0], 0.0);
    }
}

TEST(BeamBody, KineticEnergyNeglectsTermsOfThirdOrderOnly) {
  for (const Maker& maker : kMakers) {
    if (maker.shear) continue;  // its sections turn with the body, which the particles here do not describe
    for (const Boundary boundary : kBoundaries) {
      const BeamDef def = general_beam(boundary);
      const Particles p = particles(maker, def, kAll);
      const FlexibleBody& body = p.body;
      const double mu = def.material.density * def.section.area;
      const Mat3 section = tensor_of_sections(def, false);
      const Vec3 v(0.3, -0.7, 0.5), w(1.1, 0.4, -0.6);
      const VecX q1 = unit_slopes(body, 11), qd1 = unit_slopes(body, 12);
      std::vector<double> errors;
      for (const double size : {0.01, 0.005, 0.0025}) {
        const VecX q = size * q1, qd = size * qd1;
        double particles_energy = 0.0;
        for (std::size_t i = 0; i < p.nodes.size(); ++i) {
          const FlexibleNode& node = *p.nodes[i];
          const Vec3 r = node.origin + node.phi * q + 0.5 * second(node, q, q);
          const Vec3 rate = v + w.cross(r) + node.phi * qd + second(node, q, qd);
          particles_energy += 0.5 * mu * p.length[i] * rate.squaredNorm();
          const Vec3 turning = w + turned(node.psi * qd, false);
          const Mat3 R = turn(turned(node.psi * q, false));
          particles_energy += 0.5 * p.length[i] * turning.dot(R * section * R.transpose() * turning);
        }
        Vec3 md = body.md0 + body.md1 * q, ct = body.md1 * qd, cr = body.Cr0 * qd;
        Vec6 j = body.J0 + body.J1 * q;
        for (std::size_t a = 0; a < 3; ++a) {
          const auto at = static_cast<Eigen::Index>(a);
          md[at] += 0.5 * quadratic(body.md2[a], q, q);
          ct[at] += quadratic(body.md2[a], q, qd);
          cr[at] += quadratic(body.Cr1[a], qd, q);
        }
        for (std::size_t a = 0; a < 6; ++a) j[static_cast<Eigen::Index>(a)] += 0.5 * quadratic(body.J2[a], q, q);
        const double energy = 0.5 * body.mass * v.squaredNorm() + v.dot(w.cross(md)) + v.dot(ct) + 0.5 * w.dot(tensor(j) * w) + w.dot(cr) +
                              0.5 * qd.dot(body.Me * qd);
        errors.push_back(std::abs(energy - particles_energy));
      }
      EXPECT_NEAR(errors[0] / errors[1], 8.0, 1.0) << maker.name << " boundary " << static_cast<int>(boundary);
      EXPECT_NEAR(errors[1] / errors[2], 8.0, 1.0) << maker.name << " boundary " << static_cast<int>(boundary);
    }
  }
}

TEST(BeamBody, SectionsOfShearBeamsTurnWithTheirTensor) {
  // What their rotation has of the kinetic energy: blocks with and without rotary inertia. S: tensor per length, exp(theta) turns it.
  BeamEffects effects = kAll;
  effects.shear = true;
  BeamDef def = general_beam(Boundary::clamped_free), thin = def;
  thin.section.size = {{"rotary_iy", 1e-30}, {"rotary_iz", 1e-30}};
  const Maker& maker = kMakers[2];
  const Particles p = particles(maker, def, effects);
  const FlexibleBody thick = p.body, bare = maker.make(thin, effects);
  const double rho = def.material.density, iy = rho * def.section.iy, iz = rho * def.section.iz, iyz = rho * def.section.iyz;
  Mat3 S;
  S << iy + iz, 0.0, 0.0, 0.0, iy, -iyz, 0.0, -iyz, iz;
  const Vec3 w(1.1, 0.4, -0.6);
  const VecX q1 = unit_slopes(thick, 11), qd1 = unit_slopes(thick, 12);
  const auto blocks = [&](const FlexibleBody& body, const VecX& q, const VecX& qd) {
    Vec3 cr = body.Cr0 * qd;
    Vec6 j = body.J0 + body.J1 * q;
    for (std::size_t a = 0; a < 3; ++a) cr[static_cast<Eigen::Index>(a)] += quadratic(body.Cr1[a], qd, q);
    for (std::size_t a = 0; a < 6; ++a) j[static_cast<Eigen::Index>(a)] += 0.5 * quadratic(body.J2[a], q, q);
    return 0.5 * w.dot(tensor(j) * w) + w.dot(cr) + 0.5 * qd.dot(body.Me * qd);
  };
  const auto error = [&](double size) {
    const VecX q = size * q1, qd = size * qd1;
    double energy = 0.0;
    for (std::size_t i = 0; i < p.nodes.size(); ++i) {
      const Vec3 a = p.nodes[i]->psi * q, rate = p.nodes[i]->psi * qd;
      const Vec3 turning = w + rate + 0.5 * a.cross(rate);
      energy += 0.5 * p.length[i] * turning.dot(turn(a) * S * turn(a).transpose() * turning);
    }
    return blocks(thick, q, qd) - blocks(bare, q, qd) - energy;
  };
  // What is left is of third order, and of fourth in what both signs have in common.
  const auto odd = [&](double size) { return error(size) - error(-size); };
  const auto even = [&](double size) { return error(size) + error(-size); };
  EXPECT_NEAR(odd(0.04) / odd(0.02), 8.0, 0.2);
  EXPECT_NEAR(even(0.04) / even(0.02), 16.0, 0.5);
}

TEST(BeamBody, IdentitiesOfStandardInputDataHoldAndSurviveAFile) {
  for (const Maker& maker : kMakers)
    for (const Boundary boundary : kBoundaries) {
      BeamEffects effects = kAll;
      effects.shear = maker.shear;
      const FlexibleBody body = maker.make(general_beam(boundary), effects);
      const SidFile file = from_flexible_body(body, "beam");
      for (const SidCheck& check : check_sid(file)) EXPECT_LT(check.residual, 1e-9) << maker.name << ' ' << check.identity;
      const FlexibleBody again = to_flexible_body(file, "beam");
      EXPECT_LT((again.Ke - body.Ke).norm(), 1e-14 * body.Ke.norm());
      EXPECT_LT((again.J1 - body.J1).norm(), 1e-13 * (body.mass + body.J1.norm()));
      for (std::size_t a = 0; a < 3; ++a) {
        const MatX cr1 = again.Cr1[a].size() > 0 ? again.Cr1[a] : MatX::Zero(body.n, body.n);
        EXPECT_LT((cr1 - body.Cr1[a]).norm(), 1e-12 * body.Cr1[a].norm()) << maker.name << ' ' << a;
      }
    }
}

TEST(BeamBody, OnlyTheTermsAskedForExist) {
  const BeamDef def = general_beam(Boundary::clamped_free);
  for (const auto make : {make_fe_beam, make_modal_beam}) {
    const FlexibleBody rigid = make(def, {});
    EXPECT_EQ(rigid.n, 0);
    EXPECT_NEAR(rigid.mass, 2700.0 * 2.1e-4 * 1.3, 1e-12);
    EXPECT_NEAR(rigid.J0[2], rigid.mass * 1.3 * 1.3 / 3.0 + 1.3 * tensor_of_sections(def, false)(2, 2), 1e-12);
    EXPECT_NEAR(rigid.J0[0], 2700.0 * 8e-9 * 1.3, 1e-15);
    EXPECT_EQ(rigid.nodes[0].name, "root");
    EXPECT_EQ(rigid.nodes[1].name, "tip");
    EXPECT_EQ(rigid.nodes[1].phi.cols(), 0);

    const FlexibleBody planar = make(def, {.bending_xy = true, .stiffening = true});
    EXPECT_GT(planar.md2[0].size(), 0);
    EXPECT_EQ(planar.md2[1].size() + planar.md2[2].size(), 0);
    EXPECT_GT(planar.J2[0].size() * planar.J2[1].size() * planar.J2[2].size(), 0);
    EXPECT_EQ(planar.J2[3].size() + planar.J2[4].size() + planar.J2[5].size(), 0);
    EXPECT_EQ(planar.Cr1[0].size() + planar.Cr1[1].size() + planar.Cr1[2].size(), 0);
    EXPECT_EQ(planar.De.size(), 0);
    EXPECT_EQ(static_cast<int>(planar.labels.size()), planar.n);

    const FlexibleBody linear = make(def, {.bending_xy = true});
    EXPECT_EQ(linear.md2[0].size(), 0);
    EXPECT_EQ(linear.nodes[1].phi2[0].size(), 0);
    EXPECT_GT(linear.J2[2].size(), 0);
  }
}

TEST(BeamBody, BadNumbersAreRefusedByName) {
  const auto message = [](BeamDef def, const BeamEffects& effects, bool modal) -> std::string {
    try {
      (modal ? make_modal_beam : make_fe_beam)(def, effects);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const BeamDef good = general_beam(Boundary::clamped_free);
  EXPECT_EQ(message(good, kAll, false), "");
  BeamDef def = good;
  def.material.density = -1.0;
  EXPECT_NE(message(def, kAll, false).find("density"), std::string::npos);
  def = good;
  def.section.iz = 0.0;
  EXPECT_NE(message(def, kAll, true).find("iz"), std::string::npos);
  EXPECT_EQ(message(def, {.bending_xz = true}, true), "");
  def = good;
  def.length = std::nan("");
  EXPECT_NE(message(def, {}, true).find("length"), std::string::npos);
  def = good;
  def.elements = 0;
  EXPECT_NE(message(def, kAll, false).find("elements"), std::string::npos);
  def = good;
  def.frames["tip"] = 0.5;
  EXPECT_NE(message(def, kAll, false).find("reserved"), std::string::npos);
  def = good;
  def.frames["far"] = 1.5;
  EXPECT_NE(message(def, kAll, false).find("far"), std::string::npos);
  def = good;
  def.modes["bending"] = {1};
  EXPECT_NE(message(def, kAll, true).find("'bending'"), std::string::npos);
  def = good;
  def.modes["axial"] = {2, 2};
  EXPECT_NE(message(def, kAll, true).find("twice"), std::string::npos);
  def = good;
  def.section.shear_y = 0.0;
  BeamEffects shear = kAll;
  shear.shear = true;
  EXPECT_NE(message(def, shear, false).find("shear_y"), std::string::npos);
}

// Constants of second order made for few coordinates are those of all the elements' coordinates, transformed.
// The same deformation seen from another frame: nodes differ by one small rigid motion.
TEST(BeamBody, OtherBoundariesSeeTheSameDeformationButForARigidMotion) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (const Boundary boundary : {Boundary::clamped_free, Boundary::supported_supported, Boundary::supported_free})
    for (const bool shear : {false, true}) {
      BeamEffects effects = kAll;
      effects.shear = shear;
      const FlexibleBody free = make_fe_beam(general_beam(Boundary::free_free), effects);
      const FlexibleBody held = make_fe_beam(general_beam(boundary), effects);
      const MatX T = MatX::NullaryExpr(free.n, 4, [&] { return number(random); });
      const MatX Q = in_boundary(general_beam(boundary), effects, boundary, T);
      ASSERT_EQ(Q.rows(), held.n);
      const auto rows = static_cast<Eigen::Index>(6 * free.nodes.size());
      MatX apart(rows, 4), rigid = MatX::Zero(rows, 6);
      for (size_t i = 0; i < free.nodes.size(); ++i) {
        const auto r = static_cast<Eigen::Index>(6 * i);
        apart.middleRows(r, 3) = held.nodes[i].phi * Q - free.nodes[i].phi * T;
        apart.middleRows(r + 3, 3) = held.nodes[i].psi * Q - free.nodes[i].psi * T;
        rigid.block<6, 6>(r, 0).setIdentity();
        const Vec3 x = free.nodes[i].origin;
        rigid.block<3, 3>(r, 3) << 0.0, x.z(), -x.y(), -x.z(), 0.0, x.x(), x.y(), -x.x(), 0.0;
      }
      const MatX left = apart - rigid * rigid.colPivHouseholderQr().solve(apart);
      EXPECT_GT(apart.cwiseAbs().maxCoeff(), 1e-3);
      EXPECT_LT(left.cwiseAbs().maxCoeff(), 1e-12);
    }
}

TEST(BeamBody, SecondOrderInFewCoordinatesIsThatOfAll) {
  for (const Boundary boundary : kBoundaries)
    for (const bool shear : {false, true}) {
      BeamEffects effects = kAll;
      effects.shear = shear;
      const BeamDef def = general_beam(boundary);
      const FlexibleBody whole = make_fe_beam(def, effects);
      const FeBeam beam(def, effects);
      std::mt19937 random(11);
      std::uniform_real_distribution<double> any(-1.0, 1.0);
      const MatX T = MatX::NullaryExpr(whole.n, 4, [&]() { return any(random); });
      FlexibleBody few = beam.linear();
      few.n = 4;
      beam.add_second_order(T, few);
      const auto expect = [&](const MatX& found, const MatX& all, const std::string& what) {
        const MatX wanted = all.size() > 0 ? MatX(T.transpose() * all * T) : MatX::Zero(4, 4);
        const MatX got = found.size() > 0 ? found : MatX(MatX::Zero(4, 4));
        EXPECT_LE((got - wanted).norm(), 1e-13 * (1e-6 + all.norm()) * whole.n) << what;
      };
      for (size_t a = 0; a < 3; ++a) {
        expect(few.md2[a], whole.md2[a], fmt::format("md2 {}", a));
        expect(few.Cr1[a], whole.Cr1[a], fmt::format("Cr1 {}", a));
      }
      for (size_t a = 0; a < 6; ++a) expect(few.J2[a], whole.J2[a], fmt::format("J2 {}", a));
      ASSERT_EQ(few.nodes.size(), whole.nodes.size());
      double second = 0.0;
      for (size_t k = 0; k < whole.nodes.size(); ++k)
        for (size_t a = 0; a < 3; ++a) {
          expect(few.nodes[k].phi2[a], whole.nodes[k].phi2[a], fmt::format("phi2 {} of {}", a, whole.nodes[k].name));
          second = std::max(second, whole.nodes[k].phi2[a].norm());
        }
      EXPECT_GT(second, 0.1);
    }
}

}  // namespace
}  // namespace flexframe::sim::test_beam_body
