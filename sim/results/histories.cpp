#include "sim/results/histories.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace flexframe::sim {
namespace {

// Pairs of samples (of a, of b) at the same times.
std::vector<std::pair<Eigen::Index, Eigen::Index>> common_samples(const VecX& a, const VecX& b) {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> out;
  const double near = 1e-9 * std::max(a.size() > 0 ? std::abs(a[a.size() - 1]) : 0.0, b.size() > 0 ? std::abs(b[b.size() - 1]) : 0.0);
  for (Eigen::Index i = 0, k = 0; i < a.size() && k < b.size();) {
    if (std::abs(a[i] - b[k]) <= near) out.emplace_back(i++, k++);
    else if (a[i] < b[k]) ++i;
    else ++k;
  }
  return out;
}

// The largest of the columns' own values within the vector that each belongs to.
VecX largest_of_vectors(const Histories& h, const VecX& own) {
  const Eigen::Index n = own.size();
  VecX out = VecX::Zero(n);
  std::map<std::pair<std::string, std::string>, double> of_vector;  // by name and unit
  const auto key = [&](Eigen::Index k) { return std::pair(h.columns[k].substr(0, h.columns[k].rfind('.')), h.units[k]); };
  for (Eigen::Index k = 0; k < n; ++k) {
    double& range = of_vector[key(k)];
    range = std::max(range, own[k]);
  }
  for (Eigen::Index k = 0; k < n; ++k) out[k] = of_vector[key(k)];
  return out;
}

// Range of the vector that each column belongs to.
VecX vector_ranges(const Histories& h) {
  if (h.values.cols() == 0) return VecX::Zero(h.values.rows());
  return largest_of_vectors(h, h.values.rowwise().maxCoeff() - h.values.rowwise().minCoeff());
}

bool kinematic(const std::string& unit) { return unit == "m" || unit == "rad" || unit == "m/s" || unit == "rad/s"; }

}  // namespace

Histories to_histories(const Results& results) {
  Histories out;
  out.times = results.times;
  out.values.resize(static_cast<Eigen::Index>(results.outputs.size()), results.times.size());
  for (size_t k = 0; k < results.outputs.size(); ++k) {
    out.columns.push_back(results.outputs[k].column);
    out.units.push_back(results.outputs[k].unit);
    out.values.row(static_cast<Eigen::Index>(k)) = results.outputs[k].values.transpose();
  }
  if (std::any_of(results.outputs.begin(), results.outputs.end(), [](const ResultOutput& o) { return o.size != 0.0; })) {
    out.sizes.resize(out.values.rows());
    for (size_t k = 0; k < results.outputs.size(); ++k) out.sizes[static_cast<Eigen::Index>(k)] = results.outputs[k].size;
  }
  // A file may hold one of them alone.
  for (const VecX* energy : {&results.kinetic, &results.strain})
    if (energy->size() > 0) out.energy_scale = std::max(out.energy_scale, energy->maxCoeff());
  out.scales = results.scales;
  out.statistics = results.statistics;
  return out;
}

VecX rounding_of_outputs(const Histories& h) {
  const Eigen::Index n = h.values.rows();
  VecX out = VecX::Zero(n);
  if (h.values.cols() == 0) return out;
  // What counts as moving is seen against the largest output of the same unit.
  std::map<std::string, double> largest;
  for (Eigen::Index k = 0; k < n; ++k) {
    double& m = largest[h.units[k]];
    m = std::max(m, h.values.row(k).cwiseAbs().maxCoeff());
  }
  // Where every output of a unit stands still, what is left is rounding of other sizes: moments of forces, angles of a turn, speeds of the
  // places passed.
  const double duration = std::max(h.times[h.times.size() - 1] - h.times[0], 1e-300);
  const double length = std::max(largest["m"], h.scales.length), force = std::max(largest["N"], h.scales.force);
  const double reach = h.scales.length > 0.0 ? h.scales.length : 1.0;
  const std::map<std::string, double> rounding = {{"m", 1e-12 * length},
                                                  // as beside an angle of one radian
                                                  {"rad", 1e-11},
                                                  {"rad/s", 1e-11 / duration},
                                                  {"m/s", 1e-12 * length / duration},
                                                  {"m/s^2", 1e-12 * length / (duration * duration)},
                                                  {"N", 1e-12 * force},
                                                  {"N m", 1e-12 * force * reach},
                                                  {"W", 1e-12 * std::max(force * length, h.energy_scale) / duration}};
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::string& unit = h.units[k];
    const auto floor = rounding.find(unit);
    out[k] = std::max((kinematic(unit) ? 1e-11 : 1e-6) * largest[unit], floor == rounding.end() ? 0.0 : floor->second);
    // Stiff bodies take rounding of places for forces, which the softest give way to.
    if (h.scales.rests && floor != rounding.end()) out[k] = std::max(out[k], 1e6 * floor->second);
  }
  if (h.scales.rests) out = out.cwiseMax(1e-3 * largest_of_vectors(h, h.values.cwiseAbs().rowwise().maxCoeff()));
  return out;
}

VecX output_ranges(const Histories& h) {
  const Eigen::Index n = h.values.rows();
  VecX out = VecX::Zero(n);
  if (h.values.cols() == 0) return out;
  const VecX ranges = vector_ranges(h), rounding = rounding_of_outputs(h);
  for (Eigen::Index k = 0; k < n; ++k) {
    // A part of the energy counts against its own range: beside what turns fast all that bodies store is little.
    const bool whole = h.sizes.size() > 0 && h.sizes[k] < 0.0;
    if (h.units[k] == "J") out[k] = !whole && ranges[k] > 1e-9 * h.energy_scale ? ranges[k] : std::max(ranges[k], h.energy_scale);
    else if (ranges[k] > rounding[k]) out[k] = ranges[k];
    if (h.sizes.size() > 0 && h.sizes[k] > 0.0) out[k] = h.sizes[k];
  }
  return out;
}

double outputs_over_sizes(const Histories& h) {
  if (h.sizes.size() == 0 || h.values.cols() == 0) return 1.0;
  const VecX ranges = vector_ranges(h), rounding = rounding_of_outputs(h);
  double out = 0.0;
  for (Eigen::Index k = 0; k < ranges.size(); ++k) {
    if (ranges[k] <= rounding[k]) continue;
    out = std::max(out, h.sizes[k] > 0.0 ? ranges[k] / h.sizes[k] : 1.0);
  }
  return out > 0.0 ? std::min(out, 1.0) : 1.0;
}

VecX output_ranges(const Histories& run, const Histories& other) {
  constexpr double rounding = 6e-13, alike = 0.3;
  VecX out = output_ranges(run);
  if (run.columns != other.columns || (out.array() > 0.0).all()) return out;
  const VecX ranges = vector_ranges(run);
  const auto samples = common_samples(other.times, run.times);
  double length = run.scales.length;
  for (Eigen::Index k = 0; k < out.size(); ++k)
    if (run.units[k] == "m") length = std::max(length, run.values.row(k).cwiseAbs().maxCoeff());
  const double duration = std::max(run.times[run.times.size() - 1] - run.times[0], 1e-300);
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    const std::string& unit = run.units[k];
    if (out[k] > 0.0 || !kinematic(unit)) continue;
    const double least = rounding * (unit.starts_with("m") ? length : 1.0) / (unit.ends_with("/s") ? duration : 1.0);
    if (ranges[k] <= least) continue;
    double apart = 0.0;
    for (const auto& [i, j] : samples) apart = std::max(apart, std::abs(other.values(k, i) - run.values(k, j)));
    if (apart <= alike * ranges[k]) out[k] = ranges[k];
  }
  return out;
}

Difference compare_histories(const Histories& a, const Histories& reference, const VecX& ranges) {
  if (a.columns != reference.columns) throw ArgumentError("histories of other outputs cannot be compared");
  const auto samples = common_samples(a.times, reference.times);
  if (samples.empty()) throw ArgumentError("histories without common times cannot be compared");
  Difference out;
  out.columns = VecX::Zero(ranges.size());
  for (const auto& [i, k] : samples) out.columns = out.columns.cwiseMax((a.values.col(i) - reference.values.col(k)).cwiseAbs());
  for (Eigen::Index c = 0; c < ranges.size(); ++c) {
    out.columns[c] = ranges[c] > 0.0 ? out.columns[c] / ranges[c] : 0.0;
    if (ranges[c] > 0.0 && (out.column < 0 || out.columns[c] > out.largest)) out.largest = out.columns[c], out.column = static_cast<int>(c);
  }
  return out;
}

Histories at_times(const Histories& h, const VecX& times) {
  const auto samples = common_samples(h.times, times);
  Histories out = h;
  out.times.resize(static_cast<Eigen::Index>(samples.size()));
  out.values.resize(h.values.rows(), static_cast<Eigen::Index>(samples.size()));
  for (size_t s = 0; s < samples.size(); ++s) {
    const Eigen::Index at = samples[s].first;
    out.times[static_cast<Eigen::Index>(s)] = h.times[at];
    out.values.col(static_cast<Eigen::Index>(s)) = h.values.col(at);
  }
  return out;
}

}  // namespace flexframe::sim
