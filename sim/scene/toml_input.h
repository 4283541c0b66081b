// Checked access to a TOML file: every wrong thing is answered with file, line, table, key, what was found and what is allowed.
//
//   const TomlValue document = read_toml("scene.toml");
//   TableReader root(document, "scene.toml", "");
//   root.set_parameters(parameters);                       // numbers may be texts: "L/2", "10 mm" (parameters.h, units.h)
//   root.allow({"title", "render"});                       // unknown keys are refused, the nearest known word named
//   if (auto render = root.table("render")) fps = render->number("frame_rate", 30.0, positive);
//
// All functions throw InputError. The parser (toml++) stays behind toml_input.cpp.
#pragma once

#include "sim/base/types.h"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

class Parameters;

struct TomlValue {
  enum class Type { boolean, integer, real, text, date, array, table };
  Type type = Type::table;
  int line = 0;  // 1-based; of the value (a table: of its header)
  bool boolean = false;
  std::int64_t integer = 0;
  double real = 0.0;
  std::string text;               // UTF-8
  std::vector<TomlValue> items;   // elements of an array, values of a table (in the file's order)
  std::vector<std::string> keys;  // of a table, parallel to items
  std::vector<int> key_lines;
  std::shared_ptr<const std::string> file;  // of a table that comes from an included file: that file's name; else null

  // The value of a key of this table, or null.
  const TomlValue* find(std::string_view key) const;
  TomlValue* find(std::string_view key);
};

// The root table. Syntax errors name line and column. `name` appears in messages.
TomlValue parse_toml(std::string_view text, const std::string& name);

// The file's text: refuses what is missing, no file, empty, binary or larger than 8 MiB.
std::string read_text_file(const std::filesystem::path& path);
TomlValue read_toml(const std::filesystem::path& path);

// "the string 'abc'", "the number 3", "an array of 2 values".
std::string describe(const TomlValue& value);

// Allowed numbers; always finite. `what` completes "must be ...". `unit`: the number's own, "m" or "N m/rad"; with it the number may be
// written as a text with any unit of the same dimension. "": no dimension. nullptr: no unit may be written.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool open_low = false, open_high = false;
  const char* what = "a number";
  const char* unit = nullptr;
  bool doubted = true;  // angles of many turns without a unit: as if they were degrees; not those of tables, which shafts run through

  // The same range of numbers with this unit.
  constexpr Range in(const char* its_unit) const {
    Range range = *this;
    range.unit = its_unit;
    return range;
  }
};
inline constexpr Range any_number{};
inline constexpr Range positive{.low = 0.0, .open_low = true, .what = "a number > 0"};
inline constexpr Range not_negative{.low = 0.0, .what = "a number >= 0"};
inline constexpr Range fraction{.low = 0.0, .high = 1.0, .what = "a number from 0 to 1"};

// One table of the file. Holds references to the document: keep that alive.
class TableReader {
 public:
  // label: "[[body]] 'crank'" or empty for the root.
  TableReader(const TomlValue& table, std::string file, std::string label, std::string prefix = {});

  // Refuses keys that are not among these.
  void allow(std::span<const std::string> keys) const;
  void allow(std::initializer_list<std::string> keys) const;

  // Is the key there; its value or null; its value, or an InputError that it is missing.
  bool has(std::string_view key) const { return find(key) != nullptr; }
  const TomlValue* find(std::string_view key) const;
  const TomlValue& required(std::string_view key) const;

  // Without a default the key is required.
  double number(std::string_view key, Range range = any_number) const;
  double number(std::string_view key, double otherwise, Range range) const;
  std::optional<double> optional_number(std::string_view key, Range range = any_number) const;
  int integer(std::string_view key, int low, int high) const;
  int integer(std::string_view key, int otherwise, int low, int high) const;
  bool boolean(std::string_view key, bool otherwise) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string otherwise) const;
  std::size_t word(std::string_view key, std::span<const std::string> words) const;  // index of the word
  std::size_t word(std::string_view key, std::span<const std::string> words, std::size_t otherwise) const;

  // Arrays of numbers with count_low..count_high entries.
  std::vector<double> numbers(std::string_view key, std::size_t count_low, std::size_t count_high, Range range = any_number) const;
  std::vector<double> number_or_numbers(std::string_view key, std::size_t count_low, std::size_t count_high,
                                        Range range = any_number) const;
  // An array with one number for each range, in their order.
  std::vector<double> numbers(std::string_view key, std::span<const Range> ranges) const;
  Vec3 vector3(std::string_view key, const char* unit = nullptr) const;
  Vec3 vector3(std::string_view key, const Vec3& otherwise, const char* unit = nullptr) const;
  Vec3 direction(std::string_view key, const Vec3& otherwise) const;  // normalised; zero is refused
  std::vector<int> integers(std::string_view key, int low, int high) const;
  std::vector<std::string> texts(std::string_view key) const;
  MatX matrix(std::string_view key) const;  // array of rows of equal length
  MatX matrix(std::string_view key, const Range& range) const;
  MatX matrix(std::string_view key, std::span<const Range> columns) const;  // a range for each column, the last one for all further

  // A table inside ({...} or [a.b]); several ([[a]]). An absent key: none.
  std::optional<TableReader> table(std::string_view key) const;
  std::vector<TableReader> tables(std::string_view key) const;

  const TomlValue& value() const { return *table_; }
  int line() const { return table_->line; }
  int line(std::string_view key) const;  // the key's line, the table's when the key is absent
  const std::string& file() const { return file_; }
  void set_label(std::string label) { label_ = std::move(label); }

  // The scene's parameters, for this reader and those made from it afterwards. Held by reference. Without: numbers and units only.
  void set_parameters(const Parameters& parameters) { parameters_ = &parameters; }
  const Parameters& parameters() const;

  // "FILE:LINE: [[body]] 'crank': key 'length' MESSAGE"
  [[noreturn]] void fail(std::string_view key, const std::string& message) const;
  // Notes the same as a doubt of the scene, which a run warns of.
  void doubt(std::string_view key, const std::string& message) const;
  bool unitless(std::string_view key) const;  // a number or an array of them that is there, without a unit
  // "FILE:LINE: [[body]] 'crank': MESSAGE"
  [[noreturn]] void fail(const std::string& message) const;

 private:
  double checked_number(std::string_view key, const TomlValue& value, Range range, const std::string& which) const;
  double text_number(std::string_view key, const TomlValue& value, Range range, const std::string& which) const;
  TableReader inside(const TomlValue& table, std::string label, std::string prefix) const;
  // `ranges`: one an entry, the last one for all further.
  std::vector<double> checked_numbers(std::string_view key, const TomlValue& value, std::size_t low, std::size_t high,
                                      std::span<const Range> ranges) const;
  std::string full_key(std::string_view key) const;
  // Notes as a doubt of the scene an angle without a unit that looks like degrees.
  void doubt_degrees(std::string_view key, const TomlValue& value, const Range& range, double x) const;
  std::string key_at(std::string_view key) const;  // "FILE:LINE: [[body]] 'crank': key 'length'"
  std::string place(int line) const;               // "FILE:LINE"; "FILE" of what no line of it says (--set)

  const TomlValue* table_;
  const Parameters* parameters_ = nullptr;
  std::string file_, label_, prefix_;
  mutable std::vector<std::string> allowed_;  // keys, once they are known
};

}  // namespace flexframe::sim
