// Slips that come to rest: what counts as rest, and which of them turn round at once (friction.h).
#pragma once

#include "sim/dynamics/friction.h"

#include <vector>

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

// Points that were let go, but stay at rest as long as what sticks holds: their static friction counts (FrictionPoint::law) until all of it
// gives way. Per point.
struct Waiting {
  enum Sharing : char { open, known, found };  // known: by letting go of one after the other
  std::vector<char> waits;
  std::vector<char> driven;     // a prescribed motion moves it, whatever sticks
  std::vector<char> idle;       // others hold its share too: it carries nothing
  std::vector<char> released;   // was let go at this time
  std::vector<char> again;      // how often it then held all the same
  std::vector<Sharing> shared;  // per cluster
};

// Friction forces f, each within its bound, under which the accelerations A f + a0 of the rates are least (in the energy of these
// accelerations, Gauss): zero where a share-out within the bounds holds everything. A: positive semidefinite. As few as hold are between
// their bounds.
struct Shares {
  enum Place : char { idle, between, bound };
  std::vector<Place> place;
  VecX force, acceleration;
};
Shares least_acceleration(const MatX& A, const VecX& a0, const VecX& bounds);

// Whether a point that slips is at rest as long as the locks of its cluster hold. Velocities come first.
bool held_by_locks(const FrictionPoint& point, const FrictionState& friction, const Model& model, const Work& work);

// Parts whose joints rest by friction together, while something presses on them, so that rigid bodies leave open how much each of them
// holds. Needs accelerations with friction.
std::vector<int> openly_held(const Model& model, const FrictionState& friction, Work& work);

// Points that have come to rest, none in a group, go on at once: the directions in which all of them accelerate against their static
// friction, found by trying all of them (the complementarity conditions of Pfeiffer and Glocker 1996, ch. 5, enumerated). False, and
// nothing changed, where there are none (they stick), more than one choice (a reaction that raises itself), or too many points to try.
// Velocities come first.
bool turn_round(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work);

}  // namespace flexframe::sim
