// Text tables: CSV and its relatives, EXUDYN's files, Adams' tables.
#include "render/import/table.h"

#include "render/base/file.h"
#include "sim/base/plain_text.h"
#include "sim/base/words.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>

namespace flexframe::imports {
namespace {

struct Line {
  int number = 0;
  std::string_view text;
};

std::string_view trimmed(std::string_view s) {
  const auto first = s.find_first_not_of(" \t\r"), last = s.find_last_not_of(" \t\r");
  return first == s.npos ? std::string_view() : s.substr(first, last - first + 1);
}

// Fields between separators; ' ' stands for any run of blanks. A field in quotes keeps separators.
std::vector<std::string> split_fields(std::string_view line, char separator) {
  std::vector<std::string> fields;
  std::string field;
  bool quoted = false, begun = false;
  const auto close = [&] {
    fields.emplace_back(trimmed(field));
    field.clear();
    begun = false;
  };
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') {
      if (quoted && i + 1 < line.size() && line[i + 1] == '"') field += line[++i];
      else quoted = !quoted;
      begun = true;
    } else if (!quoted && separator == ' ' && (c == ' ' || c == '\t' || c == '\r')) {
      if (begun) close();
    } else if (!quoted && c == separator) {
      close();
    } else {
      field += c;
      begun = true;
    }
  }
  if (begun || separator != ' ') close();
  // A separator behind the last value ends the line.
  if (separator != ' ' && fields.size() > 1 && fields.back().empty()) fields.pop_back();
  return fields;
}

// 1.5, +1.5, 1.5D+03; with decimal_comma 1,5. None: no number.
std::optional<double> parse_number(std::string text, bool decimal_comma) {
  for (char& c : text) {
    if (c == 'D' || c == 'd') c = 'e';
    if (decimal_comma && c == ',') c = '.';
  }
  const char* from = text.data() + (text.size() > 1 && text[0] == '+' ? 1 : 0);
  double value = 0.0;
  const auto [end, error] = std::from_chars(from, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

// A field as a message shows it.
std::string said(const std::string& field) { return field.empty() ? "an empty field" : sim::quote(field); }

// How a table's rows are written.
struct Style {
  char separator = ',';
  bool decimal_comma = false;
};

bool all_numbers(const std::vector<std::string>& fields, bool decimal_comma) {
  return !fields.empty() &&
         std::all_of(fields.begin(), fields.end(), [&](const std::string& f) { return parse_number(f, decimal_comma).has_value(); });
}

// The style that reads most lines of the text as rows of numbers, of as many columns as possible: found on up to 200 lines.
Style find_style(const std::vector<Line>& lines) {
  const Style styles[] = {{',', false}, {';', false}, {'\t', false}, {' ', false}, {';', true}, {'\t', true}, {' ', true}};
  Style best;
  double most = 0.0;
  for (const Style& style : styles) {
    std::map<size_t, double> rows;  // by the number of columns
    for (size_t k = 0; k < std::min<size_t>(lines.size(), 200); ++k)
      if (const auto fields = split_fields(lines[k].text, style.separator); all_numbers(fields, style.decimal_comma))
        rows[fields.size()] += 1;
    for (const auto& [columns, count] : rows)
      if (columns > 1 && count > most) most = count, best = style;
  }
  if (most > 0.0) return best;
  // One column, or values missing: what stands in the first line.
  for (const Style& style : {Style{',', false}, Style{';', false}, Style{'\t', false}})
    if (!lines.empty() && lines.front().text.find(style.separator) != std::string_view::npos) return style;
  return {' ', false};
}

struct Header {
  std::vector<std::string> names, units;
  std::map<std::string, std::string> unit_of;  // of comment lines "# slider.x [m]: ..."
  std::vector<std::string> exudyn;             // names by what an EXUDYN header says
  std::string kind = "table";
};

// "[2,2,2,0,0,0,0]" behind '='.
std::vector<int> bracketed_counts(std::string_view line) {
  std::vector<int> counts;
  const auto open = line.rfind('['), close = line.rfind(']');
  if (open == line.npos || close == line.npos || close < open) return counts;
  for (const std::string& field : split_fields(line.substr(open + 1, close - open - 1), ',')) {
    int value = 0;
    std::from_chars(field.data(), field.data() + field.size(), value);
    counts.push_back(value);
  }
  return counts;
}

// Components of an EXUDYN sensor by the type that its header names (exudyn manual, OutputVariableType).
std::vector<std::string> exudyn_components(std::string_view type) {
  if (type == "RotationMatrix") return {"r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"};
  if (type == "Position" || type == "Displacement" || type == "Velocity" || type == "Acceleration" || type == "Rotation" ||
      type == "AngularVelocity" || type == "AngularVelocityLocal" || type == "VelocityLocal" || type == "Force" || type == "Torque")
    return {"x", "y", "z"};
  return {};
}

void read_comment(std::string_view text, Header& header) {
  text.remove_prefix(1);
  text = trimmed(text);
  if (text.starts_with("Exudyn ") && text.ends_with("solution file")) header.kind = "EXUDYN solution";
  if (text.starts_with("Exudyn ") && text.ends_with("sensor output file")) header.kind = "EXUDYN sensor";
  if (header.kind == "EXUDYN sensor" && text.starts_with("OutputVariableType"))
    header.exudyn = exudyn_components(trimmed(text.substr(text.find('=') + 1)));
  if (header.kind == "EXUDYN solution" && text.starts_with("number of written coordinates")) {
    const std::vector<int> counts = bracketed_counts(text);
    const char* letters[] = {"q", "v", "a", "x", "xdot", "lambda", "data"};
    for (size_t k = 0; k < std::min<size_t>(counts.size(), 7); ++k)
      for (int i = 0; i < std::min(counts[k], 10'000'000); ++i) header.exudyn.push_back(fmt::format("{}{}", letters[k], i));
  }
  if (const auto colon = text.find(':'); colon != text.npos) {
    const auto [name, unit] = split_column_name(std::string(text.substr(0, colon)));
    if (!unit.empty()) header.unit_of[name] = unit;
  }
}

// Text above the first row of numbers: names, and units where a second line of as many words stands below.
void read_header(const std::vector<Line>& above, const Style& style, size_t columns, Header& header) {
  std::vector<std::vector<std::string>> rows;
  for (const Line& line : above)
    if (auto fields = split_fields(line.text, style.separator); fields.size() == columns) rows.push_back(std::move(fields));
  if (rows.empty()) return;
  const auto unit_text = [](std::string text) {
    if (text.size() > 1 && (text.front() == '(' || text.front() == '[')) text = text.substr(1, text.size() - 2);
    return text;
  };
  const auto is_units = [&](const std::vector<std::string>& row) {
    return std::all_of(row.begin(), row.end(),
                       [&](const std::string& f) { return f == "-" || sim::parse_unit(unit_text(f)).has_value(); }) &&
           std::any_of(row.begin(), row.end(), [](const std::string& f) { return !f.empty(); });
  };
  if (rows.size() > 1 && is_units(rows.back())) {
    for (const std::string& field : rows.back()) header.units.push_back(field == "-" ? "" : unit_text(field));
    rows.pop_back();
  }
  for (const std::string& field : rows.back()) {
    auto [name, unit] = split_column_name(field);
    header.names.push_back(name);
    if (header.units.size() < header.names.size()) header.units.push_back(unit);
    else if (!unit.empty()) header.units[header.names.size() - 1] = unit;
  }
}

std::vector<Line> content_lines(const std::string& text, Header& header) {
  std::vector<Line> lines;
  int number = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    ++number;
    const std::string_view content = trimmed(line);
    if (content.empty()) continue;
    if (content[0] == '#' || content[0] == '%' || content[0] == '!' || content.starts_with("//")) read_comment(content, header);
    else lines.push_back({number, line});
  }
  return lines;
}

// As UTF-8 with line feeds: spreadsheets save "Unicode text" in UTF-16 behind its mark, old ones end lines by a carriage return alone.
std::string plain_text(const std::vector<std::uint8_t>& bytes) {
  std::string text(bytes.begin(), bytes.end());
  const bool little = text.starts_with("\xFF\xFE"), big = text.starts_with("\xFE\xFF");
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  if (little || big) {
    std::string out;
    const auto unit = [&](size_t at) { return bytes[at + (little ? 1 : 0)] << 8 | bytes[at + (little ? 0 : 1)]; };
    for (size_t at = 2; at + 1 < bytes.size(); at += 2) {
      std::uint32_t c = static_cast<std::uint32_t>(unit(at));
      if (c >= 0xD800 && c < 0xDC00 && at + 3 < bytes.size()) {
        c = 0x10000 + ((c - 0xD800) << 10) + (static_cast<std::uint32_t>(unit(at + 2)) & 0x3FF);
        at += 2;
      }
      if (c < 0x80) {
        out += static_cast<char>(c);
        continue;
      }
      const int more = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
      constexpr std::uint32_t heads[] = {0, 0xC0, 0xE0, 0xF0};
      out += static_cast<char>(heads[more] | c >> 6 * more);
      for (int k = more - 1; k >= 0; --k) out += static_cast<char>(0x80 | (c >> 6 * k & 0x3F));
    }
    text = std::move(out);
  }
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  return text;
}

// "t,x,y" above rows like "0,1,2,5,3,0": 0,1 2,5 3,0 or 0 1,2 5,3 0?
void refuse_mixed_commas(const Line& above, const Style& style, size_t columns, const std::string& file) {
  const size_t names = split_fields(above.text, style.separator).size();
  if (style.separator == ',' && names > 2 && columns > names && columns <= 2 * names)
    throw InputError(
        fmt::format("{}:{}: {} names stand above rows of {} numbers between commas: decimal commas? Save the table with semicolons or tabs "
                    "between its values, or with decimal points",
                    file, above.number, names, columns));
}

// A row of data above the first row of numbers, as one that begins with "NA": it must not be lost with the header.
void refuse_lost_rows(const std::vector<Line>& above, const Style& style, size_t columns, const std::string& file) {
  for (const Line& line : above) {
    const auto fields = split_fields(line.text, style.separator);
    const auto is_number = [&](const std::string& field) { return parse_number(field, style.decimal_comma).has_value(); };
    // Names may be numbers too, but then not that of the first column.
    if (fields.size() != columns || !is_number(fields[0]) ||
        2 * std::count_if(fields.begin(), fields.end(), is_number) <= std::ssize(fields))
      continue;
    const std::string& wrong = *std::find_if_not(fields.begin(), fields.end(), is_number);
    throw InputError(fmt::format("{}:{}: {} is no number", file, line.number, said(wrong)));
  }
}

std::string lower(std::string text) {
  text = sim::plain_lower(text);
  return text;
}

// The column of times among the names: -1 none.
Eigen::Index time_column(const std::vector<std::string>& names, const TableFormat& format, bool named, const std::string& file) {
  for (size_t k = 0; k < names.size(); ++k) {
    const std::string word = lower(names[k]);
    const bool is_time = format.time.empty() ? word == "t" || word == "time" || word == "times" || word.ends_with(".time") ||
                                                   word == "a. time" || word == "zeit"
                                             : names[k] == format.time;
    if (is_time) return static_cast<Eigen::Index>(k);
  }
  if (!format.time.empty())
    throw InputError(fmt::format("{}: has no column {} for the times{}; its columns: {}", file, sim::quote(format.time),
                                 sim::did_you_mean(format.time, names), sim::list_words(names, 12)));
  if (format.step) return -1;
  if (named)
    throw InputError(
        fmt::format("{}: no column is named t or time; name it with time = \"...\" in the [table] of a mapping file, or give "
                    "--step SECONDS; its columns: {}",
                    file, sim::list_words(names, 12)));
  return 0;
}

}  // namespace

Table read_text_table(const std::filesystem::path& path, const TableFormat& format) {
  const std::vector<std::uint8_t> bytes = render::read_file(path);
  const std::string file = path.string();
  const std::string text = plain_text(bytes);
  if (text.find('\0') != std::string::npos) throw InputError(fmt::format("{}: is no text table: it holds bytes of value 0", file));
  Header header;
  const std::vector<Line> lines = content_lines(text, header);
  const Style style = find_style(lines);
  const auto fields_of = [&](const Line& line) { return split_fields(line.text, style.separator); };
  size_t first = 0;
  while (first < lines.size() && !all_numbers(fields_of(lines[first]), style.decimal_comma)) ++first;
  if (first == lines.size()) throw InputError(fmt::format("{}: holds no row of numbers", file));
  const size_t columns = fields_of(lines[first]).size();
  const std::vector<Line> above(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(first));
  refuse_lost_rows(above, style, columns, file);
  if (!above.empty() && format.columns.empty()) refuse_mixed_commas(above.back(), style, columns, file);

  Table table;
  table.file = file;
  read_header(above, style, columns, header);
  table.kind = header.kind;
  const bool named = !header.names.empty() || !format.columns.empty();
  if (!format.columns.empty()) {
    if (format.columns.size() != columns)
      throw InputError(
          fmt::format("{}:{}: has {} columns, the mapping file names {}", file, lines[first].number, columns, format.columns.size()));
    header.names = format.columns;
  } else if (header.names.empty() && header.exudyn.size() + 1 == columns) {
    header.names = {"t"};
    header.names.insert(header.names.end(), header.exudyn.begin(), header.exudyn.end());
  } else if (header.names.empty()) {
    for (size_t k = 0; k < columns; ++k) header.names.push_back(fmt::format("c{}", k + 1));
  }
  header.units.resize(columns);
  const bool own_names = header.kind == "table" && named;
  const Eigen::Index time = time_column(header.names, format, own_names, file);

  const auto rows = static_cast<Eigen::Index>(lines.size() - first);
  table.values.resize(rows, static_cast<Eigen::Index>(columns));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Line& line = lines[first + i];
    const std::vector<std::string> fields = fields_of(line);
    if (fields.size() != columns)
      throw InputError(fmt::format("{}:{}: has {} values, the first row has {}", file, line.number, fields.size(), columns));
    for (size_t k = 0; k < columns; ++k) {
      const std::optional<double> value = parse_number(fields[k], style.decimal_comma);
      if (!value)
        throw InputError(fmt::format("{}:{}: column {}: {} is no number", file, line.number, sim::quote(header.names[k]), said(fields[k])));
      table.values(i, static_cast<Eigen::Index>(k)) = *value;
    }
  }

  double time_unit = format.time_unit;
  for (size_t k = 0; k < columns; ++k) {
    std::string unit = header.units[k];
    if (const auto said = header.unit_of.find(header.names[k]); unit.empty() && said != header.unit_of.end()) unit = said->second;
    const auto index = static_cast<Eigen::Index>(k);
    if (index == time) {
      if (unit.empty() || format.time_unit_given) continue;
      const auto parsed = sim::parse_unit(unit);
      if (!parsed || parsed->dimension != sim::Dimension{.second = 1})
        throw InputError(fmt::format("{}: the unit {} of its times is none of time", file, sim::quote(unit)));
      time_unit = parsed->factor;
    } else {
      table.columns.push_back({.name = header.names[k], .unit = unit, .description = {}, .index = index, .factor = 1.0});
    }
  }
  if (time >= 0) table.times = time_unit * table.values.col(time);
  else table.times = sim::VecX::LinSpaced(rows, 0.0, *format.step * static_cast<double>(rows - 1));
  keep_last_of_each_time(table);
  return table;
}

}  // namespace flexframe::imports
