#include "sim/scene/spline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

// Solves a tridiagonal system by elimination; lower[0] and upper[n-1] are not used. Diagonally dominant: no pivoting.
template <class Y>
std::vector<Y> solve_tridiagonal(const std::vector<double>& lower, std::vector<double> diagonal, const std::vector<double>& upper,
                                 std::vector<Y> rhs) {
  const size_t n = diagonal.size();
  if (n == 0) return rhs;
  double* const d = diagonal.data();
  Y* const r = rhs.data();
  const double *const l = lower.data(), *const u = upper.data();
  for (size_t i = 1; i < n; ++i) {
    const double f = l[i] / d[i - 1];
    d[i] -= f * u[i - 1];
    r[i] -= f * r[i - 1];
  }
  r[n - 1] /= d[n - 1];
  for (size_t i = n - 1; i-- > 0;) r[i] = (r[i] - u[i] * r[i + 1]) / d[i];
  return rhs;
}

bool is_finite(double value) { return std::isfinite(value); }
bool is_finite(const Vec3& value) { return value.allFinite(); }

double zero_of(double) { return 0.0; }
Vec3 zero_of(const Vec3&) { return Vec3::Zero(); }

}  // namespace

template <class Y>
std::vector<Y> spline_curvatures(const std::vector<double>& x, const std::vector<Y>& y, bool closed) {
  // Second derivatives m: h[i-1] m[i-1] + 2 (h[i-1] + h[i]) m[i] + h[i] m[i+1] = 6 (slope[i] - slope[i-1]).
  const size_t n = x.size() - 1;  // intervals
  std::vector<double> h(n);
  std::vector<Y> slope(n);
  for (size_t i = 0; i < n; ++i) h[i] = x[i + 1] - x[i], slope[i] = (y[i + 1] - y[i]) / h[i];
  std::vector<Y> m(n + 1, zero_of(Y{}));
  if (closed && n < 3) throw InputError(fmt::format("a periodic table needs three points or more in its period, found {}", n));
  if (closed) {
    // Cyclic: n unknowns by Sherman and Morrison's rank-one update of a tridiagonal matrix.
    std::vector<double> lower(n), diagonal(n), upper(n);
    std::vector<Y> rhs(n);
    for (size_t i = 0; i < n; ++i) {
      const size_t before = i == 0 ? n - 1 : i - 1;
      lower[i] = h[before];
      diagonal[i] = 2.0 * (h[before] + h[i]);
      upper[i] = h[i];
      rhs[i] = 6.0 * (slope[i] - slope[before]);
    }
    const double corner = h[n - 1], gamma = -diagonal[0];
    diagonal[0] -= gamma;
    diagonal[n - 1] -= corner * corner / gamma;
    std::vector<double> u(n, 0.0);
    u[0] = gamma;
    u[n - 1] = corner;
    const std::vector<Y> a = solve_tridiagonal(lower, diagonal, upper, rhs);
    const std::vector<double> b = solve_tridiagonal(lower, diagonal, upper, u);
    const Y f = (a[0] + a[n - 1] * corner / gamma) / (1.0 + b[0] + b[n - 1] * corner / gamma);
    for (size_t i = 0; i < n; ++i) m[i] = a[i] - f * b[i];
    m[n] = m[0];
  } else if (n == 2) {
    // One parabola through three points.
    m.assign(3, Y(2.0 * (slope[1] - slope[0]) / (h[0] + h[1])));
  } else if (n > 2) {
    // Not-a-knot: the third derivative is continuous at the second point and the last but one; the end values are eliminated.
    const size_t k = n - 1;
    // Below and above the diagonal stand h[i] and h[i + 1] but for two numbers: no rows of their own.
    const double above = (h[1] * h[1] - h[0] * h[0]) / h[1], below = (h[k - 1] * h[k - 1] - h[k] * h[k]) / h[k - 1];
    std::vector<double> d(k);
    Y* const r = m.data() + 1;
    for (size_t i = 0; i < k; ++i) {
      d[i] = 2.0 * (h[i] + h[i + 1]);
      r[i] = 6.0 * (slope[i + 1] - slope[i]);
    }
    d[0] = (h[0] + h[1]) * (h[0] + 2.0 * h[1]) / h[1];
    d[k - 1] = (h[k] + h[k - 1]) * (h[k] + 2.0 * h[k - 1]) / h[k - 1];
    for (size_t i = 1; i < k; ++i) {
      const double f = (i == k - 1 ? below : h[i]) / d[i - 1];
      d[i] -= f * (i == 1 ? above : h[i]);
      r[i] -= f * r[i - 1];
    }
    r[k - 1] /= d[k - 1];
    for (size_t i = k - 1; i-- > 0;) r[i] = (r[i] - (i == 0 ? above : h[i + 1]) * r[i + 1]) / d[i];
    m[0] = m[1] - h[0] / h[1] * (m[2] - m[1]);
    m[n] = m[n - 1] + h[n - 1] / h[n - 2] * (m[n - 1] - m[n - 2]);
  }
  for (const Y& v : m)
    if (!is_finite(v)) throw InputError("the points of a table lie too close together or too far apart for finite curvatures");
  return m;
}

template std::vector<double> spline_curvatures(const std::vector<double>& x, const std::vector<double>& y, bool closed);
template std::vector<Vec3> spline_curvatures(const std::vector<double>& x, const std::vector<Vec3>& y, bool closed);

size_t interval_of(const std::vector<double>& values, double x) {
  const size_t last = values.size() - 2;
  const double share = (x - values.front()) / (values.back() - values.front());
  size_t i = share > 0.0 ? std::min(last, static_cast<size_t>(share * static_cast<double>(last + 1))) : 0;
  for (int steps = 0; steps < 8; ++steps) {
    if (i > 0 && x < values[i]) --i;
    else if (i < last && !(x < values[i + 1])) ++i;
    else return i;
  }
  const auto after = static_cast<size_t>(std::upper_bound(values.begin(), values.end(), x) - values.begin());
  return std::clamp<size_t>(after, 1, last + 1) - 1;
}

}  // namespace flexframe::sim
