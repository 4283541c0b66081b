#include "sim/accuracy_task.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

// Settings that are tried for the run itself.
constexpr int most_rounds = 14;

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

// Options of the run itself, which stops where its CPU time exceeds a limit.
struct TooDear {};
SimulateOptions options_within(const Task& t, double limit) {
  SimulateOptions o = *t.options;
  o.tolerance.reset();
  o.method = t.search.method;
  o.estimate_error = false;
  o.progress = [&t, limit, start = thread_seconds()](double time) {
    if (thread_seconds() - start > limit) throw TooDear{};
    if (t.options->progress) t.options->progress(time);
  };
  return o;
}

// Where vibrations are followed the difference to a looser run is all that is wrong in time, and only the modes left out are wrong in space.
// Jumps of loads excite all modes and are seen elsewhere in the mechanism, so that neither frequencies nor levels tell where modes are missing:
// each body is judged by a run with more modes in it alone, and those that lack most get them.
std::optional<Finished> finish_followed(Task& t, double limit) {
  Search& search = t.search;
  const double accuracy = t.accuracy;
  Setting& setting = t.setting;
  std::vector<Refinement> list = search.refinements(setting);
  Finished out;
  const auto at_this = [&]() -> std::optional<Histories> {
    for (;;) {
      std::optional<Histories> run = search.run_within(search.at(setting), limit);
      if (run || limit < unlimited) return run;
      // Too loose to hold the mechanism together, perhaps.
      if (setting.tolerance <= 1e-7) return search.run(search.at(setting));
      setting.tolerance *= 0.1;
    }
  };
  std::optional<Histories> here = at_this();
  bool found_again = t.without.empty();
  double space_error = 10.0 * accuracy;
  for (int round = 0; here; ++round) {
    // While modes lack, time need not be better than they are.
    const double timely = std::max(0.35 * accuracy, 0.1 * space_error);
    MatX time;
    for (;;) {
      const Scene loose = search.at({setting.level, 10.0 * setting.tolerance});
      std::optional<Histories> looser = search.run_within(loose, unlimited);
      if (!looser && setting.tolerance <= 1e-11) looser = search.run(loose);
      double step = 0.1;
      if (looser) {
        out.looser = std::move(*looser);
        time = error_of_difference * relative(out.looser, *here);
        if (largest(time) <= timely || setting.tolerance <= 1e-11) break;
        step = std::pow(0.25 * accuracy / largest(time), 1.0 / cautious_order);
      }
      setting.tolerance = std::max(1e-11, setting.tolerance * std::clamp(step, 0.1, 0.5));
      here = at_this();
      if (!here) return std::nullopt;
    }
    MatX squares = MatX::Zero(time.rows(), time.cols());  // bodies vibrate at frequencies of their own
    double worst = 0.0;
    for (Refinement& r : list) {
      Search finer = search;
      Setting next = setting;
      finer.refine(r, next);
      const std::optional<Histories> judge = finer.run_within(finer.at(next), unlimited);
      search.cpu = finer.cpu;
      if (!judge) continue;
      const MatX left = relative(*judge, *here);
      // Both runs bring their errors of time, which have nothing to do with each other.
      r.left = std::sqrt(std::max(0.0, std::pow(largest(left), 2) - 2.0 * std::pow(largest(time), 2)));
      if (r.left > 0.0) squares += (left * (r.error() / largest(left))).cwiseAbs2();
      worst = std::max(worst, r.error());
    }
    const MatX space = squares.cwiseSqrt();
    space_error = largest(space);
    const auto total = [&](const MatX& in_time) {
      if (!found_again && out.add_up(*here, in_time, space, t.rigid) <= accuracy && out.add_up(*here, in_time, space, t.rigid + t.left_out) > accuracy) {
        t.find_left_out(setting, *here, dearest * here->statistics.cpu_seconds);
        found_again = true;
      }
      return out.add_up(*here, in_time, space, t.rigid + t.left_out);
    };
    out.loose_tolerance = 10.0 * setting.tolerance;
    if (total(time) <= accuracy) {
      // A looser run may do as well: the one with the fewest evaluations of those whose difference to this one is small enough.
      const double tight = setting.tolerance;
      long least = here->statistics.evaluations;
      MatX of_cheapest = time;
      for (const double factor : {32.0, 16.0, 10.0, 6.0, 4.0, 2.0}) {
        const std::optional<Histories> other = search.run_within(search.at({setting.level, factor * tight}), 2.0 * here->statistics.cpu_seconds);
        if (!other || other->statistics.evaluations >= least) continue;
        const MatX apart_by = relative(*other, *here);
        if (total(apart_by) > accuracy) continue;
        least = other->statistics.evaluations;
        of_cheapest = apart_by;
        setting.tolerance = factor * tight;
      }
      total(of_cheapest);
      break;
    }
    if (round == most_rounds) break;
    const Search before = search;
    const Setting at_before = setting;
    if (worst <= 0.5 * largest(time) || total(0.3 * time) <= accuracy) {
      if (setting.tolerance <= 1e-11) break;
      setting.tolerance *= 0.2;
    } else {
      t.coarse = *here;
      for (Refinement& r : list) {
        if (r.error() < 0.5 * worst) continue;
        search.refine(r, setting);
        r.before = r.left;
      }
    }
    std::optional<Histories> next = search.run_within(search.at(setting), limit);
    if (!next && limit == unlimited) {
      // Finer than the bodies can be, for one: what there is has to do.
      const double spent = search.cpu;
      search = before;
      search.cpu = spent;
      setting = at_before;
      break;
    }
    here = std::move(next);
  }
  if (!here) return std::nullopt;
  out.results = simulate(search.at(setting), options_within(t, unlimited));
  out.setting = setting;
  out.coarse = t.coarse;
  return out;
}

}  // namespace

double Finished::add_up(const Histories& fine, const MatX& in_time, const MatX& in_space, const MatX& in_effects) {
  if (in_time.size() == 0) return 0.0;
  const MatX rest = envelope((in_space.cwiseAbs2() + in_effects.cwiseAbs2()).cwiseSqrt()), whole = rest + envelope(in_time);
  Eigen::Index at = 0;
  error = VecX(whole.rowwise().maxCoeff()).maxCoeff(&at);
  time = largest(in_time.row(at)), space = largest(in_space.row(at)), effects = largest(in_effects.row(at));
  column = fine.columns[static_cast<size_t>(at)];
  return error;
}

// Checked against the level below; one level more as long as space is what lacks.
std::optional<Finished> finish(Task& t, double limit) {
  Search& search = t.search;
  const double accuracy = t.accuracy;
  if (search.has_levels() && follows_vibrations(search.method)) return finish_followed(t, limit);
  Finished out;
  std::optional<Histories> judge;  // what the level below was judged by
  double last_step = 0.0;   // difference of the two levels before
  for (int round = 0;; ++round) {
    const Scene chosen = search.at(t.setting);
    const double start = thread_seconds();
    try {
      out.results = simulate(chosen, options_within(t, limit));
      out.looser = search.run(search.at({t.setting.level, 10.0 * t.setting.tolerance}));
    } catch (const TooDear&) {
      search.cpu += thread_seconds() - start;
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
        t.find_left_out(t.setting, thinned, dearest * out.cpu());
        found_again = true;
      }
      return add_up(t.rigid + t.left_out);
    };
    double error = total();
    const bool stuck = last_step > 0.0 && step > 0.5 * last_step;
    const double step_before = last_step;
    last_step = step;
    // Levels may differ in some bodies only, jumps of loads converge slowly in all of them, and two levels can agree by chance: a finer run tells.
    if (search.has_levels() && error <= accuracy) {
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
    if (round == most_rounds || error <= accuracy) break;
    if (!search.has_levels() && t.setting.tolerance <= 1e-11) break;
    search.cpu += out.cpu();
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
  out.setting = t.setting;
  out.coarse = t.coarse;
  out.loose_tolerance = 10.0 * t.setting.tolerance;
  return out;
}

}  // namespace flexframe::sim
