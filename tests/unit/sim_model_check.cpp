// What a beam's model cannot show is measured beside the run and told (run/model_check.h, run/linear_limit.h); static deflections in kept
// modes.
#include "mechanism_text.h"
#include "sim/run/model_check.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <regex>

namespace flexframe::sim::test_model_check {
namespace {

// A strip of spring steel, 1 m x 20 mm x 2 mm, clamped, straight and at rest, let go under a weight of g: EI = 2.8 N m^2, 0.312 kg/m.
std::string strip(double g, const std::string& model, double duration = 2.0) {
  return head(duration, Vec3(0, -g, 0), 200) +
         "[[body]]\nname = \"strip\"\nkind = \"beam\"\nlength = 1.0\nsection = { shape = \"rectangle\", width = 0.02, height = 0.002 }\n"
         "material = { density = 7800.0, youngs_modulus = 2.1e11 }\n" +
         model + "\n" + joint("clamp", "weld", "ground", "strip.root", "") + output("tip", "strip.tip", "position");
}

Results checked(const std::string& text) { return simulate(parse_scene(text, "mechanism.toml")); }

bool warned(const Results& r, const std::string& of) {
  const std::vector<std::string> texts = r.statistics.notes.texts(Severity::warning);
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& w) { return w.find(of) != std::string::npos; });
}

// Heights of the tip every 0.2 s, of a chain of rigid links with torsion springs (24 and 48 links, extrapolated; 12 and 24 differ by less
// than 1 mm), by a program of its own with the classical Runge-Kutta method.
double error_against_links(const Results& r, const std::vector<double>& links) {
  const VecX& y = column(r, "tip.y");
  double worst = 0.0;
  for (size_t k = 0; k < links.size(); ++k) worst = std::max(worst, std::abs(y[40 * static_cast<Eigen::Index>(k + 1)] - links[k]));
  return worst / (y.maxCoeff() - y.minCoeff());
}
const std::vector<double> links_20 = {-0.40308, -0.33635, -0.00876, -0.45090, -0.25545, -0.04031, -0.48307, -0.17721, -0.09892, -0.49856};
const std::vector<double> links_40 = {-0.69328, -0.40015, -0.16158, -0.76074, -0.06785, -0.51195, -0.61311, -0.00477, -0.73895, -0.26384};

TEST(ModelCheck, BendingFartherThanOneFrameFollowsIsToldWithTheVolumesThatKeepAHundredth) {
  for (const auto& [g, links] : {std::pair{20.0, links_20}, std::pair{40.0, links_40}}) {
    const Results one = checked(strip(g, "elements = 8\neffects = [\"bending_xy\", \"stiffening\"]"));
    EXPECT_GT(error_against_links(one, links), 0.05);
    ASSERT_TRUE(warned(one, "bends by up to")) << g;
    std::smatch volumes;
    const std::vector<std::string> texts = one.statistics.notes.texts(Severity::warning);
    const auto text =
        std::find_if(texts.begin(), texts.end(), [](const std::string& w) { return w.find("bends by up to") != std::string::npos; });
    ASSERT_TRUE(std::regex_search(*text, volumes, std::regex("take model = \"mixed\" with volumes = ([0-9]+)"))) << *text;
    // The advice, followed to the letter.
    const Results advised = checked(strip(g, "model = \"mixed\"\nvolumes = " + volumes[1].str()));
    EXPECT_LT(error_against_links(advised, links), 0.01) << *text;
    EXPECT_FALSE(warned(advised, "bends by up to"));
  }
}

// Where the program decides the effects it follows the bending as far as it goes, in one frame.
TEST(ModelCheck, BendingFartherThanSecondOrderFollowsCallsForLargeBending) {
  for (const auto& [g, links] : {std::pair{20.0, links_20}, std::pair{40.0, links_40}}) {
    const Results one = checked(strip(g, "elements = 8"));
    EXPECT_LT(error_against_links(one, links), 3e-3) << g;
    EXPECT_FALSE(warned(one, "bends by up to"));
    const std::vector<std::string> notes = one.statistics.notes.texts(Severity::note);
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& n) {
      return n.find("large_bending switched on") != std::string::npos;
    })) << g;
  }
}

TEST(ModelCheck, VolumesThatBendTooFarAreTold) {
  const Results two = checked(strip(40.0, "model = \"mixed\"\nvolumes = 2\nelements = 4"));
  EXPECT_GT(error_against_links(two, links_40), 0.05);
  EXPECT_TRUE(warned(two, "in one of its volumes"));
}

TEST(ModelCheck, SmallBendingIsNotMeasured) {
  const Results r = checked(strip(0.5, "elements = 8"));
  EXPECT_TRUE(r.statistics.notes.texts(Severity::warning).empty());
}

// A beam of 12 elements that swings with the frequency of one frame, free or on a hinge: what two volumes of six change, which is within
// 2 % of what four do, and what one frame is told to lack. A cantilever's coefficient told a ninth of it for the free one.
TEST(ModelCheck, FreeAndHingedBeamsAreToldWhatOneFrameLacks) {
  const std::string beam =
      "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 0.4\nsection = { shape = \"rectangle\", width = 0.2, height = 0.009 }\n"
      "material = { density = 5540.0, youngs_modulus = 1e9 }\neffects = [\"bending_xy\", \"stiffening\"]\nframes = { middle = 0.5 }\n";
  const std::string free = joint("p", "planar", "ground", "b.root", "axis = [0, 0, 1]") +
                           "[[force]]\nkind = \"force\"\non = \"b.middle\"\ndirection = [0, 1, 0]\nvalue = \"t < 0.02 ? "
                           "60*sin(pi*t/0.02)^2 : 0\"\n";
  const std::string hinged = joint("p", "revolute", "ground", "b.root", "axis = [0, 0, 1]");
  for (const auto& [mount, gravity] : {std::pair{free, 0.0}, std::pair{hinged, -9.81}}) {
    const std::string text = head(0.6, Vec3(0, gravity, 0), 1000) + beam;
    const std::string rest = "\n" + mount + output("d", "b.tip", "displacement");
    SimulateOptions o;
    o.tolerance = 1e-7;
    o.method = Method::exponential;
    o.estimate_error = o.check_effects = false;
    std::vector<LinearLimit> limits;
    const VecX one = column(run_for_check(parse_scene(text + "elements = 12" + rest, "m.toml"), o, limits), "d.y");
    const VecX two = column(simulate(parse_scene(text + "model = \"mixed\"\nvolumes = 2\nelements = 6" + rest, "m.toml"), o), "d.y");
    const double lacks = (one - two).cwiseAbs().maxCoeff() / (two.maxCoeff() - two.minCoeff());
    ASSERT_EQ(limits.size(), 1u);
    EXPECT_GT(limits[0].error(), 0.6 * lacks) << gravity;
    EXPECT_LT(limits[0].error(), 1.6 * lacks) << gravity;
  }
}

// Forms of ends that the joints do not hold: clamped-clamped stands still, supported-supported forms are slow to make a clamped root.
TEST(ModelCheck, FormsOfOtherEndsAreTold) {
  for (const char* other : {"boundary = \"clamped-clamped\"", "boundary = \"clamped-supported\"",
                            "model = \"modal\"\nboundary = \"clamped-clamped\"\nmodes = { bending_xy = [1, 2, 3] }",
                            "model = \"modal\"\nboundary = \"supported-supported\"\nmodes = { bending_xy = [1, 2, 3] }"})
    EXPECT_TRUE(warned(checked(strip(1.0, other, 0.5)), "its modes are those of")) << other;
  for (const char* fits : {"boundary = \"supported-supported\"", "model = \"modal\"\nmodes = { bending_xy = [1, 2, 3] }"})
    EXPECT_TRUE(checked(strip(1.0, fits, 0.5)).statistics.notes.texts(Severity::warning).empty()) << fits;
}

// A thin wire between a hinge and a sprung car, from a random scene: over 250 periods nothing tells in time what its forms, those of a free
// tip, are wrong by. They are 1 % slow, which is everything in the end.
TEST(ModelCheck, FormsOfAFreeTipThatIsHeldAreToldWhereTheyAreNotChecked) {
  const double L = 0.48825665480481895, EI = 66965297940.6353 * std::numbers::pi * std::pow(0.0002926381560444849, 4) / 64;
  const double pull = 3.0 * EI / (L * L), mass = 7.2e-6;
  const Results r = checked(
      std::string("[simulation]\nstart = \"static\"\nduration = 7.63\noutput_rate = 52\ngravity = [0, 0, 0]\n") +
      fmt::format("[[body]]\nname = \"s\"\nkind = \"beam\"\nlength = {:.17g}\nsection = {{ shape = \"circle\", diameter = "
                  "0.0002926381560444849 }}\nmaterial = {{ density = 4387.795641297288, youngs_modulus = 66965297940.6353 }}\n"
                  "model = \"modal\"\nmodes = {{ axial = [1, 2], bending_xy = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10] }}\nframes = {{ m = 0.5 }}\n",
                  L) +
      fmt::format("[[body]]\nname = \"car\"\nkind = \"rigid\"\nmass = {0}\ninertia = [{1}, {1}, {1}]\n", mass, 1e-6 * mass) +
      joint("root", "revolute", "ground", "s.root", "") +
      joint("slide", "prismatic", "ground", "car",
            fmt::format("position = [{:.17g}, 0, 0]\naxis = [1, 0, 0]\nspring = {{ stiffness = {}, preload = {} }}", L, 1e3 * pull / L,
                        pull)) +
      joint("tip", "revolute", "car", "s.tip", "") +
      fmt::format("[[force]]\nkind = \"force\"\non = \"s.m\"\ndirection = [0, 1, 0]\nvalue = \"t <= 0 ? {} : 0\"\n", 0.096 * EI / (L * L)) +
      output("y", "s.m", "position"));
  EXPECT_TRUE(warned(r, "a joint holds its tip"));
}

// On a hinge and a roller, from a random scene: what free ends lack is little more than what loose steps over vibrations differ by, so that
// a decade alone does not tell it. Truth: vibrations of a supported beam, F/2 (1 - cos Wt) up to t = pi/W and F beyond, in closed form.
TEST(ModelCheck, FormsOfFreeEndsAreToldBesideErrorsOfTime) {
  const double L = 1.26, width = 0.026, height = 0.029, force = 0.3555;
  const Results r = checked(
      head(0.8, Vec3::Zero(), 400) +
      fmt::format("[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = {}\nsection = {{ shape = \"rectangle\", width = {}, height = {} }}\n"
                  "material = {{ density = 5540, youngs_modulus = 1e9 }}\nmodel = \"modal\"\nboundary = \"free-free\"\n"
                  "modes = {{ bending_xy = [1, 2, 3] }}\nframes = {{ mid = 0.5 }}\n",
                  L, width, height) +
      joint("left", "revolute", "ground", "b.root", "") +
      joint("right", "point-on-line", "ground", "b.tip", fmt::format("axis = [1, 0, 0]\nposition = [{}, 0, 0]", L)) +
      fmt::format("[[force]]\nkind = \"force\"\non = \"b.mid\"\ndirection = [0, 1, 0]\nvalue = \"t < 0.13 ? {}*sin(pi*t/0.26)^2 : {}\"\n",
                  force, force) +
      output("mid", "b.mid", "position"));
  const double pi = std::numbers::pi, W = pi / 0.13, mass = 5540 * width * height * L, stiffness = 1e9 * width * std::pow(height, 3) / 12.0;
  VecX truth = VecX::Zero(r.times.size());
  for (int n = 1; n <= 9; n += 2) {
    const double w = std::pow(n * pi, 2) * std::sqrt(stiffness / (mass * L * L * L)), at_rest = 2.0 * force / (mass * w * w);
    const double share = w * w / (w * w - W * W);
    const auto ramp = [&](double t) { return 0.5 * at_rest * (1.0 - std::cos(w * t) - share * (std::cos(W * t) - std::cos(w * t))); };
    const double rate = 0.5 * at_rest * (w * std::sin(w * 0.13) - share * (-W * std::sin(W * 0.13) + w * std::sin(w * 0.13)));
    for (Eigen::Index k = 0; k < truth.size(); ++k) {
      const double t = r.times[k], since = t - 0.13;
      truth[k] += t < 0.13 ? ramp(t) : at_rest + (ramp(0.13) - at_rest) * std::cos(w * since) + rate / w * std::sin(w * since);
    }
  }
  EXPECT_GT((column(r, "mid.y") - truth).cwiseAbs().maxCoeff(), 0.01 * (truth.maxCoeff() - truth.minCoeff()));
  EXPECT_LT((column(r, "mid.y") - truth).cwiseAbs().maxCoeff(), 0.05 * (truth.maxCoeff() - truth.minCoeff()));
  EXPECT_TRUE(warned(r, "its modes are those of"));
}

// A clamped beam under its weight, or an even load w: w x^2 (6 L^2 - 4 L x + x^2) / 24 EI; kept modes have it in full, with one mode as
// with two.
// A round section bends alike in two directions; the modes that are kept are those of each, not mixtures: with two of them and what joints
// deform the lowest frequencies are those of all modes.
TEST(KeepModes, RoundSectionsInSpace) {
  const auto modes = [](const std::string& keep) {
    return linearise(
               make_system(parse_scene(head(1, Vec3::Zero()) +
                                           "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1.7\nsection = { shape = \"tube\", "
                                           "outer_diameter = 0.04, thickness = 0.004 }\nmaterial = { density = 5500, youngs_modulus = "
                                           "1e9 }\neffects = [\"bending_xy\", \"bending_xz\", \"torsion\"]\n" +
                                           keep + "[[body]]\nname = \"load\"\nkind = \"rigid\"\nmass = 20\ninertia = [0.2, 0.2, 0.2]\n" +
                                           joint("clamp", "weld", "ground", "b", "") + joint("grip", "weld", "b.tip", "load", ""),
                                       "round.toml")))
        .modes;
  };
  const auto all = modes(""), kept = modes("keep_modes = 2\n");
  ASSERT_GT(kept.size(), 4u);
  for (size_t k = 0; k < 2; ++k) EXPECT_NEAR(kept[k].frequency / all[k].frequency, 1.0, 1e-6);
  for (size_t k = 3; k < 5; ++k) EXPECT_NEAR(kept[k].frequency / all[k].frequency, 1.0, 1e-3);
}

// A strip that swings far too fast for what samples show: whether its elements do is a warning where twice as many would take longer than
// the check may, with how to measure it, and no such warning where they were measured.
TEST(ModelCheck, WhatWouldTakeTooLongIsAWarningWithHowToMeasureIt) {
  const Scene scene = parse_scene(strip(1.0, "elements = 8\neffects = [\"bending_xy\"]", 0.5), "mechanism.toml");
  const System system = make_system(scene);
  SimulateOptions loose, tight;
  loose.tolerance = 1e-5, tight.tolerance = 1e-6;
  const Histories base = simulate_histories(scene, loose), run = simulate_histories(scene, tight);
  for (const bool affordable : {true, false}) {
    ModelCheckOptions check;
    check.run.tolerance = 1e-5, check.run.run_tolerance = 1e-6;
    check.run.run = &run;
    check.between_samples = {0};
    check.budget = affordable ? 1e3 : 0.0;
    EXPECT_TRUE(any_to_check(scene, {}, check));
    SolverStatistics told;
    check_models(scene, effect_states(scene, system.model), {}, base, check, told);
    const std::vector<std::string> texts = told.notes.texts(Severity::warning);
    const bool advised = std::any_of(texts.begin(), texts.end(), [](const std::string& w) {
      return w.find("compare with a run of twice as many elements") != std::string::npos;
    });
    EXPECT_EQ(advised, !affordable);
    check.between_samples.clear();
    EXPECT_FALSE(any_to_check(scene, {}, check));
  }
}

TEST(KeepModes, WeightAndSpreadLoadsBendAsStaticsSay) {
  const double stiffness = 2.1e11 * 0.02 * 0.01 * 0.01 * 0.01 / 12.0, load = 7800.0 * 0.02 * 0.01 * 9.81;
  const auto exact = [&](double x) { return -load * x * x * (6.0 - 4.0 * x + x * x) / (24.0 * stiffness); };
  for (const bool weight : {true, false})
    for (const int modes : {1, 2}) {
      const Results r = run(
          head(0.02, Vec3(0, weight ? -9.81 : 0.0, 0)) +
              "[[body]]\nname = \"beam\"\nkind = \"beam\"\nlength = 1.0\nsection = { shape = \"rectangle\", width = 0.02, height = 0.01 }\n"
              "material = { density = 7800.0, youngs_modulus = 2.1e11 }\nframes = { place = 0.4 }\ninitial = { static = true }\neffects = "
              "[\"bending_xy\"]\n" +
              fmt::format("keep_modes = {}\n", modes) + joint("clamp", "weld", "ground", "beam.root", "") +
              (weight ? ""
                      : fmt::format("[[force]]\nkind = \"distributed\"\non = \"beam\"\ndirection = [0, -1, 0]\nvalue = {:.17g}\n", load)) +
              output("tip", "beam.tip", "displacement") + output("place", "beam.place", "displacement"),
          1e-8);
      EXPECT_NEAR(column(r, "tip.y")[0], exact(1.0), 1e-4 * std::abs(exact(1.0)));
      EXPECT_NEAR(column(r, "place.y")[0], exact(0.4), 1e-4 * std::abs(exact(0.4)));
    }
}

}  // namespace
}  // namespace flexframe::sim::test_model_check
