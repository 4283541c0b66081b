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

namespace flexframe::sim {

// Which of them dampers act on, at the present state: again where stops touch or part.
void split_massless(const Model& model, Work& work);

// The two ways between the state and the true rates; nothing where everything has inertia.
// Reduced to true, for update_positions and update_velocities alone: coordinates and rates of m at the present coordinates and rates p in
// work.w, which become true rates.
void expand_positions(const Model& model, Work& work);
void expand_rates(const Model& model, Work& work);
// True rates into p.
void reduce_rates(const Model& model, VecX& w);

// Positions and velocities anew from the true rates in work.w: after locks, partitions or what dampers act on have changed.
void renew_motion(const Model& model, Work& work);

// Whether the coordinate behind a rate is integrated though its rate is not independent (a damper acts on it).
bool follows_damper(const Model& model, const Work& work, int rate);

// Fastest decay of what springs and dampers drive without inertia, 1/s.
double massless_decay(const Model& model, const Work& work);

}  // namespace flexframe::sim
