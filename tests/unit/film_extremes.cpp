// The smallest value that a face shows may lie between its corners.
#include "render/film/extremes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace flexframe::film::test_extremes {
namespace {

using Corners = std::array<std::array<double, 6>, 3>;

double length_at(const Corners& c, double u, double v, double w) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    const double x = u * c[0][k] + v * c[1][k] + w * c[2][k];
    sum += x * x;
  }
  return std::sqrt(sum);
}

TEST(Extremes, LeastLengthWithinATriangle) {
  // A turning plate: speed by the distance from the axis, which goes through the triangle, an edge, or beside it.
  const auto turning = [](double x, double y) {
    return Corners{{{-(0.0 - y), 0.0 - x, 0, 0, 0, 0}, {-(0.0 - y), 1.0 - x, 0, 0, 0, 0}, {-(1.0 - y), 0.0 - x, 0, 0, 0, 0}}};
  };
  EXPECT_NEAR(least_within(turning(0.25, 0.25)).length, 0.0, 1e-15);
  EXPECT_NEAR(least_within(turning(0.25, 0.25)).shares[0], 0.5, 1e-12);
  EXPECT_NEAR(least_within(turning(0.5, 0.0)).length, 0.0, 1e-15);
  EXPECT_NEAR(least_within(turning(1.0, 1.0)).length, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(least_within(turning(-3.0, 0.0)).length, 3.0, 1e-12);

  // Against a fine grid of places, in six components as stress has.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (int k = 0; k < 200; ++k) {
    Corners c{};
    for (auto& corner : c)
      for (double& x : corner) x = number(random) + (k % 2 ? 0.0 : 0.3);
    double least = 1e9;
    constexpr int n = 100;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) least = std::min(least, length_at(c, 1.0 - double(i + j) / n, double(i) / n, double(j) / n));
    const LeastWithin found = least_within(c);
    EXPECT_LE(found.length, least + 1e-12);
    EXPECT_GE(found.length, least - 5e-3);
    EXPECT_NEAR(found.length, length_at(c, found.shares[0], found.shares[1], found.shares[2]), 1e-12);
  }
  // Corners in one place, or all alike.
  const Corners same{{{3, 4, 0, 0, 0, 0}, {3, 4, 0, 0, 0, 0}, {3, 4, 0, 0, 0, 0}}};
  EXPECT_NEAR(least_within(same).length, 5.0, 1e-14);
}

}  // namespace
}  // namespace flexframe::film::test_extremes
