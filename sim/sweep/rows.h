// What is kept of the points of a sweep: a row each, appended to a file as soon as the point is done, so that a killed sweep goes on
// where it stopped.
//
// A row is a line of fields between tabs that ends with the beginning of its SHA-256: a line that was cut off, or changed, is found and
// its point is run again. The first line names the sweep by its identity (sweep.h): rows of another scene, question or program are not
// taken.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// How a point ended.
enum class PointEnd {
  done,      // all responses are there
  warned,    // so they are, and the run warned of them
  lacking,   // the run was made, a response has no value
  refused,   // the scene makes no mechanism with these settings
  failed,    // it could not be simulated
  too_long,  // it took more CPU seconds than it may
  crashed    // its process was ended, twice
};
const std::vector<std::string>& point_end_words();  // "done", "warned", ...

struct SweepRow {
  long point = 0;
  PointEnd end = PointEnd::done;
  double cpu = 0.0;     // s, of the whole point
  double error = -1.0;  // of its run, estimated, relative to the range of the output `column`; negative: not estimated
  std::string column;
  std::vector<std::optional<double>> responses;
  std::string message;  // why there are no responses, or what the run warned of
};

std::string row_line(const SweepRow& row);  // with its end of line
// None where the line is no whole row with so many responses.
std::optional<SweepRow> read_row_line(std::string_view line, std::size_t responses);

// What a file of rows holds.
struct RowsFile {
  bool there = false;
  std::string identity;   // of the sweep it belongs to; empty: the file is no file of rows
  std::size_t bytes = 0;  // up to the end of the last whole row
  long rows = 0, damaged = 0;
};
// The identity in the first line of a file of rows; empty where there is none.
std::string identity_of_rows(const std::filesystem::path& path);
// Calls take for every whole row, in the order of the file. A file that is missing is `there = false`; throws FileError where it cannot be
// read.
RowsFile read_rows(const std::filesystem::path& path, std::size_t responses, const std::function<void(SweepRow&&)>& take);

// Appends rows to a file.
class RowsWriter {
 public:
  // keep: go on behind the whole rows of an earlier file of the same identity; else the file begins anew. Throws FileError.
  RowsWriter(const std::filesystem::path& path, const std::string& identity, bool keep, std::size_t bytes);
  ~RowsWriter();
  RowsWriter(const RowsWriter&) = delete;
  RowsWriter& operator=(const RowsWriter&) = delete;

  void append(const std::string& line);  // throws FileError (disk full)

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace flexframe::sim
