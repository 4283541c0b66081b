#include "sim/accuracy/accuracy_task.h"

#include <utility>

namespace flexframe::sim {

MatX relative(const Histories& a, const Histories& reference) {
  const Histories there = at_times(a, reference.times);
  const VecX ranges = output_ranges(reference, there);
  MatX out = there.values - reference.values;
  for (Eigen::Index c = 0; c < out.rows(); ++c) out.row(c) *= ranges[c] > 0.0 ? 1.0 / ranges[c] : 0.0;
  return out;
}

bool nothing_counts(const Histories& a, const Histories& b) {
  const VecX moving = output_ranges(a, a);
  return moving.size() > 0 && moving.maxCoeff() > 0.0 && output_ranges(a, b).maxCoeff() <= 0.0;
}

double apart(const Histories& a, const Histories& reference) {
  return compare_histories(a, reference, output_ranges(reference, a)).largest;
}

double of_kind(const std::string& unit, const ByKind& factors) {
  if (unit == "m" || unit == "rad" || unit == "J" || unit == "1") return factors[0];
  return unit == "m/s" || unit == "rad/s" ? factors[1] : factors[2];
}

double largest(const MatX& m) { return m.size() > 0 ? m.cwiseAbs().maxCoeff() : 0.0; }

void Task::find_left_out(const Setting& here, const Histories& run, double seconds) {
  const std::optional<Histories> with = search.run_within(with_effects_on(search.at(here), search.states, without), seconds);
  if (with && with->columns == run.columns) left_out = relative(*with, run);
}

void Task::leave_out(const std::vector<EffectState>& what, const MatX& change) {
  without.insert(without.end(), what.begin(), what.end());
  left_out += change;
}

void Task::drop_shares_of_what_is_on() {
  const auto is_on = [&](const Share& share) {
    return std::all_of(share.owners.begin(), share.owners.end(), [&](const std::string& owner) {
      return std::any_of(search.states.begin(), search.states.end(),
                         [&](const EffectState& s) { return s.on && s.owner == owner && s.effect == share.effect; });
    });
  };
  if (std::erase_if(shares, is_on) == 0) return;
  if (left_out.rows() == coarse.values.rows()) left_out = left_out_by(shares, coarse).col(0).replicate(1, left_out.cols());
}

void Task::keep(const Finished& finished) {
  if (!nearest || finished.error < 0.0 || (*nearest && (*nearest)->error <= finished.error)) return;
  *nearest = finished;
}

bool Task::coarse_again() {
  std::optional<Histories> again = search.run_within(search.at(below()), unlimited);
  if (again) coarse = std::move(*again);
  return again.has_value();
}

void Task::run_below() {
  // Too loose to hold the mechanism together, perhaps: such a run fails, or its steps become so small that it takes longer than a tighter
  // one by far. What fails at a tight tolerance as well fails.
  for (double longest = unlimited;;) {
    std::optional<Histories> wide = search.run_within(search.at(loose_below()), longest);
    if (wide) longest = 1.0 + 10.0 * wide->statistics.work;
    std::optional<Histories> narrow = wide ? search.run_within(search.at(below()), longest) : std::nullopt;
    if (narrow) {
      loose = std::move(*wide);
      coarse = std::move(*narrow);
      return;
    }
    if (setting.tolerance <= 1e-7) {
      loose = search.run(search.at(loose_below()));
      coarse = search.run(search.at(below()));
      return;
    }
    setting.tolerance *= wide ? 0.01 : 0.1;
  }
}

}  // namespace flexframe::sim
