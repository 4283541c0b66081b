// Errors relative to ranges, and the effects of a scene: what is asked, what is left out, what is worth it.
#include "sim/results/histories.h"
#include "sim/run/effect_report.h"
#include "sim/run/histories_run.h"
#include "sim/scene/scene_reader.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim::test_histories {
namespace {

Histories example() {
  Histories h;
  h.columns = {"tip.x", "tip.y", "tip.z", "angle", "energy"};
  h.units = {"m", "m", "m", "rad", "J"};
  h.times = VecX::LinSpaced(11, 0.0, 1.0);
  h.values = MatX::Zero(5, 11);
  h.values.row(0) = h.times.transpose() * 2.0;   // range 2
  h.values.row(1) = h.times.transpose() * 0.01;  // hardly moves: counts against the vector
  h.values.row(3) = h.times.transpose() * 3.0;
  h.values.row(4).setConstant(7.0);  // conserved
  h.energy_scale = 5.0;
  return h;
}

TEST(Histories, RangesAreThoseOfWholeVectorsAndEnergiesHaveTheirScale) {
  const VecX r = output_ranges(example());
  EXPECT_NEAR(r[0], 2.0, 1e-12);
  EXPECT_NEAR(r[1], 2.0, 1e-12);
  EXPECT_NEAR(r[2], 2.0, 1e-12);
  EXPECT_NEAR(r[3], 3.0, 1e-12);
  EXPECT_NEAR(r[4], 5.0, 1e-12);
}

// Other programs' files may hold one of the energies.
TEST(Histories, TheirScaleOfEnergyIsThatOfWhatResultsHold) {
  Results results;
  results.times = VecX::LinSpaced(3, 0.0, 1.0);
  EXPECT_EQ(to_histories(results).energy_scale, 0.0);
  results.kinetic = Vec3(0.0, 4.0, 1.0);
  EXPECT_EQ(to_histories(results).energy_scale, 4.0);
  results.strain = Vec3(0.0, 6.0, 1.0);
  EXPECT_EQ(to_histories(results).energy_scale, 6.0);
  results.kinetic.resize(0);
  EXPECT_EQ(to_histories(results).energy_scale, 6.0);
}

// A picometre beside a mechanism of a metre counts where two runs tell the same of it; rounding does not come twice.
TEST(Histories, TinyMotionsCountWhereTwoRunsAgree) {
  Histories a;
  a.columns = {"tip.x", "tip.y", "rest"};
  a.units = {"m", "m", "m"};
  a.times = VecX::LinSpaced(21, 0.0, 1.0);
  a.values = MatX::Zero(3, 21);
  a.values.row(0).setConstant(1.0);
  a.values.row(1) = 1e-12 * (7.0 * a.times.transpose().array()).sin().matrix();
  a.values.row(2) = 1e-12 * (90.0 * a.times.transpose().array()).sin().matrix();
  Histories b = a;
  b.values.row(1) *= 1.02;
  b.values.row(2) = 1e-12 * (77.0 * a.times.transpose().array()).cos().matrix();
  EXPECT_EQ(output_ranges(a)[1], 0.0);
  const VecX r = output_ranges(a, b);
  EXPECT_NEAR(r[1], 2e-12, 1e-13);
  EXPECT_EQ(r[2], 0.0);
  EXPECT_NEAR(compare_histories(b, a, r).largest, 0.01, 2e-3);
  // Below the digits of the size nothing counts.
  a.values.row(1) *= 1e-4;
  b.values.row(1) *= 1e-4;
  EXPECT_EQ(output_ranges(a, b)[1], 0.0);
}

// Rounding does not move: moments of a reaction without any, the rotation of what does not turn.
TEST(Histories, RoundingIsNoRange) {
  Histories h;
  h.columns = {"pull.x", "pull.mx", "turn.x", "spin.x", "place.x", "speed.x", "small"};
  h.units = {"N", "N m", "rad", "rad/s", "m", "m/s", "m"};
  h.times = VecX::LinSpaced(11, 0.0, 0.1);
  h.values = MatX::Zero(7, 11);
  const Eigen::RowVectorXd jitter = (40.0 * h.times.transpose().array()).sin().matrix();
  h.values.row(0) = 200.0 * jitter;
  h.values.row(1) = 3e-14 * jitter;
  h.values.row(2) = 2e-16 * jitter;
  h.values.row(3) = 1e-14 * jitter;
  h.values.row(4) = h.times.transpose();
  h.values.row(5) = 1e-15 * jitter;
  h.values.row(6) = 1e-5 * jitter;
  const VecX r = output_ranges(h);
  for (int k : {1, 2, 3, 5}) EXPECT_EQ(r[k], 0.0) << h.columns[static_cast<size_t>(k)];
  for (int k : {0, 4, 6}) EXPECT_GT(r[k], 0.0) << h.columns[static_cast<size_t>(k)];
  // A mechanism of a micrometre has moments of so little.
  h.values.row(1) *= 1e6;
  EXPECT_GT(output_ranges(h)[1], 0.0);
}

// A tip of nanometres beside a way of ten metres is motion: it gets its error.
TEST(Histories, NanometresBesideMetresMove) {
  Histories h;
  h.columns = {"crane", "tip.x", "tip.y", "closed"};
  h.units = {"m", "m", "m", "m"};
  h.times = VecX::LinSpaced(11, 0.0, 1.0);
  h.values = MatX::Zero(4, 11);
  h.values.row(0) = 10.0 * h.times.transpose();
  h.values.row(2) = 5e-9 * h.times.transpose();
  h.values.row(3) = 5e-11 * h.times.transpose();  // what the closure of a loop leaves
  const VecX r = output_ranges(h);
  EXPECT_DOUBLE_EQ(r[1], 5e-9);
  EXPECT_DOUBLE_EQ(r[2], 5e-9);
  EXPECT_EQ(r[3], 0.0);
}

// A crank with an elastic rod whose loop is closed, asked for the columns of some outputs only: places alone take no rates, a combination
// takes what it reads, energies and speeds take all.
TEST(Histories, OutputsThatNobodyReadAreLeftOutOfARun) {
  const Scene scene = parse_scene(R"(
[simulation]
duration = 0.3
output_rate = 200
gravity = [0, -9.81, 0]
tolerance = 1e-7
[[body]]
name = "crank"
kind = "rigid"
mass = 0.2
inertia = [1e-4, 4e-4, 4e-4]
centre_of_mass = [0.05, 0, 0]
frames = { tip = [0.1, 0, 0] }
[[body]]
name = "rod"
kind = "beam"
length = 0.3
section = { shape = "circle", diameter = 0.01 }
material = { density = 2700, youngs_modulus = 1e9 }
elements = 4
keep_modes = 2
effects = ["bending_xy"]
[[body]]
name = "block"
kind = "rigid"
mass = 0.3
inertia = [1e-4, 1e-4, 1e-4]
[[joint]]
name = "shaft"
kind = "revolute"
parent = "ground"
child = "crank"
initial = { value = 0.4, rate = 20 }
[[joint]]
name = "pin"
kind = "revolute"
parent = "crank.tip"
child = "rod.root"
[[joint]]
name = "wrist"
kind = "revolute"
parent = "rod.tip"
child = "block"
[[joint]]
name = "guide"
kind = "prismatic"
parent = "ground"
child = "block"
axis = [1, 0, 0]
[[output]]
name = "slider"
of = "block"
quantity = "position"
[[output]]
name = "speed"
of = "block"
quantity = "velocity"
[[output]]
name = "bend"
of = "rod.tip"
quantity = "displacement"
[[output]]
name = "energy"
of = "system"
quantity = "energy"
[[output]]
name = "twice"
expression = "2*slider.x"
unit = "m"
[[output]]
name = "four"
expression = "2*twice + speed.x"
unit = "m"
)",
                                  "crank.toml");
  SimulateOptions options;
  const Histories all = simulate_histories(scene, options);
  const auto column = [&](const char* name) {
    return static_cast<size_t>(std::find(all.columns.begin(), all.columns.end(), name) - all.columns.begin());
  };
  const VecX ranges = output_ranges(all);
  for (const std::vector<const char*>& names :
       {std::vector<const char*>{"slider.x"}, {"bend.y"}, {"slider.x", "bend.y"}, {"speed.x"}, {"energy"}, {"twice"}, {"four"}}) {
    options.read.assign(all.columns.size(), false);
    for (const char* name : names) options.read.at(column(name)) = true;
    SeenBeside beside;
    options.beside = &beside;
    const Histories some = simulate_histories(scene, options);
    ASSERT_EQ(some.columns, all.columns);
    for (const char* name : names) {
      const auto k = static_cast<Eigen::Index>(column(name));
      ASSERT_GT(ranges[k], 0.0) << name;
      // The digits of a guess at a sample's rates may go on in the run.
      EXPECT_LE((some.values.row(k) - all.values.row(k)).cwiseAbs().maxCoeff(), 1e-9 * ranges[k]) << name;
    }
    const auto energy = static_cast<Eigen::Index>(column("energy"));
    EXPECT_EQ(some.values.row(energy).isZero(0.0), std::string(names.front()) != "energy");
    ASSERT_EQ(beside.swings.size(), 3);
    EXPECT_GT(beside.swings[1], 0.0);
    EXPECT_EQ(beside.swings[0], 0.0);
  }
}

TEST(Histories, ComparesAtCommonTimesAndNamesTheWorst) {
  const Histories reference = example();
  Histories off = at_times(reference, VecX::LinSpaced(6, 0.0, 1.0));
  ASSERT_EQ(off.times.size(), 6);
  off.values(1, 3) += 0.5;
  off.values(3, 2) -= 0.6;
  const Difference d = compare_histories(off, reference, output_ranges(reference));
  EXPECT_NEAR(d.columns[1], 0.25, 1e-12);
  EXPECT_NEAR(d.columns[3], 0.2, 1e-12);
  EXPECT_EQ(d.column, 1);
  EXPECT_NEAR(d.largest, 0.25, 1e-12);
  Histories other = off;
  other.columns[0] = "root.x";
  EXPECT_THROW(compare_histories(other, reference, output_ranges(reference)), flexframe::ArgumentError);
  other = off;
  other.times.array() += 0.03;
  EXPECT_THROW(compare_histories(other, reference, output_ranges(reference)), flexframe::ArgumentError);
}

Scene pendulum(const std::string& body) {
  return parse_scene(R"(
[simulation]
duration = 0.2
output_rate = 200
gravity = [0, -9.81, 0]
tolerance = 1e-5
[[body]]
name = "beam"
kind = "beam"
length = 0.4
section = { shape = "rectangle", width = 0.2, height = 0.009 }
material = { density = 5540.0, youngs_modulus = 1e9 }
elements = 8
)" + body + R"(
[[joint]]
name = "pivot"
kind = "revolute"
parent = "ground"
child = "beam.root"
axis = [0, 0, 1]
[[output]]
name = "tip"
of = "beam.tip"
quantity = "position"
)",
                     "pendulum.toml");
}

const EffectState& state(const std::vector<EffectState>& states, const std::string& effect) {
  for (const EffectState& s : states)
    if (s.effect == effect) return s;
  throw std::logic_error(effect);
}

TEST(Effects, EveryStateIsInTheRegistryAndSaysWhy) {
  for (const char* words : {"", "effects = [\"bending_xy\"]", "model = \"modal\"\nmodes = { bending_xy = [1, 2] }"}) {
    std::string body = words;
    Scene scene = pendulum(body.find("model") == 0 ? "" : body);
    if (body.find("model") == 0) {
      auto& beam = std::get<BeamDef>(scene.bodies[0].kind);
      beam.model = BeamModel::modal;
      beam.modes["bending_xy"] = {1, 2};
    }
    const std::vector<EffectState> states = effect_states(scene, make_system(scene).model);
    EXPECT_GE(states.size(), 9u);
    for (const EffectState& s : states) {
      EXPECT_NE(find_effect(s.effect), nullptr) << s.effect;
      EXPECT_FALSE(s.why.empty()) << s.effect;
      EXPECT_TRUE(s.possible || !s.on) << s.effect;
    }
  }
}

TEST(Effects, PlanarSceneBendsInItsPlaneOnly) {
  const Scene scene = pendulum("");
  const System system = make_system(scene);
  const std::vector<EffectState> states = effect_states(scene, system.model);
  EXPECT_TRUE(state(states, "bending_xy").on);
  EXPECT_EQ(state(states, "bending_xy").by, "symmetry");
  EXPECT_EQ(state(states, "bending_xy").coordinates, 16);
  EXPECT_FALSE(state(states, "bending_xz").possible);
  EXPECT_FALSE(state(states, "torsion").possible);
}

TEST(Effects, SwitchedOffLeavesNothingBehind) {
  const Scene scene = pendulum("");
  const std::vector<EffectState> states = effect_states(scene, make_system(scene).model);
  const System off = make_system(with_effect(scene, states, "beam", "stiffening", false));
  for (const FlexibleNode& node : off.model.parts[0].body.nodes)
    for (const MatX& b : node.phi2) EXPECT_EQ(b.size(), 0);
  for (const MatX& b : off.model.parts[0].body.md2) EXPECT_EQ(b.size(), 0);
  EXPECT_EQ(state(effect_states(scene, off.model), "stiffening").on, false);
  const System quiet = make_system(with_effect(scene, states, "beam", "gyroscopic", false));
  for (const MatX& b : quiet.model.parts[0].body.Cr1) EXPECT_EQ(b.size(), 0);
  // Centrifugal forces stay: the inertia follows the deformation as before.
  const System with = make_system(scene);
  const FlexibleBody &whole = with.model.parts[0].body, &left = quiet.model.parts[0].body;
  EXPECT_FALSE(whole.J1.isZero(0.0));
  EXPECT_EQ(left.J1, whole.J1);
  for (size_t a = 0; a < 6; ++a) EXPECT_EQ(left.J2[a], whole.J2[a]);
  const Scene stretched = with_effect(scene, states, "beam", "axial", true);
  EXPECT_EQ(state(effect_states(stretched, make_system(stretched).model), "axial").coordinates, 8);
  EXPECT_THROW(with_effect(scene, states, "nobody", "axial", true), flexframe::ArgumentError);
}

TEST(Effects, KeptModesAreTheLowestOnes) {
  const System all = make_system(pendulum("")), kept = make_system(pendulum("keep_modes = 3\nkeep_static = false"));
  ASSERT_EQ(all.model.parts[0].body.n, 16);
  // A hinge holds no rotation: no shape but the modes, and with keep_static that of the weight.
  ASSERT_EQ(make_system(pendulum("keep_modes = 3")).model.parts[0].body.n, 4);
  ASSERT_EQ(kept.model.parts[0].body.n, 3);
  // The machine vibrates with the lowest frequencies that it has with all coordinates: those of the hinged beam.
  const auto frequencies = [](const System& system) {
    std::vector<double> out;
    for (const LinearMode& mode : linearise(system).modes) out.push_back(mode.frequency);
    std::sort(out.begin(), out.end());
    return out;
  };
  const std::vector<double> few = frequencies(kept), whole = frequencies(all);
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(few[few.size() - 3 + k], whole[whole.size() - 16 + k], 1e-6 * whole[whole.size() - 16 + k]);
  // Coordinates are told in those of the elements, whatever is kept.
  EXPECT_EQ(kept.model.parts[0].shown.coordinates.rows(), 16);
  EXPECT_EQ(make_system(pendulum("keep_modes = 0")).model.parts[0].body.n, 0);
}

// Of a rod free at both ends the stretching vibrates at k c / (2 L), c = sqrt(E / rho): one mode of it beside six of bending and two of
// torsion.
TEST(Effects, KeptModesOfStretchingAndTorsion) {
  const std::string text =
      "[simulation]\nduration = 1\ngravity = [0, 0, 0]\n[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1.0\nsection = { shape = "
      "\"circle\", diameter = 0.02 }\nmaterial = { density = 7800.0, youngs_modulus = 2e11, poisson = 0.3 }\nmodel = \"finite-element\"\n"
      "elements = 20\neffects = [\"axial\", \"bending_xy\", \"torsion\"]\nkeep_modes = 6\nkeep_axial = 1\nkeep_torsion = 2\n";
  const System kept = make_system(parse_scene(text, "s.toml"));
  ASSERT_EQ(kept.model.parts[0].body.n, 9);
  const double c = std::sqrt(2e11 / 7800.0), cs = std::sqrt(2e11 / 2.6 / 7800.0);
  int axial = 0, torsion = 0;
  for (const LinearMode& mode : linearise(kept).modes) {
    axial += std::abs(mode.frequency - 0.5 * c) < 3e-3 * 0.5 * c;
    for (const int k : {1, 2}) torsion += std::abs(mode.frequency - 0.5 * k * cs) < 5e-3 * k * cs;
  }
  EXPECT_EQ(axial, 1);
  EXPECT_EQ(torsion, 2);
  for (const char* wrong : {"keep_axial = -1\n", "keep_torsion = 2.5\n"})
    EXPECT_THROW(parse_scene(text.substr(0, text.find("keep_axial")) + wrong, "s.toml"), flexframe::InputError) << wrong;
  EXPECT_THROW(parse_scene(text.substr(0, text.find("keep_modes")) + "keep_axial = 1\n", "s.toml"), flexframe::InputError);
}

// Between two hinges a beam's modes are those between supports, whatever frame it has; a moment at its end bends it statically beside them.
TEST(Effects, KeptModesBetweenHingesAndUnderLoads) {
  const auto text = [](const std::string& words, const std::string& force) {
    return "[simulation]\nduration = 1\ngravity = [0, 0, 0]\n[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 1.0\nsection = { shape = "
           "\"circle\", diameter = 0.02 }\n"
           "material = { density = 7800.0, youngs_modulus = 2e11 }\nmodel = \"finite-element\"\nelements = 8\nboundary = "
           "\"clamped-free\"\neffects = [\"bending_xy\"]\n" +
           words +
           "\n[[joint]]\nname = \"a\"\nkind = \"revolute\"\nparent = \"ground\"\nchild = \"b.root\"\n[[joint]]\nname = \"c\"\nkind = "
           "\"point-on-line\"\nparent = \"ground\"\n"
           "child = \"b.tip\"\naxis = [1, 0, 0]\n" +
           force;
  };
  const std::string torque = "[[force]]\nkind = \"torque\"\non = \"b.root\"\ndirection = [0, 0, 1]\nvalue = 1.0\n";
  EXPECT_EQ(make_system(parse_scene(text("keep_modes = 2", ""), "s.toml")).model.parts[0].body.n, 2);
  EXPECT_EQ(make_system(parse_scene(text("keep_modes = 2", torque), "s.toml")).model.parts[0].body.n, 3);
  EXPECT_EQ(make_system(parse_scene(text("keep_modes = 2\nkeep_static = false", torque), "s.toml")).model.parts[0].body.n, 2);
  // omega_k = (k pi / L)^2 sqrt(EI / rho A); the radius of gyration of the section is a quarter of the diameter.
  const Linearisation few = linearise(make_system(parse_scene(text("keep_modes = 2", ""), "s.toml")));
  ASSERT_EQ(few.modes.size(), 2u);
  for (int k = 1; k <= 2; ++k)
    EXPECT_NEAR(few.modes[static_cast<size_t>(k - 1)].frequency, std::pow(k * M_PI, 2) * 0.005 * std::sqrt(2e11 / 7800.0) / (2.0 * M_PI),
                5e-4 * few.modes[1].frequency);
}

TEST(Effects, StiffeningOfThePendulumIsFoundWhenLeftOut) {
  const Scene scene = pendulum("effects = [\"bending_xy\"]");
  const Histories base = simulate_histories(scene);
  NeglectOptions options;
  options.tolerance = 1e-5;
  const NeglectCheck check = check_neglected(scene, effect_states(scene, make_system(scene).model), base, options);
  ASSERT_FALSE(check.found.empty());
  EXPECT_EQ(check.found[0].effect, "stiffening");
  EXPECT_GT(check.found[0].share, 1e-5);
  EXPECT_NE(neglect_text(scene, check.found[0]).find("add \"stiffening\" to 'effects'"), std::string::npos);
  options.budget = 0.0;
  EXPECT_FALSE(check_neglected(scene, effect_states(scene, make_system(scene).model), base, options).untried.empty());
}

}  // namespace
}  // namespace flexframe::sim::test_histories
