#include "render/film/polygon.h"

#include "render/picture/ears.h"
#include "sim/base/error.h"

#include <algorithm>
#include <limits>

namespace flexframe::film {
namespace {

using Point = Eigen::Vector2d;

double cross(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// Whether the open segments ab and cd cross or touch in the inside of either; shared end points are no crossing.
bool crosses(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (a == c || a == d || b == c || b == d) return false;
  const double abc = cross(a, b, c), abd = cross(a, b, d), cda = cross(c, d, a), cdb = cross(c, d, b);
  if (((abc > 0.0) != (abd > 0.0)) && ((cda > 0.0) != (cdb > 0.0))) return true;
  const auto on = [](const Point& p, const Point& q, const Point& x, double side) { return side == 0.0 && (x - p).dot(x - q) < 0.0; };
  return on(a, b, c, abc) || on(a, b, d, abd) || on(c, d, a, cda) || on(c, d, b, cdb);
}

}  // namespace

double signed_area(const Loop& loop) {
  double area = 0.0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const Point &a = loop[i], &b = loop[(i + 1) % loop.size()];
    area += a.x() * b.y() - a.y() * b.x();
  }
  return area;
}

std::vector<std::array<int, 3>> triangulate_polygon(const std::vector<Loop>& loops) {
  std::vector<Point> points;
  std::vector<std::vector<int>> rings;
  for (const Loop& loop : loops) {
    if (loop.size() < 3) throw ArgumentError("a polygon's loop needs three corners");
    std::vector<int> ring;
    for (const Point& p : loop) {
      ring.push_back(static_cast<int>(points.size()));
      points.push_back(p);
    }
    // The outer loop runs counterclockwise, holes clockwise.
    if ((signed_area(loop) > 0.0) != rings.empty()) std::reverse(ring.begin(), ring.end());
    rings.push_back(std::move(ring));
  }

  // One loop without holes: every hole is cut open at its shortest bridge that crosses nothing.
  std::vector<int> outer = rings.empty() ? std::vector<int>{} : rings.front();
  for (size_t h = 1; h < rings.size(); ++h) {
    const std::vector<int>& hole = rings[h];
    double shortest = std::numeric_limits<double>::infinity();
    size_t from = 0, to = 0;
    for (size_t i = 0; i < outer.size(); ++i)
      for (size_t j = 0; j < hole.size(); ++j) {
        const Point &a = points[outer[i]], &b = points[hole[j]];
        const double length = (b - a).squaredNorm();
        if (length >= shortest) continue;
        bool free = true;
        const auto blocked_by = [&](const std::vector<int>& ring) {
          for (size_t k = 0; k < ring.size() && free; ++k) free = !crosses(a, b, points[ring[k]], points[ring[(k + 1) % ring.size()]]);
        };
        blocked_by(outer);
        for (size_t other = h; other < rings.size(); ++other) blocked_by(rings[other]);
        if (free) shortest = length, from = i, to = j;
      }
    if (shortest == std::numeric_limits<double>::infinity()) throw ArgumentError("a polygon's hole cannot be joined to its outline");
    std::vector<int> joined(outer.begin(), outer.begin() + static_cast<long>(from) + 1);
    for (size_t k = 0; k <= hole.size(); ++k) joined.push_back(hole[(to + k) % hole.size()]);
    joined.insert(joined.end(), outer.begin() + static_cast<long>(from), outer.end());
    outer = std::move(joined);
  }

  // Ears are clipped, the one with the best shape (largest smallest angle, by its height) first among neighbours.
  const auto turn = [&](int a, int b, int c) { return cross(points[a], points[b], points[c]); };
  const auto same = [&](int a, int b) { return points[a] == points[b]; };
  const auto height = [&](int a, int b, int c, double area) {
    const double longest =
        std::max({(points[b] - points[a]).squaredNorm(), (points[c] - points[b]).squaredNorm(), (points[a] - points[c]).squaredNorm()});
    return area < 0.0 ? -1.0 : longest > 0.0 ? area / longest : 0.0;
  };
  std::vector<std::array<int, 3>> triangles;
  while (outer.size() > 3) {
    const size_t n = outer.size();
    const size_t best = render::find_ear(outer, 0, turn, same, height);
    if (best == n) throw ArgumentError("a polygon's edges cross");
    const std::array<int, 3> ear = {outer[(best + n - 1) % n], outer[best], outer[(best + 1) % n]};
    if (turn(ear[0], ear[1], ear[2]) > 0.0) triangles.push_back(ear);
    outer.erase(outer.begin() + static_cast<long>(best));
  }
  if (outer.size() == 3 && turn(outer[0], outer[1], outer[2]) > 0.0) triangles.push_back({outer[0], outer[1], outer[2]});
  return triangles;
}

}  // namespace flexframe::film
