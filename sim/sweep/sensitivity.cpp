#include "sim/sweep/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace flexframe::sim {
namespace {

constexpr long fewest_blocks = 8, fewest_paths = 2;
constexpr int resamplings = 500;

// Responses of the whole blocks, a block a row: A, B, then A with the column of one key from B.
MatX whole_rows(const VecX& y, long length, long& left_out) {
  std::vector<long> whole;
  const long rows = y.size() / length;
  for (long r = 0; r < rows; ++r)
    if (y.segment(r * length, length).allFinite()) whole.push_back(r);
  left_out = rows - static_cast<long>(whole.size());
  MatX out(static_cast<Eigen::Index>(whole.size()), length);
  for (std::size_t k = 0; k < whole.size(); ++k) out.row(static_cast<Eigen::Index>(k)) = y.segment(whole[k] * length, length).transpose();
  return out;
}

struct Pair {
  double first, total;
};

// Of the rows in `chosen`.
std::vector<Pair> indices_of(const MatX& rows, const std::vector<Eigen::Index>& chosen, double& variance) {
  const Eigen::Index d = rows.cols() - 2;
  const auto n = static_cast<double>(chosen.size());
  double mean = 0.0, square = 0.0;
  for (const Eigen::Index r : chosen) mean += rows(r, 0) + rows(r, 1);
  mean /= 2.0 * n;
  for (const Eigen::Index r : chosen) square += std::pow(rows(r, 0) - mean, 2) + std::pow(rows(r, 1) - mean, 2);
  variance = square / (2.0 * n);
  std::vector<Pair> out(d, Pair{0.0, 0.0});
  for (Eigen::Index k = 0; k < d; ++k) {
    for (const Eigen::Index r : chosen) {
      const double a = rows(r, 0), b = rows(r, 1), ab = rows(r, 2 + k);
      // The mean taken off makes the estimate of the first index less scattered, and changes nothing of what it estimates.
      out[k].first += (b - mean) * (ab - a);
      out[k].total += 0.5 * (a - ab) * (a - ab);
    }
    out[k].first /= n * variance;
    out[k].total /= n * variance;
  }
  return out;
}

// The middle 95 % of the values.
std::pair<double, double> interval_of(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) { return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))]; };
  return {at(0.025), at(0.975)};
}

void add_sobol(const MatX& rows, Sensitivity& out) {
  std::vector<Eigen::Index> all(rows.rows());
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  const std::vector<Pair> indices = indices_of(rows, all, out.variance);
  const double scale = rows.cwiseAbs().maxCoeff();
  if (!(out.variance > 1e-24 * scale * scale)) return;
  std::vector<std::vector<double>> first(indices.size()), total(indices.size());
  std::mt19937_64 random(1);
  std::vector<Eigen::Index> chosen(all.size());
  for (int k = 0; k < resamplings; ++k) {
    for (Eigen::Index& r : chosen) r = static_cast<Eigen::Index>(random() % all.size());
    double variance = 0.0;
    const std::vector<Pair> sample = indices_of(rows, chosen, variance);
    if (!(variance > 0.0)) continue;
    for (std::size_t i = 0; i < sample.size(); ++i) first[i].push_back(sample[i].first), total[i].push_back(sample[i].total);
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const auto [first_low, first_high] = interval_of(first[i]);
    const auto [total_low, total_high] = interval_of(total[i]);
    out.sobol.push_back({indices[i].first, first_low, first_high, indices[i].total, total_low, total_high});
  }
}

void add_morris(const Design& design, const VecX& y, Sensitivity& out) {
  const auto d = static_cast<long>(design.axes().size());
  std::vector<std::vector<double>> effects(d);
  for (long path = 0; path < design.draws(); ++path) {
    if (!y.segment(path * (d + 1), d + 1).allFinite()) {
      ++out.left_out;
      continue;
    }
    ++out.used;
    for (long k = 0; k < d; ++k) {
      const Design::Move move = design.move(path, k);
      effects[move.axis].push_back((y[path * (d + 1) + k + 1] - y[path * (d + 1) + k]) / move.step);
    }
  }
  if (out.used < fewest_paths) return;
  for (const std::vector<double>& e : effects) {
    MorrisEffect one;
    const auto n = static_cast<double>(e.size());
    for (const double x : e) one.mean_size += std::abs(x) / n, one.mean += x / n;
    for (const double x : e) one.deviation += (x - one.mean) * (x - one.mean) / (n - 1.0);
    one.deviation = std::sqrt(one.deviation);
    out.morris.push_back(one);
  }
}

}  // namespace

std::vector<Sensitivity> sensitivities(const Sweep& sweep, const SweepTable& table) {
  std::vector<Sensitivity> all;
  const Sampling sampling = sweep.design.sampling();
  if (sampling != Sampling::sobol_indices && sampling != Sampling::morris) return all;
  for (std::size_t k = 0; k < sweep.names.size(); ++k) {
    Sensitivity out;
    out.response = sweep.names[k];
    const VecX y = table.responses.col(static_cast<Eigen::Index>(k));
    if (sampling == Sampling::morris) {
      add_morris(sweep.design, y, out);
    } else {
      const MatX rows = whole_rows(y, static_cast<long>(sweep.design.axes().size()) + 2, out.left_out);
      out.used = rows.rows();
      if (out.used >= fewest_blocks) add_sobol(rows, out);
    }
    all.push_back(std::move(out));
  }
  return all;
}

}  // namespace flexframe::sim
