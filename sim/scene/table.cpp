#include "sim/scene/table.h"

#include "sim/scene/spline.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::sim {
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
