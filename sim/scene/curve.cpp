#include "sim/scene/curve.h"

#include "sim/scene/spline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// Parts of every stretch between two points; fewer where there are many points.
int parts_of_stretch(size_t points) { return std::clamp<int>(static_cast<int>(8000 / points), 2, 16); }

// The spline between two of its points, an interval of width h apart: what its values have in common is made once.
class Between {
 public:
  Between(const std::vector<double>& u, const std::vector<Vec3>& y, const std::vector<Vec3>& m, size_t i)
      : u_(u[i]), v_(u[i + 1]), h_(v_ - u_), inverse_(1.0 / h_), y_(y[i]), m_(m[i]), n_(m[i + 1]), slope_((y[i + 1] - y[i]) * inverse_) {}
  Vec3 place(double at) const {
    const double a = v_ - at, b = at - u_, c = a * b / 6.0;
    return y_ + b * slope_ - (c + c * a * inverse_) * m_ - (c + c * b * inverse_) * n_;
  }
  Vec3 tangent(double at) const {
    const double a = v_ - at, b = at - u_, f = inverse_ / 6.0;
    return slope_ + (h_ * h_ - 3.0 * a * a) * f * m_ + (3.0 * b * b - h_ * h_) * f * n_;
  }
  Vec3 bend(double at) const { return (v_ - at) * inverse_ * m_ + (at - u_) * inverse_ * n_; }
  double width() const { return h_; }

 private:
  double u_, v_, h_, inverse_;
  Vec3 y_, m_, n_, slope_;
};

// Slope of a spline between two of its points, a parabola: its values at both ends and in the middle are all of it.
struct SlopeBetween {
  Vec3 begin, linear, square;
  double width;  // of the parameter
  SlopeBetween(const Between& spline, double u, double v) : width(spline.width()) {
    const Vec3 middle = spline.tangent(0.5 * (u + v)), end = spline.tangent(v);
    begin = spline.tangent(u);
    square = 2.0 * (begin - 2.0 * middle + end);
    linear = end - begin - square;
  }
  // Length between two shares of the stretch, by Gauss' rule of five points.
  double arc(double from, double to) const {
    constexpr std::array<double, 5> at{-0.906179845938664, -0.538469310105683, 0.0, 0.538469310105683, 0.906179845938664};
    constexpr std::array<double, 5> weight{0.236926885056189, 0.478628670499366, 0.568888888888889, 0.478628670499366, 0.236926885056189};
    double sum = 0.0;
    for (size_t g = 0; g < at.size(); ++g) {
      const double share = 0.5 * (from + to) + 0.5 * (to - from) * at[g];
      sum += weight[g] * (begin + share * (linear + share * square)).norm();
    }
    return 0.5 * (to - from) * width * sum;
  }
};

}  // namespace

SpaceCurve::SpaceCurve(const std::vector<Vec3>& points, bool closed) : closed_(closed) {
  const size_t least = closed ? 3 : 2, n = points.size();
  if (n < least) throw InputError(fmt::format("a {}curve needs {} points or more, found {}", closed ? "closed " : "", least, n));
  std::vector<double> u{0.0};
  for (size_t i = 1; i <= n; ++i) {
    if (i == n && !closed) break;
    const double chord = (points[i % n] - points[i - 1]).norm();
    if (!(chord > 0.0) || !std::isfinite(chord)) throw InputError(fmt::format("its points {} and {} are one", i, i % n + 1));
    u.push_back(u.back() + chord);
  }
  std::vector<Vec3> given = points;
  if (closed) given.push_back(points.front());
  const std::vector<Vec3> bends = spline_curvatures(u, given, closed);
  const int parts = parts_of_stretch(n);
  s_.reserve(1 + (u.size() - 1) * static_cast<size_t>(parts));
  samples_.reserve(s_.capacity());
  s_.push_back(0.0);
  samples_.push_back(points.front());
  for (size_t i = 0; i + 1 < u.size(); ++i) {
    const Between spline(u, given, bends, i);
    const SlopeBetween slope(spline, u[i], u[i + 1]);
    for (int k = 0; k < parts; ++k) {
      const double to = u[i] + (u[i + 1] - u[i]) * (k + 1) / parts;
      s_.push_back(s_.back() + slope.arc(static_cast<double>(k) / parts, (k + 1.0) / parts));
      samples_.push_back(k + 1 == parts ? given[i + 1] : spline.place(to));
    }
  }
  length_ = s_.back();
  bends_ = spline_curvatures(s_, samples_, closed);
}

SpaceCurve::Jet SpaceCurve::at(double s) const {
  const double inside = closed_ ? s - length_ * std::floor(s / length_) : std::clamp(s, 0.0, length_);
  const Between spline(s_, samples_, bends_, interval_of(s_, inside));
  Jet out{spline.place(inside), spline.tangent(inside), spline.bend(inside)};
  if (!closed_ && inside != s) {
    out.place += (s - inside) * out.tangent;
    out.bend.setZero();
  }
  return out;
}

// The sample with the least value of what changes by no more than the way along the curve, the first of several. Where a value lies above
// the least of a few samples, none within a way of that difference can be less: most are passed over.
template <class Value>
size_t SpaceCurve::least_sample(const Value& value) const {
  constexpr double rounding = 1.0 - 1e-6;  // chords are shorter than the curve, up to the digits of its length
  const size_t n = samples_.size(), stride = std::max<size_t>(1, static_cast<size_t>(std::sqrt(static_cast<double>(n))));
  double least = std::numeric_limits<double>::infinity(), found = least;
  for (size_t i = 0; i < n; i += stride) least = std::min(least, value(samples_[i]));
  size_t best = 0;
  for (size_t i = 0; i < n;) {
    const double v = value(samples_[i]);
    least = std::min(least, v);
    if (v < found) found = v, best = i;
    const double next = s_[i] + rounding * (v - least);
    if (++i < n && s_[i] < next)
      i = static_cast<size_t>(std::lower_bound(s_.begin() + static_cast<std::ptrdiff_t>(i), s_.end(), next) - s_.begin());
  }
  return best;
}

// Two samples to both sides of one, at an end beyond which an open curve goes on straight none.
SpaceCurve::Reach SpaceCurve::reach_of(size_t sample) const {
  const size_t last = samples_.size() - 1;
  const auto before = [&](size_t n) { return sample >= n ? s_[sample - n] : s_[last - (n - sample)] - length_; };
  const auto after = [&](size_t n) { return sample + n <= last ? s_[sample + n] : s_[sample + n - last] + length_; };
  if (closed_) return {before(std::min<size_t>(2, last)), after(std::min<size_t>(2, last))};
  return {s_[sample - std::min<size_t>(2, sample)], s_[std::min(sample + 2, last)]};
}

double SpaceCurve::nearest(const Vec3& p) const {
  const size_t best = least_sample([&](const Vec3& sample) { return (sample - p).norm(); });
  const auto [low, high] = reach_of(best);
  const double step = 0.25 * (high - low);
  double s = s_[best];
  // Newton on (c - p) . c' = 0, downhill only.
  for (int k = 0; k < 30; ++k) {
    const Jet c = at(s);
    const Vec3 away = c.place - p;
    const double f = away.dot(c.tangent), slope = c.tangent.squaredNorm() + away.dot(c.bend);
    const double next = std::clamp(slope > 0.0 ? s - f / slope : s - std::copysign(0.5 * step, f), low, high);
    const double moved = std::abs(next - s);
    s = next;
    if (moved <= 1e-15 * length_) break;
  }
  return s;
}

double SpaceCurve::farthest(const Vec3& direction) const {
  const double size = direction.norm();
  const size_t best = least_sample([&](const Vec3& sample) { return size > 0.0 ? -direction.dot(sample) / size : 0.0; });
  const auto [low, high] = reach_of(best);
  const double step = 0.25 * (high - low);
  double s = s_[best];
  // Newton on d . c' = 0, uphill only.
  for (int k = 0; k < 30; ++k) {
    const Jet c = at(s);
    const double f = direction.dot(c.tangent), slope = direction.dot(c.bend);
    const double next = std::clamp(slope < 0.0 ? s - f / slope : s + std::copysign(0.5 * step, f), low, high);
    const double moved = std::abs(next - s);
    s = next;
    if (moved <= 1e-15 * length_) break;
  }
  return s;
}

double SpaceCurve::area_xy() const {
  double twice = 0.0;
  for (size_t i = 0; i < samples_.size(); ++i) {
    const Vec3 &a = samples_[i], &b = samples_[(i + 1) % samples_.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

}  // namespace flexframe::sim
