// Histories of a scene's outputs and nothing else: the runs that are compared with each other.
#pragma once

#include "sim/results/histories.h"
#include "sim/scene/scene.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// What a run of histories shows beside them.
struct SeenBeside {
  Notes notes;  // warnings of the system and of ranges that were left (left_ranges.h)
  VecX swings;  // of every body of the scene, the largest Euclidean norm of its elastic coordinates, piece by piece
};

struct SimulateOptions {
  std::optional<double> tolerance;  // overrides the scene's
  std::optional<double> accuracy;   // overrides the scene's, and its tolerance: accuracy.h
  std::optional<Method> method;
  bool estimate_error = true;  // runs the scene once more and compares: ten times tighter, or, where that costs much, ten times looser
  // Compares with what was left out, effect by effect, as far as about half the run's cost allows; what is worth more than the asked
  // accuracy (a hundredth where none is asked) becomes a warning. Needs estimate_error.
  bool check_effects = true;
  bool pictures = false;              // what is most of the deformation counts as outputs do (left_out.h); so it does without outputs
  int samples = 0;                    // simulate_histories: thin the output times to about this many; 0: all of them
  std::vector<bool> read;             // simulate_histories: of the columns, those that anybody reads (the others are zero); empty: all
  SeenBeside* beside = nullptr;       // simulate_histories: null: not looked at
  std::vector<double> weight_shares;  // of the trees, where they are known from another run of the scene (ErrorWeights); empty: found
  // Called now and then with the simulated time (s); may throw to stop.
  std::function<void(double time)> progress;
  std::function<void(const std::string& words)> tell;  // once, where the run will take long: what it spends its steps on
  std::optional<double> max_steps;                     // overrides the scene's
};

// Steps that a run of the scene may take before it ends with a sentence that says why.
inline double steps_allowed(const Scene& scene, const SimulateOptions& options) {
  return options.max_steps.value_or(scene.simulation.max_steps.value_or(default_max_steps));
}

// All output times of a run, s: every 1 / output_rate and the end.
std::vector<double> sample_times(const SimulationSettings& settings);

// The outputs' histories only: no poses, nodes or energies are kept, no error is estimated. Times are a subset of those of run_scene()
// (all of them where outputs are angles that are counted through full turns).
Histories simulate_histories(const Scene& scene, const SimulateOptions& options = {});

// Estimated error of the tighter of two runs whose tolerances are a factor of ten apart, from their difference: error = C tolerance^p
// makes it difference / (10^p - 1). Vibrations that are stepped over give p from 0.2 (implicit methods) to 1.2 (Adams); 1/3 stays within
// a factor of five of the truth over all of that.
inline constexpr double error_of_difference = 1.0 / 3.0;

}  // namespace flexframe::sim
