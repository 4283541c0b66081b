// The engine through whole scenes: checkpoints of rigorous solutions (sim/REFERENCES.md), conserved quantities, loops, starts that cannot
// be closed.
#include "mechanism_text.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_engine {
namespace {

double at(const Results& r, const std::string& name, double t) {
  Eigen::Index row = 0;
  (r.times.array() - t).abs().minCoeff(&row);
  EXPECT_NEAR(r.times[row], t, 1e-9);
  return column(r, name)[row];
}

std::string output(const std::string& name, const std::string& of, const std::string& quantity) {
  return fmt::format("[[output]]\nname = \"{}\"\nof = \"{}\"\nquantity = \"{}\"\n", name, of, quantity);
}

std::string simulation(double duration, const std::string& gravity, double rate = 1000.0) {
  return fmt::format("[simulation]\nduration = {:.17g}\noutput_rate = {}\ngravity = {}\n", duration, rate, gravity);
}

// A rod of length 1 m and mass 1 kg, thin, its body frame at one end.
std::string rod(const std::string& name) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = 1\ninertia = [0.001, 0.083333333333333333, 0.083333333333333333]\n"
      "centre_of_mass = [0.5, 0, 0]\nframes = {{ tip = [1, 0, 0] }}\n",
      name);
}

std::string joint(const std::string& name, const std::string& kind, const std::string& parent, const std::string& child,
                  const std::string& more) {
  return fmt::format("[[joint]]\nname = \"{}\"\nkind = \"{}\"\nparent = \"{}\"\nchild = \"{}\"\n{}\n", name, kind, parent, child, more);
}

const char* pendulum = R"([[body]]
name = "rod"
kind = "beam"
length = 0.4
section = { shape = "general", area = 18e-4, iy = 1.215e-8, iz = 1.215e-8, j = 2.43e-8 }
material = { density = 5540.0, youngs_modulus = 1e9 }
elements = 10
)";

std::string pendulum_scene(const std::string& down, const std::string& axis, const std::string& rotation) {
  return simulation(1.2, down) + pendulum +
         joint("pivot", "revolute", "ground", "rod.root", fmt::format("axis = {}\nrotation = {}", axis, rotation)) +
         output("tip", "rod.tip", "position") + output("bend", "rod.tip", "displacement") + output("energy", "system", "energy");
}

// Schiavo et al. 2005 section 5.2 against the rigorous solution.
TEST(Engine, PendulumFollowsTheRigorousSolution) {
  const Results r = run(pendulum_scene("[0, -9.81, 0]", "[0, 0, 1]", "[0, 0, 0]"));
  EXPECT_NEAR(at(r, "tip.x", 0.3), 0.01919, 3e-4);
  EXPECT_NEAR(at(r, "tip.y", 0.3), -0.39955, 3e-4);
  EXPECT_NEAR(at(r, "tip.x", 0.6), -0.40000, 3e-4);
  EXPECT_NEAR(at(r, "tip.y", 0.6), -0.00052, 3e-4);
  EXPECT_NEAR(at(r, "tip.x", 1.0), 0.25211, 3e-4);
  EXPECT_NEAR(at(r, "tip.y", 1.0), -0.31056, 3e-4);
  EXPECT_NEAR(std::abs(at(r, "bend.y", 0.1)), 3.485e-3, 3e-4);
  EXPECT_NEAR(std::abs(at(r, "bend.y", 0.2)), 3.665e-3, 3e-4);
  EXPECT_NEAR(std::abs(at(r, "bend.y", 0.9)), 1.803e-3, 3e-4);
  EXPECT_NEAR(std::abs(at(r, "bend.y", 1.2)), 4.629e-3, 3e-4);
  // m g L = 1.56 J swings to and fro; the L-stable integrator damps the vibrations that the tolerance does not resolve.
  EXPECT_LT(column(r, "energy").cwiseAbs().maxCoeff(), 5e-3);
}

// The same pendulum in the xz plane of a turned world bends in its other direction.
TEST(Engine, PendulumBendsAlikeInItsOtherPlane) {
  const Results a = run(pendulum_scene("[0, -9.81, 0]", "[0, 0, 1]", "[0, 0, 0]"));
  const Results b = run(pendulum_scene("[0, 0, -9.81]", "[0, -1, 0]", "[0, 0, 0]"));
  for (double t : {0.3, 0.6, 1.0}) {
    EXPECT_NEAR(at(a, "tip.x", t), at(b, "tip.x", t), 1e-4);
    EXPECT_NEAR(at(a, "tip.y", t), at(b, "tip.z", t), 1e-4);
  }
}

// Schiavo et al. 2005 section 5.3.
std::string slider_crank() {
  const char* beam = R"([[body]]
name = "{}"
kind = "beam"
length = {}
section = {{ shape = "general", area = 0.7854e-4, iy = 4.909e-10, iz = 4.909e-10, j = 9.818e-10 }}
material = {{ density = 2770.0, youngs_modulus = {} }}
elements = {}
{}
)";
  const std::string z = "axis = [0, 0, 1]";
  return simulation(1.6, "[0, 0, 0]") + fmt::format(fmt::runtime(beam), "crank", 0.152, "1e9", 3, "") +
         fmt::format(fmt::runtime(beam), "rod", 0.304, "5e7", 8, "boundary = \"supported-supported\"\nframes = { middle = 0.5 }") +
         "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 0\ninertia = [0, 0, 0]\n" +
         joint("shaft", "revolute", "ground", "crank.root", z) + joint("pin", "revolute", "crank.tip", "rod.root", z) +
         joint("wrist", "revolute", "rod.tip", "block", z) + joint("rail", "prismatic", "ground", "block", "axis = [1, 0, 0]") +
         "[[force]]\nkind = \"torque\"\non = \"crank.root\"\ndirection = [0, 0, 1]\nvalue = \"t <= 0.7 ? 0.01*(1 - exp(-t/0.167)) : 0\"\n" +
         output("slider", "block", "position") + output("middle", "rod.middle", "displacement") + output("energy", "system", "energy");
}

TEST(Engine, SliderCrankFollowsTheRigorousSolution) {
  const Results r = run(slider_crank());
  EXPECT_NEAR(at(r, "slider.x", 0.4), 0.4327325, 1e-4);
  EXPECT_NEAR(at(r, "slider.x", 0.7), 0.2974842, 1e-4);
  EXPECT_NEAR(at(r, "slider.x", 1.0), 0.1619844, 1e-4);
  EXPECT_NEAR(at(r, "slider.x", 1.2), 0.1655611, 1e-4);
  EXPECT_NEAR(at(r, "slider.x", 1.6), 0.3673853, 1e-4);
  EXPECT_NEAR(at(r, "middle.y", 0.7), 1.055e-3, 5e-5);
  EXPECT_NEAR(at(r, "middle.y", 1.2), -1.135e-3, 5e-5);
  // Closed at every sample, and no energy made once the torque has ended.
  EXPECT_LT(column(r, "slider.y").cwiseAbs().maxCoeff(), 1e-10 * 0.456);
  EXPECT_NEAR(at(r, "energy", 1.6), at(r, "energy", 0.8), 1e-3 * at(r, "energy", 0.8));
  EXPECT_EQ(r.statistics.events, 1);
}

// What the forces supplied is what the mechanism holds.
TEST(Engine, SuppliedWorkIsTheEnergy) {
  const Results r = run(slider_crank());
  const Eigen::Index last = r.times.size() - 1;
  const double energy = r.kinetic[last] + r.strain[last] + r.potential[last] - r.kinetic[0] - r.strain[0] - r.potential[0];
  EXPECT_NEAR(r.supplied[last] - r.dissipated[last], energy, 1e-3 * energy);
}

TEST(Engine, RigidPendulumHasItsPeriod) {
  const Results r =
      run(simulation(1.9333348544, "[0, -9.81, 0]", 100) + rod("rod") + joint("pivot", "revolute", "ground", "rod", "axis = [0, 0, 1]") +
              output("angle", "pivot", "value") + output("energy", "system", "energy"),
          1e-10);
  EXPECT_NEAR(column(r, "angle")[r.times.size() - 1], 0.0, 1e-7);
  EXPECT_LT(column(r, "energy").cwiseAbs().maxCoeff(), 1e-8);
}

// Euler's equations of a free body about its middle axis, by elliptic functions.
TEST(Engine, TumblingBodyFlipsOnTime) {
  const Results r = run(simulation(60, "[0, 0, 0]", 100) + "[[body]]\nname = \"top\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 2, 3]\n" +
                            joint("free", "free", "ground", "top", "initial = { rate = [0, 0, 0, 0.01, 1, 0.01] }") +
                            output("w", "top", "angular_velocity") + output("e", "system", "energy"),
                        1e-10);
  // In body axes omega_2 changes sign at 10.91692 s; in the world the momentum stays, so look at the orientation's y axis.
  const ResultBody& body = r.bodies[0];
  double crossing = 0.0;
  for (Eigen::Index i = 1; i < r.times.size() && crossing == 0.0; ++i) {
    const auto omega2 = [&](Eigen::Index k) {
      const Quat q(body.orientation(k, 0), body.orientation(k, 1), body.orientation(k, 2), body.orientation(k, 3));
      return (q.conjugate() * Vec3(column(r, "w.x")[k], column(r, "w.y")[k], column(r, "w.z")[k])).y();
    };
    const double a = omega2(i - 1), b = omega2(i);
    if (a > 0.0 && b <= 0.0) crossing = r.times[i - 1] + (r.times[i] - r.times[i - 1]) * a / (a - b);
  }
  EXPECT_NEAR(crossing, 10.91692, 1e-4);
  EXPECT_NEAR(column(r, "e").maxCoeff(), column(r, "e").minCoeff(), 1e-7);
}

// Rigorous solution (sim/REFERENCES.md): a flexible rod on a spherical joint, in space.
TEST(Engine, RodOnASphericalJoint) {
  const Results r = run(simulation(2.0, "[0, 0, -9.81]", 100) + R"([[body]]
name = "rod"
kind = "beam"
length = 1
section = { shape = "circle", diameter = 0.01 }
material = { density = 2700.0, youngs_modulus = 1e9 }
elements = 8
)" + joint("ball", "spherical", "ground", "rod.root", "initial = { rate = [0, 0, 2.5] }") +
                        output("tip", "rod.tip", "position") + output("energy", "system", "energy"));
  EXPECT_NEAR(at(r, "energy", 0.0), 0.2208932335, 1e-9);
  EXPECT_NEAR(at(r, "tip.x", 0.5), -0.38366, 4e-3);
  EXPECT_NEAR(at(r, "tip.y", 0.5), 0.26021, 4e-3);
  EXPECT_NEAR(at(r, "tip.z", 0.5), -0.88573, 4e-3);
  EXPECT_NEAR(at(r, "tip.x", 2.0), -0.8790, 4e-3);
  EXPECT_NEAR(at(r, "tip.y", 2.0), 0.4680, 4e-3);
  EXPECT_NEAR(at(r, "tip.z", 2.0), -0.0854, 4e-3);
}

// A planar loop of spatial revolutes: three of its five conditions are redundant.
std::string parallelogram(const std::string& second_position) {
  const std::string z = "axis = [0, 0, 1]";
  return simulation(2.0, "[0, -9.81, 0]", 100) + rod("a") + rod("b") + rod("c") +
         joint("left", "revolute", "ground", "a", z + "\ninitial = { value = -0.17453292519943295 }") +
         joint("right", "revolute", "ground", "b", z + "\nposition = " + second_position + "\ninitial = { value = -0.17453292519943295 }") +
         joint("top", "revolute", "a.tip", "c", z) + joint("close", "revolute", "c.tip", "b.tip", z) + output("end", "c.tip", "position") +
         output("other", "b.tip", "position") + output("energy", "system", "energy") + output("force", "close", "reaction");
}

TEST(Engine, RedundantLoopIsClosedAndConserves) {
  const Results r = run(parallelogram("[1, 0, 0]"), 1e-9);
  EXPECT_LT((column(r, "end.x") - column(r, "other.x")).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((column(r, "end.y") - column(r, "other.y")).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_NEAR(column(r, "energy").maxCoeff(), column(r, "energy").minCoeff(), 1e-6);
  bool said = false;
  for (const std::string& note : r.statistics.notes.texts(Severity::note)) said = said || note.find("redundant") != std::string::npos;
  EXPECT_TRUE(said);
}

TEST(Engine, MechanismThatCannotBeAssembledNamesTheJoint) {
  try {
    run(parallelogram("[5, 0, 0]"));
    FAIL() << "assembled";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'close'"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("open by"), std::string::npos) << error.what();
  }
}

// A chain of rigid rods as a tree, and the same with parent and child of every joint exchanged.
TEST(Engine, ExchangingParentAndChildChangesNothing) {
  const auto chain = [](bool reversed) {
    std::string text = simulation(1.0, "[0, -9.81, 1]", 100) + rod("a") + rod("b");
    text += joint("one", "universal", "ground", "a", "axis = [0, 0, 1]");
    text += reversed ? joint("two", "spherical", "b", "a.tip", "") : joint("two", "spherical", "a.tip", "b", "");
    return text + output("tip", "b.tip", "position") + output("energy", "system", "energy");
  };
  const Results a = run(chain(false), 1e-10);
  EXPECT_NEAR(column(a, "energy").maxCoeff(), column(a, "energy").minCoeff(), 1e-7);
  const Results b = run(chain(true), 1e-10);
  EXPECT_NEAR(column(b, "energy").maxCoeff(), column(b, "energy").minCoeff(), 1e-7);
  for (const char* name : {"tip.x", "tip.y", "tip.z"}) EXPECT_LT((column(a, name) - column(b, name)).cwiseAbs().maxCoeff(), 1e-7) << name;
}

// Prescribed rotation against the same torque-free motion: a rod turned by 150 t keeps its tip on the circle.
TEST(Engine, PrescribedMotionIsFollowed) {
  const Results r =
      run(simulation(0.1, "[0, 0, 0]") + rod("rod") + joint("drive", "revolute", "ground", "rod", "axis = [0, 0, 1]\nmotion = \"150*t\"") +
          output("tip", "rod.tip", "position") + output("v", "rod.tip", "velocity") + output("a", "rod.tip", "acceleration"));
  for (double t : {0.01, 0.05, 0.1}) {
    EXPECT_NEAR(at(r, "tip.x", t), std::cos(150 * t), 1e-9);
    EXPECT_NEAR(at(r, "v.y", t), 150 * std::cos(150 * t), 1e-6);
    EXPECT_NEAR(at(r, "a.x", t), -150.0 * 150.0 * std::cos(150 * t), 1e-3);
  }
}

// Schiavo et al. 2005 Table 1.
TEST(Engine, CantileverFrequencies) {
  const Scene scene = parse_scene(simulation(1, "[0, 0, 0]") + R"([[body]]
name = "beam"
kind = "beam"
length = 2
section = { shape = "rectangle", width = 0.01, height = 0.01 }
material = { density = 2700.0, youngs_modulus = 7.2e10 }
elements = 10
)" + joint("wall", "weld", "ground", "beam.root", ""),
                                  "test.toml");
  const Linearisation linear = linearise(make_system(scene));
  const double expected[] = {2.0854750, 13.0698705, 36.6041219, 71.7795490, 118.842591};
  for (size_t k = 0; k < 5; ++k) EXPECT_NEAR(linear.modes[k].frequency / expected[k], 1.0, 1e-6);
}

// All integrators agree.
TEST(Engine, MethodsAgree) {
  const std::string scene = simulation(0.5, "[0, -9.81, 0]", 100) + rod("a") + rod("b") +
                            joint("one", "revolute", "ground", "a", "axis = [0, 0, 1]") +
                            joint("two", "revolute", "a.tip", "b", "axis = [0, 0, 1]") + output("tip", "b.tip", "position");
  const Results reference = run(scene, 1e-10, Method::adams);
  for (Method m : {Method::bdf, Method::erk, Method::dirk, Method::ida, Method::exponential}) {
    const Results r = run(scene, 1e-8, m);
    EXPECT_NEAR(at(r, "tip.x", 0.5), at(reference, "tip.x", 0.5), 1e-5) << method_name(m);
  }
}

}  // namespace
}  // namespace flexframe::sim::test_engine
