#include "sim/scene/toml_input.h"

#include "sim/base/files_read.h"
#include "sim/base/words.h"
#include "sim/scene/meant_units.h"
#include "sim/scene/parameters.h"
#include "sim/scene/unit_terms.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace flexframe::sim {

namespace {

constexpr std::uintmax_t largest_file = 8u << 20;
constexpr int deepest_key = 32;

int line_of(const toml::source_region& region) { return static_cast<int>(region.begin.line); }

TomlValue convert(const toml::node& node) {
  using Type = TomlValue::Type;
  TomlValue value;
  value.line = line_of(node.source());
  if (const auto* table = node.as_table()) {
    value.type = Type::table;
    // toml++ keeps keys sorted by name: back to the file's order, so that the first wrong key is reported
    std::vector<std::pair<const toml::key*, const toml::node*>> entries;
    for (const auto& entry : *table) entries.emplace_back(&entry.first, &entry.second);
    std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
      const auto& x = a.first->source().begin;
      const auto& y = b.first->source().begin;
      return std::pair(x.line, x.column) < std::pair(y.line, y.column);
    });
    for (const auto& entry : entries) {
      value.keys.emplace_back(entry.first->str());
      value.key_lines.push_back(line_of(entry.first->source()));
      value.items.push_back(convert(*entry.second));
    }
  } else if (const auto* array = node.as_array()) {
    value.type = Type::array;
    value.items.reserve(array->size());
    for (const toml::node& item : *array) value.items.push_back(convert(item));
  } else if (const auto* boolean = node.as_boolean()) {
    value.type = Type::boolean;
    value.boolean = boolean->get();
  } else if (const auto* integer = node.as_integer()) {
    value.type = Type::integer;
    value.integer = integer->get();
    value.real = static_cast<double>(value.integer);
  } else if (const auto* real = node.as_floating_point()) {
    value.type = Type::real;
    value.real = real->get();
  } else if (const auto* text = node.as_string()) {
    value.type = Type::text;
    value.text = text->get();
  } else {
    value.type = Type::date;
  }
  return value;
}

// Dotted keys nest one table a dot and toml++ frees them recursively: a long enough key would overflow the stack.
// Returns the line of a key with more than deepest_key dots, 0 if there is none.
int line_of_too_deep_key(std::string_view text) {
  int line = 1, dots = 0;
  char previous = 0;
  for (const char c : text) {
    if (c == '\n') {
      ++line;
      dots = 0;
    } else if (c == '.') {
      dots = previous == '.' ? 0 : dots + 1;
      if (dots > deepest_key) return line;
    } else if (std::strchr("#=,[]{}()", c)) {
      // #: a comment, or inside a string; neither is part of a key
      dots = 0;
    }
    if (c != ' ' && c != '\t') previous = c;
  }
  return 0;
}

// "[0, 0, 2*pi/3]": an array written as one text.
bool is_array_text(const TomlValue& value) {
  return value.type == TomlValue::Type::text && value.text.starts_with('[') && value.text.ends_with(']');
}

// Its entries, each a text; split at the commas outside brackets.
TomlValue split_array_text(const TomlValue& value) {
  TomlValue out;
  out.type = TomlValue::Type::array;
  out.line = value.line;
  int depth = 0;
  const std::string_view inner = std::string_view(value.text).substr(1, value.text.size() - 2);
  std::string entry;
  const auto close = [&] {
    TomlValue item;
    item.type = TomlValue::Type::text;
    item.line = value.line;
    item.text = std::exchange(entry, {});
    item.text.erase(0, std::min(item.text.find_first_not_of(' '), item.text.size()));
    item.text.erase(item.text.find_last_not_of(' ') + 1);
    out.items.push_back(std::move(item));
  };
  for (const char c : inner) {
    if (c == '(' || c == '[') ++depth;
    if (c == ')' || c == ']') --depth;
    if (c == ',' && depth == 0) close();
    else entry += c;
  }
  if (!out.items.empty() || entry.find_first_not_of(' ') != std::string::npos) close();
  return out;
}

bool is_binary(std::string_view text) { return text.find('\0') != std::string_view::npos; }

std::string first_line(std::string_view text) { return std::string(text.substr(0, std::min(text.find('\n'), std::size_t{300}))); }

}  // namespace

TomlValue parse_toml(std::string_view text, const std::string& name) {
  if (is_binary(text)) throw InputError(fmt::format("{}: is a binary file; a TOML text is expected", name));
  if (const int line = line_of_too_deep_key(text))
    throw InputError(fmt::format("{}:{}: a key with more than {} dots", name, line, deepest_key));
  try {
    return convert(toml::parse(text, name));
  } catch (const toml::parse_error& error) {
    const auto& at = error.source().begin;
    throw InputError(fmt::format("{}:{}: column {}: TOML syntax: {}", name, at.line, at.column, first_line(error.description())));
  }
}

std::string read_text_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::string name = path.string();
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) throw InputError(fmt::format("{}: no such file", name));
  if (error) throw InputError(fmt::format("{}: cannot be read: {}", name, error.message()));
  if (std::filesystem::is_directory(status)) throw InputError(fmt::format("{}: is a directory; a file is expected", name));
  // Pipes and /dev/stdin have no size: read up to the limit whatever it is.
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: cannot be opened: {}", name, std::strerror(errno)));
  note_file_read(path);
  std::string text;
  std::vector<char> block(1 << 16);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())), in.gcount() > 0) {
    text.append(block.data(), in.gcount());
    if (text.size() > largest_file)
      throw InputError(fmt::format("{}: is larger than {} MiB; is it the right file?", name, largest_file >> 20));
  }
  if (in.bad()) throw InputError(fmt::format("{}: cannot be read: {}", name, std::strerror(errno)));
  if (text.empty()) throw InputError(fmt::format("{}: is empty", name));
  return text;
}

TomlValue read_toml(const std::filesystem::path& path) { return parse_toml(read_text_file(path), path.string()); }

std::string describe(const TomlValue& value) {
  switch (value.type) {
    case TomlValue::Type::boolean:
      return value.boolean ? "the boolean true" : "the boolean false";
    case TomlValue::Type::integer:
      return fmt::format("the number {}", value.integer);
    case TomlValue::Type::real:
      return fmt::format("the number {}", value.real);
    case TomlValue::Type::text:
      return "the string " + quote(value.text);
    case TomlValue::Type::date:
      return "a date or time";
    case TomlValue::Type::array:
      return value.items.empty() ? "an empty array"
                                 : fmt::format("an array of {} value{}", value.items.size(), value.items.size() == 1 ? "" : "s");
    case TomlValue::Type::table:
      return "a table";
  }
  return "?";
}

const TomlValue* TomlValue::find(std::string_view key) const {
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (keys[i] == key) return &items[i];
  return nullptr;
}

TomlValue* TomlValue::find(std::string_view key) { return const_cast<TomlValue*>(std::as_const(*this).find(key)); }

TableReader::TableReader(const TomlValue& table, std::string file, std::string label, std::string prefix)
    : table_(&table), file_(std::move(file)), label_(std::move(label)), prefix_(std::move(prefix)) {}

std::string TableReader::full_key(std::string_view key) const { return prefix_ + std::string(key); }

int TableReader::line(std::string_view key) const {
  for (std::size_t i = 0; i < table_->keys.size(); ++i)
    if (table_->keys[i] == key) return table_->key_lines[i] > 0 ? table_->key_lines[i] : table_->items[i].line;
  return table_->line;
}

std::string TableReader::place(int line) const { return line > 0 ? fmt::format("{}:{}", file_, line) : file_; }

std::string TableReader::key_at(std::string_view key) const {
  const std::string label = label_.empty() ? "" : label_ + ": ";
  return fmt::format("{}: {}key {}", place(line(key)), label, quote(full_key(key)));
}

void TableReader::fail(std::string_view key, const std::string& message) const {
  throw InputError(fmt::format("{} {}", key_at(key), message));
}

void TableReader::fail(const std::string& message) const {
  const std::string label = label_.empty() ? "" : label_ + ": ";
  throw InputError(fmt::format("{}: {}{}", place(table_->line), label, message));
}

void TableReader::allow(std::span<const std::string> keys) const {
  allowed_.assign(keys.begin(), keys.end());
  for (const std::string& key : table_->keys)
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      const std::string hint = did_you_mean(key, keys);
      fail(key, fmt::format("is unknown{}{} allowed: {}", hint, hint.empty() ? ";" : "", list_words(keys)));
    }
}

void TableReader::allow(std::initializer_list<std::string> keys) const { allow(std::span(keys.begin(), keys.size())); }

const TomlValue* TableReader::find(std::string_view key) const { return table_->find(key); }

const Parameters& TableReader::parameters() const {
  static const Parameters none;
  return parameters_ ? *parameters_ : none;
}

const TomlValue& TableReader::required(std::string_view key) const {
  if (const TomlValue* value = find(key)) return *value;
  const std::string label = label_.empty() ? "" : label_ + ": ";
  std::vector<std::string> unknown;  // what is a key of its own is no misspelling
  for (const std::string& other : table_->keys)
    if (std::find(allowed_.begin(), allowed_.end(), other) == allowed_.end()) unknown.push_back(other);
  const std::string near = nearest_word(key, unknown);
  const std::string hint = near.empty() ? "" : fmt::format("; is '{}' a misspelling of it?", near);
  throw InputError(fmt::format("{}: {}key '{}' is missing{}", place(table_->line), label, full_key(key), hint));
}

double TableReader::text_number(std::string_view key, const TomlValue& value, Range range, const std::string& which) const {
  try {
    return parameters().number(value.text, range.unit);
  } catch (const InputError& error) {
    fail(key, fmt::format("{}must be {}, found {}, which is none: {}", which, range.what, describe(value), error.what()));
  }
}

double TableReader::checked_number(std::string_view key, const TomlValue& value, Range range, const std::string& which) const {
  const bool text = value.type == TomlValue::Type::text;
  if (!text && value.type != TomlValue::Type::real && value.type != TomlValue::Type::integer)
    fail(key, fmt::format("{}must be {}, found {}", which, range.what, describe(value)));
  const double x = text ? text_number(key, value, range, which) : value.real;
  const auto found = [&] {
    if (!text) return describe(value);
    const std::string with = parameters().values_in(value.text);
    return fmt::format("{}, which is {}{}{}", describe(value), x, with.empty() ? "" : " with ", with);
  };
  if (!std::isfinite(x)) fail(key, fmt::format("{}must be finite, found {}", which, found()));
  if (x < range.low || x > range.high || (range.open_low && x == range.low) || (range.open_high && x == range.high))
    fail(key, fmt::format("{}must be {}, found {}", which, range.what, found()));
  doubt_degrees(key, value, range, x);
  return x;
}

void TableReader::doubt(std::string_view key, const std::string& message) const {
  if (parameters_) parameters_->doubt(fmt::format("{} {}", key_at(key), message));
}

bool TableReader::unitless(std::string_view key) const {
  const auto bare = [](const TomlValue& value) { return value.type != TomlValue::Type::text || units_in(value.text).empty(); };
  const TomlValue* value = find(key);
  return value && bare(*value) && std::all_of(value->items.begin(), value->items.end(), bare);
}

void TableReader::doubt_degrees(std::string_view key, const TomlValue& value, const Range& range, double x) const {
  if (!range.doubted || !range.unit || std::string_view(range.unit) != "rad" || !looks_like_degrees(x)) return;
  if (value.type == TomlValue::Type::text && !units_in(value.text).empty()) return;
  doubt(key, fmt::format("has the angle {}, which is read as radians, {:.3g} turns: for degrees write \"{} deg\", for radians \"{} rad\"",
                         x, std::abs(x) / (2.0 * std::numbers::pi), x, x));
}

double TableReader::number(std::string_view key, Range range) const { return checked_number(key, required(key), range, ""); }

double TableReader::number(std::string_view key, double otherwise, Range range) const {
  const TomlValue* value = find(key);
  return value ? checked_number(key, *value, range, "") : otherwise;
}

std::optional<double> TableReader::optional_number(std::string_view key, Range range) const {
  const TomlValue* value = find(key);
  return value ? std::optional(checked_number(key, *value, range, "")) : std::nullopt;
}

int TableReader::integer(std::string_view key, int low, int high) const {
  const TomlValue& value = required(key);
  const bool text = value.type == TomlValue::Type::text;
  const Range range{.what = "a whole number"};
  const double x = text ? text_number(key, value, range, "") : value.real;
  // 3.0 is a whole number too
  const bool whole = value.type == TomlValue::Type::integer || ((text || value.type == TomlValue::Type::real) && x == std::floor(x));
  if (!whole || x < low || x > high)
    fail(key, fmt::format("must be a whole number from {} to {}, found {}{}", low, high, describe(value),
                          text ? fmt::format(", which is {}", x) : ""));
  return static_cast<int>(x);
}

int TableReader::integer(std::string_view key, int otherwise, int low, int high) const {
  return has(key) ? integer(key, low, high) : otherwise;
}

bool TableReader::boolean(std::string_view key, bool otherwise) const {
  const TomlValue* value = find(key);
  if (!value) return otherwise;
  if (value->type != TomlValue::Type::boolean) fail(key, fmt::format("must be true or false, found {}", describe(*value)));
  return value->boolean;
}

std::string TableReader::text(std::string_view key) const {
  const TomlValue& value = required(key);
  if (value.type != TomlValue::Type::text) fail(key, fmt::format("must be a string, found {}", describe(value)));
  if (value.text.find('\0') != std::string::npos) fail(key, "must not contain a null character");
  return value.text;
}

std::string TableReader::text(std::string_view key, std::string otherwise) const { return has(key) ? text(key) : std::move(otherwise); }

std::size_t TableReader::word(std::string_view key, std::span<const std::string> words) const {
  const TomlValue& value = required(key);
  if (value.type != TomlValue::Type::text)
    fail(key, fmt::format("must be one of the words {}; found {}", list_words(words), describe(value)));
  const auto at = std::find(words.begin(), words.end(), value.text);
  if (at == words.end()) {
    const std::string hint = did_you_mean(value.text, words);
    fail(key, fmt::format("is {}, which is unknown{}{} allowed: {}", quote(value.text), hint, hint.empty() ? ";" : "", list_words(words)));
  }
  return static_cast<std::size_t>(at - words.begin());
}

std::size_t TableReader::word(std::string_view key, std::span<const std::string> words, std::size_t otherwise) const {
  return has(key) ? word(key, words) : otherwise;
}

std::vector<double> TableReader::checked_numbers(std::string_view key, const TomlValue& value, std::size_t low, std::size_t high,
                                                 std::span<const Range> ranges) const {
  const std::string count = low == high        ? fmt::format("{}", low)
                            : high == SIZE_MAX ? fmt::format("at least {}", low)
                                               : fmt::format("{} to {}", low, high);
  if (is_array_text(value)) return checked_numbers(key, split_array_text(value), low, high, ranges);
  if (value.type != TomlValue::Type::array) fail(key, fmt::format("must be an array of {} numbers, found {}", count, describe(value)));
  if (value.items.size() < low || value.items.size() > high)
    fail(key, fmt::format("must have {} number{}, found {}", count, high == 1 ? "" : "s", value.items.size()));
  std::vector<double> result;
  result.reserve(value.items.size());
  for (std::size_t i = 0; i < value.items.size(); ++i)
    result.push_back(checked_number(key, value.items[i], ranges[std::min(i, ranges.size() - 1)], fmt::format("entry {} ", i + 1)));
  return result;
}

std::vector<double> TableReader::numbers(std::string_view key, std::size_t low, std::size_t high, Range range) const {
  return checked_numbers(key, required(key), low, high, std::span(&range, 1));
}

std::vector<double> TableReader::numbers(std::string_view key, std::span<const Range> ranges) const {
  return checked_numbers(key, required(key), ranges.size(), ranges.size(), ranges);
}

std::vector<double> TableReader::number_or_numbers(std::string_view key, std::size_t low, std::size_t high, Range range) const {
  const TomlValue& value = required(key);
  if (value.type == TomlValue::Type::array || is_array_text(value)) return checked_numbers(key, value, low, high, std::span(&range, 1));
  const double x = checked_number(key, value, range, "");
  if (low > 1) fail(key, fmt::format("must be an array of {} numbers, found {}", low, describe(value)));
  return {x};
}

Vec3 TableReader::vector3(std::string_view key, const char* unit) const {
  const std::vector<double> v = numbers(key, 3, 3, any_number.in(unit));
  return {v[0], v[1], v[2]};
}

Vec3 TableReader::vector3(std::string_view key, const Vec3& otherwise, const char* unit) const {
  return has(key) ? vector3(key, unit) : otherwise;
}

Vec3 TableReader::direction(std::string_view key, const Vec3& otherwise) const {
  const Vec3 v = vector3(key, otherwise);
  // stableNorm: the squares of small and huge components neither vanish nor overflow
  const double norm = v.stableNorm();
  if (!(norm > 0.0) || !std::isfinite(norm)) fail(key, "must be a direction, not a zero vector");
  return (v / norm).stableNormalized();
}

std::vector<int> TableReader::integers(std::string_view key, int low, int high) const {
  const TomlValue& value = required(key);
  if (value.type != TomlValue::Type::array) fail(key, fmt::format("must be an array of whole numbers, found {}", describe(value)));
  std::vector<int> result;
  for (const TomlValue& item : value.items) {
    if (item.type != TomlValue::Type::integer || item.integer < low || item.integer > high)
      fail(key, fmt::format("must hold whole numbers from {} to {}, found {}", low, high, describe(item)));
    result.push_back(static_cast<int>(item.integer));
  }
  return result;
}

std::vector<std::string> TableReader::texts(std::string_view key) const {
  const TomlValue& value = required(key);
  if (value.type != TomlValue::Type::array) fail(key, fmt::format("must be an array of strings, found {}", describe(value)));
  std::vector<std::string> result;
  for (const TomlValue& item : value.items) {
    if (item.type != TomlValue::Type::text) fail(key, fmt::format("must be an array of strings, found {} in it", describe(item)));
    result.push_back(item.text);
  }
  return result;
}

MatX TableReader::matrix(std::string_view key) const { return matrix(key, any_number); }

MatX TableReader::matrix(std::string_view key, const Range& range) const { return matrix(key, std::span(&range, 1)); }

MatX TableReader::matrix(std::string_view key, std::span<const Range> columns) const {
  const TomlValue& given = required(key);
  TomlValue split;
  if (is_array_text(given)) {
    split = split_array_text(given);
    for (TomlValue& row : split.items)
      if (is_array_text(row)) row = split_array_text(row);
  }
  const TomlValue& value = is_array_text(given) ? split : given;
  if (value.type != TomlValue::Type::array || value.items.empty())
    fail(key, fmt::format("must be a matrix (an array of rows), found {}", describe(value)));
  std::vector<Range> ranges(columns.begin(), columns.end());
  for (Range& range : ranges) range.doubted = false;
  // all rows are checked before the matrix is sized: its size must not exceed what the file holds
  const std::size_t width = value.items[0].items.size();
  for (std::size_t i = 0; i < value.items.size(); ++i) {
    const TomlValue& row = value.items[i];
    if (row.type != TomlValue::Type::array || row.items.empty())
      fail(key, fmt::format("must be a matrix (an array of rows), found {} as row {}", describe(row), i + 1));
    if (row.items.size() != width)
      fail(key, fmt::format("must have rows of equal length: row 1 has {}, row {} has {}", width, i + 1, row.items.size()));
  }
  MatX result(static_cast<Eigen::Index>(value.items.size()), static_cast<Eigen::Index>(width));
  for (std::size_t i = 0; i < value.items.size(); ++i) {
    const std::vector<double> row = checked_numbers(key, value.items[i], width, width, ranges);
    result.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), static_cast<Eigen::Index>(width));
  }
  return result;
}

std::optional<TableReader> TableReader::table(std::string_view key) const {
  const TomlValue* value = find(key);
  if (!value) return std::nullopt;
  if (value->type != TomlValue::Type::table) fail(key, fmt::format("must be a table {{...}}, found {}", describe(*value)));
  if (label_.empty()) return inside(*value, fmt::format("[{}]", key), {});
  return inside(*value, label_, prefix_ + std::string(key) + ".");
}

TableReader TableReader::inside(const TomlValue& table, std::string label, std::string prefix) const {
  TableReader reader(table, table.file ? *table.file : file_, std::move(label), std::move(prefix));
  reader.parameters_ = parameters_;
  return reader;
}

std::vector<TableReader> TableReader::tables(std::string_view key) const {
  std::vector<TableReader> result;
  const TomlValue* value = find(key);
  if (!value) return result;
  if (value->type == TomlValue::Type::table) fail(key, fmt::format("must be an array of tables: write [[{}]], not [{}]", key, key));
  if (value->type != TomlValue::Type::array) fail(key, fmt::format("must be an array of tables [[{}]], found {}", key, describe(*value)));
  for (const TomlValue& item : value->items) {
    if (item.type != TomlValue::Type::table)
      fail(key, fmt::format("must be an array of tables [[{}]], found {} in it", key, describe(item)));
    result.push_back(inside(item, fmt::format("[[{}]]", key), {}));
  }
  return result;
}

}  // namespace flexframe::sim
