#include "sim/sweep/rows.h"

#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace flexframe::sim {
namespace {

constexpr std::string_view first_words = "flexframe sweep rows 1 ";
constexpr std::size_t check_length = 12;

std::string check_of(std::string_view text) { return sha256(text).substr(0, check_length); }

std::string plain(std::string text) {
  for (char& c : text)
    if (c == '\t' || c == '\n' || c == '\r') c = ' ';
  return text;
}

std::optional<double> finite_number(std::string_view text) {
  double value = 0.0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (wrong != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

const std::vector<std::string>& point_end_words() {
  static const std::vector<std::string> words = {"done", "warned", "lacking", "refused", "failed", "too long", "crashed"};
  return words;
}

std::string row_line(const SweepRow& row) {
  std::string line = fmt::format("{}\t{}\t{}\t{}\t{}", row.point, static_cast<int>(row.end), row.cpu, row.error, plain(row.column));
  for (const std::optional<double>& value : row.responses) line += value ? fmt::format("\t{}", *value) : "\t-";
  line += "\t" + plain(row.message) + "\t";
  return line + check_of(line) + "\n";
}

std::optional<SweepRow> read_row_line(std::string_view line, std::size_t responses) {
  if (!line.empty() && line.back() == '\n') line.remove_suffix(1);
  if (line.size() <= check_length || check_of(line.substr(0, line.size() - check_length)) != line.substr(line.size() - check_length))
    return std::nullopt;
  std::vector<std::string_view> fields;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t tab = std::min(line.find('\t', at), line.size());
    fields.push_back(line.substr(at, tab - at));
    at = tab + 1;
  }
  if (fields.size() != 7 + responses) return std::nullopt;
  SweepRow row;
  const std::optional<double> point = finite_number(fields[0]), end = finite_number(fields[1]);
  const std::optional<double> cpu = finite_number(fields[2]), error = finite_number(fields[3]);
  if (!point || !end || !cpu || !error || *end < 0 || *end >= static_cast<double>(point_end_words().size())) return std::nullopt;
  row.point = static_cast<long>(*point);
  row.end = static_cast<PointEnd>(static_cast<int>(*end));
  row.cpu = *cpu;
  row.error = *error;
  row.column = fields[4];
  for (std::size_t k = 0; k < responses; ++k) row.responses.push_back(finite_number(fields[5 + k]));
  row.message = fields[5 + responses];
  return row;
}

std::string identity_of_rows(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  if (!std::getline(file, line) || file.eof() || !line.starts_with(first_words)) return {};
  return line.substr(first_words.size());
}

RowsFile read_rows(const std::filesystem::path& path, std::size_t responses, const std::function<void(SweepRow&&)>& take) {
  RowsFile out;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return out;
  out.there = true;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw FileError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
  std::string line;
  if (!std::getline(file, line) || file.eof() || !line.starts_with(first_words)) return out;
  out.identity = line.substr(first_words.size());
  std::size_t at = out.bytes = line.size() + 1;
  while (std::getline(file, line)) {
    const bool whole = !file.eof();
    at += line.size() + 1;
    std::optional<SweepRow> row = whole ? read_row_line(line, responses) : std::nullopt;
    if (!row) {
      ++out.damaged;
      continue;
    }
    ++out.rows;
    out.bytes = at;
    take(std::move(*row));
  }
  // Else what stands behind would count as never run, and be cut off.
  if (file.bad()) throw FileError(fmt::format("{}: cannot be read to its end: {}", path.string(), std::strerror(errno)));
  return out;
}

RowsWriter::RowsWriter(const std::filesystem::path& path, const std::string& identity, bool keep, std::size_t bytes) : path_(path) {
  const auto fail = [&] { throw FileError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno))); };
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) fail();
  // Two processes at one part, such as a requeued task beside the one it replaces, would mix their rows.
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(file_);
    throw FileError(fmt::format("{}: another process writes these rows", path.string()));
  }
  if (::ftruncate(file_, keep ? static_cast<off_t>(bytes) : 0) != 0 || ::lseek(file_, 0, SEEK_END) < 0) fail();
  if (!keep) append(fmt::format("{}{}\n", first_words, identity));
}

RowsWriter::~RowsWriter() {
  if (file_ >= 0) ::close(file_);
}

void RowsWriter::append(const std::string& line) {
  std::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t written = ::write(file_, rest.data(), rest.size());
    if (written >= 0) rest.remove_prefix(written);
    else if (errno != EINTR) throw FileError(fmt::format("{}: cannot be written: {}", path_.string(), std::strerror(errno)));
  }
}

}  // namespace flexframe::sim
