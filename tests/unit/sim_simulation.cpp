// Simulations that are driven step by step: inputs, states to come back to, forces of the user's, errors.
#include "mechanism_text.h"

#include "sim/simulation.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_simulation {
namespace {

// A block on a spring along z, pushed by an input.
std::string block(const std::string& more = "") {
  return head(1.0, Vec3(0, 0, 0), 100) + "[[input]]\nname = \"push\"\nvalue = 2\n" +
         "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 2\ninertia = [1, 1, 1]\nframes = { side = [0.5, 0, 0] }\n" +
         joint("slide", "prismatic", "ground", "block", "spring = { stiffness = 50 }" + more) +
         "[[force]]\nname = \"motor\"\nkind = \"force\"\non = \"block\"\ndirection = [0, 0, 1]\nvalue = \"3*push + 0*t\"\n" +
         output("z", "slide", "value") + output("v", "slide", "rate") + output("a", "block", "acceleration");
}

Scene scene_of(const std::string& text) { return parse_scene(text, "mechanism.toml"); }

TEST(Simulation, FollowsItsInput) {
  DriveOptions options;
  options.tolerance = 1e-10;
  Simulation sim(scene_of(block()), options);
  EXPECT_EQ(sim.input("push"), 2.0);
  const double omega = 5.0;
  // z'' + 25 z = 1.5 push, push held piecewise: the closed solution from step to step.
  double z = 0.0, v = 0.0;
  for (int k = 0; k < 40; ++k) {
    const double push = k % 3 == 0 ? 2.0 : 1.0 - 0.1 * k, h = k % 2 == 0 ? 0.03 : 0.011;
    sim.set_input("push", push);
    sim.step(h);
    const double rest = 1.5 * push / 25.0, c = std::cos(omega * h), s = std::sin(omega * h), before = z;
    z = rest + (z - rest) * c + v / omega * s;
    v = -(before - rest) * omega * s + v * c;
    EXPECT_NEAR(sim.output("z"), z, 1e-8) << k;
    EXPECT_NEAR(sim.output("v"), v, 1e-7) << k;
    EXPECT_NEAR(sim.output("a.z"), 1.5 * push - 25.0 * z, 1e-6) << k;
  }
}

// Without a hand on the input the scene is the plain run.
TEST(Simulation, IsTheRunOfTheScene) {
  const Results r = run(block(), 1e-10);
  DriveOptions options;
  options.tolerance = 1e-10;
  Simulation sim(scene_of(block()), options);
  for (Eigen::Index i = 1; i < r.times.size(); ++i) {
    sim.advance_to(r.times[i]);
    EXPECT_NEAR(sim.output("z"), column(r, "z")[i], 1e-8);
  }
}

// A loop with elastic rod, friction and a stop: what follows a state depends on the state alone.
TEST(Simulation, ComesBackToTheSameBits) {
  const Scene scene = scene_of(block("\nfriction = { coefficient = 0.1, normal_force = 10 }\nstop = { upper = 0.15, stiffness = 1e4 }"));
  Simulation sim(scene);
  const auto drive = [](Simulation& s, int from, int to) {
    std::vector<double> out;
    for (int k = from; k < to; ++k) {
      s.set_input("push", 3.0 * std::sin(0.3 * k));
      s.step(0.01);
      for (const double x : s.outputs()) out.push_back(x);
    }
    return out;
  };
  drive(sim, 0, 30);
  const Simulation::State middle = sim.state();
  const std::vector<double> first = drive(sim, 30, 90);
  sim.restore(middle);
  EXPECT_EQ(sim.time(), middle.time());
  EXPECT_EQ(drive(sim, 30, 90), first);
  Simulation other(scene);
  other.restore(middle);
  EXPECT_EQ(drive(other, 30, 90), first);
  // Not stopped on the way: the same.
  Simulation straight(scene);
  drive(straight, 0, 30);
  EXPECT_EQ(drive(straight, 30, 90), first);
}

TEST(Simulation, TakesForcesOfTheUser) {
  // A spring and damper in the user's hand instead of the scene's, and a torque that nothing resists along the slide.
  DriveOptions options;
  options.tolerance = 1e-10;
  int calls = 0;
  options.forces.push_back({"block.side", [&calls](const FrameMoment& f) {
                              ++calls;
                              EXPECT_NEAR(f.position.x(), 0.5, 1e-12);
                              return UserWrench{Vec3(0, 0, -30.0 * f.position.z() - 4.0 * f.velocity.z()), Vec3(1, 2, 3)};
                            }});
  Simulation sim(scene_of(block()), options);
  sim.set_input("push", 0.0);
  sim.step(1e-9);
  sim.set_input("push", 4.0);
  const double k = 80.0, m = 2.0, c = 4.0, rest = 12.0 / k, a = c / (2 * m), w = std::sqrt(k / m - a * a);
  for (int i = 1; i <= 20; ++i) {
    sim.advance_to(0.05 * i);
    const double t = 0.05 * i;
    EXPECT_NEAR(sim.output("z"), rest * (1 - std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t))), 2e-8);
  }
  EXPECT_GT(calls, 100);
}

TEST(Simulation, StaysUsableAfterErrors) {
  DriveOptions options;
  double limit = 0.2;
  options.forces.push_back({"block", [&limit](const FrameMoment& f) {
                              if (f.t > limit) throw SimulationError("the user's patience ended");
                              return UserWrench{};
                            }});
  Simulation sim(scene_of(block()), options);
  for (int k = 0; k < 10; ++k) sim.step(0.015);
  const double z = sim.output("z"), t = sim.time();
  EXPECT_THROW(sim.step(0.2), SimulationError);
  EXPECT_EQ(sim.time(), t);
  EXPECT_EQ(sim.output("z"), z);
  limit = 10.0;
  sim.step(0.2);
  Simulation straight(scene_of(block()));
  straight.advance_to(t);
  EXPECT_NEAR(straight.output("z"), z, 1e-6);

  EXPECT_THROW(sim.step(0.0), ArgumentError);
  EXPECT_THROW(sim.step(std::nan("")), ArgumentError);
  EXPECT_THROW(sim.advance_to(0.1), ArgumentError);
  EXPECT_THROW(sim.set_input("push", std::nan("")), ArgumentError);
  EXPECT_THROW(sim.restore({}), ArgumentError);
  try {
    sim.set_input("pusj", 1.0);
    FAIL();
  } catch (const ArgumentError& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean 'push'"), std::string::npos) << error.what();
  }
  EXPECT_THROW(sim.output("y"), ArgumentError);
  EXPECT_THROW(Simulation(scene_of(block()), {.tolerance = 1.0, .method = {}, .forces = {}, .progress = {}}), ArgumentError);
  EXPECT_THROW(
      Simulation(
          scene_of(block()),
          {.tolerance = {}, .method = {}, .forces = {{"block.top", [](const FrameMoment&) { return UserWrench{}; }}}, .progress = {}}),
      InputError);
}

TEST(Inputs, WrongOnesAreAnswered) {
  const auto refused = [](const std::string& from, const std::string& to, const std::string& words) {
    std::string text = block();
    text.replace(text.find(from), from.size(), to);
    try {
      scene_of(text);
      ADD_FAILURE() << to;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  refused("name = \"push\"", "name = \"sin\"", "is no name for an input");
  refused("name = \"push\"", "name = \"2u\"", "is no name for an input");
  refused("3*push", "3*puhs", "is no expression of t");
  refused("value = 2\n", "valeu = 2\n", "key 'valeu' is unknown");
  refused("[[input]]\n", "[[input]]\nname = \"push\"\n[[input]]\n", "is already the name of the input");
  // An input has its value in the text of results, and a parameter keeps its own.
  EXPECT_EQ(scene_of(block()).forces[0].value, "3*(2) + 0*t");
}

TEST(Errors, AreOneFamily) {
  EXPECT_THROW(scene_of("x = 1"), flexframe::Error);
  EXPECT_THROW(scene_of("x = 1"), flexframe::InputError);
}

}  // namespace
}  // namespace flexframe::sim::test_simulation
