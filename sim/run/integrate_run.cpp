#include "sim/run/integrate_run.h"

#include "sim/base/cpu_clock.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/massless.h"
#include "sim/run/method_choice.h"
#include "sim/time/event_watch.h"
#include "sim/time/events.h"
#include "sim/time/newton_matrix.h"
#include "sim/time/step_guard.h"
#include "sim/time/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// All times at which an expression changes its piece, ascending, then the end.
std::vector<double> segment_ends(const Model& model) {
  std::vector<double> ends;
  for (const TimeFunction& e : model.expressions) {
    const std::vector<double> t = e.switch_times(0.0, model.settings.duration);
    ends.insert(ends.end(), t.begin(), t.end());
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  ends.push_back(model.settings.duration);
  return ends;
}

// What "auto" took for a long run is looked at again after that many steps. At a tight tolerance the third order of the Runge-Kutta method
// makes its steps short: where they pass no more than a few radians of the fastest vibration, Adams follows it for at most twice the
// evaluations, and drifts a hundredth as far (elastic pendulum at 1e-8: 3 million evaluations for 1.6, its energy 1e-8 off instead of
// 2e-6).
constexpr long trial_steps = 500;
constexpr double tight = 1.0001e-8, followed_radians = 10.0;

// A method that turns out wrong: with so many steps to go others are tried for `trial_length` steps, and one that goes so many times as far
// an evaluation is taken.
constexpr double long_run = 20000, worth_changing = 5.0;
constexpr int trial_length = 60;
// Adams after events: steps until its order has grown and what hit a stop has left it, what they are asked for, the least that digits
// allow.
constexpr long restart_steps = 200;
constexpr double restart_strictness = 100.0, tightest = 1e-12;
// With so many steps to go the user is told what they are spent on.
constexpr double worth_telling = 2e5;

// A stop that is touched: coordinate and rate in the state, and how fast its spring lets what hits it vibrate, rad/s. A blow is over within
// half such a vibration, and less deep than its speed over the frequency: an error of the depth that is small against the way makes a
// large one of the speed afterwards (a ball on 1e8 N/m gained 4e-6 of its energy in every blow at a tolerance of 1e-6). So the
// coordinate is asked for no less than its rate is.
struct StopSpring {
  Eigen::Index q = 0, rate = 0;
  double frequency = 0.0;
};

std::vector<StopSpring> find_touched(System& system, double t, const VecX& y) {
  std::vector<StopSpring> out;
  VecX beside = y, rates, pushed;
  for (const int i : system.stops) {
    const Part& part = system.model.parts[static_cast<size_t>(i)];
    if (system.work.joints[static_cast<size_t>(i)].stop == StopPhase::free) continue;
    Eigen::Index rate = -1, at = system.model.nq;
    for (size_t c = 0; c < system.model.clusters.size(); ++c)
      for (const int k : system.work.clusters[c].partition.ind) {
        if (system.model.clusters[c].v0 + k == part.v0) rate = at;
        ++at;
      }
    if (rate < 0) continue;
    // The spring is linear: any step shows its stiffness over the mass that moves with it.
    const double step = 1e-6 * system.weights.size(part.q0);
    rates.resize(y.size());
    pushed.resize(y.size());
    state_rate(system, t, y.data(), rates.data());
    beside[part.q0] += step;
    state_rate(system, t, beside.data(), pushed.data());
    beside[part.q0] = y[part.q0];
    if (const double square = (rates[rate] - pushed[rate]) / step; square > 0.0) out.push_back({part.q0, rate, std::sqrt(square)});
  }
  return out;
}

// What most likely makes the steps small at the present state, half a sentence; `complaint`: of the last evaluation that failed, if one
// did.
std::string likely_cause(System system, double t, const VecX& y, const std::string& complaint) {
  if (!complaint.empty()) return complaint;
  try {
    set_state(system, t, y.data(), true);
  } catch (const SimulationError& error) {
    return error.what();
  }
  const FrictionPoint* worst = nullptr;
  for (const FrictionPoint& p : system.friction.points)
    if (p.law.reaction && p.phase != FrictionPhase::stick && (!worst || p.normal > worst->normal)) worst = &p;
  if (worst)
    return fmt::format(
        "joint '{}' is self-locking (Painleve): its reaction grows with its friction (now {:.3g} N); lower the coefficient, give "
        "normal_force as a number, or give friction a velocity scale (regularised)",
        system.model.parts[worst->part].joint.name, worst->normal);
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const Cluster& cluster = system.model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    if (cluster.loops.empty()) continue;
    const auto speed = [&](int rate) {
      return std::abs(system.work.w[cluster.v0 + rate]) * rate_scale(system.model, static_cast<int>(c), rate);
    };
    double driving = 0.0, driven = 0.0;
    for (int k : cw.partition.ind) driving = std::max(driving, speed(k));
    for (int k : cw.partition.dep) driven = std::max(driven, speed(k));
    for (int i : cluster.parts)
      if (const int motion = system.model.parts[i].joint.motion; motion >= 0)
        driving = std::max(driving, std::abs(system.work.motion[motion].rate) * cluster.size);
    if (driven > 100.0 * driving)
      return fmt::format(
          "the mechanism is at the limit of its reach, where the rates in the loop of joint '{}' grow without bound; if it should go on, "
          "another way to assemble the loop may be meant: choose it by initial = {{ guess = ... }}",
          system.model.loops[system.model.clusters[c].loops.front()].name);
  }
  // A rate whose inertia, with the others free, has almost gone.
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const ClusterWork& cw = system.work.clusters[c];
    const MatX& L = cw.L;
    for (size_t k = 0; k < cw.partition.ind.size() && L.rows() == cw.inertia.size(); ++k) {
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      if (i >= L.rows() ||
          L(i, i) * L(i, i) >
              1e-6 * std::max(cw.inertia[i],
                              system.model.mass * std::pow(rate_scale(system.model, static_cast<int>(c), cw.partition.ind[k]), 2)))
        continue;
      for (const Part& p : system.model.parts)
        if (const int v = system.model.clusters[c].v0 + cw.partition.ind[k]; v >= p.v0 && v < p.v0 + p.joint.nv)
          return fmt::format(
              "joint '{}' reaches a position in which it moves almost without inertia: give the bodies that it moves mass or inertia",
              p.joint.name);
    }
  }
  return "an acceleration grows without bound";
}

// The part of whose inertia deformation has taken most, if all but a thousandth along some coordinate (the steps then become too small): -1
// if none.
int lost_inertia(const System& system) {
  int lost = -1;
  double least = 1e-3;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const Cluster& cluster = system.model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    const MatX& L = cw.L;
    for (size_t k = 0; k < cw.partition.ind.size() && L.rows() == static_cast<Eigen::Index>(cw.partition.ind.size()); ++k)
      for (int i : cluster.parts) {
        const Part& p = system.model.parts[static_cast<size_t>(i)];
        const int e = cluster.v0 + cw.partition.ind[k] - p.ev0;
        if (e < 0 || e >= p.body.n || p.body.Me(e, e) <= 0.0) continue;
        const double pivot = L(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)), left = pivot * pivot / p.body.Me(e, e);
        if (left < least) least = left, lost = i;
      }
  }
  return lost;
}

// Half a sentence about what finds no phase that holds.
std::string unsettled_phases(const System& system, const std::vector<int>& directions) {
  std::string names;
  const auto add = [&](int part) {
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", system.model.parts[static_cast<size_t>(part)].joint.name);
  };
  for (size_t k = 0; k < system.friction.points.size(); ++k)
    if (directions[k] < 0) add(system.friction.points[k].part);
  for (size_t k = 0; k < system.stops.size(); ++k)
    if (directions[system.friction.points.size() + 2 * k] < 0 || directions[system.friction.points.size() + 2 * k + 1] < 0)
      add(system.stops[k]);
  return fmt::format(
      "friction or stop of joint {} switches endlessly between its states, no force satisfies any of them; give friction a velocity scale "
      "(regularised), or the stop damping",
      names);
}

}  // namespace

SolverStatistics integrate(System& system, Method method, const std::vector<double>& times, const RunWatch& told_to,
                           const std::function<void(System&, double, const VecX&)>& sample, int& indefinite) try {
  SolverStatistics out;
  out.tolerance = system.tolerance;
  const double start = cpu_seconds();
  double fastest_vibration = 0.0;
  const bool automatic = method == Method::automatic;
  bool on_trial = automatic && system.tolerance <= tight;
  if (automatic) method = choose_method(system, fastest_vibration);
  on_trial = on_trial && method == Method::dirk && fastest_vibration > 0.0 && may_be_followed(system);
  const auto use = [&](Method chosen, const VecX& state) {
    method = chosen;
    out.method = method_name(method);
    system.weights.begin(system, method, state);
  };
  use(method, pack_state(system, Eigen::Vector2d::Zero()));
  if (method == Method::exponential && (has_events(system) || !system.model.massless.rates.empty()))
    throw InputError(fmt::format("method \"exponential\" follows smooth motion only: {}; take method = \"auto\" or \"erk\"",
                                 has_events(system) ? "dry friction, stops and contacts have events, which need to be located"
                                                    : "massless bodies need an equilibrium in every evaluation"));

  long steps_here = 0;  // since the integrator was started last
  OdeProblem problem;
  // What work was last brought to, for as long as nothing else has moved it.
  struct {
    bool valid = false;
    double t = 0.0;
    VecX y, dy;
  } at_work;
  problem.rhs = [&](double t, const double* y, double* dy) {
    at_work.valid = false;
    state_rate(system, t, y, dy);
    at_work.t = t;
    at_work.y = Eigen::Map<const VecX>(y, problem.size);
    at_work.dy = Eigen::Map<const VecX>(dy, problem.size);
    at_work.valid = true;
  };
  const auto work_is_at = [&](const double* y) {
    return at_work.valid && at_work.y.size() == problem.size && std::equal(y, y + problem.size, at_work.y.data());
  };
  problem.jacobian = [&](double t, const double* y, bool fresh, MechanicalJacobian& into) {
    const bool here = work_is_at(y);
    at_work.valid = false;
    // A stage starts from the beginning of its step: its time is that of the rates.
    update_newton_matrix(system, here ? at_work.t : t, y, here ? at_work.dy.data() : nullptr, fresh, into);
  };
  // Rates that follow from a balance of forces are no states: the structure q' = T w is lost.
  if (!system.model.massless.rates.empty()) problem.jacobian = {};
  problem.closed_derivatives = [&](double t, const double* y, MechanicalJacobian& into) {
    if (!work_is_at(y)) {
      VecX rates(problem.size);
      problem.rhs(t, y, rates.data());
    }
    update_closed_matrix(system, y, into);
  };
  problem.all_derivatives = [&](double t, const double* y, MatX& A, MatX& B) {
    at_work.valid = false;
    difference_rates(system, t, y, A, B);
  };
  problem.keep = [&](VecX& kept) { keep_load_responses(system, kept); };
  problem.shift = [&](double t0, double t, const VecX& kept, double* dy) { return follow_loads(system, t0, t, kept, dy); };
  std::vector<StopSpring> touched;
  // A multistep method begins anew at first order after every event, and what it errs there adds up: its first steps are asked for more.
  const auto asked = [&]() {
    const bool beginning = method == Method::adams && out.restarts > 0 && steps_here < restart_steps;
    return beginning ? std::max(system.tolerance / restart_strictness, std::min(system.tolerance, tightest)) : system.tolerance;
  };
  problem.weights = [&](const double*, double* w) {
    system.weights.write(asked(), w);
    for (const StopSpring& s : touched) w[s.q] = std::max(w[s.q], s.frequency * w[s.rate]);
  };

  const std::vector<double> ends = segment_ends(system.model);
  VecX y = pack_state(system, Eigen::Vector2d::Zero());
  const Eigen::Index quadrature = system.quadrature ? 2 : 0;
  problem.tolerance = system.tolerance;
  std::unique_ptr<Integrator> integrator;
  EventWatch watch;
  StepGuard guard;
  double begun = 0.0;  // where the integrator was started last
  std::vector<std::string> changes;
  const auto retire = [&]() {
    if (!integrator) return;
    const IntegratorStatistics s = integrator->statistics();
    out.steps += s.steps;
    out.jacobians += s.jacobians;
    integrator.reset();
  };
  // After an event the state may have another size: a new integrator.
  const auto begin = [&](double t) {
    retire();
    problem.size = static_cast<int>(y.size());
    problem.cheap_jacobian = matrix_is_cheap(system);
    problem.sharp_jacobian = std::any_of(system.friction.points.begin(), system.friction.points.end(),
                                         [](const FrictionPoint& p) { return p.phase == FrictionPhase::slip; });
    touched = find_touched(system, t, y);
    integrator = std::make_unique<Integrator>(problem, method, t, y);
    watch.begin(system, t, y);
    begun = t;
    steps_here = 0;
    if (has_events(system)) at_work.valid = false;
  };
  const auto partitions = [&]() {
    std::vector<Partition> all;
    for (const ClusterWork& c : system.work.clusters) all.push_back(c.partition);
    return all;
  };
  const auto note_changes = [&](double t) {
    // A page of them tells enough; the number stands in the statistics.
    for (const std::string& change : changes)
      if (system.notes.size() < 200) system.notes.tell("", fmt::format("event at t = {:.9g} s: {}", t, change));
    changes.clear();
  };
  // Where the next step has to end lest it passes over something short: as a rule nowhere, and then at `ahead`.
  const auto guarded = [&](double ahead) {
    const double t = integrator->time(), last = t - integrator->previous_time();
    // Integrators let a step be ten to twenty times as long as the one before, after the first a thousand times as theirs again.
    const double farthest = last == 0.0 ? ahead : std::min(ahead, t + (integrator->previous_time() == begun ? 2e4 : 20.0) * last);
    const double limit = guard.limit(system, t, y, last, farthest);
    // The first step is chosen by the integrator as a tenth of what lies before it at most: only what is shorter has to be told.
    return limit < ahead && (last > 0.0 || limit - t < 0.1 * (ahead - t)) ? limit : ahead;
  };
  size_t next = 0;
  VecX at;
  double from = 0.0;
  long calls = 0, standing = 0;
  const double duration = system.model.settings.duration;
  MethodReview review;
  const auto steps_so_far = [&]() { return out.steps + (integrator ? integrator->statistics().steps : 0); };
  // Simulated seconds an evaluation that another method makes from here, in its stride; 0 where it fails.
  const auto pace_of = [&](Method other, double end) {
    const Method kept = method;
    const ErrorWeights weights = system.weights;
    double pace = 0.0;
    use(other, y);
    try {
      Integrator trial(problem, other, integrator->time(), y);
      double from_time = trial.time();
      long from_evaluations = system.evaluations;
      for (int k = 0; k < trial_length && trial.time() < end; ++k) {
        if (k == trial_length / 2) from_time = trial.time(), from_evaluations = system.evaluations;
        trial.step(end);
      }
      pace = (trial.time() - from_time) / static_cast<double>(std::max(1L, system.evaluations - from_evaluations));
    } catch (const SimulationError&) {}
    at_work.valid = false;
    method = kept;
    out.method = method_name(method);
    system.weights = weights;
    return pace;
  };
  // The method that goes far better from here than the present one does, if one is.
  const auto better_method = [&](double now, double end) {
    Method best = method;
    double pace = worth_changing * review.pace();
    std::vector<Method> others;
    if (method != Method::dirk) others.push_back(Method::dirk);
    if (method != Method::bdf && find_fastest(system, now, y).decays) others.push_back(Method::bdf);
    for (const Method other : others)
      if (const double p = pace_of(other, end); p > pace) best = other, pace = p;
    return best;
  };
  const auto keep_to_budget = [&](double now) {
    const double most = told_to.most_steps;
    const long steps = steps_so_far();
    // Short steps may pass: what sticks and lets go again takes some ten thousand of them. Nobody waits for those of small systems.
    const bool long_enough = steps >= 50000 || cpu_seconds() - start >= 5.0;
    if (static_cast<double>(steps) < most && !(long_enough && review.hopeless(most))) return;
    const double step = review.step() > 0.0 ? review.step() : now / static_cast<double>(std::max(1L, steps));
    throw SimulationError(fmt::format(
        "the run was ended at t = {:.6g} s of {:.6g} s after {} steps: at this pace it takes {:.1e} of them, more than the {:.6g} that it "
        "may. Steps of {:.1e} s: {}. "
        "Simulate a shorter time, leave out or damp what is so fast, ask for less accuracy, or raise max_steps (--max-steps)",
        now, duration, steps, static_cast<double>(steps) + (duration - now) / step, most, step, what_takes_steps(system, now, y, step)));
  };
  bool told = false;
  system.friction.tolerance = system.tolerance;
  const bool slips = std::any_of(system.friction.points.begin(), system.friction.points.end(),
                                 [](const FrictionPoint& p) { return p.phase == FrictionPhase::slip; });
  double trial_start = 0.0, last_event = 0.0;
  int at_once = 0;
  while (next < times.size() && times[next] <= 0.0) {
    sample(system, 0.0, y);
    ++next;
  }
  for (double end : ends) {
    for (TimeFunction& e : system.model.expressions) e.freeze(0.5 * (from + end));
    guard.begin(system, from, end);
    if (has_events(system)) {
      // A jump of the loads may let go what sticks.
      const std::vector<Partition> before = partitions();
      start_phases(system, from, y, !integrator, changes);
      if (!integrator) changes.clear();
      y = repack_state(system, y, before);
      system.weights.update(system, y);
      note_changes(from);
      if (integrator) ++out.events, ++out.restarts;
      begin(from);
    } else if (y.size() == quadrature && !system.driven) {
      // Everything is fixed: nothing to integrate, only to evaluate.
      for (; next < times.size() && times[next] <= end; ++next) sample(system, times[next], y);
      from = end;
      continue;
    } else if (!integrator) {
      begin(from);
    } else {
      integrator->restart(from, y);
      begun = from;
      steps_here = 0;
      ++out.events;
      ++out.restarts;
    }
    while (integrator->time() < end) {
      // With nothing in motion of its own only the samples tell how far to look ahead for the next event.
      const bool idle = y.size() == system.model.nq + quadrature;
      try {
        integrator->step(guarded(idle ? std::min(end, integrator->time() + 1.0 / system.model.settings.output_rate) : end));
      } catch (const SimulationError&) {
        // What no method can integrate fails again.
        if (!automatic || method == Method::dirk || idle) throw;
        use(Method::dirk, y);
        begin(integrator->time());
        continue;
      }
      y = integrator->state();
      ++steps_here;
      double now = integrator->time();
      const bool event = watch.look(system, *integrator, now, y);
      // An integrator may take steps below the digits of the time without complaint, and for ever.
      standing = now - integrator->previous_time() > 1e-15 * now ? 0 : standing + 1;
      if (standing > 1000)
        throw SimulationError(fmt::format("the integration stopped at t = {:.9g} s: the steps became too small; {}", now,
                                          likely_cause(system, now, y, integrator->last_complaint())));
      // Loops are looked at at every sample, and at the end of steps that pass none.
      const auto check_loops = [&]() {
        for (size_t c = 0; c < system.model.clusters.size(); ++c) require_closed(system.model, static_cast<int>(c), system.work);
      };
      const bool sampled = next < times.size() && times[next] <= now;
      for (; next < times.size() && times[next] <= now; ++next) {
        integrator->interpolate(times[next], at);
        sample(system, times[next], at);
        check_loops();
      }
      at_work.valid = false;
      if (!sampled && !system.model.loops.empty()) {
        set_state(system, now, y.data(), false);
        check_loops();
      }
      if (slips) {
        if (sampled || system.model.loops.empty()) set_state(system, now, y.data(), false);
        follow_slip(system.model, system.friction, system.work);
      }
      system.weights.update(system, y);
      if (event) {
        // Between the ends of a Runge-Kutta step the interpolant is of lower order than the step: once more, to the event and no further
        // (slider-crank with 16 reversals at 1e-7 by erk: 2e-5 instead of 2e-4). Right at the step's beginning nothing is lost.
        if ((method == Method::erk || method == Method::dirk) &&
            now - watch.start_time() > 1e-6 * (integrator->time() - watch.start_time())) {
          Integrator again(problem, method, watch.start_time(), watch.start_state());
          while (again.time() < now) again.step(now);
          y = again.state();
        }
        // Phases that follow one another without any time in between, and for ever.
        at_once = now - last_event > 1e-13 * now ? 0 : at_once + 1;
        last_event = now;
        if (at_once > 200)
          throw SimulationError(
              fmt::format("the integration stopped at t = {:.9g} s: {}", now, unsettled_phases(system, watch.directions())));
        const std::vector<Partition> before = partitions();
        pass_events(system, now, y, watch.directions(), changes);
        y = repack_state(system, y, before);
        system.weights.update(system, y);
        note_changes(now);
        ++out.events;
        ++out.restarts;
        begin(now);
        continue;
      }
      if (const long steps = steps_so_far(); review.due(steps, system.evaluations, now, duration)) {
        keep_to_budget(now);
        if (automatic && review.steps_to_go() > long_run) {
          if (const Method better = better_method(now, end); better != method) {
            system.notes.tell("", fmt::format("method changed from {} to {} at t = {:.3g} s: {}", method_name(method), method_name(better),
                                              now, what_takes_steps(system, now, y, review.step())));
            on_trial = false;
            use(better, y);
            begin(now);
            continue;
          }
        }
        if (review.steps_to_go() > worth_telling && told_to.tell && !told) {
          told = true;
          told_to.tell(fmt::format("about {:.1e} steps of {:.1e} s to go: {}", review.steps_to_go(), review.step(),
                                   what_takes_steps(system, now, y, review.step())));
        }
      } else if (static_cast<double>(steps) >= told_to.most_steps) {
        keep_to_budget(now);
      }
      if (const long steps = on_trial ? integrator->statistics().steps : 0; steps == trial_steps / 2) {
        trial_start = now;
      } else if (steps == trial_steps) {
        on_trial = false;
        if ((now - trial_start) / (0.5 * trial_steps) * fastest_vibration < followed_radians) {
          use(Method::adams, y);
          begin(now);
          continue;
        }
      }
      if (renew_partitions(system, now, y)) {
        y = pack_state(system, system.quadrature ? Eigen::Vector2d(y.tail<2>()) : Eigen::Vector2d(0.0, 0.0));
        integrator->restart(now, y);
        watch.begin(system, now, y);
        begun = now;
        steps_here = 0;
        ++out.restarts;
      }
      if (told_to.progress && ++calls % 16 == 0) told_to.progress(now);
    }
    system.notes.warn(guard.complaints());
    from = end;
  }
  retire();
  out.evaluations = system.evaluations;
  out.cpu_seconds = cpu_seconds() - start;
  return out;
} catch (const SimulationError&) {
  if (system.work.indefinite < 0) system.work.indefinite = lost_inertia(system);
  if (system.work.indefinite >= 0) indefinite = system.model.parts[static_cast<size_t>(system.work.indefinite)].scene_body;
  throw;
}

}  // namespace flexframe::sim
