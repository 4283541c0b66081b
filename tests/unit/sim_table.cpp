// Tables: splines against cubics, closed curves, what is refused; as motion and as a force over a coordinate.
#include "sim/scene/scene_reader.h"
#include "sim/scene/table.h"
#include "sim/simulate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexframe::sim::test_table {
namespace {

TEST(Table, ReproducesACubicWithItsDerivatives) {
  const auto f = [](double x) { return 2 - x + 0.5 * x * x - 0.3 * x * x * x; };
  for (const std::vector<double>& x : {std::vector<double>{-1, 0.2, 0.9, 2.5}, {-2, -1.7, 0, 0.1, 1, 3}}) {
    std::vector<double> y;
    for (double v : x) y.push_back(f(v));
    const CubicTable table(x, y, {});
    for (double t = x.front(); t <= x.back(); t += 0.037) {
      const TimeJet j = table.jet(t);
      EXPECT_NEAR(j.value, f(t), 1e-12);
      EXPECT_NEAR(j.rate, -1 + t - 0.9 * t * t, 1e-11);
      EXPECT_NEAR(j.acceleration, 1 - 1.8 * t, 1e-10);
    }
    EXPECT_EQ(table.value(x.front() - 1), y.front());
    EXPECT_EQ(table.value(x.back() + 1), y.back());
  }
}

TEST(Table, ClosesSmoothlyWithAPeriodAndConvergesWithOrderFour) {
  const double period = 2 * std::numbers::pi;
  double last = 0.0;
  for (const int n : {12, 24, 48}) {
    std::vector<double> x, y;
    for (int i = 0; i < n; ++i) x.push_back(0.3 + period * i / n), y.push_back(std::sin(x.back()));
    const CubicTable table(x, y, period);
    double error = 0.0;
    for (double t = -20; t < 20; t += 0.013) error = std::max(error, std::abs(table.value(t) - std::sin(t)));
    if (last > 0.0) {
      EXPECT_NEAR(std::log2(last / error), 4.0, 0.25);
    }
    last = error;
    const TimeJet a = table.jet(0.3 - 1e-9), b = table.jet(0.3 + 1e-9);
    EXPECT_NEAR(a.rate, b.rate, 1e-7);
    EXPECT_NEAR(a.acceleration, b.acceleration, 1e-7);
  }
}

// Tables end at their period but for the digits in which both are written; the seam is as smooth as the rest.
TEST(Table, EndsAtItsPeriodButForDigits) {
  for (const double off : {0.0, 1e-15, -1e-15, 3e-8, -3e-8, 2e-5, -2e-5}) {
    const double period = 2 * std::numbers::pi;
    std::vector<double> x, y;
    for (int i = 0; i <= 48; ++i) x.push_back(0.3 + (period + off) * i / 48), y.push_back(std::sin(0.3 + period * i / 48));
    const CubicTable table(x, y, period);
    for (double t = -10; t < 10; t += 0.013) EXPECT_NEAR(table.value(t), std::sin(t), std::abs(off) + 2e-6) << off;
    EXPECT_NEAR(table.jet(x.front()).rate, std::cos(0.3), 1e-4) << off;
  }
  EXPECT_THROW(CubicTable({0, 1, 2, 3}, {1, 2, 3, 1.1}, 3.0 + 1e-9), InputError);
  EXPECT_THROW(CubicTable({0, 1, 2, 3}, {1, 2, 3, 1}, 2.99), InputError);
}

TEST(Table, RefusesWhatIsNoFunction) {
  EXPECT_THROW(CubicTable({0}, {1}, {}), InputError);
  EXPECT_THROW(CubicTable({0, 1, 1}, {1, 2, 3}, {}), InputError);
  EXPECT_THROW(CubicTable({0, 1, 2}, {1, 2, 3}, 1.5), InputError);
  EXPECT_THROW(CubicTable({0, 1, 2}, {1, 2, 3}, 2.0), InputError);
  EXPECT_THROW(CubicTable({0, 1}, {1, 2}, 3.0), InputError);
}

Results run(const std::string& text) {
  SimulateOptions options;
  options.tolerance = 1e-9;
  options.estimate_error = false;
  return simulate(parse_scene(text, "table.toml"), options);
}

const char* disc =
    "[[body]]\nname = \"disc\"\nkind = \"rigid\"\nmass = 1\ninertia = [1, 1, 2]\n"
    "[[joint]]\nname = \"shaft\"\nkind = \"revolute\"\nparent = \"ground\"\nchild = \"disc\"\n";

// A step between points that lie close together makes the curve swing far beyond them.
TEST(Table, TellsWhereItsCurveLeavesItsValues) {
  const auto warns = [](const std::string& table) {
    const Results r =
        run(std::string("[simulation]\nduration = 1\n") + disc +
            "[[force]]\nname = \"push\"\nkind = \"torque\"\non = \"disc\"\ndirection = [0, 0, 1]\nvalue = { table = " + table + " }\n");
    const std::vector<std::string> told = r.statistics.notes.texts(Severity::warning);
    return std::any_of(told.begin(), told.end(),
                       [](const std::string& s) { return s.find("'push': the smooth curve") != std::string::npos; });
  };
  EXPECT_TRUE(warns("[[0, 0], [0.5, 0], [0.5001, 1], [1, 1]]"));
  EXPECT_TRUE(warns("[[0, 0], [0.1, 1], [0.9, 1], [1, 0]]"));  // a cubic through four points: up to 2.8
  EXPECT_TRUE(warns("[[0, 0], [0.1, 1], [0.9, 1]], period = 1"));
  EXPECT_FALSE(warns("[[0, 0], [0.2, 0], [0.4, 0], [0.6, 1], [0.8, 1], [1, 1]]"));
  EXPECT_FALSE(warns("[[0, 0], [0.5, 1], [1, 0]]"));
  EXPECT_FALSE(warns("[[0, 0], [0.25, 1], [0.5, 0], [0.75, -1]], period = 1"));
}

// A prescribed parabola: its value, rate and drive torque J a.
TEST(Table, PrescribesAMotion) {
  const Results r =
      run(std::string("[simulation]\nduration = 1\noutput_rate = 10\n") + disc + "motion = { table = [[0, 0], [0.5, 0.75], [1, 3]] }\n" +
          "[[output]]\nname = \"v\"\nof = \"shaft\"\nquantity = \"rate\"\n[[output]]\nname = \"m\"\nof = \"shaft\"\nquantity = "
          "\"reaction\"\nframe = \"child\"\n");
  for (Eigen::Index i = 0; i < r.times.size(); ++i) {
    EXPECT_NEAR(r.outputs[0].values[i], 6 * r.times[i], 1e-12);
    EXPECT_NEAR(r.outputs[6].values[i], 2 * 6.0, 1e-10);
    // What the drive supplied is the kinetic energy.
    EXPECT_NEAR(r.supplied[i], r.kinetic[i] - r.kinetic[0], 1e-7);
  }
}

// A torque -9 x against the angle is a spring: it swings with sqrt(9/2).
TEST(Table, DrivesByACoordinate) {
  const Results r = run(
      std::string("[simulation]\nduration = 3\noutput_rate = 10\n") + disc + "initial = { value = 0.4 }\n" +
      "[[force]]\nkind = \"torque\"\non = \"disc\"\ndirection = [0, 0, 1]\nvalue = { table = [[-1, 9], [0, 0], [1, -9]], of = \"shaft\" }\n"
      "[[output]]\nname = \"a\"\nof = \"shaft\"\nquantity = \"value\"\n");
  for (Eigen::Index i = 0; i < r.times.size(); ++i) EXPECT_NEAR(r.outputs[0].values[i], 0.4 * std::cos(std::sqrt(4.5) * r.times[i]), 1e-7);
}

// A cubic is met exactly by its spline, wherever its points lie: the interval of an argument is found among very uneven ones too.
TEST(Table, FindsItsPlaceAmongUnevenPoints) {
  const auto cubic = [](double x) { return 2.0 + x * (0.5 + x * (-3.0 + 0.25 * x)); };
  std::vector<double> x{-1.0}, y;
  for (double step = 1e-4; x.size() < 40; step *= 1.3) x.push_back(x.back() + step);
  for (int k = 0; k < 30; ++k) x.push_back(x.back() + 1e-3);
  for (const double at : x) y.push_back(cubic(at));
  const CubicTable table(x, y, std::nullopt);
  for (size_t i = 0; i + 1 < x.size(); ++i)
    for (const double share : {0.0, 0.3, 0.99, 1.0}) {
      const double at = x[i] + share * (x[i + 1] - x[i]);
      EXPECT_NEAR(table.value(at), cubic(at), 1e-10 * std::abs(cubic(at)) + 1e-12) << i << " " << share;
    }
}

}  // namespace
}  // namespace flexframe::sim::test_table
