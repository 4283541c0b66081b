#include "sim/run/histories_run.h"

#include "sim/results/recorder.h"
#include "sim/run/complete_inertia.h"
#include "sim/run/integrate_run.h"
#include "sim/run/left_ranges.h"
#include "sim/run/passes.h"
#include "sim/run/second_run.h"
#include "sim/scene/joint_kinds.h"
#include "sim/start/make_system.h"
#include "sim/time/sample_state.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Whether an output is an angle that is counted through full turns from sample to sample.
bool counts_turns(const Model& model, const Scene& scene, const OutputDef& output) {
  if (output.quantity == Quantity::rotation) return true;
  if (output.quantity != Quantity::value) return false;
  for (const LoopJoint& l : model.loops)
    if (l.name == output.of.body) return true;
  for (const JointDef& j : scene.joints)
    if (j.name == output.of.body) return has_orientation(j.kind);
  return true;
}

// Every k-th time and the last, so that about `wanted` remain. Angles that are counted through turns need all times.
std::vector<double> thinned(const std::vector<double>& times, const Model& model, const Scene& scene, int wanted) {
  const bool turns =
      std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) { return counts_turns(model, scene, o); });
  const size_t stride = wanted > 0 && !turns ? std::max<size_t>(1, times.size() / static_cast<size_t>(wanted)) : 1;
  std::vector<double> out;
  for (size_t i = 0; i < times.size(); i += stride) out.push_back(times[i]);
  if (out.back() != times.back()) out.push_back(times.back());
  return out;
}

}  // namespace

std::vector<double> sample_times(const SimulationSettings& s) {
  std::vector<double> times;
  const auto count = static_cast<long>(s.duration * s.output_rate * (1.0 + 1e-12));
  for (long k = 0; k <= count; ++k) times.push_back(static_cast<double>(k) / s.output_rate);
  // The run's end is always a sample.
  if (times.back() > s.duration || s.duration - times.back() < 1e-9 / s.output_rate) times.back() = s.duration;
  else times.push_back(s.duration);
  return times;
}

namespace {

// What is looked at beside the outputs.
class WatchedBeside {
 public:
  explicit WatchedBeside(const System& system)
      : ranges_(system), swings_(VecX::Zero(static_cast<Eigen::Index>(system.scene.bodies.size()))) {}
  void look(System& system, double t) {
    ranges_.look(system, t);
    for (const Part& part : system.model.parts)
      if (part.body.n > 0 && part.scene_body >= 0)
        swings_[part.scene_body] = std::max(swings_[part.scene_body], system.work.q.segment(part.eq0, part.body.n).norm());
  }
  SeenBeside seen(const System& system) const {
    SeenBeside out{system.notes, swings_};
    ranges_.warn(out.notes);
    return out;
  }

 private:
  LeftRanges ranges_;
  VecX swings_;
};

// start: null, or make_system(scene).
Histories histories_of(const System* start, const Scene& scene, const SimulateOptions& options) {
  return with_complete_inertia(scene, [&](const Scene& s, int& indefinite) {
    return with_narrowed_weights(options.weight_shares, [&](const std::vector<double>& shares, std::vector<double>& wanted) {
      // Of a changed scene (complete_inertia.h) another system is made.
      System system = start && &s == &scene ? copy_start(*start) : make_system(s);
      if (options.tolerance) system.tolerance = *options.tolerance;
      system.weights.shares = shares;
      const std::vector<double> times = thinned(sample_times(s.simulation), system.model, s, options.samples);
      HistoryRecorder recorder(system, times, options.read);
      std::optional<WatchedBeside> beside;
      if (options.beside) beside.emplace(system);
      RunSpan span = whole_run(s.simulation, times);
      const auto one = [&](System& at, double t, const VecX& y) {
        recorder.record(at, t, y);
        require_sample_closed(at, recorder.in_plane());
        if (beside) beside->look(at, t);
      };
      RunWatch watch{options.progress, steps_allowed(scene, options), options.tell};
      if (recorder.takes_four())
        watch.samples = [&](System& at, const double* when, int count, const MatX& states) {
          if (!recorder.place_four(at, when, states)) return false;
          for (int k = 0; k < count; ++k) {
            recorder.record_lane(at, when[k], k);
            if (beside) beside->look(at, when[k]);
          }
          return true;
        };
      const SolverStatistics statistics = integrate(system, options.method.value_or(s.simulation.method), span, watch, one, indefinite);
      wanted = system.weights.narrowed(system);
      Histories out = recorder.finish();
      out.statistics = statistics;
      if (beside) *options.beside = beside->seen(system);
      return out;
    });
  });
}

}  // namespace

System copy_start(const System& system) {
  System out = system;
  if (system.plane) out.plane = std::make_shared<PlaneMotion>(*system.plane);
  return out;
}

Histories simulate_histories(const Scene& scene, const SimulateOptions& options) { return histories_of(nullptr, scene, options); }
Histories simulate_histories_from(const System& start, const Scene& scene, const SimulateOptions& options) {
  return histories_of(&start, scene, options);
}

}  // namespace flexframe::sim
