// Bodies in files without geometric stiffening that spin, told from the results of a run; no second run.
#pragma once

#include "sim/base/notes.h"
#include "sim/model/model.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// Bodies of the scene, from files, that have no second-order displacements in a model, or whose inertia does not follow the deformation
// in second order: their file has none, or the model needs none.
std::vector<int> without_second_order(const Model& model, const Scene& scene);

// Warns of those among `bodies` whose file has no second-order displacements, unless the scene leaves stiffening out itself, or no
// second-order inertia, where they turn so fast that centrifugal forces are worth more than `asked` of the stiffness of their lowest
// vibration as the scene mounts them: (Omega / omega)^2.
void warn_of_missing_stiffening(const Scene& scene, const std::vector<int>& bodies, const Results& results, double asked, Notes& notes);

}  // namespace flexframe::sim
