// NumPy archives (.npz): arrays by name.
#pragma once

#include "sim/results/results.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace flexframe::imports {

struct Array {
  std::vector<size_t> shape;
  std::vector<double> values;  // row-major, whatever order the file has
  std::string text;            // of a text without dimensions
};

// All arrays of numbers (float, int, bool, either byte order and order of dimensions) and single texts. Layout: numpy.lib.format, versions
// 1 to 3. Throws sim::InputError naming file and array.
std::map<std::string, Array> read_npz(const std::filesystem::path& path);

// Arrays named as in README.md ("arm.position", ...) to results. unit: m of their lengths. Throws sim::InputError naming the array, its
// shape and the one that is needed.
sim::Results results_of_arrays(const std::map<std::string, Array>& arrays, const std::string& file, double unit);

}  // namespace flexframe::imports
