// HDF5 as the files of this project need it (results, tables, bodies); the one place that includes the library.
//
// Metadata carry checksums (format 1.10), data blocks Fletcher's, strings have a fixed
// length: a damaged file is found, not followed. HDF5 1.10 itself follows what has no checksum: damaged metadata of older formats, read
// beyond their end, and the global heaps of variable-length data, where it can loop for ever. Files with either are refused before it sees
// them.
#pragma once

#include "sim/base/types.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <hdf5.h>

namespace flexframe::sim::hdf5 {

constexpr std::size_t chunk_bytes = 256u << 10;

// HDF5 prints its error stack unless told not to; restores the caller's setting.
class Quiet {
 public:
  Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

// Owns an identifier.
class Id {
 public:
  Id() = default;
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Id(Id&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Id& operator=(Id&& other) noexcept {
    reset();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }
  ~Id() { reset(); }
  operator hid_t() const { return id_; }
  bool valid() const { return id_ >= 0; }
  bool reset() {
    const hid_t id = std::exchange(id_, -1);
    return id < 0 || close_(id) >= 0;
  }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

// The innermost reason of HDF5's error stack, such as "No space left on device".
std::string hdf5_reason();

// ---- Writing. What HDF5 refuses is thrown as WriteFailure; write_hdf5 makes a FileError of it.
struct WriteFailure {
  std::string reason = hdf5_reason();  // now: the next call of HDF5 clears it
};
hid_t done(hid_t id);
void check(herr_t status);
void write_attribute(hid_t object, const std::string& name, const std::string& text);
void write_attribute(hid_t object, const std::string& name, double value);
void write_attribute(hid_t object, const std::string& name, long value);
// A list of texts as an attribute of a dataset of `parent`; nothing where there are none.
void write_attribute(hid_t parent, const std::string& dataset, const std::string& name, const std::vector<std::string>& texts);
Id make_group(hid_t parent, const std::string& name);
// rows x (cols of any shape): dims[0] = values.rows(), the product of the others = values.cols(). Nothing where there are no values.
void write_numbers(hid_t parent, const std::string& name, const Eigen::Ref<const MatX>& values, std::vector<hsize_t> dims,
                   const std::string& unit, const std::string& meaning);
void write_rows(hid_t parent, const std::string& name, const RowsX& values, const std::vector<hsize_t>& dims, const std::string& unit,
                const std::string& meaning);
void write_texts(hid_t parent, const std::string& name, const std::vector<std::string>& texts);

// `parts` nn x n (a node's x y z, or its stresses, below each other) as nn rows of `parts` n, and back.
MatX node_rows(const MatX& shapes, Eigen::Index parts = 3);
MatX node_columns(const MatX& rows, Eigen::Index parts = 3);

// A new file, whole or not at all: `write` fills it. Throws FileError.
void write_hdf5(const std::filesystem::path& path, const std::function<void(hid_t file)>& write);

}  // namespace flexframe::sim::hdf5
