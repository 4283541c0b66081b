// Accelerations of a cluster in the plane whose bodies deform in their own modes, without its mass matrix.
//
// Reduced to the independent rates that is D = 1 + U K U^T (no 1 for joints): the modes' own unit masses, and what the few motions of the
// bodies' frames couple. With s = K U^T x, the frames' momenta and accelerations, D x = h becomes x_e = h_e - U_e s for the modes and as
// many equations for s as the frames have components: n r^2 multiplications instead of n^3 / 6 (Woodbury's formula).
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// Whether solve_reduced serves a cluster that what carries it does not feel, and costs less than its mass matrix. Not in space, nor where
// another cluster hangs on one of its elastic bodies, where a joint is held, or where a deformation closes a loop.
inline bool prefers_reduced(const Model&, int, const Work&) { return false; }
bool prefers_reduced(const Model& model, int cluster, const PlaneWork& work);

// Accelerations work.wdot of such a cluster; the composites of its parts and the acceleration of its base come first. ClusterWork::L is
// left empty. False where a body's kinetic energy or a joint's inertia is not positive.
inline bool solve_reduced(const Model&, int, Work&) { return false; }
bool solve_reduced(const Model& model, int cluster, PlaneWork& work);

// update_accelerations (dynamics.h) where nobody asks for reactions nor how the parts accelerate: mass matrices only where they are the
// cheapest way to the rates.
template <class W>
void update_accelerations_alone(const Model& model, W& work);

// X = D^-1 X of a cluster's independent rates, a column a right-hand side, D its reduced mass matrix at the state whose accelerations were
// found last. Where that was done without it, the equations are made anew: nothing is kept that another state could have replaced.
void solve_mass(const Model& model, int cluster, Work& work, MatX& X);
void solve_mass(const Model& model, int cluster, PlaneWork& work, MatX& X);

// D itself, whole, after update_accelerations or complete_mass_matrices.
void reduced_mass(const ClusterWork& cw, MatX& D);

// Mass matrices and their factors after update_accelerations_alone, where it left them out.
template <class W>
void complete_mass_matrices(const Model& model, W& work);

}  // namespace flexframe::sim
