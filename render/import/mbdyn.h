// MBDyn results: the nodes' motion of NAME.mov (text) or NAME.nc (NetCDF).
#pragma once

#include "sim/results/results.h"

#include <filesystem>
#include <optional>

namespace flexframe::imports {

// Lines "label x y z orientation velocity angular velocity". How orientations are written stands in NAME.log ("structural node: ...
// euler123", euler313, euler321, phi, mat), times in the lines "Step" of NAME.out beside it, or step. Without .log angles are euler123 in
// degrees, and a note says so. Without times: an error, or samples a second apart and a note where they are not needed. Layout: MBDyn input
// file format, section on output. Throws sim::InputError "FILE:LINE: ...".
sim::Results read_mbdyn_mov(const std::filesystem::path& path, std::optional<double> step, bool need_times);

// Variables time, node.struct.LABEL.X and .R (R11 R21 R31 R12 ...), .Phi (rad) or .E (degrees; the description says 123, 313, 321). Throws
// sim::InputError naming file and variable.
sim::Results read_mbdyn_netcdf(const std::filesystem::path& path);

}  // namespace flexframe::imports
