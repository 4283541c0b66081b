// A default run whose error of time is too large is made again more tightly, where nobody gave a tolerance.
#include "sim/run/second_run.h"
#include "tests/unit/cantilever.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace flexframe::sim::test_repeated_run {

namespace {

// Shaken at its tip: vibrations of several frequencies.
Results shaken(const std::string& more, const SimulateOptions& options = {}) {
  return run_cantilever("duration = 1\n" + more, "", "10*sin(40*t)", options);
}

}  // namespace

TEST(RepeatedRun, KeepsOnePerCentWhereNobodyGaveATolerance) {
  SimulateOptions alone;
  alone.estimate_error = false;
  const VecX truth = tip(shaken("tolerance = 1e-9", alone));  // 1.4e-5 of its range off, the default run 8e-4
  const double range = truth.maxCoeff() - truth.minCoeff();
  const auto error = [&](const Results& r) { return (tip(r) - truth).cwiseAbs().maxCoeff() / range; };

  // By whatever method "auto" ends with.
  EXPECT_LT(error(shaken("")), unasked_accuracy);

  const Results plain = shaken("method = \"dirk\"\n");
  EXPECT_LT(plain.statistics.tolerance, 1e-6);
  EXPECT_LT(plain.statistics.error_estimate, unasked_accuracy);
  EXPECT_LT(error(plain), unasked_accuracy);
  EXPECT_FALSE(said(plain, Severity::warning, "estimated error"));
  EXPECT_TRUE(said(plain, Severity::note, "taken: with the default one"));

  // A tolerance that was given is kept, in the scene or beside it, and its error is told.
  const Results given = shaken("method = \"dirk\"\ntolerance = 1e-6");
  EXPECT_EQ(given.statistics.tolerance, 1e-6);
  EXPECT_LT(error(plain), 0.1 * error(given));
  EXPECT_TRUE(said(given, Severity::warning, "estimated error"));
  SimulateOptions beside;
  beside.tolerance = 1e-6;
  EXPECT_EQ(shaken("", beside).statistics.tolerance, 1e-6);
  // Nothing is known of an error that is not estimated.
  EXPECT_EQ(shaken("", alone).statistics.tolerance, 1e-6);
}

// A run beside another one has a budget: what would take longer is given up as soon as that shows, and what it took is counted.
TEST(RepeatedRun, RunsBesideItKeepToABudget) {
  const Scene scene = cantilever("duration = 20\n", "", "10*sin(40*t)");
  SimulateOptions options;
  double whole = 0.0, given_up = 0.0;
  const std::optional<Histories> all = simulated_within(scene, options, 1e6, whole);
  ASSERT_TRUE(all);
  const Histories same = simulate_histories(scene, options);
  EXPECT_EQ(all->values, same.values);
  EXPECT_GT(whole, 0.0);
  EXPECT_FALSE(simulated_within(scene, options, 0.2 * whole, given_up));
  EXPECT_GT(given_up, 0.0);
  // A quarter of the budget tells, and the time to make the model; half of the budget leaves room for a busy machine.
  EXPECT_LT(given_up, 0.5 * whole);
}

// A beam under loads that grow slowly and then stay: 24 steps at the default tolerance, and the run ten times looser, which the estimate
// comes from, misses the vibration as well (0.03 told where 0.12 is true; of loads along several directions 0.02 where 0.99 is).
TEST(RepeatedRun, FewStepsAreLookedAtAgain) {
  const auto loaded = [](const std::string& more, const SimulateOptions& options = {}) {
    const std::string grows = "*(t < 0.0184 ? sin(pi*t/0.0368)^2 : 1)\"\n";
    return run_scene(
        parse_scene("[simulation]\nduration = 0.0415\noutput_rate = 7200\n" + more +
                        "[[body]]\nname = \"b\"\nkind = \"beam\"\nlength = 0.7\nsection = { shape = \"general\", area = 0.0016, iy = 8e-7, "
                        "iz = 1.6e-7, j = 4.8e-7, shear_y = 0.53, shear_z = 0.7 }\nmaterial = { density = 4430, youngs_modulus = 1.1e11, "
                        "poisson = 0.31 }\nframes = { p3 = 0.3, p8 = 0.8 }\n[[joint]]\nname = \"wall\"\nkind = \"weld\"\nparent = "
                        "\"ground\"\nchild = \"b.root\"\n[[force]]\nkind = \"force\"\non = \"b.p3\"\ndirection = [-0.12, 0.4, "
                        "0.91]\nvalue = \"257" +
                        grows + "[[force]]\nkind = \"distributed\"\non = \"b\"\ndirection = [-0.52, 0.73, -0.45]\nvalue = \"967" + grows +
                        "[[force]]\nkind = \"torque\"\non = \"b.p8\"\ndirection = [-0.13, -0.69, -0.71]\nvalue = \"124" + grows +
                        "[[output]]\nname = \"tip\"\nof = \"b.tip\"\nquantity = \"position\"\n",
                    "loaded.toml"),
        options);
  };
  SimulateOptions alone;
  alone.estimate_error = alone.check_effects = false;
  const VecX truth = tip(loaded("tolerance = 1e-10\n", alone));
  const double range = truth.maxCoeff() - truth.minCoeff();
  const auto error = [&](const Results& r) { return (tip(r) - truth).cwiseAbs().maxCoeff() / range; };

  EXPECT_LT(error(loaded("")), unasked_accuracy);
  const Results given = loaded("tolerance = 1e-6\n");
  EXPECT_EQ(given.statistics.tolerance, 1e-6);
  EXPECT_GT(error(given), 0.1);
  EXPECT_GT(5.0 * given.statistics.error_estimate, error(given));
  EXPECT_TRUE(said(given, Severity::warning, "estimated error"));
}

// A pendulum falls from beside its upper rest on a point that is shaken fast: at a loose tolerance five steps a shake, whatever the
// tolerance. Two such runs agreed to 0.003 of the range and were 0.14 off.
TEST(RepeatedRun, LooseTolerancesAreLookedAtAgain) {
  const auto shaken_pivot = [](double tolerance) {
    SimulateOptions options;
    options.tolerance = tolerance;
    options.method = Method::erk;
    return run_scene(
        parse_scene("[simulation]\nduration = 2\noutput_rate = 200\ngravity = [0, -9.81, 0]\n[[body]]\nname = \"head\"\nkind = "
                    "\"rigid\"\nmass = 0.5\n[[body]]\nname = \"bob\"\nkind = \"rigid\"\nmass = 0.1\ninertia = [1e-9, 1e-9, "
                    "1e-9]\ncentre_of_mass = [0, -0.1, 0]\n[[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nparent = "
                    "\"ground\"\nchild = \"head\"\naxis = [0, 1, 0]\nmotion = \"0.008*sin(120*t)\"\n[[joint]]\nname = "
                    "\"pin\"\nkind = \"revolute\"\nparent = \"head\"\nchild = \"bob\"\ninitial = { value = 2.9416, rate = 0 "
                    "}\n[[output]]\nname = \"angle\"\nof = \"pin\"\nquantity = \"value\"\n",
                    "pivot.toml"),
        options);
  };
  const VecX truth = column(shaken_pivot(1e-11), "angle");
  const double range = truth.maxCoeff() - truth.minCoeff();
  for (const double tolerance : {1e-2, 3e-3, 1e-3, 5e-4, 2e-4}) {
    const Results made = shaken_pivot(tolerance);
    const double error = (column(made, "angle") - truth).cwiseAbs().maxCoeff() / range;
    // The claim of a run: tests/trust.
    EXPECT_TRUE(error <= unasked_accuracy + 5.0 * made.statistics.error_estimate || said(made, Severity::warning, "estimated error"))
        << tolerance << ": " << error;
  }
}

}  // namespace flexframe::sim::test_repeated_run
