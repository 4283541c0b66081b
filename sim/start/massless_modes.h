// Small motions where something has no inertia (sim/dynamics/massless.h).
#pragma once

#include "sim/dynamics/directions.h"
#include "sim/start/complex_modes.h"
#include "sim/time/system.h"

namespace flexframe::sim {

// Rates without inertia stand among the independent ones again, as if they had some. False where there are none.
bool release_massless(Model& model, Work& work);

// Of the equations s of the released system `given` in the directions `all` (N: w_all x directions): what has no mass follows the rest, by
// springs alone as their stiffness lets it, which leaves s and N of the others; where dampers act, in first order: then the modes are found
// here, with shapes in w_all, and the answer is true.
bool follow_massless(const System& given, const std::vector<Direction>& all, SecondOrder& s, MatX& N, std::vector<ComplexMode>& modes);

}  // namespace flexframe::sim
