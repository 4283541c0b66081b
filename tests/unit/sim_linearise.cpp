// Small vibrations of whole systems in closed form: frequencies, damping, shapes.
#include "mechanism_text.h"
#include "sim/base/eigen_solvers.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_linearise {
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
  for (const std::string& scene :
       {bodies + joint("x", "prismatic", "ground", "b", "axis = [1, 0, 0]\nspring = { stiffness = 800, damping = 12 }"),
        bodies + held + rail + "[[force]]\nkind = \"spring-damper\"\non = \"b\"\nfrom = \"c\"\nstiffness = 800\ndamping = 12\nrest = 1\n",
        bodies + rail + "[[force]]\nkind = \"bushing\"\non = \"b\"\nstiffness = [800, 1, 1, 0, 0, 0]\ndamping = [12, 1, 1, 0, 0, 0]\n",
        bodies + rail + joint("again", "prismatic", "ground", "b", "axis = [1, 0, 0]\nspring = { stiffness = 800, damping = 12 }")}) {
    const Linearisation linear = modes_of(scene);
    ASSERT_EQ(linear.modes.size(), 1u);
    const double ratio = 12 / (2 * 2 * 20.0);
    EXPECT_NEAR(linear.modes[0].frequency, hertz(20 * std::sqrt(1 - ratio * ratio)), 1e-8) << scene;
    EXPECT_NEAR(linear.modes[0].damping, ratio, 1e-9) << scene;
    EXPECT_NEAR(std::abs(linear.modes[0].pole - std::complex<double>(-3, std::sqrt(391.0))), 0.0, 1e-8) << scene;
    EXPECT_TRUE(linear.equilibrium);
  }
}

// A ball that presses on a floor by its weight, much less deep than anything in the scene is long: sqrt(k/m), on this side of lift-off.
TEST(Linearise, BallOnAFloor) {
  for (const double stiffness : {1e3, 1e6, 1e9}) {
    const double depth = 2 * 9.81 / stiffness;
    const Linearisation linear = modes_of(
        head(1, Vec3(0, -9.81, 0)) + mass("ball", 2, "inertia = [0.1, 0.1, 0.1]\nframes = { far = [3, 0, 0] }") +
        joint("way", "prismatic", "ground", "ball", fmt::format("axis = [0, 1, 0]\ninitial = {{ value = {:.17g} }}", 0.1 - depth)) +
        fmt::format("[[force]]\nkind = \"contact\"\non = \"ball\"\nshape = \"sphere\"\nradius = 0.1\nnormal = [0, 1, 0]\n"
                    "stiffness = {}\n",
                    stiffness));
    ASSERT_EQ(linear.modes.size(), 1u);
    EXPECT_NEAR(linear.modes[0].frequency / hertz(std::sqrt(stiffness / 2)), 1.0, 1e-5) << stiffness;
  }
}

// Springs at their rest lengths along a line aslant: their forces are rounding of places, and no load says how small that is. A pull that
// moves them by more than that is no equilibrium.
TEST(Linearise, SpringsAtRestAreAnEquilibrium) {
  const Vec3 along(std::cos(0.354), std::sin(0.354), 0.0);
  for (const double rest : {1.0, 1.0 + 1e-6}) {
    std::string scene = head(1, Vec3::Zero());
    for (int i = 0; i < 3; ++i) {
      scene += mass(fmt::format("b{}", i), 1.0 + i) + joint(fmt::format("j{}", i), "prismatic", "ground", fmt::format("b{}", i),
                                                            fmt::format("axis = {}\nposition = {}{}", list(along), list(i * along),
                                                                        i == 0 ? "\nspring = { stiffness = 1600, damping = 2 }" : ""));
      if (i > 0)
        scene += fmt::format("[[force]]\nkind = \"spring-damper\"\non = \"b{}\"\nfrom = \"b{}\"\nstiffness = 2000\nrest = {:.9f}\n", i,
                             i - 1, rest);
    }
    EXPECT_EQ(modes_of(scene).equilibrium, rest == 1.0) << rest;
  }
}

// Three equal masses between walls: 2 sqrt(k/m) sin(n pi / 8), shapes sin(n pi i / 4); damping in proportion to the stiffness.
TEST(Linearise, ChainOfMasses) {
  std::string scene = head(1, Vec3::Zero());
  const double k = 500, m = 2, beta = 1e-3;
  for (int i = 1; i <= 3; ++i) {
    scene +=
        mass(fmt::format("m{}", i), m) + joint(fmt::format("s{}", i), "prismatic", "ground", fmt::format("m{}", i), "axis = [0, 1, 0]");
    scene +=
        fmt::format("[[force]]\nkind = \"bushing\"\non = \"m{}\"\n{}stiffness = [0, 500, 0, 0, 0, 0]\ndamping = [0, 0.5, 0, 0, 0, 0]\n", i,
                    i > 1 ? fmt::format("from = \"m{}\"\n", i - 1) : "");
  }
  scene += "[[force]]\nkind = \"bushing\"\non = \"m3\"\nstiffness = [0, 500, 0, 0, 0, 0]\ndamping = [0, 0.5, 0, 0, 0, 0]\n";
  const Linearisation linear = modes_of(scene);
  ASSERT_EQ(linear.modes.size(), 3u);
  for (int n = 1; n <= 3; ++n) {
    const LinearMode& mode = linear.modes[static_cast<size_t>(n - 1)];
    const double omega = 2 * std::sqrt(k / m) * std::sin(n * pi / 8);
    const double ratio = 0.5 * beta * omega;
    EXPECT_NEAR(mode.frequency, hertz(omega * std::sqrt(1 - ratio * ratio)), 1e-8);
    EXPECT_NEAR(mode.damping, ratio, 1e-9);
    Vec3 shape(std::sin(n * pi / 4), std::sin(n * pi / 2), std::sin(3 * n * pi / 4));
    shape /= shape.cwiseAbs().maxCoeff();
    EXPECT_LT(std::min((mode.shape - shape).norm(), (mode.shape + shape).norm()), 1e-7) << n;
  }
}

// A point mass on a string (spherical joint) swings in two directions at sqrt(g/l), and turning about the string is a rigid mode: it has no
// inertia.
TEST(Linearise, PointMassOnAString) {
  for (const char* inertia : {"", "inertia = [0, 0, 0]"}) {
    const Linearisation linear =
        modes_of(head(1, Vec3(0, 0, -9.81)) + mass("bob", 2, fmt::format("centre_of_mass = [0, 0, -0.5]\n{}", inertia)) +
                 joint("string", "spherical", "ground", "bob", ""));
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
  const Linearisation up = modes_of(head(1, Vec3(0, 0, 9.81)) + mass("bob", 2, "centre_of_mass = [0, 0, -0.5]") +
                                    joint("string", "spherical", "ground", "bob", ""));
  ASSERT_EQ(up.modes.size(), 3u);
  for (size_t k = 0; k < 2; ++k) EXPECT_NEAR(up.modes[k].growth, std::sqrt(9.81 / 0.5), 1e-7);
}

// A double pendulum of point masses: omega^2 = (g/l) (2 -+ sqrt 2), the lower swinging -+ sqrt 2 as far as the upper.
TEST(Linearise, DoublePendulum) {
  const std::string bob = "centre_of_mass = [0, -1, 0]\nframes = { end = [0, -1, 0] }";
  const Linearisation linear = modes_of(head(1, Vec3(0, -9.81, 0)) + mass("a", 1, bob) + mass("b", 1, bob) +
                                        joint("ja", "revolute", "ground", "a", "") + joint("jb", "revolute", "a.end", "b", ""));
  ASSERT_EQ(linear.modes.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    const double sign = k == 0 ? -1 : 1;
    EXPECT_NEAR(linear.modes[static_cast<size_t>(k)].frequency, hertz(std::sqrt(9.81 * (2 + sign * std::sqrt(2.0)))), 1e-8);
    const VecX& shape = linear.modes[static_cast<size_t>(k)].shape;
    EXPECT_NEAR((shape[0] + shape[1]) / shape[0], -sign * std::sqrt(2.0), 1e-7);
  }
}

// A loop: the parallelogram of two equal rods and a massless coupler swings as one rod does, sqrt(3 g / 2 l), with damping in one of its
// joints.
TEST(Linearise, ParallelogramWithDamping) {
  const std::string hang = "rotation = [0, 0, -1.5707963267948966]\n";
  const Linearisation linear = modes_of(head(1, Vec3(0, -9.81, 0)) + rod("a") + rod("c") + mass("b", 0, "frames = { end = [0.7, 0, 0] }") +
                                        joint("ja", "revolute", "ground", "a", hang + "spring = { damping = 0.4 }") +
                                        joint("jc", "revolute", "ground", "c", hang + "position = [0.7, 0, 0]") +
                                        joint("jb", "revolute", "a.tip", "b", "rotation = [0, 0, 1.5707963267948966]") +
                                        joint("jd", "revolute", "b.end", "c.tip", ""));
  ASSERT_EQ(linear.modes.size(), 1u);
  const double omega = std::sqrt(1.5 * 9.81);
  const double ratio = 0.4 / (2 * (2.0 / 3.0) * omega);
  EXPECT_NEAR(linear.modes[0].frequency, hertz(omega * std::sqrt(1 - ratio * ratio)), 1e-7);
  EXPECT_NEAR(linear.modes[0].damping, ratio, 1e-8);
}

// Poles of the vibrations and of what grows or decays, by rising imaginary part, then real part.
std::vector<std::complex<double>> poles(const Linearisation& linear) {
  std::vector<std::complex<double>> out;
  for (const LinearMode& m : linear.modes)
    if (m.kind != LinearMode::rigid) out.push_back(m.pole);
  std::sort(out.begin(), out.end(),
            [](auto a, auto b) { return std::abs(a.imag() - b.imag()) > 1e-9 ? a.imag() < b.imag() : a.real() < b.real(); });
  return out;
}

void expect_poles(const Linearisation& linear, std::vector<std::complex<double>> wanted, double tolerance, const std::string& what) {
  // Of a pair the upper one.
  for (std::complex<double>& z : wanted) z = {z.real(), std::abs(z.imag())};
  std::sort(wanted.begin(), wanted.end(),
            [](auto a, auto b) { return std::abs(a.imag() - b.imag()) > 1e-9 ? a.imag() < b.imag() : a.real() < b.real(); });
  const auto found = poles(linear);
  ASSERT_EQ(found.size(), wanted.size()) << what;
  for (size_t k = 0; k < found.size(); ++k)
    EXPECT_LT(std::abs(found[k] - wanted[k]), tolerance) << what << ": " << found[k] << " for " << wanted[k];
}

// Damping that is not proportional: two masses with one strong damper, against their 4 x 4 matrix.
TEST(Linearise, OneStrongDamper) {
  const double k1 = 400, k2 = 500, k = 300, c = 200, ma = 1, mb = 2;
  const Linearisation linear =
      modes_of(head(1, Vec3::Zero()) + mass("a", ma) + mass("b", mb) +
               joint("a", "prismatic", "ground", "a", "axis = [1, 0, 0]\nspring = { stiffness = 400 }") +
               joint("b", "prismatic", "ground", "b", "axis = [1, 0, 0]\nspring = { stiffness = 500, damping = 200 }") +
               "[[force]]\nkind = \"bushing\"\non = \"a\"\nfrom = \"b\"\nstiffness = [300, 0, 0, 0, 0, 0]\n");
  MatX A(4, 4);
  A << 0, 0, 1, 0, 0, 0, 0, 1, -(k1 + k) / ma, k / ma, 0, 0, k / mb, -(k2 + k) / mb, 0, -c / mb;
  const ComplexEigen exact(A);
  std::vector<std::complex<double>> wanted;
  for (const auto& z : exact.eigenvalues())
    if (z.imag() >= 0) wanted.push_back(z);
  expect_poles(linear, wanted, 1e-8, "two masses");
  EXPECT_EQ(linear.modes.back().kind, LinearMode::overdamped);
  EXPECT_EQ(linear.modes.front().kind, LinearMode::vibration);
}

// Jeffcott's rotor in turning axes: m z'' + (c + ci + 2 i m W) z' + (k - m W^2 + i c W) z = 0. A damper on ground never makes it unstable,
// one that turns with the shaft does above (1 + c/ci) times the critical speed.
TEST(Linearise, RotorWithInnerAndOuterDamper) {
  const double k = 400;
  for (const double W : {11.0, 30.0, 50.0})
    for (const auto& [c, ci] : {std::pair{3.0, 0.0}, {0.0, 3.0}, {2.0, 1.6}}) {
      const std::string slide = fmt::format("spring = {{ stiffness = {}, damping = {} }}", k, ci);
      const Linearisation linear = modes_of(
          head(1, Vec3::Zero()) + mass("hub", 1) + mass("link", 1e-9, "inertia = [1e-9, 1e-9, 1e-9]") + mass("disc", 1) +
          joint("spin", "revolute", "ground", "hub", fmt::format("motion = \"{}*t\"", W)) +
          joint("x", "prismatic", "hub", "link", "axis = [1, 0, 0]\n" + slide) +
          joint("y", "prismatic", "link", "disc", "axis = [0, 1, 0]\n" + slide) +
          fmt::format("[[force]]\nkind = \"bushing\"\non = \"disc\"\nstiffness = [0, 0, 0, 0, 0, 0]\ndamping = [{0}, {0}, 0, 0, 0, 0]\n",
                      c));
      const std::complex<double> i(0, 1), half = 0.5 * (c + ci + 2.0 * i * W), root = std::sqrt(half * half - (k - W * W + i * c * W));
      // The conjugates are the other two.
      expect_poles(linear, {-half + root, -half - root}, 1e-6, fmt::format("W {} c {} ci {}", W, c, ci));
      EXPECT_EQ(linear.modes[0].kind == LinearMode::unstable, ci > 0 && W > 20 * (1 + c / ci)) << W << " " << c << " " << ci;
      EXPECT_TRUE(linear.turning_axes);
    }
}

// A column pressed at its tip by `load` EI/L^2.
std::string column_of(double load, bool follows) {
  const double EI = 2.1e11 * pi * std::pow(0.01, 4) / 64;
  return head(1, Vec3::Zero()) +
         "[[body]]\nname = \"c\"\nkind = \"beam\"\nlength = 1\nsection = { shape = \"circle\", diameter = 0.01 }\n"
         "material = { density = 7800.0, youngs_modulus = 2.1e11 }\nelements = 10\neffects = [\"bending_xy\", \"stiffening\"]\n" +
         joint("foot", "weld", "ground", "c.root", "") +
         fmt::format("[[force]]\nkind = \"force\"\non = \"c.tip\"\ndirection = [-1, 0, 0]\nvalue = {}\nframe = \"{}\"\n", load * EI,
                     follows ? "body" : "world");
}

// A column under a load that follows its tip flutters beyond 20.05 EI/L^2 (Beck 1952); a dead load buckles it at pi^2/4 EI/L^2.
TEST(Linearise, BecksColumn) {
  const auto column = [](double load, bool follows) { return modes_of(column_of(load, follows)); };
  EXPECT_EQ(column(19.8, true).modes[0].kind, LinearMode::vibration);
  const LinearMode flutter = column(20.3, true).modes[0];
  EXPECT_EQ(flutter.kind, LinearMode::unstable);
  EXPECT_GT(flutter.frequency, 1.0);
  EXPECT_EQ(column(0.99 * pi * pi / 4, false).modes[0].kind, LinearMode::vibration);
  const LinearMode buckles = column(1.01 * pi * pi / 4, false).modes[0];
  EXPECT_EQ(buckles.kind, LinearMode::unstable);
  EXPECT_EQ(buckles.frequency, 0.0);
}

// Without modes: a dead load is known to be stable up to Euler's load, and nothing is said beyond it, of a load that follows the tip so far
// that it flutters (Beck), and of what moves freely.
TEST(Linearise, StabilityIsKnownWithoutModesWhereStiffnessProvesIt) {
  const auto known = [](const std::string& scene) { return surely_stable(make_system(parse_scene(scene, "stable.toml"))); };
  EXPECT_TRUE(known(column_of(0.0, false)));
  EXPECT_TRUE(known(column_of(0.97 * pi * pi / 4, false)));
  EXPECT_FALSE(known(column_of(1.01 * pi * pi / 4, false)));
  EXPECT_FALSE(known(column_of(20.3, true)));
  const std::string bob = mass("bob", 2, "inertia = [0.1, 0.1, 0.1]\ncentre_of_mass = [0, -1, 0]");
  EXPECT_TRUE(known(head(1, Vec3(0, -9.81, 0)) + bob + joint("pin", "revolute", "ground", "bob", "")));
  EXPECT_FALSE(known(head(1, Vec3(0, 9.81, 0)) + bob + joint("pin", "revolute", "ground", "bob", "")));
  EXPECT_FALSE(known(head(1, Vec3::Zero()) + bob + joint("pin", "revolute", "ground", "bob", "")));
}

// What flies freely is neither stiff nor unstable, at rest or under gravity, whatever its units and orientation.
TEST(Linearise, FreeMotionsAreRigid) {
  const std::string box = "inertia = [1, 2, 2.5]\ncentre_of_mass = [0.1, 0.2, 0.3]";
  for (const Vec3& gravity : {Vec3(0, 0, 0), Vec3(0, 0, -9.81), Vec3(3, 400, -9.81)})
    for (const double scale : {1e-6, 1.0, 1e6}) {
      const Linearisation linear = modes_of(
          head(1, gravity) +
          mass("box", scale, fmt::format("inertia = [{}, {}, {}]\ncentre_of_mass = [0.1, 0.2, 0.3]", scale, 2 * scale, 2.5 * scale)) +
          joint("f", "free", "ground", "box", "initial = { value = [1, 2, 3, 0.3, -1.1, 0.7], rate = [3, -1, 2] }"));
      ASSERT_EQ(linear.modes.size(), 6u);
      for (const LinearMode& m : linear.modes) EXPECT_EQ(m.kind, LinearMode::rigid);
    }
  const Linearisation beam =
      modes_of(head(1, Vec3(0, 0, -9.81)) +
               "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1\nsection = { shape = \"circle\", diameter = 0.01 }\n"
               "material = { density = 7800.0, youngs_modulus = 2.1e11 }\nelements = 8\neffects = [\"bending_xy\", \"bending_xz\", "
               "\"stiffening\"]\n");
  for (size_t k = 0; k < 6; ++k) EXPECT_EQ(beam.modes[k].kind, LinearMode::rigid);
  EXPECT_NEAR(beam.modes[6].frequency, 22.3733 * 0.0025 * std::sqrt(2.1e11 / 7800) / (2 * pi), 1e-3 * beam.modes[6].frequency);
}

// A sleeping top: A z'' - i C W z' - m g l z = 0, stable above W = 2 sqrt(A m g l) / C; the same however the world is turned.
TEST(Linearise, SleepingTop) {
  const double m = 2, l = 0.5, g = 9.81, C = 0.03, A = 0.02 + m * l * l, critical = 2 * std::sqrt(A * m * g * l) / C;
  for (const Vec3& turn : {Vec3(0, 0, 0), Vec3(0.4, -1.3, 0.8)})
    for (const double W : {0.9 * critical, 1.02 * critical, 3 * critical}) {
      const Mat3 R = rotation_exp(turn);
      const Linearisation linear = modes_of(
          head(1, R * Vec3(0, 0, -g)) + mass("top", m, fmt::format("inertia = [0.02, 0.02, {}]\ncentre_of_mass = [0, 0, {}]", C, l)) +
          joint("ball", "spherical", "ground", "top",
                fmt::format("initial = {{ value = {}, rate = {} }}", list(turn), list(R * Vec3(0, 0, W)))));
      const std::complex<double> root = std::sqrt(std::complex<double>(C * C * W * W - 4 * A * m * g * l)), i(0, 1);
      expect_poles(linear, {i * (C * W + root) / (2 * A), i * (C * W - root) / (2 * A)}, 1e-6 * W, fmt::format("top at {}", W));
      EXPECT_EQ(linear.modes[0].kind == LinearMode::unstable, W < critical);
      EXPECT_TRUE(linear.moving);
      EXPECT_TRUE(linear.equilibrium);
      EXPECT_FALSE(linear.turning_axes);
    }
}

// A free body that spins about a principal axis: unstable about the middle one, rate^2 = W^2 (Ib - I)(I - Ia) / (Ia Ib) (Euler). It flies
// along meanwhile.
TEST(Linearise, SpinAboutPrincipalAxes) {
  const Vec3 I(1.0, 2.0, 2.5);
  for (const Vec3& gravity : {Vec3(0, 0, 0), Vec3(1, -9.81, 2)})
    for (int axis = 0; axis < 3; ++axis) {
      SCOPED_TRACE(fmt::format("axis {}, gravity {}", axis, gravity.y()));
      const double W = 7.0, own = I[axis], a = I[(axis + 1) % 3], b = I[(axis + 2) % 3], square = W * W * (own - a) * (own - b) / (a * b);
      const Linearisation linear = modes_of(
          head(1, gravity) + mass("body", 3, "inertia = [1, 2, 2.5]") +
          joint("f", "free", "ground", "body",
                fmt::format("initial = {{ rate = [2, -3, 1, {}, {}, {}] }}", axis == 0 ? W : 0, axis == 1 ? W : 0, axis == 2 ? W : 0)));
      if (square < 0) {
        EXPECT_EQ(linear.modes[0].kind, LinearMode::unstable);
        EXPECT_NEAR(linear.modes[0].growth, std::sqrt(-square), 1e-7);
      } else {
        bool found = false;
        for (const LinearMode& m : linear.modes) {
          EXPECT_NE(m.kind, LinearMode::unstable);
          found = found || std::abs(m.pole - std::complex<double>(0, std::sqrt(square))) < 1e-7;
        }
        EXPECT_TRUE(found) << axis;
      }
      EXPECT_EQ(linear.equilibrium, gravity.isZero(0.0));
    }
}

// A carrier that would tumble about its middle axis is held by a wheel that spins about it: (I W + h - Ia W)(I W + h - Ib W) > 0 (a
// gyrostat).
TEST(Linearise, Gyrostat) {
  const double W = 1.0, wheel = 0.1;
  for (const double h : {0.0, 0.2, 1.0}) {
    // The wheel's inertia across its axis is the carrier's affair: 0.
    const Linearisation linear =
        modes_of(head(1, Vec3::Zero()) + mass("carrier", 5, "inertia = [1, 2, 2.5]") +
                 mass("wheel", 1e-6, fmt::format("inertia = [{0}, {1}, {0}]", 0.5 * wheel, wheel)) +
                 joint("f", "free", "ground", "carrier", fmt::format("initial = {{ rate = [0, 0, 0, 0, {}, 0] }}", W)) +
                 joint("axle", "revolute", "carrier", "wheel", fmt::format("axis = [0, 1, 0]\ninitial = {{ rate = {} }}", h / wheel)));
    const double a = 1.0 + 0.5 * wheel, b = 2.5 + 0.5 * wheel, momentum = (2.0 + wheel) * W + h,
                 square = (momentum - a * W) * (momentum - b * W) / (a * b);
    if (square < 0) {
      EXPECT_NEAR(linear.modes[0].growth, std::sqrt(-square), 1e-6) << h;
    } else {
      EXPECT_NE(linear.modes[0].kind, LinearMode::unstable) << h;
    }
  }
}

// A governor: an arm on a vertical shaft that turns freely, at the angle where it stays, cos = g / (l W^2); it swings about that by W sin
// sqrt(1 + 3 cos^2) where the shaft keeps its momentum (a mass on a sphere), by W sin where a motor keeps the rate.
TEST(Linearise, ArmThatTurnsSteadily) {
  const double g = 9.81, l = 0.5, W = 8, c = g / (l * W * W), s = std::sqrt(1 - c * c);
  for (const bool driven : {false, true}) {
    const Linearisation linear = modes_of(
        head(1, Vec3(0, 0, -g)) + mass("shaft", 1e-9, "inertia = [1e-12, 1e-12, 1e-12]") +
        mass("bob", 2, "centre_of_mass = [0, 0, -0.5]\ninertia = [1e-12, 1e-12, 1e-12]") +
        joint("spin", "revolute", "ground", "shaft",
              driven ? fmt::format("motion = \"{}*t\"", W) : fmt::format("initial = {{ rate = {} }}", W)) +
        joint("hinge", "revolute", "shaft", "bob", fmt::format("axis = [0, 1, 0]\ninitial = {{ value = {:.17g} }}", std::acos(c))));
    EXPECT_TRUE(linear.equilibrium);
    EXPECT_TRUE(linear.moving);
    EXPECT_NEAR(linear.modes.back().frequency, hertz(driven ? W * s : W * std::sqrt(1 + 3 * c * c)), 1e-6);
  }
}

// Rates that are no steady motion do not count: a pendulum started with a swing has its own frequency.
TEST(Linearise, SwingingStart) {
  const Linearisation linear =
      modes_of(head(1, Vec3(0, -9.81, 0)) + rod("a") +
               joint("j", "revolute", "ground", "a", "rotation = [0, 0, -1.5707963267948966]\ninitial = { rate = 3 }"));
  ASSERT_EQ(linear.modes.size(), 1u);
  EXPECT_NEAR(linear.modes[0].frequency, hertz(std::sqrt(1.5 * 9.81)), 1e-8);
  EXPECT_FALSE(linear.moving);
  EXPECT_EQ(linear.notes.size(), 1u);
}

}  // namespace
}  // namespace flexframe::sim::test_linearise
