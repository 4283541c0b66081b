// Values sampled along a step: parabolas come back, oscillations are averaged, vibrations are shaken as closed forms say.
#include "sim/time/sampled_remainder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace flexframe::sim::test_sampled_remainder {
namespace {

MatX sampled(Eigen::Index places, const std::function<double(double)>& value) {
  MatX out(1, places + 1);
  for (Eigen::Index i = 0; i <= places; ++i) out(0, i) = value(static_cast<double>(i) / static_cast<double>(places));
  return out;
}

TEST(SampledRemainder, GivesParabolasBack) {
  const auto parabola = [](double theta) { return 3.0 - 2.0 * (2.0 * theta - 1.0) + 0.7 * std::pow(2.0 * theta - 1.0, 2); };
  const MatX values = sampled(8, parabola), twice = spread(values);
  const Eigen::RowVector3d wanted(3.0, -2.0, 0.7);
  EXPECT_LT((closest_parabola(values) - wanted).norm(), 1e-13);
  EXPECT_LT((closest_parabola(values, 4) - wanted).norm(), 1e-13);
  ASSERT_EQ(twice.cols(), 17);
  EXPECT_EQ(twice(0, 14), values(0, 7));
  EXPECT_EQ(twice(0, 15), 0.0);
}

// Its integrals times 1, x and x^2 are those of the values, by the trapezium rule: of cos^2 a half and little more. The rule errs by
// 61 / (12 128^2).
TEST(SampledRemainder, AveragesWhatOscillates) {
  const double radians = 61.0;
  const MatX fit = closest_parabola(sampled(128, [&](double theta) { return std::pow(std::cos(radians * theta + 0.4), 2); }));
  EXPECT_NEAR(fit(0, 0) + fit(0, 2) / 3.0, 0.5 + 0.25 * (std::sin(2.0 * radians + 0.8) - std::sin(0.8)) / radians,
              61.0 / (12.0 * 128.0 * 128.0) + 1e-5);
}

// p'' + f^2 p = cos(a t) from rest: (cos(a t) - cos(f t)) / (f^2 - a^2), t sin(f t) / (2 f) in resonance, t^2 / 2 for nothing that
// vibrates.
TEST(SampledRemainder, ShakesVibrations) {
  const double span = 0.3, a = 40.0;
  const VecX f = Eigen::Vector3d(90.0, a, 0.0);
  const Eigen::Index places = 256;
  MatX loads(3, places + 1);
  for (Eigen::Index i = 0; i <= places; ++i) {
    const double t = span * static_cast<double>(i) / static_cast<double>(places);
    loads.col(i) << std::cos(a * t), std::cos(a * t), 1.0;
  }
  const Shaken shaken = shake(f, span, loads);
  for (const double t : {0.0, 0.11, 0.2004, span}) {
    const VecX at = shaken.at(t);
    EXPECT_NEAR(at[0], (std::cos(a * t) - std::cos(f[0] * t)) / (f[0] * f[0] - a * a), 3e-7);
    EXPECT_NEAR(at[1], t * std::sin(a * t) / (2.0 * a), 1e-6);
    EXPECT_NEAR(at[2], t * t / 2.0, 1e-6);
    EXPECT_NEAR(at[3], (f[0] * std::sin(f[0] * t) - a * std::sin(a * t)) / (f[0] * f[0] - a * a), 2e-5);
    EXPECT_NEAR(at[4], (std::sin(a * t) + a * t * std::cos(a * t)) / (2.0 * a), 3e-5);
    EXPECT_NEAR(at[5], t, 1e-6);
  }
}

}  // namespace
}  // namespace flexframe::sim::test_sampled_remainder
