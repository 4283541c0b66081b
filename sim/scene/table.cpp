#include "sim/scene/table.h"

#include <fmt/format.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Solves a tridiagonal system by elimination; lower[0] and upper[n-1] are not used. Diagonally dominant: no pivoting.
std::vector<double> solve_tridiagonal(const std::vector<double>& lower, std::vector<double> diagonal, const std::vector<double>& upper,
                                      std::vector<double> rhs) {
  const size_t n = diagonal.size();
  for (size_t i = 1; i < n; ++i) {
    const double f = lower[i] / diagonal[i - 1];
    diagonal[i] -= f * upper[i - 1];
    rhs[i] -= f * rhs[i - 1];
  }
  for (size_t i = n; i-- > 0;) rhs[i] = (rhs[i] - (i + 1 < n ? upper[i] * rhs[i + 1] : 0.0)) / diagonal[i];
  return rhs;
}

// The interval of ascending values in which x lies, from x.front() to x.back(). Values are spaced evenly as a rule: looked for beside where
// that puts x, a few steps, before the whole is halved again and again.
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

}  // namespace

CubicTable::CubicTable(std::vector<double> x, std::vector<double> y, std::optional<double> period)
    : x_(std::move(x)), y_(std::move(y)), period_(period.value_or(0.0)) {
  if (x_.size() < 2 || x_.size() != y_.size()) throw InputError(fmt::format("a table needs two points or more, found {}", x_.size()));
  for (size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1]))
      throw InputError(fmt::format("the first numbers of a table must ascend: point {} has {} after {}", i + 1, x_[i], x_[i - 1]));
  if (period_ > 0.0) {
    if (!(period_ >= x_.back() - x_.front()))
      throw InputError(fmt::format("the period {} is shorter than the table, {}", period_, x_.back() - x_.front()));
    if (period_ == x_.back() - x_.front()) {
      if (y_.back() != y_.front())
        throw InputError(
            fmt::format("a table as long as its period must end with the value it starts with, {}; found {}", y_.front(), y_.back()));
    } else {
      x_.push_back(x_.front() + period_);
      y_.push_back(y_.front());
    }
  }

  // Second derivatives m: h[i-1] m[i-1] + 2 (h[i-1] + h[i]) m[i] + h[i] m[i+1] = 6 (slope[i] - slope[i-1]).
  const size_t n = x_.size() - 1;  // intervals
  std::vector<double> h(n), slope(n);
  for (size_t i = 0; i < n; ++i) h[i] = x_[i + 1] - x_[i], slope[i] = (y_[i + 1] - y_[i]) / h[i];
  m_.assign(n + 1, 0.0);
  if (period_ > 0.0) {
    // Cyclic: n unknowns by Sherman and Morrison's rank-one update of a tridiagonal matrix.
    if (n < 3) throw InputError(fmt::format("a periodic table needs three points or more in its period, found {}", n));
    std::vector<double> lower(n), diagonal(n), upper(n), rhs(n);
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
    const std::vector<double> a = solve_tridiagonal(lower, diagonal, upper, rhs), b = solve_tridiagonal(lower, diagonal, upper, u);
    const double f = (a[0] + a[n - 1] * corner / gamma) / (1.0 + b[0] + b[n - 1] * corner / gamma);
    for (size_t i = 0; i < n; ++i) m_[i] = a[i] - f * b[i];
    m_[n] = m_[0];
  } else if (n == 2) {
    // One parabola through three points.
    m_.assign(3, 2.0 * (slope[1] - slope[0]) / (h[0] + h[1]));
  } else if (n > 2) {
    // Not-a-knot: the third derivative is continuous at the second point and the last but one; the end values are eliminated.
    const size_t k = n - 1;
    std::vector<double> lower(k), diagonal(k), upper(k), rhs(k);
    for (size_t i = 0; i < k; ++i) {
      lower[i] = h[i];
      diagonal[i] = 2.0 * (h[i] + h[i + 1]);
      upper[i] = h[i + 1];
      rhs[i] = 6.0 * (slope[i + 1] - slope[i]);
    }
    diagonal[0] = (h[0] + h[1]) * (h[0] + 2.0 * h[1]) / h[1];
    upper[0] = (h[1] * h[1] - h[0] * h[0]) / h[1];
    diagonal[k - 1] = (h[k] + h[k - 1]) * (h[k] + 2.0 * h[k - 1]) / h[k - 1];
    lower[k - 1] = (h[k - 1] * h[k - 1] - h[k] * h[k]) / h[k - 1];
    const std::vector<double> inner = solve_tridiagonal(lower, diagonal, upper, rhs);
    std::copy(inner.begin(), inner.end(), m_.begin() + 1);
    m_[0] = m_[1] - h[0] / h[1] * (m_[2] - m_[1]);
    m_[n] = m_[n - 1] + h[n - 1] / h[n - 2] * (m_[n - 1] - m_[n - 2]);
  }
  for (const double m : m_)
    if (!std::isfinite(m)) throw InputError("the points of a table lie too close together or too far apart for finite curvatures");
}

TimeJet CubicTable::jet(double x) const {
  if (period_ > 0.0) {
    x -= period_ * std::floor((x - x_.front()) / period_);
  } else if (x < x_.front() || x > x_.back()) {
    return {x < x_.front() ? y_.front() : y_.back(), 0.0, 0.0};
  }
  const size_t i = interval_of(x_, x);
  const double h = x_[i + 1] - x_[i], a = x_[i + 1] - x, b = x - x_[i];
  const double slope = (y_[i + 1] - y_[i]) / h;
  TimeJet out;
  out.value = y_[i] + slope * b - a * b / 6.0 * (m_[i] * (1.0 + a / h) + m_[i + 1] * (1.0 + b / h));
  out.rate = slope + ((h * h - 3.0 * a * a) * m_[i] + (3.0 * b * b - h * h) * m_[i + 1]) / (6.0 * h);
  out.acceleration = (m_[i] * a + m_[i + 1] * b) / h;
  return out;
}

std::vector<double> TimeFunction::switch_times(double t0, double t1) const {
  if (!table_) return expression_.switch_times(t0, t1);
  std::vector<double> out;
  if (table_->periodic()) return out;
  for (const double t : {table_->front(), table_->back()})
    if (t > t0 && t < t1) out.push_back(t);
  return out;
}

}  // namespace flexframe::sim
