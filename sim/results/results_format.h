// What the head of a results file says (sim/RESULTS.md). Private to results_file_write.cpp and results_file_read.cpp.
#pragma once

namespace flexframe::sim {

constexpr const char* format_name = "flexframe results";
constexpr int format_version = 1;

}  // namespace flexframe::sim
