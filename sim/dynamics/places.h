// Places where nobody asks how anything moves: samples of runs.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// update_positions (dynamics.h) without what rates, accelerations and energies alone need of it: poses of all parts. Masses, and what
// closes the rates of loops (Gd and E), are not those of these positions afterwards. Throws as that does.
template <class W>
void update_places(const Model& model, W& work);

// close_positions (closure.h) of one cluster likewise.
template <class W>
void close_places(const Model& model, int cluster, W& work);

}  // namespace flexframe::sim
