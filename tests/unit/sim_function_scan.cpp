// Short pulses: bounds of functions over boxes of times, and that no method passes over what acts for a short time.
#include "mechanism_text.h"

#include "sim/scene/function_scan.h"

#include <gtest/gtest.h>

#include <random>

namespace flexframe::sim::test_function_scan {
namespace {

// Bounds hold at random times inside random boxes: against the derivatives that the expression itself gives.
TEST(FunctionScan, BoundsHold) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (const char* text : {"exp(-((t-0.3)/0.05)^2)",
                           "sin(t)^200",
                           "3*t^3 - 2*t + 1",
                           "tanh(40*(t-0.5))",
                           "1/cosh((t-0.4)/0.01)",
                           "sqrt(1+t)*cos(30*t)",
                           "log(2+t)/(1+t^2)",
                           "atan((t-0.5)/0.02)",
                           "asin(0.9*sin(3*t))",
                           "acos(t/3)",
                           "sinh(2*t)*exp(-t)",
                           "asinh(20*(t-0.3))",
                           "acosh(2+t)",
                           "atanh(0.9*t)",
                           "tan(t)",
                           "2^(-30*t)",
                           "(1+t)^(2*t)",
                           "atan2(t-0.5, 1+t)",
                           "t < 0.5 ? exp(-((t-0.2)/0.01)^2)*sin(50*t) : 0",
                           "log10(1+t)*log2(3+t)",
                           "(t-0.5)^7",
                           "abs(t-2)*t"}) {
    Expression f(text);
    f.freeze(0.3);
    const FunctionScan value(text, 0, 0.0, 0.6), bend(text, 2, 0.0, 0.6);
    for (int box = 0; box < 200; ++box) {
      const double width = std::pow(10.0, -4 * share(random)) * 0.5, lo = share(random) * (0.99 - width), hi = lo + width;
      const FunctionBounds b = value.bounds(lo, hi);
      double low = 1e300, high = -1e300;
      for (int i = 0; i < 20; ++i) {
        const TimeJet j = f.jet(lo + width * share(random));
        low = std::min(low, j.value);
        high = std::max(high, j.value);
        EXPECT_LE(std::abs(j.rate), b.slope * (1 + 1e-9) + 1e-290) << text << " " << lo << " " << hi;
        EXPECT_LE(std::abs(j.acceleration), b.bend * (1 + 1e-9) + 1e-290) << text << " " << lo << " " << hi;
        EXPECT_LE(std::abs(j.acceleration), bend.bounds(lo, hi).size * (1 + 1e-9) + 1e-290) << text << " " << lo << " " << hi;
      }
      EXPECT_LE(high - low, b.varies + 1e-12) << text << " " << lo << " " << hi;
      if (hi - lo > 1e-3) continue;
      // Third and fourth derivative by differences of the second.
      const double m = 0.5 * (lo + hi), d = 1e-4, ddd = (f.jet(m + d).acceleration - f.jet(m - d).acceleration) / (2 * d);
      EXPECT_LE(std::abs(ddd), bend.bounds(m - d, m + d).slope * (1 + 1e-6) + 1e-6) << text;
    }
  }
}

// What a box may be so that steps of usual length are never shortened, and how far a pulse lets a step go.
TEST(FunctionScan, ShowsWavesAndFindsPulses) {
  const auto scan = [](const std::string& text, int derivative = 0) { return FunctionScan(text, derivative, 0, 10); };
  EXPECT_TRUE(scan("sin(5*t)").shows(1, 1.5));
  EXPECT_TRUE(scan("100*(1-exp(-t/0.2))").shows(0, 0.4));
  EXPECT_TRUE(scan("3*t").shows(0, 10));
  EXPECT_TRUE(scan("7").shows(0, 10));
  EXPECT_FALSE(scan("sin(5*t)").shows(0, 10));
  for (const double width : {1.0, 1e-2, 1e-4, 1e-6, 1e-8}) {
    FunctionScan pulse = scan(fmt::format("7*exp(-((t-6.123)/{})^2)", width));
    EXPECT_NEAR(pulse.peak(), 7, 3.6) << width;
    double t = 0;
    int steps = 0, inside = 0;
    while (t < 10 && ++steps < 2000) {
      t = std::min(10.0, pulse.limit(t, 0, 10));
      inside += std::abs(t - 6.123) < 2 * width;
    }
    EXPECT_GE(inside, 2) << width;
    EXPECT_LT(steps, 300) << width;
  }
  // A drive: on a steady turn a tremor that moves a micrometre and accelerates by 200 m/s^2.
  EXPECT_FALSE(scan("10*t + 1e-6*exp(-((t-5)/1e-4)^2)", 2).shows(0, 10));
}

// Force on a mass of 1 kg: its speed is the impulse, by Simpson's rule on a mesh of its own.
TEST(FunctionScan, ImpulsesArriveByEveryMethod) {
  struct Case {
    std::string text;
    double centre, width;
  };
  std::vector<Case> cases;
  for (const double width : {0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    cases.push_back({fmt::format("exp(-((t-0.6180339)/{0})^2)/{0}", width), 0.6180339, width});
    cases.push_back({fmt::format("1/({0}*cosh((t-0.3141592)/{0}))", width), 0.3141592, width});
    cases.push_back({fmt::format("1 + exp(-((t-0.55)/{0})^2)*cos((t-0.55)/{0})/{0}", width), 0.55, width});
  }
  cases.push_back({"5*sin(3*t)^200", 0.5235988, 0.03});
  for (const Case& c : cases)
    for (const Method method : {Method::automatic, Method::adams, Method::bdf, Method::erk, Method::dirk}) {
      const std::string scene =
          head(1, Vec3(0, 0, 0), 10) + "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" +
          joint("slide", "prismatic", "ground", "block", "") +
          fmt::format("[[force]]\nkind = \"force\"\non = \"block\"\ndirection = [0, 0, 1]\nvalue = \"{}\"\n", c.text) +
          output("v", "slide", "rate");
      const Results r = run(scene, 1e-6, method);
      const Expression f(c.text);
      // Coarse outside, fine around the pulse.
      const auto simpson = [&](double lo, double hi, int n) {
        double sum = f.value(lo) + f.value(hi);
        for (int i = 1; i < 2 * n; ++i) sum += (i % 2 ? 4 : 2) * f.value(lo + (hi - lo) * i / (2 * n));
        return sum * (hi - lo) / (6 * n);
      };
      const double a = std::max(0.0, c.centre - 40 * c.width), b = std::min(1.0, c.centre + 40 * c.width);
      const double impulse = simpson(0, a, 2000) + simpson(a, b, 20000) + simpson(b, 1, 2000);
      EXPECT_NEAR(last(r, "v"), impulse, 1e-3 * std::abs(impulse)) << c.text << " " << method_name(method);
    }
}

// A drive that twitches, a peak in a table of time, one over a coordinate, a load along a beam: each acts on an oscillator or a mass as its
// integral says.
TEST(FunctionScan, DrivesTablesAndDistributedLoads) {
  const std::string mass = "[[body]]\nname = \"block\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n";
  // x'' = w^2 (u - x), u a pulse of area A b sqrt(pi): amplitude w A b sqrt(pi).
  const Results driven =
      run(head(1, Vec3(0, 0, 0), 1000) + "[[body]]\nname = \"base\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 1]\n" + mass +
              joint("drive", "prismatic", "ground", "base", "motion = \"0.01*exp(-((t-0.7)/1e-4)^2)\"") +
              joint("slide", "prismatic", "base", "block", "spring = { stiffness = 100 }") + output("z", "block", "position"),
          1e-8);
  EXPECT_NEAR(column(driven, "z.z")[857], 10 * 0.01 * 1e-4 * std::sqrt(pi) * std::sin(10 * 0.157), 3e-8);
  // A peak of 1000 N at one of many points 1 ms apart: the integral of a cubic spline through even points is their trapezoidal sum, 1 Ns.
  std::string peak = "[[0, 0]";
  for (int k = 0; k <= 120; ++k) peak += fmt::format(", [{:.3f}, {}]", 0.44 + 1e-3 * k, k == 60 ? 1000 : 0);
  peak += ", [2, 0]]";
  const std::string force = "[[force]]\nkind = \"force\"\non = \"block\"\ndirection = [0, 0, 1]\nvalue = { table = " + peak;
  for (const Method method : {Method::automatic, Method::erk, Method::dirk, Method::bdf}) {
    const Results table = run(head(1, Vec3(0, 0, 0), 10) + mass + joint("slide", "prismatic", "ground", "block", "") + force + " }\n" +
                                  output("v", "slide", "rate"),
                              1e-6, method);
    EXPECT_NEAR(last(table, "v"), 1, 1e-3) << method_name(method);
    // Over a coordinate, at 10 m/s: 1/2 (v^2 - v0^2) is the area over the way.
    const Results way =
        run(head(0.1, Vec3(0, 0, 0), 100) + mass + joint("slide", "prismatic", "ground", "block", "initial = { rate = 10 }") + force +
                ", of = \"slide\" }\n" + output("v", "slide", "rate"),
            1e-6, method);
    EXPECT_NEAR(0.5 * (last(way, "v") * last(way, "v") - 100), 1, 4e-3) << method_name(method);
  }
}

}  // namespace
}  // namespace flexframe::sim::test_function_scan
