#include "sim/sweep/table.h"

#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/results/table_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

namespace fs = std::filesystem;

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

// Names of HDF5 hold no '/'.
std::string group_name(const std::string& name, std::size_t k) {
  return name.find('/') == std::string::npos && name != "." ? name : fmt::format("response_{}", k);
}

}  // namespace

long SweepTable::rows() const { return static_cast<long>(ends.size()) - std::count(ends.begin(), ends.end(), missing); }
long SweepTable::count(PointEnd end) const { return std::count(ends.begin(), ends.end(), static_cast<std::uint8_t>(end)); }

void SweepTable::reset(long points, Eigen::Index responses_of_each) {
  ends.assign(points, missing);
  cpu = VecX::Zero(points);
  error = VecX::Constant(points, -1.0);
  responses = MatX::Constant(points, responses_of_each, std::numeric_limits<double>::quiet_NaN());
  error_column.assign(points, 0);
  error_columns = {""};
  messages.clear();
}

void SweepTable::put(SweepRow&& row) {
  if (row.point < 0 || row.point >= static_cast<long>(ends.size()) || has(row.point)) return;
  const std::size_t at = row.point;
  ends[at] = static_cast<std::uint8_t>(row.end);
  cpu[row.point] = row.cpu;
  error[row.point] = row.error;
  for (std::size_t k = 0; k < row.responses.size(); ++k)
    if (row.responses[k]) responses(row.point, static_cast<Eigen::Index>(k)) = *row.responses[k];
  auto column = std::find(error_columns.begin(), error_columns.end(), row.column);
  if (column == error_columns.end()) column = error_columns.insert(column, row.column);
  error_column[at] = static_cast<std::uint16_t>(column - error_columns.begin());
  if (!row.message.empty()) messages.emplace(row.point, std::move(row.message));
}

Collected collect_rows(const Sweep& sweep) {
  Collected out;
  SweepTable& table = out.table;
  const long n = sweep.design.size();
  table.reset(n, static_cast<Eigen::Index>(sweep.responses.size()));
  const auto take = [&](SweepRow&& row) { table.put(std::move(row)); };
  for (const auto& [count, number] : shards_in(sweep.folder)) {
    Collected::Shard shard;
    shard.shard = number;
    shard.shards = count;
    const fs::path path = rows_file(sweep.folder, number, count);
    const long first = number % count;
    shard.points = first < n ? (n - first + shard.shards - 1) / shard.shards : 0;
    if (const std::string identity = identity_of_rows(path); identity != sweep.identity) {
      shard.problem = identity.empty() ? "is no file of rows" : "belongs to another sweep: its scene, options or program are not the same";
    } else {
      const RowsFile rows = read_rows(path, sweep.responses.size(), take);
      shard.rows = rows.rows;
      shard.damaged = rows.damaged;
    }
    out.shards.push_back(shard);
  }
  out.missing = n - table.rows();
  return out;
}

void write_table_csv(const Sweep& sweep, const SweepTable& table, const fs::path& path) {
  std::string text = "point";
  for (const SweepAxis& axis : sweep.design.axes()) text += "," + csv_text(axis.key);
  for (const std::string& name : sweep.names) text += "," + csv_text(name);
  text += ",end,cpu_s,error,error_of,message\n";
  for (long i = 0; i < sweep.design.size(); ++i) {
    if (!table.has(i)) continue;
    const std::size_t at = i;
    text += fmt::format("{}", i);
    for (const Design::Value& value : sweep.design.point(i)) text += "," + csv_text(value.text);
    for (Eigen::Index k = 0; k < table.responses.cols(); ++k)
      text += std::isfinite(table.responses(i, k)) ? fmt::format(",{}", table.responses(i, k)) : ",";
    text += fmt::format(",{},{:.6g},{},{},", point_end_words()[table.ends[at]], table.cpu[i],
                        table.error[i] >= 0.0 ? fmt::format("{:.3g}", table.error[i]) : "",
                        csv_text(table.error_columns[table.error_column[at]]));
    if (const auto message = table.messages.find(i); message != table.messages.end()) text += csv_text(message->second);
    text += '\n';
  }
  write_whole_file(path, text);
}

void write_table_hdf5(const Sweep& sweep, const SweepTable& table, const fs::path& path) {
  TableFile file;
  file.attributes = {{"format", "flexframe sweep"},
                     {"scene_file", sweep.question.scene.filename().string()},
                     {"scene_sha256", sha256(sweep.scene_text)},
                     {"inputs_sha256", sweep.inputs},
                     {"program_sha256", sweep.program},
                     {"identity", sweep.identity}};
  const long n = table.rows();
  std::vector<double> point;
  std::vector<std::string> ends, of, messages;
  MatX numbers(n, static_cast<Eigen::Index>(sweep.design.axes().size()));
  std::vector<std::vector<std::string>> words(sweep.design.axes().size());
  std::vector<double> cpu;
  for (long i = 0; i < sweep.design.size(); ++i) {
    if (!table.has(i)) continue;
    const std::size_t at = i;
    const std::vector<Design::Value> values = sweep.design.point(i);
    for (std::size_t k = 0; k < values.size(); ++k) {
      numbers(static_cast<Eigen::Index>(point.size()), static_cast<Eigen::Index>(k)) = values[k].number;
      if (!sweep.design.axes()[k].chance && sweep.design.axes()[k].numbers.empty()) words[k].push_back(values[k].text);
    }
    point.push_back(static_cast<double>(i));
    cpu.push_back(table.cpu[i]);
    ends.push_back(point_end_words()[table.ends[at]]);
    const auto message = table.messages.find(i);
    messages.push_back(message == table.messages.end() ? "" : message->second);
  }
  const auto as_vector = [](const std::vector<double>& v) {
    return VecX(Eigen::Map<const VecX>(v.data(), static_cast<Eigen::Index>(v.size())));
  };
  file.numbers.push_back({"points", "point", as_vector(point), "number of the point in the design"});
  for (std::size_t k = 0; k < sweep.design.axes().size(); ++k) {
    const std::string& key = sweep.design.axes()[k].key;
    if (words[k].empty()) file.numbers.push_back({"settings", key, numbers.col(static_cast<Eigen::Index>(k)), key});
    else file.texts.push_back({"settings", key, words[k], key});
  }
  file.numbers.push_back({"points", "cpu_s", as_vector(cpu), "CPU seconds of the point"});
  file.texts.push_back({"points", "end", ends, "done, warned, lacking, refused, failed, too long, crashed"});
  file.texts.push_back({"points", "message", messages, "why there are no responses, or what the run warned of"});
  // No number stands for one that is missing: each response has its own list of points.
  const auto listed = [&](const std::string& group, const std::string& meaning, const auto& value) {
    std::vector<double> places, found;
    for (long i = 0; i < sweep.design.size(); ++i)
      if (const std::optional<double> x = table.has(i) ? value(i) : std::nullopt)
        places.push_back(static_cast<double>(i)), found.push_back(*x);
    file.numbers.push_back({group, "point", as_vector(places), "number of the point in the design"});
    file.numbers.push_back({group, "value", as_vector(found), meaning});
  };
  for (std::size_t k = 0; k < sweep.names.size(); ++k)
    listed("responses/" + group_name(sweep.names[k], k), sweep.names[k], [&](long i) -> std::optional<double> {
      const double x = table.responses(i, static_cast<Eigen::Index>(k));
      return std::isfinite(x) ? std::optional<double>(x) : std::nullopt;
    });
  listed("error", "estimated error of the run, relative to the range of an output",
         [&](long i) -> std::optional<double> { return table.error[i] >= 0.0 ? std::optional<double>(table.error[i]) : std::nullopt; });
  write_table_file(file, path);
}

}  // namespace flexframe::sim
