// Compliant stops on joint coordinates as smooth pieces between located events.
//
// A stop pushes with k d - c w (d: how deep, w: the rate), never pulls: where damping would make it pull while the coordinate leaves,
// the force is zero ("parting") until the coordinate is out or pressed in again. While a run is integrated the piece is held
// (PartWork::stop), so that no step straddles a kink; what the damper takes out is counted exactly as work (loads.h).
#pragma once

#include "sim/dynamics/work.h"

#include <vector>

namespace flexframe::sim {

// Parts whose joint has a stop.
std::vector<int> stop_parts(const Model& model);

// The piece that holds at the present state.
StopPhase find_stop_phase(const Stop& stop, double q, double w);

// Two values that are positive while the piece holds and zero at its ends.
struct StopMargins {
  double out = 1.0, in = 1.0;
};
StopMargins stop_margins(const Stop& stop, StopPhase phase, double q, double w);

// The piece after `phase` when its first (first = true) or second margin has come to zero.
StopPhase next_stop_phase(StopPhase phase, bool first);

// Force of a piece, N or Nm, and the part of it that the stop's spring stores (all of it that touches, pushing or not).
double stop_elastic_force(const Stop& stop, StopPhase phase, double q);
double stop_force(const Stop& stop, StopPhase phase, double q, double w);

}  // namespace flexframe::sim
