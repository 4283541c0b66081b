#include "sim/run/integrate_run.h"

#include "sim/base/cpu_clock.h"
#include "sim/base/work_clock.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/signals.h"
#include "sim/run/lost_loops.h"
#include "sim/run/method_choice.h"
#include "sim/run/stop_reasons.h"
#include "sim/run/stop_springs.h"
#include "sim/time/assembly_gap.h"
#include "sim/time/event_watch.h"
#include "sim/time/events.h"
#include "sim/time/newton_matrix.h"
#include "sim/time/price.h"
#include "sim/time/step_guard.h"
#include "sim/time/step_works.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

namespace flexframe::sim {
namespace {

// All times within a span at which an expression changes its piece, ascending, then its end.
std::vector<double> segment_ends(const Model& model, double from, double to) {
  std::vector<double> ends;
  for (const TimeFunction& e : model.expressions) {
    const std::vector<double> t = e.switch_times(from, to);
    ends.insert(ends.end(), t.begin(), t.end());
  }
  for (const StateFunction& f : model.functions) {
    const std::vector<double> t = f.expression.switch_times(from, to);
    ends.insert(ends.end(), t.begin(), t.end());
  }
  const std::vector<double> samples = sample_times(model, from, to);
  ends.insert(ends.end(), samples.begin(), samples.end());
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  ends.push_back(to);
  return ends;
}

// What "auto" took for a long run is looked at again after that many steps. At a tight tolerance the third order of the Runge-Kutta method
// makes its steps short: where they pass no more than a few radians of the fastest vibration, Adams follows it for at most twice the
// evaluations, and drifts a hundredth as far (elastic pendulum at 1e-8: 3 million evaluations for 1.6, its energy 1e-8 off instead of
// 2e-6).
constexpr long trial_steps = 500;
constexpr double tight = 1.0001e-8, followed_radians = 10.0;

// Without loops the joints' columns of Newton's matrix serve so many steps: a fifth of the evaluations less for the same error (pendulum,
// flexible arm, solid pendulum). In loops what is left over in lengths would move the whole (slider-crank whose rods stretch: three times
// the error of its slider with columns of two steps).
constexpr int joints_last = 4;

// A method that turns out wrong: with so many steps to go others are tried for `trial_length` steps, and one that goes so many times as far
// an evaluation is taken.
constexpr double long_run = 20000, long_run_with_matrices = 2000, worth_changing = 5.0;
constexpr int trial_length = 60;
// Adams after events: steps until its order has grown and what hit a stop has left it, what they are asked for, the least that digits
// allow.
constexpr long restart_steps = 200;
constexpr double restart_strictness = 100.0, tightest = 1e-12;
// The farthest that bodies turn in a step if contacts or switches read them.
constexpr double most_radians = 1000.0;
// With so many steps to go the user is told what they are spent on.
constexpr double worth_telling = 2e5;
// Notes about events: a page of them tells enough, their number stands in the statistics.
constexpr size_t most_notes = 200;
// Times that differ by rounding alone.
constexpr double same_time = 1e-12;
// So many events within that share of the run: what both pieces drive back to their threshold.
constexpr long many_events = 1000;
constexpr double no_time = 1e-8;

// The run of a system from one segment between known switches to the next, and in it from step to step and from event to event.
class MotionRun {
 public:
  using Sample = std::function<void(System&, double, const VecX&)>;
  MotionRun(System& s, Method asked, RunSpan& asked_span, const RunWatch& watcher, const Sample& take_sample)
      : system(s),
        told_to(watcher),
        span(asked_span),
        times(asked_span.times),
        sample(take_sample),
        automatic(asked == Method::automatic),
        method(asked),
        from(asked_span.from) {}
  SolverStatistics run();
  // After run has thrown: the scene's body whose kinetic energy was lost, -1 if none.
  int lost_body() const;
  // Whether it ended as steps left loops where they cannot be.
  bool lost_loops() const { return lost; }
  // Whether it began with the exponential method, which the user has not asked for.
  bool began_following() const { return automatic && with_matrices; }

 private:
  // ---- The problem that the integrators solve ----
  void choose();
  void define_problem();
  void define_jacobians();
  bool work_is_at(const double* state) const;
  void keep_assembly(const StateAt& since, const StateAt& to);
  double asked_tolerance() const;
  // Whether the Runge-Kutta method takes over where the exponential one cannot go on: the user has not asked for it.
  bool may_step_over() const { return automatic && method == Method::exponential; }
  void use(Method chosen, const VecX& state);
  // ---- Segments and steps ----
  void begin(double t);
  void restart(double t);
  void retire();
  bool begin_segment(double end);
  void run_segment(double end);
  bool step(double end);
  bool close_anew();
  double guarded(double ahead);
  void require_progress(double now);
  // Ends the run: `what` happened, and what most likely causes it.
  [[noreturn]] void give_up(const std::string& what, const std::string& complaint) const;
  // ---- After a step ----
  void sample_start();
  void hand_out_samples(double now);
  bool follow_works(double now);
  void follow_state(double now);
  void pass_event(double now);
  void tell_progress(double now);
  void repeat_to_event(double now);
  std::vector<Partition> partitions() const;
  void note_changes(double t);
  bool review_method(double now, double end);
  bool end_trial(double now);
  void renew_loops(double now);
  // ---- Method and budget ----
  long steps_so_far() const { return out.steps + (integrator ? integrator->statistics().steps : 0); }
  double effort() const;
  double pace_of(Method other, double end);
  Method better_method(double now, double end);
  void keep_to_budget(double now);

  System& system;
  const RunWatch& told_to;
  RunSpan& span;
  const std::vector<double>& times;
  const Sample& sample;
  const double start = cpu_seconds(), begun_work = work_seconds();
  SolverStatistics out;
  OdeProblem problem;
  int joints_age = 0;  // steps since the joints' columns of Newton's matrix were made; 0: none are

  // What work was last brought to, for as long as nothing else has moved it.
  struct {
    bool valid = false;
    double t = 0.0;
    VecX y, dy;
  } at_work;

  bool automatic = false;
  Method method = Method::automatic;
  double fastest_vibration = 0.0, trial_start = 0.0;
  bool on_trial = false, with_matrices = false;
  double sampling = 0.0;  // s of work
  MethodReview review;
  bool told = false;

  VecX y, begin_y, at;  // now, where the last step began, at a sample
  MatX four_at;
  std::unique_ptr<Integrator> integrator;
  double begun = 0.0;   // where the integrator was started last
  long steps_here = 0;  // since then
  double from = 0.0;    // where the segment began
  size_t next = 0;      // of the sample times
  long standing = 0;    // steps without progress one after another
  int at_once = 0;      // events without time in between
  double last_event = 0.0;
  long events_counted = 0;
  double crowd_begun = 0.0;  // when the present thousand of events began
  long calls = 0;
  EventWatch watch;
  StepGuard guard;
  std::vector<StopSpring> touched;
  std::vector<std::string> changes;
  bool slips = false;
  bool anew = false;     // nothing has been evaluated since the integrator began
  bool lost = false;     // the run ends as loops cannot be followed
  bool passing = false;  // a step passes a change point: its loops may be on either side of it

  // Where works are asked for: those of a step, and what the state's own lack, J, now and where the step began.
  const bool with_works = told_to.works && system.quadrature;
  StepWorks works;
  Eigen::Vector2d unworked = {0.0, 0.0}, unworked_before = {0.0, 0.0};
};

// ---- The problem that the integrators solve --------------------------------------------------------------------------------------------

void MotionRun::choose() {
  on_trial = automatic && system.tolerance <= tight;
  if (automatic) method = choose_method(system, fastest_vibration);
  with_matrices = method == Method::exponential;
  on_trial = on_trial && method == Method::dirk && fastest_vibration > 0.0 && may_be_followed(system);
  if (span.goes_on) out.method = method_name(method);  // the sizes of its errors are those so far
  else use(method, pack_state(system, Eigen::Vector2d::Zero()));
  if (const std::string why = method == Method::exponential ? why_not_exponential(system) : ""; !why.empty())
    throw InputError(fmt::format("method \"exponential\" follows smooth motion only: {}; take method = \"auto\" or \"erk\"", why));
}

void MotionRun::use(Method chosen, const VecX& state) {
  method = chosen;
  out.method = method_name(method);
  system.weights.begin(system, method, state);
}

bool MotionRun::work_is_at(const double* state) const {
  return at_work.valid && at_work.y.size() == problem.size && std::equal(state, state + problem.size, at_work.y.data());
}

// After an evaluation of `to` that has left loops crossed: they have passed a change point since the state before, or the way there is too
// long.
void MotionRun::keep_assembly(const StateAt& since, const StateAt& to) {
  at_work.valid = false;
  std::vector<ClusterWork>& clusters = system.work.clusters;
  std::vector<size_t> over;
  for (size_t c = 0; c < clusters.size(); ++c)
    if (crossed(clusters[c])) over.push_back(c);
  for (const size_t c : over) {
    if (!leads_on(system, static_cast<int>(c), since, to)) throw SimulationError(assembly_gap(system, static_cast<int>(c), to.t));
    clusters[c].partition.side = 0;
  }
  passing = true;
}

// A multistep method begins anew at first order after every event, and what it errs there adds up: its first steps are asked for more.
double MotionRun::asked_tolerance() const {
  const bool beginning = method == Method::adams && out.restarts > 0 && steps_here < restart_steps;
  return beginning ? std::max(system.tolerance / restart_strictness, std::min(system.tolerance, tightest)) : system.tolerance;
}

void MotionRun::define_problem() {
  problem.tolerance = system.tolerance;
  problem.rhs = [this](double t, const double* state, double* rates) {
    at_work.valid = false;
    state_rate(system, t, state, rates);
    if (any_crossed(system)) {
      if (!anew) return keep_assembly({integrator->time(), y.data()}, {t, state});
      // As the start, an event or other conditions have left them.
      for (ClusterWork& c : system.work.clusters) c.partition.side = c.side;
    }
    anew = false;
    at_work.t = t;
    at_work.y = Eigen::Map<const VecX>(state, problem.size);
    at_work.dy = Eigen::Map<const VecX>(rates, problem.size);
    at_work.valid = true;
  };
  define_jacobians();
  problem.keep = [this](VecX& kept) { keep_load_responses(system, kept); };
  problem.shift = [this](double t0, double t, const VecX& kept, double* rates) { return follow_loads(system, t0, t, kept, rates); };
  problem.weights = [this](const double*, double* w) {
    system.weights.write(asked_tolerance(), w);
    for (const StopSpring& s : touched) w[s.q] = std::max(w[s.q], s.frequency * w[s.rate]);
  };
}

void MotionRun::define_jacobians() {
  // Rates that follow from a balance of forces are no states: the structure q' = T w is lost.
  // States of blocks and contacts act on rates too.
  if (all_have_inertia(system.model) && system.model.nz == 0)
    problem.jacobian = [this](double t, const double* state, bool fresh, MechanicalJacobian& into) {
      const bool here = work_is_at(state);
      at_work.valid = false;
      // A stage starts from the beginning of its step: its time is that of the rates.
      const bool keep = system.model.loops.empty() && joints_age > 0 && joints_age < joints_last;
      update_newton_matrix(system, here ? at_work.t : t, state, here ? at_work.dy.data() : nullptr, {fresh, keep}, into);
      count_work(newton_price(static_cast<double>(into.A.rows())));
      joints_age = fresh || !keep ? 1 : joints_age + 1;
    };
  problem.closed_derivatives = [this](double t, const double* state, MechanicalJacobian& into) {
    if (!work_is_at(state)) {
      VecX rates(problem.size);
      problem.rhs(t, state, rates.data());
    }
    update_closed_matrix(system, state, into);
    count_work(linear_model_price(static_cast<double>(into.A.rows())));
  };
  problem.all_derivatives = [this](double t, const double* state, MatX& A, MatX& B) {
    const bool here = at_work.t == t && work_is_at(state);
    at_work.valid = false;
    difference_rates(system, t, state, here ? at_work.dy.data() : nullptr, A, B);
  };
}

// ---- Segments and steps ----------------------------------------------------------------------------------------------------------------

void MotionRun::retire() {
  if (!integrator) return;
  const IntegratorStatistics s = integrator->statistics();
  out.steps += s.steps;
  out.jacobians += s.jacobians;
  integrator.reset();
}

// After an event the state may have another size: a new integrator.
void MotionRun::begin(double t) {
  retire();
  problem.size = static_cast<int>(y.size());
  problem.cheap_jacobian = matrix_is_cheap(system);
  problem.closes_loops = !system.model.loops.empty();
  problem.sharp_jacobian = std::any_of(system.friction.points.begin(), system.friction.points.end(),
                                       [](const FrictionPoint& p) { return p.phase == FrictionPhase::slip; });
  touched = find_touched(system, t, y);
  joints_age = 0;
  anew = true;
  try {
    integrator = std::make_unique<Integrator>(problem, method, t, y);
  } catch (const SimulationError&) {
    // The exponential method linearises where it begins.
    if (!may_step_over()) throw;
    use(Method::dirk, y);
    integrator = std::make_unique<Integrator>(problem, method, t, y);
  }
  watch.begin(system, t, y);
  begun = t;
  steps_here = 0;
  if (has_events(system)) at_work.valid = false;
}

void MotionRun::restart(double t) {
  joints_age = 0;
  anew = true;
  try {
    integrator->restart(t, y);
  } catch (const SimulationError&) {
    if (!may_step_over()) throw;
    begin(t);
  }
  begun = t;
  steps_here = 0;
  ++out.restarts;
}

// False where there is nothing to integrate: the segment is done.
bool MotionRun::begin_segment(double end) {
  for (TimeFunction& e : system.model.expressions) e.freeze(0.5 * (from + end));
  for (StateFunction& f : system.model.functions)
    if (f.expression.has_switches()) f.expression.freeze(0.5 * (from + end));
  guard.begin(system, from, end);
  const Eigen::Index quadrature = system.quadrature ? 2 : 0;
  if (has_events(system) || !system.model.blocks.empty()) {
    // A jump of the loads may let go what sticks.
    const std::vector<Partition> before = partitions();
    const bool first = !integrator && !span.goes_on;
    start_phases(system, from, y, first, changes);
    if (first) changes.clear();
    y = repack_state(system, y, before);
    system.weights.update(system, y);
    note_changes(from);
    if (integrator) ++out.events, ++out.restarts;
    begin(from);
  } else if (y.size() == quadrature && !system.driven) {
    // Everything is fixed: nothing to integrate, only to evaluate.
    for (; next < times.size() && times[next] <= end; ++next) sample(system, times[next], y);
    return false;
  } else if (!integrator) {
    begin(from);
  } else {
    restart(from);
    ++out.events;
  }
  return true;
}

// Where the next step has to end lest it passes over something short: as a rule nowhere, and then at `ahead`.
double MotionRun::guarded(double ahead) {
  const double t = integrator->time(), last = t - integrator->previous_time();
  // Integrators let a step be ten to twenty times as long as the one before, after the first a thousand times as theirs again.
  const double farthest = last == 0.0 ? ahead : std::min(ahead, t + (integrator->previous_time() == begun ? 2e4 : 20.0) * last);
  bool moved = false;
  double limit = guard.limit(system, t, y, last, farthest, moved);
  if (moved) at_work.valid = false;
  // What reads turning bodies is looked at inside every step, so often a radian.
  if (const double turning = has_events(system) ? watched_turning(system) : 0.0; turning > 0.0)
    limit = std::min(limit, t + most_radians / turning);
  // The first step is chosen by the integrator as a tenth of what lies before it at most: only what is shorter has to be told.
  return limit < ahead && (last > 0.0 || limit - t < 0.1 * (ahead - t)) ? limit : ahead;
}

// One step of the integrator; false where the method failed and another begins from here.
bool MotionRun::step(double end) {
  // With nothing in motion of its own only the samples tell how far to look ahead for the next event.
  const bool idle = y.size() == system.model.nq + (system.quadrature ? 2 : 0);
  try {
    integrator->step(guarded(idle ? std::min(end, integrator->time() + 1.0 / system.model.settings.output_rate) : end));
  } catch (const SimulationError& error) {
    if (close_anew()) return false;
    // What no method can integrate fails again.
    lost = !system.model.loops.empty();
    if (!automatic || method == Method::dirk || idle) give_up(error.what(), integrator->complaint());
    lost = false;
    use(Method::dirk, y);
    begin(integrator->time());
    return false;
  }
  begin_y.swap(y);
  y = integrator->state();
  ++steps_here;
  return true;
}

// Dependent coordinates are integrated as first guesses of the closure only, and at a loose tolerance come away from where it leaves them.
// Begins the integration again with the present state closed; false where that changes nothing.
bool MotionRun::close_anew() {
  if (system.model.loops.empty()) return false;
  const double t = integrator->time();
  at_work.valid = false;
  try {
    set_state(system, t, y.data(), false);
  } catch (const SimulationError&) {
    return false;
  }
  // Less than that of the size, or of a radian, does not lead into another assembly.
  constexpr double little = 1e-6;
  const double away = (system.work.q - y.head(system.model.nq)).cwiseAbs().maxCoeff();
  if (any_crossed(system) || away <= little * std::min(1.0, system.model.size)) return false;
  y = pack_state(system, system.quadrature ? Eigen::Vector2d(y.tail<2>()) : Eigen::Vector2d(0.0, 0.0));
  restart(t);
  watch.begin(system, t, y);
  return true;
}

void MotionRun::run_segment(double end) {
  while (integrator->time() < end) {
    if (!step(end)) continue;
    double now = integrator->time();
    bool event = false, handed_out = false;
    try {
      event = watch.look(system, *integrator, now, y);
      require_progress(now);
      hand_out_samples(now);
      handed_out = true;
      follow_state(now);
    } catch (const SimulationError& error) {
      // Its steps are long: the end of one may be out of reach where shorter ones lead on.
      if (handed_out && may_step_over()) {
        y = begin_y;
        unworked = unworked_before;
        passing = false;
        use(Method::dirk, y);
        begin(integrator->previous_time());
        continue;
      }
      lost = !system.model.loops.empty();
      const std::string bent = bent_too_far(system, now, y);
      if (bent.empty()) throw;
      throw SimulationError(fmt::format("{}; {}", error.what(), bent));
    }
    if (event) {
      pass_event(now);
      if (static_cast<double>(steps_so_far()) >= told_to.most_steps) keep_to_budget(now);
      tell_progress(now);
      continue;
    }
    if (review_method(now, end) || end_trial(now)) continue;
    renew_loops(now);
    tell_progress(now);
  }
}

void MotionRun::tell_progress(double now) {
  if (told_to.progress && ++calls % 16 == 0) told_to.progress(now);
}

// An integrator may take steps below the digits of the time without complaint, and for ever.
void MotionRun::require_progress(double now) {
  standing = now - integrator->previous_time() > 1e-15 * now ? 0 : standing + 1;
  if (standing > 1000)
    give_up(fmt::format("the integration stopped at t = {:.9g} s: the steps became too small", now), integrator->complaint());
}

void MotionRun::give_up(const std::string& what, const std::string& complaint) const {
  const std::string cause = likely_cause(system, integrator->time(), y, complaint);
  throw SimulationError(cause == what ? what : fmt::format("{}; {}", what, cause));
}

int MotionRun::lost_body() const {
  int part = system.work.indefinite;
  if (part < 0 && integrator) part = lost_inertia(system, integrator->time(), y);
  return part < 0 ? -1 : system.model.parts[static_cast<size_t>(part)].scene_body;
}

// ---- After a step ----------------------------------------------------------------------------------------------------------------------

// The samples that the step passed.
void MotionRun::hand_out_samples(double now) {
  // A sample that is later by rounding alone belongs to the piece that ends here: what jumps at its time is told as it was before.
  const double until = now * (1.0 + same_time);
  const auto passed = [&](size_t k) { return k < times.size() && times[k] <= until; };
  const bool followed = with_works && follow_works(now);
  const auto one_by_one = [&](double t) {
    integrator->interpolate(t, at);
    if (followed) at.tail<2>() = begin_y.tail<2>() + unworked_before + works.at(t);
    else if (with_works) at.tail<2>() += unworked;
    sample(system, t, at);
    if (any_crossed(system)) keep_assembly({integrator->previous_time(), begin_y.data()}, {t, at.data()});
  };
  const double before = work_seconds();
  while (passed(next)) {
    std::array<double, 4> some{};
    int count = 0;
    const int most = told_to.samples ? 4 : 1;
    for (; count < most && passed(next); ++next) some[static_cast<size_t>(count++)] = std::min(times[next], now);
    count_work(count * evaluations_a_sample * system.price);
    if (count > 1) {
      std::fill(some.begin() + count, some.end(), some[static_cast<size_t>(count - 1)]);
      integrator->interpolate_four(some.data(), four_at);
      if (told_to.samples(system, some.data(), count, four_at)) continue;
    }
    for (int k = 0; k < count; ++k) one_by_one(some[static_cast<size_t>(k)]);
  }
  sampling += work_seconds() - before;
  at_work.valid = false;
}

// The works of the step that ends now, and what the state's own lack of them.
bool MotionRun::follow_works(double now) {
  unworked_before = unworked;
  if (method != Method::exponential) return false;
  const double from_time = integrator->previous_time();
  VecX state, rates(problem.size);
  try {
    works.follow(from_time, now, [&](double t) {
      integrator->interpolate(t, state);
      problem.rhs(t, state.data(), rates.data());
      return Eigen::Vector2d(rates.tail<2>());
    });
  } catch (const SimulationError&) {
    return false;  // what cannot be evaluated there is told by the steps
  }
  unworked += works.at(now) - (y.tail<2>() - begin_y.tail<2>());
  return true;
}

// Loops are looked at at every sample and at every step's end, from where the next one sets out: how near to a singular position their
// partitions are counts there, and on which side of it.
void MotionRun::follow_state(double now) {
  if (!system.model.loops.empty() || passing) require_closed_loops(system, now, y.data());
  if (any_crossed(system)) {
    keep_assembly({integrator->previous_time(), begin_y.data()}, {now, y.data()});
    require_closed_loops(system, now, y.data());
  }
  if (passing) {
    for (ClusterWork& c : system.work.clusters)
      if (c.partition.side == 0) c.partition.side = c.side;
    passing = false;
  }
  if (slips) {
    set_rates(system, now, y.data());
    follow_slip(system.model, system.friction, system.work);
  }
  system.weights.update(system, y);
}

std::vector<Partition> MotionRun::partitions() const {
  std::vector<Partition> all;
  for (const ClusterWork& c : system.work.clusters) all.push_back(c.partition);
  return all;
}

void MotionRun::note_changes(double t) {
  for (const std::string& change : changes)
    if (system.notes.size() < most_notes) system.notes.tell("", fmt::format("event at t = {:.9g} s: {}", t, change));
  changes.clear();
}

// Between the ends of a Runge-Kutta step the interpolant is of lower order than the step: once more, to the event and no further
// (slider-crank with 16 reversals at 1e-7 by erk: 2e-5 instead of 2e-4). Right at the step's beginning nothing is lost.
void MotionRun::repeat_to_event(double now) {
  if (method != Method::erk && method != Method::dirk) return;
  if (now - watch.start_time() <= 1e-6 * (integrator->time() - watch.start_time())) return;
  Integrator again(problem, method, watch.start_time(), watch.start_state());
  while (again.time() < now) again.step(now);
  y = again.state();
}

void MotionRun::pass_event(double now) {
  // What comes to rest does so between the ends of its step; the repeated one leaves it a speed of its own error.
  const VecX seen = y;
  repeat_to_event(now);
  // Phases that follow one another without any time in between, and for ever, or with as good as none.
  at_once = now - last_event > 1e-13 * now ? 0 : at_once + 1;
  last_event = now;
  bool crowded = false;
  if (++events_counted % many_events == 0) {
    crowded = now - crowd_begun < no_time * span.to;
    crowd_begun = now;
  }
  if (at_once > 200 || crowded)
    throw SimulationError(fmt::format("the integration stopped at t = {:.9g} s: {}", now, unsettled_phases(system, watch.directions())));
  const std::vector<Partition> before = partitions();
  double released = 0.0;
  pass_events(system, now, seen, y, watch.directions(), changes, released);
  if (system.quadrature) y[y.size() - 1] += released;
  y = repack_state(system, y, before);
  system.weights.update(system, y);
  note_changes(now);
  ++out.events;
  ++out.restarts;
  begin(now);
}

// Other independent coordinates where the loops ask for them.
void MotionRun::renew_loops(double now) {
  if (!renew_partitions(system, now, y)) return;
  y = pack_state(system, system.quadrature ? Eigen::Vector2d(y.tail<2>()) : Eigen::Vector2d(0.0, 0.0));
  restart(now);
  watch.begin(system, now, y);
}

// ---- Method and budget -----------------------------------------------------------------------------------------------------------------

// What the method has cost so far, in evaluations. Of the exponential method's work they are the smaller part, in runs that began with it
// all that it counts is looked at.
double MotionRun::effort() const {
  return with_matrices ? (work_seconds() - begun_work - sampling) / system.price : static_cast<double>(system.evaluations);
}

// Simulated seconds an evaluation that another method makes from here, in its stride; 0 where it fails.
double MotionRun::pace_of(Method other, double end) {
  const Method kept = method;
  const ErrorWeights weights = system.weights;
  double pace = 0.0;
  use(other, y);
  try {
    Integrator trial(problem, other, integrator->time(), y);
    double from_time = trial.time();
    double before = effort();
    for (int k = 0; k < trial_length && trial.time() < end; ++k) {
      if (k == trial_length / 2) from_time = trial.time(), before = effort();
      trial.step(end);
    }
    pace = (trial.time() - from_time) / std::max(1.0, effort() - before);
  } catch (const SimulationError&) {}
  at_work.valid = false;
  method = kept;
  out.method = method_name(method);
  system.weights = weights;
  return pace;
}

// The method that goes far better from here than the present one does, if one is.
Method MotionRun::better_method(double now, double end) {
  // Where everything fast decays BDF errs less than the Runge-Kutta method that goes as far (a struck damper: 1.4e-4 instead of 1.1e-3).
  constexpr double preferred = 2.0;
  const double least = worth_changing * review.pace();
  Method best = method;
  double pace = least;
  std::vector<Method> others;
  if (method != Method::dirk) others.push_back(Method::dirk);
  if (method != Method::bdf && find_fastest(system, now, y).decays) others.push_back(Method::bdf);
  for (const Method other : others)
    if (const double p = pace_of(other, end); p > least && (other == Method::bdf ? preferred : 1.0) * p > pace) best = other, pace = p;
  return best;
}

void MotionRun::keep_to_budget(double now) {
  const double most = told_to.most_steps, duration = span.to;
  const long steps = steps_so_far();
  // Short steps may pass: what sticks and lets go again takes some ten thousand of them. Nobody waits for those of small systems.
  const bool long_enough = steps >= 50000 || work_seconds() - begun_work >= 5.0;
  if (static_cast<double>(steps) < most && !(long_enough && review.hopeless(most))) return;
  const bool follows_all = !automatic && (method == Method::adams || method == Method::erk);
  const double length = review.step() > 0.0 ? review.step() : now / static_cast<double>(std::max(1L, steps));
  throw SimulationError(fmt::format(
      "the run was ended at t = {:.6g} s of {:.6g} s after {} steps: at this pace it takes {:.1e} of them, more than the {:.6g} that it "
      "may. Steps of {:.1e} s: {}. "
      "{}imulate a shorter time, leave out or damp what is so fast, ask for less accuracy, or raise max_steps (--max-steps)",
      now, duration, steps, static_cast<double>(steps) + (duration - now) / length, most, length, what_takes_steps(system, now, y, length),
      follows_all ? "Take another method (dirk and bdf step over what is fast, auto changes to them), s" : "S"));
}

// Now and then: the run's length against its budget, the method against others. True where another one begins.
bool MotionRun::review_method(double now, double end) {
  const long steps = steps_so_far();
  if (!review.due(steps, effort(), now, span.to)) {
    if (static_cast<double>(steps) >= told_to.most_steps) keep_to_budget(now);
    return false;
  }
  if (static_cast<double>(steps) >= told_to.most_steps) keep_to_budget(now);
  // What ends a run with one method another one may pass.
  if (automatic && review.steps_to_go() > (method == Method::exponential ? long_run_with_matrices : long_run)) {
    if (const Method better = better_method(now, end); better != method) {
      system.notes.tell("", fmt::format("method changed from {} to {} at t = {:.3g} s: {}", method_name(method), method_name(better), now,
                                        what_takes_steps(system, now, y, review.step())));
      on_trial = false;
      use(better, y);
      begin(now);
      return true;
    }
  }
  keep_to_budget(now);
  if (review.steps_to_go() > worth_telling && told_to.tell && !told) {
    told = true;
    told_to.tell(fmt::format("about {:.1e} steps of {:.1e} s to go: {}", review.steps_to_go(), review.step(),
                             what_takes_steps(system, now, y, review.step())));
  }
  return false;
}

// The trial of the Runge-Kutta method at a tight tolerance; true where Adams begins in its place.
bool MotionRun::end_trial(double now) {
  if (!on_trial) return false;
  const long steps = integrator->statistics().steps;
  if (steps == trial_steps / 2) trial_start = now;
  if (steps != trial_steps) return false;
  on_trial = false;
  if ((now - trial_start) / (0.5 * trial_steps) * fastest_vibration >= followed_radians) return false;
  use(Method::adams, y);
  begin(now);
  return true;
}

void MotionRun::sample_start() {
  for (; next < times.size() && times[next] <= from; ++next) {
    at = y;
    if (with_works) at.tail<2>() += unworked;
    sample(system, from, at);
    at_work.valid = false;
  }
}

SolverStatistics MotionRun::run() {
  out.tolerance = system.tolerance;
  choose();
  define_problem();
  y = span.goes_on ? span.state : pack_state(system, Eigen::Vector2d::Zero());
  system.friction.tolerance = system.tolerance;
  slips = std::any_of(system.friction.points.begin(), system.friction.points.end(),
                      [](const FrictionPoint& p) { return p.phase == FrictionPhase::slip; });
  for (const double end : segment_ends(system.model, span.from, span.to)) {
    if (begin_segment(end)) {
      // Which way friction acts at the start, what blocks read there and how expressions go on are known now: what jumps there is told as
      // it begins.
      sample_start();
      run_segment(end);
      system.notes.warn(guard.complaints());
    }
    from = end;
  }
  retire();
  span.state = y;
  out.evaluations = system.evaluations;
  out.cpu_seconds = cpu_seconds() - start;
  out.work = work_seconds() - begun_work;
  return out;
}

}  // namespace

SolverStatistics integrate(System& system, Method method, RunSpan& span, const RunWatch& watch,
                           const std::function<void(System&, double, const VecX&)>& sample, int& indefinite) {
  MotionRun run(system, method, span, watch, sample);
  try {
    return run.run();
  } catch (const SimulationError& error) {
    indefinite = run.lost_body();
    if (indefinite < 0 && run.lost_loops()) throw LoopsLost(error.what(), system.tolerance, run.began_following());
    throw;
  }
}

}  // namespace flexframe::sim
