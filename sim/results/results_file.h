// Results on disk: one self-describing HDF5 file (layout: sim/RESULTS.md), and histories as CSV.
// Files appear under their final name whole or not at all: they are written beside it and renamed.
#pragma once

#include "sim/results/results.h"

#include <filesystem>

namespace flexframe::sim {

// Throws FileError naming the path when it cannot be written (no folder, full disk, ...), SimulationError for results
// that hold NaN or disagree in size.
void write_results(const Results& results, const std::filesystem::path& path);

// Checks every dataset's shape and values. Throws InputError "FILE: dataset '/times': ...".
Results read_results(const std::filesystem::path& path);

}  // namespace flexframe::sim
