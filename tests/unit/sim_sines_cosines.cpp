// Sines and cosines of many angles: against those of the standard library in higher precision, for angles of all sizes and numbers of them.
#include "sim/base/sines_cosines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace flexframe::sim::test_sines_cosines {
namespace {

void expect_right(const std::vector<double>& angles) {
  std::vector<double> sines = angles, cosines(angles.size());
  sines_cosines(sines.data(), static_cast<int>(angles.size()), sines.data(), cosines.data());
  for (size_t i = 0; i < angles.size(); ++i) {
    const auto angle = static_cast<long double>(angles[i]);
    EXPECT_NEAR(sines[i], static_cast<double>(std::sin(angle)), 3e-16) << angles[i];
    EXPECT_NEAR(cosines[i], static_cast<double>(std::cos(angle)), 3e-16) << angles[i];
  }
}

TEST(SinesCosines, AreRightForAnglesOfAllSizes) {
  std::mt19937 engine(11);
  for (int decade = -12; decade <= 9; ++decade) {
    const double most = std::pow(10.0, decade);
    std::uniform_real_distribution<double> any(-most, most);
    std::vector<double> angles(2000);
    for (double& angle : angles) angle = any(engine);
    expect_right(angles);
  }
}

TEST(SinesCosines, AreRightAboutQuarterTurns) {
  std::vector<double> angles;
  for (int quarter = -1000; quarter <= 636000; quarter += 1 + std::abs(quarter) / 50) {
    const double angle = quarter * 0.5 * std::numbers::pi;
    for (const double near : {angle, std::nextafter(angle, 1e9), std::nextafter(angle, -1e9), angle + 0.25 * std::numbers::pi})
      angles.push_back(near);
  }
  expect_right(angles);
}

TEST(SinesCosines, TakeAnyNumberOfAnglesAndSmallOnesExactly) {
  for (int count = 0; count < 12; ++count) {
    std::vector<double> angles(count + 1, 7.0), cosines(count + 1, 7.0);
    for (int i = 0; i < count; ++i) angles[i] = 1e-9 * i;
    sines_cosines(angles.data(), count, angles.data(), cosines.data());
    for (int i = 0; i < count; ++i) {
      EXPECT_EQ(angles[i], 1e-9 * i);
      EXPECT_EQ(cosines[i], 1.0);
    }
    EXPECT_EQ(angles[count], 7.0) << "written beyond the end";
    EXPECT_EQ(cosines[count], 7.0) << "written beyond the end";
  }
}

TEST(SinesCosines, OfWhatIsNoAngleAreNoNumbers) {
  const double infinite = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  const double angles[5] = {0.5, infinite, -infinite, none, 1e300};
  double sines[5], cosines[5];
  sines_cosines(angles, 5, sines, cosines);
  EXPECT_NEAR(sines[0], std::sin(0.5), 3e-16);
  for (int i = 1; i < 4; ++i) EXPECT_TRUE(std::isnan(sines[i]) && std::isnan(cosines[i])) << angles[i];
  EXPECT_NEAR(sines[4] * sines[4] + cosines[4] * cosines[4], 1.0, 1e-15);
  EXPECT_EQ(sines[4], std::sin(1e300));
}

}  // namespace
}  // namespace flexframe::sim::test_sines_cosines
