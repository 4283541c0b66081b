#include "sim/scene/table.h"

#include "sim/scene/spline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// The last point becomes the first one again, a period later. A table that ends there but for the digits in which it is written is as long
// as its period: a point so close beside the closing one would hold the curve level there, or bend it without bound.
void close_after(double period, std::vector<double>& x, std::vector<double>& y) {
  constexpr double digits_of_places = 1e-3, digits_of_values = 1e-6;  // relative to the steps of the table, to the range of its values
  const double length = x.back() - x.front(), beyond = length - period;
  const double step = std::min(x[1] - x[0], x[x.size() - 1] - x[x.size() - 2]);
  if (std::abs(beyond) <= digits_of_places * step) {
    const auto [low, high] = std::minmax_element(y.begin(), y.end());
    if (!(std::abs(y.back() - y.front()) <= digits_of_values * (*high - *low)))
      throw InputError(
          fmt::format("a table as long as its period must end with the value it starts with, {}; found {}", y.front(), y.back()));
    x.pop_back();
    y.pop_back();
  } else if (beyond > 0.0) {
    throw InputError(fmt::format("the period {} is shorter than the table, {}", period, length));
  }
  x.push_back(x.front() + period);
  y.push_back(y.front());
}

}  // namespace

CubicTable::CubicTable(std::vector<double> x, std::vector<double> y, std::optional<double> period)
    : x_(std::move(x)), y_(std::move(y)), period_(period.value_or(0.0)) {
  if (x_.size() < 2 || x_.size() != y_.size()) throw InputError(fmt::format("a table needs two points or more, found {}", x_.size()));
  for (size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1]))
      throw InputError(fmt::format("the first numbers of a table must ascend: point {} has {} after {}", i + 1, x_[i], x_[i - 1]));
  if (period_ > 0.0) close_after(period_, x_, y_);

  m_ = spline_curvatures(x_, y_, period_ > 0.0);
}

TimeJet CubicTable::jet(double x) const {
  if (period_ > 0.0) {
    x -= period_ * std::floor((x - x_.front()) / period_);
  } else if (x < x_.front() || x > x_.back()) {
    return {x < x_.front() ? y_.front() : y_.back(), 0.0, 0.0};
  }
  return spline_jet(x_, y_, m_, interval_of(x_, x), x);
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
