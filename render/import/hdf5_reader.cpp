#include "render/import/hdf5_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace flexframe::imports {

using sim::InputError;
using sim::hdf5::Id;

Hdf5Reader::Hdf5Reader(const std::filesystem::path& path) : name_(path.string()) {
  H5dont_atexit();
  if (!std::filesystem::is_regular_file(path)) throw InputError(fmt::format("{}: no such file", name_));
  file_ = Id(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file_.valid()) fail(fmt::format("is no HDF5 file that can be read: {}", sim::hdf5::hdf5_reason()));
}

void Hdf5Reader::fail(const std::string& message) const { throw InputError(fmt::format("{}: {}", name_, message)); }

void Hdf5Reader::check_size(const std::string& path, hsize_t count) const {
  // No packing makes a byte into more than about a thousand.
  if (count > 1100 * std::filesystem::file_size(name_)) fail(fmt::format("dataset {} says that it is larger than the file can hold", path));
}

bool Hdf5Reader::has(const std::string& path) const {
  // Every step of the way must be there.
  for (size_t at = path.find('/', 1); at != std::string::npos; at = path.find('/', at + 1))
    if (H5Lexists(file_, path.substr(0, at).c_str(), H5P_DEFAULT) <= 0) return false;
  return H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0;
}

std::vector<std::string> Hdf5Reader::members(const std::string& path) const {
  std::vector<std::string> names;
  if (!has(path)) return names;
  H5Literate_by_name(
      file_, path.c_str(), H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
      },
      &names, H5P_DEFAULT);
  return names;
}

std::vector<double> Hdf5Reader::rows(const std::string& path, hsize_t first, std::int64_t count, hsize_t* width) const {
  const Id set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(fmt::format("lacks the dataset {}", path));
  const Id type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  const int rank = H5Sget_simple_extent_ndims(space);
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || rank < 1 || rank > 2) fail(fmt::format("dataset {} is no table of numbers", path));
  hsize_t dims[2] = {0, 1};
  H5Sget_simple_extent_dims(space, dims, nullptr);
  const hsize_t wanted = count < 0 ? dims[0] - std::min(dims[0], first) : static_cast<hsize_t>(count);
  if (first + wanted > dims[0]) fail(fmt::format("dataset {} has {} rows, {} from row {} on are needed", path, dims[0], wanted, first));
  check_size(
      path, dims[1] > 0 && wanted > std::numeric_limits<hsize_t>::max() / dims[1] ? std::numeric_limits<hsize_t>::max() : wanted * dims[1]);
  std::vector<double> out(wanted * dims[1]);
  if (width) *width = dims[1];
  if (out.empty()) return out;
  const hsize_t start[2] = {first, 0}, extent[2] = {wanted, dims[1]};
  const Id memory(H5Screate_simple(rank, extent, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, extent, nullptr) < 0 ||
      H5Dread(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, out.data()) < 0)
    fail(fmt::format("dataset {} cannot be read: {}", path, sim::hdf5::hdf5_reason()));
  return out;
}
std::string Hdf5Reader::bytes(const std::string& path) const {
  const Id set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(fmt::format("lacks the dataset {}", path));
  const Id type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
  if (H5Tdetect_class(type, H5T_VLEN) > 0 || H5Tis_variable_str(type) > 0) fail(fmt::format("dataset {} has texts of free length", path));
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  const auto size = static_cast<hsize_t>(H5Tget_size(type));
  if (count < 0 || size == 0) fail(fmt::format("dataset {} cannot be read", path));
  check_size(path, static_cast<hsize_t>(count));
  check_size(path, size);
  check_size(path, static_cast<hsize_t>(count) * size);
  std::string out(static_cast<size_t>(count) * size, '\0');
  if (!out.empty() && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out.data()) < 0)
    fail(fmt::format("dataset {} cannot be read: {}", path, sim::hdf5::hdf5_reason()));
  return out;
}

std::string Hdf5Reader::text(const std::string& path, const std::string& name) const {
  const Id attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(fmt::format("lacks the attribute {} of {}", name, path));
  const Id kind(H5Aget_type(attribute), H5Tclose);
  if (H5Tget_class(kind) != H5T_STRING) fail(fmt::format("the attribute {} of {} is no text", name, path));
  if (H5Tis_variable_str(kind) > 0) {
    char* text = nullptr;
    if (H5Aread(attribute, kind, &text) < 0 || !text) fail(fmt::format("the attribute {} of {} cannot be read", name, path));
    std::string out(text);
    H5free_memory(text);
    return out;
  }
  std::string text(std::min<size_t>(H5Tget_size(kind), 1000), '\0');
  if (text.size() < H5Tget_size(kind) || H5Aread(attribute, kind, text.data()) < 0)
    fail(fmt::format("the attribute {} of {} cannot be read", name, path));
  return text.substr(0, std::min(text.find('\0'), text.size()));
}

bool Hdf5Reader::has_attribute(const std::string& path, const std::string& name) const {
  return H5Aexists_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

std::optional<double> Hdf5Reader::attribute(const std::string& path, const std::string& name) const {
  if (!has_attribute(path, name)) return std::nullopt;
  const Id attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  double value = 0.0;
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0)
    return std::nullopt;
  return value;
}

}  // namespace flexframe::imports
