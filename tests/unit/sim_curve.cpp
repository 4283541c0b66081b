// The point of a curve nearest to another, and the one farthest along a direction, beside a search of the whole curve.
#include "sim/scene/curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace flexframe::sim::test_curve {
namespace {

// Points around a circle or along a wave, some stretches a hundred times as long as others.
std::vector<Vec3> uneven_points(std::mt19937& random, bool closed) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<double> u;
  for (int i = 0; i < 12; ++i) u.push_back(0.6 * (i + 0.2 * share(random)) / 12.0);
  const double crowd = 0.65 + 0.1 * share(random);
  for (int i = 0; i < 30; ++i) u.push_back(crowd + 0.002 * (i + share(random)));
  if (!closed) u.push_back(1.0);
  std::vector<Vec3> out;
  for (const double at : u) {
    const double angle = 2.0 * M_PI * at;
    out.push_back(closed ? Vec3(2.0 * std::cos(angle), std::sin(angle), 0.0) : Vec3(3.0 * at, 0.3 * std::sin(angle), 0.0));
  }
  return out;
}

TEST(Curve, NearestAndFarthestPlacesAreThoseOfTheWholeCurve) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> about(-2.5, 2.5);
  constexpr int places = 40000;
  for (const bool closed : {false, true}) {
    const SpaceCurve curve(uneven_points(random, closed), closed);
    for (int trial = 0; trial < 60; ++trial) {
      const Vec3 p(about(random), about(random), 0.0);
      double least = 1e9, farthest = -1e9;
      for (int i = 0; i <= places; ++i) {
        const Vec3 c = curve.at(curve.length() * i / places).place;
        least = std::min(least, (c - p).norm());
        farthest = std::max(farthest, c.dot(p));
      }
      EXPECT_NEAR((curve.at(curve.nearest(p)).place - p).norm(), least, 1e-6);
      EXPECT_NEAR(curve.at(curve.farthest(p)).place.dot(p), farthest, 1e-6);
    }
  }
}

}  // namespace
}  // namespace flexframe::sim::test_curve
