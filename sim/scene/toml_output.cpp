#include "sim/scene/toml_output.h"

#include <cmath>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

std::string text_of(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += fmt::format("\\{}", c);
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    else out += c;
  }
  return out + '"';
}

std::string key_of(const std::string& key) {
  const bool bare = !key.empty() && key.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") == key.npos;
  return bare ? key : text_of(key);
}

std::string number_of(double x) {
  if (std::isnan(x)) return "nan";
  if (std::isinf(x)) return x > 0.0 ? "inf" : "-inf";
  const std::string digits = fmt::format("{}", x);
  return digits.find_first_of(".e") == std::string::npos ? digits + ".0" : digits;
}

std::string inline_of(const TomlValue& value) {
  std::string out;
  switch (value.type) {
    case TomlValue::Type::boolean:
      return value.boolean ? "true" : "false";
    case TomlValue::Type::integer:
      return fmt::format("{}", value.integer);
    case TomlValue::Type::real:
      return number_of(value.real);
    case TomlValue::Type::text:
      return text_of(value.text);
    case TomlValue::Type::date:
      return text_of("");
    case TomlValue::Type::array:
      for (const TomlValue& item : value.items) out += (out.empty() ? "" : ", ") + inline_of(item);
      return "[" + out + "]";
    case TomlValue::Type::table:
      for (std::size_t k = 0; k < value.items.size(); ++k)
        out += fmt::format("{}{} = {}", out.empty() ? "" : ", ", key_of(value.keys[k]), inline_of(value.items[k]));
      return out.empty() ? "{}" : "{ " + out + " }";
  }
  return {};
}

void write_table(const TomlValue& table, const std::string& head, std::string& out) {
  out += "\n" + head + "\n";
  for (std::size_t k = 0; k < table.items.size(); ++k) out += fmt::format("{} = {}\n", key_of(table.keys[k]), inline_of(table.items[k]));
}

bool is_table_list(const TomlValue& value) {
  return value.type == TomlValue::Type::array && !value.items.empty() && value.items.front().type == TomlValue::Type::table;
}

}  // namespace

std::string write_toml(const TomlValue& root) {
  std::string out;
  // Keys of the root itself stand before the first table.
  for (std::size_t k = 0; k < root.items.size(); ++k)
    if (root.items[k].type != TomlValue::Type::table && !is_table_list(root.items[k]))
      out += fmt::format("{} = {}\n", key_of(root.keys[k]), inline_of(root.items[k]));
  for (std::size_t k = 0; k < root.items.size(); ++k) {
    const TomlValue& value = root.items[k];
    if (value.type == TomlValue::Type::table) write_table(value, fmt::format("[{}]", key_of(root.keys[k])), out);
    if (is_table_list(value))
      for (const TomlValue& item : value.items) write_table(item, fmt::format("[[{}]]", key_of(root.keys[k])), out);
  }
  return out;
}

TomlValue toml_text(std::string text) {
  TomlValue out;
  out.type = TomlValue::Type::text;
  out.text = std::move(text);
  return out;
}
TomlValue toml_number(double number) {
  TomlValue out;
  out.type = TomlValue::Type::real;
  out.real = number;
  return out;
}
TomlValue toml_count(std::int64_t count) {
  TomlValue out;
  out.type = TomlValue::Type::integer;
  out.integer = count;
  out.real = static_cast<double>(count);
  return out;
}
TomlValue toml_truth(bool truth) {
  TomlValue out;
  out.type = TomlValue::Type::boolean;
  out.boolean = truth;
  return out;
}
TomlValue toml_list(std::vector<TomlValue> items) {
  TomlValue out;
  out.type = TomlValue::Type::array;
  out.items = std::move(items);
  return out;
}
TomlValue toml_texts(std::span<const std::string> texts) {
  std::vector<TomlValue> items;
  for (const std::string& text : texts) items.push_back(toml_text(text));
  return toml_list(std::move(items));
}
void toml_put(TomlValue& table, const std::string& key, TomlValue value) {
  table.keys.push_back(key);
  table.key_lines.push_back(0);
  table.items.push_back(std::move(value));
}

}  // namespace flexframe::sim
