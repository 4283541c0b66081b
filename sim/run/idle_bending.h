// Beams that nothing bends but their weight, if that: shafts and rods on which all acts along and about their axes.
//
// Bending that is never excited costs most of a run all the same: its fast vibrations set the steps. A run goes without it at first. What
// bends such a beam after all, its weight or a load that comes later, is seen along the motion as for every deformation that is left out
// (left_out.h), and so is a beam that comes near to bending by itself: pressed, twisted or spun.
#pragma once

#include "sim/scene/scene.h"

namespace flexframe::sim {

// The scene whose beams with automatic effects go without bending where nothing excites it: ProgramChoice::first_bending. Found by the
// accelerations of the mechanism without weight at rest, moving and deformed in all other ways, at different times. Leaves alone what
// starts in static equilibrium (which may be one of many), touches, moves in a plane, or asks for what bending alone tells. asked: for an
// accuracy, whose search would weigh what weight bends by many pairs of runs: weight counts then.
Scene without_idle_bending(const Scene& given, bool asked);

}  // namespace flexframe::sim
