// Mass, structural stiffness and damping of a mechanism at a state, and the undamped vibrations that they make.
#pragma once

#include "sim/dynamics/directions.h"

namespace flexframe::sim {

// In the units of the directions.
struct StructuralMatrices {
  MatX N;        // w_all x n: rates that unit rates of the directions make
  MatX M, D, K;  // n x n, exact: bodies and flexures; no loads, no geometric stiffness
};

// At the positions in work.q and its prescribed motions, which stand. Leaves in `work` the positions and the last direction's unit rates.
StructuralMatrices structural_matrices(const Model& model, Work& work, const std::vector<Direction>& directions);

// Ascending; those without stiffness have the frequency 0 but for rounding.
struct StructuralVibrations {
  VecX frequencies;  // rad/s
  MatX shapes;       // n x n, columns of unit modal mass
  MatX amounts;      // n x n: of rates of the directions, amounts shapes = 1
};

// Of M and K. Empty where M is not positive: what has no inertia.
StructuralVibrations structural_vibrations(const StructuralMatrices& matrices);

}  // namespace flexframe::sim
