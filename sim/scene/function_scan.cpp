#include "sim/scene/function_scan.h"

#include "sim/scene/expression_code.h"
#include "sim/scene/interval.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace flexframe::sim {

namespace expression {

namespace {

// Taylor coefficients over a box of times, f^(k)(t) / k! for every t in it: a function with all of its derivatives below the order.
struct Series {
  static constexpr int order = 5;
  std::array<Interval, order> c;
  Series() = default;  // no values: the stack is not cleared
  Series(double x) {
    c.fill({0.0, 0.0});
    c[0] = {x, x};
  }
  explicit Series(Interval value) {
    c.fill({0.0, 0.0});
    c[0] = value;
  }
  Interval& operator[](int k) { return c[k]; }
  const Interval& operator[](int k) const { return c[k]; }
};

constexpr Interval zero{0.0, 0.0};
Interval times(double f, Interval a) { return Interval{f, f} * a; }

template <class F>
Series each(F&& f) {
  Series out;
  for (int k = 0; k < Series::order; ++k) out[k] = f(k);
  return out;
}

// Sum of a[i] b[k - i], i from `from` to `to`.
Interval convolved(const Series& a, const Series& b, int k, int from, int to) {
  Interval sum = zero;
  for (int i = from; i <= to; ++i) sum = sum + a[i] * b[k - i];
  return sum;
}

Series operator+(const Series& a, const Series& b) {
  return each([&](int k) { return a[k] + b[k]; });
}
Series operator-(const Series& a, const Series& b) {
  return each([&](int k) { return a[k] - b[k]; });
}
Series operator-(const Series& a) {
  return each([&](int k) { return -a[k]; });
}
Series operator*(const Series& a, const Series& b) {
  return each([&](int k) { return convolved(a, b, k, 0, k); });
}
Series operator/(const Series& a, const Series& b) {
  Series out;
  for (int k = 0; k < Series::order; ++k) {
    Interval sum = a[k];
    for (int i = 1; i <= k; ++i) sum = sum - b[i] * out[k - i];
    out[k] = sum / b[0];
  }
  return out;
}

// f(u) from f(u[0]) and the series of f'(u): k f_k = sum of j u_j f'_(k-j).
Interval integrated(const Series& u, const Series& slope, int k) {
  Interval sum = zero;
  for (int j = 1; j <= k; ++j) sum = sum + times(j, u[j]) * slope[k - j];
  return times(1.0 / k, sum);
}
Series integrated(Interval value, const Series& u, const Series& slope) {
  return each([&](int k) { return k == 0 ? value : integrated(u, slope, k); });
}

// Two functions, each the other's derivative up to the sign: f' = sign1 g, g' = sign2 f.
void pair_of(const Series& u, Series& f, double sign1, Series& g, double sign2) {
  for (int k = 1; k < Series::order; ++k) {
    f[k] = times(sign1, integrated(u, g, k));
    g[k] = times(sign2, integrated(u, f, k));
  }
}

Interval hyperbolic_cosine(Interval a) {
  const Interval s = increasing(a, [](double x) { return std::sinh(x); });
  return root(one + square(s));
}

Series sin(const Series& u) {
  Series s(sine(u[0])), c(cosine(u[0]));
  pair_of(u, s, 1.0, c, -1.0);
  return s;
}
Series cos(const Series& u) {
  Series s(sine(u[0])), c(cosine(u[0]));
  pair_of(u, s, 1.0, c, -1.0);
  return c;
}
Series sinh(const Series& u) {
  Series s(increasing(u[0], [](double x) { return std::sinh(x); })), c(hyperbolic_cosine(u[0]));
  pair_of(u, s, 1.0, c, 1.0);
  return s;
}
Series cosh(const Series& u) {
  Series s(increasing(u[0], [](double x) { return std::sinh(x); })), c(hyperbolic_cosine(u[0]));
  pair_of(u, s, 1.0, c, 1.0);
  return c;
}
Series tan(const Series& u) { return sin(u) / cos(u); }
Series exp(const Series& u) {
  Series f(increasing(u[0], [](double x) { return std::exp(x); }));
  for (int k = 1; k < Series::order; ++k) f[k] = integrated(u, f, k);
  return f;
}
Series tanh(const Series& u) {
  Series f(increasing(u[0], [](double x) { return std::tanh(x); }));
  // The slope, 1 - f^2, by 1 / cosh^2: it vanishes far out, where the difference is rounding.
  const double near = u[0].has_zero() ? 0.0 : std::min(std::abs(u[0].lo), std::abs(u[0].hi)),
               far = std::max(std::abs(u[0].lo), std::abs(u[0].hi));
  Series slope(widened(1.0 / std::cosh(far) / std::cosh(far), 1.0 / std::cosh(near) / std::cosh(near)));
  for (int k = 1; k < Series::order; ++k) {
    f[k] = integrated(u, slope, k);
    slope[k] = -convolved(f, f, k, 0, k);
  }
  return f;
}

// u^c for a number c: binomial series about u[0], powers of the rest by convolution.
Series power(const Series& u, double c) {
  Series rest = u;
  rest[0] = zero;
  Series power_of_rest(1.0), out(0.0);
  double binomial = 1.0;
  for (int k = 0; k < Series::order && binomial != 0.0; ++k) {
    const Interval factor = times(binomial, power(u[0], c - k));
    for (int m = 0; m < Series::order; ++m) out[m] = out[m] + factor * power_of_rest[m];
    power_of_rest = power_of_rest * rest;
    binomial *= (c - k) / (k + 1);
  }
  return out;
}
Series sqrt(const Series& u) { return power(u, 0.5); }
Series log(const Series& u) {
  return integrated(increasing(clipped(u[0], 0.0, infinity), [](double x) { return std::log(x); }), u, Series(1.0) / u);
}
Series log2(const Series& u) { return log(u) * Series(M_LOG2E); }
Series log10(const Series& u) { return log(u) * Series(M_LOG10E); }
Series asin(const Series& u) {
  return integrated(increasing(clipped(u[0], -1.0, 1.0), [](double x) { return std::asin(x); }), u,
                    power(Series(1.0) - power(u, 2.0), -0.5));
}
Series acos(const Series& u) { return Series(0.5 * M_PI) - asin(u); }
Series atan(const Series& u) {
  return integrated(increasing(u[0], [](double x) { return std::atan(x); }), u, Series(1.0) / (Series(1.0) + power(u, 2.0)));
}
Series asinh(const Series& u) {
  return integrated(increasing(u[0], [](double x) { return std::asinh(x); }), u, power(Series(1.0) + power(u, 2.0), -0.5));
}
Series acosh(const Series& u) {
  return integrated(increasing(clipped(u[0], 1.0, infinity), [](double x) { return std::acosh(x); }), u,
                    power(power(u, 2.0) - Series(1.0), -0.5));
}
Series atanh(const Series& u) {
  return integrated(increasing(clipped(u[0], -1.0, 1.0), [](double x) { return std::atanh(x); }), u,
                    Series(1.0) / (Series(1.0) - power(u, 2.0)));
}

Series power(const Series& a, const Series& b) {
  bool number = b[0].lo == b[0].hi;
  for (int k = 1; k < Series::order; ++k) number = number && b[k].lo == 0.0 && b[k].hi == 0.0;
  return number ? power(a, b[0].lo) : exp(b * log(a));
}

double number_of(const Series& u) { return std::rint(0.5 * (u[0].lo + u[0].hi)); }

Series atan2_on_side(const Series& y, const Series& x, double) {
  // Its value alone is an angle; what varies is the rate, (x y' - y x') / r^2.
  const auto derivative = [](const Series& f) {
    return each([&](int k) { return k + 1 < Series::order ? times(k + 1, f[k + 1]) : zero; });
  };
  const Series rate = (x * derivative(y) - y * derivative(x)) / (power(x, 2.0) + power(y, 2.0));
  return each([&](int k) { return k == 0 ? Interval{-2.0 * M_PI, 2.0 * M_PI} : times(1.0 / k, rate[k - 1]); });
}

double largest(Interval a) { return a.empty() ? 0.0 : std::max(std::abs(a.lo), std::abs(a.hi)); }

}  // namespace

}  // namespace expression

using expression::Interval;
using expression::Op;
using expression::Series;

struct FunctionScan::Code {
  std::vector<Expression::Instruction> code;
  std::vector<double> chosen;  // by its selectors within the segment
};

FunctionScan::~FunctionScan() = default;
FunctionScan::FunctionScan(FunctionScan&&) noexcept = default;
FunctionScan& FunctionScan::operator=(FunctionScan&&) noexcept = default;

FunctionScan::FunctionScan(const std::string& text, int derivative, double from, double to)
    : derivative_(derivative), to_(to), least_(1e-13 * (to - from)), known_until_(from) {
  auto code = std::make_unique<Code>();
  std::vector<Expression::Selector> selectors;
  expression::compile(text, code->code, selectors);
  code->chosen.assign(selectors.size(), 0.0);
  expression::choices_after(expression::Piece(code->code), from + 0.5 * (to - from), code->chosen);
  const bool constant =
      std::none_of(code->code.begin(), code->code.end(), [](const Expression::Instruction& i) { return i.op == Op::time; });
  code_ = std::move(code);
  if (constant) known_until_ = to;
  else find_peak(from, to);
}

FunctionScan::FunctionScan(const TableDef& table, int derivative, double from, double to)
    : table_(std::make_unique<CubicTable>(table.x, table.y, table.period)),
      points_(table.x),
      period_(table.period.value_or(0.0)),
      derivative_(derivative),
      to_(to),
      least_(1e-13 * (to - from)),
      known_until_(from) {
  // A table is as large as its points, a spline's overshoot besides.
  for (const double x : points_) {
    const TimeJet j = table_->jet(x);
    peak_ = std::max(peak_, std::abs(derivative_ == 2 ? j.acceleration : j.value));
  }
}

// The largest size, within a half: the box with the largest bound is halved until the middle of some box is half as large.
void FunctionScan::find_peak(double from, double to) {
  struct Box {
    double bound, lo, hi;
    bool operator<(const Box& other) const { return bound < other.bound; }
  };
  std::priority_queue<Box> open;
  const auto add = [&](double lo, double hi) {
    const double middle = lo + 0.5 * (hi - lo), at = bounds(middle, middle).size;
    if (std::isfinite(at)) peak_ = std::max(peak_, at);
    open.push({bounds(lo, hi).size, lo, hi});
  };
  add(from, to);
  for (int halved = 0; halved < 300 && open.top().bound > 2.0 * peak_; ++halved) {
    const Box box = open.top();
    const double middle = box.lo + 0.5 * (box.hi - box.lo);
    if (!(middle > box.lo && middle < box.hi)) break;
    open.pop();
    add(box.lo, middle);
    add(middle, box.hi);
  }
}

FunctionBounds FunctionScan::bounds(double lo, double hi) const {
  if (table_) return bounds_of_table(lo, hi);
  Series time(Interval{lo, hi});
  time[1] = expression::one;
  const Series f = expression::run(expression::Piece(code_->code), time,
                                   [&](int index, Op, const Series&, const Series&) { return code_->chosen[index]; });
  // f^(d), f^(d+1), f^(d+2) from the coefficients.
  const double factorial = derivative_ == 2 ? 2.0 : 1.0, next = derivative_ == 2 ? 6.0 : 1.0, second = derivative_ == 2 ? 24.0 : 2.0;
  FunctionBounds out;
  const Interval value = f[derivative_];
  out.size = factorial * expression::largest(value);
  out.varies = value.empty() ? 0.0 : factorial * (value.hi - value.lo);
  out.slope = next * expression::largest(f[derivative_ + 1]);
  out.bend = second * expression::largest(f[derivative_ + 2]);
  return out;
}

FunctionBounds FunctionScan::bounds_of_table(double lo, double hi) const {
  // The box in points: its ends, and the table's in between, of a periodic one in the period of each.
  std::vector<double> at{lo};
  if (period_ > 0.0) hi = std::min(hi, lo + period_);
  const double first_period = period_ > 0.0 ? period_ * std::floor((lo - points_.front()) / period_) : 0.0;
  for (double offset = first_period; points_.front() + offset < hi; offset += period_) {
    for (auto x = std::upper_bound(points_.begin(), points_.end(), lo - offset); x != points_.end() && *x + offset < hi; ++x)
      at.push_back(*x + offset);
    if (period_ == 0.0) break;
  }
  at.push_back(hi);
  FunctionBounds out;
  const TimeJet first = table_->jet(lo), end = table_->jet(hi);
  double low = 0.0, high = 0.0, before = 0.0;
  for (size_t i = 0; i < at.size(); ++i) {
    const TimeJet j = table_->jet(at[i]);
    const double v = derivative_ == 2 ? j.acceleration : j.value, gap = i > 0 ? at[i] - at[i - 1] : 0.0;
    low = i == 0 ? v : std::min(low, v);
    high = i == 0 ? v : std::max(high, v);
    if (derivative_ == 2) {
      // Straight between the points: what is bent is how far they lie off the line through the ends.
      const double share = hi > lo ? (at[i] - lo) / (hi - lo) : 0.0,
                   off = std::abs(v - first.acceleration - share * (end.acceleration - first.acceleration));
      if (hi > lo) out.bend = std::max(out.bend, 8.0 * off / ((hi - lo) * (hi - lo)));
      if (gap > 0.0) out.slope = std::max(out.slope, std::abs(v - before) / gap);
    } else {
      out.bend = std::max(out.bend, std::abs(j.acceleration));
      out.slope = std::max(out.slope, std::abs(j.rate));
    }
    before = v;
  }
  out.size = std::max(std::abs(low), std::abs(high));
  out.varies = high - low;
  // Between two points a cubic leaves their range by at most an eighth of its bend over the gap squared.
  for (size_t i = 1; derivative_ == 0 && i < at.size(); ++i)
    out.varies = std::max(out.varies, high - low + out.bend * (at[i] - at[i - 1]) * (at[i] - at[i - 1]) / 4.0);
  return out;
}

bool is_shown(const FunctionBounds& b, double width, double floor) {
  if (b.varies <= floor) return true;
  const double bend = b.bend * width * width / 8.0;
  return bend <= std::max(floor, 0.5 * b.slope * width) && std::isfinite(bend);
}

bool FunctionScan::shows(double lo, double hi) const { return is_shown(bounds(lo, hi), hi - lo, 1e-9 * peak_); }

double FunctionScan::limit(double t, double step, double farthest) {
  farthest = std::min(farthest, to_);
  if (gave_up()) return farthest;
  // Looked at anew once two thirds of the way are no longer known.
  if (known_until_ >= std::min(to_, t + 0.65 * (farthest - t))) return known_until_ >= to_ ? expression::infinity : known_until_;
  double span = farthest - t;
  while (span > least_ && !shows(t, t + span)) span *= 0.5;
  // No bound even for the shortest box (numbers beyond double precision that cancel) says nothing of widths.
  if (span <= least_ && !std::isfinite(bounds(t, t + span).bend)) return farthest;
  if (span < step) ++shortened_;
  known_until_ = t + std::max(span, least_);
  return known_until_;
}

// ---- Along paths -----------------------------------------------------------------------------------------------------------------------

PathScan::PathScan(std::string_view text, std::span<const std::string> variables) {
  std::vector<Expression::Selector> selectors;
  std::vector<std::string> used;
  expression::compile(text, code_, selectors, variables, &used);
  chosen_.assign(selectors.size(), 0.0);
  const auto number_before = [&](size_t i) { return i > 0 && code_[i - 1].op == Op::number; };
  for (size_t i = 0; i < code_.size(); ++i) {
    const Op op = code_[i].op;
    const bool polynomial = op <= Op::multiply || op == Op::negate || (op >= Op::both && op != Op::atan2) ||
                            (op == Op::divide && number_before(i)) ||
                            (op == Op::power && number_before(i) && code_[i - 1].number >= 0.0 && code_[i - 1].number <= 3.0);
    may_peak_ = may_peak_ || !polynomial;
  }
}

void PathScan::choose(double t, const double* values) {
  expression::run(
      expression::Piece(code_), t, [&](int index, Op op, double a, double b) { return chosen_[index] = expression::select(op, a, b); },
      static_cast<double*>(nullptr), values);
}

FunctionBounds PathScan::bounds(double lo, double hi, std::span<const PathBounds> paths) const {
  Series time(Interval{lo, hi});
  time[1] = expression::one;
  std::vector<Series> variables;
  for (const PathBounds& p : paths) {
    Series v(Interval{p.least, p.most});
    v[1] = {p.slowest, p.fastest};
    v[2] = {0.5 * p.bend_least, 0.5 * p.bend_most};
    variables.push_back(v);
  }
  const Series f = expression::run(
      expression::Piece(code_), time, [&](int index, Op, const Series&, const Series&) { return chosen_[index]; },
      static_cast<Series*>(nullptr), variables.data());
  FunctionBounds out;
  out.size = expression::largest(f[0]);
  out.varies = f[0].empty() ? 0.0 : f[0].hi - f[0].lo;
  out.slope = expression::largest(f[1]);
  out.bend = 2.0 * expression::largest(f[2]);
  return out;
}

}  // namespace flexframe::sim
