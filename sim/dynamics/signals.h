// What expressions read of the present state (Model::signals), and the blocks that turn such readings into others. W: Work or PlaneWork.
//
// Signals follow from positions and velocities alone, so that no force waits for an acceleration. A block whose output passes its input on
// (D is not zero) is evaluated after what it reads; model_build has put them in that order.
#pragma once

#include "sim/dynamics/plane_work.h"

#include <vector>

namespace flexframe::sim {

// Room for the signals' values, and blocks at their initial states.
void reserve_signals(const Model& model, Work& work);

// SignalWork::value, ::output and ::zdot of blocks at the present state; a model without functions and blocks costs nothing. Positions and
// velocities come first.
template <class W>
void update_signals(const Model& model, W& work);

// Value of a function at the signals as they are. Throws SimulationError naming its owner where it is not finite.
double function_value(const StateFunction& function, const SignalWork& signals, double t);
// Positive while the first choice of the function that the motion makes stays as it is held, or stands where nothing is held.
double first_margin(const StateFunction& function, const SignalWork& signals, double t);

// Sampled blocks take their inputs, by the pieces that functions have there: those whose period ends at t. Signals come first; afterwards
// they are anew.
void sample_blocks(Model& model, Work& work, double t);
// Sample times within (from, to), ascending; none where nothing is sampled.
std::vector<double> sample_times(const Model& model, double from, double to);

// Switches of functions by the motion, counted one after the other: their number, their margins (expression.h), what rounding leaves of
// a margin that is zero, and the piece after those that ended (ended: one a switch, of all functions).
int switch_count(const Model& model);
void switch_margins(const Model& model, const Work& work, double* margin);
void switch_roundings(const Model& model, Work& work, std::vector<double>& rounding);
void hold_switches(Model& model, Work& work);
void pass_switches(Model& model, const Work& work, const std::vector<bool>& ended);
// The function to which a switch belongs.
const StateFunction& switch_owner(const Model& model, int at);

}  // namespace flexframe::sim
