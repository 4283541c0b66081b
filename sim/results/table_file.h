// Tables of numbers and texts as HDF5.
#pragma once

#include "sim/base/types.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

// Data sets of one dimension, in groups ("a" or "a/b") by name.
struct TableFile {
  struct Numbers {
    std::string group, name;
    VecX values;  // finite
    std::string meaning;
  };
  struct Texts {
    std::string group, name;
    std::vector<std::string> values;
    std::string meaning;
  };
  std::vector<std::pair<std::string, std::string>> attributes;  // of the file
  std::vector<Numbers> numbers;
  std::vector<Texts> texts;
};

// Written whole or not at all; data sets without values are left out. Throws SimulationError for a number that is not finite, FileError.
void write_table_file(const TableFile& table, const std::filesystem::path& path);

}  // namespace flexframe::sim
