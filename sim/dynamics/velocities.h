// Velocities where no accelerations follow.
#pragma once

#include "sim/dynamics/dynamics.h"

namespace flexframe::sim {

// update_velocities (dynamics.h) without what accelerations alone need of them: dependent rates and twists.
template <class W>
void update_velocities_alone(const Model& model, W& work);

// close_velocities (closure.h) of one cluster likewise.
template <class W>
void close_velocities_alone(const Model& model, int cluster, W& work);

}  // namespace flexframe::sim
