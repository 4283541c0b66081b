// Hourglass motions of reduced integration: a bar of one layer of C3D20R is right as it is, and told of where a mass and a support at
// single nodes set off what its points do not see.
#include "deck_text.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <array>
#include <map>

namespace flexframe::sim::test_reduce_hourglass {
namespace {

// A steel bar of 3 x 1 x 1 bricks of 20 nodes, 0.8 x 0.06 x 0.04 m, held at x = 0; with a mass of 2 kg at one corner of its end, held there
// in y.
std::string bar(const std::string& element, bool point) {
  std::map<std::array<int, 3>, int> number;
  std::string nodes = "*NODE, NSET=ALL\n", elements = "*ELEMENT, TYPE=" + element + ", ELSET=BAR\n", root = "*NSET, NSET=ROOT\n";
  for (int i = 0; i <= 6; ++i)
    for (int j = 0; j <= 2; ++j)
      for (int k = 0; k <= 2; ++k) {
        if (i % 2 + j % 2 + k % 2 > 1) continue;
        const int n = static_cast<int>(number.size()) + 1;
        number[{i, j, k}] = n;
        nodes += fmt::format("{}, {}, {}, {}\n", n, 0.8 * i / 6, 0.06 * j / 2, 0.04 * k / 2);
        if (i == 0) root += fmt::format("{},\n", n);
      }
  const std::array<std::array<int, 3>, 20> places{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2}, {2, 0, 2}, {2, 2, 2},
                                                   {0, 2, 2}, {1, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 1, 0}, {1, 0, 2}, {2, 1, 2},
                                                   {1, 2, 2}, {0, 1, 2}, {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}}};
  for (int e = 0; e < 3; ++e) {
    elements += fmt::format("{}", e + 1);
    for (size_t p = 0; p < places.size(); ++p)
      elements += fmt::format(",{} {}", p == 11 ? "\n" : "", number.at({2 * e + places[p][0], places[p][1], places[p][2]}));
    elements += "\n";
  }
  const int corner = number.at({6, 0, 0});
  return nodes + elements + root +
         "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1E11, 0.3\n*DENSITY\n7850.\n*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL\n*BOUNDARY\nROOT, 1, "
         "3\n" +
         (point ? fmt::format("*ELEMENT, TYPE=MASS, ELSET=POINT\n9001, {}\n*MASS, ELSET=POINT\n2.\n*BOUNDARY\n{}, 2\n", corner, corner)
                : "");
}

Reduction of(const std::string& element, bool point) {
  const Scratch scratch;
  return reduced(read_inp(scratch.put("bar.inp", bar(element, point))), 6);
}

constexpr const char* told = "hourglass motions";

TEST(ReduceHourglass, SoundBarsAreNotToldOf) {
  const Reduction whole = of("C3D20", false), fewer = of("C3D20R", false);
  EXPECT_FALSE(says(whole.report.warnings, told));
  EXPECT_FALSE(says(fewer.report.warnings, told));
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(fewer.report.frequencies(k) / whole.report.frequencies(k), 1.0, 0.03);
}

TEST(ReduceHourglass, ToldWhereSingleNodesSetThemOff) {
  const Reduction whole = of("C3D20", true), fewer = of("C3D20R", true);
  EXPECT_FALSE(says(whole.report.warnings, told));
  // Why: the second frequency is an eighth too low.
  EXPECT_LT(fewer.report.frequencies(1), 0.9 * whole.report.frequencies(1));
  EXPECT_TRUE(says(fewer.report.warnings, told));
}

}  // namespace
}  // namespace flexframe::sim::test_reduce_hourglass
