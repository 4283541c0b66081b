// Dry friction with exact stick and slip, its regularised version, stops: event times and energies in closed form.
#include "mechanism_text.h"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>

namespace flexframe::sim::test_friction {
namespace {

std::string head(double duration, const std::string& gravity, double rate = 100) {
  return fmt::format("[simulation]\nduration = {:.17g}\noutput_rate = {}\ngravity = {}\n", duration, rate, gravity);
}

std::string block(double mass = 1.0) {
  return fmt::format("[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = {}\ninertia = [0.1, 0.1, 0.1]\n", mass);
}

std::string slide(const std::string& more) {
  return "[[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nparent = \"ground\"\nchild = \"block\"\naxis = [1, 0, 0]\n" + more + "\n";
}

std::string push(const char* on, const char* direction, double value) {
  return fmt::format("[[force]]\nkind = \"force\"\non = \"{}\"\ndirection = {}\nvalue = {}\n", on, direction, value);
}

// A block of 3 m/s on a floor stops after v/(mu g), v^2/(2 mu g), and stays; the normal force as a number and as the reaction.
TEST(Friction, SlidingBlockStops) {
  for (const char* normal : {"19.62", "\"reaction\""}) {
    const Results r =
        run(head(2, "[0, -9.81, 0]") + block(2) +
                slide(fmt::format("initial = {{ rate = 3 }}\nfriction = {{ coefficient = 0.3, normal_force = {} }}", normal)) +
                output("x", "slide", "value") + output("v", "slide", "rate"),
            1e-8);
    const std::vector<double> stick = events(r, "sticks");
    ASSERT_EQ(stick.size(), 1u) << normal;
    EXPECT_NEAR(stick[0], 3 / (0.3 * 9.81), 1e-8);
    const VecX& x = column(r, "x");
    EXPECT_NEAR(x[x.size() - 1], 9 / (2 * 0.3 * 9.81), 1e-8);
    EXPECT_EQ(column(r, "v")[x.size() - 1], 0.0);
    EXPECT_NEAR(r.dissipated[x.size() - 1], 0.5 * 2 * 9, 1e-6);
    EXPECT_LT(energy_gap(r), 1e-6);
  }
}

// On a slope the block stays below the friction angle and slides above it, with g (sin a - mu cos a).
TEST(Friction, SlopeHoldsBelowTheFrictionAngle) {
  for (const auto& [slope, moves] : {std::pair{0.29, 0.0}, std::pair{0.35, 0.5 * (std::sin(0.35) - 0.3 * std::cos(0.35)) * 9.81}}) {
    const Results r =
        run(head(1, "[0, -9.81, 0]") + block() +
                slide(fmt::format("rotation = [0, 0, {:.17g}]\nfriction = {{ coefficient = 0.3, normal_force = \"reaction\" }}", -slope)) +
                output("x", "slide", "value"),
            1e-9);
    EXPECT_NEAR(column(r, "x")[100], moves, 1e-8) << slope;
  }
}

// m x'' + k x = -+f from x0: every half period pi/omega the amplitude loses 2 f/k, until it sticks inside f/k.
TEST(Friction, OscillatorTurnsAndSticksOnTime) {
  const double k = 400, omega = 20, f = 0.2 * 10;
  const std::string scene =
      head(1.2, "[0, 0, 0]") + block() +
      slide("initial = { value = 0.0325 }\nspring = { stiffness = 400 }\nfriction = { coefficient = 0.2, normal_force = 10 }") +
      output("x", "slide", "value");
  double last = 1e9;
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    const Results r = run(scene, tolerance);
    const std::vector<double> turns = events(r, "turns round"), sticks = events(r, "sticks");
    // 32.5 mm - 10 mm - 10 mm - 10 mm = 2.5 mm < f/k = 5 mm.
    ASSERT_EQ(turns.size(), 2u);
    ASSERT_EQ(sticks.size(), 1u);
    double error = std::abs(sticks[0] - 3 * pi / omega);
    for (int i = 0; i < 2; ++i) error = std::max(error, std::abs(turns[i] - (i + 1) * pi / omega));
    EXPECT_LT(error, 30 * tolerance);
    EXPECT_LE(error, last);
    last = std::max(error, 1e-12);
    const VecX& x = column(r, "x");
    EXPECT_NEAR(x[x.size() - 1], -(0.0325 - 6 * f / k), 30 * tolerance);
    EXPECT_LT(energy_gap(r), 10 * tolerance);
  }
}

// The regularised law tends to the exact one as its velocity scale does to zero.
TEST(Friction, RegularisedTendsToExact) {
  double last = 1.0;
  for (const double v : {1e-2, 1e-3, 1e-4}) {
    const Results r = run(head(0.4, "[0, 0, 0]") + block() +
                              slide(fmt::format("initial = {{ value = 0.0325 }}\nspring = {{ stiffness = 400 }}\nfriction = {{ coefficient "
                                                "= 0.2, normal_force = 10, regularised = {} }}",
                                                v)) +
                              output("x", "slide", "value"),
                          1e-7);
    const VecX& x = column(r, "x");
    // At 0.4 s: in the third half period, from +12.5 mm about +5 mm.
    const double error = std::abs(x[x.size() - 1] - (0.005 + 0.0075 * std::cos(20 * 0.4 - 2 * pi)));
    EXPECT_LT(error, 0.5 * last) << v;
    last = error;
  }
  EXPECT_LT(last, 2e-5);
}

// A block on a belt, held by a spring, static coefficient above the kinetic one: the classical stick-slip cycle.
TEST(Friction, BeltDrivenBlockSticksAndSlipsPeriodically) {
  const double k = 100, v = 0.1, normal = 10, mus = 0.4, mu = 0.2, omega = 10, d = (mus - mu) * normal / k;
  const Results r = run(
      head(3, "[0, 0, 0]") + "[[body]]\nname = \"belt\"\nkind = \"rigid\"\nmass = 1\n" + block() +
          "[[joint]]\nname = \"drive\"\nkind = \"prismatic\"\nparent = \"ground\"\nchild = \"belt\"\naxis = [1, 0, 0]\nmotion = \"0.1*t\"\n"
          "[[joint]]\nname = \"contact\"\nkind = \"prismatic\"\nparent = \"belt\"\nchild = \"block\"\naxis = [1, 0, 0]\n"
          "friction = { coefficient = 0.2, static_coefficient = 0.4, normal_force = 10 }\n"
          "[[force]]\nkind = \"bushing\"\non = \"block\"\nstiffness = [100, 0, 0, 0, 0, 0]\n" +
          output("x", "block", "position"),
      1e-9);
  const std::vector<double> slips = events(r, "slips"), sticks = events(r, "sticks");
  const double slip = 2 / omega * (pi - std::atan(d * omega / v)), stick = 2 * d / v;
  ASSERT_GE(slips.size(), 3u);
  double t = mus * normal / k / v;
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(slips[i], t, 1e-7);
    if (i < sticks.size()) {
      EXPECT_NEAR(sticks[i], t + slip, 1e-7);
    }
    t += slip + stick;
  }
  // The belt's drive feeds what friction takes: the balance includes prescribed motions.
  EXPECT_LT(energy_gap(r), 1e-6);
}

// Friction of a revolute: a spinning disc stops after J w / (mu N r); the reaction is its weight.
TEST(Friction, SpinningDiscStops) {
  const Results r =
      run(head(2, "[0, 0, -9.81]") + block(2) +
              "[[joint]]\nname = \"spin\"\nkind = \"revolute\"\nparent = \"ground\"\nchild = \"block\"\ninitial = { rate = 5 }\n"
              "friction = { coefficient = 0.1, normal_force = \"reaction\", radius = 0.2 }\n",
          1e-9);
  const std::vector<double> stick = events(r, "sticks");
  ASSERT_EQ(stick.size(), 1u);
  EXPECT_NEAR(stick[0], 0.1 * 5 / (0.1 * 2 * 9.81 * 0.2), 1e-7);
}

// A ball dropped on a stop: contact lasts as long as the half cycle of its spring, it never pulls, and the balance closes.
TEST(Stops, BouncesWithoutPullingAndKeepsTheBooks) {
  for (const double damping : {0.0, 30.0}) {
    const Results r =
        run(head(2, "[-9.81, 0, 0]", 1000) + block() +
                slide(fmt::format("initial = {{ value = 0.5 }}\nstop = {{ lower = 0, stiffness = 1e4, damping = {} }}", damping)) +
                output("x", "slide", "value") + output("v", "slide", "rate"),
            1e-9);
    const VecX& v = column(r, "v");
    const double impact = std::sqrt(2 * 9.81 * 0.5);
    // Restitution of a damped spring that only pushes (weight neglected): exp(-zeta/sqrt(1-zeta^2) * angle until the force is zero).
    const double zeta = damping / (2 * std::sqrt(1e4)), beta = std::sqrt(1 - zeta * zeta);
    const double angle = damping > 0 ? std::atan2(2 * zeta * beta, 2 * zeta * zeta - 1) : pi;
    EXPECT_NEAR(v.segment(300, 120).maxCoeff(), impact * std::exp(-zeta / beta * angle), 0.03);
    EXPECT_LT(energy_gap(r), 2e-5);
    EXPECT_GE(events(r, "lower stop").size(), 3u);
  }
}

// Heckmann et al. 2006 section 6.1, rigorous solution (sim/REFERENCES.md): constant crank speed, gravity, 30 N of friction on the slider.
// Modal beams, 2 + 3 bending modes and the first axial ones.
std::string dlr_slider_crank(double duration, const std::string& law = "") {
  std::string scene = R"([simulation]
duration = DURATION
output_rate = 200
gravity = [0, -9.81, 0]
[[body]]
name = "crank"
kind = "beam"
length = 3
section = { shape = "general", area = 1e-3, iy = 3.93434522e-6, iz = 3.93434522e-6, j = 1e-6 }
material = { density = 1000, youngs_modulus = 1e9 }
model = "modal"
boundary = "clamped-free"
modes = { bending_xy = [1, 2], axial = [1] }
damping = { ratio = 0.02 }
[[body]]
name = "rod"
kind = "beam"
length = 10
section = { shape = "general", area = 1e-3, iy = 4.05284735e-6, iz = 4.05284735e-6, j = 1e-6 }
material = { density = 1000, youngs_modulus = 1e9 }
model = "modal"
boundary = "supported-supported"
modes = { bending_xy = [1, 2, 3], axial = [1] }
damping = { ratio = 0.02 }
frames = { middle = 0.5 }
[[body]]
name = "slider"
kind = "rigid"
mass = 4
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "shaft"
kind = "revolute"
parent = "ground"
child = "crank.root"
motion = "pi/2 + 2*pi/5*t"
[[joint]]
name = "pin"
kind = "revolute"
parent = "crank.tip"
child = "rod.root"
[[joint]]
name = "wrist"
kind = "revolute"
parent = "rod.tip"
child = "slider"
[[joint]]
name = "guide"
kind = "prismatic"
parent = "ground"
child = "slider"
axis = [1, 0, 0]
friction = { coefficient = 0.3, normal_force = 100LAW }
)" + output("slider", "slider", "position");
  scene.replace(scene.find("DURATION"), 8, fmt::format("{}", duration));
  scene.replace(scene.find("LAW"), 3, law);
  return scene;
}

TEST(Friction, DlrSliderCrankSticksOnTime) {
  const Results r = run(dlr_slider_crank(10), 1e-6);
  const std::vector<double> sticks = events(r, "sticks"), slips = events(r, "slips");
  std::string seen;
  for (const std::string& note : r.statistics.notes.texts(Severity::note)) seen += note + "\n";
  // The rigorous solution sticks at 1.293112-1.296565, 3.755208-3.756341, 6.185158-6.190495, 8.807935-8.810858 s, while the rod's
  // axial force runs from bound to bound. Five and seven modes see the three longer ones and turn round at the shortest.
  const double exact_stick[] = {1.293112, 6.185158, 8.807935}, exact_slip[] = {1.296565, 6.190495, 8.810858};
  ASSERT_EQ(sticks.size(), 3u) << seen;
  ASSERT_EQ(slips.size(), 3u) << seen;
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(sticks[i], exact_stick[i], 6e-3);
    EXPECT_NEAR(slips[i], exact_slip[i], 6e-3);
  }
  ASSERT_EQ(events(r, "turns round").size(), 1u) << seen;
  EXPECT_NEAR(events(r, "turns round")[0], 3.7558, 6e-3);
  EXPECT_NEAR(column(r, "slider.x")[r.times.size() - 1], 9.55532, 2e-2);
}

// Its first sticking and slipping converge with the tolerance, and the regularised law to the exact one.
TEST(Friction, DlrEventsConverge) {
  const auto both = [](double tolerance) {
    const Results r = run(dlr_slider_crank(1.4), tolerance);
    const std::vector<double> stick = events(r, "sticks"), slip = events(r, "slips");
    EXPECT_EQ(stick.size(), 1u);
    EXPECT_EQ(slip.size(), 1u);
    return stick.size() == 1 && slip.size() == 1 ? Eigen::Vector2d(stick[0], slip[0]) : Eigen::Vector2d(0, 0);
  };
  const Eigen::Vector2d exact = both(1e-10);
  const auto error = [&](double tolerance) { return (both(tolerance) - exact).cwiseAbs().maxCoeff(); };
  double before = 1e-3;
  for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
    const double now = error(tolerance);
    EXPECT_LT(now, tolerance);
    // Down to the digits of the reference (times are told to 1e-8 s, and the last digit may be one off); what a loose run hits by luck,
    // the next need not.
    EXPECT_LT(now, std::max({0.5 * before, 0.1 * tolerance, 1.5e-8})) << tolerance;
    before = now;
  }
  // Its history while the slider slips, sticks and slips again; the slower it may creep, the nearer.
  const VecX sticking = column(run(dlr_slider_crank(1.4), 1e-9), "slider.x");
  const auto off = [&](double v) {
    return (column(run(dlr_slider_crank(1.4, fmt::format(", regularised = {}", v)), 1e-9), "slider.x") - sticking).cwiseAbs().maxCoeff();
  };
  const double fast = off(0.1), slow = off(0.01), slowest = off(0.001);
  EXPECT_LT(slow, 0.5 * fast);
  EXPECT_LT(slowest, 0.5 * slow);
}

// The example has one bending mode a body. Its slider may come to rest at the crank's dead centre, where no joint and hardly a deformation
// lets it stick: the loop stays closed all the same, and the force that holding it would take lets it go at once. Errors of loose runs are
// those of a run a hundred times tighter but for the factor by which they grow over eight turns (measured: 6 times the tolerance at most).
TEST(Friction, DlrExampleEndsAtEveryTolerance) {
  std::ifstream file(FLEXFRAME_SOURCE_DIR "/examples/dlr_slider_crank.toml");
  const std::string scene(std::istreambuf_iterator<char>(file), {});
  const std::array outputs{"slider.x", "rod_middle.y", "crank_tip.y"};
  const Results exact = run(scene, 1e-10);
  const auto error = [&](double tolerance, std::optional<Method> method) {
    const Results r = run(scene, tolerance, method);
    double worst = 0.0;
    for (const char* name : outputs) {
      const VecX& x = column(exact, name);
      worst = std::max(worst, (column(r, name) - x).cwiseAbs().maxCoeff() / (x.maxCoeff() - x.minCoeff()));
    }
    return worst;
  };
  for (const double tolerance : {1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8})
    EXPECT_LT(error(tolerance, {}), 10 * tolerance) << tolerance;
  // A run that wrongly sticks there would end in a loop that comes open.
  for (const Method method : {Method::bdf, Method::erk, Method::dirk})
    for (const double tolerance : {1e-2, 3e-3, 1e-3}) EXPECT_LT(error(tolerance, method), 0.5) << tolerance;
}

// Three newtons more a newton of friction press the rod far out of its line, beyond what a kinetic energy of second order describes: the
// run is made anew with the complete one, whether the mass matrix is lost in a step or the steps shorten before it.
TEST(Friction, PressedBeyondSecondOrder) {
  std::ifstream file(FLEXFRAME_SOURCE_DIR "/examples/dlr_slider_crank.toml");
  std::string scene(std::istreambuf_iterator<char>(file), {});
  const std::string law = "coefficient = 0.3, normal_force = 100";
  scene.replace(scene.find(law), law.size(), "coefficient = 3, normal_force = 100");
  const Results exact = run(scene, 1e-8);
  const VecX& x = column(exact, "slider.x");
  ASSERT_EQ(events(exact, "sticks").size(), 4u);
  for (const Method method : {Method::adams, Method::bdf, Method::erk, Method::dirk}) {
    const Results r = run(scene, 1e-5, method);
    ASSERT_EQ(events(r, "sticks").size(), 4u);
    EXPECT_LT((column(r, "slider.x") - x).cwiseAbs().maxCoeff(), 1e-2 * (x.maxCoeff() - x.minCoeff())) << method_name(method);
  }
}

// A puck slides on a floor in any direction: friction opposes its velocity, so that it keeps its line and stops after v / (mu g); a ball
// and a rod in a sleeve that slides and turns likewise keep the direction of what slips.
TEST(Friction, OpposesTheSlipWhateverItsDirection) {
  const double g = 9.81, mu = 0.3;
  const Results r = run(
      head(0.5, "[0, 0, -9.81]") + block(2) +
          "[[joint]]\nname = \"floor\"\nkind = \"planar\"\nparent = \"ground\"\nchild = \"block\"\ninitial = { rate = [2.4, -1.8, 0] }\n"
          "friction = { coefficient = 0.3, normal_force = \"reaction\", regularised = 1e-4 }\n" +
          output("p", "block", "position"),
      1e-9);
  for (Eigen::Index i = 0; i < r.times.size(); ++i) {
    const double t = r.times[i], s = 3 * t - 0.5 * mu * g * t * t;
    EXPECT_NEAR(column(r, "p.x")[i], 0.8 * s, 1e-6);
    EXPECT_NEAR(column(r, "p.y")[i], -0.6 * s, 1e-6);
  }
  EXPECT_LT(energy_gap(r), 1e-6);
  // J w' = -mu N r w/|w| where J is the same about all axes.
  const Results ball =
      run(head(0.5, "[0, 0, 0]") + block(2) +
              "[[joint]]\nname = \"ball\"\nkind = \"spherical\"\nparent = \"ground\"\nchild = \"block\"\ninitial = { rate = [2, 1, -2] }\n"
              "friction = { coefficient = 0.3, normal_force = 4, radius = 0.05, regularised = 1e-4 }\n" +
              output("w", "block", "angular_velocity"),
          1e-9);
  const Vec3 w = positions(ball, "w").bottomRows(1).transpose();
  EXPECT_LT((w - Vec3(2, 1, -2) / 3 * (3 - 0.5 * 0.3 * 4 * 0.05 / 0.1)).norm(), 1e-6);
  // Where m r^2 = J the slip of a sleeve keeps its direction too.
  const double radius = std::sqrt(0.1 / 2);
  const Results sleeve = run(head(0.5, "[0, 0, 0]") + block(2) +
                                 fmt::format("[[joint]]\nname = \"sleeve\"\nkind = \"cylindrical\"\nparent = \"ground\"\nchild = "
                                             "\"block\"\ninitial = {{ rate = [1.2, {:.17g}] }}\n"
                                             "friction = {{ coefficient = 0.3, normal_force = 4, radius = {:.17g}, regularised = 1e-4 }}\n",
                                             1.6 / radius, radius) +
                                 output("v", "sleeve", "rate"),
                             1e-9);
  EXPECT_NEAR(last(sleeve, "v.1"), 0.6 * (2 - 0.5 * 0.3 * 4 / 2), 1e-6);
  EXPECT_NEAR(last(sleeve, "v.2") * radius, 0.8 * (2 - 0.5 * 0.3 * 4 / 2), 1e-6);
}

// A block that turns round on a plate drags it the other way from then on: the plate, held until then, is let go at that very time.
TEST(Friction, TurningRoundLetsGoWhatItStandsOn) {
  const auto body = [](const char* name, const char* on, const char* more) {
    return fmt::format(
        "[[body]]\nname = \"{0}\"\nkind = \"rigid\"\nmass = 1\n[[joint]]\nname = \"on_{1}\"\nkind = \"prismatic\"\nparent = \"{1}\"\nchild "
        "= "
        "\"{0}\"\naxis = [1, 0, 0]\n{2}\n",
        name, on, more);
  };
  const Results r = run(head(1, "[0, 0, 0]") + body("plate", "ground", "friction = { coefficient = 0.3, normal_force = 10 }") +
                            body("load", "plate", "initial = { rate = 1 }\nfriction = { coefficient = 0.2, normal_force = 10 }") +
                            push("plate", "[1, 0, 0]", -2) + push("load", "[1, 0, 0]", -5) + output("plate", "plate", "position") +
                            output("load", "load", "position") + output("held", "on_ground", "friction_force"),
                        1e-8);
  // Until 1/7 s the load's 2 N cancel the plate's own; from then on they add up to 4 N against 3 N.
  const double turn = 1.0 / 7.0;
  ASSERT_EQ(events(r, "turns round").size(), 1u);
  EXPECT_NEAR(events(r, "turns round")[0], turn, 1e-8);
  for (Eigen::Index i = 0; i < r.times.size(); ++i) {
    const double t = r.times[i], after = std::max(0.0, t - turn), before = std::min(t, turn);
    EXPECT_NEAR(column(r, "plate.x")[i], -0.5 * after * after, 1e-7);
    EXPECT_NEAR(column(r, "load.x")[i], before - 3.5 * before * before - 1.5 * after * after, 1e-7);
    EXPECT_NEAR(column(r, "held")[i], t > turn ? 3.0 : 0.0, 1e-7);
  }
  EXPECT_LT(energy_gap(r), 1e-6);
}

// Pushed beside its centre of mass, a puck at rest would need more than its friction to be kept from turning as long as it stood; once it
// slides, its own inertia keeps it. m = 2 kg, 3 N of friction, centre of mass 0.1 m and push of 6 N 1/15 m beside the middle.
TEST(Friction, SlidesFromRestWithoutTurning) {
  const Results r =
      run(head(1, "[0, 0, 0]") +
              "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\ncentre_of_mass = [0.1, 0, 0]\n"
              "frames = { side = [0.06666666666666667, 0, 0] }\n[[joint]]\nname = \"floor\"\nkind = \"planar\"\nparent = "
              "\"ground\"\nchild = \"block\"\nfriction = { coefficient = 0.3, normal_force = 10, radius = 0.05 }\n" +
              push("block.side", "[0, 1, 0]", 6) + output("p", "floor", "value") + output("f", "floor", "friction_force"),
          1e-8);
  for (Eigen::Index i = 1; i < r.times.size(); ++i) {
    EXPECT_NEAR(column(r, "p.2")[i], 0.75 * r.times[i] * r.times[i], 1e-7);
    EXPECT_EQ(column(r, "p.3")[i], 0.0);
    EXPECT_NEAR(column(r, "f.3")[i], -0.1, 1e-7);
  }
}

// The same, exact: it stops on time and stays; its spin has a law of its own.
TEST(Friction, PuckStopsWhereItsSpeedIsSpent) {
  const double g = 9.81, mu = 0.3, stop = 3 / (mu * g);
  for (const char* normal : {"\"reaction\"", "19.62"}) {
    const Results r = run(head(2, "[0, 0, -9.81]") + block(2) +
                              "[[joint]]\nname = \"floor\"\nkind = \"planar\"\nparent = \"ground\"\nchild = \"block\"\nrotation = [0, 0, "
                              "0.4]\ninitial = { rate = [2.4, -1.8, 2] }\n" +
                              fmt::format("friction = {{ coefficient = 0.3, normal_force = {}, radius = 0.05 }}\n", normal) +
                              output("p", "floor", "value"),
                          1e-8);
    const std::vector<double> sticks = events(r, "sticks");
    ASSERT_EQ(sticks.size(), 2u) << normal;
    // Spin: J w = mu N r t.
    EXPECT_NEAR(sticks[0], 0.1 * 2 / (mu * 2 * g * 0.05), 1e-7);
    EXPECT_NEAR(sticks[1], stop, 1e-8);
    for (Eigen::Index i = 0; i < r.times.size(); ++i) {
      const double t = std::min(r.times[i], stop), s = 3 * t - 0.5 * mu * g * t * t;
      EXPECT_NEAR(column(r, "p.1")[i], 0.8 * s, 1e-7);
      EXPECT_NEAR(column(r, "p.2")[i], -0.6 * s, 1e-7);
    }
    EXPECT_NEAR(r.dissipated[r.times.size() - 1], 0.5 * 2 * 9 + 0.5 * 0.1 * 4, 1e-6);
    EXPECT_LT(energy_gap(r), 1e-6);
  }
}

// On a slope across which it is pushed a puck turns downhill and, the slope being flatter than friction, comes to rest. With the angle d
// between velocity and downhill v' = g (sin a cos d - mu cos a), v d' = -g sin a sin d: v = v0 tan(d/2)^k / sin d, k = mu / tan a.
TEST(Friction, PuckTurnsDownhill) {
  const double slope = 0.2, mu = 0.35, g = 9.81, v0 = 2, k = mu / std::tan(slope);
  // Time and path by quadrature over d, from pi/2 down.
  const auto speed = [&](double d) { return v0 * std::pow(std::tan(0.5 * d), k) / std::sin(d); };
  double time = 0, down = 0, across = 0;
  const int n = 200000;
  for (int i = 0; i < n; ++i) {
    // d = pi/2 u^8: smooth where it comes to rest.
    const double u = (i + 0.5) / n, d = 0.5 * pi * std::pow(u, 8),
                 dt = speed(d) / (g * std::sin(slope) * std::sin(d)) * (4 * pi * std::pow(u, 7) / n);
    time += dt;
    down += speed(d) * std::cos(d) * dt;
    across += speed(d) * std::sin(d) * dt;
  }
  double before = 1;
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    const Results r = run(head(3, fmt::format("[{:.17g}, 0, {:.17g}]", g * std::sin(slope), -g * std::cos(slope))) + block(2) +
                              "[[joint]]\nname = \"floor\"\nkind = \"planar\"\nparent = \"ground\"\nchild = \"block\"\ninitial = { rate = "
                              "[0, 2, 0] }\nfriction = { coefficient = 0.35, normal_force = \"reaction\" }\n" +
                              output("p", "floor", "value"),
                          tolerance);
    const std::vector<double> sticks = events(r, "sticks");
    ASSERT_EQ(sticks.size(), 1u) << tolerance;
    const double error = std::max({std::abs(sticks[0] - time), std::abs(last(r, "p.1") - down), std::abs(last(r, "p.2") - across)});
    EXPECT_LT(error, 30 * tolerance);
    EXPECT_LT(error, before);
    before = error;
    EXPECT_LT(energy_gap(r), 100 * tolerance);
  }
}

// A block on a plate that is shaken in a circle sticks below mu g and slips above, in the direction of the force.
TEST(Friction, CirclingPlateDragsAndLetsGo) {
  const double w = 5, mu = 0.3, g = 9.81;
  for (const double radius : {0.9 * mu * g / (w * w), 1.5 * mu * g / (w * w)}) {
    // The pull grows slowly: a (t) = r w^2 t / 2 in a turning direction, as a force on the block.
    const Results r =
        run(head(2, "[0, 0, -9.81]") + block(2) +
                "[[joint]]\nname = \"floor\"\nkind = \"planar\"\nparent = \"ground\"\nchild = \"block\"\nfriction = { coefficient = 0.3, "
                "normal_force = \"reaction\" }\n" +
                fmt::format(
                    "[[force]]\nkind = \"force\"\non = \"block\"\ndirection = [1, 0, 0]\nvalue = \"{0:.17g}*t*cos(5*t)\"\n[[force]]\nkind "
                    "= \"force\"\non = \"block\"\ndirection = [0, 1, 0]\nvalue = \"{0:.17g}*t*sin(5*t)\"\n",
                    2 * radius * w * w / 2) +
                output("v", "floor", "rate"),
            1e-8);
    const std::vector<double> slips = events(r, "slips");
    if (radius < mu * g / (w * w)) {
      EXPECT_TRUE(slips.empty());
      continue;
    }
    ASSERT_GE(slips.size(), 1u);
    EXPECT_NEAR(slips[0], 2 / 1.5, 1e-7);
    // Just after, along the force.
    const Eigen::Index i = static_cast<Eigen::Index>(std::ceil(slips[0] * 100)) + 1;
    const double angle = std::atan2(column(r, "v.2")[i], column(r, "v.1")[i]);
    EXPECT_NEAR(std::remainder(angle - 5 * r.times[i], 2 * pi), 0.0, 0.1);
    EXPECT_LT(energy_gap(r), 1e-6);
  }
}

// A ball joint: free of other moments its spin keeps its direction and stops after J w / (mu N r). A pendulum on one swings out and hangs
// within the moment that friction holds; a body of three moments of inertia lets go along the direction in which it accelerates.
TEST(Friction, BallJointSticksAndLetsGo) {
  const Results spin =
      run(head(2, "[0, 0, 0]") + block(2) +
              "[[joint]]\nname = \"ball\"\nkind = \"spherical\"\nparent = \"ground\"\nchild = \"block\"\ninitial = { rate = [2, 1, -2] }\n"
              "friction = { coefficient = 0.3, normal_force = 4, radius = 0.2 }\n",
          1e-8);
  ASSERT_EQ(events(spin, "sticks").size(), 1u);
  EXPECT_NEAR(events(spin, "sticks")[0], 0.1 * 3 / (0.3 * 4 * 0.2), 1e-7);
  EXPECT_LT(energy_gap(spin), 1e-7);

  const std::string bob =
      "[[body]]\nname = \"bob\"\nkind = \"rigid\"\nmass = 2\ninertia = [0.01, 0.02, 0.03]\ncentre_of_mass = [0, 0, -0.5]\n";
  const Results swing = run(head(20, "[0, 0, -9.81]", 20) + bob +
                                "[[joint]]\nname = \"ball\"\nkind = \"spherical\"\nparent = \"ground\"\nchild = \"bob\"\ninitial = { value "
                                "= [0.8, 0, 0], rate = [0, 1, 0.5] }\n"
                                "friction = { coefficient = 0.3, normal_force = \"reaction\", radius = 0.05 }\n[[output]]\nname = "
                                "\"p\"\nof = \"ball\"\nquantity = \"value\"\n" +
                                output("w", "bob", "angular_velocity"),
                            1e-8);
  ASSERT_GE(events(swing, "sticks").size(), 1u);
  EXPECT_EQ(positions(swing, "w").bottomRows(1).norm(), 0.0);
  // m g l sin(angle) <= mu m g r.
  const auto& o = swing.bodies[0].orientation.bottomRows<1>();
  const Vec3 down = Quat(o(0), o(1), o(2), o(3)).toRotationMatrix() * Vec3(0, 0, -0.5);
  EXPECT_LE(std::hypot(down.x(), down.y()), 0.3 * 0.05 + 1e-9);
  EXPECT_LT(energy_gap(swing), 1e-5);

  // From rest under a moment: M = J a + mu N r a/|a|.
  const Results go =
      run(head(0.01, "[0, 0, 0]", 1e4) + bob +
              "[[joint]]\nname = \"ball\"\nkind = \"spherical\"\nparent = \"ground\"\nchild = \"bob\"\nposition = [0, 0, 0]\n"
              "friction = { coefficient = 0.5, static_coefficient = 0.6, normal_force = 10, radius = 0.1 }\n[[force]]\nkind = "
              "\"torque\"\non = \"bob\"\ndirection = [1, 1, 2]\nvalue = 1.2\n" +
              output("w", "bob", "angular_velocity"),
          1e-9);
  const Vec3 a = positions(go, "w").row(1).transpose() / go.times[1], J(0.01 + 0.5, 0.02 + 0.5, 0.03);
  EXPECT_LT((J.cwiseProduct(a) + 0.5 * 10 * 0.1 * a.normalized() - 1.2 * Vec3(1, 1, 2).normalized()).norm(), 2e-3);
}

// A rod in a sleeve slips in distance and angle together: a spin lets a weight slide that would not move by itself.
TEST(Friction, SpinningSleeveLetsItsLoadSlide) {
  const auto sleeve = [](const char* spin) {
    return run(head(1, "[5, 0, 0]") + block(2) +
                   fmt::format("[[joint]]\nname = \"sleeve\"\nkind = \"cylindrical\"\nparent = \"ground\"\nchild = \"block\"\naxis = [1, "
                               "0, 0]\ninitial = {{ rate = [0, {}] }}\n"
                               "friction = {{ coefficient = 0.5, normal_force = 30, radius = 0.1 }}\n",
                               spin) +
                   output("v", "sleeve", "rate") + output("x", "sleeve", "value"),
               1e-8);
  };
  EXPECT_EQ(last(sleeve("0"), "x.1"), 0.0);
  const Results r = sleeve("200");
  // While it spins the drag along is mu N v / s: v follows it until both are gone; then it sticks.
  EXPECT_GT(last(r, "x.1"), 0.01);
  EXPECT_LT(energy_gap(r), 1e-4);
  // A velocity of its own in every direction: a free body in a medium that takes a constant force.
  const Results medium = run(head(2, "[0, 0, 0]") + block(2) +
                                 "[[joint]]\nname = \"medium\"\nkind = \"free\"\nparent = \"ground\"\nchild = \"block\"\ninitial = { rate "
                                 "= [1, 2, 2, 0, 0, 0.3] }\n"
                                 "friction = { coefficient = 1, normal_force = 4, radius = 0.05 }\n" +
                                 output("p", "block", "position"),
                             1e-8);
  ASSERT_EQ(events(medium, "sticks").size(), 2u);
  EXPECT_NEAR(events(medium, "sticks")[0], 0.1 * 0.3 / (4 * 0.05), 1e-7);
  EXPECT_NEAR(events(medium, "sticks")[1], 2 * 3 / 4.0, 1e-7);
  EXPECT_LT((positions(medium, "p").bottomRows(1).transpose() - Vec3(1, 2, 2) / 3 * (9 * 2 / (2 * 4.0))).norm(), 1e-7);
}

// Crank (driven or pushed by the slider), rod and a slider whose friction is that of its reaction.
std::string rough_slider(double coefficient, const std::string& shaft, const std::string& guide, const std::string& push) {
  return head(3, "[0, 0, 0]") +
         "[[body]]\nname = \"crank\"\nkind = \"rigid\"\nmass = 1\ninertia = [0.001, 0.0833, 0.0833]\ncentre_of_mass = [0.5, 0, 0]\nframes "
         "= { tip = [1, 0, 0] }\n"
         "[[body]]\nname = \"rod\"\nkind = \"rigid\"\nmass = 1\ninertia = [0.001, 0.0833, 0.0833]\ncentre_of_mass = [0.5, 0, 0]\nframes = "
         "{ tip = [1.05, 0, 0] }\n" +
         block() + "[[joint]]\nname = \"shaft\"\nkind = \"revolute\"\nparent = \"ground\"\nchild = \"crank\"\n" + shaft +
         "[[joint]]\nname = \"pin\"\nkind = \"revolute\"\nparent = \"crank.tip\"\nchild = \"rod\"\n[[joint]]\nname = \"wrist\"\nkind = "
         "\"revolute\"\nparent = \"rod.tip\"\nchild = \"block\"\n" +
         slide(fmt::format("{}friction = {{ coefficient = {}, normal_force = \"reaction\" }}", guide, coefficient)) + push;
}

// A driven crank cannot push the slider on where the rod is steeper than the angle of friction, tan b = 1/mu: said when and where it gets
// there, at once. Below, it runs.
TEST(Friction, SelfLockingIsSaid) {
  try {
    run(rough_slider(0.6, "motion = \"2.8 - t\"\n", "", ""), 1e-6);
    FAIL();
  } catch (const SimulationError& error) {
    const std::string why = error.what();
    double t = 0.0;
    EXPECT_NE(why.find("joint 'slide' is self-locking"), std::string::npos) << why;
    ASSERT_EQ(std::sscanf(why.c_str(), "the integration stopped at t = %lf", &t), 1) << why;
    EXPECT_NEAR(t, 2.8 - (pi - std::asin(1.05 * std::sin(std::atan(1 / 0.6)))), 1e-6);
  }
  const Results r = run(rough_slider(0.3, "motion = \"2.8 - t\"\n", "", ""), 1e-6);
  EXPECT_LT(energy_gap(r), 1e-4 * r.dissipated[r.times.size() - 1]);
}

// Where two forces of friction fit the reaction that they change, the least is meant: pushed by the slider, the mechanism runs on past the
// place where the other one comes within reach (mu tan b = 1), however large the coefficient.
TEST(Friction, LeastFrictionThatFits) {
  for (const double mu : {0.6, 1.5}) {
    const Results r = run(rough_slider(mu, "", "initial = { value = 1.2 }\n",
                                       "[[force]]\nkind = \"force\"\non = \"block\"\ndirection = [-1, 0, 0]\nvalue = 50\n"),
                          1e-7);
    EXPECT_GE(events(r, "turns round").size(), 4u);
    EXPECT_LT(r.statistics.evaluations, 10000);
    EXPECT_LT(energy_gap(r), 1e-4 * r.dissipated[r.times.size() - 1]);
  }
}

// Where slip starts the direction of friction is far stiffer than a moment later: no method takes its predictor for the solution.
TEST(Friction, MethodsAgreeOnSlipFromRest) {
  const std::string scene =
      head(0.4, "[0, 0, 0]") +
      "[[body]]\nname = \"b\"\nkind = \"rigid\"\nmass = 0.8\ninertia = [0.01, 0.02, 0.025]\ncentre_of_mass = [0.1, -0.1, 0.2]\n"
      "[[joint]]\nname = \"ball\"\nkind = \"spherical\"\nparent = \"ground\"\nchild = \"b\"\nfriction = { coefficient = 0.3, normal_force "
      "= 2, radius = 0.1 }\n"
      "[[force]]\nkind = \"torque\"\non = \"b\"\nframe = \"body\"\ndirection = [1, 2, 1]\nvalue = \"0.08 + 2*t\"\n" +
      output("w", "b", "angular_velocity");
  const Eigen::MatrixX3d reference = positions(run(scene, 1e-10, Method::adams), "w");
  for (const Method method : {Method::bdf, Method::dirk, Method::erk})
    EXPECT_LT((positions(run(scene, 1e-7, method), "w") - reference).cwiseAbs().maxCoeff(), 1e-4) << method_name(method);
}

}  // namespace
}  // namespace flexframe::sim::test_friction
