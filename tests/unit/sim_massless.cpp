// Bodies without mass that springs, bushings and dampers hold: closed forms, both ways to write a scene, vibrations, refusals.
#include "mechanism_text.h"
#include "sim/base/eigen_solvers.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"

#include <gtest/gtest.h>

namespace flexframe::sim::test_massless {
namespace {

std::string body(const std::string& name, double mass, const std::string& more = "") {
  return fmt::format("[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = {}\n{}{}\n", name, mass,
                     mass > 0 ? "inertia = [0.1, 0.1, 0.1]\n" : "", more);
}

std::string slide(const std::string& name, const std::string& parent, const std::string& child, const std::string& more) {
  return joint(name, "prismatic", parent, child, "axis = [1, 0, 0]\n" + more);
}

// Ground - k1 - node - k2 - mass, the mass sliding on the node or both on ground: one spring of k1 k2 / (k1 + k2), the node k2 / (k1 + k2)
// of the way.
TEST(Massless, NodeBetweenTwoSprings) {
  const double k1 = 100, k2 = 300, m = 0.3, x0 = 0.4, omega = std::sqrt(k1 * k2 / (k1 + k2) / m), share = k2 / (k1 + k2);
  const std::string bodies = head(2, Vec3::Zero()) + body("node", 0) + body("block", m);
  const std::string watched = output("x", "block", "position") + output("n", "node", "position") + output("v", "node", "velocity") +
                              output("a", "node", "acceleration") + output("f", "one", "reaction");
  const std::string stacked = bodies + slide("one", "ground", "node", "spring = { stiffness = 100 }") +
                              slide("two", "node", "block", "spring = { stiffness = 300 }\ninitial = { value = 0.1 }") + watched;
  const std::string abreast = bodies + slide("one", "ground", "node", "spring = { stiffness = 100 }") +
                              slide("two", "ground", "block", "initial = { value = 0.4 }") +
                              "[[force]]\nkind = \"spring-damper\"\non = \"block\"\nfrom = \"node\"\nstiffness = 300\nrest = 0\n" + watched;
  for (const std::string& scene : {stacked, abreast})
    for (const Method method : {Method::automatic, Method::dirk}) {
      const double tolerance = method == Method::dirk ? 1e-7 : 1e-9;
      const Results r = run(scene, tolerance, method);
      for (Eigen::Index i = 0; i < r.times.size(); ++i) {
        const double t = r.times[i];
        EXPECT_NEAR(column(r, "x.x")[i], x0 * std::cos(omega * t), 100 * tolerance);
        EXPECT_NEAR(column(r, "n.x")[i], share * x0 * std::cos(omega * t), 100 * tolerance);
        EXPECT_NEAR(column(r, "v.x")[i], -share * x0 * omega * std::sin(omega * t), 1000 * tolerance);
        EXPECT_NEAR(column(r, "a.x")[i], -share * x0 * omega * omega * std::cos(omega * t), 1e-6 + 20000 * tolerance);
      }
      EXPECT_LT(energy_gap(r), 1000 * tolerance);
    }
  const Linearisation linear = linearise(make_system(parse_scene(stacked, "node.toml")));
  ASSERT_EQ(linear.modes.size(), 1u);
  EXPECT_NEAR(linear.modes[0].frequency, omega / (2 * pi), 1e-8);
}

// Spring and damper in series (Maxwell's body) beside a spring: three real states, against their matrix's exponential; and two nodes with a
// damper between them, where one direction is of first order and one has no damper.
TEST(Massless, DampersMakeItFirstOrder) {
  const double m = 2, k = 50, k1 = 80, k2 = 120, c = 6;
  for (const bool two : {false, true}) {
    // Ground - (k1) - a - c - b - k2 - block; with one node k1 is rigid.
    const std::string scene =
        head(3, Vec3::Zero()) + (two ? body("a", 0) : "") + body("b", 0) + body("block", m) +
        (two ? slide("first", "ground", "a", "spring = { stiffness = 80 }") + slide("damper", "a", "b", "spring = { damping = 6 }")
             : slide("damper", "ground", "b", "spring = { damping = 6 }")) +
        slide("x", "ground", "block", "spring = { stiffness = 50 }\ninitial = { rate = 1.5 }") +
        "[[force]]\nkind = \"bushing\"\non = \"block\"\nfrom = \"b\"\nstiffness = [120, 0, 0, 0, 0, 0]\n" +
        output("x", "block", "position") + output("b", "b", "position") + (two ? output("a", "a", "position") : "");
    const Results r = run(scene, 1e-9);
    // x' = v, m v' = -k x - f, the damper's stretch s' = f / c, f = (x - s) k_s with k_s of the springs in series.
    const double ks = two ? k1 * k2 / (k1 + k2) : k2;
    MatX A(3, 3);
    A << 0, 1, 0, -(k + ks) / m, 0, ks / m, ks / c, 0, -ks / c;
    const ComplexEigen eigen(A);
    const Eigen::Vector3cd start = eigen.eigenvectors().partialPivLu().solve(Eigen::Vector3cd(0, 1.5, 0));
    for (Eigen::Index i = 0; i < r.times.size(); ++i) {
      const Eigen::Vector3d z = (eigen.eigenvectors() * (start.array() * (eigen.eigenvalues() * r.times[i]).array().exp()).matrix()).real();
      const double f = ks * (z[0] - z[2]);
      EXPECT_NEAR(column(r, "x.x")[i], z[0], 2e-7);
      EXPECT_NEAR(column(r, "b.x")[i], z[0] - f / k2, 2e-7);
      if (two) {
        EXPECT_NEAR(column(r, "a.x")[i], f / k1, 2e-7);
      }
    }
    EXPECT_LT(energy_gap(r), 1e-6);
    const Linearisation linear = linearise(make_system(parse_scene(scene, "maxwell.toml")));
    ASSERT_EQ(linear.modes.size(), 2u);
    const auto& all = eigen.eigenvalues();
    Eigen::Index at = 0, real = 0;
    all.imag().maxCoeff(&at);
    all.imag().cwiseAbs().minCoeff(&real);
    EXPECT_NEAR(linear.modes[0].frequency, all[at].imag() / (2 * pi), 1e-7);
    EXPECT_NEAR(linear.modes[0].damping, -all[at].real() / std::abs(all[at]), 1e-7);
    EXPECT_EQ(linear.modes[1].kind, LinearMode::overdamped);
    EXPECT_NEAR(linear.modes[1].pole.real(), all[real].real(), 1e-7 * std::abs(all[real].real()));
  }
}

// A stiff damper's node is integrated implicitly: the decay c/k = 1e-6 s costs no steps.
TEST(Massless, FastDecayCostsNoSteps) {
  const Results r = run(head(1, Vec3::Zero()) + body("plate", 0) +
                            slide("x", "ground", "plate", "spring = { stiffness = 1e4, damping = 0.01 }\ninitial = { value = 0.2 }") +
                            "[[force]]\nkind = \"force\"\non = \"plate\"\ndirection = [1, 0, 0]\nvalue = \"100*sin(2*pi*t)\"\n" +
                            output("x", "plate", "position"),
                        1e-6);
  EXPECT_LT(r.statistics.steps, 2000);
  for (Eigen::Index i = 1; i < r.times.size(); ++i) EXPECT_NEAR(column(r, "x.x")[i], 0.01 * std::sin(2 * pi * r.times[i]), 2e-6);
}

// A massless point without a joint on three springs, pulled about: forces are in balance at every time, and what the force does the springs
// store.
TEST(Massless, FreePointFollowsItsForces) {
  const Vec3 ends[] = {{1, 0, 0}, {-0.5, 0.8, 0}, {-0.4, -0.6, 0.9}};
  std::string scene = head(1, Vec3(0, 0, -9.81)) + body("point", 0) +
                      body("anchor", 1, "frames = { e0 = [1, 0, 0], e1 = [-0.5, 0.8, 0], e2 = [-0.4, -0.6, 0.9] }") +
                      joint("fixed", "weld", "ground", "anchor", "");
  for (int i = 0; i < 3; ++i)
    scene += fmt::format("[[force]]\nkind = \"spring-damper\"\non = \"point\"\nfrom = \"anchor.e{}\"\nstiffness = {}\nrest = 0.6\n", i,
                         100 + 50 * i);
  scene += "[[force]]\nkind = \"force\"\non = \"point\"\ndirection = [0.3, -0.5, 0.8]\nvalue = \"20*sin(4*t)\"\n" +
           output("p", "point", "position") + output("v", "point", "velocity");
  const Results r = run(scene, 1e-8);
  const Vec3 pull = Vec3(0.3, -0.5, 0.8).normalized();
  for (Eigen::Index i = 0; i < r.times.size(); i += 10) {
    const Vec3 p = positions(r, "p").row(i).transpose();
    Vec3 f = 20 * std::sin(4 * r.times[i]) * pull;
    for (int k = 0; k < 3; ++k) f += (100 + 50 * k) * ((ends[k] - p).norm() - 0.6) * (ends[k] - p).normalized();
    EXPECT_LT(f.norm(), 1e-8) << r.times[i];
  }
  EXPECT_LT(energy_gap(r), 1e-6);
  const Vec3 before = positions(r, "p").row(49).transpose(), after = positions(r, "p").row(51).transpose(),
             v = positions(r, "v").row(50).transpose();
  EXPECT_LT(((after - before) / 0.02 - v).norm(), 1e-2 * v.norm());
}

// A massless last link of a chain on a torsion spring: it turns until the spring meets the force at its end, and disturbs the pendulum by
// that force alone.
TEST(Massless, EndOfAChain) {
  const std::string first = head(1.5, Vec3(0, -9.81, 0)) + rod("r") + joint("j", "revolute", "ground", "r", "");
  const std::string tip = "[[body]]\nname = \"tip\"\nkind = \"rigid\"\nmass = 0\nframes = { end = [0.5, 0, 0] }\n" +
                          joint("s", "revolute", "r.tip", "tip", "spring = { stiffness = 4 }");
  const auto pull = [](const char* on) {
    return fmt::format("[[force]]\nkind = \"force\"\non = \"{}\"\ndirection = [0, 1, 0]\nframe = \"body\"\nvalue = 3\n", on);
  };
  const Results r = run(
      first + tip + pull("tip.end") + output("a", "s", "value") + output("tip", "r.tip", "position") + output("s", "s", "reaction"), 1e-9);
  // Follower force across the link: k a = F l.
  for (Eigen::Index i = 0; i < r.times.size(); ++i) {
    EXPECT_NEAR(column(r, "a")[i], 3 * 0.5 / 4, 1e-10);
    EXPECT_NEAR(Vec3(column(r, "s.x")[i], column(r, "s.y")[i], column(r, "s.z")[i]).norm(), 3, 1e-9);
  }
  EXPECT_LT(energy_gap(r), 1e-7);
  // The same force and moment on the rod itself: a rigid link at that angle.
  const std::string bent = "[[body]]\nname = \"tip\"\nkind = \"rigid\"\nmass = 0\nframes = { end = [0.5, 0, 0] }\n" +
                           joint("s", "weld", "r.tip", "tip", "rotation = [0, 0, 0.375]");
  const Results other = run(first + bent + pull("tip.end") + output("tip", "r.tip", "position"), 1e-9);
  EXPECT_LT((positions(r, "tip") - positions(other, "tip")).cwiseAbs().maxCoeff(), 1e-7);
}

// Between balls: a massless piece with bushings of all six directions between ground and a body that hangs on it by a weld, and one at the
// end.
TEST(Massless, BushingsInSeries) {
  const std::string bush = "stiffness = [4000, 5000, 6000, 30, 40, 50]\n";
  const auto scene = [&](bool piece) {
    std::string s = head(0.5, Vec3(1, -9.81, 2)) + (piece ? body("piece", 0) : "") +
                    "[[body]]\nname = \"b\"\nkind = \"rigid\"\nmass = 2\ninertia = [0.02, 0.03, 0.04]\ncentre_of_mass = [0.1, 0.02, 0]\n";
    // Two equal bushings in series along x are half a bushing as long as turns are small; here the second is a rod of the first's kind on a
    // slide.
    if (piece)
      s += slide("p", "ground", "piece", "spring = { stiffness = 8000 }") + slide("x", "piece", "b", "spring = { stiffness = 8000 }");
    else s += slide("x", "ground", "b", "spring = { stiffness = 4000 }");
    return s + output("p", "b", "position");
  };
  EXPECT_LT((positions(run(scene(true), 1e-9), "p") - positions(run(scene(false), 1e-9), "p")).cwiseAbs().maxCoeff(), 1e-8);
  // At the end of a tree in six directions: the bushing yields to the force at once.
  const Results r = run(head(1, Vec3::Zero()) + body("b", 2) + joint("fixed", "weld", "ground", "b", "") + body("end", 0) +
                            "[[force]]\nkind = \"bushing\"\non = \"end\"\nfrom = \"b\"\n" + bush +
                            "[[force]]\nkind = \"force\"\non = \"end\"\ndirection = [1, 2, 2]\nvalue = \"30*t\"\n[[force]]\nkind = "
                            "\"torque\"\non = \"end\"\ndirection = [0, 0, 1]\nvalue = \"5*t\"\n" +
                            output("p", "end", "position") + output("a", "end", "rotation"),
                        1e-8);
  EXPECT_LT((positions(r, "p").row(100).transpose() - Vec3(10 / 4000.0, 20 / 5000.0, 20 / 6000.0)).norm(), 1e-10);
  EXPECT_LT((positions(r, "a").row(100).transpose() - Vec3(0, 0, 0.1)).norm(), 1e-9);
  EXPECT_LT(energy_gap(r), 1e-8);
}

// A plate on a spring is pressed into a stop: k q = F before, k q + s (q - stop) = F beyond, located and continuous, with the stop's damper
// or without.
TEST(Massless, MeetsAStop) {
  for (const double damping : {0.0, 3.0}) {
    const Results r =
        run(head(2, Vec3::Zero()) + body("plate", 0) +
                slide("x", "ground", "plate",
                      fmt::format("spring = {{ stiffness = 100 }}\nstop = {{ upper = 0.1, stiffness = 900, damping = {} }}", damping)) +
                "[[force]]\nkind = \"force\"\non = \"plate\"\ndirection = [1, 0, 0]\nvalue = \"20*t\"\n" + output("x", "x", "value"),
            1e-9);
    ASSERT_EQ(events(r, "upper stop").size(), 1u);
    EXPECT_NEAR(events(r, "upper stop")[0], 0.5, 1e-8);
    for (Eigen::Index i = 0; i < r.times.size(); ++i) {
      // Beyond: 1000 y + c y' = 20 (t - 0.5) for y = x - 0.1.
      const double t = r.times[i] - 0.5, lag = damping / 1000,
                   y = t > 0 ? 0.02 * (t - lag * (1 - (lag > 0 ? std::exp(-t / lag) : 0.0))) : 0.2 * t;
      EXPECT_NEAR(column(r, "x")[i], 0.1 + y, 1e-8) << damping << " " << r.times[i];
    }
    EXPECT_LT(energy_gap(r), 1e-6);
  }
}

std::string complaint(const std::string& scene) {
  try {
    run(scene, 1e-6);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

// What cannot be determined is said.
TEST(Massless, RefusesWhatNothingDetermines) {
  const std::string plate = head(1, Vec3::Zero()) + body("plate", 0);
  EXPECT_NE(complaint(plate + slide("x", "ground", "plate", "")).find("without inertia"), std::string::npos);
  EXPECT_NE(complaint(plate + slide("x", "ground", "plate", "spring = { stiffness = -1 }")).find("stiffness"), std::string::npos);
  EXPECT_NE(
      complaint(plate + slide("x", "ground", "plate", "spring = { stiffness = 10 }\nfriction = { coefficient = 0.1, normal_force = 1 }"))
          .find("friction"),
      std::string::npos);
  // Held along x, pulled along y from half a second on.
  const std::string why =
      complaint(plate + joint("f", "planar", "ground", "plate", "") +
                "[[force]]\nkind = \"bushing\"\non = \"plate\"\nstiffness = [10, 0, 0, 0, 0, 0]\n"
                "[[force]]\nkind = \"force\"\non = \"plate\"\ndirection = [0, 1, 0]\nvalue = \"t > 0.5 ? t - 0.5 : 0\"\n");
  EXPECT_NE(why.find("without inertia"), std::string::npos) << why;
  EXPECT_NE(why.find("t = 0.5"), std::string::npos) << why;
  // A toggle of two springs in line that is pressed through its dead point.
  const std::string snap =
      complaint(plate + slide("x", "ground", "plate", "rotation = [0, 0, 1.5707963267948966]\ninitial = { value = 0.3 }") +
                "[[body]]\nname = \"wall\"\nkind = \"rigid\"\nmass = 1\n" + joint("w", "weld", "ground", "wall", "position = [1, 0, 0]") +
                "[[force]]\nkind = \"spring-damper\"\non = \"plate\"\nfrom = \"wall\"\nstiffness = 100\nrest = 1.0440306508910551\n"
                "[[force]]\nkind = \"force\"\non = \"plate\"\ndirection = [0, -1, 0]\nvalue = \"3*t\"\n");
  EXPECT_NE(snap.find("snap through"), std::string::npos) << snap;
}

}  // namespace
}  // namespace flexframe::sim::test_massless
