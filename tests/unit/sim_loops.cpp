// Loops in which the joint that closes them has coordinates of its own to look after: motion, stop, friction, screw, springs, given values.
// It must not matter which joint of a loop that is, nor how the loop is written down.
#include "mechanism_text.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_loops {
namespace {

// Four-bar of unit rods on a base of 1 m; `more` per joint, in the order of `order`.
std::string four_bar(const std::vector<std::string>& more, const std::vector<int>& order, const std::string& start = "") {
  const std::vector<std::string> joints = {joint("ja", "revolute", "ground", "a", "rotation = [0, 0, 1]\n" + start + more[0]),
                                           joint("jb", "revolute", "a.tip", "b", "rotation = [0, 0, -1]\n" + more[1]),
                                           joint("jc", "revolute", "ground", "c", "position = [1, 0, 0]\nrotation = [0, 0, 1]\n" + more[2]),
                                           joint("jd", "revolute", "c.tip", "b.tip", "rotation = [0, 0, -1]\n" + more[3])};
  std::string scene = rod("a") + rod("b") + rod("c");
  for (int k : order) scene += joints[static_cast<size_t>(k)];
  return scene + output("p", "b.tip", "position") + output("d", "jd", "value") + output("dr", "jd", "rate") +
         output("force", "jd", "reaction") + output("b", "jb", "value");
}

const std::vector<std::vector<int>> orders = {{0, 1, 2, 3}, {3, 2, 1, 0}, {1, 3, 0, 2}};

// All orders give the same histories; returns the first.
Results same_for_all_orders(const std::vector<std::string>& more, double duration, double tolerance, double close,
                            const std::string& start = "") {
  std::vector<Results> all;
  for (const std::vector<int>& order : orders)
    all.push_back(run(head(duration, Vec3(0, -9.81, 0)) + four_bar(more, order, start), tolerance));
  for (const Results& r : all) {
    for (const char* name : {"p.x", "p.y", "d", "dr", "b"})
      EXPECT_LT((column(r, name) - column(all[0], name)).cwiseAbs().maxCoeff(), close) << name;
    EXPECT_LT(energy_gap(r), 10.0 * close);
    EXPECT_LT(column(r, "p.z").cwiseAbs().maxCoeff(), 1e-10);
  }
  return all[0];
}

TEST(Loops, FrictionInEveryJoint) {
  const std::string friction = "friction = { coefficient = 0.3, normal_force = 10, radius = 0.5 }";
  const Results r = same_for_all_orders({friction, friction, friction, friction}, 4, 1e-9, 1e-6);
  // It swings to rest and stays: the last half second nothing moves.
  EXPECT_EQ(column(r, "dr").tail(50).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GE(events(r, "sticks").size(), 1u);
  EXPECT_GT(r.dissipated[r.times.size() - 1], 1.0);
}

TEST(Loops, RegularisedFrictionAndStopsInEveryJoint) {
  const std::string both =
      "friction = { coefficient = 0.2, normal_force = 1, radius = 0.5, regularised = 0.05 }\nstop = { lower = -0.5, upper = 0.4, stiffness "
      "= 300, damping = 3 }";
  const Results r = same_for_all_orders({both, both, both, both}, 2, 1e-9, 1e-6);
  EXPECT_GE(events(r, "stop").size(), 2u);
}

// A motion of one joint drives the loop, the others rub; the drive's work is in the balance.
TEST(Loops, DrivenWithFrictionInTheOthers) {
  const std::string friction = "friction = { coefficient = 0.3, normal_force = 2, radius = 0.5 }";
  const Results r = same_for_all_orders({friction, friction, friction, "motion = \"0.5*sin(3*t)\""}, 2, 1e-9, 1e-6);
  for (Eigen::Index i = 0; i < r.times.size(); ++i) EXPECT_NEAR(column(r, "d")[i], 0.5 * std::sin(3 * r.times[i]), 1e-9);
}

// A torque by table of the angle of whichever joint closes the loop.
TEST(Loops, TableOfTheAngleOfEveryJoint) {
  const std::string spring = "spring = { stiffness = 2, damping = 0.1 }";
  std::vector<double> ends;
  for (const char* of : {"ja", "jb", "jc", "jd"})
    for (const std::vector<int>& order : orders) {
      const Results r = run(head(1, Vec3(0, -9.81, 0)) + four_bar({spring, spring, spring, spring}, order) +
                                fmt::format("[[force]]\nkind = \"torque\"\non = \"a\"\ndirection = [0, 0, 1]\nvalue = {{ table = [[-3, 9], "
                                            "[-1, 4], [0, 1], [1, -2], [3, -5]], of = \"{}\" }}\n",
                                            of),
                            1e-9);
      if (&order == &orders.front()) ends.push_back(last(r, "p.x"));
      EXPECT_NEAR(last(r, "p.x"), ends.back(), 1e-7) << of;
    }
  // A parallelogram: opposite angles do the same, neighbouring ones the opposite.
  EXPECT_NEAR(ends[0], ends[2], 1e-7);
  EXPECT_NEAR(ends[1], ends[3], 1e-7);
  EXPECT_GT(std::abs(ends[0] - ends[1]), 1e-3);
}

// A differential screw: the nut turns on a ground thread of pitch p1 and carries a rod by a thread of pitch p2; the rod slides. Turning by
// a, the nut rises by p1 a, the rod by (p1 - p2) a. Every joint of the loop has something, so one of the threads or the slide closes it.
TEST(Loops, DifferentialScrew) {
  const double p1 = 0.02, p2 = 0.012, inertia = 3e-4, nut = 0.5, bar = 2.0, g = 9.81;
  const std::string bodies = fmt::format(
      "[[body]]\nname = \"nut\"\nkind = \"rigid\"\nmass = {}\ninertia = [2e-4, 2e-4, {}]\n[[body]]\nname = \"bar\"\nkind = \"rigid\"\nmass "
      "= {}\ninertia = [0.1, 0.1, 0.1]\n",
      nut, inertia, bar);
  const std::vector<std::string> joints = {joint("thread", "screw", "ground", "nut", fmt::format("pitch = {}", p1)),
                                           joint("second", "screw", "nut", "bar", fmt::format("pitch = {}", p2)),
                                           joint("slide", "prismatic", "ground", "bar", "stop = { upper = 1, stiffness = 1e4 }")};
  for (const std::vector<int>& order : {std::vector<int>{0, 1, 2}, {2, 1, 0}, {1, 2, 0}}) {
    std::string scene = head(1, Vec3(0, 0, -g)) + bodies;
    for (int k : order) scene += joints[static_cast<size_t>(k)];
    const Results r = run(scene + output("a", "thread", "value") + output("b", "second", "value") + output("z", "slide", "value"), 1e-9);
    const double a = -(nut * p1 + bar * (p1 - p2)) * g / (inertia + nut * p1 * p1 + bar * (p1 - p2) * (p1 - p2)) / 2;
    EXPECT_NEAR(last(r, "a"), a, 1e-7 * std::abs(a));
    EXPECT_NEAR(last(r, "b"), -a, 1e-7 * std::abs(a));
    EXPECT_NEAR(last(r, "z"), (p1 - p2) * a, 1e-7 * std::abs(a));
    EXPECT_LT(energy_gap(r), 1e-6);
  }
}

// A four-bar in space with two balls and a universal joint, springs in all of them and given values in some: the order of the joints
// changes nothing.
TEST(Loops, SpringsInBallsAndUniversalJoints) {
  const std::string spring = "spring = { stiffness = 3, damping = 0.05 }\n";
  const std::vector<std::string> joints = {
      joint("crank", "revolute", "ground", "a", "axis = [0, 1, 0]\nrotation = [0, 0, 0.9]\ninitial = { rate = 1 }\n" + spring),
      joint("ball", "spherical", "a.tip", "b", "rotation = [0.2, 0.3, -0.9]\n" + spring),
      joint("cross", "universal", "b.tip", "c.tip", "rotation = [0.1, 0, -1.2]\naxis = [0, 0, 1]\n" + spring),
      joint("rocker", "spherical", "ground", "c", "position = [1.2, -0.2, 0.1]\nrotation = [0, 0, 1.3]\n" + spring)};
  std::vector<Eigen::MatrixX3d> paths, balls;
  for (const std::vector<int>& order : orders) {
    std::string scene = head(0.5, Vec3(0, -9.81, 0)) + rod("a") + rod("b") + rod("c");
    for (int k : order) scene += joints[static_cast<size_t>(k)];
    const Results r =
        run(scene + output("p", "b.tip", "position") + output("ball", "ball", "value") + output("cross", "cross", "value"), 1e-9);
    EXPECT_LT(energy_gap(r), 1e-6);
    paths.push_back(positions(r, "p"));
    balls.push_back(positions(r, "ball"));
  }
  // Assembled from zero with least motion, by which coordinates is a matter of the order; so the start decides, not what follows.
  EXPECT_GT((paths[0].row(50) - paths[0].row(0)).norm(), 0.05);
}

// A slider on a line with friction, spring and stop, as a point on a line and as a guided massless block.
TEST(Loops, PointOnALineRubsAsAGuideDoes) {
  for (const char* more : {"friction = { coefficient = 0.3, normal_force = 5 }", "spring = { stiffness = 30, damping = 1, rest = 1.2 }",
                           "stop = { lower = 1.1, upper = 1.6, stiffness = 2000, damping = 20 }",
                           "friction = { coefficient = 0.1, normal_force = \"reaction\" }"}) {
    const std::string bars = head(0.8, Vec3(0, -9.81, 0)) + rod("a") + rod("b") +
                             joint("ja", "revolute", "ground", "a", "initial = { value = 0.8 }") +
                             joint("jb", "revolute", "a.tip", "b", "rotation = [0, 0, -1.6]") + output("tip", "b.tip", "position");
    const Results line = run(bars + joint("rail", "point-on-line", "ground", "b.tip", fmt::format("axis = [1, 0, 0]\n{}", more)) +
                                 output("force", "rail", "reaction"),
                             1e-8);
    const Results guide = run(
        bars + "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 0\n" + joint("pin", "spherical", "block", "b.tip", "") +
            joint("rail", "prismatic", "ground", "block", fmt::format("axis = [1, 0, 0]\n{}", more)) + output("force", "pin", "reaction"),
        1e-8);
    EXPECT_LT((positions(line, "tip") - positions(guide, "tip")).cwiseAbs().maxCoeff(), 1e-5) << more;
    EXPECT_LT(energy_gap(line), 1e-4) << more;
    EXPECT_LT(column(line, "tip.y").cwiseAbs().maxCoeff(), 1e-9) << more;
  }
}

// A shaft in two hinges on one line: statics leaves the shares open, and the least ones are half of the load each, without moments,
// whichever of the two closes the loop. A table on four legs likewise.
TEST(Loops, RedundantReactionsAreTheLeast) {
  const std::string shaft =
      "[[body]]\nname = \"shaft\"\nkind = \"rigid\"\nmass = 2\ninertia = [0.1, 0.1, 0.05]\ncentre_of_mass = [0, 0, 0.5]\nframes = { far = "
      "[0, 0, 1] }\n";
  const std::string near = joint("near", "revolute", "ground", "shaft", "initial = { rate = 3 }"),
                    far = joint("far", "revolute", "ground", "shaft.far", "position = [0, 0, 1]");
  for (const std::string& joints : {near + far, far + near}) {
    const Results r =
        run(head(0.1, Vec3(0, -9.81, -4)) + shaft + joints + output("near", "near", "reaction") + output("far", "far", "reaction"), 1e-8);
    for (const char* name : {"near", "far"}) {
      const std::string n = name;
      EXPECT_NEAR(last(r, n + ".y"), 9.81, 1e-9) << name;
      EXPECT_NEAR(last(r, n + ".z"), 4.0, 1e-9) << name;
      for (const char* zero : {".x", ".mx", ".my", ".mz"}) EXPECT_NEAR(last(r, n + zero), 0.0, 1e-9) << name << zero;
    }
  }
  std::string table =
                  "[[body]]\nname = \"top\"\nkind = \"rigid\"\nmass = 4\ninertia = [1, 1, 1]\nframes = { a = [1, 1, 0], b = [-1, 1, 0], c "
                  "= [-1, -1, 0], d = [1, -1, 0] }\n",
              legs;
  for (const char* leg : {"a", "b", "c", "d"}) {
    const std::string name = leg, place = name == "a"   ? "[1, 1, 0]"
                                          : name == "b" ? "[-1, 1, 0]"
                                          : name == "c" ? "[-1, -1, 0]"
                                                        : "[1, -1, 0]";
    legs += joint(name, "weld", "ground", "top." + name, "position = " + place) + output(name, name, "reaction");
  }
  const Results r = run(head(0.1, Vec3(0, 0, -10)) + table + legs, 1e-8);
  for (const char* leg : {"a", "b", "c", "d"}) {
    EXPECT_NEAR(last(r, std::string(leg) + ".z"), 10.0, 1e-9);
    EXPECT_NEAR(last(r, std::string(leg) + ".x"), 0.0, 1e-9);
  }
}

// A four-bar without rates of its own on a body that flies: the rounding of the carrier's speed, to which nothing in the loop could give
// way across the plane, is no contradiction of rates. Without spin every point flies straight on; with it the energy stays.
TEST(Loops, CarriedAlongAtRest) {
  std::string bars = four_bar({"", "", "", ""}, {0, 1, 2, 3});
  for (size_t at = 0; (at = bars.find("ground", at)) != std::string::npos;) bars.replace(at, 6, "carrier");
  const auto flying = [&](const std::string& spin) {
    return run(head(0.5, Vec3::Zero()) + "[[body]]\nname = \"carrier\"\nkind = \"rigid\"\nmass = 3\ninertia = [0.3, 0.4, 0.5]\n" +
                   joint("flight", "free", "ground", "carrier",
                         "initial = { value = [0.1, 0.2, 0.3, 0.4, -0.5, 0.6], rate = [3, -2, 1, " + spin + "] }") +
                   bars,
               1e-9);
  };
  const Results straight = flying("0, 0, 0"), turning = flying("0.7, 1.3, -0.9");
  const Eigen::MatrixX3d p = positions(straight, "p");
  for (Eigen::Index i = 0; i < p.rows(); ++i)
    EXPECT_LT((p.row(i) - p.row(0) - straight.times[i] * Vec3(3, -2, 1).transpose()).norm(), 1e-9);
  EXPECT_LT(energy_gap(turning), 1e-6);
  EXPECT_GT((positions(turning, "p") - p).cwiseAbs().maxCoeff(), 0.1);
}

// Values that are given of every joint of a loop must fit; the joint that does not is named.
TEST(Loops, GivenValuesMustFit) {
  const auto start = [](const char* value, const char* rate) { return fmt::format("initial = {{ value = {}, rate = {} }}", value, rate); };
  // The parallelogram: the others turn as they must.
  const std::vector<std::string> fits = {start("0.3", "1"), start("-0.3", "-1"), start("0.3", "1"), start("-0.3", "-1")};
  EXPECT_LT(energy_gap(run(head(0.2, Vec3(0, -9.81, 0)) + four_bar(fits, orders[0]), 1e-8)), 1e-5);
  for (const std::vector<int>& order : orders)
    for (size_t wrong = 0; wrong < 4; ++wrong)
      for (const bool rate : {false, true}) {
        std::vector<std::string> more = fits;
        more[wrong] = rate ? start(wrong % 2 ? "-0.3" : "0.3", "0.2") : start("0.35", wrong % 2 ? "-1" : "1");
        try {
          run(head(0.2, Vec3(0, -9.81, 0)) + four_bar(more, order), 1e-8);
          ADD_FAILURE() << "accepted: " << more[wrong];
        } catch (const InputError& error) {
          const std::string text = error.what();
          EXPECT_TRUE(text.find("joint 'j") != std::string::npos) << text;
        }
      }
}

}  // namespace
}  // namespace flexframe::sim::test_loops
