// The integrator's state taken apart.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

// Coordinates, independent rates and further states of y into the system's work; dependent rates stay.
void unpack_state(System& system, const double* y);

}  // namespace flexframe::sim
