// Rotations as scene files write them: a rotation vector in rad, { axis, angle }, { euler, angles }, { quaternion } or { matrix }.
#pragma once

#include "sim/scene/toml_input.h"

namespace flexframe::sim {

// The rotation vector, rad. [0, 0, 1.2], ["0", "0", "30 deg"]; { axis = [0, 0, 1], angle = "30 deg" }; { euler = "zxz", angles = [a, b, c]
// }: turns about the axes as they lie by then, the first letter first; { quaternion = [w, x, y, z] } of any length but 0; { matrix = rows }
// whose columns are the turned axes, to a few digits. Without the key: zero. Throws InputError.
Vec3 read_rotation(const TableReader& reader, std::string_view key);

}  // namespace flexframe::sim
