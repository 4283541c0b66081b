// Outputs that are zero by their definition: displacements of the very frame from which a deformation is measured.
#pragma once

#include "sim/results/results.h"
#include "sim/scene/scene.h"

namespace flexframe::sim {

// A note for each output `displacement` of a body that deforms all the while the output is exactly zero.
void tell_of_zero_displacements(const Scene& scene, Results& results);

}  // namespace flexframe::sim
