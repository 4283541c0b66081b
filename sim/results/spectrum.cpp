#include "sim/results/spectrum.h"

#include <unsupported/Eigen/FFT>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace flexframe::sim {
namespace {

// Lagrange's cubic through the four samples about a place.
double between(const VecX& x, const VecX& values, Eigen::Index low, double at) {
  const Eigen::Index first = std::clamp<Eigen::Index>(low - 1, 0, x.size() - 4);
  double sum = 0.0;
  for (Eigen::Index i = first; i < first + 4; ++i) {
    double weight = 1.0;
    for (Eigen::Index k = first; k < first + 4; ++k)
      if (k != i) weight *= (at - x[k]) / (x[i] - x[k]);
    sum += weight * values[i];
  }
  return sum;
}

}  // namespace

Spectrum amplitude_spectrum(const VecX& x, const VecX& values) {
  const Eigen::Index n = x.size();
  if (n < 16 || values.size() != n) throw InputError("a spectrum needs at least 16 samples");
  for (Eigen::Index i = 1; i < n; ++i)
    if (!(x[i] > x[i - 1])) throw InputError("a spectrum needs samples in ascending order: the shaft must turn one way");
  const double span = (x[n - 1] - x[0]) * static_cast<double>(n) / static_cast<double>(n - 1), step = span / static_cast<double>(n);
  VecX even(n), window(n);
  for (Eigen::Index i = 0, low = 0; i < n; ++i) {
    const double at = std::min(x[0] + step * static_cast<double>(i), x[n - 1]);
    while (low + 2 < n && x[low + 1] <= at) ++low;
    window[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n));
    even[i] = between(x, values, low, at);
  }
  // Without the mean that the window sees nothing of it stands in the first line.
  const double weights = window.sum(), weighted = window.dot(even) / weights;
  std::vector<double> windowed(n);
  for (Eigen::Index i = 0; i < n; ++i) windowed[i] = window[i] * (even[i] - weighted);
  std::vector<std::complex<double>> lines;
  Eigen::FFT<double> fft;
  fft.fwd(lines, windowed);
  Spectrum out;
  const VecX steps = x.tail(n - 1) - x.head(n - 1);
  out.coarsest = steps.maxCoeff();
  out.even = out.coarsest - steps.minCoeff() <= 1e-6 * step;
  const auto seen = static_cast<Eigen::Index>(span / (2.0 * out.coarsest) * (1.0 + 1e-6));
  const Eigen::Index half = std::clamp<Eigen::Index>(seen, 3, n / 2) + 1;
  out.at.resize(half);
  out.amplitude.resize(half);
  for (Eigen::Index k = 0; k < half; ++k) {
    out.at[k] = static_cast<double>(k) / span;
    out.amplitude[k] = 2.0 * std::abs(lines[k]) / weights;
  }
  out.amplitude[0] = std::abs(even.mean());
  return out;
}

SpectralLine largest_line(const Spectrum& s) {
  Eigen::Index k = 0;
  s.amplitude.tail(s.amplitude.size() - 1).maxCoeff(&k);
  ++k;
  SpectralLine out{s.at[k], s.amplitude[k]};
  if (k < 2 || k + 1 >= s.at.size() || !(out.amplitude > 0.0)) return out;
  // A sine d lines beside this one, |d| <= 1/2: its share of a line by Hann's window.
  const auto share = [](double d) {
    if (std::abs(d) < 1e-9) return 1.0;
    if (std::abs(std::abs(d) - 1.0) < 1e-9) return 0.5;
    const double turn = std::numbers::pi * d;
    return std::abs(std::sin(turn) / (turn * (1.0 - d * d)));
  };
  const double before = s.amplitude[k - 1], after = s.amplitude[k + 1], nearer = std::max(before, after) / out.amplitude;
  const double d = std::clamp((2.0 * nearer - 1.0) / (nearer + 1.0), 0.0, 0.5) * (after > before ? 1.0 : -1.0);
  const double amplitude = out.amplitude / share(d);
  // Other sines nearby, or a frequency that changes, make another lobe.
  constexpr double fits = 0.02;
  if (std::abs(before - amplitude * share(d + 1.0)) > fits * amplitude || std::abs(after - amplitude * share(d - 1.0)) > fits * amplitude)
    return out;
  return {s.at[k] + d * (s.at[1] - s.at[0]), amplitude};
}

std::string doubt_of(const Spectrum& s, const SpectralLine& largest) {
  constexpr double fewest_periods = 3.0, fewest_samples = 8.0;  // Hann's main lobe; 0.8 % off by the cubic
  if (!(largest.amplitude > 1e-12 * s.amplitude[0])) return {};
  const double periods = largest.at / s.at[1], samples = 1.0 / (largest.at * s.coarsest);
  if (periods < fewest_periods)
    return fmt::format("has only {:.2g} of its periods in these samples: it is a drift, or too slow for its size to be told", periods);
  if (!s.even && samples < fewest_samples)
    return fmt::format("has only {:.2g} samples a period where they are farthest apart: its size is too small; take a larger output_rate",
                       samples);
  return {};
}

}  // namespace flexframe::sim
