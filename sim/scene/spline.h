// Cubic splines through points (table.h): their second derivatives, and values between two points that are known.
#pragma once

#include "sim/scene/expression.h"

#include <vector>

namespace flexframe::sim {

// Second derivatives at the points of the spline with the end conditions of table.h. x ascending strictly, as many y; closed: the last
// point is the first one again, and there are four or more. Y: double or Vec3. Throws InputError.
template <class Y>
std::vector<Y> spline_curvatures(const std::vector<double>& x, const std::vector<Y>& y, bool closed);

// The interval of ascending values in which x lies, from x.front() to x.back(). Values are spaced evenly as a rule: looked for beside where
// that puts x, a few steps, before the whole is halved again and again.
size_t interval_of(const std::vector<double>& values, double x);

// Value, slope and curvature at `at`, which lies between the points i and i + 1.
inline TimeJet spline_jet(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& m, size_t i, double at) {
  const double h = x[i + 1] - x[i], a = x[i + 1] - at, b = at - x[i];
  const double slope = (y[i + 1] - y[i]) / h;
  TimeJet out;
  out.value = y[i] + slope * b - a * b / 6.0 * (m[i] * (1.0 + a / h) + m[i + 1] * (1.0 + b / h));
  out.rate = slope + ((h * h - 3.0 * a * a) * m[i] + (3.0 * b * b - h * h) * m[i + 1]) / (6.0 * h);
  out.acceleration = (m[i] * a + m[i + 1] * b) / h;
  return out;
}

}  // namespace flexframe::sim
