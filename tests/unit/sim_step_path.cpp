// The way between the ends of steps against closed solutions.
#include "sim/time/step_path.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_step_path {

namespace {

// y = (sin t, e^-t), y' = (cos t, -y1): the second rate hangs on where it is asked for.
VecX solution(double t) { return Eigen::Vector2d(std::sin(t), std::exp(-t)); }
bool rates(double t, const VecX& y, VecX& out) {
  out = Eigen::Vector2d(std::cos(t), -y[1]);
  return true;
}

// The largest error within the last of several steps, the others `ratio` times as long as the next.
double error_of(double h, double ratio, int steps) {
  StepPath path;
  std::vector<double> times{0.7};
  double step = h * std::pow(ratio, steps - 1);
  for (int k = 0; k < steps; ++k, step /= ratio) times.push_back(times.back() + step);
  for (const double t : times) {
    VecX f;
    rates(t, solution(t), f);
    path.add(t, solution(t), f);
  }
  // What a method's own interpolant of third order may say.
  const auto own = [](double t, VecX& y) { y = solution(t).array() + 1e-3; };
  double worst = 0.0;
  for (double s = 0.0; s <= 1.0; s += 0.05) {
    VecX y;
    const double t = times[times.size() - 2] + s * h;
    EXPECT_TRUE(path.at(t, rates, own, y));
    worst = std::max(worst, (y - solution(t)).cwiseAbs().maxCoeff());
  }
  return worst;
}

}  // namespace

TEST(StepPath, IsOfSixthOrder) {
  // Over two halvings: terms of sixth and eighth order may cancel at one length.
  for (const double ratio : {1.0, 0.8, 1.3})
    for (const int steps : {2, 3, 5}) {
      const double coarse = error_of(0.4, ratio, steps), fine = error_of(0.1, ratio, steps);
      EXPECT_LT(coarse, 3e-6) << ratio << ", " << steps << " steps";
      EXPECT_GT(std::log2(coarse / fine) / 2.0, 5.3) << ratio << ", " << steps << " steps";
    }
}

// After one step, or one much longer than those before, the method's own interpolant foretells, and its error counts less.
TEST(StepPath, MendsWhatTheMethodForetells) {
  EXPECT_LT(error_of(0.2, 1.0, 1), 2e-4);
  EXPECT_LT(error_of(0.2, 0.2, 3), 2e-4);
}

TEST(StepPath, SaysWhereRatesCannotBeEvaluated) {
  StepPath path;
  const auto own = [](double t, VecX& y) { y = solution(t); };
  VecX y, f;
  EXPECT_FALSE(path.at(0.5, rates, own, y));
  for (const double t : {0.0, 1.0}) {
    rates(t, solution(t), f);
    path.add(t, solution(t), f);
  }
  EXPECT_FALSE(path.at(
      0.5, [](double, const VecX&, VecX&) { return false; }, own, y));
  EXPECT_TRUE(path.at(0.5, rates, own, y));
  path.clear();
  EXPECT_TRUE(path.empty());
}

}  // namespace flexframe::sim::test_step_path
