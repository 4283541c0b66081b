// The tables of sim/BEAMS.md. Each row is checked; with FLEXFRAME_TABLES set they are printed, in the form the page has them:
//   FLEXFRAME_TABLES=1 test_sim --gtest_filter='BeamTables*' --gtest_brief=1
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/beam_eigenforms.h"
#include "tests/unit/beam_chains.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <numbers>

namespace flexframe::sim::test_beam_tables {
namespace {

constexpr double pi = std::numbers::pi;

void row(const std::string& text) {
  if (std::getenv("FLEXFRAME_TABLES")) fmt::print("{}\n", text);
}

VecX hertz(const MatX& K, const MatX& M) { return GeneralizedEigen(K, M, Eigen::EigenvaluesOnly).eigenvalues().cwiseSqrt() / (2.0 * pi); }

BeamDef rectangle(double length, double height, double width, double e) {
  BeamDef def;
  def.length = length;
  def.section.area = height * width;
  def.section.iz = width * height * height * height / 12.0;
  def.section.iy = height * width * width * width / 12.0;
  def.section.j = 0.2 * std::min(def.section.iy, def.section.iz);
  def.material = {2700.0, e, 0.3};
  return def;
}

TEST(BeamTables, ErrorAgainstElements) {
  const std::array<std::pair<Boundary, const char*>, 6> boundaries = {{{Boundary::clamped_free, "clamped-free"},
                                                                       {Boundary::supported_supported, "supported-supported"},
                                                                       {Boundary::supported_free, "supported-free"},
                                                                       {Boundary::free_free, "free-free"},
                                                                       {Boundary::clamped_clamped, "clamped-clamped"},
                                                                       {Boundary::clamped_supported, "clamped-supported"}}};
  row("| boundary | elements | mode 1 | 2 | 3 | 4 | 5 |\n|---|---|---|---|---|---|---|");
  for (const auto& [boundary, name] : boundaries)
    for (const int elements : {1, 2, 5, 10, 20, 40}) {
      BeamDef def = rectangle(2.0, 0.01, 0.01, 7.2e10);
      def.boundary = boundary;
      def.elements = elements;
      const FlexibleBody body = make_fe_beam(def, {.bending_xy = true});
      const VecX f = body.n > 0 ? hertz(body.Ke, body.Me) : VecX();
      std::string line = fmt::format("| {} | {} |", name, elements);
      for (int mode = 1; mode <= 5; ++mode) {
        const double lambda = beam::bending_form(boundary, mode).lambda;
        const double theory = lambda * lambda / 4.0 * std::sqrt(7.2e10 * 1e-4 / 12.0 / 2700.0) / (2.0 * pi);
        if (mode > f.size()) {
          line += " - |";
          continue;
        }
        line += fmt::format(" {:.2e} |", f[mode - 1] / theory - 1.0);
        if (elements >= 10) {
          // the leading term of a cubic element's error in a frequency is (lambda/n)^4 / 1440
          EXPECT_NEAR(f[mode - 1] / theory - 1.0, std::pow(lambda / elements, 4) / 1440.0,
                      0.3 * std::pow(lambda / elements, 4) / 1440.0 + 2e-9);
        }
      }
      row(line);
    }
}

TEST(BeamTables, LumpedCantileverInEveryModel) {
  BeamDef def = rectangle(0.5, 0.02, 0.05, 6.9e10);
  const double ei = 6.9e10 * def.section.iz, theory = std::sqrt(ei / 2.7) / 0.25 / (2.0 * pi), force = 196.2;
  def.elements = 10;
  def.modes["bending_xy"] = {1, 2, 3};
  row("| model | tip under 196.2 N, mm | f1, Hz | f2 | f3 |\n|---|---|---|---|---|");
  const auto print = [&](const char* name, double tip, const VecX& f) {
    row(fmt::format("| {} | {:.5f} | {:.4f} | {:.4f} | {:.4f} |", name, 1e3 * tip, f[0], f[1], f[2]));
    EXPECT_NEAR(tip, 3.55435e-3, 1e-5);
    EXPECT_NEAR(f[0], 65.33, 0.16);
  };
  for (const bool coupled : {false, true}) {
    def.curvature_coupling = coupled;
    const BeamChain chain = make_lumped_beam(def, {.bending_xy = true});
    constexpr int n = 10;
    MatX M = MatX::Zero(n, n), K = M;
    VecX tip(n);
    const MatX all = link_stiffness(chain.links, n);
    for (int i = 0; i < n; ++i) {
      tip[i] = def.length - chain.pieces[static_cast<std::size_t>(i) + 1].start;
      for (int j = 0; j < n; ++j) K(i, j) = all(3 * i + 2, 3 * j + 2);
    }
    for (int k = 1; k <= n; ++k) {
      const BeamPiece& piece = chain.pieces[static_cast<std::size_t>(k)];
      VecX v = VecX::Zero(n), w = v;
      for (int j = 0; j < k; ++j) v[j] = piece.start - chain.pieces[static_cast<std::size_t>(j) + 1].start, w[j] = 1.0;
      M += piece.body.mass * v * v.transpose() + piece.body.md0.x() * (v * w.transpose() + w * v.transpose()) +
           piece.body.J0[2] * w * w.transpose();
    }
    print(coupled ? "lumped, 10, neighbours coupled" : "lumped, 10", force * tip.dot(K.ldlt().solve(tip)), hertz(K, M));
  }
  for (const bool modal : {false, true}) {
    const FlexibleBody body = modal ? make_modal_beam(def, {.bending_xy = true}) : make_fe_beam(def, {.bending_xy = true});
    const VecX phi = body.nodes[1].phi.row(1).transpose();
    print(modal ? "modal, 3 forms" : "finite elements, 10", force * phi.dot(body.Ke.ldlt().solve(phi)), hertz(body.Ke, body.Me));
  }
  VecX exact(3);
  for (int k = 0; k < 3; ++k) exact[k] = theory * std::pow(beam::bending_form(Boundary::clamped_free, k + 1).lambda, 2);
  print("Euler-Bernoulli theory", force * 0.125 / (3.0 * ei), exact);
}

TEST(BeamTables, FrequencyUnderAxialLoad) {
  BeamDef def = rectangle(2.0, 0.032064, 0.011662, 2.1e11);
  def.material.density = 7850.0;
  def.boundary = Boundary::supported_supported;
  def.elements = 10;
  def.modes["bending_xy"] = {1, 2, 3};
  row("| P/Pcr | sqrt law, Hz | modal, 3 forms | finite elements, 10 |\n|---|---|---|---|");
  const BeamEffects effects{.bending_xy = true, .stiffening = true};
  const FlexibleBody fe = make_fe_beam(def, effects), modal = make_modal_beam(def, effects);
  const double pcr = pi * pi * 2.1e11 * def.section.iz / 4.0, f1 = std::sqrt(pcr / (7850.0 * def.section.area)) / 4.0;
  for (const double share : {-1.0, 0.0, 0.5, 0.9, 0.95}) {
    const double law = f1 * std::sqrt(1.0 - share);
    const double a = hertz(modal.Ke + share * pcr * modal.nodes[1].phi2[0], modal.Me)[0];
    const double b = hertz(fe.Ke + share * pcr * fe.nodes[1].phi2[0], fe.Me)[0];
    row(fmt::format("| {} | {:.5f} | {:.5f} | {:.5f} |", share, law, a, b));
    EXPECT_NEAR(a / law, 1.0, 1e-9);
    EXPECT_NEAR(b / law, 1.0, 2e-4);
  }
}

TEST(BeamTables, RotatingCantilever) {
  row("| speed | | mode 1: 10 elements | 5 forms | 2 | | 3 | |\n|---|---|---|---|---|---|---|---|");
  BeamDef def = rectangle(1.0, 0.01, 0.01, 7.2e10);
  def.elements = 10;
  for (const char* direction : {"bending_xy", "bending_xz"}) def.modes[direction] = {1, 2, 3, 4, 5};
  const double unit = std::sqrt(7.2e10 * def.section.iz / 0.27);
  for (const bool lag : {false, true})
    for (const double speed : {0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0}) {
      const BeamEffects effects{.bending_xy = lag, .bending_xz = !lag, .stiffening = true};
      const FlexibleBody fe = make_fe_beam(def, effects), modal = make_modal_beam(def, effects);
      const double half = 0.5 * speed * speed * unit * unit;
      const VecX a = hertz(fe.Ke - half * fe.J2[2], fe.Me) * 2.0 * pi / unit,
                 b = hertz(modal.Ke - half * modal.J2[2], modal.Me) * 2.0 * pi / unit;
      row(fmt::format("| {} | {} | {:.5f} | {:.5f} | {:.5f} | {:.5f} | {:.5f} | {:.5f} |", speed, lag ? "lag" : "flap", a[0], b[0], a[1],
                      b[1], a[2], b[2]));
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i] / b[i], 1.0, 3e-3);
    }
}

TEST(BeamTables, CostOfMaking) {
  row("| beam | coordinates | nodes | CPU ms |\n|---|---|---|---|");
  const BeamEffects planar{.bending_xy = true, .stiffening = true};
  const BeamEffects all{.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true};
  const auto time = [&](const std::string& name, const BeamDef& def, const BeamEffects& effects, auto make) {
    const std::clock_t start = std::clock();
    const FlexibleBody body = make(def, effects);
    const double ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    row(fmt::format("| {} | {} | {} | {:.1f} |", name, body.n, body.nodes.size(), ms));
    EXPECT_LT(ms, 20000.0);
  };
  BeamDef def = rectangle(1.0, 0.01, 0.01, 7.2e10);
  for (const int elements : {10, 40}) {
    def.elements = elements;
    time(fmt::format("{} elements, plane", elements), def, planar, make_fe_beam);
    time(fmt::format("{} elements, space", elements), def, all, make_fe_beam);
  }
  def.modes = {{"axial", {1}}, {"bending_xy", {1, 2, 3}}, {"bending_xz", {1, 2, 3}}, {"torsion", {1}}};
  time("8 forms, space", def, all, make_modal_beam);
  for (int k = 4; k <= 60; ++k) def.modes["bending_xy"].push_back(k);
  time("65 forms up to mode 60", def, all, make_modal_beam);
}

}  // namespace
}  // namespace flexframe::sim::test_beam_tables
