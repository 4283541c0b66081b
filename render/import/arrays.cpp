#include "render/import/arrays.h"

#include "sim/base/late_library.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string_view>

namespace flexframe::imports {
namespace {

using sim::InputError;

constexpr std::uint64_t most_bytes = std::uint64_t{8} << 30;

// libzip's functions; it is opened with the first archive.
struct LibZip : sim::LateLibrary {
  LibZip() : LateLibrary(FLEXFRAME_LIBZIP_FILE, "NumPy archives (libzip)") {}
  decltype(&zip_discard) discard = function("zip_discard");
  decltype(&zip_fclose) close = function("zip_fclose");
  decltype(&zip_fopen_index) open_member = function("zip_fopen_index");
  decltype(&zip_fread) read = function("zip_fread");
  decltype(&zip_get_num_entries) count = function("zip_get_num_entries");
  decltype(&zip_open) open = function("zip_open");
  decltype(&zip_stat_index) stat = function("zip_stat_index");
  decltype(&zip_strerror) error = function("zip_strerror");
};
const LibZip& libzip() {
  static const LibZip library;
  return library;
}

struct Closer {
  void operator()(zip_t* archive) const { libzip().discard(archive); }
  void operator()(zip_file_t* file) const { libzip().close(file); }
};

// One member of the archive, unpacked; its checksum is looked at by libzip.
std::string read_member(zip_t* archive, zip_uint64_t index, std::uint64_t size, const std::string& where) {
  const std::unique_ptr<zip_file_t, Closer> file(libzip().open_member(archive, index, 0));
  if (!file) throw InputError(fmt::format("{}: cannot be unpacked: {}", where, libzip().error(archive)));
  if (size > most_bytes) throw InputError(fmt::format("{}: has {} bytes, more than {} are not read", where, size, most_bytes));
  std::string bytes(size, '\0');
  if (libzip().read(file.get(), bytes.data(), size) != static_cast<zip_int64_t>(size) || libzip().read(file.get(), &bytes, 0) != 0)
    throw InputError(fmt::format("{}: is damaged", where));
  char rest = 0;
  if (libzip().read(file.get(), &rest, 1) != 0) throw InputError(fmt::format("{}: is damaged (its checksum does not fit)", where));
  return bytes;
}

// The value behind 'KEY': in the text of a Python dictionary.
std::string_view dictionary_value(std::string_view text, std::string_view key) {
  const auto at = text.find(fmt::format("'{}':", key));
  if (at == text.npos) return {};
  text.remove_prefix(at + key.size() + 3);
  const auto begin = text.find_first_not_of(' ');
  if (begin == text.npos) return {};
  text.remove_prefix(begin);
  const auto end = text[0] == '(' ? text.find(')') : text[0] == '\'' ? text.find('\'', 1) : text.find_first_of(",}");
  return end == text.npos ? std::string_view() : text.substr(0, text[0] == '(' || text[0] == '\'' ? end + 1 : end);
}

template <class T>
void convert(const std::string& bytes, size_t from, bool swapped, std::vector<double>& out) {
  for (size_t i = 0; i < out.size(); ++i) {
    char one[sizeof(T)];
    std::memcpy(one, bytes.data() + from + i * sizeof(T), sizeof(T));
    if (swapped) std::reverse(std::begin(one), std::end(one));
    T value;
    std::memcpy(&value, one, sizeof(T));
    out[i] = static_cast<double>(value);
  }
}

// Letters of a text without dimensions: bytes (S) or UTF-32 (U).
std::string convert_text(const std::string& bytes, size_t from, char kind, bool swapped) {
  std::string text;
  const size_t width = kind == 'U' ? 4 : 1;
  for (size_t at = from; at + width <= bytes.size(); at += width) {
    std::uint32_t letter = 0;
    for (size_t k = 0; k < width; ++k)
      letter |= std::uint32_t{static_cast<unsigned char>(bytes[at + (swapped ? width - 1 - k : k)])} << 8 * k;
    if (letter == 0) break;
    if (letter < 0x80) text += static_cast<char>(letter);
    else if (letter < 0x800) text += {static_cast<char>(0xC0 | letter >> 6), static_cast<char>(0x80 | (letter & 63))};
    else
      text += {static_cast<char>(0xE0 | (letter >> 12 & 15)), static_cast<char>(0x80 | (letter >> 6 & 63)),
               static_cast<char>(0x80 | (letter & 63))};
  }
  return text;
}

// Column by column to row by row.
void to_rows(Array& array) {
  const std::vector<double> from = array.values;
  const size_t n = array.shape.size();
  std::vector<size_t> at(n, 0);
  for (const double value : from) {
    size_t place = 0;
    for (size_t k = 0; k < n; ++k) place = place * array.shape[k] + at[k];
    array.values[place] = value;
    for (size_t k = 0; k < n && ++at[k] == array.shape[k]; ++k) at[k] = 0;
  }
}

Array read_npy(const std::string& bytes, const std::string& where) {
  const auto fail = [&](const std::string& message) { throw InputError(fmt::format("{}: {}", where, message)); };
  if (bytes.size() < 12 || bytes.compare(0, 6, "\x93NUMPY") != 0) fail("is no NumPy array");
  const bool short_header = bytes[6] == 1;
  size_t length = 0;
  for (size_t k = 0; k < (short_header ? 2u : 4u); ++k) length |= size_t{static_cast<unsigned char>(bytes[8 + k])} << 8 * k;
  const size_t from = (short_header ? 10 : 12) + length;
  if (from > bytes.size()) fail("ends in its header");
  const std::string_view header = std::string_view(bytes).substr(short_header ? 10 : 12, length);
  const std::string_view type = dictionary_value(header, "descr"), shape = dictionary_value(header, "shape"),
                         order = dictionary_value(header, "fortran_order");
  if (type.size() < 4 || shape.empty() || order.empty()) fail("has a header without descr, shape or fortran_order (a structured array?)");
  Array array;
  std::uint64_t count = 1;
  for (size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] < '0' || shape[i] > '9') continue;
    std::uint64_t dimension = 0;
    for (; i < shape.size() && shape[i] >= '0' && shape[i] <= '9'; ++i)
      dimension = std::min(most_bytes, 10 * dimension + static_cast<std::uint64_t>(shape[i] - '0'));
    array.shape.push_back(dimension);
    count = dimension > 0 && count > most_bytes / dimension ? most_bytes : count * dimension;
  }
  const bool swapped = type[1] == '>';
  const char kind = type[2];
  size_t width = 0;
  for (size_t k = 3; k + 1 < type.size() && type[k] >= '0' && type[k] <= '9'; ++k) width = 10 * width + static_cast<size_t>(type[k] - '0');
  if ((kind == 'U' || kind == 'S') && array.shape.empty()) {
    array.text = convert_text(bytes, from, kind, swapped);
    return array;
  }
  if (width == 0 || width > 8 || (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b'))
    fail(fmt::format("holds {}; numbers are needed (float, int)", sim::quote(type)));
  if (count * width != bytes.size() - from) fail(fmt::format("has {} bytes of data for {} numbers", bytes.size() - from, count));
  array.values.resize(count);
  if (kind == 'f' && width == 8) convert<double>(bytes, from, swapped, array.values);
  else if (kind == 'f' && width == 4) convert<float>(bytes, from, swapped, array.values);
  else if (kind == 'i' && width == 8) convert<std::int64_t>(bytes, from, swapped, array.values);
  else if (kind == 'i' && width == 4) convert<std::int32_t>(bytes, from, swapped, array.values);
  else if (kind == 'i' && width == 2) convert<std::int16_t>(bytes, from, swapped, array.values);
  else if (kind == 'i' && width == 1) convert<std::int8_t>(bytes, from, swapped, array.values);
  else if (kind == 'u' && width == 8) convert<std::uint64_t>(bytes, from, swapped, array.values);
  else if (kind == 'u' && width == 4) convert<std::uint32_t>(bytes, from, swapped, array.values);
  else if (kind == 'u' && width == 2) convert<std::uint16_t>(bytes, from, swapped, array.values);
  else if (width == 1) convert<std::uint8_t>(bytes, from, swapped, array.values);
  else fail(fmt::format("holds {}; numbers of 32 or 64 bits are needed", sim::quote(type)));
  if (order.starts_with("True")) to_rows(array);
  return array;
}

}  // namespace

std::map<std::string, Array> read_npz(const std::filesystem::path& path) {
  int error = 0;
  const std::unique_ptr<zip_t, Closer> archive(libzip().open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &error));
  if (!archive) throw InputError(fmt::format("{}: is no NumPy archive (numpy.savez), or a damaged one", path.string()));
  std::map<std::string, Array> arrays;
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(libzip().count(archive.get(), 0)); ++i) {
    zip_stat_t stat;
    if (libzip().stat(archive.get(), i, 0, &stat) != 0 || !(stat.valid & ZIP_STAT_NAME) || !(stat.valid & ZIP_STAT_SIZE))
      throw InputError(fmt::format("{}: member {} cannot be read", path.string(), i));
    std::string name = stat.name;
    if (!name.ends_with(".npy")) continue;
    name.resize(name.size() - 4);
    const std::string where = fmt::format("{}: array '{}'", path.string(), name);
    arrays[name] = read_npy(read_member(archive.get(), i, stat.size, where), where);
  }
  if (arrays.empty()) throw InputError(fmt::format("{}: holds no arrays", path.string()));
  return arrays;
}

}  // namespace flexframe::imports
