// Beams as chains: Chudnovsky et al. 2006's lumped cantilever, the coupled springs, pure bending of a mixed beam, frames and damping.
#include "sim/base/eigen_solvers.h"
#include "tests/unit/beam_chains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexframe::sim::test_beam_volumes {
namespace {

constexpr double pi = std::numbers::pi;

// Chudnovsky et al. 2006: 0.5 x 0.05 x 0.02 m of aluminium.
BeamDef seed_cantilever(int elements) {
  BeamDef def;
  def.length = 0.5;
  def.section.area = 1e-3;
  def.section.iy = 0.02 * std::pow(0.05, 3) / 12.0;
  def.section.iz = 0.05 * std::pow(0.02, 3) / 12.0;
  def.section.j = 0.249 * 0.05 * std::pow(0.02, 3) * 4.0 / 3.0;
  def.material = {2700.0, 6.9e10, 0.33};
  def.model = BeamModel::lumped;
  def.elements = elements;
  return def;
}

// Small motions of a chain in the xy plane, root clamped: mass, stiffness and tip displacement over the links' angles.
struct PlanarChain {
  MatX M, K;
  VecX tip;
};

PlanarChain planar(const BeamChain& chain, double length) {
  const int n = static_cast<int>(chain.pieces.size()) - 1;
  PlanarChain out{MatX::Zero(n, n), MatX::Zero(n, n), VecX::Zero(n)};
  const MatX K = link_stiffness(chain.links, n);
  for (int i = 0; i < n; ++i) {
    out.tip[i] = length - chain.pieces[i + 1].start;
    for (int j = 0; j < n; ++j) out.K(i, j) = K(3 * i + 2, 3 * j + 2);
  }
  for (int k = 1; k <= n; ++k) {
    const FlexibleBody& body = chain.pieces[k].body;
    VecX v = VecX::Zero(n), w = v;  // of the piece's root, per joint rate
    for (int j = 0; j < k; ++j) v[j] = chain.pieces[k].start - chain.pieces[j + 1].start, w[j] = 1.0;
    out.M += body.mass * v * v.transpose() + body.md0.x() * (v * w.transpose() + w * v.transpose()) + body.J0[2] * w * w.transpose();
  }
  return out;
}

VecX hertz(const PlanarChain& chain) { return GeneralizedEigen(chain.K, chain.M).eigenvalues().cwiseSqrt() / (2.0 * pi); }

TEST(BeamVolumes, LumpedCantileverAgainstClosedTheory) {
  const BeamDef def = seed_cantilever(10);
  const BeamChain chain = make_lumped_beam(def, {.bending_xy = true});
  ASSERT_EQ(chain.pieces.size(), 11u);
  EXPECT_EQ(chain.links.free, (std::array<bool, 3>{false, false, true}));
  double mass = 0.0;
  for (const BeamPiece& piece : chain.pieces) mass += piece.body.mass;
  EXPECT_NEAR(mass, 1.35, 1e-12);
  EXPECT_NEAR(chain.links.section(2, 2) / chain.links.diagonal[0], 6.9e10 * def.section.iz / 0.05, 1e-6);
  const PlanarChain linear = planar(chain, 0.5);
  EXPECT_NEAR(linear.tip.dot(linear.K.ldlt().solve(linear.tip)) * 196.2, 3.54546e-3, 1e-8);
  const VecX f = hertz(linear);
  EXPECT_NEAR(f[0], 65.48022, 1e-4);
  EXPECT_NEAR(f[1], 412.69854, 1e-4);
  EXPECT_NEAR(f[2], 1161.31326, 1e-4);
}

TEST(BeamVolumes, CoupledSpringsAreExactUnderEndLoads) {
  for (const int elements : {1, 2, 3, 4, 10, 25}) {
    BeamDef def = seed_cantilever(elements);
    def.curvature_coupling = true;
    const PlanarChain linear = planar(make_lumped_beam(def, {.bending_xy = true}), 0.5);
    const double ei = 6.9e10 * def.section.iz;
    const VecX by_moment = linear.K.ldlt().solve(VecX::Ones(elements)), by_force = linear.K.ldlt().solve(linear.tip);
    EXPECT_NEAR(linear.tip.dot(by_moment) * 2.0 * ei / 0.25, 1.0, 1e-12) << elements;
    if (elements > 1) {
      EXPECT_NEAR(linear.tip.dot(by_force) * 3.0 * ei / 0.125, 1.0, 1e-12) << elements;
    }
    EXPECT_NEAR(by_moment.sum() * ei / 0.5, 1.0, 1e-12) << elements;
    EXPECT_GT(SymmetricEigen(linear.K).eigenvalues()[0], 0.0);
  }
}

TEST(BeamVolumes, LumpedFrequenciesConvergeWithOrderTwo) {
  const double exact = std::pow(1.87510406871196117 / 0.5, 2) * std::sqrt(6.9e10 * 0.02 * 0.02 / 12.0 / 2700.0) / (2.0 * pi);
  EXPECT_NEAR(exact, 65.330, 1e-3);
  for (const bool coupled : {false, true}) {
    std::vector<double> errors;
    for (const int elements : {10, 20, 40}) {
      BeamDef def = seed_cantilever(elements);
      def.curvature_coupling = coupled;
      errors.push_back(std::abs(hertz(planar(make_lumped_beam(def, {.bending_xy = true}), 0.5))[0] / exact - 1.0));
    }
    EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.2);
    EXPECT_NEAR(errors[1] / errors[2], 4.0, 0.1);
    EXPECT_LT(errors[0], coupled ? 8e-4 : 2.4e-3);
  }
}

TEST(BeamVolumes, LinkMomentsAreTheSectionsInAllDirections) {
  BeamDef def = seed_cantilever(6);
  def.section.iyz = 0.2 * def.section.iz;
  def.curvature_coupling = true;
  const BeamChain chain = make_lumped_beam(def, {.bending_xy = true, .bending_xz = true, .torsion = true});
  const MatX K = link_stiffness(chain.links, 6);
  EXPECT_LT((K - K.transpose()).norm(), 1e-12 * K.norm());
  EXPECT_GT(SymmetricEigen(K).eigenvalues()[0], 0.0);
  // uniform curvature (twist rate 0.1, v'' = 0.2, w'' = 0.3): the angles are C's row sums, 9/8 l and 7/8 l next to an end
  const double l = 0.5 / 6.0, e = 6.9e10, g = e / 2.66;
  Mat3X theta(3, 6);
  for (int i = 0; i < 6; ++i) theta.col(i) = (i % 5 == 0 ? 9.0 : i == 1 || i == 4 ? 7.0 : 8.0) / 8.0 * l * Vec3(0.1, -0.3, 0.2);
  const Mat3X m = link_moments(chain.links, theta);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(m(0, i), -g * def.section.j * 0.1, 1e-9 * g * def.section.j);
    EXPECT_NEAR(m(1, i), e * (def.section.iy * 0.3 + def.section.iyz * 0.2), 1e-9 * e * def.section.iy);
    EXPECT_NEAR(m(2, i), -e * (def.section.iz * 0.2 + def.section.iyz * 0.3), 1e-9 * e * def.section.iz);
  }
}

TEST(BeamVolumes, PureBendingOfAMixedBeamClosesTheCircle) {
  BeamDef def = seed_cantilever(2);
  def.model = BeamModel::mixed;
  def.volumes = 10;
  const double L = def.length, ei = 6.9e10 * def.section.iz;
  for (const bool plane_xy : {true, false})
    for (const double turns : {0.25, 0.5, 1.0}) {
      const std::vector<BeamPiece> pieces =
          mixed_pieces(def, {.axial = true, .bending_xy = plane_xy, .bending_xz = !plane_xy, .stiffening = true});
      ASSERT_EQ(pieces.size(), 10u);
      const double moment = 2.0 * pi * turns * (plane_xy ? ei : 6.9e10 * def.section.iy) / L;
      Mat3 R = Mat3::Identity();
      Vec3 r = Vec3::Zero();
      for (const BeamPiece& piece : pieces) {
        // the moment is the same along the beam; about -y it bends towards +z
        const FlexibleNode &a = piece.body.nodes[0], &b = piece.body.nodes[1];
        const VecX load = (plane_xy ? 1.0 : -1.0) * moment * (b.psi - a.psi).row(plane_xy ? 2 : 1).transpose();
        const VecX q = piece.body.Ke.ldlt().solve(load);
        const auto pose = [&](const FlexibleNode& node, Mat3& rotation, Vec3& position) {
          const Vec3 turn = node.psi * q;
          rotation = turn.norm() == 0.0 ? Mat3::Identity() : Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
          position = node.origin + node.phi * q;
          for (std::size_t i = 0; i < 3; ++i)
            if (node.phi2[i].size() > 0) position[static_cast<Eigen::Index>(i)] += 0.5 * q.dot(node.phi2[i] * q);
        };
        Mat3 Ra, Rb;
        Vec3 ra, rb;
        pose(a, Ra, ra);
        pose(b, Rb, rb);
        r += R * Ra.transpose() * (rb - ra);
        R = R * Ra.transpose() * Rb;
      }
      const double angle = 2.0 * pi * turns;
      Vec3 exact(std::sin(angle) / angle * L, 0.0, 0.0);
      exact[plane_xy ? 1 : 2] = (1.0 - std::cos(angle)) / angle * L;
      EXPECT_LT((r - exact).norm(), 1e-4 * L) << turns;
    }
}

TEST(BeamVolumes, FramesAndNodesCoverTheWholeBeam) {
  BeamDef def = seed_cantilever(2);
  def.frames = {{"middle", 0.5}, {"start", 0.0}, {"end", 1.0}, {"odd", 0.377}};
  def.volumes = 4;
  for (const BeamModel model : {BeamModel::lumped, BeamModel::mixed}) {
    def.model = model;
    const BeamEffects effects{.axial = true, .bending_xy = true};
    const std::vector<BeamPiece> pieces = model == BeamModel::lumped ? make_lumped_beam(def, effects).pieces : mixed_pieces(def, effects);
    ASSERT_EQ(static_cast<int>(pieces.size()), piece_count(def));
    const auto x_of = [](const BeamPiece& piece, const std::string& name) {
      for (const FlexibleNode& node : piece.body.nodes)
        if (node.name == name) return piece.start + node.origin.x();
      ADD_FAILURE() << piece.name << " has no node " << name;
      return 0.0;
    };
    EXPECT_NEAR(x_of(pieces.front(), "root"), 0.0, 1e-15);
    EXPECT_NEAR(x_of(pieces.back(), "tip"), 0.5, 1e-15);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      EXPECT_NEAR(pieces[k].start, piece_start(def, static_cast<int>(k)), 1e-15);
      if (k > 0) {
        EXPECT_NEAR(x_of(pieces[k - 1], "tip"), pieces[k].start, 1e-15);
      }
    }
    for (const auto& [name, share] : def.frames)
      EXPECT_NEAR(x_of(pieces[static_cast<std::size_t>(locate_piece(def, share).first)], name), share * 0.5, 1e-15) << name;
    double last = -1.0;
    for (const BeamPiece& piece : pieces)
      for (const FlexibleNode& node : piece.body.nodes)
        if (node.name.starts_with("node[")) {
          EXPECT_GE(piece.start + node.origin.x(), last - 1e-15);
          last = piece.start + node.origin.x();
        }
    EXPECT_NEAR(last, 0.5, 1e-15);
  }
}

TEST(BeamVolumes, DampingIsThatOfTheFirstMode) {
  BeamDef def = seed_cantilever(20);
  def.damping.ratio = {0.03};
  const BeamChain chain = make_lumped_beam(def, {.bending_xy = true});
  const PlanarChain linear = planar(chain, 0.5);
  EXPECT_NEAR(chain.links.time_constant * hertz(linear)[0] * pi, 0.03, 2e-5);
  const FlexibleBody volume = mixed_pieces(def, {.bending_xy = true, .stiffening = true})[0].body;
  EXPECT_LT((volume.De - chain.links.time_constant * volume.Ke).norm(), 1e-12 * volume.De.norm());
  def.damping.mass = 1.0;
  EXPECT_THROW(chain_time_constant(def, {.bending_xy = true}), InputError);
  def.damping = {};
  def.elements = 0;
  EXPECT_THROW(make_lumped_beam(def, {}), InputError);
}

TEST(BeamVolumes, WithoutHingesALumpedBeamIsWelded) {
  const BeamChain chain = make_lumped_beam(seed_cantilever(10), {});
  ASSERT_EQ(chain.pieces.size(), 11u);
  EXPECT_EQ(chain.pieces[0].body.n, 0);
  for (const bool free : chain.links.free) EXPECT_FALSE(free);
}

// Static forms carry a constant moment exactly; eigenforms between the ends add what dynamics needs.
TEST(BeamVolumes, VolumesWithModesBendUnderAMoment) {
  BeamDef def = seed_cantilever(10);
  def.modes = {{"bending_xy", {1, 2}}, {"torsion", {1}}};
  const BeamEffects effects{.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true};
  const FlexibleBody body = make_modal_volume(def, effects);
  ASSERT_EQ(body.n, 1 + 4 + 2 + 2);
  const FlexibleNode &root = body.nodes[0], &tip = body.nodes[1];
  const VecX q = body.Ke.ldlt().solve(
      VecX((tip.psi - root.psi).transpose() * Vec3(1.0, 2.0, 3.0) + (tip.phi - root.phi).transpose() * Vec3(4.0, 0.0, 0.0)));
  const double e = 6.9e10, L = def.length;
  const Vec3 turn = (tip.psi - root.psi) * q;
  EXPECT_NEAR(turn.x(), 1.0 * L / (e / 2.66 * def.section.j), 1e-10 * turn.x());
  EXPECT_NEAR(turn.y(), 2.0 * L / (e * def.section.iy), 1e-10 * turn.y());
  EXPECT_NEAR(turn.z(), 3.0 * L / (e * def.section.iz), 1e-10 * turn.z());
  EXPECT_NEAR(((tip.phi - root.phi) * q).x(), 4.0 * L / (e * def.section.area), 1e-10 * L);
  // frame on mean axes: no linear or angular momentum in any coordinate
  EXPECT_LT(body.md1.norm(), 1e-12 * body.mass);
  EXPECT_LT(body.Cr0.norm(), 1e-12 * body.mass * L);
  // free-free frequency from above (Rayleigh) with one symmetric form more
  const FlexibleBody plane = make_modal_volume(def, {.bending_xy = true});
  const VecX squares = GeneralizedEigen(plane.Ke, plane.Me).eigenvalues();
  const double exact = 4.730040744862704 * 4.730040744862704 * std::sqrt(e * def.section.iz / (2700.0 * def.section.area)) / (L * L);
  EXPECT_GT(std::sqrt(squares[0]), exact);
  EXPECT_LT(std::sqrt(squares[0]), 1.005 * exact);
}

TEST(BeamVolumes, ValidityNoteSpeaksOfStockyBeamsAndHighModes) {
  BeamDef def = seed_cantilever(10);
  EXPECT_EQ(beam_validity_note(def), "");
  def.length = 0.1;
  EXPECT_NE(beam_validity_note(def).find("slenderness"), std::string::npos);
  EXPECT_EQ(beam_validity_note(def, {.bending_xy = true, .shear = true}), "");
  EXPECT_EQ(beam_validity_note(def, {.axial = true}), "");
  def.length = 0.5;
  def.model = BeamModel::modal;
  def.modes["bending_xy"] = {1, 40};
  EXPECT_NE(beam_validity_note(def).find("mode 40"), std::string::npos);
}

// Volumes of very many elements share their coordinates: a beam of 8 x 1000 has a motion of some 1500, not one of 8 times 300 or more; few
// elements stay as they are, and the first frequency is the cantilever's (1.8751^4 E I / rho A L^4).
TEST(BeamVolumes, ManyElementsInManyVolumesAreFewer) {
  BeamDef def;
  def.length = 0.125;  // an eighth of a metre
  def.section.area = 4e-4;
  def.section.iy = def.section.iz = std::pow(0.02, 4) / 12.0;
  def.material = {7850.0, 2.1e11, 0.3};
  def.boundary = Boundary::clamped_free;
  def.model = BeamModel::finite_element;
  BeamEffects effects;
  effects.bending_xy = true;
  const auto coordinates = [&](int volumes, int elements) {
    def.volumes = volumes;
    def.elements = elements;
    return make_fe_beam(def, effects).n;
  };
  EXPECT_LE(8 * coordinates(8, 1000), 1500);
  EXPECT_GT(coordinates(8, 1000), 100);
  EXPECT_EQ(coordinates(5, 1000), coordinates(1, 1000));
  EXPECT_EQ(coordinates(500, 16), 2 * 16);
  def.volumes = 8;
  def.elements = 1000;
  const FlexibleBody body = make_fe_beam(def, effects);
  const GeneralizedEigen modes(body.Ke, body.Me);
  const double first = std::pow(1.875104069, 2) * std::sqrt(2.1e11 * def.section.iz / (7850.0 * 4e-4)) / (0.125 * 0.125);
  EXPECT_NEAR(std::sqrt(modes.eigenvalues()(0)), first, 1e-5 * first);
}

}  // namespace
}  // namespace flexframe::sim::test_beam_volumes
