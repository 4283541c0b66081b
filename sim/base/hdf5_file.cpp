#include "sim/base/hdf5_file.h"

#include "sim/base/error.h"
#include "sim/base/file_output.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include <fmt/format.h>

namespace flexframe::sim::hdf5 {

hid_t done(hid_t id) {
  if (id < 0) throw WriteFailure{};
  return id;
}
void check(herr_t status) {
  if (status < 0) throw WriteFailure{};
}

namespace {

Id text_type(std::size_t length) {
  Id type(done(H5Tcopy(H5T_C_S1)), H5Tclose);
  check(H5Tset_size(type, std::max<std::size_t>(1, length)));
  check(H5Tset_cset(type, H5T_CSET_UTF8));
  check(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return type;
}

}  // namespace

void write_attribute(hid_t object, const std::string& name, const std::string& text) {
  const Id type = text_type(text.size()), space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const Id attribute(done(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, type, text.empty() ? "\0" : text.data()));
}

void write_attribute(hid_t object, const std::string& name, double value) {
  const Id space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const Id attribute(done(H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value));
}

void write_attribute(hid_t object, const std::string& name, long value) {
  const Id space(done(H5Screate(H5S_SCALAR)), H5Sclose);
  const Id attribute(done(H5Acreate2(object, name.c_str(), H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, H5T_NATIVE_LONG, &value));
}

Id make_group(hid_t parent, const std::string& name) {
  return {done(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Gclose};
}

namespace {

// HDF5's filter fletcher32: sums of words of 16 bits, and of these sums, in ones' complement. Its own takes half of the time in which a
// file is written, one word after the other; these are the same sums, eight words at once.
std::uint32_t fletcher32(const std::vector<double>& numbers) {
  using Words __attribute__((vector_size(16))) = std::uint16_t;
  using Sums __attribute__((vector_size(32))) = std::uint32_t;
  constexpr std::size_t lanes = 8, rounds = 256;  // no sum leaves 32 bits
  constexpr std::uint64_t ones = 65535;
  const auto* bytes = reinterpret_cast<const unsigned char*>(numbers.data());
  const std::size_t all = numbers.size() * sizeof(double) / 2;
  std::uint64_t sum = 0, of_sums = 0;
  bool any = false;
  std::uint16_t word[lanes * rounds];
  for (std::size_t first = 0; first < all; first += lanes * rounds) {
    const std::size_t words = std::min(lanes * rounds, all - first), count = (words + lanes - 1) / lanes;
    std::memcpy(word, bytes + 2 * first, 2 * words);
    std::fill(word + words, word + count * lanes, std::uint16_t{0});
    Sums plain{}, running{};
    for (std::size_t k = 0; k < count; ++k) {
      Words at;
      std::memcpy(&at, word + lanes * k, sizeof(at));
      plain += __builtin_convertvector(at, Sums);
      running += plain;
    }
    // Word k of lane i counts words - (lanes k + i) times, running has it count - k times.
    const std::uint64_t beyond = lanes * count - words;
    std::uint64_t here = 0, weighted = 0;
    for (std::size_t i = 0; i < lanes; ++i) {
      here += plain[i];
      weighted += lanes * std::uint64_t{running[i]} - (i + beyond) * plain[i];
    }
    any = any || here > 0;
    of_sums = (of_sums + words * sum + weighted) % ones;
    sum = (sum + here) % ones;
  }
  // Its words have the high byte first: 256 times these, for 2^16 is 1 here. Zero is only what is all zeros.
  const auto folded = [&](std::uint64_t s) { return static_cast<std::uint32_t>(any && s == 0 ? ones : s); };
  return folded(256 * of_sums % ones) << 16 | folded(256 * sum % ones);
}

// A chunk at a time, row by row: as HDF5 would write it, past its own copies.
template <class Values>
void write_chunks(hid_t parent, const std::string& name, const Values& values, const std::vector<hsize_t>& dims, const std::string& unit,
                  const std::string& meaning) {
  static_assert(std::endian::native == std::endian::little, "chunks are written as they lie in memory");
  if (values.size() == 0) return;
  const std::size_t row_bytes = values.cols() * sizeof(double);
  const auto block = static_cast<hsize_t>(std::clamp<std::size_t>(chunk_bytes / row_bytes, 1, static_cast<std::size_t>(values.rows())));
  const Id space(done(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr)), H5Sclose);
  const Id creation(done(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  std::vector<hsize_t> chunk = dims;
  chunk[0] = block;
  check(H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data()));
  check(H5Pset_fletcher32(creation));
  const Id set(done(H5Dcreate2(parent, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT)), H5Dclose);
  if (!unit.empty()) write_attribute(set, "unit", unit);
  write_attribute(set, "meaning", meaning);

  std::vector<hsize_t> start(dims.size(), 0);
  const std::size_t size = static_cast<std::size_t>(block) * static_cast<std::size_t>(values.cols());
  std::vector<double> numbers(size);
  std::vector<unsigned char> bytes(size * sizeof(double) + 4);
  for (start[0] = 0; start[0] < dims[0]; start[0] += block) {
    const auto count = static_cast<Eigen::Index>(std::min(block, dims[0] - start[0]));
    Eigen::Map<RowsX> rows(numbers.data(), static_cast<Eigen::Index>(block), values.cols());
    rows.topRows(count) = values.middleRows(static_cast<Eigen::Index>(start[0]), count);
    rows.bottomRows(rows.rows() - count).setZero();
    std::memcpy(bytes.data(), numbers.data(), size * sizeof(double));
    const std::uint32_t sums = fletcher32(numbers);
    for (std::size_t k = 0; k < 4; ++k) bytes[size * sizeof(double) + k] = static_cast<unsigned char>(sums >> 8 * k);
    check(H5Dwrite_chunk(set, H5P_DEFAULT, 0, start.data(), bytes.size(), bytes.data()));
  }
}

}  // namespace

void write_numbers(hid_t parent, const std::string& name, const Eigen::Ref<const MatX>& values, std::vector<hsize_t> dims,
                   const std::string& unit, const std::string& meaning) {
  write_chunks(parent, name, values, dims, unit, meaning);
}

void write_rows(hid_t parent, const std::string& name, const RowsX& values, const std::vector<hsize_t>& dims, const std::string& unit,
                const std::string& meaning) {
  write_chunks(parent, name, values, dims, unit, meaning);
}

namespace {

// Texts one behind the other, each as long as the longest.
struct PackedTexts {
  explicit PackedTexts(const std::vector<std::string>& texts) {
    for (const std::string& text : texts) longest = std::max(longest, text.size());
    packed.resize(longest * texts.size(), '\0');
    for (std::size_t i = 0; i < texts.size(); ++i)
      std::copy(texts[i].begin(), texts[i].end(), packed.begin() + static_cast<std::ptrdiff_t>(i * longest));
  }
  std::size_t longest = 1;
  std::string packed;
};

}  // namespace

void write_texts(hid_t parent, const std::string& name, const std::vector<std::string>& texts) {
  if (texts.empty()) return;
  const PackedTexts all(texts);
  const hsize_t count = texts.size();
  const Id type = text_type(all.longest), space(done(H5Screate_simple(1, &count, nullptr)), H5Sclose);
  const Id set(done(H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)), H5Dclose);
  check(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.packed.data()));
}

void write_attribute(hid_t parent, const std::string& dataset, const std::string& name, const std::vector<std::string>& texts) {
  if (texts.empty()) return;
  const PackedTexts all(texts);
  const hsize_t count = texts.size();
  const Id set(done(H5Dopen2(parent, dataset.c_str(), H5P_DEFAULT)), H5Dclose);
  const Id type = text_type(all.longest), space(done(H5Screate_simple(1, &count, nullptr)), H5Sclose);
  const Id attribute(done(H5Acreate2(set, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT)), H5Aclose);
  check(H5Awrite(attribute, type, all.packed.data()));
}

MatX node_rows(const MatX& shapes, Eigen::Index parts) {
  const Eigen::Index nn = shapes.rows() / parts, n = shapes.cols();
  MatX rows(nn, parts * n);
  for (Eigen::Index i = 0; i < nn; ++i)
    for (Eigen::Index a = 0; a < parts; ++a) rows.row(i).segment(a * n, n) = shapes.row(parts * i + a);
  return rows;
}

MatX node_columns(const MatX& rows, Eigen::Index parts) {
  const Eigen::Index nn = rows.rows(), n = rows.cols() / parts;
  MatX shapes(parts * nn, n);
  for (Eigen::Index i = 0; i < nn; ++i)
    for (Eigen::Index a = 0; a < parts; ++a) shapes.row(parts * i + a) = rows.row(i).segment(a * n, n);
  return shapes;
}

void write_hdf5(const std::filesystem::path& path, const std::function<void(hid_t file)>& write) {
  PendingFile pending(path);
  // at exit HDF5 would try again to write what a full disk refused; only its first call counts
  H5dont_atexit();
  const Quiet quiet;
  const auto fail = [&](const std::string& reason) { throw FileError(fmt::format("{}: cannot be written: {}", path.string(), reason)); };
  Id file;
  try {
    const Id access(done(H5Pcreate(H5P_FILE_ACCESS)), H5Pclose);
    check(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
    check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG));
    file = Id(done(H5Fcreate(pending.path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access)), H5Fclose);
    write(file);
    check(H5Fflush(file, H5F_SCOPE_LOCAL));
  } catch (const WriteFailure& failure) {
    fail(failure.reason);
  }
  if (!file.reset()) fail(hdf5_reason());
  pending.commit();
}

}  // namespace flexframe::sim::hdf5
