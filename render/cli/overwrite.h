// What a command writes must not take the place of what it reads: a scene, its parts, bodies, meshes or tables would be lost.
#pragma once

#include <filesystem>
#include <vector>

namespace flexframe::cli {

// Throws UsageError where one of `outputs` (those that are empty are left out) is one of `inputs`, a file that this command has read so
// far (sim/base/files_read.h), or another of the outputs. To be called before anything is computed, and
// again before the first file is written where more was read meanwhile.
void require_not_read(const std::vector<std::filesystem::path>& outputs, const std::vector<std::filesystem::path>& inputs = {});

}  // namespace flexframe::cli
