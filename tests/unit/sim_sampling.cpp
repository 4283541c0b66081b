// Whether samples show a motion.
#include "sim/results/sampling.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_sampling {
namespace {

// A body of two coordinates over 0.1 s, 401 samples: one stands at 0.01, the other swings by `swing` at `frequency` (Hz).
Results vibrating(double swing, double frequency) {
  Results out;
  out.times = VecX::LinSpaced(401, 0.0, 0.1);
  ResultBody body;
  body.name = "rod";
  body.q = MatX::Constant(401, 2, 0.01);
  body.qd = MatX::Zero(401, 2);
  const double omega = 2.0 * M_PI * frequency;
  for (Eigen::Index i = 0; i < 401; ++i) {
    body.q(i, 1) = swing * std::sin(omega * out.times[i]);
    body.qd(i, 1) = swing * omega * std::cos(omega * out.times[i]);
  }
  out.bodies.push_back(body);
  return out;
}

TEST(Sampling, TellsAVibrationThatIsTooFast) {
  const std::optional<FastMotion> fast = faster_than_samples(vibrating(1e-4, 3100.0));
  ASSERT_TRUE(fast.has_value());
  EXPECT_EQ(fast->owner, "body 'rod'");
  EXPECT_NEAR(fast->frequency, 3100.0, 0.15 * 3100.0);
  EXPECT_FALSE(faster_than_samples(vibrating(1e-4, 100.0)).has_value());
}

TEST(Sampling, RoundingOfWhatRestsIsNoVibration) { EXPECT_FALSE(faster_than_samples(vibrating(1e-16, 3100.0)).has_value()); }

}  // namespace
}  // namespace flexframe::sim::test_sampling
