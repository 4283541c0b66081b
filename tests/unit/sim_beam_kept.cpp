// Beams that keep few modes against all of their elements' coordinates, by dense matrices, and against theory.
#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/bodies/axis_mass.h"
#include "sim/bodies/beam_kept.h"
#include "sim/bodies/body_terms.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <random>

namespace flexframe::sim::test_beam_kept {
namespace {

struct Case {
  BeamDef def;
  BeamEffects effects;
  std::array<int, 4> count = {0, 0, 0, 0};
  std::vector<HeldPoint> held;
  std::string what;
};

// Translations and rotations of all nodes per coordinate.
MatX motion_of_nodes(const FlexibleBody& body) {
  MatX out(static_cast<Eigen::Index>(6 * body.nodes.size()), body.n);
  for (size_t i = 0; i < body.nodes.size(); ++i) {
    const auto r = static_cast<Eigen::Index>(6 * i);
    out.middleRows(r, 3) = body.nodes[i].phi, out.middleRows(r + 3, 3) = body.nodes[i].psi;
  }
  return out;
}

BeamDef plain_beam(int elements, Boundary boundary = Boundary::clamped_free) {
  BeamDef def;
  def.length = 1.3;
  def.section.area = 2.1e-4;
  def.section.iy = 3.0e-9;
  def.section.iz = 5.0e-9;
  def.section.j = 4.0e-9;
  def.section.shear_y = 0.8;
  def.section.shear_z = 0.7;
  def.material = {2700.0, 7e10, 0.3};
  def.boundary = boundary;
  def.elements = elements;
  return def;
}

const FlexibleNode& node_named(const FlexibleBody& body, const std::string& name) {
  for (const FlexibleNode& node : body.nodes)
    if (node.name == name) return node;
  throw std::runtime_error("no node " + name);
}

// Rigid motions that belong to the effects: translations 0 1 2, rotations 3 4 5.
std::vector<int> rigid_motions(const BeamEffects& e) {
  std::vector<int> out;
  if (e.axial) out.push_back(0);
  if (e.bending_xy) out.push_back(1), out.push_back(5);
  if (e.bending_xz) out.push_back(2), out.push_back(4);
  if (e.torsion) out.push_back(3);
  return out;
}

// Mass, stiffness and held rows over rigid motions and elastic coordinates; angles are measured by the beam's length.
struct Dense {
  MatX M, K, held;
};

MatX motion_rows(const FlexibleBody& body, const BeamEffects& effects, const FlexibleNode& node, bool rotation) {
  const double L = node_named(body, "tip").origin.x();
  MatX rows = MatX::Zero(3, 6 + body.n);
  if (rotation) {
    rows.middleCols(3, 3).setIdentity();
    rows.rightCols(body.n) = L * node.psi;
  } else {
    rows.leftCols(3).setIdentity();
    rows.middleCols(3, 3) = -skew(node.origin) / L;
    rows.rightCols(body.n) = node.phi;
  }
  std::vector<int> columns = rigid_motions(effects);
  for (int k = 0; k < body.n; ++k) columns.push_back(6 + k);
  return rows(Eigen::all, columns);
}

Dense dense(const FlexibleBody& body, const BeamEffects& effects, const std::vector<HeldPoint>& held) {
  const double L = node_named(body, "tip").origin.x();
  MatX M = MatX::Zero(6 + body.n, 6 + body.n);
  M.topLeftCorner(3, 3) = body.mass * Mat3::Identity();
  M.block<3, 3>(0, 3) = -skew(body.md0) / L;
  M.block<3, 3>(3, 0) = skew(body.md0) / L;
  const Vec6& J = body.J0;
  M.block<3, 3>(3, 3) << J[0], J[3], J[4], J[3], J[1], J[5], J[4], J[5], J[2];
  M.block<3, 3>(3, 3) /= L * L;
  M.block(0, 6, 3, body.n) = body.md1;
  M.block(3, 6, 3, body.n) = body.Cr0 / L;
  M.block(6, 0, body.n, 3) = body.md1.transpose();
  M.block(6, 3, body.n, 3) = body.Cr0.transpose() / L;
  M.bottomRightCorner(body.n, body.n) = body.Me;
  const std::vector<int> rigid = rigid_motions(effects);
  std::vector<int> taken = rigid;
  for (int k = 0; k < body.n; ++k) taken.push_back(6 + k);
  const auto n = static_cast<Eigen::Index>(taken.size());
  Dense out;
  out.M = M(taken, taken);
  out.K = MatX::Zero(n, n);
  out.K.bottomRightCorner(body.n, body.n) = body.Ke;
  out.held.resize(0, n);
  for (const HeldPoint& h : held) {
    if (h.load) continue;
    for (const bool rotation : {false, true}) {
      if (!(rotation ? h.moment : h.force)) continue;
      const Eigen::Index before = out.held.rows();
      out.held.conservativeResize(before + 3, Eigen::NoChange);
      out.held.bottomRows(3) = motion_rows(body, effects, node_named(body, h.node), rotation);
    }
  }
  return out;
}

// Angular frequencies of the held body, ascending, and its compliance under each unit load along what holds leave.
struct Answer {
  VecX omega;
  std::vector<double> compliance;
};

Answer answer(const FlexibleBody& body, const BeamEffects& effects, const std::vector<HeldPoint>& held) {
  const Dense d = dense(body, effects, held);
  const VecX root = d.M.diagonal().cwiseSqrt().cwiseInverse();
  const MatX free = root.asDiagonal() * orthogonal_complement(MatX(root.asDiagonal() * d.held.transpose()), 1e-9);
  const GeneralizedEigen eigen(MatX(free.transpose() * d.K * free), MatX(free.transpose() * d.M * free));
  const MatX modes = free * eigen.eigenvectors();
  const double least = 1e-6 * body.Ke.diagonal().minCoeff() / body.Me.diagonal().maxCoeff();
  Eigen::Index first = 0;
  while (first < eigen.eigenvalues().size() && eigen.eigenvalues()[first] < least) ++first;
  Answer out;
  out.omega = eigen.eigenvalues().tail(eigen.eigenvalues().size() - first).cwiseSqrt();
  for (const HeldPoint& h : held) {
    if (!h.load) continue;
    MatX load(0, d.M.rows());
    if (h.node.empty()) {
      // the weight along each of the directions
      const std::vector<int> rigid = rigid_motions(effects);
      for (size_t k = 0; k < rigid.size(); ++k) {
        if (rigid[k] > 2) continue;
        load.conservativeResize(load.rows() + 1, Eigen::NoChange);
        load.bottomRows(1) = d.M.row(static_cast<Eigen::Index>(k));
      }
    } else {
      if (h.force) load = motion_rows(body, effects, node_named(body, h.node), false);
      if (h.moment) {
        const Eigen::Index before = load.rows();
        load.conservativeResize(before + 3, Eigen::NoChange);
        load.bottomRows(3) = motion_rows(body, effects, node_named(body, h.node), true);
      }
    }
    for (Eigen::Index k = 0; k < load.rows(); ++k) {
      double sum = 0.0;
      for (Eigen::Index i = first; i < modes.cols(); ++i) sum += std::pow(load.row(k).dot(modes.col(i)), 2) / eigen.eigenvalues()[i];
      out.compliance.push_back(sum);
    }
  }
  return out;
}

FlexibleBody whole_body(const Case& c) {
  BeamDef mean = c.def;
  mean.boundary = Boundary::free_free;
  mean.damping = {};
  mean.keep_modes.reset();
  return make_fe_beam(mean, c.effects);
}

void expect_same(const Case& c) {
  SCOPED_TRACE(c.what);
  const KeptBeam kept = make_kept_beam(c.def, c.effects, c.count, c.held);
  const Answer few = answer(kept.body, c.effects, c.held), all = answer(whole_body(c), c.effects, c.held);
  int modes = 0;
  for (const int k : c.count) modes += k;
  modes = std::min<int>(modes, static_cast<int>(all.omega.size()));
  ASSERT_GE(few.omega.size(), modes);
  // Rounding of the elements' stiffness grows with the fourth power of their number.
  const double rounding = 1e-8 + 1e-13 * std::pow(c.def.elements, 4);
  for (int k = 0; k < modes; ++k) EXPECT_NEAR(few.omega[k] / all.omega[k], 1.0, rounding) << k;
  ASSERT_EQ(few.compliance.size(), all.compliance.size());
  double largest = 0.0;
  for (const double x : all.compliance) largest = std::max(largest, x);
  for (size_t k = 0; k < all.compliance.size(); ++k)
    EXPECT_NEAR(few.compliance[k], all.compliance[k], 1e-6 * all.compliance[k] + 1e-9 * largest) << k;
}

// One direction at a time, any hold, any load, few elements and many.
TEST(BeamKept, FrequenciesAndStaticDeflectionsAreThoseOfAllCoordinates) {
  std::mt19937 random(5);
  const auto any = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
  for (int trial = 0; trial < 60; ++trial) {
    Case c;
    const int direction = any(0, 3);
    c.def = plain_beam(std::array<int, 5>{3, 5, 10, 24, 40}[static_cast<size_t>(any(0, 4))]);
    const double scale = std::pow(10.0, any(-2, 2));
    c.def.length *= scale;
    c.def.section.area *= std::pow(scale, 2);
    for (double* second : {&c.def.section.iy, &c.def.section.iz, &c.def.section.j}) *second *= std::pow(scale, 4);
    c.def.frames = {{"a", 0.3}, {"b", any(0, 1) == 0 ? 0.5 : 0.71}};
    c.def.keep_modes = any(1, 8);
    c.effects.axial = direction == 0, c.effects.bending_xy = direction == 1, c.effects.bending_xz = direction == 2;
    c.effects.torsion = direction == 3;
    c.effects.shear = c.effects.bending_xy && any(0, 2) == 0;
    c.effects.stiffening = any(0, 1) == 0;
    c.count[static_cast<size_t>(direction)] = *c.def.keep_modes;
    c.what = fmt::format("trial {}: direction {}, {} elements, {} modes, {} m", trial, direction, c.def.elements, *c.def.keep_modes,
                         c.def.length);
    for (const char* place : {"root", "a", "b", "tip"}) {
      const int kind = any(0, 4);
      if (kind == 1) c.held.push_back({place, true, false, false});
      if (kind == 2) c.held.push_back({place, true, true, false});
      if (kind == 3) c.held.push_back({place, true, any(0, 1) == 0, true});
      c.what += fmt::format(" {}:{}", place, kind);
    }
    if (any(0, 1) == 0) c.held.push_back({"", true, false, true});
    expect_same(c);
  }
}

// Frequencies by theory, with many elements: hinged, clamped and free ends, spans of equal frequencies.
TEST(BeamKept, ManyElementsHaveTheFrequenciesOfTheory) {
  const BeamDef beam = plain_beam(300);
  const double unit =
      std::sqrt(beam.material.youngs_modulus * beam.section.iz / (beam.material.density * beam.section.area)) / (beam.length * beam.length);
  const auto frequencies = [&](BeamDef def, const std::vector<HeldPoint>& held, int count) {
    def.keep_modes = count;
    const KeptBeam kept = make_kept_beam(def, {.bending_xy = true, .stiffening = true}, {0, count, 0, 0}, held);
    return VecX(answer(kept.body, {.bending_xy = true}, held).omega.head(count) / unit);
  };
  const HeldPoint hinge_root{"root", true, false, false}, hinge_tip{"tip", true, false, false}, weld_root{"root", true, true, false};
  const VecX both = frequencies(beam, {hinge_root, hinge_tip}, 12);
  for (int k = 1; k <= 12; ++k) EXPECT_NEAR(both[k - 1] / std::pow(k * std::numbers::pi, 2), 1.0, 1e-5) << k;
  const auto root_of = [](auto f, double at) {
    double a = at - 0.4, b = at + 0.4;
    for (int i = 0; i < 80; ++i) (f(a) * f(0.5 * (a + b)) <= 0.0 ? b : a) = 0.5 * (a + b);
    return a;
  };
  const VecX clamped = frequencies(beam, {weld_root}, 12);
  for (int k = 1; k <= 12; ++k) {
    const double l = root_of([](double x) { return std::cos(x) + 1.0 / std::cosh(x); }, (k - 0.5) * std::numbers::pi);
    EXPECT_NEAR(clamped[k - 1] / (l * l), 1.0, 1e-5) << k;
  }
  const VecX free = frequencies(beam, {}, 12);
  for (int k = 1; k <= 12; ++k) {
    const double l = root_of([](double x) { return std::cos(x) - 1.0 / std::cosh(x); }, (k + 0.5) * std::numbers::pi);
    EXPECT_NEAR(free[k - 1] / (l * l), 1.0, 1e-5) << k;
  }
  // Welded at a third and at two thirds: two cantilevers of a third and a span between clamps.
  BeamDef thirds = beam;
  thirds.frames = {{"a", 1.0 / 3.0}, {"b", 2.0 / 3.0}};
  const VecX three = frequencies(thirds, {{"a", true, true, false}, {"b", true, true, false}}, 6);
  const double l1 = root_of([](double x) { return std::cos(x) + 1.0 / std::cosh(x); }, 1.8) * 3.0;
  const double l2 = root_of([](double x) { return std::cos(x) + 1.0 / std::cosh(x); }, 4.7) * 3.0;
  const double c1 = root_of([](double x) { return std::cos(x) - 1.0 / std::cosh(x); }, 4.7) * 3.0;
  EXPECT_NEAR(three[0] / (l1 * l1), 1.0, 1e-5);
  EXPECT_NEAR(three[1] / (l1 * l1), 1.0, 1e-5);
  for (int k = 2; k <= 3; ++k) EXPECT_NEAR(three[k] / (l2 * l2), 1.0, 1e-5);
  EXPECT_NEAR(three[4] / (c1 * c1), 1.0, 1e-5);
}

// Turned principal axes: the modes of both principal directions.
TEST(BeamKept, TurnedSectionsBendAboutTheirPrincipalAxes) {
  for (const double iyz : {1.1e-9, -2.5e-9, 3.5e-9}) {
    Case c;
    c.def = plain_beam(12);
    c.def.section.iyz = iyz;
    c.effects = {.bending_xy = true, .bending_xz = true, .stiffening = true};
    c.count = {0, 4, 4, 0};
    c.held = {{"root", true, true, false}, {"tip", true, false, true}};
    c.what = fmt::format("iyz {}", iyz);
    const KeptBeam kept = make_kept_beam(c.def, c.effects, c.count, c.held);
    const Answer few = answer(kept.body, c.effects, c.held), all = answer(whole_body(c), c.effects, c.held);
    // Each of the four lowest in either direction: E I by Mohr's circle.
    const double middle = 4e-9, radius = std::hypot(1e-9, iyz);
    for (const double inertia : {middle - radius, middle + radius})
      for (int k = 0; k < 4; ++k) {
        BeamDef one = plain_beam(12);
        one.section.iz = inertia;
        KeptBeam single = make_kept_beam(one, {.bending_xy = true}, {0, 4, 0, 0}, {c.held[0]});
        // Bending both ways the sections' inertia counts in so far as it is unlike (rotary_inertia).
        single.body.J0[2] += one.material.density * one.length * (inertia - (middle - radius));
        const double omega = answer(single.body, {.bending_xy = true}, {c.held[0]}).omega[k];
        EXPECT_LT((few.omega.array() / omega - 1.0).abs().minCoeff(), 1e-8) << c.what << " " << k;
      }
    for (size_t k = 0; k < all.compliance.size(); ++k)
      EXPECT_NEAR(few.compliance[k], all.compliance[k], 1e-8 * std::abs(all.compliance[k]) + 1e-12 * all.compliance[0]);
  }
}

// All constants, of first and second order, are those of the elements' coordinates in the shapes that are kept.
TEST(BeamKept, ConstantsAreThoseOfAllCoordinates) {
  for (const Boundary boundary : {Boundary::clamped_free, Boundary::supported_supported, Boundary::supported_free, Boundary::free_free})
    for (const int variant : {0, 1, 2, 3}) {
      Case c;
      c.def = plain_beam(7, boundary);
      c.def.keep_modes = 3;
      c.def.frames = {{"hook", 0.4}};
      c.effects = {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = variant != 3};
      if (variant > 0) c.def.section.iyz = 1.1e-9;
      c.effects.shear = variant == 2;
      c.count = {2, 3, 3, 2};
      c.held = {{"root", true, true, false}, {"hook", true, false, true}, {"", true, false, true}};
      const FlexibleBody whole = whole_body(c);
      const KeptBeam kept = make_kept_beam(c.def, c.effects, c.count, c.held);
      const FlexibleBody& few = kept.body;
      SCOPED_TRACE(fmt::format("boundary {}, variant {}, {} coordinates", static_cast<int>(boundary), variant, few.n));
      ASSERT_EQ(few.nodes.size(), whole.nodes.size());
      // T: the shapes in the elements' coordinates, from the motion of the nodes.
      const MatX A = motion_of_nodes(whole), B = motion_of_nodes(few);
      const MatX T = least_squares(A, B);
      EXPECT_LT((A * T - B).cwiseAbs().maxCoeff(), 1e-9 * B.cwiseAbs().maxCoeff());
      const auto expect = [&](const MatX& found, const MatX& all, const std::string& what) {
        const MatX wanted = all.size() > 0 ? MatX(T.transpose() * all * T) : MatX(MatX::Zero(few.n, few.n));
        const MatX got = found.size() > 0 ? found : MatX(MatX::Zero(few.n, few.n));
        const double size = all.size() > 0 ? MatX(T.cwiseAbs().transpose() * all.cwiseAbs() * T.cwiseAbs()).maxCoeff() : 0.0;
        EXPECT_LE((got - wanted).cwiseAbs().maxCoeff(), 1e-10 * size + 1e-13 * T.squaredNorm() * whole.Me.cwiseAbs().maxCoeff()) << what;
      };
      expect(few.Me, whole.Me, "Me");
      expect(few.Ke, whole.Ke, "Ke");
      const auto expect_rows = [&](const MatX& found, const MatX& all, const std::string& what) {
        EXPECT_LE((found - all * T).cwiseAbs().maxCoeff(), 1e-10 * MatX(all.cwiseAbs() * T.cwiseAbs()).maxCoeff() + 1e-14) << what;
      };
      expect_rows(few.md1, whole.md1, "md1");
      expect_rows(few.J1, whole.J1, "J1");
      expect_rows(few.Cr0, whole.Cr0, "Cr0");
      for (size_t a = 0; a < 3; ++a) {
        expect(few.md2[a], whole.md2[a], fmt::format("md2 {}", a));
        expect(few.Cr1[a], whole.Cr1[a], fmt::format("Cr1 {}", a));
      }
      for (size_t a = 0; a < 6; ++a) expect(few.J2[a], whole.J2[a], fmt::format("J2 {}", a));
      for (size_t i = 0; i < whole.nodes.size(); ++i)
        for (size_t a = 0; a < 3; ++a) expect(few.nodes[i].phi2[a], whole.nodes[i].phi2[a], "phi2 of " + whole.nodes[i].name);
      ASSERT_EQ(has_axis_mass(few), has_axis_mass(whole));
      // The boundary's coordinates see the same deformations.
      BeamDef named = c.def;
      named.keep_modes.reset();
      const FlexibleBody seen = make_fe_beam(named, c.effects);
      ASSERT_EQ(kept.coordinates.rows(), seen.n);
      MatX apart(A.rows(), few.n), rigid = MatX::Zero(A.rows(), 6);
      for (size_t i = 0; i < seen.nodes.size(); ++i) {
        const auto r = static_cast<Eigen::Index>(6 * i);
        apart.middleRows(r, 3) = seen.nodes[i].phi * kept.coordinates - few.nodes[i].phi;
        apart.middleRows(r + 3, 3) = seen.nodes[i].psi * kept.coordinates - few.nodes[i].psi;
        rigid.block<6, 6>(r, 0).setIdentity();
        rigid.block<3, 3>(r, 3) = -skew(seen.nodes[i].origin);
      }
      EXPECT_LT((apart - rigid * least_squares(rigid, apart)).cwiseAbs().maxCoeff(), 1e-9 * B.cwiseAbs().maxCoeff());
    }
}

// Kinetic energy of the particles on the axis, in both bodies at the same state.
TEST(BeamKept, MassOfTheAxisIsThatOfAllCoordinates) {
  Case c;
  c.def = plain_beam(8);
  c.def.keep_modes = 3;
  c.effects = {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true};
  const FlexibleBody whole = whole_body(c);
  const FlexibleBody few = make_kept_beam(c.def, c.effects, {2, 3, 3, 2}, {{"root", true, true, false}}).body;
  const MatX A = motion_of_nodes(whole), B = motion_of_nodes(few);
  const MatX T = least_squares(A, B);
  const VecX q = VecX::LinSpaced(few.n, 1.0, -1.0) * (0.2 / B.cwiseAbs().maxCoeff());
  BodyTerms small, large;
  reserve(few, small), reserve(whole, large);
  update_mass(few, q, small), update_mass(whole, VecX(T * q), large);
  const MatX wanted = T.transpose() * large.Mee * T;
  EXPECT_LT((small.Mee - wanted).cwiseAbs().maxCoeff(), 1e-9 * wanted.cwiseAbs().maxCoeff());
  EXPECT_LT((small.Mre - large.Mre * T).cwiseAbs().maxCoeff(), 1e-9 * MatX(large.Mre * T).cwiseAbs().maxCoeff());
}

// A load on what is held deforms nothing and adds no shape.
TEST(BeamKept, LoadsOnHeldPlacesAddNoShape) {
  const BeamDef def = plain_beam(10);
  const HeldPoint hinge{"root", true, false, false};
  const int n = make_kept_beam(def, {.bending_xy = true}, {0, 3, 0, 0}, {hinge}).body.n;
  EXPECT_EQ(n, 3);
  EXPECT_EQ(make_kept_beam(def, {.bending_xy = true}, {0, 3, 0, 0}, {hinge, {"root", true, false, true}}).body.n, n);
  EXPECT_EQ(make_kept_beam(def, {.bending_xy = true}, {0, 3, 0, 0}, {hinge, {"root", true, true, true}}).body.n, n + 1);
  EXPECT_EQ(make_kept_beam(def, {.bending_xy = true}, {0, 1000, 0, 0}, {hinge, {"tip", true, true, true}}).body.n, 20);
}

// Frequencies of a body of which one hold gives way: those of all coordinates, to the next order where inertia loads the shapes too.
TEST(BeamKept, InertiaOfMovingHoldsRefinesFrequencies) {
  const HeldPoint root{"root", true, false, false}, tip{"tip", true, false, false};
  for (const int direction : {0, 1}) {
    BeamEffects effects;
    (direction == 0 ? effects.axial : effects.bending_xy) = true;
    std::array<int, 4> count = {0, 0, 0, 0};
    count[static_cast<size_t>(direction)] = 3;
    double off[2];
    for (const bool statics : {true, false}) {
      BeamDef def = plain_beam(20);
      def.keep_static = statics;
      def.keep_inertia = !statics;
      const double found = answer(make_kept_beam(def, effects, count, {root, tip}).body, effects, {root}).omega[0];
      const double truth = answer(whole_body({def, effects, {}, {}, ""}), effects, {root}).omega[0];
      off[statics] = found / truth - 1.0;
    }
    EXPECT_GT(off[1], 1e-5) << direction;
    EXPECT_GT(off[0], -1e-9) << direction;
    EXPECT_LT(off[0], 0.1 * off[1]) << direction;
  }
}

// Damping ratios of the boundary's modes.
TEST(BeamKept, DampingIsThatOfTheBoundarysModes) {
  for (const Boundary boundary : {Boundary::clamped_free, Boundary::supported_supported, Boundary::supported_free, Boundary::free_free}) {
    BeamDef def = plain_beam(10, boundary);
    def.damping.ratio = {0.02, 0.03};
    BeamDef named = def;
    const FlexibleBody whole = make_fe_beam(named, {.bending_xy = true});
    // Everything is kept: the damping is that of all coordinates.
    const KeptBeam kept = make_kept_beam(def, {.bending_xy = true}, {0, 1000, 0, 0}, {});
    ASSERT_EQ(kept.body.n, whole.n);
    const MatX De = kept.coordinates.transpose() * whole.De * kept.coordinates;
    EXPECT_LT((kept.body.De - De).cwiseAbs().maxCoeff(), 1e-7 * De.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace flexframe::sim::test_beam_kept
