// Static equilibrium starts: against closed forms and rigorous solutions (sim/REFERENCES.md), stability, loops, what cannot rest.
#include "mechanism_text.h"
#include "sim/dynamics/directions.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"
#include "sim/start/static_problem.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace flexframe::sim::test_statics {
namespace {

std::string head(double duration, const std::string& gravity, const std::string& more = "") {
  return fmt::format("[simulation]\nduration = {:.17g}\noutput_rate = 100\ngravity = {}\n{}\n", duration, gravity, more);
}

std::string output(const std::string& name, const std::string& of, const std::string& quantity) {
  return fmt::format("[[output]]\nname = \"{}\"\nof = \"{}\"\nquantity = \"{}\"\n", name, of, quantity);
}

std::string joint(const std::string& name, const std::string& kind, const std::string& parent, const std::string& child,
                  const std::string& more) {
  return fmt::format("[[joint]]\nname = \"{}\"\nkind = \"{}\"\nparent = \"{}\"\nchild = \"{}\"\n{}\n", name, kind, parent, child, more);
}

std::string rod(const std::string& name, double length = 1.0) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = 1\ninertia = [0.001, 0.0833333333, 0.0833333333]\ncentre_of_mass = [{}, 0, 0]\n"
      "frames = {{ tip = [{}, 0, 0] }}\n",
      name, 0.5 * length, length);
}

// A parallelogram of links 0.3 m long over 0.5 m hangs by its weight, its links turned alike, and neither by whole turns more: from 20
// degrees below the line the search turns one of them three times on its way.
TEST(Statics, LinksHangWithoutWholeTurns) {
  const auto link = [](const char* name, double mass, double length) {
    return fmt::format(
        "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = {}\ninertia = [0.01, 0.01, 0.01]\ncentre_of_mass = [{}, 0, 0]\n"
        "frames = {{ e = [{}, 0, 0] }}\n",
        name, mass, 0.5 * length, length);
  };
  const auto hinge = [](const char* name, const char* parent, const char* child, const std::string& more) {
    return fmt::format("[[joint]]\nname = \"{}\"\nkind = \"revolute\"\nparent = \"{}\"\nchild = \"{}\"\n{}\n", name, parent, child, more);
  };
  const std::string guess = "initial = { guess = \"-20 deg\" }";
  const Results r = run(head(0.001, "[0.3, -9.81, 0]", "start = \"static\"") + "[ground]\nframes = { d = [0.5, 0, 0] }\n" +
                        link("a", 1, 0.3) + link("b", 1, 0.3) + link("c", 2, 0.5) + hinge("A", "ground", "a", guess) +
                        hinge("D", "ground.d", "b", guess) + hinge("B", "a.e", "c", "initial = { guess = \"20 deg\" }") +
                        hinge("C", "c.e", "b.e", "") + output("A", "A", "value") + output("D", "D", "value"));
  const double hangs = std::atan2(-9.81, 0.3);  // where weight pulls
  EXPECT_NEAR(column(r, "A")[0], hangs, 1e-6);
  EXPECT_NEAR(column(r, "D")[0], hangs, 1e-6);
}

// k s + preload = -m g along the joint's axis: it hangs at s = -(m g + preload) / k; a spring between frames with the same numbers pulls
// with preload + k (length - rest).
TEST(Statics, PreloadShiftsTheEquilibrium) {
  const std::string weight =
      "[[body]]\nname = \"weight\"\nkind = \"rigid\"\nmass = 2\ninertia = [1, 1, 1]\nframes = { hook = [0, -1, 0] }\n";
  const auto rest = [&](const std::string& spring, const std::string& force) {
    return column(
        run(head(0.1, "[0, -9.81, 0]", "start = \"static\"") + weight +
            joint("guide", "prismatic", "ground", "weight", "axis = [0, 1, 0]\n" + spring) + force + output("s", "guide", "value")),
        "s")[0];
  };
  EXPECT_NEAR(rest("spring = { stiffness = 100.0, preload = 5.0 }", ""), -(2.0 * 9.81 + 5.0) / 100.0, 1e-9);
  const double s = rest(
      "", "[[force]]\nkind = \"spring-damper\"\non = \"weight.hook\"\nfrom = \"ground\"\nstiffness = 100.0\nrest = 0.0\npreload = 5.0\n");
  EXPECT_NEAR(100.0 * (1.0 - s) + 5.0, 2.0 * 9.81, 1e-7);
}

// Linear theory bends a cantilever by P L^3 / 3 EI; at P L^2/EI = 1 the elastica's deflection is 0.30172 L, at 0.5 it is 0.16208 L
// (Bisshopp and Drucker). Where a linear body is off by more than 1 % the run says so, and by how much.
TEST(Statics, BendingBeyondLinearTheoryIsSaid) {
  const double stiffness = 6.9e10 * 0.05 * 0.02 * 0.02 * 0.02 / 12.0;
  const auto cantilever = [&](double load, const std::string& model) {
    return run(
        head(0.01, "[0, 0, 0]") +
        "[[body]]\nname = \"beam\"\nkind = \"beam\"\nlength = 0.5\nsection = { shape = \"rectangle\", width = 0.05, height = 0.02 }\n"
        "material = { density = 2700.0, youngs_modulus = 6.9e10 }\ninitial = { static = true }\n" +
        model + "\n" + joint("clamp", "weld", "ground", "beam.root", "") +
        fmt::format("[[force]]\nkind = \"force\"\non = \"beam.tip\"\ndirection = [0, -1, 0]\nvalue = {}\n", load * stiffness / 0.25) +
        output("tip", "beam.tip", "position"));
  };
  const std::string modal = "model = \"modal\"\nmodes = { bending_xy = [1, 2, 3] }\neffects = [\"bending_xy\"]";
  const std::string elements = "elements = 10\neffects = [\"bending_xy\"]",
                    second_order = "elements = 10\neffects = [\"bending_xy\", \"stiffening\"]";
  for (const std::string& model : {elements, second_order})
    EXPECT_TRUE(cantilever(0.5, model).statistics.notes.texts(Severity::warning).empty()) << model;
  for (const auto& [load, exact, model] :
       {std::tuple{0.5, 0.16208, modal}, std::tuple{1.0, 0.30172, modal}, std::tuple{1.0, 0.30172, elements}}) {
    const Results r = cantilever(load, model);
    ASSERT_EQ(r.statistics.notes.texts(Severity::warning).size(), 1u) << model;
    const std::string said = r.statistics.notes.texts(Severity::warning)[0];
    const size_t at = said.find("wrong by about ");
    ASSERT_NE(at, std::string::npos) << said;
    const double error = 100.0 * (-column(r, "tip.y")[0] / 0.5 / exact - 1.0);
    EXPECT_NEAR(std::stod(said.substr(at + 15)), error, 0.25 * error) << said;
  }
  // Left to the program, large bending is followed in the same forms.
  for (const auto& [load, exact] : {std::pair{0.5, 0.16208}, std::pair{1.0, 0.30172}}) {
    const Results r = cantilever(load, "model = \"modal\"\nmodes = { bending_xy = [1, 2, 3] }");
    EXPECT_TRUE(r.statistics.notes.texts(Severity::warning).empty()) << load;
    EXPECT_NEAR(-column(r, "tip.y")[0] / 0.5 / exact, 1.0, 0.01) << load;
  }
}

// Euler-Bernoulli: 0.5 x 0.05 x 0.02 m, 196.2 N at the tip bends it by P L^3 / 3 EI = 3.55435 mm; it stays there.
TEST(Statics, CantileverBendsByTheTextbook) {
  const Results r = run(
      head(0.05, "[0, 0, 0]") +
      "[[body]]\nname = \"beam\"\nkind = \"beam\"\nlength = 0.5\nsection = { shape = \"rectangle\", width = 0.05, height = 0.02 }\n"
      "material = { density = 2700.0, youngs_modulus = 6.9e10 }\nelements = 4\neffects = [\"bending_xy\"]\ninitial = { static = true }\n" +
      joint("clamp", "weld", "ground", "beam.root", "") +
      "[[force]]\nkind = \"force\"\non = \"beam.tip\"\ndirection = [0, -1, 0]\nvalue = 196.2\n" + output("tip", "beam.tip", "position"));
  const VecX& y = column(r, "tip.y");
  const double exact = 196.2 * 0.125 / (3.0 * 6.9e10 * 0.05 * 0.02 * 0.02 * 0.02 / 12.0);
  EXPECT_NEAR(exact, 3.55435e-3, 1e-8);
  // (w/L)^2 of it is geometry.
  EXPECT_NEAR(y[0], -exact, 1e-4 * exact);
  EXPECT_LT((y.array() - y[0]).abs().maxCoeff(), 1e-8 * exact);
}

// Heckmann et al. 2006 section 6.3 at rest, rigorous solution (sim/REFERENCES.md): the flap stop and the blade's weight.
TEST(Statics, HelicopterBladeHangsOnItsStop) {
  const Results r = run(head(0.2, "[0, 0, -9.81]") + R"(
[[body]]
name = "hub"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[body]]
name = "blade"
kind = "beam"
length = 6
section = { shape = "general", area = 1.8148e-3, iy = 9.40262875e-7, iz = 9.166094107e-5, j = 1e-6 }
material = { density = 3857.174, youngs_modulus = 1e11 }
elements = 6
boundary = "supported-free"
effects = ["bending_xz", "stiffening"]
initial = { static = true }
)" + joint("rotor", "revolute", "ground", "hub", "motion = 0") +
                        joint("flap", "revolute", "hub", "blade.root",
                              "axis = [0, -1, 0]\nposition = [0.3, 0, 0]\nstop = { lower = -0.008726646, stiffness = 5e4 }") +
                        output("flap", "flap", "value") + output("tip", "blade.tip", "position"));
  EXPECT_NEAR(column(r, "flap")[0], -0.033417, 2e-5);
  EXPECT_NEAR(column(r, "tip.z")[0], -0.318486, 1e-3);
  const VecX& tip = column(r, "tip.z");
  EXPECT_LT((tip.array() - tip[0]).abs().maxCoeff(), 1e-6);
}

// Two rods under their weight and a horizontal force F at the end: tan a2 = F / (W/2), tan a1 = F / (3 W/2).
TEST(Statics, ChainHangsAlongItsForces) {
  const Results r = run(head(0.01, "[0, -9.81, 0]", "start = \"static\"") + rod("upper") + rod("lower") +
                        joint("one", "revolute", "ground", "upper", "axis = [0, 0, 1]") +
                        joint("two", "revolute", "upper.tip", "lower", "axis = [0, 0, 1]") +
                        "[[force]]\nkind = \"force\"\non = \"lower.tip\"\ndirection = [1, 0, 0]\nvalue = 7\n" +
                        output("a", "one", "value") + output("b", "two", "value"));
  const double a = std::atan2(7.0, 1.5 * 9.81) - pi / 2, b = std::atan2(7.0, 0.5 * 9.81) - pi / 2;
  EXPECT_NEAR(column(r, "a")[0], a, 1e-10);
  EXPECT_NEAR(column(r, "b")[0], b - a, 1e-10);
}

// What `initial` gives is held, the rest finds its equilibrium: the lower rod hangs straight down from the upper one.
TEST(Statics, GivenCoordinatesAreHeld) {
  const System s = make_system(parse_scene(head(1, "[0, -9.81, 0]", "start = \"static\"") + rod("upper") + rod("lower") +
                                               joint("one", "revolute", "ground", "upper", "axis = [0, 0, 1]\ninitial = { value = -0.4 }") +
                                               joint("two", "revolute", "upper.tip", "lower", "axis = [0, 0, 1]"),
                                           "held.toml"));
  EXPECT_EQ(s.work.q[0], -0.4);
  EXPECT_NEAR(s.work.q[1], 0.4 - pi / 2, 1e-10);
}

// A loop: a four-bar of three rods hangs symmetrically (its lowest point), whichever side it starts on.
TEST(Statics, FourBarHangsSymmetrically) {
  const Results r = run(
      head(0.01, "[0, -9.81, 0]", "start = \"static\"") + rod("a") + rod("b", 1.2) + rod("c") +
      joint("ja", "revolute", "ground", "a", "axis = [0, 0, 1]") + joint("jb", "revolute", "a.tip", "b", "axis = [0, 0, 1]") +
      joint("jc", "revolute", "ground", "c", "axis = [0, 0, 1]\nposition = [2, 0, 0]") +
      joint("jd", "revolute", "b.tip", "c.tip", "axis = [0, 0, 1]") + output("p", "a.tip", "position") + output("q", "c.tip", "position"));
  EXPECT_NEAR(column(r, "p.x")[0] - 0.0, 2.0 - column(r, "q.x")[0], 1e-9);
  EXPECT_NEAR(column(r, "p.y")[0], column(r, "q.y")[0], 1e-9);
  EXPECT_LT(column(r, "p.y")[0], 0.0);
}

// Small vibrations about the equilibrium that a static start finds: sqrt(3 g / 2 L) of a hanging rod, from wherever it starts.
TEST(Statics, LinearisationIsAboutTheEquilibrium) {
  const System s = make_system(parse_scene(
      head(1, "[0, -9.81, 0]", "start = \"static\"") + rod("r") + joint("j", "revolute", "ground", "r", "axis = [0, 0, 1]"), "rod.toml"));
  const Linearisation linear = linearise(s);
  EXPECT_TRUE(linear.equilibrium);
  ASSERT_EQ(linear.modes.size(), 1u);
  const double inertia = 0.0833333333 + 0.25;
  EXPECT_NEAR(linear.modes[0].frequency, std::sqrt(9.81 * 0.5 / inertia) / (2 * pi), 1e-8);
}

// A column beyond its buckling load stays straight, and the notes say that it will not for long.
TEST(Statics, UnstableEquilibriumIsNamed) {
  const System s =
      make_system(parse_scene(head(1, "[0, -9.81, 0]", "start = \"static\"") + rod("r") +
                                  joint("j", "revolute", "ground", "r", "axis = [0, 0, 1]\nrotation = [0, 0, 1.5707963267948966]"),
                              "up.toml"));
  bool said = false;
  for (const std::string& note : s.notes.texts(Severity::warning)) said = said || note.find("it is unstable") != std::string::npos;
  // From exactly upright the residual is rounding only: it must be told, not solved away.
  EXPECT_TRUE(said);
}

TEST(Statics, WhatFallsFreelyHasNoEquilibrium) {
  try {
    make_system(parse_scene(head(1, "[0, -9.81, 0]", "start = \"static\"") + rod("r"), "fall.toml"));
    FAIL() << "a free body found rest";
  } catch (const InputError& error) {
    const std::string what = error.what();
    for (const char* word : {"fall.toml", "static equilibrium", "r (free)", "initial"})
      EXPECT_NE(what.find(word), std::string::npos) << what;
  }
}

// Elastica (Mattiasson 1981), P L^2 / EI = 2 and 10: mixed beam of ten volumes, dead load across.
TEST(Statics, ElasticaOfAMixedBeam) {
  for (const auto& [load, w, u] : {std::tuple{2.0, 0.4934574804, 0.1606417208}, std::tuple{10.0, 0.8106090249, 0.5549955978}}) {
    const System s = make_system(
        parse_scene(head(1, "[0, 0, 0]") +
                        "[[body]]\nname = \"beam\"\nkind = \"beam\"\nlength = 1\nsection = { shape = \"general\", area = 1e-3, iy = 1e-8, "
                        "iz = 1e-8, j = 2e-8 }\n"
                        "material = { density = 1000.0, youngs_modulus = 1e8 }\nmodel = \"mixed\"\nvolumes = 10\nelements = 1\neffects = "
                        "[\"bending_xy\", \"stiffening\"]\n"
                        "initial = { static = true }\n" +
                        joint("clamp", "weld", "ground", "beam.root", "") +
                        fmt::format("[[force]]\nkind = \"force\"\non = \"beam.tip\"\ndirection = [0, 1, 0]\nvalue = {}\n", load) +
                        output("tip", "beam.tip", "position"),
                    "elastica.toml"));
    const Results r = run(s.scene.text);
    // EI = 1. Second-order pieces of a tenth: quartic in the piece's angle.
    EXPECT_NEAR(column(r, "tip.y")[0], w, 2e-3);
    EXPECT_NEAR(column(r, "tip.x")[0], 1.0 - u, 2e-3);
  }
}

// A lumped beam is held by the springs between its pieces: w L^4 / 8 EI.
TEST(Statics, LumpedCantileverIsHeldByItsSprings) {
  const System s = make_system(parse_scene(head(1, "[0, -9.81, 0]", "start = \"static\"") +
                                               "[[body]]\nname = \"beam\"\nkind = \"beam\"\nlength = 1\nsection = { shape = \"circle\", "
                                               "diameter = 0.05 }\nmaterial = { density = 7800.0, youngs_modulus = 2.1e11 }\n"
                                               "model = \"lumped\"\nelements = 16\n" +
                                               joint("clamp", "weld", "ground", "beam.root", "") + output("tip", "beam.tip", "position"),
                                           "lumped.toml"));
  const double exact = 7800 * 9.81 * pi * 0.05 * 0.05 / 4 / (8 * 2.1e11 * pi * std::pow(0.05, 4) / 64);
  EXPECT_NEAR(column(run(s.scene.text), "tip.y")[0], -exact, 5e-3 * exact);
}

// An eccentric disc on a turning shaft rests at e W^2 / (k/m - W^2) in it, above the critical speed too, where its energy has a saddle; a
// damper in the shaft makes that unstable, and the notes say so.
TEST(Statics, RotorAboveItsCriticalSpeed) {
  for (const auto& [speed, damping] : {std::pair{11.0, 0.0}, {30.0, 0.0}, {30.0, 3.0}}) {
    const std::string slide = fmt::format("spring = {{ stiffness = 400, damping = {} }}", damping);
    const auto body = [](const std::string& name, const std::string& more) {
      return fmt::format("[[body]]\nname = \"{}\"\nkind = \"rigid\"\n{}\n", name, more);
    };
    const System s = make_system(parse_scene(head(1, "[0, 0, 0]", "start = \"static\"") + body("hub", "mass = 1\ninertia = [1, 1, 1]") +
                                                 body("link", "mass = 0") +
                                                 body("disc", "mass = 1\ninertia = [0.1, 0.1, 0.1]\ncentre_of_mass = [0.001, 0, 0]") +
                                                 joint("spin", "revolute", "ground", "hub", fmt::format("motion = \"{}*t\"", speed)) +
                                                 joint("x", "prismatic", "hub", "link", "axis = [1, 0, 0]\n" + slide) +
                                                 joint("y", "prismatic", "link", "disc", "axis = [0, 1, 0]\n" + slide),
                                             "rotor.toml"));
    EXPECT_NEAR(s.work.q[0], 1e-3 * speed * speed / (400 - speed * speed), 1e-12);
    EXPECT_NEAR(s.work.q[1], 0.0, 1e-12);
    bool said = false;
    for (const std::string& note : s.notes.texts(Severity::warning)) said = said || note.find("it is unstable") != std::string::npos;
    EXPECT_EQ(said, damping > 0.0);
  }
}

// Weight across a turning shaft is no load that rests beside it: the state at t = 0, g / (w0^2 - speed^2) below the axis, would have to go
// round backwards. Of weight along the axis, and of an arm whose sag hardly changes within its period, nothing is said.
TEST(Statics, WeightTurnsAgainstAShaft) {
  const auto notes = [](const std::string& gravity, double speed, double stiffness) {
    const auto body = [](const std::string& name, const std::string& more) {
      return fmt::format("[[body]]\nname = \"{}\"\nkind = \"rigid\"\n{}\n", name, more);
    };
    const std::string slide = fmt::format("spring = {{ stiffness = {} }}", stiffness);
    const System s = make_system(parse_scene(head(1, gravity, "start = \"static\"") + body("hub", "mass = 1\ninertia = [1, 1, 1]") +
                                                 body("link", "mass = 0") +
                                                 body("disc", "mass = 1\ninertia = [0.1, 0.1, 0.1]\ncentre_of_mass = [0.001, 0, 0]") +
                                                 joint("spin", "revolute", "ground", "hub", fmt::format("motion = \"{}*t\"", speed)) +
                                                 joint("x", "prismatic", "hub", "link", "axis = [1, 0, 0]\n" + slide) +
                                                 joint("y", "prismatic", "link", "disc", "axis = [0, 1, 0]\n" + slide),
                                             "shaft.toml"));
    std::string said;
    for (const std::string& note : s.notes.texts(Severity::note))
      if (note.find("it holds at t = 0 only") != std::string::npos) said = note;
    return said;
  };
  // 9.81 / (400 - 121) m below the axis, times 11 1/s; the slower whirl is at 20 - 11 1/s.
  const std::string said = notes("[0, -9.81, 0]", 11, 400);
  EXPECT_NE(said.find(fmt::format("moves on by {:.3g} m/s", 9.81 / 279 * 11)), std::string::npos) << said;
  EXPECT_NE(said.find(fmt::format("vibrates by up to {:.2g} m", 9.81 / 279 * 11 / 9)), std::string::npos) << said;
  EXPECT_EQ(notes("[0, 0, -9.81]", 11, 400), "");
  EXPECT_EQ(notes("[0, -9.81, 0]", 0.5, 400), "");
}

// Two elastic bars in a flat roof, EA = 1e5 N: beyond the limit load of 4.81 N they rest on the other side, and the notes say where they
// snapped.
TEST(Statics, SnapThroughFindsTheStateBeyond) {
  const double length = std::hypot(1.0, 0.05), slope = std::atan2(0.05, 1.0);
  for (const double load : {4.0, 6.0, 20.0}) {
    std::string scene = head(1, "[0, 0, 0]", "start = \"static\"");
    for (const char* name : {"l", "r"})
      scene += fmt::format(
          "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = {:.17g}\nsection = {{ shape = \"general\", area = 1e-4, iy = 1e-9, iz = "
          "1e-9, j = 1e-9 }}\n"
          "material = {{ density = 1000.0, youngs_modulus = 1e9 }}\nelements = 1\neffects = [\"axial\"]\n",
          name, length);
    scene += joint("left", "revolute", "ground", "l.root", fmt::format("position = [-1, 0, 0]\nrotation = [0, 0, {:.17g}]", slope)) +
             joint("right", "revolute", "ground", "r.root", fmt::format("position = [1, 0, 0]\nrotation = [0, 0, {:.17g}]", pi - slope)) +
             joint("apex", "revolute", "l.tip", "r.tip", "") +
             fmt::format("[[force]]\nkind = \"force\"\non = \"l.tip\"\ndirection = [0, -1, 0]\nvalue = {}\n", load) +
             output("y", "l.tip", "position");
    const Results r = run(scene);
    const double y = column(r, "y.y")[0];
    EXPECT_NEAR(2e5 * (std::hypot(1.0, y) / length - 1) * y / std::hypot(1.0, y), -load, 1e-6);
    EXPECT_EQ(y<0, load> 4.9);
    bool said = false;
    for (const std::string& note : r.statistics.notes.texts(Severity::note)) said = said || note.find("snapped to") != std::string::npos;
    EXPECT_EQ(said, load > 4.9) << load;
  }
}

// Forces count with their values at exactly t = 0; accelerations of motions are the reason where nothing rests in them; a beam beyond its
// linear field is refused.
TEST(Statics, WhatHoldsAtTimeZero) {
  const std::string block = "[[body]]\nname = \"m\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n";
  const System s =
      make_system(parse_scene(head(1, "[0, 0, 0]", "start = \"static\"") + block +
                                  joint("x", "prismatic", "ground", "m", "axis = [1, 0, 0]\nspring = { stiffness = 100 }") +
                                  "[[force]]\nkind = \"force\"\non = \"m\"\ndirection = [1, 0, 0]\nvalue = \"t <= 0 ? 5 : 0\"\n",
                              "let_go.toml"));
  EXPECT_NEAR(s.work.q[0], 0.05, 1e-12);
  const auto refusal = [](const std::string& scene) {
    try {
      make_system(parse_scene(scene, "refused.toml"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string cart = "[[body]]\nname = \"cart\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n";
  const std::string driven = refusal(head(1, "[0, 0, 0]", "start = \"static\"") + cart + block +
                                     joint("drive", "prismatic", "ground", "cart", "axis = [1, 0, 0]\nmotion = \"3*t*t\"") +
                                     joint("slide", "prismatic", "cart", "m", "axis = [1, 0, 0]"));
  EXPECT_NE(driven.find("'drive' with 6 m/s^2"), std::string::npos) << driven;
  EXPECT_EQ(driven.find("buckles"), std::string::npos) << driven;
  const std::string bent =
      refusal(head(1, "[0, 0, 0]", "start = \"static\"") +
              "[[body]]\nname = \"strip\"\nkind = \"beam\"\nlength = 1\nsection = { shape = \"general\", area = 1e-3, iy = 1e-8, iz = "
              "1e-8, j = 2e-8 }\n"
              "material = { density = 1000.0, youngs_modulus = 1e8 }\nmodel = \"modal\"\nmodes = { bending_xy = [1, 2, 3] }\n" +
              joint("clamp", "weld", "ground", "strip.root", "") +
              "[[force]]\nkind = \"force\"\non = \"strip.tip\"\ndirection = [0, 1, 0]\nvalue = 10\n");
  EXPECT_NE(bent.find("'strip'"), std::string::npos) << bent;
  EXPECT_NE(bent.find("mixed"), std::string::npos) << bent;
}

// A tree of bodies of all kinds about a random place, whose loads keep their directions.
std::string random_tree(std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  std::uniform_int_distribution<int> pick(0, 3);
  const auto beam = [&](const std::string& name, const std::string& model) {
    return fmt::format(
        "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = {}\nsection = {{ shape = \"rectangle\", width = 0.03, height = 0.02 }}\n"
        "material = {{ density = 1200.0, youngs_modulus = 1e8 }}\nframes = {{ middle = 0.4 }}\n{}\n",
        name, 0.6 + 0.2 * number(random), model);
  };
  const std::vector<std::string> kinds{"revolute", "spherical", "universal", "prismatic"};
  const auto any_joint = [&](const std::string& name, const std::string& parent, const std::string& child) {
    const std::string& kind = kinds[static_cast<size_t>(pick(random))];
    std::string more;
    if (kind == "revolute" || kind == "prismatic") more = fmt::format("axis = [{}, 1, {}]\n", number(random), number(random));
    if (kind == "universal") more = "axis = [0, 0, 1]\n";
    return joint(name, kind, parent, child, more + (kind == "universal" ? "" : "spring = { stiffness = 30.0 }"));
  };
  std::string text = head(0.1, fmt::format("[{}, {}, {}]", 9.0 * number(random), 9.0 * number(random), 9.0 * number(random)));
  text += beam("trunk", "model = \"mixed\"\nvolumes = 3") + beam("branch", "elements = 2") +
          beam("twig", "model = \"mixed\"\nvolumes = 2") + rod("fruit", 0.3) + any_joint("a", "ground", "trunk.root") +
          joint("b", "weld", "trunk.middle", "branch.root", "") + any_joint("c", "trunk.tip", "twig.root") +
          any_joint("d", "twig.tip", "fruit");
  for (const char* on : {"branch.tip", "twig.middle", "fruit.tip"})
    text += fmt::format("[[force]]\nkind = \"force\"\non = \"{}\"\ndirection = [{}, {}, 1]\nvalue = {}\n", on, number(random),
                        number(random), 5.0 * number(random));
  return text + fmt::format("[[force]]\nkind = \"distributed\"\non = \"branch\"\ndirection = [0, {}, 1]\nvalue = 3\n", number(random));
}

// The stiffness of trees under dead loads, made of what turns their parts, against central differences of the forces along one coordinate
// after another.
TEST(Statics, StiffnessOfTreesByPartsEqualsDifferences) {
  std::mt19937 random(7);
  for (int scene = 0; scene < 12; ++scene) {
    const std::string text = random_tree(random);
    System system = make_system(parse_scene(text, "tree.toml"));
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (const Direction& d : independent_directions(system.model, system.work))
      move_along(system.model, d, (d.rate >= 0 ? 0.4 : 0.02) * number(random) / d.scale, system.work);
    StaticProblem p = static_problem(system.model, system.work);
    const size_t parts = system.model.parts.size();
    const Sought all{std::vector<char>(parts, 1), std::vector<char>(parts, 1), {}};
    p.load(1.0);
    p.find_directions(all);
    const Eigen::Index n = static_cast<Eigen::Index>(p.sought.size());
    MatX by_parts, one_by_one, central(n, n);
    ASSERT_TRUE(p.stiffness(by_parts));
    p.by_parts = false;
    ASSERT_TRUE(p.stiffness(one_by_one));
    const VecX q = p.work.q;
    for (Eigen::Index k = 0; k < n; ++k) {
      constexpr double h = 1e-6;
      VecX f[2];
      for (int side = 0; side < 2; ++side) {
        move_along(p.model, p.sought[k], (side == 0 ? h : -h) / p.sought[k].scale, p.work);
        ASSERT_TRUE(p.evaluate(nullptr, f[side]));
        p.work.q = q;
      }
      central.col(k) = (f[1] - f[0]) / (2.0 * h);
    }
    EXPECT_LT((by_parts - central).cwiseAbs().maxCoeff(), 1e-7 * central.cwiseAbs().maxCoeff()) << scene << "\n" << text;
    // One-sided differences err by more, in proportion to their step and to how sections turn in second order.
    EXPECT_LT((by_parts - one_by_one).cwiseAbs().maxCoeff(), 1e-4 * central.cwiseAbs().maxCoeff());
    // What stands between parts is far softer.
    double between = 0.0, off = 0.0;
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index k = 0; k < n; ++k) {
        if (p.sought[i].part == p.sought[k].part) continue;
        between = std::max(between, std::abs(central(i, k)));
        off = std::max(off, std::abs(by_parts(i, k) - central(i, k)));
      }
    EXPECT_GT(between, 1.0);
    EXPECT_LT(off, 1e-6 * between) << scene << "\n" << text;
    EXPECT_NE(by_parts, one_by_one);
  }
}

}  // namespace
// Two beams that cross, one clamped and one on a universal joint and a ball: it turns freely about its axis, where its stiffness is
// rounding of either sign. That was taken for a way over unstable states, and the loads were raised in hundreds of steps (90 CPU s).
TEST(Statics, WhatTurnsFreelyIsNoBuckling) {
  const double L = 1.0, d = 0.02, F = 50.0;
  const auto bar = [&](const std::string& name) {
    return fmt::format(
        "[[body]]\nname = \"{0}\"\nkind = \"beam\"\nlength = {1}\nsection = {{ shape = \"circle\", diameter = {2} }}\nmaterial = {{ "
        "density = "
        "7850, youngs_modulus = 2.1e11, poisson = 0.3 }}\nframes = {{ middle = 0.5 }}\n[[body]]\nname = \"{0}s\"\nkind = \"rigid\"\nmass = "
        "0.01\ninertia = [1e-6, 1e-6, 1e-6]\n",
        name, L, d);
  };
  const std::string turned = "rotation = [0, 1.5707963267948966, 0]\n";
  const System s = make_system(
      parse_scene(head(1, "[0, 0, 0]", "start = \"static\"") + bar("one") + bar("two") +
                      joint("a", "weld", "ground", "one", "position = [-0.5, 0, 0]\n") +
                      joint("p", "prismatic", "ground", "ones", "position = [0.5, 0, 0]\naxis = [1, 0, 0]\n") +
                      joint("b", "weld", "ones", "one.tip", "") +
                      joint("twoa", "universal", "ground", "two", "position = [0, 0, 0.5]\naxis = [0, 0, 1]\n" + turned) +
                      joint("twop", "prismatic", "ground", "twos", "position = [0, 0, -0.5]\naxis = [1, 0, 0]\n" + turned) +
                      joint("twob", "spherical", "twos", "two.tip", "") + joint("cross", "spherical", "one.middle", "two.middle", "") +
                      fmt::format("[[force]]\nkind = \"force\"\non = \"one.middle\"\ndirection = [0, -1, 0]\nvalue = {}\n", F) +
                      output("middle", "one.middle", "position"),
                  "crossed.toml"));
  int steps = 1000;
  for (const std::string& note : s.notes.texts(Severity::note))
    if (std::sscanf(note.c_str(), "static equilibrium: %d Newton steps", &steps) == 1) {
      EXPECT_EQ(note.find("load steps"), std::string::npos);
    }
  EXPECT_LE(steps, 20);
}
}  // namespace flexframe::sim::test_statics
