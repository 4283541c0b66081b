#include "sim/time/sampled_remainder.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

MatX closest_parabola(const MatX& values, Eigen::Index every) {
  const Eigen::Index spans = (values.cols() - 1) / every;
  // Legendre's polynomials 1, x, (3 x^2 - 1) / 2: their normal equations are nearly diagonal.
  MatX by(spans + 1, 3), sums = MatX::Zero(values.rows(), 3);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i <= spans; ++i) {
    const double x = 2.0 * static_cast<double>(i) / static_cast<double>(spans) - 1.0, weight = i == 0 || i == spans ? 0.5 : 1.0;
    by.row(i) << 1.0, x, 1.5 * x * x - 0.5;
    normal.noalias() += weight * by.row(i).transpose() * by.row(i);
    sums.noalias() += values.col(i * every) * (weight * by.row(i));
  }
  const MatX c = normal.ldlt().solve(sums.transpose()).transpose();
  MatX out(values.rows(), 3);
  out.col(0) = c.col(0) - 0.5 * c.col(2);
  out.col(1) = c.col(1);
  out.col(2) = 1.5 * c.col(2);
  return out;
}

MatX spread(const MatX& values) {
  MatX out = MatX::Zero(values.rows(), 2 * values.cols() - 1);
  for (Eigen::Index i = 0; i < values.cols(); ++i) out.col(2 * i) = values.col(i);
  return out;
}

Shaken shake(const VecX& frequencies, double span, const MatX& loads) {
  const Eigen::Index n = frequencies.size(), last = loads.cols() - 1;
  Shaken out;
  // What does not vibrate turns by so little that it makes no difference.
  out.frequencies = frequencies.cwiseMax(1e-3 / span);
  out.span = span;
  out.sums = MatX::Zero(2 * n, last + 1);
  const double part = span / static_cast<double>(last);
  VecX before(2 * n), now(2 * n);
  for (Eigen::Index i = 0; i <= last; ++i) {
    const Eigen::ArrayXd angle = out.frequencies.array() * (part * static_cast<double>(i));
    now.head(n) = angle.cos() * loads.col(i).array();
    now.tail(n) = angle.sin() * loads.col(i).array();
    if (i > 0) out.sums.col(i) = out.sums.col(i - 1) + 0.5 * part * (before + now);
    std::swap(before, now);
  }
  return out;
}

VecX Shaken::at(double s) const {
  const Eigen::Index n = frequencies.size(), last = sums.cols() - 1;
  const double place = std::clamp(s / span, 0.0, 1.0) * static_cast<double>(last);
  const Eigen::Index i = std::min(static_cast<Eigen::Index>(place), last - 1);
  const double share = place - static_cast<double>(i);
  const Eigen::ArrayXd sum = (1.0 - share) * sums.col(i).array() + share * sums.col(i + 1).array(), angle = frequencies.array() * s,
                       cos = angle.cos(), sin = angle.sin();
  VecX out(2 * n);
  out.head(n) = (sin * sum.head(n) - cos * sum.tail(n)) / frequencies.array();
  out.tail(n) = cos * sum.head(n) + sin * sum.tail(n);
  return out;
}

}  // namespace flexframe::sim
