// The rows of a sweep in one piece: what is asked of the points, what came of them.
#pragma once

#include "sim/sweep/sweep.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace flexframe::sim {

// Row i is point i of the design. Numbers lie in columns, so that a million rows fit into memory.
struct SweepTable {
  std::vector<std::uint8_t> ends;          // a PointEnd; `missing`: no row
  VecX cpu, error;                         // s; relative, negative: not estimated
  MatX responses;                          // points x responses, not a number where there is none
  std::vector<std::string> error_columns;  // what `error_column` counts in
  std::vector<std::uint16_t> error_column;
  std::map<long, std::string> messages;  // of points that have one

  static constexpr std::uint8_t missing = 255;
  bool has(long point) const { return ends[static_cast<std::size_t>(point)] != missing; }
  long rows() const;  // that are there
  long count(PointEnd end) const;

  // No rows of `points` points.
  void reset(long points, Eigen::Index responses_of_each);
  // A row; of two of one point the first counts, and points that the design has not are left out.
  void put(SweepRow&& row);
};

// What a folder holds of a sweep, and what it lacks.
struct Collected {
  SweepTable table;
  struct Shard {
    int shard = 1, shards = 1;
    long points = 0, rows = 0, damaged = 0;
    std::string problem;  // why nothing was taken of it: another scene, question or program
  };
  std::vector<Shard> shards;  // as their files say, in order
  long missing = 0;           // points without a row
};

// Reads all rows of sweep.folder. Of two rows of one point the one that is read first counts (they are equal but for the CPU time). Throws
// FileError.
Collected collect_rows(const Sweep& sweep);

// The table as CSV: point, the keys of the design, the responses, end, cpu_s, error, error_of, message; a line each point that has a row,
// in the order of the points. Empty: no number. Written whole or not at all.
void write_table_csv(const Sweep& sweep, const SweepTable& table, const std::filesystem::path& path);

// The same as HDF5 (sweep/README.md has the layout). Throws FileError.
void write_table_hdf5(const Sweep& sweep, const SweepTable& table, const std::filesystem::path& path);

}  // namespace flexframe::sim
