// The exponential method against the sixth-order and the multistep method at tight tolerances: plane and space, loops, jumps of loads,
// springs and dampers between frames, prescribed motions; what it is not for is refused.
#include "sim/results/histories.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace flexframe::sim::test_exponential {
namespace {

Scene example(const std::string& name) { return read_scene(std::string(FLEXFRAME_SOURCE_DIR) + "/examples/" + name + ".toml"); }

void keep(Scene& scene, const std::string& body, int modes) {
  for (BodyDef& b : scene.bodies)
    if (b.name == body) {
      BeamDef& beam = std::get<BeamDef>(b.kind);
      beam.keep_modes = modes;
      beam.keep_static = false;
      beam.elements = std::max(beam.elements, 3 * modes);
    }
}

Histories histories(const Scene& scene, double tolerance, Method method) {
  SimulateOptions options;
  options.tolerance = tolerance;
  options.method = method;
  options.samples = 200;
  return simulate_histories(scene, options);
}

double error(const Histories& h, const Histories& reference) { return compare_histories(h, reference, output_ranges(reference)).largest; }

// Free vibrations of eight modes through a whole fall: the error falls with the tolerance, for a tenth of the evaluations of the
// sixth-order method. Their number scatters by a twentieth with rounding: it is counted where a tenth is not within that.
TEST(Exponential, FollowsVibrationsOfAPendulum) {
  Scene scene = example("pendulum");
  keep(scene, "pendulum", 8);
  const Histories reference = histories(scene, 1e-10, Method::erk), sixth = histories(scene, 1e-6, Method::erk);
  const Histories loose = histories(scene, 1e-5, Method::exponential), tight = histories(scene, 2e-7, Method::exponential),
                  tightest = histories(scene, 1e-9, Method::exponential);
  EXPECT_LT(error(loose, reference), 1e-2);
  EXPECT_LT(error(tight, reference), 1e-3);
  EXPECT_LT(error(tightest, reference), 1e-4);
  EXPECT_LT(10 * tight.statistics.evaluations, sixth.statistics.evaluations);
}

// A loop, a torque that jumps to zero, changing choices of independent coordinates.
TEST(Exponential, FollowsASliderCrankThroughAJump) {
  Scene scene = example("slider_crank");
  for (BodyDef& body : scene.bodies)
    if (auto* rod = std::get_if<BeamDef>(&body.kind))
      std::erase_if(rod->effects.names, [](const auto& n) { return n == "axial" || n == "shear"; });
  keep(scene, "crank", 1);
  keep(scene, "rod", 4);
  const Histories reference = histories(scene, 1e-10, Method::erk);
  const Histories loose = histories(scene, 1e-5, Method::exponential), tight = histories(scene, 1e-8, Method::exponential);
  EXPECT_LT(error(loose, reference), 2e-2);
  EXPECT_LT(error(tight, reference), 2e-4);
}

// Rods that stretch too: what their vibrations do on the average has to be sampled (without: 1e-3 and 6e-5 at 1e-7 and 1e-8).
TEST(Exponential, ReachesATightToleranceWhereRodsStretch) {
  Scene scene = example("slider_crank");
  scene.simulation.duration = 0.8;
  for (BodyDef& body : scene.bodies)
    if (auto* rod = std::get_if<BeamDef>(&body.kind)) {
      const bool crank = body.name == "crank";
      rod->effects.names = {"bending_xy", "stiffening", "axial"};
      rod->elements = crank ? 8 : 16;
      rod->keep_modes = crank ? 2 : 3;
      rod->keep_axial = 2;
    }
  const Histories reference = histories(scene, 1e-9, Method::erk);
  const Histories loose = histories(scene, 1e-6, Method::exponential), tight = histories(scene, 1e-7, Method::exponential),
                  tightest = histories(scene, 1e-8, Method::exponential);
  EXPECT_LT(error(loose, reference), 2e-3);
  EXPECT_LT(error(tight, reference), 5e-5);
  EXPECT_LT(error(tightest, reference), 1.5e-5);
}

// A stacker's mast whose fast vibrations decay within a turn (stiffness alone damps, 2 % of the first one) on a driven cart. Sampled loads
// must not shake them as if nothing damped them: the force at its foot was 1.0e-5 of its range off, now 5.6e-7.
TEST(Exponential, DoesNotShakeWhatIsDampedStrongly) {
  const Scene scene = parse_scene(R"toml(
[simulation]
duration = 3.5
output_rate = 200
gravity = [0, -9.81, 0]
[[body]]
name = "cart"
kind = "rigid"
mass = 1e5
[[body]]
name = "mast"
kind = "beam"
length = 13.0
section = { shape = "circle", diameter = 0.7 }
material = { density = 7850, youngs_modulus = 2.1e11, poisson = 0.3 }
damping = { stiffness = 0.002 }
model = "modal"
modes = { bending_xy = [1, 2, 3, 4], axial = [1] }
[[body]]
name = "load"
kind = "rigid"
mass = 26500
inertia = [5700, 5700, 11000]
centre_of_mass = [0.4, 0, 0]
[[joint]]
name = "rail"
kind = "prismatic"
parent = "ground"
child = "cart"
axis = [1, 0, 0]
motion = "4.3*(t < 1.76 ? t/1.76 - sin(2*pi*t/1.76)/(2*pi) : 1)"
[[joint]]
name = "foot"
kind = "weld"
parent = "cart"
child = "mast.root"
rotation = [0, 0, 1.5707963267948966]
[[joint]]
name = "head"
kind = "weld"
parent = "mast.tip"
child = "load"
rotation = [0, 0, -1.5707963267948966]
[[output]]
name = "foot"
of = "foot"
quantity = "reaction"
)toml",
                                  "mast.toml");
  const Histories reference = histories(scene, 1e-11, Method::erk), h = histories(scene, 1e-7, Method::exponential);
  ASSERT_EQ(h.columns[0], "foot.x");
  EXPECT_LT(compare_histories(h, reference, output_ranges(reference)).columns[0], 2e-6);
}

// A beam slides along a carrier that flies: what does not vibrate has shapes that are nearly parallel. Some of their amounts without the
// others made 98 % of the energy between the ends of steps; now 6e-6 of it come and go.
TEST(Exponential, KeepsEnergyWithinStepsWhereRigidMotionsAreNearlyParallel) {
  const Scene scene = parse_scene(R"toml(
[simulation]
duration = 0.1
gravity = [0, -9.81, 0]
[[body]]
name = "carrier"
kind = "rigid"
mass = 1.3
inertia = [0.007, 0.004, 0.010]
frames = { p = [-0.3, 0.4, -0.4] }
[[body]]
name = "beam"
kind = "beam"
length = 0.5
section = { shape = "circle", diameter = 0.011 }
material = { density = 2700.0, youngs_modulus = 7e10 }
elements = 3
[[joint]]
name = "flight"
kind = "free"
parent = "ground"
child = "carrier"
initial = { rate = [0.2, -0.1, 0.2, -0.5, 0.7, 0.6] }
[[joint]]
name = "slide"
kind = "prismatic"
parent = "carrier.p"
child = "beam"
rotation = [0.2, -0.4, 0.1]
axis = [-0.3, -0.9, -0.4]
initial = { rate = 0.9 }
[[output]]
name = "energy"
of = "system"
quantity = "energy"
[[output]]
name = "kinetic"
of = "system"
quantity = "kinetic"
)toml",
                                  "slide.toml");
  for (double tolerance : {1e-7, 1e-8, 1e-9}) {
    const Histories h = histories(scene, tolerance, Method::exponential);
    ASSERT_EQ(h.columns[0], "energy");
    const auto energy = h.values.row(0);
    EXPECT_LT(energy.maxCoeff() - energy.minCoeff(), 2e-5 * h.values.row(1).maxCoeff()) << tolerance;
  }
}

// A body that flies, turns and falls has fewer shapes than motions: its rotations' become displacements'. Beside a hinged body that ended
// every run at its start.
TEST(Exponential, FollowsAFallingBodyBesideAPendulum) {
  const Scene scene = parse_scene(R"toml(
[simulation]
duration = 0.5
gravity = [-1.35, 1.9, 0.135]
[[body]]
name = "pendulum"
kind = "rigid"
mass = 2.339
inertia = [0.053338168575283666, 0.05721633662631104, 0.05014239281995063]
centre_of_mass = [-0.192, -0.095, -0.052]
[[body]]
name = "flier"
kind = "rigid"
mass = 1.812
inertia = [0.018697316504849786, 0.006747814368703978, 0.014218178927575435]
centre_of_mass = [0.009, 0.193, 0.159]
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "pendulum"
position = [0.009, -0.065, -0.138]
rotation = [-0.161, -0.857, 0.557]
axis = [-0.242, -0.239, 0.818]
initial = { rate = 0.024 }
[[joint]]
name = "flight"
kind = "free"
parent = "ground"
child = "flier"
position = [0.234, 0.248, -0.115]
rotation = [-0.19800000000000004, -0.6060000000000001, -0.6670000000000001]
axis = [0.498, 0.058, 0.547]
initial = { rate = [-0.997, 0.265, 0.049, 0.147, -0.023, -0.73] }
[[output]]
name = "flier"
of = "flier"
quantity = "position"
[[output]]
name = "pendulum"
of = "pendulum"
quantity = "rotation"
)toml",
                                  "flier.toml");
  const Histories reference = histories(scene, 1e-11, Method::erk);
  EXPECT_LT(error(histories(scene, 1e-6, Method::exponential), reference), 1e-5);
}

constexpr const char* beam = R"(
length = 0.5
section = { shape = "rectangle", width = 0.01, height = 0.02 }
material = { density = 2700.0, youngs_modulus = 7e8 }
elements = 4
keep_modes = 2
keep_static = false
)";

// Quaternions, two bending directions, a spring and a damper between bodies, a driven joint.
TEST(Exponential, AgreesInSpace) {
  const std::string text = fmt::format(R"scene([simulation]
duration = 0.6
output_rate = 200
gravity = [0, 0, -9.81]
[[body]]
name = "a"
kind = "beam"{0}
[[body]]
name = "b"
kind = "beam"{0}
[[joint]]
name = "drive"
kind = "revolute"
parent = "ground"
child = "a.root"
axis = [0, 0, 1]
motion = "0.8*sin(5*t)"
[[joint]]
name = "ball"
kind = "spherical"
parent = "a.tip"
child = "b.root"
initial = {{ rate = [3, 2, 1] }}
[[force]]
kind = "spring-damper"
on = "b.tip"
from = "ground"
stiffness = 20
damping = 0.3
rest = 0.4
[[output]]
name = "tip"
of = "b.tip"
quantity = "position"
[[output]]
name = "bend"
of = "a.tip"
quantity = "displacement"
)scene",
                                       beam);
  const Scene scene = parse_scene(text, "test.toml");
  const Histories reference = histories(scene, 1e-10, Method::erk);
  const Histories loose = histories(scene, 1e-7, Method::exponential), tight = histories(scene, 1e-9, Method::exponential);
  EXPECT_LT(error(loose, reference), 1e-2);
  EXPECT_LT(error(tight, reference), 2e-4);
}

// A lumped beam on springs, at rest: its rates are rounding, from which steps were shortened (6438 of them).
TEST(Exponential, TakesLongStepsAtRest) {
  std::string text = R"scene([simulation]
duration = 0.02
output_rate = 200
gravity = [0, 0, 0]
start = "static"
[ground]
frames = { g2 = [0.0588, -0.144, 0], g4 = [0.1177, -0.144, 0], g6 = [0.1765, -0.144, 0], g8 = [0.2354, -0.144, 0] }
[[body]]
name = "rail"
kind = "beam"
length = 0.294
section = { shape = "box", height = 0.045, width = 0.0708, thickness = 0.00214 }
material = { density = 1200.0, youngs_modulus = 3e9, poisson = 0.38 }
model = "lumped"
elements = 20
frames = { p2 = 0.2, p4 = 0.4, p6 = 0.6, p7 = 0.7, p8 = 0.8 }
[[joint]]
name = "end"
kind = "weld"
parent = "ground"
child = "rail.root"
[[force]]
kind = "force"
on = "rail.p7"
direction = [0, -1, 0]
value = 689
[[output]]
name = "load"
of = "rail.p7"
quantity = "position"
)scene";
  for (int k : {2, 4, 6, 8})
    text += fmt::format(
        "[[force]]\nkind = \"spring-damper\"\non = \"rail.p{0}\"\nfrom = \"ground.g{0}\"\nstiffness = 2.65e6\nrest = 0.144\n", k);
  const Histories h = histories(parse_scene(text, "test.toml"), 1e-6, Method::exponential);
  EXPECT_LT(h.statistics.steps, 300);
}

TEST(Exponential, RefusesWhatHasEvents) {
  const std::string text = R"([simulation]
duration = 0.1
gravity = [0, -9.81, 0]
method = "exponential"
[[body]]
name = "block"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "slide"
kind = "prismatic"
parent = "ground"
child = "block"
axis = [1, 0, 0]
initial = { rate = 1.0 }
friction = { coefficient = 0.3, normal_force = 10 }
)";
  try {
    simulate(parse_scene(text, "test.toml"), {});
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("method \"exponential\""), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace flexframe::sim::test_exponential
