#include "sim/results/csv.h"

#include "sim/base/file_output.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

namespace flexframe::sim {

namespace {

void append_number(std::string& text, double x) {
  // 24 characters hold the shortest form of any double: -2.2250738585072014e-308
  char digits[32];
  const auto [end, error] = std::to_chars(digits, digits + sizeof digits, x);
  text.append(digits, end);
}

std::string field(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == std::string::npos) return name;
  std::string quoted = "\"";
  for (const char c : name) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

}  // namespace

std::string csv_head(const Results& results) {
  std::string text = "# t [s]: time\n";
  for (const ResultOutput& output : results.outputs) {
    std::string description = output.description;
    std::replace(description.begin(), description.end(), '\n', ' ');
    text += fmt::format("# {} [{}]{}{}\n", output.column, output.unit, description.empty() ? "" : ": ", description);
  }
  return text;
}

std::string histories_csv(const Results& results) {
  std::string text = "t";
  for (const ResultOutput& output : results.outputs) {
    if (output.values.size() != results.times.size())
      throw SimulationError(
          fmt::format("the output '{}' has {} values for {} times", output.column, output.values.size(), results.times.size()));
    if (!output.values.allFinite()) throw SimulationError(fmt::format("the output '{}' holds a value that is not finite", output.column));
    text += "," + field(output.column);
  }
  text += '\n';
  for (Eigen::Index i = 0; i < results.times.size(); ++i) {
    append_number(text, results.times[i]);
    for (const ResultOutput& output : results.outputs) {
      text += ',';
      append_number(text, output.values[i]);
    }
    text += '\n';
  }
  return text;
}

void write_histories_csv(const Results& results, const std::filesystem::path& path, bool head) {
  write_whole_file(path, (head ? csv_head(results) : "") + histories_csv(results));
}

}  // namespace flexframe::sim
