// What a run of a scene costs and what of it: set-up (parse to the first step), one evaluation of the equations of motion, evaluations.
//
//   bench_evaluation SCENE... [--runs N] [--count N] [--setup] [--batch N [--tolerance T]]
//
// CPU seconds are the least of N runs (five) without estimates of errors and effects, as the integrator has them. An evaluation is timed
// at the states of the run's samples. With --count N nothing is timed and every scene is evaluated N times at its start, for counting
// instructions, which do not depend on the machine's load:
//
//   valgrind --tool=callgrind --toggle-collect='flexframe::sim::state_rate*' bench_evaluation SCENE --count 100
//
// With --setup nothing is run: every scene is read and brought to its start (setup.py beside counts the instructions of that); --runs 1
// where not given.
//
// With --batch N every scene is read once and run N times in a row with another gravity each time, as sweeps run a scene with other
// numbers: runs a CPU second, histories of the outputs included, and how far off the first run is (of the ranges of its outputs, against a
// run with a hundredth of the tolerance).
#include "sim/run/histories_run.h"
#include "sim/run/integrate_run.h"
#include "sim/scene/scene_reader.h"
#include "sim/start/make_system.h"
#include "tests/bench/cpu.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace {

using namespace flexframe::sim;

struct Cost {
  double setup = 1e9, run = 1e9, evaluation = 1e9;  // s
  long steps = 0, evaluations = 0;
  std::string method;
};

// Seconds an evaluation takes over the states of a run.
double time_evaluations(System& system, const std::vector<double>& times, const std::vector<VecX>& states) {
  if (states.empty()) return 0.0;
  const long rounds = std::max(1L, 2000L / static_cast<long>(states.size()));
  VecX dy(states.front().size());
  long done = 0;
  const double start = flexframe::test::process_seconds();
  for (long r = 0; r < rounds; ++r)
    for (size_t i = 0; i < states.size(); ++i)
      if (states[i].size() == dy.size()) state_rate(system, times[i], states[i].data(), dy.data()), ++done;
  return (flexframe::test::process_seconds() - start) / static_cast<double>(std::max(1L, done));
}

Cost measure(const std::string& file, long runs) {
  Cost out;
  for (long go = 0; go < runs; ++go) {
    double start = flexframe::test::process_seconds();
    std::optional<System> made;
    std::thread([&] { made = make_system(read_scene(file)); }).join();  // a thread of its own has kept no bodies
    System& system = *made;
    const Scene& scene = system.scene;
    out.setup = std::min(out.setup, flexframe::test::process_seconds() - start);
    const std::vector<double> times = sample_times(scene.simulation);
    RunSpan span = whole_run(scene.simulation, times);
    std::vector<double> at;
    std::vector<VecX> states;
    int indefinite = -1;
    start = flexframe::test::process_seconds();
    const SolverStatistics s = integrate(
        system, scene.simulation.method, span, {},
        [&](System&, double t, const VecX& y) {
          at.push_back(t);
          states.push_back(y);
        },
        indefinite);
    out.run = std::min(out.run, flexframe::test::process_seconds() - start);
    out.steps = s.steps;
    out.evaluations = system.evaluations;
    out.method = s.method;
    out.evaluation = std::min(out.evaluation, time_evaluations(system, at, states));
  }
  return out;
}

void evaluate_often(const std::string& file, long count) {
  System system = make_system(read_scene(file));
  const VecX y = pack_state(system, Eigen::Vector2d::Zero());
  VecX dy(y.size());
  for (long k = 0; k < count; ++k) state_rate(system, 0.0, y.data(), dy.data());
  fmt::print("{}: {} evaluations, {} states, {}\n", file, count, y.size(), system.plane ? "in a plane" : "in space");
}

// Every time in a thread of its own, which has kept no bodies.
void set_up(const std::string& file, long runs) {
  double least = 1e9;
  for (long go = 0; go < runs; ++go) {
    const double start = flexframe::test::process_seconds();
    std::thread([&] { make_system(read_scene(file)); }).join();
    least = std::min(least, flexframe::test::process_seconds() - start);
  }
  fmt::print("{}: set-up {:.3f} ms\n", file, 1e3 * least);
}

void run_often(const std::string& file, long count, std::optional<double> tolerance) {
  Scene scene = read_scene(file);
  SimulateOptions options;
  options.estimate_error = options.check_effects = false;
  options.tolerance = tolerance ? tolerance : scene.simulation.tolerance;
  SimulateOptions strict = options;
  strict.tolerance = 0.01 * options.tolerance.value_or(1e-6);
  const Histories first = simulate_histories(scene, options), reference = simulate_histories(scene, strict);
  const double off = compare_histories(first, reference, output_ranges(reference)).largest;
  const Vec3 gravity = scene.simulation.gravity;
  const double start = flexframe::test::process_seconds();
  for (long k = 0; k < count; ++k) {
    scene.simulation.gravity = gravity * (1.0 + 1e-3 * static_cast<double>(k % 10)) + Vec3(0.0, -1e-3 * static_cast<double>(k % 10), 0.0);
    simulate_histories(scene, options);
  }
  const double seconds = flexframe::test::process_seconds() - start;
  fmt::print("{}: {:.0f} runs a second ({} evaluations), {:.2g} off\n", file, static_cast<double>(count) / seconds,
             first.statistics.evaluations, off);
}

}  // namespace

int main(int count, char** words) {
  std::vector<std::string> scenes;
  long repeats = 0, runs = 0, batch = 0;
  bool setup = false;
  std::optional<double> tolerance;
  for (int i = 1; i < count; ++i) {
    if (std::string_view(words[i]) == "--count" && i + 1 < count) repeats = std::atol(words[++i]);
    else if (std::string_view(words[i]) == "--batch" && i + 1 < count) batch = std::atol(words[++i]);
    else if (std::string_view(words[i]) == "--tolerance" && i + 1 < count) tolerance = std::atof(words[++i]);
    else if (std::string_view(words[i]) == "--runs" && i + 1 < count) runs = std::atol(words[++i]);
    else if (std::string_view(words[i]) == "--setup") setup = true;
    else scenes.emplace_back(words[i]);
  }
  // Memory as the program has it (tune_process in render/draw): large matrices stay in the heap.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 64 << 20);
  if (setup) {
    for (const std::string& file : scenes) set_up(file, std::max(1L, runs));
    return 0;
  }
  if (runs == 0) runs = 5;
  if (scenes.empty()) {
    fmt::print(stderr, "usage: bench_evaluation SCENE... [--runs N] [--count N] [--setup] [--batch N [--tolerance T]]\n");
    return 2;
  }
  if (repeats == 0 && batch == 0)
    fmt::print("{:<44}  {:>12}  {:>9}  {:>9}  {:>7}  {:>11}  {:>13}\n", "scene", "method", "set-up ms", "run ms", "steps", "evaluations",
               "us/evaluation");
  for (const std::string& file : scenes) {
    if (batch > 0) {
      run_often(file, batch, tolerance);
      continue;
    }
    if (repeats > 0) {
      evaluate_often(file, repeats);
      continue;
    }
    const Cost c = measure(file, runs);
    fmt::print("{:<44}  {:>12}  {:>9.2f}  {:>9.2f}  {:>7}  {:>11}  {:>13.2f}\n", file, c.method, 1e3 * c.setup, 1e3 * c.run, c.steps,
               c.evaluations, 1e6 * c.evaluation);
  }
}
