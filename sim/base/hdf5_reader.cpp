#include "sim/base/hdf5_reader.h"

#include "sim/base/files_read.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace flexframe::sim::hdf5 {
namespace {

constexpr std::size_t longest_string = 16u << 20;
constexpr char checked_format = 3;  // version of the superblock of files whose metadata all have checksums

}  // namespace

// The innermost reason of HDF5's error stack, such as "No space left on device".
std::string hdf5_reason() {
  std::string reason;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_DOWNWARD,
      [](unsigned, const H5E_error2_t* entry, void* out) -> herr_t {
        if (entry->desc && *entry->desc) *static_cast<std::string*>(out) = entry->desc;
        return 0;
      },
      &reason);
  const std::size_t at = reason.find("error message = '");
  if (at != std::string::npos) {
    const std::size_t from = at + std::strlen("error message = '");
    reason = reason.substr(from, reason.find('\'', from) - from);
  }
  return reason.empty() ? "unknown reason" : reason;
}

void Reader::fail(const std::string& object, const std::string& message) const {
  throw InputError(fmt::format("{}: {}: {}", name_, object, message));
}

Id Reader::open_file() const {
  std::error_code error;
  const auto status = std::filesystem::status(name_, error);
  if (status.type() == std::filesystem::file_type::not_found) throw InputError(fmt::format("{}: no such file", name_));
  if (std::filesystem::is_directory(status)) throw InputError(fmt::format("{}: is a directory; {} is expected", name_, kind_));
  if (!std::filesystem::is_regular_file(status)) throw InputError(fmt::format("{}: cannot be read: it is no regular file", name_));
  note_file_read(name_);
  std::ifstream bytes(name_, std::ios::binary);
  if (!bytes) throw InputError(fmt::format("{}: cannot be read: {}", name_, std::strerror(errno)));
  char start[9] = {};
  bytes.read(start, sizeof start);
  require_whole(bytes, name_);
  if (bytes.gcount() != sizeof start || std::memcmp(start, "\x89HDF\r\n\x1a\n", 8) != 0)
    throw InputError(fmt::format("{}: is no HDF5 file; {} of flexframe is expected", name_, kind_));
  if (start[8] != checked_format)
    throw InputError(
        fmt::format("{}: has one of HDF5's older formats, without checksums, which are not read; write format 1.10, in h5py File(name, "
                    "\"w\", libver=\"v110\")",
                    name_));
  if (holds_global_heap(bytes))
    throw InputError(
        fmt::format("{}: holds data of variable length (an HDF5 global heap), which is not read; write strings with a fixed length, in "
                    "h5py as numpy.bytes_(\"text\")",
                    name_));
  require_whole(bytes, name_);  // all of it was read
  Id file(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.valid()) throw InputError(fmt::format("{}: cannot be opened (damaged or cut short?): {}", name_, hdf5_reason()));
  // What holds_global_heap looks for has sizes of 8 bytes.
  const Id creation(H5Fget_create_plist(file), H5Pclose);
  std::size_t address_bytes = 0, size_bytes = 0;
  if (!creation.valid() || H5Pget_sizes(creation, &address_bytes, &size_bytes) < 0 || address_bytes != 8 || size_bytes != 8)
    throw InputError(fmt::format("{}: has addresses and sizes of {} and {} bytes; 8 are expected", name_, address_bytes, size_bytes));
  return file;
}

bool Reader::has(hid_t parent, const std::string& name) const {
  H5L_info_t link{};
  return H5Lexists(parent, name.c_str(), H5P_DEFAULT) > 0 && H5Lget_info(parent, name.c_str(), &link, H5P_DEFAULT) >= 0 &&
         link.type == H5L_TYPE_HARD && H5Oexists_by_name(parent, name.c_str(), H5P_DEFAULT) > 0;
}

Id Reader::group(hid_t parent, const std::string& name, const std::string& path) const {
  if (!has(parent, name)) fail(fmt::format("group '{}'", path), "is missing");
  Id group(H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose);
  if (!group.valid()) fail(fmt::format("group '{}'", path), "is no group, or damaged");
  return group;
}

std::vector<std::string> Reader::group_names(hid_t parent, const std::string& path) const {
  struct Found {
    std::vector<std::string> names;
    bool too_many = false;
  } found;
  const herr_t status = H5Literate(
      parent, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        auto& list = *static_cast<Found*>(out);
        if (list.names.size() >= 1'000'000) {
          list.too_many = true;
          return 1;
        }
        list.names.emplace_back(name);
        return 0;
      },
      &found);
  if (status < 0 || found.too_many) fail(fmt::format("group '{}'", path), "cannot be listed (damaged?)");
  return std::move(found.names);
}

std::vector<std::string> Reader::texts_of(hid_t id, const Id& type, const Id& space, bool attribute, const std::string& object) const {
  if (!type.valid() || !space.valid() || H5Tget_class(type) != H5T_STRING) fail(object, "must be text");
  if (H5Tis_variable_str(type) != 0) fail(object, "must be text of fixed length");
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 0 || count > 1'000'000) fail(object, "has too many entries");
  std::vector<std::string> texts;
  if (count == 0) return texts;
  Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_cset(memory, H5Tget_cset(type));
  const std::size_t length = H5Tget_size(type);
  if (length == 0 || length > longest_string || length * count > 16 * longest_string) fail(object, "has strings that are too long");
  H5Tset_size(memory, length);
  H5Tset_strpad(memory, H5Tget_strpad(type));
  std::string packed(length * count, '\0');
  const herr_t status = attribute ? H5Aread(id, memory, packed.data()) : H5Dread(id, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, packed.data());
  if (status < 0) fail(object, "cannot be read (damaged?): " + hdf5_reason());
  const bool blanks = H5Tget_strpad(type) == H5T_STR_SPACEPAD;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    std::string text = packed.substr(i * length, length);
    text.resize(std::min(text.find('\0'), text.size()));
    while (blanks && !text.empty() && text.back() == ' ') text.pop_back();
    texts.push_back(std::move(text));
  }
  return texts;
}

Id Reader::open_attribute(hid_t object, const std::string& name, const std::string& label, bool optional) const {
  if (H5Aexists(object, name.c_str()) <= 0) {
    if (optional) return {};
    fail(label, "is missing");
  }
  Id attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(label, "cannot be read (damaged?)");
  return attribute;
}

std::string Reader::text(hid_t object, const std::string& name, const std::string& path, std::optional<std::string> otherwise) const {
  const std::string label = fmt::format("attribute '{}' of '{}'", name, path);
  const Id attribute = open_attribute(object, name, label, otherwise.has_value());
  if (!attribute.valid()) return *otherwise;
  const auto found = texts_of(attribute, Id(H5Aget_type(attribute), H5Tclose), Id(H5Aget_space(attribute), H5Sclose), true, label);
  if (found.size() != 1) fail(label, "must be one string");
  return found[0];
}

double Reader::number(hid_t object, const std::string& name, const std::string& path, std::optional<double> otherwise) const {
  const std::string label = fmt::format("attribute '{}' of '{}'", name, path);
  const Id attribute = open_attribute(object, name, label, otherwise.has_value());
  if (!attribute.valid()) return *otherwise;
  const Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (!plain_number(type) || H5Sget_simple_extent_npoints(space) != 1) fail(label, "must be one number");
  double value = 0.0;
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0) fail(label, "cannot be read (damaged?)");
  if (!std::isfinite(value)) fail(label, "is not finite");
  return value;
}

long Reader::count(hid_t object, const std::string& name, const std::string& path) const {
  const double value = number(object, name, path, 0.0);
  return std::abs(value) < 9e18 ? static_cast<long>(value) : 0;
}

bool Reader::plain_number(hid_t type) {
  const hid_t usual[] = {H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_IEEE_F64BE, H5T_IEEE_F32BE, H5T_STD_I64LE, H5T_STD_I32LE, H5T_STD_I16LE,
                         H5T_STD_I8LE,   H5T_STD_U64LE,  H5T_STD_U32LE,  H5T_STD_U16LE,  H5T_STD_U8LE,  H5T_STD_I64BE, H5T_STD_I32BE,
                         H5T_STD_I16BE,  H5T_STD_I8BE,   H5T_STD_U64BE,  H5T_STD_U32BE,  H5T_STD_U16BE, H5T_STD_U8BE};
  return type >= 0 && std::any_of(std::begin(usual), std::end(usual), [&](hid_t known) { return H5Tequal(type, known) > 0; });
}

Id Reader::dataset(hid_t parent, const std::string& name, const std::string& label) const {
  Id set(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(label, "is no dataset, or damaged");
  const Id creation(H5Dget_create_plist(set), H5Pclose);
  if (!creation.valid()) fail(label, "cannot be read (damaged?): " + hdf5_reason());
  if (H5Pget_external_count(creation) != 0 || H5Pget_layout(creation) == H5D_VIRTUAL)
    fail(label, "lies in another file, which is not read");
  const int filters = H5Pget_nfilters(creation);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter = H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &values, nullptr, 0, nullptr, &config);
    if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_FLETCHER32)
      fail(label, fmt::format("is packed by HDF5's filter {}; only deflate, shuffle and fletcher32 are read", filter));
  }
  return set;
}

std::vector<std::string> Reader::texts(hid_t parent, const std::string& name, const std::string& path) const {
  const std::string label = fmt::format("dataset '{}{}'", path, name);
  if (!has(parent, name)) return {};
  const Id set = dataset(parent, name, label);
  return texts_of(set, Id(H5Dget_type(set), H5Tclose), Id(H5Dget_space(set), H5Sclose), false, label);
}

MatX Reader::numbers(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape, bool optional,
                     std::vector<hsize_t>* dims_out) const {
  return read_numbers<MatX>(parent, name, path, shape, optional, dims_out);
}

RowsX Reader::rows(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape, bool optional) const {
  return read_numbers<RowsX>(parent, name, path, shape, optional, nullptr);
}

template <class Values>
Values Reader::read_numbers(hid_t parent, const std::string& name, const std::string& path, const std::vector<hsize_t>& shape,
                            bool optional, std::vector<hsize_t>* dims_out) const {
  const std::string label = fmt::format("dataset '{}{}'", path, name);
  if (!has(parent, name)) {
    if (optional) return {};
    fail(label, "is missing");
  }
  const Id set = dataset(parent, name, label);
  const Id type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
  if (!plain_number(type)) fail(label, "must hold numbers (of 32 or 64 bits, or whole)");

  // shape
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 0 || rank > H5S_MAX_RANK) fail(label, "has no shape (damaged?)");
  std::vector<hsize_t> dims(rank);
  if (rank > 0) H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  bool same = dims.size() == shape.size();
  for (std::size_t i = 0; same && i < dims.size(); ++i) same = shape[i] == any || shape[i] == dims[i];
  if (!same) fail(label, fmt::format("must be {}, found {}", shape_text(shape), shape_text(dims)));
  double values_held = 1.0;
  for (const hsize_t extent : dims) values_held *= static_cast<double>(extent);
  if (dims_out) *dims_out = dims;
  if (values_held == 0.0) return {};
  // a few bytes may claim any shape; even deflate packs no more than a thousand to one
  if (values_held * sizeof(double) > 1100.0 * 8.0 * static_cast<double>(H5Dget_storage_size(set)))
    fail(label, fmt::format("claims {:.3g} values but holds {} bytes", values_held, H5Dget_storage_size(set)));

  // blocks of rows
  hsize_t cols = 1;
  for (std::size_t i = 1; i < dims.size(); ++i) cols *= dims[i];
  Values values(static_cast<Eigen::Index>(dims[0]), static_cast<Eigen::Index>(cols));
  const hsize_t block = std::clamp<hsize_t>(4 * chunk_bytes / (cols * sizeof(double)), 1, dims[0]);
  RowsX block_rows;
  for (hsize_t first = 0; first < dims[0]; first += block) {
    const hsize_t count = std::min(block, dims[0] - first);
    auto part = values.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count));
    double* numbers = part.data();
    if constexpr (!Values::IsRowMajor) {
      block_rows.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(cols));
      numbers = block_rows.data();
    }
    std::vector<hsize_t> start(dims.size(), 0), extent = dims;
    start[0] = first;
    extent[0] = count;
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr);
    const Id memory(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose);
    if (H5Dread(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, numbers) < 0)
      fail(label, "cannot be read (damaged or cut short?): " + hdf5_reason());
    if constexpr (!Values::IsRowMajor) part = block_rows;
    if (!part.allFinite()) {
      for (Eigen::Index i = 0; i < part.rows(); ++i)
        if (!part.row(i).allFinite())
          fail(label, fmt::format("holds a value that is not finite in row {}", first + static_cast<hsize_t>(i)));
    }
  }
  return values;
}

std::string Reader::shape_text(const std::vector<hsize_t>& shape) {
  std::string text;
  for (const hsize_t extent : shape) text += (text.empty() ? "" : " x ") + (extent == any ? std::string("n") : fmt::format("{}", extent));
  return text.empty() ? "one number" : text;
}

bool Reader::holds_global_heap(std::ifstream& file) {
  constexpr std::string_view mark("GCOL\1", 5);
  constexpr std::size_t head = 16;
  file.seekg(0, std::ios::end);
  const auto length = static_cast<std::uint64_t>(std::max<std::streamoff>(file.tellg(), 0));
  file.seekg(0);
  std::string block(std::min<std::size_t>(length + head, 1u << 20), '\0');
  std::size_t kept = 0;
  while (file) {
    file.read(block.data() + kept, static_cast<std::streamsize>(block.size() - kept));
    const std::string_view bytes(block.data(), kept + file.gcount());
    for (std::size_t at = bytes.find(mark); at != std::string_view::npos && at + head <= bytes.size(); at = bytes.find(mark, at + 1)) {
      std::uint64_t size = 0;
      for (std::size_t k = 8; k-- > 0;) size = size << 8 | static_cast<unsigned char>(bytes[at + 8 + k]);
      // By chance alone: once in 2^70 bytes.
      if (size <= length) return true;
    }
    kept = std::min(bytes.size(), head - 1);
    std::memmove(block.data(), bytes.data() + bytes.size() - kept, kept);
  }
  return false;
}

}  // namespace flexframe::sim::hdf5
