// Beams whose length a loop holds carry forces along them: they resist bending by their lengthening, and their loops stay closed.
#include "mechanism_text.h"

#include "sim/start/make_system.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace flexframe::sim::test_held_lengths {
namespace {

constexpr double E = 2.1e11, rho = 7800.0, width = 0.02, height = 0.002, A = width * height, I = width * height * height * height / 12.0;

std::string strip(const std::string& more) {
  return fmt::format(
      "[[body]]\nname = \"beam\"\nkind = \"beam\"\nlength = 1\nsection = {{ shape = \"rectangle\", width = {}, height = {} }}\nmaterial = "
      "{{ density = {}, youngs_modulus = {} }}\n"
      "frames = {{ middle = 0.5 }}\n{}\n",
      width, height, rho, E, more);
}

std::string hinged(const std::string& more) {
  return strip(more) + joint("left", "revolute", "ground", "beam", "") +
         joint("right", "revolute", "ground", "beam.tip", "position = [1, 0, 0]") + output("middle", "beam.middle", "position") +
         output("tip", "beam.tip", "position") + output("pull", "right", "reaction");
}

bool stretches(const System& system, const std::string& body) {
  return std::any_of(system.model.effects.begin(), system.model.effects.end(),
                     [&](const EffectState& s) { return s.owner == body && s.effect == "axial" && s.on; });
}

bool notes(const Notes& notes, const std::string& what) {
  return std::any_of(notes.all().begin(), notes.all().end(), [&](const Note& n) { return n.text.find(what) != std::string::npos; });
}

struct Sag {
  double deflection, pull;
};

// Hinged strip under q per length with immovable ends: EI w'''' - N w'' = q, N = EA/2L int w'^2 dx (von Karman; Timoshenko, Theory of
// plates and shells, cylindrical bending). With k^2 = N/EI, u = kL/2: w(L/2) = q/(N k^2) (1/cosh u - 1 + u^2/2).
Sag cylindrical_bending(double q) {
  const auto stretched = [&](double N) {
    const double k = std::sqrt(N / (E * I));
    double sum = 0.0;
    constexpr int n = 4000;
    for (int i = 0; i < n; ++i) {
      const double x = (i + 0.5) / n;
      const double slope = -q / (N * k) * std::sinh(k * (0.5 - x)) / std::cosh(0.5 * k) + q / (2.0 * N) * (1.0 - 2.0 * x);
      sum += slope * slope / n;
    }
    return 0.5 * E * A * sum;
  };
  double low = 1e-3, high = 1e5;
  for (int i = 0; i < 100; ++i) (stretched(std::sqrt(low * high)) > std::sqrt(low * high) ? low : high) = std::sqrt(low * high);
  const double u = 0.5 * std::sqrt(low / (E * I));
  return {q / (low * 4.0 * u * u) * (1.0 / std::cosh(u) - 1.0 + 0.5 * u * u), low};
}

// Linear bending alone is 4 times too much at 5 m/s^2 and 22 times at 80. Eight elements bend to 2e-4; the pull of the end joint is N to
// the second order.
TEST(HeldLengths, HingedStripSagsAsItsStretchingAllows) {
  for (const double g : {0.5, 5.0, 20.0, 80.0}) {
    const Sag exact = cylindrical_bending(rho * A * g);
    for (const char* model : {"elements = 8", "model = \"mixed\"\nvolumes = 4\nelements = 2", "elements = 16\nkeep_modes = 5"}) {
      const Results r = run(head(1e-4, Vec3(0, -g, 0), 1e4) + "start = \"static\"\n" + hinged(model), 1e-6);
      EXPECT_NEAR(-column(r, "middle.y")[0], exact.deflection, 1e-3 * exact.deflection) << g << " " << model;
      EXPECT_NEAR(std::abs(column(r, "pull.x")[0]), exact.pull, 3e-3 * exact.pull) << g << " " << model;
      EXPECT_NEAR(column(r, "tip.x")[0], 1.0, 1e-12) << model;
      EXPECT_TRUE(notes(r.statistics.notes, "axial on: the loop of joint 'right' holds its length"));
    }
  }
}

// One end on a slide, a free end, a four-bar: nothing pulls along them.
TEST(HeldLengths, LoopsThatCanGiveWayHoldNothing) {
  const std::string slide = strip("") + joint("left", "revolute", "ground", "beam", "") +
                            "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" +
                            joint("guide", "prismatic", "ground", "block", "position = [1, 0, 0]\naxis = [1, 0, 0]") +
                            joint("right", "revolute", "block", "beam.tip", "");
  const std::string line = strip("") + joint("left", "revolute", "ground", "beam", "") +
                           joint("right", "point-on-line", "ground", "beam.tip", "axis = [1, 0, 0]");
  const std::string four_bar = rod("a") + rod("c") + strip("") +
                               joint("ja", "revolute", "ground", "a", "rotation = [0, 0, 1.5707963267948966]") +
                               joint("jb", "revolute", "a.tip", "beam", "rotation = [0, 0, -1.5707963267948966]") +
                               joint("jc", "revolute", "ground", "c", "position = [1, 0, 0]\nrotation = [0, 0, 1.5707963267948966]") +
                               joint("jd", "revolute", "c.tip", "beam.tip", "");
  for (const std::string& scene : {slide, line, four_bar}) {
    const System system = make_system(parse_scene(head(1, Vec3(0, -9.81, 0)) + scene, "scene.toml"));
    EXPECT_FALSE(stretches(system, "beam"));
    EXPECT_FALSE(notes(system.notes, "holds its length"));
  }
}

// A braced square: its diagonal and its sides are held by one another, whichever joint closes which loop. A beam that only hangs on it is
// not.
TEST(HeldLengths, EveryMemberOfAStressedFramework) {
  const auto member = [](const std::string& name, double length) {
    return fmt::format(
        "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = {:.17g}\nelements = 2\nsection = {{ shape = \"circle\", diameter = 0.01 "
        "}}\nmaterial = {{ density = 7800, youngs_modulus = 2.1e11 }}\n",
        name, length);
  };
  const std::string diagonal = fmt::format("{:.17g}", std::sqrt(2.0));
  // Corners (0,0) and (1,0) on ground, (1,1) and (0,1) free: sides, and both diagonals, of which one is too many.
  const std::string scene =
      member("left", 1) + member("right", 1) + member("top", 1) + member("up", std::sqrt(2.0)) + member("down", std::sqrt(2.0)) +
      member("hanger", 0.3) + joint("1", "revolute", "ground", "left", "rotation = [0, 0, 1.5707963267948966]") +
      joint("2", "revolute", "ground", "right", "position = [1, 0, 0]\nrotation = [0, 0, 1.5707963267948966]") +
      joint("3", "revolute", "left.tip", "top", "rotation = [0, 0, -1.5707963267948966]") +
      joint("4", "revolute", "right.tip", "top.tip", "") +
      joint("5", "revolute", "ground", "up", "rotation = [0, 0, 0.78539816339744831]") + joint("6", "revolute", "up.tip", "right.tip", "") +
      joint("7", "revolute", "ground", "down", "position = [1, 0, 0]\nrotation = [0, 0, 2.3561944901923448]") +
      joint("8", "revolute", "down.tip", "left.tip", "") + joint("9", "revolute", "top.tip", "hanger", "");
  const System system = make_system(parse_scene(head(1, Vec3(0, -9.81, 0)) + scene, "frame.toml"));
  for (const char* name : {"left", "right", "top", "up", "down"}) EXPECT_TRUE(stretches(system, name)) << name;
  EXPECT_FALSE(stretches(system, "hanger"));
}

// What the scene decides stays decided, with a sentence.
TEST(HeldLengths, SceneThatLeavesItOutIsTold) {
  for (const char* more : {"effects = [\"bending_xy\", \"stiffening\"]", "model = \"modal\"\nmodes = { bending_xy = [1, 2] }",
                           "model = \"modal\"\nboundary = \"supported-supported\"\nmodes = { bending_xy = [1, 2] }"}) {
    const System system = make_system(parse_scene(head(1, Vec3(0, -9.81, 0)) + hinged(more), "scene.toml"));
    EXPECT_FALSE(stretches(system, "beam")) << more;
    EXPECT_TRUE(notes(system.notes, "holds its length, and axial is off")) << more;
  }
}

// Links lengthen as elements do.
TEST(HeldLengths, LumpedStripSagsToo) {
  const Sag exact = cylindrical_bending(rho * A * 5.0);
  const Results r = run(head(1e-4, Vec3(0, -5, 0), 1e4) + "start = \"static\"\n" + hinged("model = \"lumped\"\nelements = 32"), 1e-6);
  EXPECT_NEAR(-column(r, "middle.y")[0], exact.deflection, 5e-3 * exact.deflection);
  EXPECT_NEAR(std::abs(column(r, "pull.x")[0]), exact.pull, 1e-2 * exact.pull);
  EXPECT_TRUE(notes(r.statistics.notes, "axial on: the loop of joint 'right' holds its length"));
}

// Set free from straight, it swings about its sag: four times stiffer than by bending, and as the loop closes so is the energy kept.
TEST(HeldLengths, SwingKeepsEnergyAndClosure) {
  for (const char* model : {"elements = 6", "model = \"mixed\"\nvolumes = 3\nelements = 1"}) {
    const Results r = run(head(0.2, Vec3(0, -5, 0), 200) + hinged(model), 1e-10);
    EXPECT_LT(energy_gap(r), 1e-5 * r.kinetic.maxCoeff()) << model;
    EXPECT_LT((column(r, "tip.x").array() - 1.0).abs().maxCoeff(), 1e-12);
    EXPECT_LT(-column(r, "middle.y").minCoeff(), 2.5 * cylindrical_bending(rho * A * 5.0).deflection);
  }
}

}  // namespace
}  // namespace flexframe::sim::test_held_lengths
