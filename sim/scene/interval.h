// Interval arithmetic with outward rounding, for the search for switches and pulses in expressions (Moore, Kearfott, Cloud: Introduction to
// Interval Analysis, SIAM 2009); private to expression_switches.cpp and expression_scan.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim::expression {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

// lo > hi: empty (outside a function's domain).
struct Interval {
  double lo, hi;
  bool empty() const { return lo > hi; }
  bool has_zero() const { return lo <= 0.0 && hi >= 0.0; }
};

inline constexpr Interval nothing{infinity, -infinity};
inline constexpr Interval everything{-infinity, infinity};
inline constexpr Interval one{1.0, 1.0};

// Outward by more than the rounding of one operation or library function; not-a-number bounds are infinite ones. What is too large for a
// number lies between the largest one and infinity.
inline Interval widened(double lo, double hi) {
  constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon(), largest = std::numeric_limits<double>::max();
  constexpr double smallest = std::numeric_limits<double>::denorm_min();
  return {std::isnan(lo)   ? -infinity
          : lo == infinity ? largest
                           : lo - rounding * std::abs(lo) - (lo != 0.0) * smallest,
          std::isnan(hi)    ? infinity
          : hi == -infinity ? -largest
                            : hi + rounding * std::abs(hi) + (hi != 0.0) * smallest};
}

inline Interval operator+(Interval a, Interval b) { return a.empty() || b.empty() ? nothing : widened(a.lo + b.lo, a.hi + b.hi); }
inline Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
inline Interval operator-(Interval a, Interval b) { return a + -b; }

// 0 * infinity is 0 here: the factor is exactly zero
inline double product(double a, double b) { return a == 0.0 || b == 0.0 ? 0.0 : a * b; }

inline Interval operator*(Interval a, Interval b) {
  if (a.empty() || b.empty()) return nothing;
  const double p = product(a.lo, b.lo), q = product(a.lo, b.hi), r = product(a.hi, b.lo), s = product(a.hi, b.hi);
  return widened(std::min({p, q, r, s}), std::max({p, q, r, s}));
}

inline Interval operator/(Interval a, Interval b) {
  if (a.empty() || b.empty()) return nothing;
  if (b.has_zero()) return a.lo == 0.0 && a.hi == 0.0 ? Interval{0.0, 0.0} : everything;
  return a * widened(1.0 / b.hi, 1.0 / b.lo);
}

inline Interval square(Interval a) {
  if (a.empty()) return nothing;
  const double low = a.has_zero() ? 0.0 : std::min(std::abs(a.lo), std::abs(a.hi));
  const double high = std::max(std::abs(a.lo), std::abs(a.hi));
  return widened(low * low, high * high);
}

inline Interval clipped(Interval a, double low, double high) {
  if (a.empty() || a.hi < low || a.lo > high) return nothing;
  return {std::max(a.lo, low), std::min(a.hi, high)};
}

template <class F>
inline Interval increasing(Interval a, F&& f) {
  return a.empty() ? nothing : widened(f(a.lo), f(a.hi));
}

inline Interval root(Interval a) {
  return increasing(clipped(a, 0.0, infinity), [](double x) { return std::sqrt(x); });
}

inline Interval sine(Interval a) {
  if (a.empty()) return nothing;
  if (!(a.hi - a.lo < 2.0 * M_PI)) return {-1.0, 1.0};
  const double s = std::sin(a.lo), e = std::sin(a.hi);
  // is there a maximum (pi/2 + 2 pi k) or a minimum between?
  const auto holds = [&](double at) { return std::floor((a.hi - at) / (2.0 * M_PI)) > std::floor((a.lo - at) / (2.0 * M_PI)); };
  const double high = holds(0.5 * M_PI) ? 1.0 : std::max(s, e), low = holds(-0.5 * M_PI) ? -1.0 : std::min(s, e);
  // beside an extremum the test above may err by rounding of the argument: second order in it, but never beyond 1
  const double slack = square({a.lo, a.hi}).hi * 1e-31 + 1e-15;
  return {std::max(-1.0, low - slack), std::min(1.0, high + slack)};
}
inline Interval cosine(Interval a) { return sine(a + Interval{0.5 * M_PI, 0.5 * M_PI}); }

// x^c for a number c
inline Interval power(Interval x, double c) {
  if (x.empty()) return nothing;
  if (c == 0.0) return one;
  if (c == 1.0) return x;
  if (c != std::rint(c)) {
    x = clipped(x, 0.0, infinity);
    if (c < 0.0) return -increasing(x, [c](double a) { return -std::pow(a, c); });
    return increasing(x, [c](double a) { return std::pow(a, c); });
  }
  if (c < 0.0) return one / power(x, -c);
  if (std::fmod(c, 2.0) != 0.0) return increasing(x, [c](double a) { return std::pow(a, c); });
  const double low = x.has_zero() ? 0.0 : std::min(std::abs(x.lo), std::abs(x.hi));
  return widened(std::pow(low, c), std::pow(std::max(std::abs(x.lo), std::abs(x.hi)), c));
}

}  // namespace flexframe::sim::expression
