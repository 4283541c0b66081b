// Where an expression changes its branch: interval arithmetic on each selector's operands and their derivatives isolates the changes
// (branch and bound; a box whose value excludes zero holds none, one whose derivative excludes zero at most one), bisection on
// the selector itself finishes them (Moore, Kearfott, Cloud: Introduction to Interval Analysis, SIAM 2009, sections 5.4 and 8.1).
#include "sim/scene/expression.h"

#include "sim/base/words.h"
#include "sim/scene/expression_code.h"
#include "sim/scene/interval.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace flexframe::sim {

namespace expression {

namespace {

// A value and its derivative over a box of times; partial: at some of them the value is perhaps not a number.
struct Range {
  Interval v, d;
  bool partial;
  Range() = default;  // no values: the stack is not cleared
  Range(double x) : v{x, x}, d{0.0, 0.0}, partial(false) {}
  Range(Interval value, Interval rate, bool is_partial) : v(value), d(value.empty() ? nothing : rate), partial(is_partial) {}
};

Range operator+(const Range& a, const Range& b) { return {a.v + b.v, a.d + b.d, a.partial || b.partial}; }
Range operator-(const Range& a, const Range& b) { return {a.v - b.v, a.d - b.d, a.partial || b.partial}; }
Range operator-(const Range& a) { return {-a.v, -a.d, a.partial}; }
Range operator*(const Range& a, const Range& b) { return {a.v * b.v, a.d * b.v + a.v * b.d, a.partial || b.partial}; }
Range operator/(const Range& a, const Range& b) {
  const Interval v = a.v / b.v;
  return {v, (a.d - v * b.d) / b.v, a.partial || b.partial};
}

// The argument of a function that is defined from low to high.
Range within(const Range& u, double low, double high) { return {clipped(u.v, low, high), u.d, u.partial || u.v.lo < low || u.v.hi > high}; }

template <class F>
Range increasing(const Range& u, Interval slope, F&& f) {
  return {increasing(u.v, f), slope * u.d, u.partial};
}

Range sin(const Range& u) { return {sine(u.v), cosine(u.v) * u.d, u.partial}; }
Range cos(const Range& u) { return {cosine(u.v), -(sine(u.v) * u.d), u.partial}; }
Range tan(const Range& u) {
  if (u.v.empty()) return u;
  const auto branch = [](double x) { return std::floor((x - 0.5 * M_PI) / M_PI); };
  if (!(u.v.hi - u.v.lo < M_PI) || branch(u.v.lo) != branch(u.v.hi)) return {everything, everything, u.partial};
  const Interval v = increasing(u.v, [](double x) { return std::tan(x); });
  return {v, (one + square(v)) * u.d, u.partial};
}
Range asin(const Range& u) {
  const Range x = within(u, -1.0, 1.0);
  return increasing(x, one / root(one - square(x.v)), [](double a) { return std::asin(a); });
}
Range acos(const Range& u) {
  const Range x = within(u, -1.0, 1.0);
  return -increasing(x, one / root(one - square(x.v)), [](double a) { return -std::acos(a); });
}
Range atan(const Range& u) {
  return increasing(u, one / (one + square(u.v)), [](double a) { return std::atan(a); });
}
Range exp(const Range& u) {
  const Interval v = increasing(u.v, [](double a) { return std::exp(a); });
  return {v, v * u.d, u.partial};
}
Range sinh(const Range& u) {
  const Interval v = increasing(u.v, [](double a) { return std::sinh(a); });
  return {v, root(one + square(v)) * u.d, u.partial};
}
Range cosh(const Range& u) {
  const Interval s = increasing(u.v, [](double a) { return std::sinh(a); });
  return {root(one + square(s)), s * u.d, u.partial};
}
Range tanh(const Range& u) {
  const Interval v = increasing(u.v, [](double a) { return std::tanh(a); });
  return {v, (one - square(v)) * u.d, u.partial};
}
Range asinh(const Range& u) {
  return increasing(u, one / root(one + square(u.v)), [](double a) { return std::asinh(a); });
}
Range acosh(const Range& u) {
  const Range x = within(u, 1.0, infinity);
  return increasing(x, one / root(square(x.v) - one), [](double a) { return std::acosh(a); });
}
Range atanh(const Range& u) {
  const Range x = within(u, -1.0, 1.0);
  return increasing(x, one / (one - square(x.v)), [](double a) { return std::atanh(a); });
}
Range log(const Range& u) {
  const Range x = within(u, 0.0, infinity);
  return increasing(x, one / x.v, [](double a) { return std::log(a); });
}
Range log2(const Range& u) { return log(u) * Range(M_LOG2E); }
Range log10(const Range& u) { return log(u) * Range(M_LOG10E); }
Range sqrt(const Range& u) {
  const Range x = within(u, 0.0, infinity);
  const Interval v = root(x.v);
  return {v, x.d / (v + v), x.partial};
}

Range power(const Range& a, const Range& b) {
  if (b.v.lo == b.v.hi && b.d.lo == 0.0 && b.d.hi == 0.0) {
    const double c = b.v.lo;
    const Range x = c == std::rint(c) ? a : within(a, 0.0, infinity);
    return {power(x.v, c), c == 0.0 ? Interval{0.0, 0.0} : Interval{c, c} * power(x.v, c - 1.0) * x.d, x.partial};
  }
  return exp(b * log(a));
}

double number_of(const Range& u) { return std::rint(0.5 * (u.v.lo + u.v.hi)); }

Range atan2_on_side(const Range& y, const Range& x, double side) {
  const bool partial = y.partial || x.partial;
  if (y.v.empty() || x.v.empty()) return {nothing, nothing, true};
  const Interval rate = (x.v * y.d - y.v * x.d) / (square(x.v) + square(y.v));
  const auto angle = [](Interval ratio) { return increasing(ratio, [](double a) { return std::atan(a); }); };
  const double shift = x.v.lo > 0.0 ? 0.0 : x.v.hi < 0.0 ? side * M_PI : infinity;
  if (std::isfinite(shift)) return {angle(y.v / x.v) + Interval{shift, shift}, rate, partial};
  if (!y.v.has_zero()) {
    const double up = y.v.lo > 0.0 ? 0.5 * M_PI : -0.5 * M_PI;
    return {Interval{up, up} - angle(x.v / y.v), rate, partial};
  }
  return {{-2.0 * M_PI, 2.0 * M_PI}, everything, partial};
}

struct TooMany {};

// A selector's operands at one time with the selectors inside them held.
struct Operands {
  double a, b;
};

class Search {
 public:
  Search(const std::vector<Expression::Instruction>& code, const std::vector<Expression::Selector>& selectors, double t0, double t1)
      : code_(code), selectors_(selectors), held_(selectors.size(), 0.0), t0_(t0), t1_(t1), narrowest_((t1 - t0) * 0x1p-32) {}

  // Throws TooMany.
  std::vector<double> times() {
    std::vector<std::vector<double>> changes(selectors_.size());
    for (std::size_t s = 0; s < selectors_.size(); ++s) {
      selector_ = &selectors_[s];
      if (!depends_on_time()) continue;
      // pieces in which the selectors inside the operands keep their choice
      std::vector<double> ends{t0_, t1_};
      for (int i = selector_->begin; i < selector_->end; ++i)
        if (is_selector(code_[i].op)) {
          const auto& inner = changes[code_[i].index];
          ends.insert(ends.end(), inner.begin(), inner.end());
        }
      std::sort(ends.begin(), ends.end());
      ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
      found_ = &changes[s];
      for (std::size_t p = 0; p + 1 < ends.size(); ++p) {
        hold(0.5 * (ends[p] + ends[p + 1]));
        isolate(ends[p], ends[p + 1]);
        // the operands may jump from one piece to the next
        if (p > 0) found_->push_back(ends[p]);
      }
    }

    std::vector<double> candidates;
    for (const auto& times : changes) candidates.insert(candidates.end(), times.begin(), times.end());
    return real_changes(std::move(candidates));
  }

 private:
  // Those that read variables change where the motion tells, not where time does.
  bool depends_on_time() const {
    bool time = false;
    for (int i = selector_->begin; i < selector_->end; ++i) {
      if (code_[i].op == Op::variable) return false;
      time = time || code_[i].op == Op::time;
    }
    return time;
  }

  void hold(double t) { choices_after(Piece(code_, selector_->begin, selector_->end), t, held_); }

  Operands operands(double t) const {
    const auto held = [this](int index, Op, double, double) { return held_[index]; };
    if (!is_binary_selector(selector_->op)) return {run(Piece(code_, selector_->begin, selector_->end), t, held), 0.0};
    Operands o{};
    o.b = run(Piece(code_, selector_->begin, selector_->end), t, held, &o.a);
    return o;
  }

  // What distinguishes choices: the sign of the difference, the whole number, the side of the cut; not a number is one more.
  double choice(const Operands& o) const {
    if (std::isnan(o.a) || std::isnan(o.b)) return infinity;
    if (selector_->op == Op::rint || selector_->op == Op::atan2) return select(selector_->op, o.a, o.b);
    return static_cast<double>((o.a > o.b) - (o.a < o.b));
  }
  double choice(double t) const { return choice(operands(t)); }

  enum class Box { constant, at_most_one_change, unknown };

  // The operands over a box, with the selectors inside them held.
  void ranges(double lo, double hi, Range& a, Range& b) const {
    const auto held = [this](int index, Op, const Range&, const Range&) { return held_[index]; };
    const Range time(Interval{lo, hi}, one, false);
    b = Range(0.0);
    if (is_binary_selector(selector_->op)) b = run(Piece(code_, selector_->begin, selector_->end), time, held, &a);
    else a = run(Piece(code_, selector_->begin, selector_->end), time, held);
  }

  // The difference of the operands at one time, as wide as its rounding.
  Interval difference(double t) const {
    Range a, b;
    ranges(t, t, a, b);
    return a.v - b.v;
  }

  Box classify(double lo, double hi) {
    if (++boxes_ > most_boxes) throw TooMany{};
    Range a, b;
    ranges(lo, hi, a, b);
    if (a.v.empty() || b.v.empty()) return Box::constant;
    if (a.partial || b.partial) return Box::unknown;
    if (selector_->op == Op::atan2) {
      if (b.v.lo > 0.0 || (b.v.hi < 0.0 && !a.v.has_zero())) return Box::constant;
      const bool one_crosses = (!b.v.has_zero() && !a.d.has_zero()) || (!a.v.has_zero() && !b.d.has_zero());
      return one_crosses ? Box::at_most_one_change : Box::unknown;
    }
    if (selector_->op == Op::rint) {
      if (select(Op::rint, a.v.lo, 0.0) == select(Op::rint, a.v.hi, 0.0)) return Box::constant;
      return !a.d.has_zero() && std::abs(choice(lo) - choice(hi)) <= 1.0 ? Box::at_most_one_change : Box::unknown;
    }
    const Interval direct = a.v - b.v, rate = a.d - b.d;
    if (!direct.has_zero() || (direct.lo == 0.0 && direct.hi == 0.0)) return Box::constant;
    if (!rate.has_zero()) return Box::at_most_one_change;
    // the mean value form is the sharper one in small boxes
    const double middle = lo + 0.5 * (hi - lo);
    const Interval centre = difference(middle);
    if (centre.empty()) return Box::unknown;
    if (!(centre + rate * Interval{lo - middle, hi - middle}).has_zero()) return Box::constant;
    return centre.has_zero() && zero_but_for_rounding(lo, hi, a.v, b.v, centre, rate) ? Box::at_most_one_change : Box::unknown;
  }

  // No finer box would tell more: the difference varies less than it is rounded (a touch of high order), or it vanishes wherever
  // one looks while the operands hardly vary (t*t < t^2).
  bool zero_but_for_rounding(double lo, double hi, Interval a, Interval b, Interval centre, Interval rate) const {
    const double variation = std::max(std::abs(rate.lo), std::abs(rate.hi)) * (hi - lo);
    if (variation <= 4.0 * (centre.hi - centre.lo)) return true;
    const double size = std::max({std::abs(a.lo), std::abs(a.hi), std::abs(b.lo), std::abs(b.hi)});
    if (!(a.hi - a.lo + b.hi - b.lo <= 0.02 * size)) return false;
    for (const double part : {0.0, 0.137, 0.319, 0.618, 0.871, 1.0})
      if (!difference(lo + part * (hi - lo)).has_zero()) return false;
    return true;
  }

  void isolate(double lo, double hi) {
    struct Span {
      double lo, hi;
    };
    std::vector<Span> open{{lo, hi}};
    while (!open.empty()) {
      const Span box = open.back();
      open.pop_back();
      const Box kind = classify(box.lo, box.hi);
      if (kind == Box::constant) continue;
      const double middle = box.lo + 0.5 * (box.hi - box.lo);
      const bool narrow = box.hi - box.lo <= narrowest_ || !(middle > box.lo && middle < box.hi);
      // a few boxes end so beside a touch or a pole; many are changes too dense to tell apart
      if (narrow && kind == Box::unknown && ++unresolved_ > most_unresolved) throw TooMany{};
      if (narrow || kind == Box::at_most_one_change) bisect(box.lo, box.hi);
      else {
        open.push_back({middle, box.hi});
        open.push_back({box.lo, middle});
      }
    }
  }

  // Down to neighbouring numbers; of the two, the one nearer to the threshold.
  void bisect(double lo, double hi) {
    const double before = choice(lo);
    if (before == choice(hi)) return;
    for (;;) {
      const double middle = lo + 0.5 * (hi - lo);
      if (!(middle > lo && middle < hi)) break;
      (choice(middle) == before ? lo : hi) = middle;
    }
    const Operands low = operands(lo), high = operands(hi);
    const bool take_low = selector_->op != Op::rint && selector_->op != Op::atan2 && std::abs(low.a - low.b) < std::abs(high.a - high.b);
    found_->push_back(take_low ? lo : hi);
    if (found_->size() > most_changes) throw TooMany{};
  }

  // All choices at t; in branches that are not taken: infinity.
  void all_choices(double t, std::vector<double>& out) const {
    out.assign(selectors_.size(), infinity);
    choices_after(Piece(code_), t, out);
  }

  // Candidates at which the choices before and after differ. Several within a few roundings are one.
  std::vector<double> real_changes(std::vector<double> candidates) const {
    std::sort(candidates.begin(), candidates.end());
    // Whether a branch is taken at that time only the motion tells.
    const bool by_state = std::any_of(code_.begin(), code_.end(), [](const Expression::Instruction& i) { return i.op == Op::variable; });
    std::vector<double> apart;
    for (const double t : candidates) {
      const double gap = 8.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t), std::abs(t1_ - t0_) * 0x1p-20);
      if (t > t0_ && t < t1_ && (apart.empty() || t - apart.back() > gap)) apart.push_back(t);
    }
    std::vector<double> kept, before, after;
    double last = t0_;
    for (std::size_t i = 0; i < apart.size(); ++i) {
      const double next = i + 1 < apart.size() ? apart[i + 1] : t1_;
      if (i == 0) all_choices(0.5 * (last + apart[0]), before);
      all_choices(0.5 * (apart[i] + next), after);
      if (by_state || before != after) kept.push_back(apart[i]);
      std::swap(before, after);
      last = apart[i];
    }
    return kept;
  }

  static constexpr long most_boxes = 1'000'000;
  static constexpr long most_unresolved = 1000;
  static constexpr std::size_t most_changes = 100'000;

  const std::vector<Expression::Instruction>& code_;
  const std::vector<Expression::Selector>& selectors_;
  std::vector<double> held_;
  const Expression::Selector* selector_ = nullptr;
  std::vector<double>* found_ = nullptr;
  double t0_, t1_, narrowest_;
  long boxes_ = 0, unresolved_ = 0;
};

}  // namespace

}  // namespace expression

std::vector<double> Expression::switch_times(double t0, double t1) const {
  if (selectors_.empty() || constant_ || !(t1 > t0)) return {};
  try {
    return expression::Search(code_, selectors_, t0, t1).times();
  } catch (const expression::TooMany&) {
    throw SimulationError(
        fmt::format("the expression {} changes its branch more often between t = {} and {} s than can be located", quote(text_), t0, t1));
  }
}

}  // namespace flexframe::sim
