#include "sim/accuracy/accuracy_task.h"
#include "sim/run/start_forces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

namespace flexframe::sim {
namespace {

// The largest size of each row within a twentieth of the duration, before or after: what oscillates is as wrong in between.
MatX envelope(const MatX& m) {
  const MatX size = m.cwiseAbs();
  const Eigen::Index n = m.cols(), reach = n / 20;
  MatX out(m.rows(), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index first = std::max<Eigen::Index>(0, k - reach), last = std::min(n - 1, k + reach);
    out.col(k) = size.middleCols(first, last - first + 1).rowwise().maxCoeff();
  }
  return out;
}

// The vector that each column is a component of, by number.
std::vector<Eigen::Index> vectors_of(const Histories& h) {
  std::map<std::string, Eigen::Index> known;
  std::vector<Eigen::Index> out;
  for (size_t k = 0; k < h.columns.size(); ++k) {
    const std::string name = h.columns[k].substr(0, h.columns[k].rfind('.')) + "\n" + h.units[k];
    out.push_back(known.try_emplace(name, static_cast<Eigen::Index>(known.size())).first->second);
  }
  return out;
}

// The size of each column's whole vector: an asked accuracy is one of vectors, whose components have one range (histories.h; a crane's boom
// had 8.9e-3 in its worst component and 1.03e-2 as a vector).
MatX vector_sizes(const Histories& h, const MatX& columns) {
  const std::vector<Eigen::Index> of = vectors_of(h);
  MatX squares = MatX::Zero(columns.rows(), columns.cols()), out = squares;  // a vector a row; as many rows as are needed or more
  for (Eigen::Index c = 0; c < out.rows(); ++c) squares.row(of[c]) += columns.row(c).cwiseAbs2();
  for (Eigen::Index c = 0; c < out.rows(); ++c) out.row(c) = squares.row(of[c]).cwiseSqrt();
  return out;
}

}  // namespace

MatX left_out_by(const std::vector<Task::Share>& shares, const Histories& h) {
  // What an effect does to outputs that it does not move itself, through the motion of the mechanism, at least.
  constexpr double elsewhere = 0.2;
  const Eigen::Index n = h.values.rows();
  // Of a vector whose error is 1, each component.
  const VecX alone = vector_sizes(h, MatX::Ones(n, 1)).col(0).cwiseInverse();
  VecX out = VecX::Zero(n);
  for (const Task::Share& share : shares)
    out += share.columns.size() == n ? VecX(share.columns.cwiseMax(elsewhere * share.worth * alone)) : VecX(share.worth * alone);
  // Where places of pictures are what is asked, the scene's own outputs have sizes beyond measure.
  constexpr double beyond_measure = 1e250;
  if (h.sizes.size() == n) out = (h.sizes.array() > beyond_measure).select(0.0, out);
  return out.replicate(1, h.values.cols());
}

double Finished::add_up(const Histories& fine, const MatX& in_time, const MatX& in_space, const MatX& in_effects, double equal) {
  if (in_time.size() == 0) return error = 0.0;
  const MatX rest = envelope((in_space.cwiseAbs2() + in_effects.cwiseAbs2()).cwiseSqrt()), of_time = envelope(in_time);
  const MatX squares = equal * equal * of_time.cwiseAbs2() + rest.cwiseAbs2();
  const MatX whole = (rest + of_time).cwiseMax(squares.cwiseSqrt());
  const MatX vectors = vector_sizes(fine, whole);
  error = largest(vectors);
  sizes = {fine.times, fine.columns, whole, error};
  Eigen::Index at = 0;  // the largest component of the vector that is furthest off
  VecX((vectors.rowwise().maxCoeff().array() >= error).select(whole.rowwise().maxCoeff(), -1.0)).maxCoeff(&at);
  const auto share = [&](const MatX& columns) { return largest(MatX(vector_sizes(fine, envelope(columns)).row(at))); };
  time = share(in_time), space = share(in_space), effects = share(in_effects);
  if (std::hypot(equal * time, space, effects) > time + std::hypot(space, effects)) time *= equal;
  column = fine.columns[at];
  return error;
}

double Finished::after_start() const {
  const Eigen::Index later = sizes.shares.cols() - sizes.shares.cols() / 20 - 1;
  if (later < 1 || std::abs(sizes.error - error) > 0.1 * error) return -1.0;
  return std::sqrt(3.0) * sizes.shares.rightCols(later).maxCoeff();  // of a whole vector at most
}

void Finished::count_start(Search& search, const Histories& fine) {
  std::optional<Scene> shorter = search.shorter_at_ends();
  if (!shorter) return;
  constexpr double instant = 1e-6, longest = 1.0;  // of the duration; CPU s
  shorter->simulation.duration *= instant;
  shorter->simulation.output_rate = 1.0 / shorter->simulation.duration;
  const std::optional<Histories> start = search.run_within(*shorter, longest);
  if (!start || start->columns != fine.columns) return;
  // Lengths are at least halved; what the next elements add is 3 % of that (mast of a stacker crane).
  constexpr double of_the_change = 2.25;
  const VecX ranges = output_ranges(fine);
  for (Eigen::Index c = 0; c < ranges.size(); ++c) {
    if (ranges[c] <= 0.0 || !converges_slowly(fine.units[c])) continue;
    const double lacks = of_the_change * std::abs(start->values(c, 0) - fine.values(c, 0)) / ranges[c];
    if (lacks <= error) continue;
    error = space = lacks, time = effects = 0.0;
    column = fine.columns[c];
    unreached =
        "; it is at t = 0, when a joint still holds what the beam's element beside it weighs, which only many elements make small: request "
        "less accuracy";
  }
}

void run_itself(const Task& t, const Setting& setting, double limit, Finished& out) {
  SimulateOptions o = *t.options;
  o.tolerance.reset();
  o.method = t.search.method;
  o.estimate_error = false;
  o.progress = [&t, limit, start = work_seconds()](double time) {
    const double now = work_seconds();
    if (now > t.search.until) throw SearchSpent{};
    if (now - start > limit) throw TooDear{};
    if (t.options->progress) t.options->progress(time);
  };
  out.scene = t.search.at(setting);
  out.results = run_for_check(out.scene, o, out.limits);
  out.setting = setting;
  out.method = t.search.method;
  out.described = t.search.describe(setting);
  out.chosen = t.chosen;
  out.loose_tolerance = 10.0 * setting.tolerance;
}

// Checked against the level below; one level more as long as space is what lacks.
std::optional<Finished> finish(Task& t, double limit) {
  Search& search = t.search;
  const double accuracy = t.accuracy;
  if (search.has_levels() && follows_vibrations(search.method)) return finish_followed(t, limit);
  Finished out;
  std::optional<Histories> judge;  // what the level below was judged by
  double last_step = 0.0;          // difference of the two levels before
  for (int round = 0;; ++round) {
    const double start = work_seconds();
    try {
      run_itself(t, t.setting, limit, out);
      out.looser = search.run(search.at({t.setting.level, 10.0 * t.setting.tolerance}));
    } catch (const TooDear&) {
      search.cpu += work_seconds() - start;
      return std::nullopt;
    } catch (const SimulationError&) {
      // Too loose or too coarse to hold the mechanism together, perhaps.
      if (t.setting.tolerance <= 1e-7 || round == most_rounds) throw;
      t.setting.tolerance *= 0.1;
      t.setting.level += search.has_levels();
      t.coarse_again();
      continue;
    }
    const Histories fine = to_histories(out.results);
    const Histories thinned = at_times(fine, t.coarse.times);
    MatX space = relative(t.coarse, thinned);
    const double step = search.has_levels() ? largest(space) : 0.0;
    // A geometric series: what is still to come is the last step / (ratio - 1). The first ratio is taken for 3; free vibrations after a
    // release converge slowly, by 1.5 a level, unless a finer run tells.
    const double ratio = last_step > 0.0 ? std::clamp(last_step / std::max(step, 1e-300), 1.5, 6.0) : 3.0;
    space *= search.has_levels() ? 1.0 / (ratio - 1.0) : 0.0;
    // The error of time again, in the modes that the level below did not have.
    const MatX time = error_of_difference * relative(out.looser, thinned);
    const auto add_up = [&](const MatX& effects) { return out.add_up(fine, time, space, effects); };
    // Where what is left out decides, it is found again in these modes.
    bool found_again = t.without.empty();
    const auto total = [&] {
      if (!found_again && add_up(t.rigid) <= accuracy && add_up(t.rigid + t.left_out) > accuracy) {
        t.find_left_out(t.setting, thinned, dearest * out.work());
        found_again = true;
      }
      return add_up(t.rigid + t.left_out);
    };
    double error = total();
    const bool stuck = last_step > 0.0 && step > 0.5 * last_step;
    const double step_before = last_step;
    last_step = step;
    // Levels may differ in some bodies only, jumps of loads converge slowly in all of them, and two levels can agree by chance: a finer run
    // tells. So it does where the level below is the same: bodies have no more modes of bending (two rods that strike, 96 modes of 300
    // elements and two of stretching: 5.5e-2 of time alone was told where 0.37 is true).
    if (search.has_levels() && (error <= accuracy || step == 0.0)) {
      const Scene finer = search.finer_than(t.setting);
      // The level below was judged by these modes and one more in bodies where this level has none more: do these matter?
      const bool more_matter = judge && apart(*judge, thinned) > unasked * accuracy;
      judge = search.run_within(finer, unlimited);
      // Where it tells more, its word counts.
      MatX left = judge ? MatX(-relative(*judge, thinned)) : space;
      // Three levels tell how fast they converge.
      if (judge) {
        const double falls = std::clamp(step / std::max(largest(left), 1e-300), 1.5, 6.0);
        left *= falls / (falls - 1.0);
      }
      for (Eigen::Index c = 0; c < space.rows(); ++c)
        if (largest(left.row(c)) > largest(space.row(c))) space.row(c) = left.row(c);
      error = total();
      if (error > accuracy && more_matter) search.keep_at_least(finer);
    }
    out.coarse = t.coarse;
    t.keep(out);
    if (round == most_rounds || error <= accuracy) break;
    // What is off at t = 0 alone falls as one over the modes: far from what is asked more of them are of no use. Volumes bend farther.
    constexpr double beyond_reach = 3.0;
    const double later = out.after_start();
    const bool one_frame = std::all_of(out.limits.begin(), out.limits.end(), [](const LinearLimit& l) { return l.pieces == 1; });
    if (search.has_levels() && one_frame && error > beyond_reach * accuracy && later >= 0.0 && later <= accuracy) break;
    if (!search.has_levels() && t.setting.tolerance <= 1e-11) break;
    search.cpu += out.work();
    // More modes that do not help are the error of time in them.
    if (!search.has_levels() || ((stuck || out.time > 0.5 * accuracy) && t.setting.tolerance > 1e-10)) {
      const double step_down = std::pow(0.4 * accuracy / std::max(out.time, 0.4 * accuracy), 1.0 / cautious_order);
      t.setting.tolerance = std::max(1e-11, t.setting.tolerance * std::clamp(step_down, 0.05, 0.3));
      t.coarse_again();
      last_step = stuck ? 0.0 : step_before;
      continue;
    }
    ++t.setting.level;
    t.coarse = thinned;
  }
  return out;
}

}  // namespace flexframe::sim
