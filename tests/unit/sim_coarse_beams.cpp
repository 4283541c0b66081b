// Beams of too few elements against the same beam of sixteen: warned of where they err by more than a per cent, not where they are right.
#include "tests/unit/cantilever.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace flexframe::sim::test_coarse_beams {

namespace {

// Under a force that acts at once, or slowly.
Results pushed(const std::string& model, bool slowly) {
  SimulateOptions options;
  options.estimate_error = false;
  return run_cantilever("duration = 0.42\ngravity = [0, 0, 0]\ntolerance = 1e-7", model, slowly ? "10*(t < 0.3 ? t/0.3 : 1)" : "10",
                        options);
}

bool warned(const Results& results) { return said(results, Severity::warning, "too few"); }

}  // namespace

TEST(CoarseBeams, AreWarnedOfWhereTheyErr) {
  for (const bool slowly : {false, true}) {
    const VecX truth = tip(pushed("elements = 16", slowly));
    const double range = truth.maxCoeff() - truth.minCoeff();
    for (const std::string model :
         {"elements = 1", "elements = 2", "elements = 3", "elements = 4", "", "model = \"mixed\"\nvolumes = 2\nelements = 1",
          "model = \"lumped\"\nelements = 3", "model = \"lumped\"\nelements = 10", "model = \"lumped\"\nelements = 20"}) {
      const Results made = pushed(model, slowly);
      const double error = (tip(made) - truth).cwiseAbs().maxCoeff() / range;
      // An estimate: what errs by less than a third of a per cent is not blamed.
      EXPECT_TRUE(error <= 0.01 || warned(made)) << model << (slowly ? ", slowly" : "") << ": " << error;
      EXPECT_TRUE(error >= 0.0033 || !warned(made)) << model << (slowly ? ", slowly" : "") << ": " << error;
    }
  }
}

// A console along three quarters of a circle, loaded at rest across its plane; the deflection by Castigliano's integrals.
TEST(CoarseBeams, StraightVolumesOfACurvedAxisAreWarnedOfWhereTheyErr) {
  constexpr double R = 0.5, angle = 1.5 * std::numbers::pi, d = 0.01, E = 2.1e11, G = E / 2.6, I = std::numbers::pi * d * d * d * d / 64.0;
  double truth = 0.0;
  constexpr int places = 2000;
  for (int i = 0; i < places; ++i) {
    // From the end, which lies `back` along the arc away: the force bends with R sin(back) and twists with R (1 - cos(back)).
    const double back = (i + 0.5) * angle / places, bend = R * std::sin(back), twist = R * (1.0 - std::cos(back));
    truth += (bend * bend / (E * I) + twist * twist / (G * 2.0 * I)) * R * angle / places;
  }
  for (const std::string volumes : {"volumes = 3", "volumes = 6", "volumes = 10", ""}) {
    const std::string text = fmt::format(R"toml(
[simulation]
duration = 0.01
start = "static"
[[body]]
name = "hook"
kind = "beam"
axis = {{ x = "{0}*sin(u)", y = "{0}*(1 - cos(u))", to = {1} }}
section = {{ shape = "circle", diameter = {2} }}
material = {{ density = 7850, youngs_modulus = {3}, poisson = 0.3 }}
{4}
[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "hook.root"
[[force]]
kind = "force"
on = "hook.tip"
direction = [0, 0, 1]
value = 0.1
[[output]]
name = "tip"
of = "hook.tip"
quantity = "position"
)toml",
                                         R, angle, d, E, volumes);
    const Results made = run_scene(parse_scene(text, "curved.toml"), SimulateOptions{});
    double z = 0.0;
    for (const ResultOutput& output : made.outputs)
      if (output.column == "tip.z") z = output.values[0];
    const double error = std::abs(z / (0.1 * truth) - 1.0);
    EXPECT_EQ(error > 0.01, warned(made)) << volumes << ": " << error;
    EXPECT_TRUE(!volumes.empty() || error < 0.01) << error;
  }
}

}  // namespace flexframe::sim::test_coarse_beams
