// Which method "auto" takes where something vibrates fast, and that the run by it is right.
#include "sim/run/method_choice.h"

#include "sim/results/histories.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace flexframe::sim::test_method_choice {
namespace {

// A slider-crank with an elastic rod. rod: its keys; crank: of the shaft, a motion or an initial rate; more: further tables.
Scene slider_crank(const std::string& rod, const std::string& crank, const std::string& more = "") {
  return parse_scene(R"toml(
[simulation]
duration = 1.0
output_rate = 500
[[body]]
name = "crank"
kind = "rigid"
mass = 1
inertia = [1e-3, 1e-3, 1e-3]
frames = { pin = [0.05, 0, 0] }
[[body]]
name = "rod"
kind = "beam"
length = 0.2
section = { shape = "rectangle", width = 0.01, height = 0.005 }
material = { density = 2700, youngs_modulus = 7e10 }
)toml" + rod + R"toml(
[[body]]
name = "slider"
kind = "rigid"
mass = 0.1
[[joint]]
name = "shaft"
kind = "revolute"
parent = "ground"
child = "crank"
)toml" + crank + R"toml(
[[joint]]
name = "pin"
kind = "revolute"
parent = "crank.pin"
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
[[output]]
name = "q"
of = "rod"
quantity = "q"
)toml" + more,
                     "slider_crank.toml");
}

const std::string few = "model = \"modal\"\nmodes = { bending_xy = [1, 2], axial = [1] }\n",
                  many = "elements = 8\neffects = [\"bending_xy\", \"axial\"]\n", driven = "motion = \"20*t\"\n",
                  let_go = "initial = { value = 0.5, rate = 20 }\n";

Method chosen(const Scene& scene) {
  double fastest = 0.0;
  return choose_method(make_system(scene), fastest);
}

// Damped so that the fastest vibrations decay and the slowest make some 700 radians: in a loop backward differences take a tenth of the
// Runge-Kutta method's evaluations and err a tenth as much; a beam that hangs from nothing but its clamp is stepped over.
TEST(MethodChoice, DampedLoopsGoByBackwardDifferences) {
  const std::string damped = many + "damping = { stiffness = 1e-5 }\n";
  const Scene loop = slider_crank(damped, driven);
  EXPECT_EQ(chosen(loop), Method::bdf);
  Scene tree = loop;
  tree.joints.erase(tree.joints.begin() + 2, tree.joints.end());
  tree.bodies.pop_back();
  EXPECT_EQ(chosen(tree), Method::dirk);
}

// Of links that stretch and bend the stretching is the fastest and decays; that their bending does not is no matter.
TEST(MethodChoice, LinksThatStretchGoByBackwardDifferences) {
  const std::string links = "model = \"lumped\"\nelements = 6\ndamping = { stiffness = 2e-5 }\neffects = [\"bending_xy\"";
  EXPECT_EQ(chosen(slider_crank(links + ", \"axial\"]\n", driven)), Method::bdf);
  EXPECT_EQ(chosen(slider_crank(links + "]\n", driven)), Method::dirk);
}

TEST(MethodChoice, FewRatesOnMotionsAndInLoopsAreFollowed) {
  EXPECT_EQ(chosen(slider_crank(few, driven)), Method::exponential);
  EXPECT_EQ(chosen(slider_crank(few, let_go)), Method::exponential);
  EXPECT_EQ(chosen(slider_crank(many, driven)), Method::dirk);
}

TEST(MethodChoice, WhatIsTighterIsLeftToAdams) {
  Scene scene = slider_crank(few, driven);
  scene.simulation.tolerance = 1e-9;
  EXPECT_EQ(chosen(scene), Method::dirk);
}

// Events, springs beside free joints, and open chains that swing.
TEST(MethodChoice, WhatCannotOrShouldNotBeFollowedIsNot) {
  EXPECT_EQ(chosen(slider_crank(few, let_go + "friction = { coefficient = 0.3, normal_force = 10, radius = 0.01 }\n")), Method::dirk);
  EXPECT_EQ(chosen(slider_crank(few, let_go, R"([[force]]
kind = "spring-damper"
on = "slider"
from = "ground"
stiffness = 1e5
rest = 0.2
)")),
            Method::dirk);
  EXPECT_EQ(chosen(parse_scene(R"([simulation]
duration = 3.0
gravity = [0, -9.81, 0]
[[body]]
name = "rod"
kind = "beam"
length = 1.0
section = { shape = "rectangle", width = 0.03, height = 0.002 }
material = { density = 2700, youngs_modulus = 7e10 }
model = "modal"
modes = { bending_xy = [1, 2], axial = [1] }
[[joint]]
name = "pivot"
kind = "revolute"
parent = "ground"
child = "rod.root"
)",
                               "pendulum.toml")),
            Method::dirk);
}

// 7.6e-7 and 2.8e-6 of the range off; the implicit method, which steps over the rod's vibrations, 7e-3 and 1.2e-2.
TEST(MethodChoice, WhatIsFollowedIsRight) {
  for (const std::string& crank : {driven, let_go}) {
    Scene scene = slider_crank(few, crank);
    scene.simulation.duration = 0.1;
    const auto run = [&](Method method, double tolerance) {
      SimulateOptions options;
      options.method = method;
      options.tolerance = tolerance;
      return simulate_histories(scene, options);
    };
    const Histories truth = run(Method::erk, 1e-10), h = run(Method::automatic, 1e-6), stepped_over = run(Method::dirk, 1e-6);
    const VecX ranges = output_ranges(truth);
    EXPECT_EQ(h.statistics.method, "exponential");
    EXPECT_LT(compare_histories(h, truth, ranges).largest, 2e-5);
    EXPECT_GT(compare_histories(stepped_over, truth, ranges).largest, 1e-3);
  }
}

// A robot's arm of 24 coordinates: the matrices of the exponential method are dear beside its equations, so that "auto" steps over the
// vibrations, 0.023 of the range of the drive's reactions off by its estimate; they are followed then, 3e-4 off.
TEST(MethodChoice, WhatSteppingOverGetsWrongIsFollowedThough) {
  const Scene scene = parse_scene(R"([simulation]
duration = 0.5
gravity = [0, 0, -9.81]
[[body]]
name = "arm"
kind = "beam"
length = 0.8
section = { shape = "tube", diameter = 0.04, thickness = 0.002 }
material = { density = 7850, youngs_modulus = 2.1e11 }
keep_modes = 8
[[body]]
name = "load"
kind = "rigid"
mass = 3
inertia = [0.01, 0.02, 0.02]
[[joint]]
name = "base"
kind = "revolute"
parent = "ground"
child = "arm.root"
axis = [0, 0, 1]
motion = "60 deg*t^2*(3 - t)/4"
[[joint]]
name = "hand"
kind = "weld"
parent = "arm.tip"
child = "load"
[[output]]
name = "drive"
of = "base"
quantity = "reaction"
)",
                                  "arm.toml");
  EXPECT_EQ(chosen(scene), Method::dirk);
  const Results r = simulate(scene, {});
  EXPECT_EQ(r.statistics.method, "exponential");
  EXPECT_LT(r.statistics.error_estimate, 2e-3);
  const std::vector<std::string> notes = r.statistics.notes.texts(Severity::note);
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& n) { return n.starts_with("method exponential taken"); }));
  SimulateOptions options;
  options.method = Method::exponential;
  options.tolerance = 1e-8;  // as the explicit one at 1e-9 says too, in 30 s
  options.estimate_error = false;
  const Histories truth = simulate_histories(scene, options), h = to_histories(r);
  EXPECT_LT(compare_histories(h, truth, output_ranges(truth)).largest, 2e-3);
  // Whoever chooses a method or a tolerance gets it.
  options = {};
  options.tolerance = 1e-6;
  EXPECT_EQ(simulate(scene, options).statistics.method, "dirk");
}

// A beam that buckles takes its slide to the limit of its reach, where the exponential method's long steps find no way: the implicit one
// goes on from there.
TEST(MethodChoice, WhatCannotBeFollowedIsSteppedOver) {
  Scene scene = read_scene(std::string(FLEXFRAME_SOURCE_DIR) + "/examples/beams/buckling.toml");
  EXPECT_EQ(chosen(scene), Method::exponential);
  scene.simulation.duration = 10.91;
  SimulateOptions options;
  EXPECT_EQ(simulate_histories(scene, options).statistics.method, "dirk");
  options.method = Method::exponential;
  EXPECT_THROW(simulate_histories(scene, options), SimulationError);
}

}  // namespace
}  // namespace flexframe::sim::test_method_choice
