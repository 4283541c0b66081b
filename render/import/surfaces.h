// Surfaces that results carry themselves: meshes in other units, skins of finite element meshes.
#pragma once

#include "sim/results/results.h"

#include <string>

namespace flexframe::imports {

// Reads body.mesh, whose lengths are in `unit` m, into body.surface, with the colours of its materials; body.mesh is empty then. Throws
// render::MeshError.
void embed_mesh(double unit, sim::ResultBody& body);

// Throws render::MeshError where the file is no mesh.
void check_mesh(const std::string& file);

}  // namespace flexframe::imports
