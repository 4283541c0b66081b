#include "sim/time/event_watch.h"

#include "sim/time/events.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexframe::sim {

void EventWatch::begin(System& system, double t, const VecX& y) {
  const size_t n = event_count(system);
  start_.t = t;
  start_y_ = y;
  start_.margin.resize(n);
  before_.margin.clear();
  directions_.assign(n, 0);
  just_begun_ = true;
  if (n > 0) start_ = at(system, t, y);
}

// A multistep interpolant is exact at the step's end and misses its start by up to the tolerance, at first order by a bend of the whole
// step: enough to foretell a stop that is met again at once by a body that has only just left it. What it misses is taken out linearly.
void EventWatch::state_at(const Integrator& integrator, double t, VecX& y) const {
  integrator.interpolate(t, y);
  if (!(end_ > start_.t)) return;
  const double share = (t - start_.t) / (end_ - start_.t), rest = 1.0 - share;
  y += rest * missed_;
  // What the slopes differ by at the start and nothing at the end, nor any state there: Hermite's cubics.
  if (turned_.size() > 0) y += share * rest * rest * turned_ + (rest * rest * (1.0 + 2.0 * share) - rest) * missed_;
}

// The first step after an event is of first order, its interpolant a straight line or nearly so: a body that has just been left slowly
// would seem to come back within the step, and be left again, as often as steps are short against that bend. So the slope there is made
// right.
void EventWatch::take_out_slope(System& system, const Integrator& integrator) {
  const double step = end_ - start_.t;
  VecX rates(start_y_.size()), place;
  state_rate(system, start_.t, start_y_.data(), rates.data());
  // Slope of the interpolant, a polynomial, by five of its places: exact up to the fourth order.
  constexpr double beside = 0.05;
  constexpr std::array<double, 4> weights{48.0, -36.0, 16.0, -3.0};
  VecX slope = -25.0 * (start_y_ - missed_);
  for (size_t i = 0; i < weights.size(); ++i) {
    integrator.interpolate(start_.t + static_cast<double>(i + 1) * beside * step, place);
    slope += weights[i] * place;
  }
  turned_ = step * rates - slope / (12.0 * beside);
}

EventWatch::Point EventWatch::at(System& system, const Integrator& integrator, double t) {
  state_at(integrator, t, scratch_);
  return at(system, t, scratch_);
}

EventWatch::Point EventWatch::at(System& system, double t, const VecX& y) const {
  Point p;
  p.t = t;
  p.margin.resize(start_.margin.size());
  p.rate.resize(start_.margin.size());
  event_margins(system, t, y.data(), p.margin.data());
  event_rates(system, p.rate.data());
  return p;
}

bool EventWatch::ended(const Point& p) const {
  for (size_t k = 0; k < p.margin.size(); ++k)
    if (p.margin[k] < floor_[k]) return true;
  return false;
}

// Whether no margin changes by a good part of itself, in this step or, at its pace, in the one before: one that came to zero in between and
// back would bend sixteen times as sharply as these three ends of steps show.
bool EventWatch::calm(const Point& end) const {
  constexpr double little = 0.25;
  if (before_.margin.size() != end.margin.size() || !(start_.t > before_.t)) return false;
  const double pace = (end.t - start_.t) / (start_.t - before_.t);
  for (size_t k = 0; k < end.margin.size(); ++k) {
    const double a = start_.margin[k], b = end.margin[k];
    if (std::isinf(a) && a == b) continue;  // what cannot end
    if (!(std::max(std::abs(b - a), pace * std::abs(a - before_.margin[k])) <= little * std::min(a, b))) return false;
  }
  return true;
}

// The step's start, looks inside it and its end.
std::vector<EventWatch::Point> EventWatch::looks(System& system, const Integrator& integrator, double t, const VecX& y) {
  std::vector<Point> points{start_};
  Point last = at(system, t, y);
  // Within a step whose error is small a margin has one turning point, seldom two: a look at each third shows it. What stands still while
  // others turn has no error.
  constexpr double angle = 0.5;
  constexpr int most = 4000;
  const int parts = static_cast<int>(std::clamp(std::ceil(watched_turning(system) * (t - start_.t) / angle), 3.0, double{most}));
  const bool reads = !system.model.functions.empty() || !system.model.contacts.empty();
  if (!reads && parts == 3 && calm(last)) {
    points.push_back(std::move(last));
    return points;
  }
  integrator.interpolate(start_.t, missed_);
  missed_ = start_y_ - missed_;
  // Slopes at the ends of the step, by secants.
  constexpr double beside = 0.01;
  const auto look = [&](double share) { points.push_back(at(system, integrator, start_.t + share * (t - start_.t))); };
  if (reads) look(beside / parts);
  for (int i = 1; i < parts; ++i) look(static_cast<double>(i) / parts);
  if (reads) look(1.0 - beside / parts);
  points.push_back(std::move(last));
  if (reads) look_between(system, integrator, points);
  return points;
}

// Between two looks a margin that falls and rises again lies above both of its tangents there, or the chords beside, as long as these are
// taken steep enough: where they meet below zero it is looked at once more.
void EventWatch::look_between(System& system, const Integrator& integrator, std::vector<Point>& points) {
  constexpr int most = 200;  // looks more
  constexpr double steeper = 1.5;
  const double width = points.back().t - points.front().t;
  const auto chord = [&](size_t i, size_t k) { return (points[i + 1].margin[k] - points[i].margin[k]) / (points[i + 1].t - points[i].t); };
  int more = 0;
  for (size_t i = 0; i + 1 < points.size() && more < most;) {
    const Point &a = points[i], &b = points[i + 1];
    double look = 0.0;
    for (size_t k = 0; k < floor_.size() && look == 0.0; ++k) {
      if (a.margin[k] < floor_[k] || b.margin[k] < floor_[k]) continue;
      const double falls = steeper * (std::isfinite(a.rate[k]) ? a.rate[k] : i > 0 ? chord(i - 1, k) : 0.0);
      const double rises = steeper * (std::isfinite(b.rate[k]) ? b.rate[k] : i + 2 < points.size() ? chord(i + 1, k) : 0.0);
      if (!(falls < 0.0 && rises > 0.0)) continue;
      const double meet = (a.margin[k] - b.margin[k] + rises * (b.t - a.t)) / (rises - falls);
      if (a.margin[k] + falls * meet < floor_[k]) look = a.t + std::clamp(meet, 0.1 * (b.t - a.t), 0.9 * (b.t - a.t));
    }
    if (look == 0.0 || b.t - a.t < 1e-6 * width) {
      ++i;
      continue;
    }
    Point between = at(system, integrator, look);
    const bool over = ended(between);
    points.insert(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, std::move(between));
    if (over) return;  // what comes later is of no interest
    ++more;
    if (i > 0) --i;  // its chord has changed
  }
}

// Follows margins that have their least value among the points inside the step. True where one ends there: `before` and `after` enclose its
// zero.
bool EventWatch::dips(System& system, const Integrator& integrator, const std::vector<Point>& points, Point& before, Point& after) {
  for (size_t i = 1; i + 1 < points.size(); ++i)
    for (size_t k = 0; k < floor_.size(); ++k) {
      Point a = points[i - 1], b = points[i], c = points[i + 1];
      if (!(b.margin[k] <= a.margin[k] && b.margin[k] < c.margin[k])) continue;
      // A parabola through three points, renewed around its lowest: ten rounds leave a millionth of the step and less.
      for (int round = 0; round < 10; ++round) {
        const double ab = (b.margin[k] - a.margin[k]) / (b.t - a.t), bc = (c.margin[k] - b.margin[k]) / (c.t - b.t),
                     bend = (bc - ab) / (c.t - a.t);
        if (!(bend > 0.0)) break;
        const double t = 0.5 * (a.t + b.t) - 0.5 * ab / bend, least = b.margin[k] - bend * (t - b.t) * (t - b.t);
        // The parabola stays clear of zero by half of what it was drawn through: the margin stays positive.
        if (least > 0.5 * b.margin[k] || !(t > a.t && t < c.t) || std::abs(t - b.t) <= 1e-6 * (c.t - a.t)) break;
        Point next = at(system, integrator, t);
        if (ended(next)) {
          before = t > b.t ? b : a;
          after = next;
          return true;
        }
        if (next.margin[k] < b.margin[k]) {
          (t > b.t ? a : c) = b;
          b = std::move(next);
        } else {
          (t > b.t ? c : a) = std::move(next);
        }
      }
    }
  return false;
}

// Narrows the enclosure down to the digits of the time: the false position of the margin that comes to zero first, each second time the
// middle.
void EventWatch::locate(System& system, const Integrator& integrator, Point& before, Point& after) {
  const double width = std::max(4e-16 * after.t, 1e-14 * (after.t - start_.t));
  for (int round = 0; after.t - before.t > width && round < 200; ++round) {
    double share = 1.0;
    for (size_t k = 0; k < floor_.size(); ++k)
      if (after.margin[k] < floor_[k]) share = std::min(share, (before.margin[k] - floor_[k]) / (before.margin[k] - after.margin[k]));
    double t = before.t + 0.5 * (after.t - before.t);
    // Beside the place that is foretold, so that the next look encloses it from the other side.
    const double guess = before.t + share * (after.t - before.t),
                 beside = std::max(0.25 * width, 0.01 * std::min(guess - before.t, after.t - guess));
    if (round % 3 == 0) t = guess - beside;
    if (round % 3 == 1) t = guess + beside;
    t = std::clamp(t, before.t + 0.25 * width, after.t - 0.25 * width);
    Point p = at(system, integrator, t);
    (ended(p) ? after : before) = std::move(p);
  }
}

// Whether a phase ends among the looks, and between which two of its points.
bool EventWatch::find(System& system, const Integrator& integrator, std::vector<Point>& points, Point& before, Point& after) {
  size_t first = 1;
  while (first < points.size() && !ended(points[first])) ++first;
  // What lies before the first end that the points show may hide an earlier one.
  const std::vector<Point> clear(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(first));
  if (dips(system, integrator, clear, before, after)) return true;
  if (first == points.size()) return false;
  before = points[first - 1];
  after = points[first];
  return true;
}

bool EventWatch::look(System& system, const Integrator& integrator, double& t, VecX& y) {
  if (start_.margin.empty()) return false;
  end_ = t;
  turned_.resize(0);
  event_roundings(system, floor_);
  for (size_t k = 0; k < floor_.size(); ++k) floor_[k] = std::min(-floor_[k], 2.0 * start_.margin[k]);
  std::vector<Point> points = looks(system, integrator, t, y);
  Point before, after;
  bool found = find(system, integrator, points, before, after);
  if (found && just_begun_) {
    take_out_slope(system, integrator);
    points = looks(system, integrator, t, y);
    found = find(system, integrator, points, before, after);
  }
  just_begun_ = false;
  if (!found) {
    before_ = std::move(start_);
    start_ = std::move(points.back());
    start_y_ = y;
    return false;
  }
  locate(system, integrator, before, after);
  t = after.t;
  state_at(integrator, t, y);
  for (size_t k = 0; k < floor_.size(); ++k) directions_[k] = after.margin[k] < floor_[k] ? -1 : 0;
  return true;
}

}  // namespace flexframe::sim
