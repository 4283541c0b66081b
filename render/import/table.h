// Named columns over time: what most simulators write as a result file, and what a mapping file speaks of.
#pragma once

#include "sim/base/types.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::imports {

using sim::InputError;

struct Column {
  std::string name;
  std::string unit;         // as the file writes it, "" where it writes none
  std::string description;  // what else the file says of it
  Eigen::Index index = -1;  // column of Table::values; -1: a constant
  double factor = 1.0;      // of that column (-1: a negated alias), or the constant itself
};

inline constexpr const char* modelica_kind = "Modelica result";

struct Table {
  std::string file;  // for messages
  std::string kind;  // what the file is: "table", modelica_kind
  sim::VecX times;   // nt, s, increasing
  sim::MatX values;  // nt x m, as the file has them
  std::vector<Column> columns;
  std::vector<std::string> notes;

  // The column of this name; null: there is none. Of a Modelica result blanks in an index do not count: Dymola writes T[1, 2], OpenModelica
  // T[1,2]. Throws InputError where there are two.
  const Column* find(const std::string& name) const;
  // nt values in the column's own unit. Throws InputError where one is not finite.
  sim::VecX series(const Column& column) const;
};

// How a text table is written where it does not say so itself.
struct TableFormat {
  std::vector<std::string> columns;  // names, first to last; empty: of the header, else c1, c2 ...
  std::string time;                  // name of the column of times; empty: t or time, else the first
  double time_unit = 1.0;            // s
  bool time_unit_given = false;
  std::optional<double> step;  // s between rows of a table without times
};

// CSV, blank- or tab-separated text, EXUDYN's sensor and solution files, Adams' tables (README.md). Separator, header, units and comment
// lines are found from the text. Throws InputError "FILE:LINE: what was found, what is needed".
Table read_text_table(const std::filesystem::path& path, const TableFormat& format);

// Modelica result of Dymola or OpenModelica: MAT file of level 4 with the matrices Aclass, name, description, dataInfo, data_1, data_2
// (version 1.1, "binTrans" or "binNormal"). Names have no blanks in their indices. Throws InputError.
Table read_modelica(const std::filesystem::path& path);

// Several tables of the same times as one; the columns of each are named FILE.COLUMN by the file's stem. Throws InputError naming the file
// whose times differ.
Table join_tables(std::vector<Table> tables);

// The name and unit of "slider.x [mm]" or "Time (s)"; the unit is empty where the bracket holds none that is known.
std::pair<std::string, std::string> split_column_name(std::string text);

// A Modelica name without the blanks of its indices: "T[1, 2]" is "T[1,2]".
std::string without_index_blanks(std::string name);

// Rows with a time that was there before are left out but for the last of each (events); times then increase, or InputError with the row.
void keep_last_of_each_time(Table& table);

}  // namespace flexframe::imports
