// Numbers beside the axes of diagrams: each tells the place where it stands.
#include "render/film/flat.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <string>

namespace flexframe::film::test_flat {
namespace {

TEST(FlatTicks, NumbersAreThoseOfTheirPlaces) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (int k = 0; k < 2000; ++k) {
    // From 1e-9 to 1e9, as wide as the number is large or as little as a thousandth of it, on either side of zero.
    const double size = std::pow(10.0, 18.0 * part(random) - 9.0), wide = size * std::pow(10.0, -3.0 * part(random));
    const double low = (part(random) < 0.5 ? -1.0 : 1.0) * size * part(random);
    const FlatAxis axis = flat_axis(low, low + wide, true);
    std::set<std::string> words;
    const std::vector<double> ticks = flat_ticks(axis);
    for (const double t : ticks) {
      const std::string word = flat_tick_text(t);
      EXPECT_NEAR(std::stod(word), t, 0.1 * (axis.high - axis.low) / static_cast<double>(ticks.size())) << word;
      words.insert(word);
    }
    EXPECT_EQ(words.size(), ticks.size()) << low << " to " << low + wide;
  }
}

TEST(FlatTicks, WordsAreShort) {
  EXPECT_EQ(flat_tick_text(0.0095), "9.5e-03");
  EXPECT_EQ(flat_tick_text(0.001), "1e-03");
  EXPECT_EQ(flat_tick_text(12000.0), "1.2e+04");
  EXPECT_EQ(flat_tick_text(-0.00125), "-1.25e-03");
  EXPECT_EQ(flat_tick_text(0.25), "0.25");
}

}  // namespace
}  // namespace flexframe::film::test_flat
