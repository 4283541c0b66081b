// Settings of a scene that make a response small or large within limits: searches from several places (search.h), each of which keeps its
// runs as rows in a file of its own, rows/search_S_of_N.rows, with the places where they were made. A search is its rows: what it does next
// follows from them alone, so that one that was killed goes on where it was, and shards make the table of one process.
#pragma once

#include "sim/sweep/search.h"
#include "sim/sweep/sweep.h"
#include "sim/sweep/table.h"

#include <filesystem>
#include <string>
#include <vector>

namespace flexframe::sim {

// What became of the searches.
struct FoundMinimum {
  struct Search {
    bool ended = false;  // else rows are missing
    SearchEnd end = SearchEnd::settled;
    long runs = 0, without = 0;  // without: that lack a response
    long best = -1;              // its best point, -1: none keeps all limits
    bool same = false;           // as good as the best of all
  };
  std::vector<Search> searches;
  long best = -1;
  std::vector<std::string> at_ends;   // keys at an end of their range: "L (upper end)"
  std::vector<std::string> active;    // limits that hold it back
  std::vector<std::string> warnings;  // why it may not be the smallest
};

std::filesystem::path search_file(const std::filesystem::path& folder, int search, int searches);  // search: from 1

// run_shard (sweep.h) where the question is for a minimum: searches instead of points, options.workers of them at a time.
ShardReport run_searches(const Sweep& sweep, const SweepShard& options);

// Reads the rows of all searches: their places go to sweep.design, so that all that is made of a table can be made of these. `missing`
// counts searches that have not ended. Throws FileError.
Collected collect_searches(Sweep& sweep, FoundMinimum& found);

// Whether the row keeps all limits; of rows with all responses.
bool keeps_limits(const Sweep& sweep, const SweepTable& table, long point);

}  // namespace flexframe::sim
