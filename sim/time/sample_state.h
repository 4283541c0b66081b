// The state at a sample of a run, as outputs read it: for less than an evaluation, in a scene that moves in a plane.
#pragma once

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/four_places.h"
#include "sim/time/system.h"

namespace flexframe::sim {

// Whether energies, poses and twists of a sample can be had from the scene's plane: it has one, gravity lies in it and nothing touches.
bool has_plane_samples(const System& system);

// Brings the work in space to (t, y) by the scene's plane: coordinates and rates, every loop closed; what place_in_space (plane_work.h)
// has, the poses of `frames` besides, and of those of springs. Inertias and accelerations are not made. Returns the energies of the
// system. moving: false where nobody asks how anything moves: rates that close loops and twists stay as they were, energies are zero.
Energy place_plane_sample(System& system, double t, const double* y, const std::vector<int>& frames = {}, bool moving = true);

// Four samples at once, of which nobody asks how anything moves: their states are the rows of 4 x size. False where they are to be placed
// one by one (FourPlaces::place); conditions of the loops that the partitions leave out have been looked at else. bring_sample then brings
// the work to one of them, as far as FourPlaces::bring does.
bool place_four_samples(System& system, const double* times, const MatX& states, FourPlaces& places);
void bring_sample(System& system, double t, const FourPlaces& places, int lane);

// The same by the equations in space: set_state, and the poses.
Energy place_space_sample(System& system, double t, const double* y, const std::vector<int>& frames = {});

// Conditions of the loops that the partitions leave out, where the sample was placed last: throws as require_closed (closure.h).
void require_sample_closed(System& system, bool in_plane);

}  // namespace flexframe::sim
