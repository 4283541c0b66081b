#include "interp/spline.h"

#include "interp/dense_solvers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace flexframe::interp {
namespace {

constexpr int highest = 5;

// Knots of the spline through the parameters: the inner ones but those next to the ends, which are no knots.
std::vector<double> make_knots(std::span<const double> at, int degree) {
  const size_t n = at.size(), order = static_cast<size_t>(degree) + 1, skip = order / 2;
  std::vector<double> knots(order, at.front());
  // An odd degree has its knots at parameters; an even one only serves few values, where it is one polynomial.
  if (n > order)
    for (size_t k = skip; k + skip < n; ++k) knots.push_back(at[k]);
  knots.insert(knots.end(), order, at.back());
  return knots;
}

// The basis functions that live at x, from index `first` on: values of this degree, and of one degree less for the slopes.
struct Basis {
  size_t first = 0;
  std::array<double, highest + 1> value{}, slope{};
};

Basis basis_at(const std::vector<double>& knots, int degree, double x) {
  const size_t p = degree;
  const size_t last = knots.size() - p - 2;
  const auto above = std::upper_bound(knots.begin(), knots.end(), x);
  const size_t span = std::clamp(static_cast<size_t>(above - knots.begin()), p + 1, last + 1) - 1;
  Basis b;
  b.first = span - p;
  std::array<double, highest + 1> lower{};
  b.value[0] = 1.0;
  for (size_t d = 1; d <= p; ++d) {
    lower = b.value;
    std::array<double, highest + 1> next{};
    for (size_t j = 0; j < d; ++j) {
      const double left = knots[span + 1 + j - d], right = knots[span + 1 + j];
      const double share = lower[j] / (right - left);
      next[j] += (right - x) * share;
      next[j + 1] += (x - left) * share;
    }
    b.value = next;
  }
  for (size_t j = 0; j < p; ++j) {
    const double rate = static_cast<double>(p) * lower[j] / (knots[span + 1 + j] - knots[span + 1 + j - p]);
    b.slope[j] -= rate;
    b.slope[j + 1] += rate;
  }
  return b;
}

// Rows of the parameters `wanted` in the values at the parameters `at`.
void window_rows(std::span<const double> at, std::span<const double> wanted, int degree, Eigen::MatrixXd& value, Eigen::MatrixXd& slope) {
  const auto n = static_cast<Eigen::Index>(at.size()), m = static_cast<Eigen::Index>(wanted.size());
  const std::vector<double> knots = make_knots(at, degree);
  auto collect = [&](std::span<const double> places, Eigen::MatrixXd& v, Eigen::MatrixXd* g) {
    v.setZero(static_cast<Eigen::Index>(places.size()), n);
    if (g) g->setZero(v.rows(), n);
    for (Eigen::Index i = 0; i < v.rows(); ++i) {
      const Basis b = basis_at(knots, degree, places[i]);
      for (Eigen::Index j = 0; j <= degree; ++j) {
        v(i, static_cast<Eigen::Index>(b.first) + j) = b.value[j];
        if (g) (*g)(i, static_cast<Eigen::Index>(b.first) + j) = b.slope[j];
      }
    }
  };
  Eigen::MatrixXd at_nodes, v, g;
  collect(at, at_nodes, nullptr);
  collect(wanted, v, &g);
  const Eigen::MatrixXd inverse = inverse_by_full_pivots(at_nodes);
  value.resize(m, n);
  slope.resize(m, n);
  value.noalias() = v * inverse;
  slope.noalias() = g * inverse;
}

constexpr size_t window = 24, margin = 24;  // the influence of a value falls by 2.3 an interval: 1e-9 over the margin

// Rows by windows of values; value index i of the extended line is column column_of[i].
SplineRows rows_of_degree(std::span<const double> at, std::span<const int> column_of, int columns, std::span<const double> wanted,
                          int degree) {
  std::vector<Eigen::Triplet<double>> values, slopes;
  SplineRows out;
  const size_t n = at.size();
  size_t next = 0;
  Eigen::MatrixXd value, slope;
  for (size_t from = 0; from + 1 < n && next < wanted.size(); from += window) {
    const size_t to = std::min(n - 1, from + window);
    size_t end = next;
    while (end < wanted.size() && (to == n - 1 || wanted[end] < at[to])) ++end;
    if (end == next) continue;
    const size_t lo = from > margin ? from - margin : 0, hi = std::min(n, to + margin + 1);
    window_rows(at.subspan(lo, hi - lo), wanted.subspan(next, end - next), std::min(degree, static_cast<int>(hi - lo) - 1), value, slope);
    for (Eigen::Index i = 0; i < value.rows(); ++i) {
      out.lebesgue = std::max(out.lebesgue, value.row(i).lpNorm<1>());
      for (Eigen::Index j = 0; j < value.cols(); ++j) {
        const int row = static_cast<int>(next) + static_cast<int>(i), column = column_of[lo + j];
        if (std::abs(value(i, j)) > 1e-14) values.emplace_back(row, column, value(i, j));
        if (slope(i, j) != 0.0) slopes.emplace_back(row, column, slope(i, j));
      }
    }
    next = end;
  }
  out.value.resize(static_cast<Eigen::Index>(wanted.size()), columns);
  out.slope.resize(static_cast<Eigen::Index>(wanted.size()), columns);
  out.value.setFromTriplets(values.begin(), values.end());
  out.slope.setFromTriplets(slopes.begin(), slopes.end());
  return out;
}

}  // namespace

SplineRows spline_rows(std::span<const double> at, std::span<const double> wanted, double period) {
  const int n = static_cast<int>(at.size());
  if (n < 2) throw ArgumentError("a spline needs at least two values");
  // A closed line is continued over its ends, round and round.
  std::vector<double> line(at.begin(), at.end());
  std::vector<int> column(at.size());
  for (int i = 0; i < n; ++i) column[i] = i;
  if (period > 0.0) {
    line.clear();
    column.clear();
    for (int i = -static_cast<int>(margin); i <= n + static_cast<int>(margin); ++i) {
      const int turn = i >= 0 ? i / n : -((n - 1 - i) / n), k = i - turn * n;
      line.push_back(at[k] + turn * period);
      column.push_back(k);
    }
  }
  const int most = std::min(highest, static_cast<int>(line.size()) - 1);
  for (int degree = most;; degree = degree > 3 ? 3 : 1) {
    SplineRows rows = rows_of_degree(line, column, n, wanted, degree);
    if (degree <= 1 || (rows.lebesgue <= 4.0 && std::isfinite(rows.lebesgue))) return rows;
  }
}

}  // namespace flexframe::interp
