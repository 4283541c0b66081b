// Static starts in a plane that beams would leave: on both sides of critical loads by Euler and Timoshenko, and without a search for where
// they would go.
#include "sim/run/across_plane.h"
#include "sim/run/run_scene.h"
#include "sim/scene/scene_reader.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"
#include "tests/unit/cantilever.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace flexframe::sim::test_across_plane {

namespace {

constexpr double E = 2.1e11, G = E / 2.6, L = 1.0;

const std::string head = "[simulation]\nduration = 0.05\noutput_rate = 200\ngravity = [0, 0, 0]\nstart = \"static\"\n";

std::string bar_of(const std::string& name, const std::string& section, const std::string& more = "") {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = {}\nsection = {}\nmaterial = {{ density = 7850, youngs_modulus = 2.1e11, "
      "poisson = 0.3 }}\n{}\n",
      name, L, section, more);
}
std::string joint(const std::string& what) { return "[[joint]]\n" + what; }
std::string load(const std::string& kind, const std::string& on, const std::string& direction, double value) {
  return fmt::format(
      "[[force]]\nkind = \"{0}\"\non = \"{1}\"\ndirection = {2}\nvalue = {3:.17g}\n[[output]]\nname = \"end\"\nof = \"{1}\"\nquantity = "
      "\"position\"\n",
      kind, on, direction, value);
}

// A console with a load at its tip.
std::string console(const std::string& section, const std::string& kind, const std::string& direction, double value,
                    const std::string& more = "") {
  return head + bar_of("strip", section, more) + joint("name = \"wall\"\nkind = \"weld\"\nparent = \"ground\"\nchild = \"strip.root\"\n") +
         load(kind, "strip.tip", direction, value);
}

std::string hinge(const std::string& name, const std::string& between, double x, double angle) {
  return joint(
      fmt::format("name = \"{}\"\nkind = \"revolute\"\n{}\nposition = [{}, 0, 0]\nrotation = [0, 0, {:.17g}]\n", name, between, x, angle));
}

// Two round bars hinged about z to ground and to each other, the given angle to the level, pressed at the apex.
std::string truss(double angle, double diameter, double force) {
  const std::string section = fmt::format("{{ shape = \"circle\", diameter = {} }}", diameter);
  const double foot = L * std::cos(angle);
  return head + bar_of("left", section) + bar_of("right", section) +
         hinge("a", "parent = \"ground\"\nchild = \"left.root\"", -foot, angle) +
         hinge("b", "parent = \"ground\"\nchild = \"right.root\"", foot, pi - angle) +
         hinge("apex", "parent = \"left.tip\"\nchild = \"right.tip\"", 0.0, pi - 2.0 * angle) +
         load("force", "left.tip", "[0, -1, 0]", force);
}

// What each bar carries when the truss tips over across its plane, of its Euler load: it is clamped at its foot, free to move across at the
// apex, and turned there against its own twist, k = G J cot^2 / L. tan z = -z E I / (k L), P / P_Euler = (z / pi)^2; J = 2 I of a circle.
double share_of_euler(double angle) {
  const double spring = 2.0 * G / (E * std::pow(std::tan(angle), 2));
  double low = 0.5 * pi * (1.0 + 1e-9), high = pi;
  for (int i = 0; i < 60; ++i) {
    const double z = 0.5 * (low + high);
    (std::tan(z) + z / spring < 0.0 ? low : high) = z;
  }
  return std::pow(low / pi, 2);
}

bool warned(const std::string& scene) {
  return said(simulate(parse_scene(scene, "plane.toml")), Severity::warning, "it holds in the plane only");
}

}  // namespace

TEST(AcrossPlane, TrussesTipAtTheLoadByEuler) {
  constexpr double d = 0.02, euler = pi * pi * E * pi * d * d * d * d / 64.0 / (L * L);
  for (const double degrees : {30.0, 60.0, 75.0}) {
    const double angle = degrees * pi / 180.0, critical = 2.0 * std::sin(angle) * share_of_euler(angle) * euler;
    EXPECT_FALSE(warned(truss(angle, d, 0.95 * critical))) << degrees;
    EXPECT_TRUE(warned(truss(angle, d, 1.05 * critical))) << degrees;
  }
}

TEST(AcrossPlane, ColumnsAndConsolesTipAtTheLoadsByEulerAndTimoshenko) {
  constexpr double h = 0.04, b = 0.004, weak = h * b * b * b / 12.0, J = h * b * b * b / 3.0 * (1.0 - 0.63 * b / h);
  const std::string deep = fmt::format("{{ shape = \"rectangle\", height = {}, width = {} }}", h, b);
  const double column = pi * pi * E * weak / (4.0 * L * L), console_load = 4.0126 / (L * L) * std::sqrt(E * weak * G * J);
  for (const bool beyond : {false, true}) {
    const double share = beyond ? 1.05 : 0.95;
    EXPECT_EQ(warned(console(deep, "force", "[-1, 0, 0]", share * column)), beyond);
    EXPECT_EQ(warned(console(deep, "force", "[0, -1, 0]", share * console_load)), beyond);
  }
}

// Beams as stiff one way as the other, whose coordinates bend them both ways at once: an angle of two bars under its weight rests in space
// as it does in its plane, so that nothing accelerates there (it was judged with 2343 m/s^2 under 9.81), and is known to be stable.
TEST(AcrossPlane, SquareBarsRestInSpaceAsInTheirPlane) {
  const std::string section = "{ shape = \"rectangle\", height = 0.02, width = 0.02 }";
  const Scene scene = parse_scene("[simulation]\nduration = 0.05\noutput_rate = 200\ngravity = [0, -9.81, 0]\nstart = \"static\"\n" +
                                      bar_of("post", section) + bar_of("arm", section) +
                                      joint("name = \"foot\"\nkind = \"weld\"\nparent = \"ground\"\nchild = \"post.root\"\nrotation = "
                                            "[0, 0, 1.5707963267948966]\n") +
                                      joint("name = \"corner\"\nkind = \"weld\"\nparent = \"post.tip\"\nchild = \"arm.root\"\nrotation = "
                                            "[0, 0, -1.5707963267948966]\n"),
                                  "angle.toml");
  const System start = make_system(scene);
  const std::optional<RestInSpace> rest = rest_in_space(scene, start.model.effects);
  ASSERT_TRUE(rest);
  EXPECT_TRUE(linearise(rest->wide).equilibrium);
  EXPECT_TRUE(surely_stable(rest->wide));
}

// The search in space ran hundreds of steps of two hundred coordinates down a hill that nobody asks about (95 CPU s, and 5 of a truss).
TEST(AcrossPlane, IsJudgedWhereItRestsWithoutASearch) {
  const std::string thin = "{ shape = \"rectangle\", height = 0.0076, width = 0.0059 }";
  const double bend = 4.45 * E * 0.0059 * std::pow(0.0076, 3) / 12.0 / L;
  const double angle = pi / 6.0, d = 0.04, euler = pi * pi * E * pi * d * d * d * d / 64.0;
  for (const std::string& text : {console(thin, "torque", "[0, 0, 1]", bend, "model = \"mixed\"\nvolumes = 20"),
                                  truss(angle, d, 0.9 * euler), truss(angle, d, 1.1 * euler)}) {
    Scene scene = parse_scene(text, "plane.toml");
    const System start = make_system(scene);
    const std::optional<RestInSpace> rest = rest_in_space(scene, start.model.effects);
    ASSERT_TRUE(rest);
    ASSERT_EQ(rest->wide.model.parts.size(), rest->flat.model.parts.size());
    int steps = 1000;
    for (const Note& n : rest->wide.notes.all()) std::sscanf(n.text.c_str(), "static equilibrium: %d Newton steps", &steps);
    EXPECT_LE(steps, 5);
    for (size_t i = 0; i < rest->wide.model.parts.size(); ++i)
      EXPECT_LT((rest->wide.work.parts[i].world.p - rest->flat.work.parts[i].world.p).norm(), 1e-9) << i;
  }
  EXPECT_TRUE(warned(console(thin, "torque", "[0, 0, 1]", bend, "model = \"mixed\"\nvolumes = 20")));
}

}  // namespace flexframe::sim::test_across_plane
