// Finding what has no inertia; how it moves: sim/dynamics/massless.h.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

// Finds the rates without inertia at the assembled start, locks them (Model::massless, ClusterWork::carried), brings their coordinates into
// balance and tells of it in the notes: false where there are none. Throws InputError where nothing determines them, or forces act that the
// balance does not know.
bool find_massless(System& system);

}  // namespace flexframe::sim
