// [[instance]]: copies of a [[group]] of bodies, joints, forces and outputs, each placed and with parameters of its own.
#pragma once

#include "sim/scene/parameters.h"
#include "sim/scene/toml_input.h"

#include <string>

namespace flexframe::sim {

// Adds to the root's body, joint, force and output what its instances say: names become "INSTANCE:NAME", and names of the group's own
// bodies and joints inside it follow; numbers may use the group's parameters and `i`, the number of the copy (1 ... count); names may hold
// "{expression}". Joints whose parent is outside the group, and forces with a direction in the world, are moved and turned by the
// instance's position and rotation. Throws InputError naming file, line and key; `file`: the root's.
void place_instances(TomlValue& root, const std::string& file, const Parameters& parameters);

}  // namespace flexframe::sim
