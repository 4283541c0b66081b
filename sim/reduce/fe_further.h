// What a reduced model leaves out of the finite element model, as a few shapes beside its own.
//
// With static deflections among the fields the rest of the model follows their inertia alone: what U lacks under the inertia of the static
// responses S to unit loads at the interfaces is K^-1 M S, one solution each. Shapes C of these that have no stiffness in common with U
// (U^T K C = 0) are moved by no load at an interface where U has all of S; at a frequency omega a motion U q is slowed as by an added mass
// omega^2 G, G = U^T M C (C^T K C)^-1 C^T M U, which is exact where omega is low. REDUCE.md.
#pragma once

#include "sim/reduce/fe_solver.h"

namespace flexframe::sim {

struct FeFurther {
  FeModes shapes;            // M-orthonormal, K diagonal and none in common with the reduced model's; the largest parts of G first
  MatX coupling;             // U^T M of them
  double right_up_to = 0.0;  // omega^2: up to here the frequencies of `basis` change by no more than a thousandth beside the shapes
};

// basis: of the reduced model, M-orthonormal and K diagonal. statics: elastic responses to unit loads at the interfaces, free x k.
FeFurther further_fields(const FeSolver& solver, const FeModes& basis, MatX statics);

}  // namespace flexframe::sim
