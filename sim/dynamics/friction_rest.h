// Slips that come to rest: what counts as rest, and which of them turn round at once (friction.h).
#pragma once

#include "sim/dynamics/friction.h"

namespace flexframe::sim {

// Slower than this share of the fastest slip so far a direction is rounding.
inline constexpr double no_speed = 1e-13;
// And of several slips whose rates keep a proportion the others rest as well.
inline constexpr double at_rest = 1e-10;

inline double rate_of(const FrictionPoint& p, const Model& model, const VecX& w_all) { return w_all[model.parts[p.part].v0 + p.rate]; }
inline double static_coefficient(const Friction& law) { return law.static_coefficient.value_or(law.coefficient); }
// Of a point that slips forward or backward.
inline double direction(const FrictionPoint& p) { return p.phase == FrictionPhase::forward ? 1.0 : -1.0; }
bool any_sticks(const FrictionState& friction);

// The largest rate of a point so far, FrictionState::fastest, brought up to the present velocities.
void follow_fastest(const Model& model, FrictionState& friction, const Work& work);
// What rounding leaves of a slip that is zero, in the unit of its rate; of a point that sticks 0.
double friction_rounding(const FrictionPoint& point, const FrictionState& friction, const Model& model);

// Points that have come to rest, none in a group, go on at once: the directions in which all of them accelerate against their static
// friction, found by trying all of them (the complementarity conditions of Pfeiffer and Glocker 1996, ch. 5, enumerated). False, and
// nothing changed, where there are none (they stick), more than one choice (a reaction that raises itself), or too many points to try.
// Velocities come first.
bool turn_round(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work);

}  // namespace flexframe::sim
