#include "sim/simulate.h"

#include "sim/dynamics.h"
#include "sim/kinematics.h"
#include "sim/recorder.h"
#include "sim/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

namespace flexframe::sim {
namespace {

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::vector<double> sample_times(const SimulationSettings& s) {
  std::vector<double> times;
  const double count = std::floor(s.duration * s.output_rate * (1.0 + 1e-12));
  for (double k = 0.0; k <= count; k += 1.0) times.push_back(k / s.output_rate);
  // The run's end is always a sample.
  if (times.back() > s.duration || s.duration - times.back() < 1e-9 / s.output_rate) times.back() = s.duration;
  else times.push_back(s.duration);
  return times;
}

// All times at which an expression changes its piece, ascending, then the end.
std::vector<double> segment_ends(const Model& model) {
  std::vector<double> ends;
  for (const Expression& e : model.expressions) {
    const std::vector<double> t = e.switch_times(0.0, model.settings.duration);
    ends.insert(ends.end(), t.begin(), t.end());
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  ends.push_back(model.settings.duration);
  return ends;
}

// Explicit steps are limited by stability to about one radian of the fastest elastic vibration. Up to 2000 such radians in the run
// Adams is the cheapest; beyond, the L-stable Runge-Kutta method steps over vibrations that the tolerance does not see (BDF of order
// 3 to 5 is unstable for them, of order 2 it is three times as dear).
Method choose_method(const System& system) {
  double fastest = 0.0;
  for (const Part& p : system.model.parts)
    for (int k = 0; k < p.body.n; ++k) fastest = std::max(fastest, p.body.Ke(k, k) / p.body.Me(k, k));
  return std::sqrt(fastest) * system.model.settings.duration < 2000.0 ? Method::adams : Method::dirk;
}

// Integrates a system from its assembled start; calls sample at each of the times, in order.
SolverStatistics integrate(System& system, Method method, const std::vector<double>& times, const std::function<void(double)>& progress,
                           const std::function<void(System&, double, const VecX&)>& sample) {
  SolverStatistics out;
  out.tolerance = system.tolerance;
  const double start = cpu_seconds();
  if (method == Method::automatic) method = choose_method(system);
  out.method = method_name(method);

  OdeProblem problem;
  problem.rhs = [&](double t, const double* y, double* dy) { state_rate(system, t, y, dy); };
  problem.weights = [&](const double* y, double* w) { error_weights(system, y, w); };

  const std::vector<double> ends = segment_ends(system.model);
  VecX y = pack_state(system, Eigen::Vector2d::Zero());
  problem.size = static_cast<int>(y.size());
  problem.tolerance = system.tolerance;
  update_scale(system, y);
  std::unique_ptr<Integrator> integrator;
  size_t next = 0;
  double from = 0.0;
  long calls = 0;
  while (next < times.size() && times[next] <= 0.0) {
    sample(system, 0.0, y);
    ++next;
  }
  for (double end : ends) {
    for (Expression& e : system.model.expressions) e.freeze(0.5 * (from + end));
    if (problem.size == 0 || problem.size == (system.quadrature ? 2 : 0)) {
      // Everything is prescribed or fixed: nothing to integrate, only to evaluate.
      for (; next < times.size() && times[next] <= end; ++next) sample(system, times[next], y);
      from = end;
      continue;
    }
    if (!integrator) {
      integrator = std::make_unique<Integrator>(problem, method, from, y);
    } else {
      integrator->restart(from, y);
      ++out.events;
      ++out.restarts;
    }
    while (integrator->time() < end) {
      integrator->step(end);
      y = integrator->state();
      const double now = integrator->time();
      for (; next < times.size() && times[next] <= now; ++next) {
        VecX at;
        integrator->interpolate(times[next], at);
        sample(system, times[next], at);
      }
      if (!system.model.loops.empty()) set_state(system, now, y.data(), false);
      update_scale(system, y);
      if (renew_partitions(system)) {
        y = pack_state(system, system.quadrature ? Eigen::Vector2d(y.tail<2>()) : Eigen::Vector2d(0.0, 0.0));
        integrator->restart(now, y);
        ++out.restarts;
      }
      if (progress && ++calls % 16 == 0) progress(now);
    }
    from = end;
  }
  if (integrator) {
    const IntegratorStatistics s = integrator->statistics();
    out.steps = s.steps;
    out.evaluations = s.evaluations;
    out.jacobians = s.jacobians;
  }
  out.cpu_seconds = cpu_seconds() - start;
  return out;
}

}  // namespace

const char* method_name(Method method) {
  switch (method) {
    case Method::adams: return "adams";
    case Method::bdf: return "bdf";
    case Method::erk: return "erk";
    case Method::dirk: return "dirk";
    case Method::ida: return "ida";
    default: return "auto";
  }
}

Results simulate(const Scene& scene, const SimulateOptions& options) {
  System system = make_system(scene);
  if (options.tolerance) system.tolerance = *options.tolerance;
  const Method method = options.method.value_or(scene.simulation.method);
  const std::vector<double> times = sample_times(scene.simulation);

  Recorder recorder(system, times);
  SolverStatistics statistics = integrate(system, method, times, options.progress,
                                          [&](System& s, double t, const VecX& y) { recorder.record(s, t, y); });
  statistics.notes = system.notes;

  if (options.estimate_error && !recorder.outputs_empty()) {
    // Error of time: err = C tol^p with p near 1 between this run and one ten times looser (ACCURACY.md section 1).
    System loose = make_system(scene);
    loose.tolerance = std::min(10.0 * system.tolerance, 0.1);
    OutputComparison comparison(recorder, loose);
    integrate(loose, method, times, {}, [&](System& s, double t, const VecX& y) { comparison.add(s, t, y); });
    const auto [difference, column] = comparison.largest();
    statistics.error_estimate = difference / 9.0;
    statistics.error_column = column;
  }
  Results results = recorder.finish(system);
  results.statistics = statistics;
  return results;
}

}  // namespace flexframe::sim
