// Beams of too few elements against the same beam of sixteen: warned of where they err by more than a per cent, not where they are right.
#include "sim/run/run_scene.h"
#include "sim/scene/scene_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>

using namespace flexframe::sim;

namespace {

// A steel cantilever under a force at its tip that acts at once, or slowly.
Results pushed(const std::string& model, bool slowly) {
  const std::string text = fmt::format(R"(
[simulation]
duration = 0.42
gravity = [0, 0, 0]
tolerance = 1e-7
[[body]]
name = "beam"
kind = "beam"
length = 1.0
section = {{ shape = "rectangle", width = 0.02, height = 0.02 }}
material = {{ density = 7850, youngs_modulus = 2.1e11 }}
{}
[[joint]]
name = "clamp"
kind = "weld"
parent = "ground"
child = "beam.root"
[[force]]
kind = "force"
on = "beam.tip"
direction = [0, 1, 0]
value = "{}"
[[output]]
name = "tip"
of = "beam.tip"
quantity = "position"
)",
                                       model, slowly ? "10*(t < 0.3 ? t/0.3 : 1)" : "10");
  SimulateOptions options;
  options.estimate_error = false;
  return run_scene(parse_scene(text, "coarse.toml"), options);
}

bool warned(const Results& results) {
  const std::vector<std::string> texts = results.statistics.notes.texts(Severity::warning);
  return std::any_of(texts.begin(), texts.end(), [](const std::string& t) { return t.find("too few") != std::string::npos; });
}

VecX tip(const Results& results) {
  for (const ResultOutput& output : results.outputs)
    if (output.column == "tip.y") return output.values;
  return {};
}

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
