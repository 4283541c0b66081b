#include "render/film/polygon.h"
#include "sim/base/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace test_polygon {
namespace {

using flexframe::film::Loop;
using flexframe::film::signed_area;
using flexframe::film::triangulate_polygon;

Loop circle(double radius, int sides, double x = 0.0, double y = 0.0) {
  Loop loop;
  for (int i = 0; i < sides; ++i)
    loop.emplace_back(x + radius * std::cos(2 * M_PI * i / sides), y + radius * std::sin(2 * M_PI * i / sides));
  return loop;
}

// Area of the triangles; fails where one is turned over.
double covered(const std::vector<Loop>& loops) {
  std::vector<Eigen::Vector2d> points;
  for (const Loop& loop : loops) points.insert(points.end(), loop.begin(), loop.end());
  double area = 0.0;
  for (const auto& t : triangulate_polygon(loops)) {
    const double one = signed_area({points[t[0]], points[t[1]], points[t[2]]});
    EXPECT_GT(one, 0.0);
    area += 0.5 * one;
  }
  return area;
}

double expected(const std::vector<Loop>& loops) {
  double area = 0.0;
  for (size_t l = 0; l < loops.size(); ++l) area += (l == 0 ? 0.5 : -0.5) * std::abs(signed_area(loops[l]));
  return area;
}

TEST(Polygon, CoversItsAreaOnce) {
  const Loop i_section = {{-5, -3}, {-4, -3}, {-4, -0.2}, {4, -0.2}, {4, -3}, {5, -3},
                          {5, 3},   {4, 3},   {4, 0.2},   {-4, 0.2}, {-4, 3}, {-5, 3}};
  const std::vector<std::vector<Loop>> cases = {
      {{{0, 0}, {1, 0}, {0, 1}}},
      {circle(1.0, 64)},
      {i_section},
      {circle(1.0, 64), circle(0.9, 64)},
      {circle(1.0, 64), circle(0.999, 64)},
      {{{-2, -1}, {2, -1}, {2, 1}, {-2, 1}}, {{-1.9, -0.9}, {1.9, -0.9}, {1.9, 0.9}, {-1.9, 0.9}}},
      {{{-2, -1}, {2, -1}, {2, 1}, {-2, 1}}, circle(0.3, 12, -1.0), circle(0.3, 12, 1.0), circle(0.2, 9)},
      {{{0, 0}, {2, 0}, {2, 2}, {1, 0.5}, {0, 2}}},
  };
  for (const auto& loops : cases) EXPECT_NEAR(covered(loops), expected(loops), 1e-12 * expected(loops));
}

TEST(Polygon, SenseOfRotationDoesNotMatter) {
  std::vector<Loop> loops = {circle(1.0, 16), circle(0.5, 16)};
  const double area = covered(loops);
  for (Loop& loop : loops) std::reverse(loop.begin(), loop.end());
  EXPECT_NEAR(covered(loops), area, 1e-12);
}

TEST(Polygon, RefusesWhatIsNone) {
  EXPECT_THROW(triangulate_polygon({{{0, 0}, {1, 0}}}), flexframe::ArgumentError);
  EXPECT_THROW(triangulate_polygon({circle(1.0, 16), {{0, 0}, {1, 1}}}), flexframe::ArgumentError);
}

}  // namespace

}  // namespace test_polygon
