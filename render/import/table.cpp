#include "render/import/table.h"

#include "sim/base/words.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::imports {

const Column* Table::find(const std::string& name) const {
  const Column* found = nullptr;
  const std::string wanted = kind == modelica_kind ? without_index_blanks(name) : name;
  for (const Column& column : columns) {
    if (column.name != wanted) continue;
    if (found)
      throw InputError(fmt::format("{}: two columns are named {}: which is meant? Give each its own name", file, sim::quote(name)));
    found = &column;
  }
  return found;
}

sim::VecX Table::series(const Column& column) const {
  sim::VecX out = column.index < 0 ? sim::VecX::Constant(times.size(), column.factor) : sim::VecX(column.factor * values.col(column.index));
  for (Eigen::Index i = 0; i < out.size(); ++i)
    if (!std::isfinite(out[i]))
      throw InputError(fmt::format("{}: column {}: the value at t = {:g} s is not finite", file, sim::quote(column.name), times[i]));
  return out;
}

std::pair<std::string, std::string> split_column_name(std::string text) {
  const auto trimmed = [](const std::string& s) {
    const auto first = s.find_first_not_of(" \t"), last = s.find_last_not_of(" \t");
    return first == std::string::npos ? std::string() : s.substr(first, last - first + 1);
  };
  text = trimmed(text);
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}}) {
    if (text.empty() || text.back() != close) continue;
    const auto at = text.rfind(open);
    if (at == std::string::npos || at == 0) continue;
    const std::string unit = trimmed(text.substr(at + 1, text.size() - at - 2));
    // "body.frame_a.r_0[1]" has an index, no unit.
    if (const auto parsed = sim::parse_unit(unit); parsed && (text[at - 1] == ' ' || unit.find_first_not_of("0123456789,") != unit.npos))
      return {trimmed(text.substr(0, at)), unit};
  }
  return {text, ""};
}

std::string without_index_blanks(std::string name) {
  int depth = 0;
  std::erase_if(name, [&](char c) {
    if (c == '[') ++depth;
    if (c == ']') --depth;
    return c == ' ' && depth > 0;
  });
  return name;
}

void keep_last_of_each_time(Table& table) {
  const Eigen::Index n = table.times.size();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!std::isfinite(table.times[i])) throw InputError(fmt::format("{}: the time of row {} is not finite", table.file, i + 1));
    if (!kept.empty() && table.times[i] < table.times[kept.back()])
      throw InputError(fmt::format("{}: times must not fall, but row {} is at {:g} s after {:g} s", table.file, i + 1, table.times[i],
                                   table.times[kept.back()]));
    if (!kept.empty() && table.times[i] == table.times[kept.back()]) kept.back() = i;
    else kept.push_back(i);
  }
  if (std::ssize(kept) == n) return;
  table.notes.push_back(fmt::format("{} of {} rows repeat a time (events): the last of each time is kept", n - std::ssize(kept), n));
  table.times = sim::VecX(table.times(kept));
  table.values = sim::MatX(table.values(kept, Eigen::all));
}

Table join_tables(std::vector<Table> tables) {
  Table joined = std::move(tables.front());
  if (tables.size() == 1) return joined;
  const auto stem = [](const Table& table) { return std::filesystem::path(table.file).stem().string(); };
  const std::string first = joined.file;
  for (Column& column : joined.columns) column.name = stem(joined) + "." + column.name;
  for (size_t k = 1; k < tables.size(); ++k) {
    const Table& table = tables[k];
    const double span = std::max(1e-300, joined.times[joined.times.size() - 1] - joined.times[0]);
    if (table.times.size() != joined.times.size() || (table.times - joined.times).cwiseAbs().maxCoeff() > 1e-9 * span)
      throw InputError(fmt::format("{}: its {} times are not those of {} ({}): files read together must have the same times", table.file,
                                   table.times.size(), first, joined.times.size()));
    const Eigen::Index before = joined.values.cols();
    joined.values.conservativeResize(Eigen::NoChange, before + table.values.cols());
    joined.values.rightCols(table.values.cols()) = table.values;
    for (Column column : table.columns) {
      column.name = stem(table) + "." + column.name;
      if (column.index >= 0) column.index += before;
      joined.columns.push_back(std::move(column));
    }
    joined.notes.insert(joined.notes.end(), table.notes.begin(), table.notes.end());
  }
  return joined;
}

}  // namespace flexframe::imports
