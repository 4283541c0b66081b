// Dry friction in loops that run freely: every reversal at a dead centre is found, whichever joint closes the loop. A constant friction
// force takes out force times path, so that the speed at every angle follows from energy alone; where the reaction presses, from an
// independent program.
#include "mechanism_text.h"

#include "sim/dynamics/friction_rest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim::test_friction_loops {
namespace {

constexpr double R = 0.1, L = 0.3, crank_inertia = 0.0125, rod_mass = 0.5, rod_inertia = 0.5 * 0.09 / 12, piston = 0.8;

std::string body(const std::string& name, double mass, double inertia, double centre, double end) {
  return fmt::format(
      "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = {}\ninertia = [{:.17g}, {:.17g}, {:.17g}]\ncentre_of_mass = [{}, 0, 0]\nframes = "
      "{{ end = [{}, 0, 0] }}\n",
      name, mass, inertia, inertia, inertia, centre, end);
}

// Slider-crank in the plane, crank pin at angle `at` with rate `rate`; joints in this order, those of `swapped` with parent and child
// exchanged.
struct Engine {
  double at = 0.7, rate = 50;
  std::array<int, 4> order{0, 1, 2, 3};
  std::array<bool, 4> swapped{};
  std::array<std::string, 4> more;  // of the joints shaft, pin, wrist, guide
  std::string forces;

  std::string text(double duration) const {
    std::string out = head(duration, Vec3(0, 0, 0), 200) + body("crank", 1, crank_inertia - 0.0025, 0.05, R) +
                      body("rod", rod_mass, rod_inertia, 0.15, L) + body("piston", piston, 0.001, 0, 0);
    const double tilt = -std::asin(R * std::sin(at) / L);
    const std::array<const char*, 4> names{"shaft", "pin", "wrist", "guide"}, kinds{"revolute", "revolute", "revolute", "prismatic"},
        parents{"ground", "crank.end", "rod.end", "ground"}, children{"crank", "rod", "piston", "piston"};
    const std::array<double, 4> values{at, tilt - at, -tilt, R * std::cos(at) + L * std::cos(tilt)};
    for (const int k : order) {
      const size_t i = static_cast<size_t>(k);
      const bool turned = swapped[i];
      out += joint(names[i], kinds[i], turned ? children[i] : parents[i], turned ? parents[i] : children[i],
                   fmt::format("{}initial = {{ value = {:.17g}{} }}\n{}", k == 3 ? "axis = [1, 0, 0]\n" : "",
                               turned ? -values[i] : values[i], k == 0 ? fmt::format(", rate = {:.17g}", rate) : "", more[i]));
    }
    return out + forces + output("angle", "shaft", "value") + output("speed", "shaft", "rate") + output("x", "guide", "value");
  }
};

double piston_at(double angle) { return R * std::cos(angle) + std::sqrt(L * L - R * R * std::sin(angle) * std::sin(angle)); }

// Twice the kinetic energy over the square of the crank's speed.
double inertia_at(double a) {
  const double s = R / L * std::sin(a), c = std::sqrt(1 - s * s), tilt = -R / L * std::cos(a) / c;  // rod angle per crank angle
  const double vx = -R * std::sin(a) + 0.5 * L * s * tilt, vy = R * std::cos(a) + 0.5 * L * c * tilt,
               slide = -R * std::sin(a) + L * s * tilt;
  return crank_inertia + rod_mass * (vx * vx + vy * vy) + rod_inertia * tilt * tilt + piston * slide * slide;
}

// The piston's way from one angle to another, back and forth.
double path(double from, double to) {
  double out = 0.0, last = from;
  for (double turn = std::ceil(from / pi) * pi; turn < to; turn += pi) {
    out += std::abs(piston_at(turn) - piston_at(last));
    last = turn;
  }
  return out + std::abs(piston_at(to) - piston_at(last));
}

// Largest error of the crank's speed at the angles it went through, relative to its first speed.
double speed_error(const Engine& engine, const Results& r, double force) {
  const VecX &angle = column(r, "angle"), &speed = column(r, "speed");
  double worst = 0.0;
  for (Eigen::Index i = 0; i < angle.size(); ++i) {
    const double energy = 0.5 * inertia_at(engine.at) * engine.rate * engine.rate - force * path(engine.at, angle[i]);
    worst = std::max(worst, std::abs(speed[i] - std::sqrt(2 * energy / inertia_at(angle[i]))) / engine.rate);
  }
  return worst;
}

TEST(FrictionLoops, EveryDeadCentreOfAFreeSliderCrankIsFound) {
  for (const double rate : {20.0, 50.0})
    for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
      Engine engine;
      engine.rate = rate;
      engine.more[3] = "friction = { coefficient = 0.1, normal_force = 10 }\n";
      const Results r = run(engine.text(1), tolerance);
      EXPECT_LT(speed_error(engine, r, 1.0), 200 * tolerance) << rate << " " << tolerance;
      EXPECT_EQ(events(r, "turns round").size(), static_cast<size_t>(std::floor(last(r, "angle") / pi))) << rate << " " << tolerance;
      EXPECT_LT(energy_gap(r), 200 * tolerance * r.kinetic[0]);
    }
}

TEST(FrictionLoops, WhicheverJointIsCut) {
  std::array<int, 4> order{0, 1, 2, 3};
  int at = 0;
  do {
    Engine engine;
    engine.rate = 30;
    engine.order = order;
    engine.swapped = {false, at % 2 == 1, at % 3 == 1, false};
    engine.more[3] = "friction = { coefficient = 0.1, normal_force = 10 }\n";
    const Results r = run(engine.text(0.4), 1e-6);
    EXPECT_LT(speed_error(engine, r, 1.0), 3e-5) << at;
    ++at;
  } while (std::next_permutation(order.begin(), order.end()));
}

// Friction by the wrist's own reaction, pin of 20 mm, the piston's guide besides by its side force: reversals of the rod's swing and of the
// piston. The speed after 0.5 s is that of a program of its own (bodies in absolute coordinates with multipliers, Dormand and Prince's
// method at 1e-11, events by bisection).
TEST(FrictionLoops, FrictionByReactionWhateverIsParentAndChild) {
  for (const bool swapped : {false, true})
    for (const double tolerance : {1e-5, 1e-7}) {
      Engine engine;
      engine.swapped[2] = swapped;
      engine.order = swapped ? std::array{3, 2, 1, 0} : std::array{0, 1, 2, 3};
      engine.more[2] = "friction = { coefficient = 0.3, normal_force = \"reaction\", radius = 0.02 }\n";
      engine.more[3] = "friction = { coefficient = 0.1, normal_force = \"reaction\" }\n";
      const Results r = run(engine.text(0.5), tolerance);
      EXPECT_NEAR(last(r, "speed"), 44.816447, 50 * 30 * tolerance + 2e-6) << swapped << " " << tolerance;
    }
}

// A crank-rocker with friction in the rocker's pin: what it takes out is moment times the rocker's way.
TEST(FrictionLoops, CrankRockerWithFrictionInTheRocker) {
  const std::string scene = head(1, Vec3(0, 0, 0), 200) + body("crank", 1, 0.02, 0, 0.1) + body("coupler", 0.3, 0.004, 0.2, 0.4) +
                            body("rocker", 0.6, 0.01, 0, 0.3) +
                            joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.5, rate = 40 }") +
                            joint("a", "revolute", "crank.end", "coupler", "") + joint("b", "revolute", "coupler.end", "rocker.end", "") +
                            joint("pivot", "revolute", "ground", "rocker",
                                  "position = [0.35, 0, 0]\nfriction = { coefficient = 0.2, normal_force = 20, radius = 0.02 }") +
                            output("swing", "pivot", "value") + output("speed", "shaft", "rate");
  for (const double tolerance : {1e-5, 1e-6, 1e-8}) {
    const Results r = run(scene, tolerance);
    const VecX& swing = column(r, "swing");
    // Between samples the rocker's way is what the samples show but for the turning points, which a parabola through three of them adds.
    double way = 0.0;
    for (Eigen::Index i = 1; i < swing.size(); ++i) way += std::abs(swing[i] - swing[i - 1]);
    const Eigen::Index end = swing.size() - 1;
    const size_t turns = events(r, "turns round").size();
    EXPECT_NEAR(r.kinetic[0] - r.kinetic[end], 0.2 * 20 * 0.02 * way, 0.2 * 20 * 0.02 * 0.02 * static_cast<double>(turns));
    EXPECT_NEAR(r.dissipated[end], r.kinetic[0] - r.kinetic[end], 30 * tolerance * r.kinetic[0]);
    EXPECT_GT(turns, 6u);
  }
}

// An elastic rod: the piston's reversals are not at the crank's dead centres. Energy is kept at every tolerance, and the speed does not
// jump.
TEST(FrictionLoops, ElasticRod) {
  const std::string scene =
      head(0.2, Vec3(0, 0, 0), 1000) + body("crank", 1, 0.01, 0.05, R) +
      "[[body]]\nname = \"rod\"\nkind = \"beam\"\nlength = 0.3\nelements = 2\nsection = { shape = \"circle\", diameter = 0.01 }\n"
      "material = { density = 7800, youngs_modulus = 2.1e11 }\neffects = [\"bending_xy\", \"stiffening\"]\n" +
      body("piston", piston, 0.001, 0, 0) + joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.7, rate = 30 }") +
      joint("pin", "revolute", "crank.end", "rod.root", "") + joint("wrist", "revolute", "rod.tip", "piston", "") +
      joint("guide", "prismatic", "ground", "piston", "axis = [1, 0, 0]\nfriction = { coefficient = 0.1, normal_force = 50 }") +
      output("speed", "shaft", "rate") + output("x", "guide", "value");
  const Results best = run(scene, 1e-7);
  for (const double tolerance : {1e-5, 1e-6}) {
    const Results r = run(scene, tolerance);
    EXPECT_LT(energy_gap(r), 50 * tolerance * r.kinetic[0]) << tolerance;
    EXPECT_LT((column(r, "speed") - column(best, "speed")).cwiseAbs().maxCoeff(), 30 * std::max(1e-5, 100 * tolerance)) << tolerance;
  }
}

// A parallelogram whose four pins hold more at rest than they rub with. They hold together until the moment on the crank, 5 t N m, is the
// sum of what each can hold, whichever gives way first; then the links turn alike against the sum of what they rub with. Inertia of the
// crank's angle: twice 0.01 + 1 kg (0.1 m)^2, and the coupler's 1 kg (0.2 m)^2.
TEST(FrictionLoops, PinsThatRestTogetherHoldTogether) {
  const std::array<double, 4> rubs{0.5, 0.3, 0.2, 0.4}, holds{0.8, 0.5, 0.4, 0.6};
  const auto pin = [&](int k, const char* parent, const char* child, const char* more) {
    return joint(fmt::format("p{}", k + 1), "revolute", parent, child,
                 fmt::format("{}friction = {{ coefficient = {}, static_coefficient = {}, normal_force = 10, radius = 0.1 }}", more, rubs[k],
                             holds[k]));
  };
  const std::array<std::string, 4> pins{pin(0, "ground", "crank", "initial = { value = 0.3 }\n"),
                                        pin(1, "crank.end", "coupler", "initial = { guess = -0.3 }\n"),
                                        pin(2, "coupler.end", "rocker.end", "initial = { guess = 0.3 }\n"),
                                        pin(3, "ground", "rocker", "position = [0.4, 0, 0]\ninitial = { guess = 0.3 }\n")};
  std::array<int, 4> order{0, 1, 2, 3};
  do {
    std::string scene = head(0.6, Vec3(0, 0, 0), 1000) + body("crank", 1, 0.01, 0.1, 0.2) + body("coupler", 1, 0.01, 0.2, 0.4) +
                        body("rocker", 1, 0.01, 0.1, 0.2);
    for (const int k : order) scene += pins[static_cast<size_t>(k)];
    scene += "[[force]]\nkind = \"torque\"\non = \"crank\"\ndirection = [0, 0, 1]\nvalue = \"5*t\"\n" + output("angle", "p1", "value") +
             output("held", "p3", "friction_force");
    const Results r = run(scene, 1e-8);
    const VecX& angle = column(r, "angle");
    for (Eigen::Index i = 0; i < angle.size(); ++i) {
      const double t = std::max(r.times[i], 0.46);
      const double turned = (5.0 / 6 * (t * t * t - 0.46 * 0.46 * 0.46) - 1.4 / 2 * (t * t - 0.46 * 0.46) -
                             (5.0 / 2 * 0.46 * 0.46 - 1.4 * 0.46) * (t - 0.46)) /
                            0.08;
      ASSERT_NEAR(angle[i], 0.3 + turned, 1e-6) << r.times[i];
    }
    // How they share it is not told by rigid bodies.
    EXPECT_EQ(r.statistics.notes.texts(Severity::warning).size(), 1u);
  } while (std::next_permutation(order.begin(), order.end()));
}

// A rod on two balls turns about the line through them, which is askew to their axes. Each holds as much along that line, whatever its
// locks carry across it, which the rod's supports take as well: 0.6 N m each, and 0.3 once it turns.
TEST(FrictionLoops, BallsHoldAlongTheLineTheyTurnAbout) {
  const Vec3 line = Vec3(0.6, 0.5, 0.62).normalized(), far = 0.4 * line;
  const auto text = [](const Vec3& v) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v[0], v[1], v[2]); };
  for (const double holds : {0.3, 0.6}) {
    const std::string rub =
        fmt::format("friction = {{ coefficient = 0.3, static_coefficient = {}, normal_force = 10, radius = 0.1 }}", holds);
    const Results r =
        run(head(1, Vec3(0, 0, 0), 200) + "[[body]]\nname = \"rod\"\nkind = \"rigid\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n" +
                "centre_of_mass = " + text(0.5 * far) + "\nframes = { far = " + text(far) + " }\n" +
                joint("near", "spherical", "ground", "rod", rub) +
                joint("far", "spherical", "ground", "rod.far", "position = " + text(far) + "\n" + rub) +
                "[[force]]\nkind = \"torque\"\non = \"rod\"\ndirection = " + text(line) + "\nvalue = \"2*t\"\n" +
                output("w", "rod", "angular_velocity"),
            1e-8);
    for (Eigen::Index i = 0; i < r.times.size(); ++i) {
      const double t = std::max(r.times[i], holds);
      const double rate = ((t * t - holds * holds) - 0.6 * (t - holds)) / 0.1;
      ASSERT_NEAR(column(r, "w.x")[i], rate * line[0], 1e-6) << r.times[i];
    }
  }
}

// Shares of several rates that hold fewer motions: each force is within its bound, one at its bound opposes the acceleration, and what is
// within does not accelerate (Gauss' principle: these conditions have one solution for the accelerations). Where a share-out holds
// everything, as one within the bounds made the loads, nothing accelerates.
TEST(FrictionLoops, SharesHoldWhatCanBeHeld) {
  std::srand(7);
  for (int trial = 0; trial < 400; ++trial) {
    const Eigen::Index n = 3 + trial % 5, freedoms = 1 + trial % 3;
    const MatX C = MatX::Random(n, freedoms);
    const MatX A = C * C.transpose();
    const VecX bounds = VecX::NullaryExpr(n, [](Eigen::Index) { return std::pow(10.0, Eigen::internal::random(-1.0, 1.0)); });
    const double load = trial % 2 ? 0.999 : 3.0;
    const VecX a0 = A * bounds.cwiseProduct(load * VecX::Random(n));
    const Shares shares = least_acceleration(A, a0, bounds);
    const double small = 1e-10 * (A.cwiseAbs() * bounds).maxCoeff();
    EXPECT_LT((shares.acceleration - a0 - A * shares.force).cwiseAbs().maxCoeff(), small);
    if (load < 1.0) {
      EXPECT_LT(shares.acceleration.cwiseAbs().maxCoeff(), small) << trial;
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      ASSERT_LE(std::abs(shares.force[k]), bounds[k] * (1 + 1e-12)) << trial;
      if (std::abs(shares.force[k]) < bounds[k] * (1 - 1e-12)) {
        EXPECT_LT(std::abs(shares.acceleration[k]), small) << trial;
      } else {
        EXPECT_LT(shares.force[k] * shares.acceleration[k], small * bounds[k]) << trial;
      }
    }
  }
}

std::string on_stop(const std::string& kind, const std::string& stop, double value, double rate, double push) {
  return head(0.1, Vec3(0, 0, 0), 1000) + "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" +
         joint("slide", kind, "ground", "block",
               fmt::format("axis = [0, 0, 1]\ninitial = {{ value = {:.17g}, rate = {} }}\nstop = {{ {}, stiffness = 1e4 }}", value, rate,
                           stop)) +
         fmt::format("[[force]]\nkind = \"{}\"\non = \"block\"\ndirection = [0, 0, 1]\nvalue = {}\n",
                     kind == "prismatic" ? "force" : "torque", push) +
         output("x", "slide", "value");
}

// A body that starts exactly on its stop is carried by it: depth a (1 - cos w t) + v/w sin w t under a push a k, until it leaves.
TEST(Stops, CarriesWhatStartsOnIt) {
  for (const char* kind : {"prismatic", "revolute"})
    for (const auto& [stop, side] : {std::pair{"lower = 0.25", -1.0}, std::pair{"upper = 0.25", 1.0},
                                     std::pair{"lower = -1, upper = 0.25", 1.0}, std::pair{"lower = 0.25, upper = 1", -1.0}})
      for (const Method method : {Method::automatic, Method::adams, Method::bdf, Method::erk, Method::dirk, Method::ida})
        for (const double off : {0.0, 1e-300, 1e-17})
          for (const double rate : {0.0, 0.5}) {
            const double push = 10, w = 100, a = push / 1e4;
            const Results r = run(on_stop(kind, stop, 0.25 + off, side * rate, side * push), 1e-7, method);
            const VecX& x = column(r, "x");
            // In contact for the first 30 ms.
            for (Eigen::Index i = 0; i <= 30; ++i) {
              const double t = 1e-3 * static_cast<double>(i);
              const double depth = a * (1 - std::cos(w * t)) + rate / w * std::sin(w * t);
              ASSERT_NEAR(side * (x[i] - 0.25), depth, 1e-6)
                  << kind << " " << stop << " " << method_name(method) << " " << off << " " << rate << " " << t;
            }
          }
}

// A ball that only just reaches its stop, in flight that one long step could cover.
TEST(Stops, IsNotFlownThrough) {
  for (const double above : {1e-3, 1e-6, 1e-8})
    for (const Method method : {Method::automatic, Method::erk, Method::dirk}) {
      const double v = std::sqrt(2 * 9.81 * (1 + above));
      const Results r =
          run(head(0.8, Vec3(0, 0, -9.81), 10) + "[[body]]\nname = \"ball\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" +
                  joint("flight", "prismatic", "ground", "ball",
                        fmt::format("initial = {{ rate = {:.17g} }}\nstop = {{ upper = 1, stiffness = 1e9 }}", v)) +
                  output("z", "flight", "value"),
              1e-6, method);
      EXPECT_EQ(events(r, "meets its upper stop").size(), 1u) << above << " " << method_name(method);
      EXPECT_LT(energy_gap(r), 1e-4);
    }
}

}  // namespace
}  // namespace flexframe::sim::test_friction_loops
