// The estimated error of a run's time integration: from a run ten times tighter where that costs little, else from one ten times looser.
#pragma once

#include "sim/results/histories.h"
#include "sim/run/histories_run.h"
#include "sim/time/system.h"

#include <optional>

namespace flexframe::sim {

// What the warning advises: how much tighter a run has to be for unasked_accuracy, in whole decades.
double advised_tolerance(double tolerance, double error);

// How many times the steps a run of this method (its word) at another tolerance takes: as of methods of low order, but of Adams' and of
// backward differences, whose order rises with the tolerance. Those of the other methods of high order grow less than told.
double growth_of_steps(const std::string& method, double from, double to);

// What a run like this one costs at another tolerance, in evaluations times what one of them takes by the number of coordinates: about
// microseconds. CPU time would make results depend on how busy the machine is.
double price_at(const Results& run, double tolerance);

// Whether a run ten times tighter costs no more than about a CPU second, three of methods whose order rises with the tolerance, and is no
// rounding.
bool is_looked_at_tighter(const Results& run);

// The outputs of that run, by the method that `run` ended with; none where it is not looked at, takes far more steps than expected, or
// fails. start, scene: as for simulate_histories_from, which they go to with the options.
std::optional<Histories> tighter_run(const System& start, const Scene& scene, const SimulateOptions& options, const Results& run);

// At a loose tolerance steps are as long as drives and samples let them be, at a tenth of it as well: two such runs may agree by chance.
bool is_loose(const SolverStatistics& run);

// As estimate_time_error, from a run ten times tighter: it is so much better that the difference is the error. looser: one ten times
// looser, or null; returns the difference to it, and where the run is loose its estimate counts if it is the larger one.
Difference estimate_by_tighter(const Histories& tighter, const Histories* looser, const Histories& run, SolverStatistics& out);

// Compares a run with one whose tolerance is ten times as large: fills error_estimate and error_column of the output that is furthest off,
// and warns of outputs whose estimated error is above unasked_accuracy (run_scene.h) of their range. Returns the difference that it comes
// from (of the looser run). Where that is by Adams' methods the error is a fifth of the difference. Of others forces and accelerations are
// taken to err by half of it: vibrations that are stepped over show in them most, and hardly less at a tenth of the tolerance; other
// outputs by a third (error_of_difference). Runs with events are not told to be better than 0.8 of their tolerance.
Difference estimate_time_error(const Histories& looser, const Histories& run, SolverStatistics& out);

// What is missing in the balance of the energies of the results, over the largest of them; counts: more than unasked_accuracy and five
// times the estimated error.
struct EnergyGap {
  double share = 0.0;
  bool counts = false;
};
EnergyGap missing_energy(const Results& results);

// Warns where the energies of the results do not balance (missing_energy): work is no output, so no second run compares it, and where
// nothing feels it no step is made for it. asked: a note, as an accuracy is asked of outputs.
void tell_of_energies(Results& results, bool asked);

}  // namespace flexframe::sim
