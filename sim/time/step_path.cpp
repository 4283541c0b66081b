#include "sim/time/step_path.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

constexpr std::array<double, 2> inside = {1.0 / 3.0, 2.0 / 3.0};  // shares of a step at which rates are evaluated within it

// Integrals from 0 to s of the polynomials of degree three that are 1 at one of 0, 1/3, 2/3, 1 and 0 at the others, and of the one of
// degree four that is 0 at all of them and whose integral to 1 is 1.
std::array<double, 5> integrals(double s) {
  const double a = s * s, b = a * s, c = b * s, d = c * s;
  const auto of = [&](double k0, double k1, double k2, double k3) { return k0 * s + k1 * a / 2.0 + k2 * b / 3.0 + k3 * c / 4.0; };
  // x (x - 1/3) (x - 2/3) (x - 1) = x^4 - 2 x^3 + 11/9 x^2 - 2/9 x, -1/270 to 1.
  const double bubble = d / 5.0 - c / 2.0 + 11.0 / 27.0 * b - a / 9.0;
  return {of(1.0, -5.5, 9.0, -4.5), of(0.0, 9.0, -22.5, 13.5), of(0.0, -4.5, 18.0, -13.5), of(0.0, 1.0, -4.5, 4.5), -270.0 * bubble};
}

}  // namespace

void StepPath::clear() {
  ends_.clear();
  known_ = false;
}

void StepPath::add(double time, const VecX& y, const VecX& rates) {
  constexpr size_t most = 4;
  if (ends_.size() == most) std::rotate(ends_.begin(), ends_.begin() + 1, ends_.end());
  else ends_.emplace_back();
  ends_.back() = {time, y, rates};
  known_ = false;
}

bool StepPath::foretell(double time, VecX& y) const {
  // With steps of equal length the weights of the older ends stay below one within the last step; with older ones of a third of it an
  // error of theirs counts some ten times.
  constexpr double shortest = 1.0 / 3.0;
  if (ends_.size() < 3) return false;
  size_t first = ends_.size() - 2;
  const double last = ends_[first + 1].time - ends_[first].time;
  while (first > 0 && ends_[first].time - ends_[first - 1].time >= shortest * last) --first;
  if (ends_.size() - first < 3) return false;
  y = ends_.back().y;
  for (size_t i = first; i < ends_.size(); ++i) {
    const End& end = ends_[i];
    double value = 1.0, slope = 0.0;  // of the polynomial that is 1 here and 0 at the others; its slope here
    for (size_t j = first; j < ends_.size(); ++j)
      if (j != i) {
        value *= (time - ends_[j].time) / (end.time - ends_[j].time);
        slope += 1.0 / (end.time - ends_[j].time);
      }
    const double away = time - end.time, square = value * value;
    y += square * ((1.0 - 2.0 * away * slope) * (end.y - ends_.back().y) + away * end.rates);
  }
  return true;
}

bool StepPath::at(double time, const Rates& f, const Own& own, VecX& y) {
  if (ends_.size() < 2) return false;
  const End &begin = ends_[ends_.size() - 2], &end = ends_.back();
  const double h = end.time - begin.time;
  if (!known_) {
    std::array<VecX, 2> places;
    for (size_t k = 0; k < inside.size(); ++k) {
      const double t = begin.time + inside[k] * h;
      if (!foretell(t, places[k])) own(t, places[k]);
      if (!f(t, places[k], within_[k])) return false;
    }
    known_ = true;
  }
  const std::array<double, 5> w = integrals((time - begin.time) / h);
  const std::array<double, 5> whole = integrals(1.0);
  const auto moved = [&](const std::array<double, 5>& weights) -> VecX {
    return h * (weights[0] * begin.rates + weights[1] * within_[0] + weights[2] * within_[1] + weights[3] * end.rates);
  };
  y = begin.y + moved(w) + w[4] * (end.y - begin.y - moved(whole));
  return true;
}

}  // namespace flexframe::sim
