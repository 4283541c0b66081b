// The estimated error of a run's time integration, from a run ten times looser.
#pragma once

#include "sim/results/histories.h"

namespace flexframe::sim {

// What the warning advises: how much tighter a run has to be for unasked_accuracy, in whole decades.
double advised_tolerance(double tolerance, double error);

// Compares a run with one whose tolerance is ten times as large: fills error_estimate and error_column of the output that is furthest off,
// and warns of outputs whose estimated error is above unasked_accuracy (run_scene.h) of their range. Returns the difference that it comes
// from (of the looser run). Of Adams' methods the error is a fifth of the difference. Of others forces and accelerations are taken to err
// by half of it: vibrations that are stepped over show in them most, and hardly less at a tenth of the tolerance; other outputs by a third
// (error_of_difference). Runs with events are not told to be better than 0.8 of their tolerance.
Difference estimate_time_error(const Histories& looser, const Histories& run, SolverStatistics& out);

}  // namespace flexframe::sim
