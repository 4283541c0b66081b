// The matrix of Newton's method for implicit integration, by the structure of the equations of motion instead of a difference for
// every state: q' = T w, w' = f(q, w), so that a system of the size of the independent rates is solved and nothing is spent on
// dependent coordinates and quadratures.
//
// What is stiff in most scenes is known in closed form: the structural stiffness and damping of the bodies, and those of springs, dampers,
// cables and bushings between frames, through the mass matrix of the state evaluated last. Joint coordinates and rates, which carry
// springs, stops and contact, are differenced. Terms that are neither (gyroscopic ones, the geometric stiffness of the momentary loads) are
// left out: they slow Newton's method down by about their rate times the step, and change no solution. Where tables, functions of the state
// or springs of loops act all columns are differenced, and of bodies that carry each other in a plane, or with few elastic coordinates.
#pragma once

#include "sim/time/integrator.h"
#include "sim/time/system.h"

namespace flexframe::sim {

// What is made anew. fresh: differences too; else those only that are cheap, and what is known in closed form. keep_joints: not even
// the cheap ones.
struct Renewal {
  bool fresh = true, keep_joints = false;
};

// Brings `out` to the state (t, y). rates: those of the state and `work` at it, or null where it is to be evaluated. `out` empty: fresh.
void update_newton_matrix(System& system, double t, const double* y, const double* rates, const Renewal& renewal, MechanicalJacobian& out);

// T, P and of A and B only what is known in closed form at y, the state that was evaluated last; the rest of them is zero.
void update_closed_matrix(System& system, const double* y, MechanicalJacobian& out);

// All columns of A and B at (t, y) by differences wide enough for what is left beside the stiffness: a millionth of the component's size.
// rates: those of the state, with `work` at its places, or null where it is to be evaluated.
void difference_rates(System& system, double t, const double* y, const double* rates, MatX& A, MatX& B);

// Whether the stiffness is known in closed form and no more than three joints' rates are left to differences, so that the matrix costs
// less than the iterations of a step and is worth making at every one.
bool matrix_is_cheap(const System& system);

}  // namespace flexframe::sim
