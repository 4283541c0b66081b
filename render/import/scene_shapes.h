// Results of another program for a mechanism that a scene describes: drawn with the scene's beams, shapes, meshes and joint symbols.
#pragma once

#include "sim/results/results.h"
#include "sim/scene/scene.h"

namespace flexframe::imports {

// Bodies are matched by name: each takes kind, length, section and mesh of the scene's; joints stand where the moved frames of their
// parents are. The results then carry the scene and are drawn by its [render] table. Throws sim::InputError where no body has a name of the
// scene's.
void dress_by_scene(const sim::Scene& scene, sim::Results& results);

}  // namespace flexframe::imports
