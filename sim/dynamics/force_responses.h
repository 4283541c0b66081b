// Accelerations per generalised force, at the positions evaluated last: the mass matrix's inverse of the whole tree applied to right-hand
// sides, by the factors that its clusters have. What Newton's matrix asks of bodies' stiffness where bodies hang on flexible ones.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// X: independent rates in the order of the state x right-hand sides; from generalised forces on them, N, N m or of an elastic coordinate,
// to their accelerations. complete_mass_matrices (reduced_mass.h) comes first. Cost: a right-hand side is some n^2 multiplications a
// cluster of n rates, two passes over the tree (Featherstone 2008, sec. 7.3).
template <class W>
void force_responses(const Model& model, W& work, MatX& X);

}  // namespace flexframe::sim
