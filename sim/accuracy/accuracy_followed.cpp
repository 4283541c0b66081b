// The run that keeps an asked accuracy where vibrations are followed.
//
// The difference to a looser run is all that is wrong in time, and only the modes left out are wrong in space. Jumps of loads excite all
// modes and are seen elsewhere in the mechanism, so that neither frequencies nor levels tell where modes are missing: each body is judged
// by a run with more modes in it alone, and those that lack most get them.
#include "sim/accuracy/accuracy_task.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

constexpr double tightest = 1e-11;

struct Followed {
  Task& t;
  double limit;
  Search& search = t.search;
  Setting& setting = t.setting;
  std::vector<Refinement> list = search.refinements(setting);
  Finished out;
  std::optional<Histories> here;  // the run at the setting
  MatX time, space;               // errors, columns x samples
  double worst = 0.0;             // of the bodies' errors of space
  bool found_again = t.without.empty();

  Followed(Task& task, double most) : t(task), limit(most) {}
  std::optional<Histories> run_here();
  bool settle_time(double timely);
  void judge_space();
  double total(const MatX& in_time);
  void take_looser();
  bool refine();
};

// Tighter where it fails; none where it is too dear.
std::optional<Histories> Followed::run_here() {
  for (;;) {
    std::optional<Histories> run = search.run_within(search.at(setting), limit);
    if (run || limit < unlimited) return run;
    // Too loose to hold the mechanism together, perhaps.
    if (setting.tolerance <= 1e-7) return search.run(search.at(setting));
    setting.tolerance *= 0.1;
  }
}

// Lowers the tolerance until a run ten times looser is `timely` near; false where that is too dear.
bool Followed::settle_time(double timely) {
  for (;;) {
    const Scene loose = search.at({setting.level, 10.0 * setting.tolerance});
    std::optional<Histories> looser = search.run_within(loose, unlimited);
    if (!looser && setting.tolerance <= tightest) looser = search.run(loose);
    double step = 0.1;
    if (looser) {
      out.looser = std::move(*looser);
      time = error_of_difference * relative(out.looser, *here);
      if (largest(time) <= timely || setting.tolerance <= tightest) break;
      step = std::pow(0.25 * t.accuracy / largest(time), 1.0 / cautious_order);
    }
    setting.tolerance = std::max(tightest, setting.tolerance * std::clamp(step, 0.1, 0.5));
    here = run_here();
    if (!here) return false;
  }
  out.loose_tolerance = 10.0 * setting.tolerance;
  return true;
}

void Followed::judge_space() {
  MatX squares = MatX::Zero(time.rows(), time.cols());  // bodies vibrate at frequencies of their own
  worst = 0.0;
  for (Refinement& r : list) {
    Search finer = search;
    Setting next = setting;
    finer.refine(r, next);
    const std::optional<Histories> judge = finer.run_within(finer.at(next), unlimited);
    search.cpu = finer.cpu;
    if (!judge) {
      // Nobody knows: it counts as what keeps the accuracy from being claimed.
      squares.array() += std::pow(std::max(2.0 * t.accuracy, r.before), 2);
      continue;
    }
    const MatX left = relative(*judge, *here);
    // Both runs bring their errors of time, which have nothing to do with each other where modes vibrate; volumes that turn far are wrong
    // in the same way in both (a cantilever let go under 40 m/s^2: 3.0e-3 told where 1.2e-2 was true).
    const double of_time = r.body ? 2.0 * std::pow(largest(time), 2) : 0.0;
    r.left = std::sqrt(std::max(0.0, std::pow(largest(left), 2) - of_time));
    if (r.left > 0.0) squares += (left * (r.error() / largest(left))).cwiseAbs2();
    worst = std::max(worst, r.error());
  }
  space = squares.cwiseSqrt();
  // After a contact or a stop the next one comes at another time: modes do not add up then, and two runs may differ by less than either is
  // wrong (a flap on a stop: 0.097 told where 0.27 was true).
  if (search.touches) space *= 3.0;
}

// The error with what is left out, which is found again at this setting where it decides.
double Followed::total(const MatX& in_time) {
  if (!found_again && out.add_up(*here, in_time, space, t.rigid) <= t.accuracy &&
      out.add_up(*here, in_time, space, t.rigid + t.left_out) > t.accuracy) {
    t.find_left_out(setting, *here, dearest * here->statistics.cpu_seconds);
    found_again = true;
  }
  return out.add_up(*here, in_time, space, t.rigid + t.left_out);
}

// A looser run may do as well: the one with the fewest evaluations of those whose difference to this one is small enough.
void Followed::take_looser() {
  const double tight = setting.tolerance;
  long least = here->statistics.evaluations;
  MatX of_cheapest = time;
  for (const double factor : {32.0, 16.0, 10.0, 6.0, 4.0, 2.0}) {
    const std::optional<Histories> other =
        search.run_within(search.at({setting.level, factor * tight}), 2.0 * here->statistics.cpu_seconds);
    if (!other || other->statistics.evaluations >= least) continue;
    const MatX apart_by = relative(*other, *here);
    if (total(apart_by) > t.accuracy) continue;
    least = other->statistics.evaluations;
    of_cheapest = apart_by;
    setting.tolerance = factor * tight;
  }
  total(of_cheapest);
}

// Tighter or with more modes, whichever lacks; false where neither is possible, and what there is has to do.
bool Followed::refine() {
  const Search before = search;
  const Setting at_before = setting;
  if (worst <= 0.5 * largest(time) || total(0.3 * time) <= t.accuracy) {
    if (setting.tolerance <= tightest) return false;
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
    // Finer than the bodies can be, for one.
    const double spent = search.cpu;
    search = before;
    search.cpu = spent;
    setting = at_before;
    return false;
  }
  here = std::move(next);
  return true;
}

}  // namespace

std::optional<Finished> finish_followed(Task& t, double limit) {
  Followed f(t, limit);
  double lacking = 10.0 * t.accuracy;  // of space
  Finished last;                       // judged
  try {
    f.here = f.run_here();
    for (int round = 0; f.here; ++round) {
      // While modes lack, time need not be better than they are.
      if (!f.settle_time(std::max(0.35 * t.accuracy, 0.1 * lacking))) return std::nullopt;
      f.judge_space();
      lacking = largest(f.space);
      if (f.total(f.time) <= t.accuracy) {
        if (!t.straight) f.take_looser();
        break;
      }
      last = f.out;
      last.setting = f.setting;
      if (round == most_rounds || !f.refine()) break;
    }
  } catch (const SearchSpent&) {
    // The last one that was judged, made in full: a run of known price.
    if (last.error < 0.0) throw;
    t.search.until = 1e300;
    run_itself(t, last.setting, unlimited, last);
    last.coarse = t.coarse;
    t.keep(last);
    throw;
  }
  if (!f.here) return std::nullopt;

  run_itself(t, f.setting, unlimited, f.out);
  f.out.coarse = t.coarse;
  t.keep(f.out);
  return std::move(f.out);
}

}  // namespace flexframe::sim
