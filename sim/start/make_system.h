// A scene made ready to be integrated: model, effects that its loops call for, assembled start, static equilibrium, what has no inertia.
#pragma once

#include "sim/bodies/further_shapes.h"
#include "sim/time/system.h"

#include <functional>
#include <vector>

namespace flexframe::sim {

// Makes an assembled start ready for the search for a static one: may move work.q to where it is to begin, and returns which coordinates it
// leaves where they are, a mark a rate of w_all (statics.h).
using BeforeRest = std::function<std::vector<char>(const Model&, Work&)>;

// Builds the model and assembles the start (t = 0). Throws InputError. further: shapes that bodies of files take beside their own.
System make_system(const Scene& scene, const BeforeRest& before = {}, const FurtherOfBodies& further = {});

}  // namespace flexframe::sim
