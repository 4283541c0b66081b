// Functions given by points: twice continuously differentiable cubic splines (de Boor, A Practical Guide to Splines, 2001, ch. IV).
//
// End conditions: not-a-knot, so that a cubic is reproduced exactly (two points: a line; three: a parabola); with a period the curve
// closes with value, slope and curvature. Beyond the ends of a table without period the end values stay.
#pragma once

#include "sim/scene/expression.h"

#include <memory>
#include <optional>
#include <vector>

namespace flexframe::sim {

class CubicTable {
 public:
  // x ascending strictly, as many y, at least two points. With a period: it exceeds x.back() - x.front(), and the curve returns to
  // y.front() at x.front() + period. Throws InputError saying which point is wrong.
  CubicTable(std::vector<double> x, std::vector<double> y, std::optional<double> period);

  TimeJet jet(double x) const;  // value, slope, curvature
  double value(double x) const { return jet(x).value; }
  double front() const { return x_.front(); }
  double back() const { return x_.back(); }
  bool periodic() const { return period_ > 0.0; }

 private:
  std::vector<double> x_, y_, m_;  // m: second derivatives at the points
  double period_ = 0.0;            // 0: none
};

// A function of time: an expression or a table. The interface is Expression's.
class TimeFunction {
 public:
  TimeFunction() = default;
  // Of an expression; of a table, which it keeps.
  explicit TimeFunction(Expression expression) : expression_(std::move(expression)) {}
  explicit TimeFunction(std::shared_ptr<const CubicTable> table) : table_(std::move(table)) {}

  double value(double t) const { return table_ ? table_->value(t) : expression_.value(t); }
  TimeJet jet(double t) const { return table_ ? table_->jet(t) : expression_.jet(t); }
  bool constant() const { return !table_ && expression_.constant(); }
  bool has_switches() const { return !table_ && expression_.has_switches(); }
  // A table is smooth enough for the integrator's error control; only its ends are kinks.
  std::vector<double> switch_times(double t0, double t1) const;
  void freeze(double t_inside) {
    if (!table_) expression_.freeze(t_inside);
  }
  void unfreeze() { expression_.unfreeze(); }

 private:
  Expression expression_;
  std::shared_ptr<const CubicTable> table_;
};

}  // namespace flexframe::sim
