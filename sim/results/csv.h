// Histories as CSV: a header line "t,slider.x,..." and one line a sample; numbers in the shortest form that reads back to the same
// bits, '.' as decimal point whatever the locale; names with a comma, quote or line end are quoted (RFC 4180).
#pragma once

#include "sim/results/results.h"

#include <filesystem>
#include <string>

namespace flexframe::sim {

// The whole table as text.
std::string histories_csv(const Results& results);

// Comment lines "# slider.x [m]: description", one a column.
std::string csv_head(const Results& results);

// Whole or not at all. head: with the comment lines before the header line. Throws FileError naming the path when it cannot be written.
void write_histories_csv(const Results& results, const std::filesystem::path& path, bool head = false);

}  // namespace flexframe::sim
