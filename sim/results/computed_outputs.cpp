#include "sim/results/computed_outputs.h"

#include "sim/scene/expression.h"
#include "sim/scene/scene_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

namespace flexframe::sim {
namespace {

constexpr Eigen::Index reach = 12;
constexpr double unseen_share = 0.05;
// Where it is looked between two samples: at no simple fraction, since a vibration of a multiple of the samples' rate is at rest in those.
constexpr std::array<double, 2> places{0.382, 0.729};

double sinc(double x) { return x == 0.0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); }

// Of the samples reach - 1 before to reach behind the one before the place.
VecX lanczos_weights(double place) {
  VecX weights(2 * reach);
  for (Eigen::Index j = 0; j < 2 * reach; ++j) {
    const double x = static_cast<double>(j - reach + 1) - place;
    weights[j] = sinc(x) * sinc(x / static_cast<double>(reach));
  }
  return weights / weights.sum();
}

// y: count samples; at all places that have enough neighbours.
MatX between_samples(const VecX& y) {
  const Eigen::Index spans = y.size() - 2 * reach + 1;
  MatX out(spans, static_cast<Eigen::Index>(places.size()));
  for (std::size_t p = 0; p < places.size(); ++p) {
    const VecX weights = lanczos_weights(places[p]);
    for (Eigen::Index i = 0; i < spans; ++i) out(i, static_cast<Eigen::Index>(p)) = weights.dot(y.segment(i, 2 * reach));
  }
  return out;
}

double swing(const MatX& values) { return (values.array() - values.mean()).matrix().norm(); }

// Columns between the samples: as their samples say, or as their expressions do.
class Between {
 public:
  Between(const Results& results, Eigen::Index first, Eigen::Index count) : results_(results), first_(first), count_(count) {
    const double step = (results.times[first + count - 1] - results.times[first]) / static_cast<double>(count - 1);
    times_.resize(count - 2 * reach + 1, static_cast<Eigen::Index>(places.size()));
    for (std::size_t p = 0; p < places.size(); ++p)
      for (Eigen::Index i = 0; i < times_.rows(); ++i)
        times_(i, static_cast<Eigen::Index>(p)) = results.times[first] + step * (static_cast<double>(i + reach - 1) + places[p]);
  }

  MatX sampled(const std::string& column) const {
    const auto found = std::find_if(results_.outputs.begin(), results_.outputs.end(), [&](const auto& o) { return o.column == column; });
    return between_samples(found->values.segment(first_, count_));
  }

  // By its expression; a place where that has no value is as the samples say.
  const MatX& compute(const OutputDef& def) {
    const Expression expression(def.expression, names_);
    std::vector<MatX> read;
    for (const std::string& name : expression.variables()) read.push_back(computed_.contains(name) ? computed_.at(name) : sampled(name));
    MatX out = sampled(def.name);
    std::vector<double> variables(read.size());
    for (Eigen::Index k = 0; k < out.size(); ++k) {
      for (std::size_t v = 0; v < read.size(); ++v) variables[v] = read[v].data()[k];
      try {
        out.data()[k] = expression.value(times_.data()[k], variables.data());
      } catch (const SimulationError&) {}
    }
    return computed_[def.name] = out;
  }

  // Columns that expressions may read.
  void know(const std::string& column) { names_.push_back(column); }

 private:
  const Results& results_;
  const Eigen::Index first_, count_;
  MatX times_;
  std::vector<std::string> names_;
  std::map<std::string, MatX> computed_;
};

bool even(const VecX& t) {
  const VecX steps = t.tail(t.size() - 1) - t.head(t.size() - 1);
  return steps.maxCoeff() - steps.minCoeff() <= 1e-6 * steps.mean();
}

std::vector<OutputDef> outputs_of(const Results& results) {
  try {
    if (!results.scene_text.empty()) return parse_scene(results.scene_text, results.scene_file).outputs;
  } catch (const InputError&) {}
  return {};
}

}  // namespace

std::vector<UnseenOutput> computed_beyond_samples(const Results& results, Eigen::Index first, Eigen::Index count) {
  if (count < 4 * reach || !even(results.times.segment(first, count))) return {};
  std::vector<UnseenOutput> out;
  const std::vector<OutputDef> defs = outputs_of(results);
  const auto computed = [&](const std::string& column) {
    return std::find_if(defs.begin(), defs.end(),
                        [&](const OutputDef& d) { return d.quantity == Quantity::expression && d.name == column; });
  };
  Between between(results, first, count);
  for (const ResultOutput& o : results.outputs)
    if (computed(o.column) == defs.end()) between.know(o.column);
  const VecX t = results.times.segment(first, count);
  for (const ResultOutput& o : results.outputs) {
    const auto def = computed(o.column);
    if (def == defs.end()) continue;
    try {
      const MatX& values = between.compute(*def);
      const double missed = (values - between.sampled(o.column)).norm(), size = swing(values);
      if (missed > unseen_share * size && missed > 1e-12 * values.norm())
        out.push_back({o.column, missed / size, static_cast<double>(count - 1) / (t[count - 1] - t[0])});
    } catch (const InputError&) {
      continue;  // names that the results do not have
    }
    between.know(o.column);
  }
  return out;
}

}  // namespace flexframe::sim
