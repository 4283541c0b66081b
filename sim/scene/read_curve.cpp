#include "sim/scene/read_curve.h"

#include "sim/scene/expression.h"
#include "sim/scene/parameters.h"
#include "sim/scene/readings.h"
#include "sim/scene/unit_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace flexframe::sim {
namespace {

// Points of a curve that is given by expressions: of a circle its spline is then within 1e-9 of the radius. A curve that winds more gets
// more: beyond so much of a turn (rad) from point to point, on more than so large a share of it (corners stay what they are), the spline's
// bend would be off by more than 1e-4.
constexpr int points_of_expressions = 400, most_points_of_expressions = 25600;
// Of the axis of a beam: a spline's tangent at its ends errs by the cube of the distance of its points, 9e-8 rad after half a circle of 400
// points, and a ring of two halves would stay open by twice that.
constexpr int points_of_axes = 4000;
constexpr double turn_of_points = 0.03, share_of_corners = 0.02;

using Place = std::function<Vec3(double)>;

// Whether n steps from one end to the other follow the curve, and their ends. Seen at unequal distances, so that a whole turn a step is no
// straight line.
bool follows(const Place& place, double from, double to, int n, std::vector<Vec3>& ends) {
  constexpr double between = 0.37;
  const double turn_squared = std::pow(std::sin(turn_of_points), 2);
  int turned = 0;
  Vec3 last = place(from), before = Vec3::Zero();
  ends.assign(1, last);
  for (int i = 1; i <= 2 * n; ++i) {
    const int whole = i / 2;
    const Vec3 now = place(from + (to - from) * (whole + (i % 2 ? between : 0.0)) / n), way = now - last;
    if (i % 2 == 0) ends.push_back(now);
    const bool bends = before.cross(way).squaredNorm() > turn_squared * before.squaredNorm() * way.squaredNorm();
    if (i > 1 && (bends || before.dot(way) < 0.0)) ++turned;
    last = now;
    before = way;
  }
  return turned <= share_of_corners * 2 * n;
}

std::vector<Vec3> given_points(const TableReader& reader) {
  const MatX rows = reader.matrix("points", any_number.in("m"));
  if (rows.cols() != 2 && rows.cols() != 3)
    reader.fail("points", fmt::format("must be rows of two numbers (x, y) or three, found {}", rows.cols()));
  std::vector<Vec3> out;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) out.emplace_back(rows(i, 0), rows(i, 1), rows.cols() == 3 ? rows(i, 2) : 0.0);
  return out;
}

// least: steps from one end to the other, or more.
std::vector<Vec3> computed_points(const TableReader& reader, bool closed, int least) {
  // u is whatever the expressions make of it: an angle, a way.
  const double from = reader.number("from", 0.0, any_number.in("*")), to = reader.number("to", 1.0, any_number.in("*"));
  if (!(to > from)) reader.fail("to", fmt::format("must be greater than 'from', {}; found {}", from, to));
  const std::vector<std::string> names{"u"};
  std::array<std::function<double(double)>, 3> xyz{[](double) { return 0.0; }, [](double) { return 0.0; }, [](double) { return 0.0; }};
  for (int k = 0; k < 3; ++k) {
    const char* const key = k == 0 ? "x" : k == 1 ? "y" : "z";
    if (!reader.has(key) && k == 2) continue;
    if (reader.required(key).type != TomlValue::Type::text) {
      xyz[k] = [value = reader.number(key, any_number.in("m"))](double) { return value; };
      continue;
    }
    try {
      const std::string text = reader.text(key);
      reader.parameters().doubt_units(text);
      doubt_parameters(reader.parameters(), text, names);
      xyz[k] = [f = Expression(reader.parameters().substitute(replace_units(text, "m").value_or(text)), names)](double u) {
        return f.value(0.0, &u);
      };
    } catch (const Error& error) {
      reader.fail(key, fmt::format("is no expression of u: {}", error.what()));
    }
  }
  const Place place = [&](double u) { return Vec3(xyz[0](u), xyz[1](u), xyz[2](u)); };
  std::vector<Vec3> out;
  // Whether steps follow the curve is seen with as few as would do.
  int n = std::min(least, points_of_expressions);
  while (!follows(place, from, to, n, out) && n < most_points_of_expressions) n *= 2;
  if (n < least) {
    out.clear();
    for (int i = 0; i <= least; ++i) out.push_back(place(from + (to - from) * i / least));
  }
  if (!closed) return out;
  double size = 0.0;
  for (const Vec3& p : out) size = std::max(size, (p - out.front()).norm());
  if (const double gap = (out.back() - out.front()).norm(); gap > 1e-6 * size)
    reader.fail("closed", fmt::format("is true, but the curve's ends at u = {} and u = {} lie {:.3g} m apart", from, to, gap));
  out.pop_back();
  return out;
}

// The curve made last serves where the points are the same: of groups that are placed several times.
std::shared_ptr<const SpaceCurve> curve_through(std::vector<Vec3> points, bool closed) {
  struct Made {
    std::vector<Vec3> points;
    std::weak_ptr<const SpaceCurve> curve;
  };
  static thread_local Made last;
  if (auto known = last.curve.lock(); known && known->closed() == closed && last.points == points) return known;
  auto made = std::make_shared<const SpaceCurve>(points, closed);
  last = {std::move(points), made};
  return made;
}

}  // namespace

std::shared_ptr<const SpaceCurve> read_curve(const TableReader& outer, std::string_view key) {
  outer.required(key);
  const TableReader reader = *outer.table(key);
  const bool closed = reader.boolean("closed", false), points = reader.has("points");
  if (points) reader.allow({"points", "closed"});
  else if (reader.has("x")) reader.allow({"x", "y", "z", "from", "to", "closed"});
  else {
    reader.allow({"points", "x", "y", "z", "from", "to", "closed"});
    reader.fail("needs 'points', rows of x, y, z (m), or 'x', 'y', 'z', expressions of u");
  }
  const int least = key == "axis" ? points_of_axes : points_of_expressions;
  try {
    return curve_through(points ? given_points(reader) : computed_points(reader, closed, least), closed);
  } catch (const InputError& error) {
    // Messages of the keys themselves have file and line already.
    const std::string what = error.what();
    if (what.starts_with(reader.file())) throw;
    outer.fail(key, fmt::format("is no curve: {}", what));
  }
}

}  // namespace flexframe::sim
