// HDF5 files of other programs: what stands where, as numbers and texts.
#pragma once

#include "sim/base/hdf5_file.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::imports {

// A file open for reading. Every function throws sim::InputError with the file's name.
class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::filesystem::path& path);
  [[noreturn]] void fail(const std::string& message) const;

  // Whether there is a group or dataset of this path; every step of the way is looked for.
  bool has(const std::string& path) const;
  // Names in a group, in their order; none where there is no such group.
  std::vector<std::string> members(const std::string& path) const;
  // Rows first ... first + count of a dataset as numbers; count < 0: all. width: numbers a row.
  std::vector<double> rows(const std::string& path, hsize_t first, std::int64_t count, hsize_t* width = nullptr) const;
  double number(const std::string& path, hsize_t row) const { return rows(path, row, 1).front(); }
  // A dataset's bytes as they stand in the file: texts.
  std::string bytes(const std::string& path) const;
  bool has_attribute(const std::string& path, const std::string& name) const;
  // Attributes of a group or dataset: a text (which must be there), a number.
  std::string text(const std::string& path, const std::string& name) const;
  std::optional<double> attribute(const std::string& path, const std::string& name) const;

 private:
  // Throws where a dataset says that it has more bytes than any packing could have made of the file.
  void check_size(const std::string& path, hsize_t count) const;

  std::unique_ptr<sim::hdf5::Quiet> quiet_ = std::make_unique<sim::hdf5::Quiet>();  // what goes wrong is told in sentences
  std::string name_;
  sim::hdf5::Id file_;
};

}  // namespace flexframe::imports
