// A mechanism that swings in one of its modes about its start, as results that can be drawn like those of a run.
#pragma once

#include "sim/results/results.h"
#include "sim/start/linearise.h"

namespace flexframe::sim {

// One period in `pictures` equal steps over `seconds` of playback, so that a film of it loops; loops stay closed. amplitude: m, of the
// coordinate that moves farthest (angles count with the size of their loop). Throws SimulationError where a loop cannot be closed so far
// from the start, InputError for a mode that moves nothing.
Results swing_in_mode(const System& system, const LinearMode& mode, double amplitude, int pictures, double seconds);

}  // namespace flexframe::sim
