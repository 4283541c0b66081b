// Clusters of few independent rates: their accelerations by the twists of their parts against those by composite bodies, in the plane and
// in space, with loops, prescribed motions, deformation and friction. Power of prescribed motions against the rate of the energy.
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/few_rates.h"
#include "sim/dynamics/plane_work.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/scene/scene_reader.h"
#include "sim/start/make_system.h"
#include "sim/time/system.h"
#include "tests/unit/mechanism_text.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_few_rates {
namespace {

// A state that moves and is deformed, near the start.
VecX disturbed(const System& system, const VecX& start) {
  VecX y = start;
  const Model& model = system.model;
  for (const Part& p : model.parts)
    for (int k = 0; k < p.body.n; ++k) y[p.eq0 + k] += 1e-4 * model.size * std::sin(1.0 + k);
  for (Eigen::Index k = model.nq; k < y.size(); ++k) y[k] += 0.3 * std::cos(2.0 + static_cast<double>(k));
  return y;
}

// Accelerations and reduced mass matrices by composites of the state that `work` is in.
template <class W>
void expect_same_by_composites(const System& system, W& work) {
  const Model& model = system.model;
  const VecX few = work.wdot;
  std::vector<MatX> mass(model.clusters.size());
  bool any = false;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    if (!work.clusters[c].whole) any = true, reduced_mass(work.clusters[c], mass[c]);
  ASSERT_TRUE(any) << "no cluster was solved by its parts' twists";
  update_accelerations(model, work);
  EXPECT_LT((work.wdot - few).norm(), 1e-10 * (1.0 + few.norm()));
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    if (mass[c].size() == 0) continue;
    EXPECT_TRUE(work.clusters[c].whole);
    MatX D;
    reduced_mass(work.clusters[c], D);
    EXPECT_LT((D - mass[c]).norm(), 1e-12 * D.norm());
  }
}

void expect_same(const Scene& scene) {
  System system = make_system(scene);
  const VecX start = pack_state(system, Eigen::Vector2d::Zero());
  for (const VecX& y : {start, disturbed(system, start)}) {
    VecX dy(y.size());
    state_rate(system, 0.1, y.data(), dy.data());
    if (!system.plane) {
      expect_same_by_composites(system, system.work);
      continue;
    }
    PlaneWork work(system.work, *system.plane);
    expect_same_by_composites(system, work);
  }
}

class FewRates : public testing::TestWithParam<const char*> {};

TEST_P(FewRates, AccelerateAsCompositesDo) {
  expect_same(read_scene(std::string(FLEXFRAME_SOURCE_DIR) + "/examples/" + GetParam() + ".toml"));
}

INSTANTIATE_TEST_SUITE_P(Examples, FewRates,
                         testing::Values("engine", "dlr_slider_crank", "mechanisms/conical_pendulum", "mechanisms/top",
                                         "mechanisms/tapered_cantilever"));

// What hangs on a driven rotor: its base accelerates.
TEST(FewRatesOnARotor, AreCarried) {
  expect_same(parse_scene(head(1.0, Vec3(0, 0, -9.81)) + rod("rotor") + rod("bob") +
                              joint("spin", "revolute", "ground", "rotor", "axis = [0, 0, 1]\nmotion = \"3*t + sin(2*t)\"") +
                              joint("ball", "spherical", "rotor.tip", "bob.tip", ""),
                          "carried.toml"));
}

// In space two parts on ground, held `length` apart, one of which follows the other: a slider on a spring beside a crank.
std::string crank_and_slider(const std::string& motion) {
  return head(1.0, Vec3(0, 0, -9.81)) + rod("crank") + rod("slider") +
         "[[body]]\nname = \"bob\"\nkind = \"rigid\"\nmass = 0.3\ninertia = [0.01, 0.02, 0.03]\ncentre_of_mass = [0.1, 0, 0.05]\n" +
         joint("shaft", "revolute", "ground", "crank", "axis = [0, 0, 1]\n" + motion) +
         joint("hinge", "revolute", "crank.tip", "bob", "axis = [0, 1, 0]") +
         joint("guide", "prismatic", "ground", "slider",
               "axis = [1, 0, 0.4]\nspring = { stiffness = 50, damping = 3 }\ninitial = { guess = 2 }") +
         joint("bar", "distance", "bob", "slider.tip", "length = 2.5");
}
TEST(FewRatesInSpace, FollowOnGround) {
  System system = make_system(parse_scene(crank_and_slider(""), "follower.toml"));
  ASSERT_FALSE(system.plane);
  expect_same(parse_scene(crank_and_slider(""), "follower.toml"));
}

// What loads and prescribed motions feed in less what is lost, against the rate at which the energy of the bodies changes: its difference
// along the motion.
void expect_balance(const Scene& scene, double t, double least_power) {
  System system = make_system(scene);
  ASSERT_TRUE(system.quadrature && system.driven);
  const VecX y = disturbed(system, pack_state(system, Eigen::Vector2d::Zero()));
  const Eigen::Index n = y.size() - 2;
  const double h = 1e-6;
  VecX dy(y.size());
  // The state as it stands once its loops are closed, with the guesses of their coordinates put right.
  set_state(system, t, y.data(), false);
  VecX at = y;
  at.head(system.model.nq) = system.work.q;
  state_rate(system, t, at.data(), dy.data());
  const double net = dy[n] - dy[n + 1];
  const auto energy = [&](double s) {
    const VecX beside = at + s * dy;
    set_state(system, t + s, beside.data(), false);
    const Energy e = compute_energy(system.model, system.work);
    return e.kinetic + e.strain + e.potential;
  };
  EXPECT_GT(std::abs(net), least_power);
  EXPECT_NEAR((energy(h) - energy(-h)) / (2.0 * h), net, 1e-5 * (std::abs(dy[n]) + std::abs(dy[n + 1])));
}

// By the twists of the parts, in the plane and in space.
TEST(MotionPower, OfALoopInThePlane) {
  expect_balance(read_scene(std::string(FLEXFRAME_SOURCE_DIR) + "/examples/dlr_slider_crank.toml"), 0.1, 1e-3);
}
TEST(MotionPower, OfARotorThatCarriesABob) {
  const std::string bob = head(1.0, Vec3(0, 0, -9.81)) + rod("rotor") + rod("bob") +
                          joint("spin", "revolute", "ground", "rotor", "axis = [0, 0, 1]\nmotion = \"3*t + sin(2*t)\"") +
                          joint("ball", "spherical", "rotor.tip", "bob.tip", "");
  expect_balance(parse_scene(bob, "carried.toml"), 0.1, 1e-3);
}
TEST(MotionPower, OfALoopInSpace) {
  expect_balance(parse_scene(crank_and_slider("motion = \"0.2 + 3*t + sin(2*t)\""), "follower.toml"), 0.1, 1e-3);
}
// By the wrenches on the rotor: of links, of what hangs on these, a flexible body with many coordinates among them.
TEST(MotionPower, OfARotorThatCarriesLinks) {
  const std::string links = head(1.0, Vec3(0, 0, -9.81)) + rod("rotor") + rod("arm") + rod("hand") + rod("other") +
                            joint("spin", "revolute", "ground", "rotor", "axis = [0, 0, 1]\nmotion = \"3*t + sin(2*t)\"") +
                            joint("flap", "revolute", "rotor.tip", "arm", "axis = [0, 1, 0]\nspring = { stiffness = 5, damping = 0.3 }") +
                            joint("wrist", "revolute", "arm.tip", "hand", "axis = [0, 0, 1]") +
                            joint("back", "revolute", "rotor", "other", "axis = [0, 1, 1]");
  expect_balance(parse_scene(links, "links.toml"), 0.1, 1e-3);
}
TEST(MotionPower, OfABlade) { expect_balance(read_scene(std::string(FLEXFRAME_SOURCE_DIR) + "/examples/beams/blade.toml"), 6.0, 1e-3); }
// By the accelerations of the parts: clusters that carry one another; a drive on what moves.
TEST(MotionPower, OfADriveOnWhatMoves) {
  const std::string driven = head(1.0, Vec3(0, -9.81, 0)) + rod("arm") + rod("hand") + rod("finger") +
                             joint("shoulder", "revolute", "ground", "arm", "axis = [0, 0, 1]") +
                             joint("elbow", "revolute", "arm.tip", "hand", "axis = [0, 0, 1]\nmotion = \"3*t + sin(2*t)\"") +
                             joint("knuckle", "revolute", "hand.tip", "finger", "axis = [0, 0, 1]");
  expect_balance(parse_scene(driven, "driven.toml"), 0.1, 1e-3);
}
// Deformation closes the loop: a beam held at both ends on a carriage.
TEST(MotionPower, WhereDeformationClosesALoop) {
  const std::string held = R"(
[[body]]
name = "carriage"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
frames = { far = [1, 0, 0] }
[[body]]
name = "beam"
kind = "beam"
length = 1
section = { shape = "circle", diameter = 0.02 }
material = { density = 2700, youngs_modulus = 7e9 }
model = "modal"
modes = { bending_xy = [1, 2, 3], axial = [1] }
boundary = "clamped-free"
effects = ["bending_xy", "axial"]
)";
  expect_balance(parse_scene(head(1.0, Vec3(0, -9.81, 0)) + held +
                                 joint("way", "prismatic", "ground", "carriage", "axis = [0, 1, 0]\nmotion = \"0.1*sin(5*t)\"") +
                                 joint("clamp", "weld", "carriage", "beam.root", "") +
                                 joint("pin", "revolute", "carriage.far", "beam.tip", "axis = [0, 0, 1]"),
                             "held.toml"),
                 0.1, 1e-3);
}

}  // namespace
}  // namespace flexframe::sim::test_few_rates
