// Bodies in files without geometric stiffening that spin, told from the results of a run; no second run.
#pragma once

#include "sim/base/notes.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

namespace flexframe::sim {

// Warns of bodies whose file has no second-order displacements, unless the scene leaves stiffening out itself, where they turn so fast that
// centrifugal forces are worth more than `asked` of the stiffness of their lowest vibration as the scene mounts them: (Omega / omega)^2.
void warn_of_missing_stiffening(const Scene& scene, const Results& results, double asked, Notes& notes);

}  // namespace flexframe::sim
