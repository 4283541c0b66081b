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

std::vector<CubicTable> splines(const std::vector<double>& u, const std::vector<Vec3>& points, std::optional<double> period) {
  std::vector<CubicTable> out;
  out.reserve(3);
  for (int k = 0; k < 3; ++k) {
    std::vector<double> y;
    y.reserve(points.size());
    for (const Vec3& p : points) y.push_back(p[k]);
    out.emplace_back(u, std::move(y), period);
  }
  return out;
}

// The spline through the given points, by the length of their chords u; of a closed curve the first point is the last one again.
struct Through {
  const std::vector<double>& u;
  std::array<std::vector<double>, 3> y, m;
  Through(const std::vector<double>& by, const std::vector<Vec3>& points, bool closed) : u(by) {
    for (size_t k = 0; k < 3; ++k) {
      y[k].reserve(u.size());
      for (size_t i = 0; i < u.size(); ++i) y[k].push_back(points[i % points.size()][static_cast<Eigen::Index>(k)]);
      m[k] = spline_curvatures(u, y[k], closed);
    }
  }
  // Between the points i and i + 1.
  TimeJet jet(size_t k, size_t i, double at) const { return spline_jet(u, y[k], m[k], i, at); }
  Vec3 place(size_t i, double at) const { return {jet(0, i, at).value, jet(1, i, at).value, jet(2, i, at).value}; }
};

// Slope of a spline between two of its points, a parabola: its values at both ends and in the middle are all of it.
struct SlopeBetween {
  Vec3 begin, linear, square;
  double width;  // of the parameter
  // i: of the point at u.
  SlopeBetween(const Through& through, size_t i, double u, double v) : width(v - u) {
    for (size_t d = 0; d < 3; ++d) {
      const Eigen::Index k = static_cast<Eigen::Index>(d);
      const double a = through.jet(d, i, u).rate, middle = through.jet(d, i, 0.5 * (u + v)).rate, b = through.jet(d, i, v).rate;
      begin[k] = a;
      square[k] = 2.0 * (a - 2.0 * middle + b);
      linear[k] = b - a - square[k];
    }
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
  const Through through(u, points, closed);
  const int parts = parts_of_stretch(n);
  s_.reserve(1 + (u.size() - 1) * static_cast<size_t>(parts));
  samples_.reserve(s_.capacity());
  s_.push_back(0.0);
  samples_.push_back(points.front());
  for (size_t i = 0; i + 1 < u.size(); ++i) {
    const SlopeBetween slope(through, i, u[i], u[i + 1]);
    for (int k = 0; k < parts; ++k) {
      const double to = u[i] + (u[i + 1] - u[i]) * (k + 1) / parts;
      s_.push_back(s_.back() + slope.arc(static_cast<double>(k) / parts, (k + 1.0) / parts));
      samples_.push_back(k + 1 == parts ? points[(i + 1) % n] : through.place(i, to));
    }
  }
  length_ = s_.back();
  xyz_ = splines(s_, samples_, closed ? std::optional<double>(length_) : std::nullopt);
}

SpaceCurve::Jet SpaceCurve::at(double s) const {
  const double inside = closed_ ? s : std::clamp(s, 0.0, length_);
  const TimeJet x = xyz_[0].jet(inside), y = xyz_[1].jet(inside), z = xyz_[2].jet(inside);
  Jet out{{x.value, y.value, z.value}, {x.rate, y.rate, z.rate}, {x.acceleration, y.acceleration, z.acceleration}};
  if (inside != s) {
    out.place += (s - inside) * out.tangent;
    out.bend.setZero();
  }
  return out;
}

double SpaceCurve::nearest(const Vec3& p) const {
  size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < samples_.size(); ++i)
    if (const double d = (samples_[i] - p).squaredNorm(); d < least) least = d, best = i;
  const double step = length_ / static_cast<double>(samples_.size() - 1);
  const double low = closed_ || best > 0 ? s_[best] - 2.0 * step : 0.0;
  const double high = closed_ || best + 1 < samples_.size() ? s_[best] + 2.0 * step : length_;
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
  size_t best = 0;
  for (size_t i = 1; i < samples_.size(); ++i)
    if (direction.dot(samples_[i]) > direction.dot(samples_[best])) best = i;
  const double step = length_ / static_cast<double>(samples_.size() - 1);
  const double low = closed_ ? s_[best] - 2.0 * step : std::max(0.0, s_[best] - 2.0 * step);
  const double high = closed_ ? s_[best] + 2.0 * step : std::min(length_, s_[best] + 2.0 * step);
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
