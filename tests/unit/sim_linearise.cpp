// Small vibrations of whole systems in closed form: frequencies, damping, shapes.
#include "mechanism_text.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

namespace flexframe::sim {
namespace {

Linearisation modes_of(const std::string& scene) { return linearise(make_system(parse_scene(scene, "modes.toml"))); }

std::string mass(const std::string& name, double m, const std::string& more = "inertia = [0.1, 0.2, 0.3]") {
  return fmt::format("[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = {}\n{}\n", name, m, more);
}

double hertz(double omega) { return omega / (2 * pi); }

// A mass on a spring and damper of each kind: joint, between frames, bushing, and a joint that closes a loop.
TEST(Linearise, EverySpringAndDamper) {
  const std::string bodies = head(1, Vec3::Zero()) + mass("b", 2);
  const std::string rail = joint("x", "prismatic", "ground", "b", "axis = [1, 0, 0]\n");
  const std::string held = mass("c", 1) + joint("c", "weld", "ground", "c", "position = [-1, 0, 0]");
  for (const std::string& scene : {bodies + joint("x", "prismatic", "ground", "b", "axis = [1, 0, 0]\nspring = { stiffness = 800, damping = 12 }"),
                                   bodies + held + rail + "[[force]]\nkind = \"spring-damper\"\non = \"b\"\nfrom = \"c\"\nstiffness = 800\ndamping = 12\nrest = 1\n",
                                   bodies + rail + "[[force]]\nkind = \"bushing\"\non = \"b\"\nstiffness = [800, 1, 1, 0, 0, 0]\ndamping = [12, 1, 1, 0, 0, 0]\n",
                                   bodies + rail + joint("again", "prismatic", "ground", "b", "axis = [1, 0, 0]\nspring = { stiffness = 800, damping = 12 }")}) {
    const Linearisation linear = modes_of(scene);
    ASSERT_EQ(linear.modes.size(), 1u);
    EXPECT_NEAR(linear.modes[0].frequency, hertz(20), 1e-8) << scene;
    EXPECT_NEAR(linear.modes[0].damping, 12 / (2 * 2 * 20.0), 1e-9) << scene;
    EXPECT_TRUE(linear.equilibrium);
  }
}

// Three equal masses between walls: 2 sqrt(k/m) sin(n pi / 8), shapes sin(n pi i / 4); damping in proportion to the stiffness.
TEST(Linearise, ChainOfMasses) {
  std::string scene = head(1, Vec3::Zero());
  const double k = 500, m = 2, beta = 1e-3;
  for (int i = 1; i <= 3; ++i) {
    scene += mass(fmt::format("m{}", i), m) + joint(fmt::format("s{}", i), "prismatic", "ground", fmt::format("m{}", i), "axis = [0, 1, 0]");
    scene += fmt::format("[[force]]\nkind = \"bushing\"\non = \"m{}\"\n{}stiffness = [0, 500, 0, 0, 0, 0]\ndamping = [0, 0.5, 0, 0, 0, 0]\n", i, i > 1 ? fmt::format("from = \"m{}\"\n", i - 1) : "");
  }
  scene += "[[force]]\nkind = \"bushing\"\non = \"m3\"\nstiffness = [0, 500, 0, 0, 0, 0]\ndamping = [0, 0.5, 0, 0, 0, 0]\n";
  const Linearisation linear = modes_of(scene);
  ASSERT_EQ(linear.modes.size(), 3u);
  for (int n = 1; n <= 3; ++n) {
    const LinearMode& mode = linear.modes[static_cast<size_t>(n - 1)];
    const double omega = 2 * std::sqrt(k / m) * std::sin(n * pi / 8);
    EXPECT_NEAR(mode.frequency, hertz(omega), 1e-8);
    EXPECT_NEAR(mode.damping, 0.5 * beta * omega, 1e-9);
    Vec3 shape(std::sin(n * pi / 4), std::sin(n * pi / 2), std::sin(3 * n * pi / 4));
    shape /= shape.cwiseAbs().maxCoeff();
    EXPECT_LT(std::min((mode.shape - shape).norm(), (mode.shape + shape).norm()), 1e-7) << n;
  }
}

// A point mass on a string (spherical joint) swings in two directions at sqrt(g/l), and turning about the string is a rigid mode: it has no inertia.
TEST(Linearise, PointMassOnAString) {
  for (const char* inertia : {"", "inertia = [0, 0, 0]"}) {
    const Linearisation linear = modes_of(head(1, Vec3(0, 0, -9.81)) + mass("bob", 2, fmt::format("centre_of_mass = [0, 0, -0.5]\n{}", inertia)) + joint("string", "spherical", "ground", "bob", ""));
    ASSERT_EQ(linear.modes.size(), 3u);
    EXPECT_EQ(linear.modes[0].frequency, 0.0);
    EXPECT_EQ(linear.modes[0].growth, 0.0);
    EXPECT_GT(std::abs(linear.modes[0].shape[2]), 0.999);
    for (size_t k = 1; k < 3; ++k) {
      EXPECT_NEAR(linear.modes[k].frequency, hertz(std::sqrt(9.81 / 0.5)), 1e-8);
      EXPECT_LT(std::abs(linear.modes[k].shape[2]), 1e-6);
    }
    EXPECT_TRUE(linear.equilibrium);
  }
  // Beside a body with inertia on it, and upside down: it falls at the same rate.
  const Linearisation up = modes_of(head(1, Vec3(0, 0, 9.81)) + mass("bob", 2, "centre_of_mass = [0, 0, -0.5]") + joint("string", "spherical", "ground", "bob", ""));
  ASSERT_EQ(up.modes.size(), 3u);
  for (size_t k = 0; k < 2; ++k) EXPECT_NEAR(up.modes[k].growth, std::sqrt(9.81 / 0.5), 1e-7);
}

// A double pendulum of point masses: omega^2 = (g/l) (2 -+ sqrt 2), the lower swinging -+ sqrt 2 as far as the upper.
TEST(Linearise, DoublePendulum) {
  const std::string bob = "centre_of_mass = [0, -1, 0]\nframes = { end = [0, -1, 0] }";
  const Linearisation linear = modes_of(head(1, Vec3(0, -9.81, 0)) + mass("a", 1, bob) + mass("b", 1, bob) + joint("ja", "revolute", "ground", "a", "") + joint("jb", "revolute", "a.end", "b", ""));
  ASSERT_EQ(linear.modes.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    const double sign = k == 0 ? -1 : 1;
    EXPECT_NEAR(linear.modes[static_cast<size_t>(k)].frequency, hertz(std::sqrt(9.81 * (2 + sign * std::sqrt(2.0)))), 1e-8);
    const VecX& shape = linear.modes[static_cast<size_t>(k)].shape;
    EXPECT_NEAR((shape[0] + shape[1]) / shape[0], -sign * std::sqrt(2.0), 1e-7);
  }
}

// A loop: the parallelogram of two equal rods and a massless coupler swings as one rod does, sqrt(3 g / 2 l), with damping in one of its joints.
TEST(Linearise, ParallelogramWithDamping) {
  const std::string hang = "rotation = [0, 0, -1.5707963267948966]\n";
  const Linearisation linear = modes_of(head(1, Vec3(0, -9.81, 0)) + rod("a") + rod("c") + mass("b", 0, "frames = { end = [0.7, 0, 0] }") +
                                        joint("ja", "revolute", "ground", "a", hang + "spring = { damping = 0.4 }") + joint("jc", "revolute", "ground", "c", hang + "position = [0.7, 0, 0]") +
                                        joint("jb", "revolute", "a.tip", "b", "rotation = [0, 0, 1.5707963267948966]") + joint("jd", "revolute", "b.end", "c.tip", ""));
  ASSERT_EQ(linear.modes.size(), 1u);
  const double omega = std::sqrt(1.5 * 9.81);
  EXPECT_NEAR(linear.modes[0].frequency, hertz(omega), 1e-7);
  EXPECT_NEAR(linear.modes[0].damping, 0.4 / (2 * (2.0 / 3.0) * omega), 1e-8);
}

}  // namespace
}  // namespace flexframe::sim
