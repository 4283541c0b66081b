// Beams against theory: eigenvalues, Schiavo et al. 2005 Table 1, order of convergence, buckling loads, rotating beams, damping.
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/beam_eigenforms.h"
#include "sim/bodies/beam_terms.h"
#include "sim/bodies/section_strain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexframe::sim::test_beam_theory {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::array<Boundary, 6> kBoundaries = {Boundary::clamped_free, Boundary::supported_supported, Boundary::supported_free,
                                                 Boundary::free_free,    Boundary::clamped_clamped,     Boundary::clamped_supported};

// Schiavo et al. 2005 section 5.1.
BeamDef schiavo_beam(int elements, Boundary boundary = Boundary::clamped_free) {
  BeamDef def;
  def.length = 2.0;
  def.section.area = 1e-4;
  def.section.iy = def.section.iz = 1e-8 / 12.0;
  def.section.j = 0.1406e-8;
  def.section.shear_y = def.section.shear_z = 5.0 / 6.0;
  def.material = {2700.0, 7.2e10, 0.3};
  def.boundary = boundary;
  def.elements = elements;
  return def;
}

// A beam with rho A = EI = L = 1 and a section much smaller than its length.
BeamDef unit_beam(int elements, Boundary boundary = Boundary::clamped_free) {
  BeamDef def;
  def.length = 1.0;
  def.section.area = 1e-4;
  def.section.iy = def.section.iz = 1e-9;
  def.material = {1e4, 1e9, 0.3};
  def.boundary = boundary;
  def.elements = elements;
  return def;
}

VecX frequencies(const MatX& K, const MatX& M) { return GeneralizedEigen(K, M, Eigen::EigenvaluesOnly).eigenvalues().cwiseSqrt(); }

const FlexibleNode& tip(const FlexibleBody& body) { return body.nodes[1]; }

TEST(BeamTheory, EigenvaluesOfTheSixBoundariesToTwelveDigits) {
  // roots of the characteristic equations computed with 30 digits
  const std::array<std::vector<double>, 6> lambda = {{
      {1.87510406871196117, 4.69409113297417458, 7.85475743823761257, 10.9955407348754670, 14.1371683910464706},
      {pi, 2 * pi, 3 * pi, 4 * pi, 5 * pi},
      {3.92660231204791878, 7.06858274562873072, 10.2101761228130305, 13.3517687777540944, 16.4933614313464127},
      {4.73004074486270403, 7.85320462409583756, 10.9956078380016709, 14.1371654912574641, 17.2787596573994815},
      {4.73004074486270403, 7.85320462409583756, 10.9956078380016709, 14.1371654912574641, 17.2787596573994815},
      {3.92660231204791878, 7.06858274562873072, 10.2101761228130305, 13.3517687777540944, 16.4933614313464127},
  }};
  for (std::size_t b = 0; b < 6; ++b)
    for (std::size_t k = 0; k < 5; ++k)
      EXPECT_NEAR(beam::bending_form(kBoundaries[b], static_cast<int>(k) + 1).lambda, lambda[b][k], 1e-14 * lambda[b][k]) << b << ' ' << k;
}

TEST(BeamTheory, EigenformsStayOrthonormalAndKeepTheirEndsUpToTheHighestMode) {
  const beam::GaussRule rule = beam::gauss_rule(12);
  for (const Boundary boundary : kBoundaries) {
    for (const int mode : {1, 2, 3, 12, 30, 59, 60, kMaxMode}) {
      const beam::Eigenform f = beam::bending_form(boundary, mode);
      // residual of the equation and of the end conditions, relative to lambda^order
      const auto scaled = [&](double xi, int order) { return beam::evaluate(f, xi, order) / std::pow(f.lambda, order); };
      EXPECT_TRUE(std::isfinite(scaled(0.37, 3)));
      const double at_root = boundary == Boundary::free_free ? scaled(0, 2) : scaled(0, 0);
      const double at_tip = boundary == Boundary::clamped_free || boundary == Boundary::supported_free || boundary == Boundary::free_free
                                ? std::abs(scaled(1, 2)) + std::abs(scaled(1, 3))
                                : std::abs(scaled(1, 0));
      EXPECT_NEAR(at_root, 0.0, 1e-13);
      EXPECT_NEAR(at_tip, 0.0, 1e-13 * f.lambda);
      for (const int other : {1, 29, 59, 60}) {
        const beam::Eigenform g = beam::bending_form(boundary, other);
        double product = 0.0, bending = 0.0;
        const int panels = std::max(mode, other) + 1;
        for (int e = 0; e < panels; ++e)
          for (std::size_t i = 0; i < rule.x.size(); ++i) {
            const double xi = (e + rule.x[i]) / panels, w = rule.w[i] / panels;
            product += w * beam::evaluate(f, xi, 0) * beam::evaluate(g, xi, 0);
            bending += w * beam::evaluate(f, xi, 2) * beam::evaluate(g, xi, 2);
          }
        EXPECT_NEAR(product, mode == other ? 1.0 : 0.0, 2e-13) << mode << ' ' << other;
        EXPECT_NEAR(bending / (f.lambda * f.lambda * g.lambda * g.lambda), mode == other ? 1.0 : 0.0, 1e-12) << mode << ' ' << other;
      }
    }
  }
}

TEST(BeamTheory, TenElementsGiveTheFrequenciesOfSchiavosTable1) {
  const std::array<double, 5> table = {2.0854750, 13.0698705, 36.6041219, 71.7795490, 118.842591};
  for (const BeamEffects effects : {BeamEffects{.bending_xy = true}, BeamEffects{.bending_xz = true, .stiffening = true}}) {
    const FlexibleBody body = make_fe_beam(schiavo_beam(10), effects);
    const VecX f = frequencies(body.Ke, body.Me) / (2.0 * pi);
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(f[i] / table[static_cast<std::size_t>(i)], 1.0, 1e-6);
  }
}

TEST(BeamTheory, FrequenciesOfOneToFortyElementsConvergeWithOrderFour) {
  for (const Boundary boundary : kBoundaries) {
    std::vector<VecX> f;
    for (int elements = 1; elements <= 40; ++elements) {
      const FlexibleBody body = make_fe_beam(unit_beam(elements, boundary), {.bending_xy = true});
      f.push_back(body.n > 0 ? frequencies(body.Ke, body.Me) : VecX());
    }
    for (int mode = 1; mode <= 5; ++mode) {
      const double lambda = beam::bending_form(boundary, mode).lambda;
      const auto error = [&](int elements) { return f[static_cast<std::size_t>(elements - 1)][mode - 1] / (lambda * lambda) - 1.0; };
      // Rayleigh-Ritz: from above; the order between two meshes where rounding (4e-16 lambda_max^4/lambda^4) is still far below
      for (int elements = 1; elements <= 40; ++elements) {
        if (f[static_cast<std::size_t>(elements - 1)].size() < mode) continue;
        EXPECT_GT(error(elements), -1e-8) << elements;
      }
      const int coarse = mode == 1 ? 5 : 4 * mode, fine = std::min(40, 2 * coarse);
      EXPECT_NEAR(std::log(error(coarse) / error(fine)) / std::log(static_cast<double>(fine) / coarse), 4.0, 0.15)
          << "boundary " << static_cast<int>(boundary) << " mode " << mode;
      EXPECT_LT(error(40), 1.1 * std::pow(lambda / 40.0, 4) / 1440.0 + 1e-8);
    }
  }
}

TEST(BeamTheory, AxialAndTorsionFrequenciesConvergeWithOrderTwo) {
  for (const Boundary boundary : kBoundaries)
    for (const bool axial : {true, false}) {
      const double speed = axial ? std::sqrt(7.2e10 / 2700.0) : std::sqrt(7.2e10 / 2.6 * 0.1406e-8 / (2700.0 * 2e-8 / 12.0));
      const double exact = beam::rod_form(boundary, 2).lambda / 2.0 * speed;
      std::vector<double> errors;
      for (const int elements : {10, 20}) {
        const FlexibleBody body = make_fe_beam(schiavo_beam(elements, boundary), {.axial = axial, .torsion = !axial});
        errors.push_back(frequencies(body.Ke, body.Me)[1] / exact - 1.0);
      }
      EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.2);
      EXPECT_LT(errors[1], 0.01);
    }
}

TEST(BeamTheory, ModalAndFiniteElementBeamsAgree) {
  for (const Boundary boundary : kBoundaries) {
    BeamDef def = schiavo_beam(40, boundary);
    def.section.iz *= 1.7;
    def.section.iyz = 0.3 * def.section.iy;
    def.modes = {{"bending_xy", {1, 2, 3, 4, 5, 6}}, {"bending_xz", {1, 2, 3, 4, 5, 6}}};
    const BeamEffects effects{.bending_xy = true, .bending_xz = true, .stiffening = true};
    const FlexibleBody fe = make_fe_beam(def, effects), modal = make_modal_beam(def, effects);
    const VecX a = frequencies(fe.Ke, fe.Me), b = frequencies(modal.Ke, modal.Me);
    for (int i = 0; i < 8; ++i) EXPECT_NEAR(a[i] / b[i], 1.0, 1.2e-5);
    EXPECT_NEAR(fe.mass, modal.mass, 1e-14);
    EXPECT_EQ(modal.labels[0].substr(0, 12), "bending_xy 1");
  }
}

TEST(BeamTheory, AnAxialLoadBucklesAtEulersLoads) {
  // virtual work of a load -P along x at the tip: K + P phi2_x(tip), so P is a generalised eigenvalue
  const auto critical = [](const FlexibleBody& body) {
    const MatX g = -tip(body).phi2[0];
    return 1.0 / GeneralizedEigen(g, body.Ke, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  };
  const double tan_root = 4.49340945790906418;
  const std::array<double, 6> theory = {pi * pi / 4.0, pi * pi, 0.0, pi * pi, 4.0 * pi * pi, tan_root * tan_root};
  for (std::size_t b = 0; b < 6; ++b) {
    if (kBoundaries[b] == Boundary::supported_free) continue;  // no static load without a support at the tip
    BeamDef def = unit_beam(40, kBoundaries[b]);
    def.modes["bending_xz"] = {};
    for (int k = 1; k <= 40; ++k) def.modes["bending_xz"].push_back(k);
    const BeamEffects effects{.bending_xz = true, .stiffening = true};
    EXPECT_NEAR(critical(make_fe_beam(def, effects)) / theory[b], 1.0, 1e-5) << b;
    EXPECT_NEAR(critical(make_modal_beam(def, effects)) / theory[b], 1.0, 2e-3) << b;
  }
}

TEST(BeamTheory, FrequencyUnderAxialLoadFollowsTheSquareRootLaw) {
  // Heckmann et al. 2006 section 6.2: P_cr / f_1^2 = 4 rho A L^2
  BeamDef def;
  def.length = 2.0;
  def.section.area = 3.739407e-4;
  def.section.iy = def.section.iz = 3.203679e-8;
  def.material = {7850.0, 2.1e11, 0.3};
  def.boundary = Boundary::supported_supported;
  def.modes["bending_xy"] = {1};
  const FlexibleBody body = make_modal_beam(def, {.bending_xy = true, .stiffening = true});
  const std::array<double, 4> share = {0.0, 0.5, 0.9, 0.95}, hertz = {18.8, 13.2936, 5.94508, 4.20381};
  for (std::size_t i = 0; i < 4; ++i) {
    const double k = body.Ke(0, 0) + share[i] * 16600.0 * tip(body).phi2[0](0, 0);
    EXPECT_NEAR(std::sqrt(k / body.Me(0, 0)) / (2.0 * pi) / hertz[i], 1.0, 1e-5);
  }
}

TEST(BeamTheory, RotatingCantileverFrequencies) {
  // Wright et al. 1982, hub radius 0: in the rotating frame the stiffness is Ke - Omega^2/2 d2 Jzz/dq2
  const std::array<double, 3> speeds = {0.0, 6.0, 12.0};
  const std::array<std::array<double, 3>, 3> flap = {{{3.5160152685, 22.0344915647, 61.6972144135},
                                                      {7.3603730193, 26.8090816785, 66.6839143815},
                                                      {13.1701504875, 37.6031123312, 79.6144784895}}};
  BeamDef def = unit_beam(20);
  def.modes["bending_xy"] = {};
  for (int k = 1; k <= 12; ++k) def.modes["bending_xy"].push_back(k);
  def.modes["bending_xz"] = def.modes["bending_xy"];
  for (const auto make : {make_fe_beam, make_modal_beam})
    for (std::size_t s = 0; s < speeds.size(); ++s)
      for (const bool lag : {false, true}) {
        const FlexibleBody body = make(def, {.bending_xy = lag, .bending_xz = !lag, .stiffening = true});
        const double square = speeds[s] * speeds[s];
        const VecX f = frequencies(body.Ke - 0.5 * square * body.J2[2], body.Me);
        for (int i = 0; i < 3; ++i) {
          const double expected = std::sqrt(std::pow(flap[s][static_cast<std::size_t>(i)], 2) - (lag ? square : 0.0));
          EXPECT_NEAR(f[i] / expected, 1.0, 1e-4) << speeds[s] << (lag ? " lag " : " flap ") << i + 1;
        }
      }
}

TEST(BeamTheory, TorsionBucklesABeamUnderItsOwnPlanesLoad) {
  // lateral buckling of a narrow cantilever by a force at its tip: P L^2 = 4.0126 sqrt(EI GJ) (Timoshenko, Gere 1961, 6.4). The strong
  // plane bends statically by q0 = K^-1 F; what is left couples w and theta through phi2_y(tip)
  BeamDef def = unit_beam(16);
  def.section.iz = 1e-3;  // strong in xy: no bending before buckling
  def.section.j = 0.5e-9;
  const FlexibleBody body = make_fe_beam(def, {.bending_xz = true, .torsion = true, .stiffening = true});
  const MatX g = tip(body).phi2[1];
  const double largest = GeneralizedEigen(g, body.Ke, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  const double gj = 1e9 / 2.6 * 0.5e-9;
  EXPECT_NEAR(1.0 / largest / (4.01259934 * std::sqrt(gj)), 1.0, 2e-3);
}

TEST(BeamTheory, ShearElementsGiveTimoshenkosDeflectionAndFrequency) {
  BeamDef def = schiavo_beam(1);
  def.length = 0.05;  // as short as five times its height
  const FlexibleBody body = make_fe_beam(def, {.bending_xy = true, .shear = true});
  const VecX q = body.Ke.ldlt().solve(VecX(tip(body).phi.row(1).transpose()));
  const double ei = 7.2e10 * 1e-8 / 12.0, kga = 5.0 / 6.0 * 7.2e10 / 2.6 * 1e-4, L = def.length;
  EXPECT_NEAR(tip(body).phi.row(1).dot(q) / (L * L * L / (3.0 * ei) + L / kga), 1.0, 1e-12);
  // supported-supported has a closed form, the smaller root of
  //   rho A rho I/(kGA) w^4 - (rho A + (rho I + rho A EI/kGA) b^2) w^2 + EI b^4 = 0;
  // elements much shorter than the section is high bend linearly: order 2
  def.boundary = Boundary::supported_supported;
  const double ra = 0.27, ri = 2700.0 * 1e-8 / 12.0;
  for (int k = 1; k <= 3; ++k) {
    const double b = k * pi / L, A = ra * ri / kga, B = ra + (ri + ra * ei / kga) * b * b, C = ei * b * b * b * b;
    const double exact = std::sqrt((B - std::sqrt(B * B - 4.0 * A * C)) / (2.0 * A));
    std::array<double, 2> errors = {};
    for (std::size_t i = 0; i < 2; ++i) {
      def.elements = i == 0 ? 40 : 80;
      const FlexibleBody simple = make_fe_beam(def, {.bending_xy = true, .shear = true});
      errors[i] = frequencies(simple.Ke, simple.Me)[k - 1] / exact - 1.0;
    }
    EXPECT_LT(errors[1], 1.1e-4 * k * k / 4.0) << k;
    EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.1) << k;
  }
}

// Principal axes beside y and z couple both directions: compliance of the tip L^3/3 EI^-1 + L (kGA)^-1, curvature EI^-1 F (L - x).
TEST(BeamTheory, ShearElementsOfTurnedSectionsBendExactlyUnderForces) {
  BeamDef def = schiavo_beam(1);
  def.length = 0.05;
  def.section.iz = 2e-8 / 12.0;
  def.section.iyz = 0.7e-8 / 12.0;
  def.section.shear_z = 0.4;
  const double E = 7.2e10, ga = E / 2.6 * 1e-4, L = def.length;
  Eigen::Matrix2d ei, kga;
  ei << E * def.section.iz, E * def.section.iyz, E * def.section.iyz, E * def.section.iy;
  kga << def.section.shear_y * ga, 0.0, 0.0, def.section.shear_z * ga;
  const Eigen::Matrix2d compliance = L * L * L / 3.0 * ei.inverse() + L * kga.inverse();
  const Eigen::Vector2d force(3.0, -2.0), curvature = L * (ei.inverse() * force);
  const BeamEffects effects{.bending_xy = true, .bending_xz = true, .shear = true};
  for (const int elements : {1, 3}) {
    def.elements = elements;
    const FlexibleBody body = make_fe_beam(def, effects);
    const MatX phi = tip(body).phi.bottomRows(2), q = body.Ke.ldlt().solve(MatX(phi.transpose()));
    EXPECT_LT((phi * q - compliance).norm(), 1e-12 * compliance.norm()) << elements;
    const VecX bent = q * force;
    const std::vector<ElementStrain> strains = fe_strains(def, effects);
    const auto at = [&](const CoordinateRow& row) {
      double sum = 0.0;
      for (const auto& [k, value] : row) sum += value * bent[k];
      return sum;
    };
    for (const ElementStrain& e : strains) {
      const Eigen::Vector2d from(at(e.bend_y[0]), at(e.bend_z[0])), to(at(e.bend_y[1]), at(e.bend_z[1]));
      EXPECT_LT((from - (1.0 - e.x0 / L) * curvature).norm(), 1e-10 * curvature.norm()) << elements;
      EXPECT_LT((to - (1.0 - e.x1 / L) * curvature).norm(), 1e-10 * curvature.norm()) << elements;
    }
  }
}

// Where a force acts the elements end: u = F x / EA, v = F (x^3 / 3 EI + x / kGA) at any place of a clamped beam.
TEST(BeamTheory, ForcesOnFramesBetweenEvenNodesFindTheExactCompliance) {
  BeamDef def = schiavo_beam(5);
  def.length = 0.1;
  const std::map<std::string, double> frames = {{"near", 0.23}, {"between", 0.5}, {"close", 0.985}, {"two", 0.71}, {"three", 0.76}};
  def.frames = frames;
  const double E = 7.2e10, G = E / 2.6, area = 1e-4, ei = E * 1e-8 / 12.0, kga = 5.0 / 6.0 * G * area;
  const FlexibleBody body = make_fe_beam(def, {.axial = true, .bending_xy = true, .shear = true});
  // Even places in lengths of an element: 1.15 moves node 1; 2.5 is added; 3.55 is added, 3.8 moves node 4; 4.925 lies too near to the tip.
  EXPECT_EQ(body.n, 3 * 7);
  for (const FlexibleNode& node : body.nodes) {
    if (!frames.contains(node.name)) continue;
    const double x = node.origin.x(), bound = node.name == "close" ? 0.03 : 1e-12;
    const MatX by = body.Ke.ldlt().solve(MatX(node.phi.transpose()));
    EXPECT_NEAR((node.phi * by)(0, 0) / (x / (E * area)), 1.0, bound) << node.name;
    EXPECT_NEAR((node.phi * by)(1, 1) / (x * x * x / (3.0 * ei) + x / kga), 1.0, bound) << node.name;
  }
  // Coordinates that are named one by one belong to the even nodes.
  def.all_elements = true;
  EXPECT_EQ(make_fe_beam(def, {.axial = true, .bending_xy = true}).n, 3 * 5);
}

TEST(BeamTheory, DampingRatiosAreThoseAskedFor) {
  BeamDef def = schiavo_beam(8);
  def.damping.ratio = {0.02, 0.03};
  const BeamEffects effects{.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true};
  const auto ratios = [&](const FlexibleBody& body) {
    const GeneralizedEigen eigen(body.Ke, body.Me);
    const MatX d = eigen.eigenvectors().transpose() * body.De * eigen.eigenvectors();
    VecX out(body.n);
    for (int i = 0; i < body.n; ++i) out[i] = d(i, i) / (2.0 * std::sqrt(eigen.eigenvalues()[i]));
    EXPECT_LT((d - MatX(d.diagonal().asDiagonal())).norm(), 1e-6 * d.norm());
    return out;
  };
  def.section.iy *= 2.0;  // no double frequencies
  const VecX fe = ratios(make_fe_beam(def, effects));
  EXPECT_NEAR(fe[0], 0.02, 1e-8);
  for (int i = 1; i < fe.size(); ++i) EXPECT_NEAR(fe[i], 0.03, 1e-8);
  def.damping = {.ratio = {}, .mass = 0.4, .stiffness = 1e-4};
  const FlexibleBody rayleigh = make_fe_beam(def, effects);
  EXPECT_LT((rayleigh.De - 0.4 * rayleigh.Me - 1e-4 * rayleigh.Ke).norm(), 1e-12 * rayleigh.De.norm());
  def.damping = {.ratio = {0.01, 0.02, 0.05}, .mass = 0.0, .stiffness = 0.0};
  def.modes = {{"bending_xy", {1, 3, 5}}, {"axial", {1}}};
  const FlexibleBody modal = make_modal_beam(def, effects);
  const std::array<double, 4> expected = {0.01, 0.02, 0.05, 0.05};
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(modal.De(i, i) / (2.0 * std::sqrt(modal.Ke(i, i) * modal.Me(i, i))), expected[static_cast<std::size_t>(i)], 1e-14);
}

TEST(BeamTheory, SixtyModesKeepEveryTermFinite) {
  BeamDef def = schiavo_beam(1);
  def.modes = {{"bending_xy", {1, 30, 60}}, {"bending_xz", {60}}, {"axial", {1, 60}}, {"torsion", {60}}};
  for (const Boundary boundary : kBoundaries) {
    def.boundary = boundary;
    const FlexibleBody body =
        make_modal_beam(def, {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true});
    for (const auto& m : {body.md2[0], body.md2[1], body.J2[1], body.J2[3], body.Cr1[0], body.Cr1[2], body.Ke}) EXPECT_TRUE(m.allFinite());
    for (const FlexibleNode& node : body.nodes) {
      EXPECT_TRUE(node.phi.allFinite());
      EXPECT_LT(node.phi.cwiseAbs().maxCoeff(), 2.01);
    }
  }
}

}  // namespace
}  // namespace flexframe::sim::test_beam_theory
