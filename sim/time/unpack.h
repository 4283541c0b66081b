// The integrator's state taken apart.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

// Coordinates, independent rates and further states of y into the system's work; dependent rates stay.
void unpack_state(System& system, const double* y);

// Accelerations of the independent rates, as many as y has, at the coordinates that state_rate has evaluated last and the rates of y: what
// follows from positions alone is not made again. masses: the clusters' mass matrices are complete afterwards (reduced_mass.h). For
// systems without friction all of whose parts have inertia.
void accelerate_beside(System& system, const double* y, bool masses, double* wdot);

}  // namespace flexframe::sim
