#include "sim/expression.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace flexframe::sim;

namespace {

double value_of(const char* text, double t = 0.3) { return Expression(text).value(t); }

}  // namespace

TEST(Expression, Values) {
  EXPECT_EQ(value_of("-2^2"), -4.0);
  EXPECT_EQ(value_of("2^3^2"), 512.0);
  EXPECT_EQ(value_of("2^-2"), 0.25);
  EXPECT_EQ(value_of("t < 1 ? 2 : 3"), 2.0);
  EXPECT_EQ(value_of("t <= 0.7 ? 0.01*(1 - exp(-t/0.167)) : 0"), 0.01 * (1.0 - std::exp(-0.3 / 0.167)));
}

TEST(ExpressionSwitches, TorqueThatEnds) {
  const auto times = Expression("t <= 0.7 ? 0.01*(1 - exp(-t/0.167)) : 0").switch_times(0.0, 1.6);
  ASSERT_EQ(times.size(), 1u);
  EXPECT_EQ(times[0], 0.7);
}
