// Coordinates of driven joints, which results do not hold.
#pragma once

#include "sim/results/results.h"

namespace flexframe::sim {

// Value (rad, m) and rate (rad/s, m/s) at the times of the results of every joint that follows a prescribed motion and has no coordinates
// there, from the text of the scene that the results keep. Nothing is added where they keep none, or one that cannot be read any more.
void add_driven_coordinates(Results& results);

}  // namespace flexframe::sim
