// Work on files of other programs in a process of its own: their libraries (HDF5, NetCDF, matio, assimp) may be led astray by damage.
#pragma once

#include <filesystem>
#include <functional>
#include <span>

namespace flexframe::cli {

// What work returns, done in a child process; its exceptions end that process as they would end the program. Throws sim::InputError naming
// the files where the child is ended by a signal, or takes more than 20 s of CPU time and a second for each megabyte of them.
int guarded(std::span<const std::filesystem::path> files, const std::function<int()>& work);

}  // namespace flexframe::cli
