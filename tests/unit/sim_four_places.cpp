// Samples of a run that are placed four at a time: histories of places against what a whole run records one by one, and what falls back.
// (sim_planar.cpp compares the places of all of its mechanisms.)
#include "mechanism_text.h"
#include "sim/dynamics/closure.h"
#include "sim/run/histories_run.h"
#include "sim/start/make_system.h"
#include "sim/time/sample_state.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_four_places {
namespace {

std::string elastic(const std::string& name, double length, const std::string& effects = "\"bending_xy\", \"stiffening\"") {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = {}\nsection = {{ shape = \"circle\", diameter = 0.01 }}\n"
      "material = {{ density = 2770.0, youngs_modulus = 1e9 }}\nelements = 4\nkeep_modes = 2\nframes = {{ middle = 0.5 }}\n"
      "effects = [{}]\n",
      name, length, effects);
}

std::string slider_crank(const std::string& shaft) {
  return elastic("crank", 0.15) + elastic("rod", 0.3) + "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 0.05\ninertia = [0, 0, 0]\n" +
         joint("shaft", "revolute", "ground", "crank.root", shaft) + joint("crank_pin", "revolute", "crank.tip", "rod.root", "") +
         joint("wrist_pin", "revolute", "rod.tip", "block", "") + joint("guide", "prismatic", "ground", "block", "axis = [1, 0, 0]");
}

const std::string& places() {
  static const std::string text = output("slider", "block", "position") + output("middle", "rod.middle", "displacement") +
                                  output("turn", "crank.middle", "rotation") + output("pin", "crank_pin", "value") +
                                  output("guide", "guide", "value");
  return text;
}

// What simulate records one by one against the same run's histories of places; both by the same steps, but where work is supplied: what
// samples leave behind counts among the sizes against which its error is measured.
void compare_runs(const std::string& text, Method method, double apart = 1e-12) {
  SCOPED_TRACE(fmt::format("method {}, {}", static_cast<int>(method), text));
  const Results whole = run(text, 1e-5, method);
  SimulateOptions options;
  options.tolerance = 1e-5;
  options.method = method;
  options.estimate_error = false;
  const Histories four = simulate_histories(parse_scene(text, "mechanism.toml"), options);
  ASSERT_EQ(four.statistics.evaluations, whole.statistics.evaluations);
  int moving = 0;
  for (size_t k = 0; k < four.columns.size(); ++k) {
    const VecX &a = column(whole, four.columns[k]), b = four.values.row(static_cast<Eigen::Index>(k)).transpose();
    EXPECT_LE((a - b).cwiseAbs().maxCoeff(), apart * (1.0 + a.cwiseAbs().maxCoeff())) << four.columns[k];
    moving += a.maxCoeff() > a.minCoeff();
  }
  EXPECT_GE(moving, 4);
}

TEST(FourPlaces, HistoriesAreThoseOfSamplesOneByOne) {
  const std::string free = "initial = { value = 0.4, rate = 8 }", driven = "motion = \"0.4 + 8*t + 0.1*sin(9*t)\"";
  for (const Method method : {Method::exponential, Method::erk, Method::dirk})
    for (const std::string& shaft : {free, driven})
      compare_runs(head(0.2, Vec3(1.0, -9.81, 0.0), 777) + slider_crank(shaft) + places(), method, shaft == free ? 1e-12 : 1e-6);
  // In another plane of the world, and in a tree.
  compare_runs(head(0.3, Vec3(0.0, 0.0, -9.81), 500) + elastic("arm", 0.4) +
                   joint("base", "revolute", "ground", "arm.root", "axis = [0, 0, 1]\nrotation = [1.5707963267948966, 0, 0]") +
                   output("tip", "arm.tip", "position") + output("bent", "arm.tip", "displacement"),
               Method::exponential);
}

System system_of(const std::string& text) { return make_system(parse_scene(text, "mechanism.toml")); }

bool fit(const System& system, const std::vector<int>& frames = {}) {
  return has_plane_samples(system) && FourPlaces::fit(system.model, *system.plane, frames);
}

TEST(FourPlaces, OneThatDoesNotCloseLeavesAllFourToBePlacedOneByOne) {
  const std::string text = head(0.1, Vec3(0.0, -9.81, 0.0)) + rod("left") + rod("coupler") + rod("right") +
                           joint("g1", "revolute", "ground", "left", "initial = { value = 1.2 }") +
                           joint("p1", "revolute", "left.tip", "coupler", "") + joint("p2", "revolute", "coupler.tip", "right.tip", "") +
                           joint("g2", "revolute", "ground", "right", "position = [1.4, 0, 0]");
  System system = system_of(text);
  ASSERT_TRUE(fit(system));
  FourPlaces four(system.model, system.work, *system.plane, {});
  const VecX y = pack_state(system, Eigen::Vector2d::Zero());
  MatX states = y.transpose().replicate(4, 1);
  const double times[4] = {};
  EXPECT_TRUE(place_four_samples(system, times, states, four));
  // The independent coordinate goes where the links do not reach; and one that is no number.
  ASSERT_EQ(system.work.clusters[0].partition.ind.size(), 1u);
  const int q = system.model.parts[static_cast<size_t>(system.work.clusters[0].partition.ind[0])].q0;
  states(2, q) += 2.2;
  EXPECT_FALSE(place_four_samples(system, times, states, four));
  const VecX far = states.row(2).transpose();
  EXPECT_THROW(place_plane_sample(system, 0.0, far.data(), {}, false), SimulationError);
  states(2, q) = std::nan("");
  EXPECT_FALSE(place_four_samples(system, times, states, four));
  states(2, q) = y[q];
  EXPECT_TRUE(place_four_samples(system, times, states, four));
}

TEST(FourPlaces, WhatElseClosesLoopsIsPlacedOneByOne) {
  const std::string beginning = head(0.1, Vec3(0.0, -9.81, 0.0));
  // A gear between two wheels.
  EXPECT_FALSE(fit(system_of(beginning + rod("one") + rod("two") + joint("a", "revolute", "ground", "one", "") +
                             joint("b", "revolute", "ground", "two", "position = [0, 2, 0]") +
                             "[[coupling]]\nname = \"gear\"\nkind = \"gear\"\njoints = [\"a\", \"b\"]\nratio = -2\n")));
  // A beam held at both ends: its deformation closes the loop.
  System held = system_of(beginning + elastic("rod", 0.3, "\"bending_xy\", \"axial\"") + joint("a", "revolute", "ground", "rod.root", "") +
                          joint("b", "revolute", "ground", "rod.tip", "position = [0.3, 0, 0]"));
  ASSERT_TRUE(fit(held));
  ASSERT_TRUE(deformation_closes(held.model, held.work.clusters[0].partition, 0));
  FourPlaces four(held.model, held.work, *held.plane, {});
  const MatX states = pack_state(held, Eigen::Vector2d::Zero()).transpose().replicate(4, 1);
  const double times[4] = {};
  EXPECT_FALSE(place_four_samples(held, times, states, four));
}

}  // namespace
}  // namespace flexframe::sim::test_four_places
