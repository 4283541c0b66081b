// What parts of a run are thought to take, s, for the count of work (base/work_clock.h): fitted to 1600 runs of 70 scenes.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

// An evaluation of the equations of motion, and in proportion a sample of the outputs.
double evaluation_price(const System& system);
inline constexpr double evaluations_a_sample = 1.5;

// A matrix of n rates for Newton's method, its differences excluded (they are evaluations), and one with its vibrations for the exponential
// method.
double newton_price(double n);
double linear_model_price(double n);
// So many terms of a series of n rates.
double series_price(double terms, double n);

}  // namespace flexframe::sim
