// Groups, texts and arrays of an HDF5 file that may be damaged or foreign.
#pragma once

#include "sim/base/error.h"
#include "sim/base/hdf5_file.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace flexframe::sim::hdf5 {

// Reading: every error names the file and the object.
class Reader {
 public:
  // kind: what the file is to be, for messages ("a results file").
  Reader(const std::filesystem::path& path, std::string kind) : name_(path.string()), kind_(std::move(kind)) {}
  [[noreturn]] void fail(const std::string& object, const std::string& message) const;
  Id open_file() const;
  // A link to another file, or one by name, is none: nothing beyond the file is opened.
  bool has(hid_t parent, const std::string& name) const;
  Id group(hid_t parent, const std::string& name, const std::string& path) const;
  std::vector<std::string> group_names(hid_t parent, const std::string& path) const;
  // Strings of fixed length.
  std::vector<std::string> texts_of(hid_t id, const Id& type, const Id& space, bool attribute, const std::string& object) const;
  std::string text(hid_t object, const std::string& name, const std::string& path, std::optional<std::string> otherwise) const;
  double number(hid_t object, const std::string& name, const std::string& path, std::optional<double> otherwise) const;
  long count(hid_t object, const std::string& name, const std::string& path) const;
  // HDF5 converts what a type's bits are said to mean without checking that they lie in the number: only the usual types are let through.
  static bool plain_number(hid_t type);
  // A dataset whose values lie in this file, plain or packed by the filters that HDF5 always has.
  Id dataset(hid_t parent, const std::string& name, const std::string& label) const;
  std::vector<std::string> texts(hid_t parent, const std::string& name, const std::string& path) const;
  static constexpr hsize_t any = std::numeric_limits<hsize_t>::max();
  // A dataset of numbers as rows x (product of the other dimensions). `shape`: the expected one, `any` where free; `dims` tells the
  // found one.
  MatX numbers(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape, bool optional,
               std::vector<hsize_t>* dims_out = nullptr) const;
  RowsX rows(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape, bool optional) const;
  static std::string shape_text(const std::vector<hsize_t>& shape);

 private:
  template <class Values>
  Values read_numbers(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape, bool optional,
                      std::vector<hsize_t>* dims_out) const;
  // Whether the file's bytes contain the head of a global heap's collection: "GCOL", version 1, three bytes of any value, its size.
  static bool holds_global_heap(std::ifstream& file);
  // Not valid: there is none, which is all right where it is optional.
  Id open_attribute(hid_t object, const std::string& name, const std::string& label, bool optional) const;
  std::string name_, kind_;
};

}  // namespace flexframe::sim::hdf5
