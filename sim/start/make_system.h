// A scene made ready to be integrated: model, effects that its loops call for, assembled start, static equilibrium, what has no inertia.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

// Builds the model and assembles the start (t = 0). Throws InputError.
System make_system(const Scene& scene);

}  // namespace flexframe::sim
