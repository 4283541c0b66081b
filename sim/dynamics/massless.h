// Coordinates without inertia: bodies that have no mass and are held by springs, bushings and dampers only.
//
// Where the rates can change along z without any mass moving, z' M = 0 and the equation of motion along z has no acceleration: it is the
// balance z' Q(q, w, t) = 0 of the applied forces alone (weight and inertia do no work along z). Dampers along z make it one of first
// order: rates from the balance, coordinates integrated. Springs alone make it algebraic: the coordinates solve it by Newton's method
// inside every evaluation, and their rates follow from its derivative. Both kinds together: damping is positive semidefinite, so that along
// its null directions no damper acts at all, and the balance splits into the two.
//
// The rates m that carry nothing are locked in closure.h with a rate of their own (ClusterWork::lock_rate), and the other independent rates
// are integrated as those that move the masses alike while m rests, p = w - Z w_m: M p' is what the recursion of dynamics.h finds with m
// locked, and where only springs act no second derivative of them is ever needed. Z does not depend on the position (parallel slides, a
// massless body at a tree's end); what does is refused.
//
// In the state p stands in the place of the independent rates, and the coordinates of m beside the others: integrated where dampers act,
// first guesses elsewhere.
#pragma once

#include "sim/dynamics/work.h"

#include <optional>

namespace flexframe::sim {

// The two ways between the state and the motion, which the system (sim/time/system.cpp) goes; nothing where everything has inertia.
// From the state: coordinates of m and all rates, true ones, from the other coordinates and the rates p in work.w. Positions and
// velocities of those (dynamics.h) come first, and are then those of the motion. Throws SimulationError where nothing determines them.
void expand_rates(const Model& model, Work& work);
// To the state: true rates of w_all into p.
void reduce_rates(const Model& model, VecX& w);

// Of rates w_all those that move no mass.
VecX massless_part(const Model& model, const VecX& w);

// Between two states: positions and velocities anew from the true rates in work.w, where locks or partitions have changed, and where stops
// that touch or part have changed what dampers act on.
void renew_motion(const Model& model, Work& work);
void renew_dampers(const Model& model, Work& work);

// What a work space that is made anew keeps of the old one.
void keep_balance(const Work& old, Work& work);

// Whether M w' = f holds for every rate: what a method may rely on that needs no more than the mass matrix.
bool all_have_inertia(const Model& model);

// Whether the coordinate behind a rate is integrated though its rate is not independent (a damper acts on it).
bool follows_damper(const Model& model, const Work& work, int rate);

// Fastest decay of what springs and dampers drive without inertia, 1/s; 0 where no damper drives any.
double massless_decay(const Model& model, const Work& work);

// J: the most that a spring or damper takes up where the mechanism moves by `share` of its size (rotations: share in rad), within the time
// 1 / slow (slow: 1/s). Nothing where everything has inertia.
std::optional<double> balance_energy(const Model& model, double share, double slow);

}  // namespace flexframe::sim
