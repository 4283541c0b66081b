// Loops stay in the way in which they are assembled: beside a change point, from a guess in the other assembly, and through a change point.
#include "sim/run/lost_loops.h"
#include "sim/start/make_system.h"
#include "sim/time/assembly_gap.h"
#include "tests/unit/mechanism_text.h"

#include <gtest/gtest.h>

#include <array>
#include <map>

namespace flexframe::sim::test_assembly_gap {
namespace {

const std::vector<Method> methods = {Method::dirk, Method::erk, Method::adams, Method::bdf, Method::ida, Method::exponential};

std::string bar(const std::string& name, double mass, double inertia, const Vec3& centre, double length) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = {}\ninertia = [{}, {}, {}]\ncentre_of_mass = {}\nframes = {{ tip = [{}, 0, 0] "
      "}}\n",
      name, mass, inertia, inertia, inertia, list(centre), length);
}

// Crank a and rocker c of one length, a coupler b of 1 m and a base, from the crank's angle and one of the places where the coupler meets
// the rocker: that on the left of the line from the crank's end to the rocker's foot, or that on its right (side = -1).
struct FourBar {
  double base, arm, crank, side;
  std::map<std::string, double> angles() const {
    const Vec3 b(arm * std::cos(crank), arm * std::sin(crank), 0.0), foot(base, 0.0, 0.0), d = foot - b;
    const double along = 0.5 * (d.squaredNorm() + 1.0 - arm * arm) / d.norm(), across = side * std::sqrt(1.0 - along * along);
    const Vec3 at_b = along * d.normalized() + across * Vec3(-d.y(), d.x(), 0.0).normalized(), at_c = b + at_b - foot;
    const double coupler = std::atan2(at_b.y(), at_b.x()), rocker = std::atan2(at_c.y(), at_c.x());
    return {{"ja", crank}, {"jb", coupler - crank}, {"jc", rocker}, {"jd", coupler - rocker}};
  }
  std::string scene() const {
    const std::map<std::string, double> q = angles();
    const auto start = [&](const char* name) { return fmt::format("initial = {{ value = {:.17g} }}", q.at(name)); };
    return head(1.0, Vec3::Zero()) + bar("a", 1, 0.1, {0.5 * arm, 0, 0}, arm) + rod("b") + bar("c", 1, 0.1, {0.5 * arm, 0, 0}, arm) +
           joint("ja", "revolute", "ground", "a", start("ja")) + joint("jb", "revolute", "a.tip", "b", start("jb")) +
           joint("jc", "revolute", "ground", "c", fmt::format("position = [{}, 0, 0]\n", base) + start("jc")) +
           joint("jd", "revolute", "c.tip", "b.tip", start("jd"));
  }
  // The state of a system of such a four-bar at rest in this place.
  VecX state(const System& system) const {
    VecX y = VecX::Zero(state_size(system));
    const std::map<std::string, double> q = angles();
    for (const Part& p : system.model.parts)
      if (p.joint.nq == 1) y[p.q0] = q.at(p.joint.name);
    return y;
  }
};

bool crosses(System& system, const VecX& y) {
  VecX rates(y.size());
  state_rate(system, 0.0, y.data(), rates.data());
  return any_crossed(system);
}

TEST(AssemblyGap, ClosingInAnotherAssemblyIsSeen) {
  for (const double side : {1.0, -1.0}) {
    const FourBar here{1.5, 1.0, 1.2, side}, beside{1.5, 1.0, 1.25, side}, other{1.5, 1.0, 1.25, -side};
    System system = make_system(parse_scene(here.scene(), "four_bar.toml"));
    const VecX from = here.state(system), near = beside.state(system), far = other.state(system);
    EXPECT_FALSE(crosses(system, from));
    EXPECT_FALSE(crosses(system, near));
    EXPECT_TRUE(leads_on(system, 0, {0.0, from.data()}, {0.0, near.data()}));
    EXPECT_TRUE(crosses(system, far));
    EXPECT_FALSE(leads_on(system, 0, {0.0, from.data()}, {0.0, far.data()}));
  }
}

// A parallelogram lies flat where its crank does. Below the base its rocker's tip is on the other side than above.
TEST(AssemblyGap, AParallelogramGoesThroughItsChangePoint) {
  const FourBar before{1.0, 0.5, -0.2, -1.0}, after{1.0, 0.5, 0.3, 1.0};
  System system = make_system(parse_scene(before.scene(), "parallelogram.toml"));
  EXPECT_NEAR(before.angles().at("jc"), -0.2, 1e-12);
  EXPECT_NEAR(after.angles().at("jc"), 0.3, 1e-12);
  const VecX from = before.state(system), over = after.state(system);
  EXPECT_FALSE(crosses(system, from));
  EXPECT_TRUE(crosses(system, over));
  EXPECT_TRUE(leads_on(system, 0, {0.0, from.data()}, {0.0, over.data()}));

  const std::string turning = head(3.0, Vec3(0, -9.81, 0)) + rod("a") + rod("b") + rod("c") +
                              joint("ja", "revolute", "ground", "a", "initial = { value = 1, rate = 8 }") +
                              joint("jb", "revolute", "a.tip", "b", "initial = { guess = -1 }") +
                              joint("jc", "revolute", "ground", "c", "position = [1, 0, 0]\ninitial = { guess = 1 }") +
                              joint("jd", "revolute", "c.tip", "b.tip", "") + output("a", "ja", "value") + output("c", "jc", "value");
  for (const Method method : methods) {
    const Results r = run(turning, 1e-3, method);
    EXPECT_LT((column(r, "a") - column(r, "c")).cwiseAbs().maxCoeff(), 1e-9) << method_name(method);
    EXPECT_GT(last(r, "a"), 10.0) << method_name(method);
  }
}

// A crank-rocker of Grashof's (the crank and the base are shorter than the others together, by a half of a per cent of the crank): its
// coupler and rocker never come into line. At loose tolerances steps of the explicit method went over into its mirror image.
TEST(AssemblyGap, ACrankRockerBesideAChangePointKeepsItsAssembly) {
  const std::string scene =
      head(1.003, Vec3::Zero(), 600) + bar("crank", 1.998, 0.679, {0.69, -0.0527, 0}, 1.475778510406556) +
      bar("coupler", 1.3905, 0.434, {1.2732, -0.00936, 0}, 3.0701475837251078) +
      bar("rocker", 0.5164, 0.9894, {1.296, -0.267, 0}, 3.0153029994742866) +
      joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.8362196254570257, rate = 6.624497053567014 }") +
      joint(
          "hinge", "revolute", "ground", "rocker",
          "position = [4.532303583669983, -0.7960716179483124, 0]\ninitial = { value = -2.7715963968768413, rate = -2.7066950531741814 }") +
      joint("top", "revolute", "rocker.tip", "coupler.tip", "initial = { value = 1.4415020765439972, rate = 4.150139740870664 }") +
      joint("pin", "revolute", "coupler", "crank.tip", "initial = { value = 2.1663139457898697, rate = 5.181052365870531 }") +
      output("between", "top", "value");
  for (const double tolerance : {1e-2, 1e-3})
    for (const Method method : methods) {
      const VecX between = column(run(scene, tolerance, method), "between");
      EXPECT_GT((between.array().sin() * std::sin(between[0])).minCoeff(), 0.0) << method_name(method) << " " << tolerance;
    }
}

// A four-bar beside a change point, let go from rest. At 1e-2 steps of BDF went to where its loop cannot be closed, and the run ended at
// 0.19 s with "the limit of its reach"; the motion has none: it is that of a tight run by
// another method.
TEST(AssemblyGap, ALooseRunThatLosesItsLoopIsMadeAgain) {
  const std::string scene =
      head(0.3, Vec3(-1.70059, 7.016655, 0), 400) +
      bar("b0", 3.420952839438412, 0.0005780293557073455, {0.019736289961233888, -0.003845355299053434, 0}, 0.042103671234240456) +
      bar("b1", 0.6395535672211708, 0.00020034628298144802, {0.03072893407454335, 0.004999162503750847, 0}, 0.05237413171277261) +
      bar("b2", 0.24683629900787527, 8.127793197276808e-05, {0.04520087577654668, -0.007694812572700388, 0}, 0.08878986601869218) +
      joint("j0", "revolute", "ground", "b0", "initial = { value = -1.8534311857221737, rate = 0 }") +
      joint("j1", "revolute", "b0.tip", "b1", "initial = { value = -0.9006595536625794, rate = 0 }") +
      joint("j2", "revolute", "b1.tip", "b2.tip", "initial = { value = -0.8186925892334722, rate = 0 }") +
      joint("j3", "revolute", "ground", "b2",
            "position = [0.020429755007031848, -0.09733410141752674, 0]\ninitial = { value = 2.710401978561361, rate = 0 }") +
      output("turn", "j0", "value");
  const Results loose = run(scene, 1e-2, Method::bdf), tight = run(scene, 1e-9, Method::erk);
  EXPECT_LT(loose.statistics.tolerance, 1.1e-3);
  EXPECT_TRUE(loose.statistics.notes.texts(Severity::note).size() > tight.statistics.notes.texts(Severity::note).size());
  const VecX a = column(loose, "turn"), b = column(tight, "turn");
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 0.1 * (b.maxCoeff() - b.minCoeff()));
}

// What the exponential method loses that "auto" took is made again from its start by steps over the vibrations, at the same tolerance; what
// these lose too, or a method that was asked for, ends the run.
TEST(AssemblyGap, WhatFollowingLosesIsMadeAgainByStepping) {
  struct Made {
    SolverStatistics statistics;
  };
  const auto made = [](double tolerance, bool followed, bool stepping_loses) {
    std::vector<std::pair<double, bool>> runs;
    std::string notes = "ended";
    try {
      const Made out = with_kept_loops(tolerance, [&](std::optional<double> at, bool stepping) {
        runs.emplace_back(*at, stepping);
        if (!stepping || stepping_loses) throw LoopsLost("joint 'w' cannot be closed", *at, followed && !stepping);
        return Made{};
      });
      notes = out.statistics.notes.texts(Severity::note).at(0);
    } catch (const LoopsLost&) {}
    return std::pair{runs, notes};
  };
  using Runs = std::vector<std::pair<double, bool>>;
  const auto [runs, note] = made(1e-6, true, false);
  EXPECT_EQ(runs, (Runs{{1e-6, false}, {1e-6, true}}));
  EXPECT_NE(note.find("method dirk"), std::string::npos) << note;
  EXPECT_EQ(made(1e-6, true, true).first, (Runs{{1e-6, false}, {1e-6, true}}));
  EXPECT_EQ(made(1e-6, true, true).second, "ended");
  EXPECT_EQ(made(1e-6, false, false).first, (Runs{{1e-6, false}}));
  EXPECT_EQ(made(1e-3, true, false).first.size(), 3u);
}

// Four-bars in the vertical plane whose assemblies nothing connects: links of 1, 2 and 1.5 kg, a spring on the crank, a force on the
// coupler's end. Truth: the crank goes downhill in steps of 1e-4 rad, the coupler on its side of the line to the rocker's foot.
struct HeldFourBar {
  std::array<double, 4> links;                             // crank, coupler, rocker, base
  double crank, coupler, rocker, stiffness, rest, fx, fy;  // guesses of the joints; spring; force
  std::string scene() const {
    const auto link = [&](const std::string& name, double mass, double length) {
      return bar(name, mass, mass * length * length / 12 + 0.001, {0.5 * length, 0, 0}, length);
    };
    const auto guess = [](double angle) { return fmt::format("initial = {{ guess = {} }}", angle); };
    return head(0.1, Vec3(0, -9.81, 0)) + "start = \"static\"\n" + link("a", 1.0, links[0]) + link("b", 2.0, links[1]) +
           link("c", 1.5, links[2]) +
           joint("ja", "revolute", "ground", "a",
                 fmt::format("{}\nspring = {{ stiffness = {}, rest = {} }}", guess(crank), stiffness, rest)) +
           joint("jb", "revolute", "a.tip", "b", guess(coupler)) +
           joint("jc", "revolute", "ground", "c", fmt::format("position = [{}, 0, 0]\n{}", links[3], guess(rocker))) +
           joint("jd", "revolute", "b.tip", "c.tip", "") +
           fmt::format("[[force]]\nkind = \"force\"\non = \"b.tip\"\ndirection = [{}, {}, 0]\nvalue = {}\n", fx, fy, std::hypot(fx, fy)) +
           output("turn", "ja", "value");
  }
  double energy(double angle, double side) const {
    const Vec3 a(links[0] * std::cos(angle), links[0] * std::sin(angle), 0.0), foot(links[3], 0.0, 0.0), d = foot - a;
    const double along = 0.5 * (d.squaredNorm() + links[1] * links[1] - links[2] * links[2]) / d.norm();
    const double across = side * std::sqrt(links[1] * links[1] - along * along);
    const Vec3 b = a + along * d.normalized() + across * Vec3(-d.y(), d.x(), 0.0).normalized();
    return 9.81 * (0.5 * a.y() + a.y() + b.y() + 0.75 * b.y()) - fx * b.x() - fy * b.y() + 0.5 * stiffness * std::pow(angle - rest, 2);
  }
  double downhill() const {
    const double turn = crank + coupler;
    const Vec3 a(links[0] * std::cos(crank), links[0] * std::sin(crank), 0.0), d = Vec3(links[3], 0.0, 0.0) - a;
    const double side = d.x() * std::sin(turn) - d.y() * std::cos(turn) > 0.0 ? 1.0 : -1.0;
    double angle = crank;
    const double step = energy(crank + 1e-4, side) < energy(crank - 1e-4, side) ? 1e-4 : -1e-4;
    while (energy(angle + step, side) < energy(angle, side)) angle += step;
    return angle;
  }
};

TEST(AssemblyGap, AStaticStartStaysInItsAssembly) {
  for (const HeldFourBar& held :
       {HeldFourBar{{0.6231, 0.6686, 0.8747, 0.9189}, 2.2931, -3.1124, -3.1176, 38.1829, -0.8709, 54.659, -19.0639},
        {{0.4237, 0.5674, 0.6378, 0.2812}, 0.0133, -5.0962, 0.9939, 22.5073, 0.0377, 34.7917, -5.8822},
        {{0.9474, 0.5104, 0.8573, 0.3982}, -0.1076, 1.1904, 0.4194, 25.5233, 0.3777, 5.3185, 0.144}})
    EXPECT_NEAR(last(run(held.scene(), 1e-6), "turn"), held.downhill(), 2e-4) << held.crank;
}

}  // namespace
}  // namespace flexframe::sim::test_assembly_gap
