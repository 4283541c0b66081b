#include "sim/time/step_works.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// Intervals between points: those of a step in which little turns, and the most, for some 150 radians.
constexpr Eigen::Index fewest = 16, most = 256;
// Of the largest work of a step: a tenth of what energies that do not balance are warned of from.
constexpr double small = 1e-3;

// The integral from -1 on of the polynomial through the values at cos(pi j / n), n their number less one.
Eigen::Matrix2Xd integrated(const Eigen::Matrix2Xd& values, double half_length) {
  const Eigen::Index n = values.cols() - 1;
  Eigen::Matrix2Xd c = Eigen::Matrix2Xd::Zero(2, n + 3), out = Eigen::Matrix2Xd::Zero(2, n + 2);
  for (Eigen::Index k = 0; k <= n; ++k) {
    for (Eigen::Index j = 0; j <= n; ++j)
      c.col(k) += (j == 0 || j == n ? 1.0 : 2.0) / static_cast<double>(n) *
                  std::cos(std::numbers::pi * static_cast<double>(j * k % (2 * n)) / static_cast<double>(n)) * values.col(j);
    if (k == n) c.col(k) *= 0.5;  // that of k = 0 stands twice
  }
  for (Eigen::Index k = 1; k <= n + 1; ++k) {
    out.col(k) = half_length / (2.0 * static_cast<double>(k)) * (c.col(k - 1) - c.col(k + 1));
    out.col(0) += (k % 2 == 0 ? -1.0 : 1.0) * out.col(k);
  }
  return out;
}

}  // namespace

void StepWorks::follow(double from, double to, const Rates& rates) {
  from_ = from, to_ = to;
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
  const auto at_point = [&](Eigen::Index j, Eigen::Index n) {
    return rates(middle + half * std::cos(std::numbers::pi * static_cast<double>(j) / static_cast<double>(n)));
  };
  Eigen::Index n = std::max(fewest, points_);
  Eigen::Matrix2Xd values(2, n + 1);
  for (Eigen::Index j = 0; j <= n; ++j) values.col(j) = at_point(j, n);
  for (;;) {
    series_ = integrated(values, half);
    const Eigen::Array2d size = scale_.cwiseMax(series_.rightCols(n + 1).cwiseAbs().rowwise().sum());
    const auto beyond = [&](Eigen::Index k) { return series_.rightCols(n + 2 - k).cwiseAbs().rowwise().sum().array(); };
    if (n >= most || (beyond(3 * n / 4) <= small * size).all()) {
      scale_ = size;
      points_ = (beyond(3 * n / 8) <= small * size).all() ? n / 2 : n;
      return;
    }
    Eigen::Matrix2Xd more(2, 2 * n + 1);
    for (Eigen::Index j = 0; j <= 2 * n; ++j) more.col(j) = j % 2 == 0 ? Eigen::Vector2d(values.col(j / 2)) : at_point(j, 2 * n);
    values = std::move(more);
    n *= 2;
  }
}

Eigen::Vector2d StepWorks::at(double t) const {
  const double x = std::clamp((2.0 * t - from_ - to_) / (to_ - from_), -1.0, 1.0);
  // Clenshaw's recursion.
  Eigen::Vector2d b = Eigen::Vector2d::Zero(), before = b;
  for (Eigen::Index k = series_.cols() - 1; k > 0; --k) {
    const Eigen::Vector2d next = series_.col(k) + 2.0 * x * b - before;
    before = b;
    b = next;
  }
  return series_.col(0) + x * b - before;
}

}  // namespace flexframe::sim
