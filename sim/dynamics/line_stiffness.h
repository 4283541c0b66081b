// Stiffness and damping of springs, cables and bushings between frames, as the independent rates see them: what Newton's matrix asks of
// them.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// Whether a load is a spring, damper, cable or bushing whose tangent is known: its pull follows from its length, its rate and the time
// alone.
bool is_line(const Load& load);

// With G = forces, the generalised forces change by -G diag(stiffness) G^T per change of the independent rates' directions (in the order of
// the state; elastic coordinates, joints' coordinates along their rates) and by -G diag(damping) G^T per rate. What turns or lengthens the
// levers of a pull is left out.
struct LineStiffness {
  MatX forces;              // independent rates x lines: per unit of pull
  VecX stiffness, damping;  // N/m, N s/m
};

// Of all lines of the model, slack cables left out, at the state that was evaluated last.
template <class W>
LineStiffness line_stiffness(const Model& model, const W& work);

}  // namespace flexframe::sim
