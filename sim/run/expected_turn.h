// What is known before a run of how far bodies will bend, so that nobody waits for the warning of linear_limit.h: linear statics of the
// bodies under the loads of the scene, at a score of instants, with the mechanism in its start position. What the joints let go
// accelerates (d'Alembert's forces), so that a pendulum is bent as it is when it is let go.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

// A sentence for every body that is expected to bend so far in its frame that linear displacements err by more than `tolerated` of its
// deflection: by how many degrees, how wrong that makes it, what to take instead. Loads that act from the start swing a body twice as far
// as they hold it, unless it starts in equilibrium. `system` is at its start (make_system). Not told: motions that the mechanism gets into
// later, and spin.
Notes expected_turns(const System& system, double tolerated);

}  // namespace flexframe::sim
