#include "sim/scene/document.h"

#include "sim/base/words.h"
#include "sim/scene/instances.h"
#include "sim/scene/toml_output.h"

#include <algorithm>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

namespace fs = std::filesystem;

constexpr int deepest_include = 16;

const std::vector<std::string> root_keys{"title", "include", "parameters", "simulation", "ground", "group",    "instance", "body",
                                         "joint", "force",   "output",     "render",     "input",  "coupling", "block"};
const std::vector<std::string> part_keys{"include", "parameters", "group", "instance", "body", "joint",
                                         "force",   "output",     "input", "coupling", "block"};
const std::vector<std::string> listed{"group", "instance", "body", "joint", "force", "output", "input", "coupling", "block"};

TomlValue& entry(TomlValue& table, const std::string& key, TomlValue::Type type, int line) {
  if (TomlValue* found = table.find(key)) return *found;
  table.keys.push_back(key);
  table.key_lines.push_back(line);
  TomlValue value;
  value.type = type;
  value.line = line;
  table.items.push_back(std::move(value));
  return table.items.back();
}

// Names of files in an included table are relative to that table's file: seen from the scene's folder.
void move_files(TomlValue& value, const fs::path& folder, const fs::path& scene_folder) {
  for (std::size_t k = 0; k < value.items.size(); ++k) {
    TomlValue& item = value.items[k];
    const bool file = value.type == TomlValue::Type::table && (value.keys[k] == "mesh" || value.keys[k] == "file");
    if (file && item.type == TomlValue::Type::text && !item.text.empty() && fs::path(item.text).is_relative())
      item.text = (folder / item.text).lexically_proximate(scene_folder.empty() ? fs::path(".") : scene_folder).string();
    if (item.type == TomlValue::Type::table || item.type == TomlValue::Type::array) move_files(item, folder, scene_folder);
  }
}

// Puts the tables of `part` before those of `whole`; of two parameters of one name that of `whole` counts.
void merge(TomlValue& whole, TomlValue part, const std::shared_ptr<const std::string>& file) {
  for (std::size_t k = 0; k < part.items.size(); ++k) {
    const std::string& key = part.keys[k];
    if (key == "include") continue;
    TomlValue& value = part.items[k];
    if (key == "parameters") {
      TomlValue& own = entry(whole, key, TomlValue::Type::table, 0);
      for (std::size_t p = 0; p < value.items.size(); ++p)
        if (!own.find(value.keys[p])) {
          own.keys.push_back(value.keys[p]);
          own.key_lines.push_back(0);
          own.items.push_back(value.items[p]);
        }
      continue;
    }
    for (TomlValue& item : value.items)
      if (!item.file) item.file = file;
    TomlValue& own = entry(whole, key, TomlValue::Type::array, value.line);
    own.items.insert(own.items.begin(), std::make_move_iterator(value.items.begin()), std::make_move_iterator(value.items.end()));
  }
}

void check_lists(const TableReader& reader) {
  for (const std::string& key : listed) reader.tables(key);
  reader.table("parameters");
}

// Includes of `root`, which lies in `file`, and theirs. `open`: the files on the way here.
void include_files(TomlValue& root, const fs::path& file, const fs::path& scene_folder, std::vector<fs::path>& open) {
  const TableReader reader(root, file.string(), "");
  if (!reader.has("include")) return;
  const bool one = reader.find("include")->type == TomlValue::Type::text;
  const std::vector<std::string> names = one ? std::vector{reader.text("include")} : reader.texts("include");
  for (auto name = names.rbegin(); name != names.rend(); ++name) {  // NOLINT(modernize-loop-convert): from the last to the first
    if (name->empty()) reader.fail("include", "is empty; a file name is expected");
    fs::path path(*name);
    if (path.is_relative()) path = file.parent_path() / path;
    std::error_code error;
    const fs::path real = fs::weakly_canonical(path, error);
    if (std::find(open.begin(), open.end(), real) != open.end())
      reader.fail("include", fmt::format("names the file {}, which includes this one: a circle", quote(*name)));
    if (open.size() >= deepest_include) reader.fail("include", fmt::format("goes deeper than {} files", deepest_include));
    TomlValue part;
    try {
      part = read_toml(path);
    } catch (const InputError& problem) {
      reader.fail("include", fmt::format("names the file {}, which cannot be used: {}", quote(*name), problem.what()));
    }
    const TableReader inside(part, path.string(), "");
    inside.allow(part_keys);
    check_lists(inside);
    move_files(part, path.parent_path(), scene_folder);
    open.push_back(real);
    include_files(part, path, scene_folder, open);
    open.pop_back();
    merge(root, std::move(part), std::make_shared<const std::string>(path.string()));
  }
}

// "PATH=VALUE": the value as TOML reads it, else a text.
std::pair<std::string, TomlValue> parse_setting(const std::string& setting) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0)
    throw InputError(
        fmt::format("--set {} must be NAME=VALUE or TABLE.NAME.KEY=VALUE, for example --set body.rod.length=0.4", quote(setting)));
  const std::string value = setting.substr(equals + 1);
  TomlValue parsed;
  try {
    parsed = parse_toml("value = " + value, "--set").items.at(0);
  } catch (const InputError&) {
    parsed.type = TomlValue::Type::text;
    parsed.text = value;
  }
  return {setting.substr(0, equals), std::move(parsed)};
}

std::vector<std::string> split_path(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.') parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
}

[[noreturn]] void refuse_setting(const std::string& path, const std::string& message) {
  throw InputError(fmt::format("--set {}: {}", path, message));
}

// "; did you mean 'length'?", or the sign before what there is.
std::string hint(const std::string& word, const std::vector<std::string>& known) {
  const std::string out = did_you_mean(word, known);
  return out.empty() ? ";" : out;
}

void set_parameter(TomlValue& root, const std::string& name, TomlValue value) {
  TomlValue* table = root.find("parameters");
  TomlValue* old = table ? table->find(name) : nullptr;
  if (!old) {
    const std::vector<std::string> known = table ? table->keys : std::vector<std::string>{};
    if (known.empty())
      refuse_setting(name, fmt::format("the scene has no parameter {} and no [parameters] at all; a key of a table is set as "
                                       "TABLE.NAME.KEY=VALUE",
                                       quote(name)));
    refuse_setting(name, fmt::format("the scene has no parameter {}{} there are {}", quote(name), hint(name, known), list_words(known)));
  }
  value.line = old->line;
  *old = std::move(value);
}

void set_key(TomlValue& root, const std::string& path, TomlValue value) {
  const std::vector<std::string> parts = split_path(path);
  const bool by_name = std::find(listed.begin() + 2, listed.end(), parts[0]) != listed.end();
  if (!by_name && parts[0] != "simulation" && parts[0] != "render" && parts[0] != "ground")
    refuse_setting(path,
                   fmt::format("{} is no table of a scene; allowed: a parameter, simulation.KEY, render.KEY, and body, joint, force or "
                               "output with NAME.KEY",
                               quote(parts[0])));
  const std::size_t first = by_name ? 2 : 1;
  if (parts.size() <= first) refuse_setting(path, "a key is missing behind the table");
  TomlValue* at = nullptr;
  if (by_name) {
    std::vector<std::string> known;
    if (TomlValue* list = root.find(parts[0]))
      for (TomlValue& item : list->items)
        if (const TomlValue* name = item.find("name")) {
          known.push_back(name->text);
          if (name->text == parts[1]) at = &item;
        }
    if (!at)
      refuse_setting(path,
                     fmt::format("there is no {} {}{} there are {}", parts[0], quote(parts[1]), hint(parts[1], known), list_words(known)));
  } else {
    at = &entry(root, parts[0], TomlValue::Type::table, 0);
  }
  for (std::size_t k = first; k + 1 < parts.size(); ++k) {
    at = &entry(*at, parts[k], TomlValue::Type::table, at->line);
    if (at->type != TomlValue::Type::table) refuse_setting(path, fmt::format("{} is {} and has no keys", quote(parts[k]), describe(*at)));
  }
  value.line = at->line;
  entry(*at, parts.back(), value.type, at->line) = std::move(value);
}

void erase_key(TomlValue& table, const std::string& key) {
  for (std::size_t k = table.keys.size(); k-- > 0;)
    if (table.keys[k] == key) {
      const auto at = static_cast<std::ptrdiff_t>(k);
      table.keys.erase(table.keys.begin() + at);
      table.key_lines.erase(table.key_lines.begin() + at);
      table.items.erase(table.items.begin() + at);
    }
}

// Keys that say the same thing in other ways than a set one: the file's go, as its own value of that key does.
struct OtherWays {
  std::string_view key;
  std::vector<std::string> gone;
};
const std::vector<OtherWays> other_ways = {
    {"simulation.tolerance", {"accuracy"}},
    {"simulation.accuracy", {"tolerance"}},
    {"render.camera.views", {"path", "position", "target", "direction", "orbit", "preset", "fit"}},
    {"render.camera.position", {"path", "views", "direction", "preset", "fit", "window"}},
    {"render.camera.direction", {"path", "views", "position", "target", "preset", "fit"}},
    {"render.camera.path", {"views", "position", "target", "direction", "preset", "window"}},
    {"render.camera.preset", {"path", "views", "position", "target", "direction"}},
};

void make_room(TomlValue& root, const std::string& path) {
  const auto way = std::find_if(other_ways.begin(), other_ways.end(), [&](const OtherWays& w) { return w.key == path; });
  if (way == other_ways.end()) return;
  const std::vector<std::string> parts = split_path(path);
  TomlValue* at = &root;
  for (std::size_t k = 0; at && k + 1 < parts.size(); ++k) at = at->find(parts[k]);
  if (!at || at->type != TomlValue::Type::table) return;
  for (const std::string& key : way->gone) erase_key(*at, key);
}

Parameters read_parameters(const TableReader& root) {
  Parameters parameters;
  const auto reader = root.table("parameters");
  if (!reader) return parameters;
  for (const std::string& name : reader->value().keys) {
    const TomlValue& value = *reader->find(name);
    const bool number = value.type == TomlValue::Type::integer || value.type == TomlValue::Type::real;
    if (!number && value.type != TomlValue::Type::text)
      reader->fail(name, fmt::format("must be a number, or a text that says one, found {}", describe(value)));
    try {
      parameters.add(name, number ? fmt::format("{}", value.real) : value.text);
    } catch (const InputError& error) {
      reader->fail(name, error.what());
    }
  }
  for (const std::string& name : reader->value().keys) {
    try {
      parameters.number(name, nullptr);
    } catch (const InputError& error) {
      reader->fail(name, fmt::format("has no value: {}", error.what()));
    }
  }
  return parameters;
}

}  // namespace

SceneDocument parse_document(std::string_view text, const fs::path& name, std::span<const std::string> settings) {
  SceneDocument document;
  document.file = name;
  document.text = std::string(text);
  document.root = parse_toml(text, name.string());
  const TableReader reader(document.root, name.string(), "");
  reader.allow(root_keys);
  check_lists(reader);

  bool changed = reader.has("include");
  std::error_code error;
  std::vector<fs::path> open{fs::weakly_canonical(name, error)};
  include_files(document.root, name, name.parent_path(), open);
  std::vector<std::pair<std::string, TomlValue>> keys;
  for (const std::string& setting : settings) {
    auto [path, value] = parse_setting(setting);
    if (path.find('.') == std::string::npos) set_parameter(document.root, path, std::move(value));
    else keys.emplace_back(path, std::move(value));
    changed = true;
  }
  document.parameters = read_parameters(reader);
  if (reader.has("instance") || reader.has("group")) {
    place_instances(document.root, name.string(), document.parameters);
    changed = true;
  }
  for (const auto& [path, value] : keys) make_room(document.root, path);
  for (auto& [path, value] : keys) set_key(document.root, path, std::move(value));
  if (!changed) return document;

  TomlValue& root = document.root;
  for (const char* gone : {"include", "group", "instance"}) erase_key(root, gone);
  std::string made;
  for (const std::string& setting : settings) made += fmt::format(" --set {}", quote(setting));
  document.text = fmt::format("# {} as it was run{}: settings, included files and instances in their place\n{}",
                              quote(name.filename().string()), made.empty() ? "" : " with" + made, write_toml(root));
  return document;
}

SceneDocument read_document(const fs::path& file, std::span<const std::string> settings) {
  return parse_document(read_text_file(file), file, settings);
}

}  // namespace flexframe::sim
