// Beams of too few elements against the same beam of sixteen: warned of where they err by more than a per cent, not where they are right.
#include "sim/run/run_scene.h"
#include "sim/scene/scene_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
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
tolerance = 1e-8
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
