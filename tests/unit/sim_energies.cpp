// Work supplied and dissipated beside the energies of bodies, springs and contacts: closed form, and what cannot be less than nothing.
#include "mechanism_text.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace flexframe::sim::test_energies {
namespace {

std::string ball(double duration, const std::string& guide, const std::string& force) {
  return fmt::format("[simulation]\nduration = {}\noutput_rate = 500\ngravity = [0, -9.81, 0]\n", duration) +
         "[[body]]\nname = \"ball\"\nkind = \"rigid\"\nmass = 2\ninertia = [0.01, 0.01, 0.01]\n"
         "[[joint]]\nname = \"fall\"\nkind = \"prismatic\"\nparent = \"ground\"\nchild = \"ball\"\naxis = [0, 1, 0]\n" +
         guide + "\n[[force]]\nname = \"touch\"\non = \"ball\"\n" + force + "\n";
}

// The largest step back of the work taken out, J: nothing gives back what friction and damping took.
double given_back(const Results& r) {
  double worst = 0.0;
  for (Eigen::Index k = 1; k < r.dissipated.size(); ++k) worst = std::max(worst, r.dissipated[k - 1] - r.dissipated[k]);
  return worst;
}

// Falls by 0.45 m on its own radius: m g h is what there is. Steps of free flight reach deep into the ground before the touch is located.
TEST(Energies, ContactsTakeOutWhatTheirDampersDo) {
  const double there_is = 2 * 9.81 * 0.45;
  const std::string touch = "kind = \"contact\"\nshape = \"sphere\"\nradius = 0.05\nnormal = [0, 1, 0]\n";
  const auto bounce = [&](const std::string& law) { return run(ball(2, "initial = { value = 0.5 }", touch + law), 1e-8); };
  for (const char* law : {"stiffness = 1e5", "stiffness = 1e6\nexponent = 1.5"}) {
    const Results r = bounce(law);
    EXPECT_LT(r.dissipated.cwiseAbs().maxCoeff(), 1e-6 * there_is) << law;
    EXPECT_LT(energy_gap(r), 1e-5 * there_is) << law;
  }
  for (const char* law :
       {"stiffness = 1e5\ndamping = 0.4", "stiffness = 1e5\ndamping = 6", "stiffness = 1e6\nexponent = 1.5\nrestitution = 0.5"}) {
    const Results r = bounce(law);
    EXPECT_LT(energy_gap(r), 1e-5 * there_is) << law;
    EXPECT_LT(given_back(r), 1e-6 * there_is) << law;
    EXPECT_GT(r.dissipated[r.times.size() - 1], 0.5 * there_is) << law;
  }
  // Half of the speed comes back from the first impact, so three quarters of its energy are gone before the second: after 0.303 s and
  // 0.303 s more.
  const Results half = bounce("stiffness = 1e6\nrestitution = 0.5");
  EXPECT_NEAR(half.dissipated[225], 0.75 * there_is, 0.01 * there_is);
}

// Falls by half a metre until the cable tightens.
TEST(Energies, CablesTakeOutWhatTheirDampersDo) {
  const std::string cable = "kind = \"cable\"\nfrom = \"ground.top\"\nstiffness = 900\nrest = 1\ndamping = ";
  const std::string top = "[ground]\nframes = { top = [0, 2, 0] }\n";
  for (const char* damping : {"0", "3", "60"}) {
    const Results r = run(top + ball(3, "initial = { value = 1.5 }", cable + damping), 1e-8);
    EXPECT_LT(energy_gap(r), 1e-5 * 9.81) << damping;
    EXPECT_LT(given_back(r), 1e-6 * 9.81) << damping;
  }
}

// Lifted evenly by a spring that is wound up, at rest relative to it: the motor gives m g v, whether the spring pulls by its stretch or by
// its preload, and a slack cable that is wound up takes nothing.
TEST(Energies, WhatWindsUpASpringLiftsTheWeight) {
  const std::string top = "[ground]\nframes = { top = [0, 4, 0] }\n";
  const double weight = 2 * 9.81, v = 0.7;
  for (const double preload : {0.0, 12.0}) {
    const double stretch = (weight - preload) / 400;
    const Results r = run(top + ball(2, fmt::format("initial = {{ value = 1, rate = {} }}", v),
                                     fmt::format("kind = \"spring-damper\"\nfrom = \"ground.top\"\nstiffness = 400\npreload = {}\n"
                                                 "rest = \"{:.17g} - {}*t\"",
                                                 preload, 3 - stretch, v)),
                          1e-8);
    EXPECT_NEAR(r.supplied[r.times.size() - 1], weight * v * 2, 1e-6 * weight) << preload;
    EXPECT_LT(energy_gap(r), 1e-6 * weight) << preload;
  }
  for (const char* damping : {"", "\ndamping = 8"}) {
    const Results r =
        run(top + ball(3, "initial = { value = 1 }",
                       std::string("kind = \"cable\"\nfrom = \"ground.top\"\nstiffness = 900\nrest = \"3.4 - 0.8*sin(4*t)\"") + damping),
            1e-8);
    EXPECT_LT(energy_gap(r), 1e-5 * r.supplied.cwiseAbs().maxCoeff()) << damping;
  }
}

// A mass under 9 t N goes 1.5 t^3 / 2 far, which a few long steps follow exactly: it has the kinetic energy that was supplied, 9^2 / 8 / 2
// J.
TEST(Energies, LongStepsThatFollowTheMotionHaveItsWork) {
  const Results r =
      run("[simulation]\nduration = 1\noutput_rate = 200\n[[body]]\nname = \"m\"\nkind = \"rigid\"\nmass = 2\n"
          "inertia = [0.01, 0.01, 0.01]\n[[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nparent = \"ground\"\nchild = \"m\"\n"
          "axis = [1, 0, 0]\n[[force]]\nkind = \"force\"\non = \"m\"\ndirection = [1, 0, 0]\nvalue = \"9*t\"\n",
          1e-6);
  EXPECT_NEAR(r.kinetic[200], 81.0 / 16, 1e-5);
  EXPECT_NEAR(r.supplied[200], 81.0 / 16, 3e-3 * 81.0 / 16);
}

// The work along a way that is followed loosely is told of: a stiff beam under strong damping, in long steps.
TEST(Energies, WhatDoesNotBalanceIsToldOf) {
  const std::string scene =
      "[simulation]\nduration = 9\noutput_rate = 10\n"
      "[[body]]\nname = \"beam\"\nkind = \"beam\"\nmodel = \"mixed\"\nvolumes = 10\nelements = 2\nlength = 1\n"
      "section = { shape = \"rectangle\", width = 0.02, height = 0.005 }\nmaterial = { density = 2700, youngs_modulus = 7e10 }\n"
      "damping = { ratio = 2.0 }\n"
      "[[joint]]\nname = \"clamp\"\nkind = \"weld\"\nparent = \"ground\"\nchild = \"beam.root\"\n"
      "[[force]]\nkind = \"force\"\non = \"beam.tip\"\ndirection = [0, 1, 0]\nvalue = \"145.8*min(t/4, 1)\"\n"
      "[[output]]\nname = \"tip\"\nof = \"beam.tip\"\nquantity = \"position\"\n";
  for (const double tolerance : {1e-5, 1e-8}) {
    SimulateOptions options;
    options.tolerance = tolerance;
    const Results r = simulate(parse_scene(scene, "elastica.toml"), options);
    const double turned = std::max(r.supplied.cwiseAbs().maxCoeff(), r.dissipated.cwiseAbs().maxCoeff());
    const double allowed = 0.01 + 5 * std::max(0.0, r.statistics.error_estimate);
    bool told = false;
    for (const std::string& text : r.statistics.notes.texts(Severity::warning))
      told = told || text.find("do not balance") != std::string::npos;
    EXPECT_EQ(told, energy_gap(r) > allowed * turned) << tolerance;
    EXPECT_EQ(told, tolerance > 1e-6);
  }
}

}  // namespace
}  // namespace flexframe::sim::test_energies
