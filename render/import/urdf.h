// Robots: a URDF file and the motion of its joints as a table.
#pragma once

#include "render/import/table.h"
#include "sim/results/results.h"

#include <filesystem>

namespace flexframe::imports {

// Every link with its visual shapes, moved by forward kinematics: world = parent's link * joint origin (xyz, rpy about fixed axes) * joint
// motion about or along its axis. table: a column a joint, named like it (rad, m, or the unit in its header); joints without a column stay
// at 0 (a table without columns moves none), a mimic joint follows its own. The first link may move by columns LINK.x LINK.y LINK.z and
// LINK.qw LINK.qx LINK.qy LINK.qz. angle_unit, length_unit: of columns without a unit. Source: ROS wiki, urdf/XML. Throws sim::InputError
// naming file, link or joint.
sim::Results read_urdf(const std::filesystem::path& path, const Table& table, double length_unit, double angle_unit);

}  // namespace flexframe::imports
