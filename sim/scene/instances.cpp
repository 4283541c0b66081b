#include "sim/scene/instances.h"

#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/scene/readings.h"
#include "sim/scene/rotation_input.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

const std::vector<std::string> kinds{"body", "joint", "coupling", "force", "block", "output"};

// Keys whose texts are words and names, not numbers.
const std::set<std::string, std::less<>> word_keys{
    "name",  "kind",     "model",       "mesh",   "file",   "color",    "parent", "child",       "on",      "from",
    "of",    "quantity", "frame",       "shape",  "frames", "boundary", "shown",  "effects",     "without", "ports",
    "euler", "drawing",  "relative_to", "joints", "joint",  "carrier",  "unit",   "description", "through"};
// Of these, the ones that name bodies, joints and forces, or a frame behind a dot.
const std::set<std::string, std::less<>> reference_keys{"parent",      "child",  "on",    "from",    "of",
                                                        "relative_to", "joints", "joint", "carrier", "through"};

struct Copy {
  const TableReader* instance = nullptr;
  std::string name;                          // "b2"
  Parameters all;                            // the scene's and the group's
  Parameters own;                            // the group's and i, as numbers
  std::map<std::string, std::string> words;  // parameters that are texts
  std::set<std::string> inside;              // bodies, joints and whatever else of the group is referred to by name
  std::set<std::string> outputs;             // outputs and blocks of the group, which its expressions read
  Vec3 position = Vec3::Zero();
  Mat3 turn = Mat3::Identity();
};

// "{expression}" in names and words; in expressions a number stands in brackets.
std::string fill(const Copy& copy, const std::string& text, bool expression = false) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = text.find('{', at), close = text.find('}', at);
    if (open == std::string::npos || close == std::string::npos || close < open) {
      out.append(text, at);
      break;
    }
    out.append(text, at, open - at);
    const std::string inner = text.substr(open + 1, close - open - 1);
    if (const auto word = copy.words.find(inner); word != copy.words.end()) {
      out += word->second;
    } else {
      try {
        const double x = copy.all.number(inner, nullptr);
        const std::string number = x == std::round(x) && std::abs(x) < 1e15 ? fmt::format("{:.0f}", x) : fmt::format("{}", x);
        out += expression ? "(" + number + ")" : number;
      } catch (const InputError& error) {
        copy.instance->fail(fmt::format("makes no word of {} in its group: {}", quote(text), error.what()));
      }
    }
    at = close + 1;
  }
  return out;
}

// The longest name of an output or block of the group that stands there; empty: none.
std::string output_at(const Copy& copy, const std::string& text, std::size_t at) {
  std::string longest;
  for (const std::string& name : copy.outputs) {
    const std::size_t end = at + name.size();
    if (name.size() <= longest.size() || text.compare(at, name.size(), name) != 0) continue;
    const auto in_word = [&](std::size_t k) { return std::isalnum(static_cast<unsigned char>(text[k])) || text[k] == '_'; };
    if (end == text.size() || !in_word(end) || !in_word(end - 1)) longest = name;
  }
  return longest;
}

// Expressions read the outputs of their own group.
std::string name_readings(const Copy& copy, const std::string& text) {
  std::string out;
  std::size_t done = 0;
  std::set<std::size_t> units;
  for (const UnitWord& word : unit_words(text))
    if (only_a_unit(word, text)) units.insert(word.at);
  for (const NameInText& name : names_in(text)) {
    const bool component = name.at > 0 && text[name.at - 1] == '.';
    if (component || name.at < done || units.contains(name.at)) continue;
    const std::string found = output_at(copy, text, name.at);
    if (found.empty()) continue;
    out.append(text, done, name.at - done);
    out += copy.name + ":" + found;
    done = name.at + found.size();
  }
  return out.append(text, done, std::string::npos);
}

void rewrite(const Copy& copy, TomlValue& value, const std::string& key, bool words) {
  using Type = TomlValue::Type;
  if (value.type == Type::text) {
    if (!words) {
      try {
        const std::string filled = fill(copy, value.text, true);
        if (key == "value" || key == "expression" || key == "input")
          doubt_parameters(copy.own, filled, {copy.outputs.begin(), copy.outputs.end()});
        value.text = name_readings(copy, copy.own.substitute_beside_units(filled));
      } catch (const InputError& error) {
        copy.instance->fail(error.what());
      }
      return;
    }
    value.text = fill(copy, value.text);
    if (key == "name") value.text = copy.name + ":" + value.text;
    if (!reference_keys.contains(key)) return;
    const std::size_t dot = value.text.find('.');
    if (copy.inside.contains(value.text.substr(0, dot))) value.text = copy.name + ":" + value.text;
  } else if (value.type == Type::array) {
    for (TomlValue& item : value.items) rewrite(copy, item, key, words);
  } else if (value.type == Type::table) {
    for (std::size_t k = 0; k < value.items.size(); ++k) {
      // Ends of a shape are frames of its own body, or numbers.
      if (key == "shapes" && (value.keys[k] == "from" || value.keys[k] == "to")) {
        rewrite(copy, value.items[k], "end", value.items[k].type == Type::text && !value.items[k].text.starts_with('['));
        continue;
      }
      // Names of frames are keys; what stands behind them are numbers.
      const bool inner_words = key == "drawing" || (key != "frames" && value.keys[k] != "frames" && word_keys.contains(value.keys[k]));
      rewrite(copy, value.items[k], key == "initial" ? key : value.keys[k], inner_words);
    }
  }
}

void set_numbers(TomlValue& table, const std::string& key, const Vec3& numbers) {
  TomlValue list;
  list.type = TomlValue::Type::array;
  list.line = table.line;
  for (const double x : numbers) {
    TomlValue item;
    item.type = TomlValue::Type::real;
    item.line = table.line;
    item.real = x;
    list.items.push_back(std::move(item));
  }
  if (TomlValue* old = table.find(key)) {
    *old = std::move(list);
    return;
  }
  table.keys.push_back(key);
  table.key_lines.push_back(table.line);
  table.items.push_back(std::move(list));
}

// Moves and turns what hangs on bodies outside the group, or on the world.
void place(const Copy& copy, TomlValue& table, const std::string& kind, const std::string& file) {
  if (copy.turn == Mat3::Identity() && copy.position == Vec3::Zero()) return;
  TableReader reader(table, table.file ? *table.file : file, fmt::format("[[{}]]", kind));
  reader.set_parameters(copy.all);
  if (kind == "joint" && reader.has("parent")) {
    const std::string parent = reader.text("parent");
    const std::string body = parent.substr(0, parent.find('.'));
    if (body.starts_with(copy.name + ":") && copy.inside.contains(body.substr(copy.name.size() + 1))) return;
    const Vec3 position = copy.position + copy.turn * reader.vector3("position", Vec3::Zero(), "m");
    const Mat3 turn = copy.turn * rotation_exp(read_rotation(reader, "rotation"));
    set_numbers(table, "position", position);
    set_numbers(table, "rotation", rotation_log(turn));
  }
  if (kind == "force" && reader.has("direction") && reader.text("frame", "world") == "world")
    set_numbers(table, "direction", copy.turn * reader.vector3("direction"));
}

std::string text_of(const TableReader& reader, const std::string& name) {
  const TomlValue& value = *reader.find(name);
  if (value.type == TomlValue::Type::text) return value.text;
  if (value.type == TomlValue::Type::integer || value.type == TomlValue::Type::real) return fmt::format("{}", value.real);
  reader.fail(name, fmt::format("must be a number or a text, found {}", describe(value)));
}

// The group's parameters, with those of the instance in their place.
void set_parameters(const TableReader& group, const TableReader& instance, const Parameters& scene, int number, Copy& copy) {
  Parameters outer = scene;
  outer.add("i", fmt::format("{}", number));
  copy.all = outer;
  const auto defaults = group.table("parameters");
  const auto given = instance.table("parameters");
  if (given && !defaults) instance.fail("parameters", "are given, but the group has none");
  if (given) given->allow(defaults->value().keys);
  std::vector<std::string> names{"i"};
  if (defaults)
    for (const std::string& name : defaults->value().keys) {
      const bool own = given && given->has(name);
      const std::string text = text_of(own ? *given : *defaults, name);
      try {
        // An instance's text sees the scene's parameters, so that L = "L" hands one on.
        copy.all.add(name, own ? fmt::format("{}", outer.number(text, nullptr)) : text);
        names.push_back(name);
      } catch (const InputError&) {
        copy.words[name] = text;
      }
    }
  for (const std::string& name : names) {
    try {
      copy.own.add(name, fmt::format("{}", copy.all.number(name, nullptr)));
    } catch (const InputError& error) {
      // A default that is no number is a word.
      if (!defaults || !defaults->has(name)) throw;
      copy.words[name] = text_of(*defaults, name);
    }
  }
}

void add_copy(TomlValue& root, const TomlValue& group, const Copy& copy, const std::string& file) {
  for (const std::string& kind : kinds) {
    const TomlValue* list = group.find(kind);
    if (!list) continue;
    TomlValue* into = root.find(kind);
    if (!into) {
      root.keys.push_back(kind);
      root.key_lines.push_back(list->line);
      root.items.emplace_back();
      into = &root.items.back();
      into->type = TomlValue::Type::array;
      into->line = list->line;
    }
    for (TomlValue table : list->items) {
      if (!table.file) table.file = group.file;
      rewrite(copy, table, "", false);
      place(copy, table, kind, file);
      into->items.push_back(std::move(table));
    }
  }
}

}  // namespace

void place_instances(TomlValue& root, const std::string& file, const Parameters& parameters) {
  TableReader reader(root, file, "");
  reader.set_parameters(parameters);
  std::map<std::string, TableReader> groups;
  for (TableReader& group : reader.tables("group")) {
    const std::string name = group.text("name");
    group.set_label(fmt::format("[[group]] {}", quote(name)));
    group.allow({"name", "parameters", "body", "joint", "coupling", "force", "block", "output"});
    for (const std::string& kind : kinds) group.tables(kind);
    group.table("parameters");
    if (!groups.emplace(name, group).second) group.fail("name", "is already the name of another group");
  }
  std::vector<std::string> known;
  known.reserve(groups.size());
  for (const auto& entry : groups) known.push_back(entry.first);
  const TomlValue instances = root.find("instance") ? *root.find("instance") : TomlValue{};
  const TomlValue definitions = root.find("group") ? *root.find("group") : TomlValue{};
  for (const TomlValue& table : instances.items) {
    TableReader instance(table, table.file ? *table.file : file, "[[instance]]");
    instance.set_parameters(parameters);
    const std::string name = instance.text("name");
    instance.set_label(fmt::format("[[instance]] {}", quote(name)));
    instance.allow({"group", "name", "count", "position", "rotation", "parameters"});
    const std::string group_name = instance.text("group");
    const TomlValue* definition = nullptr;
    for (const TomlValue& candidate : definitions.items)
      if (candidate.find("name")->text == group_name) definition = &candidate;
    if (!definition) {
      const std::string hint = did_you_mean(group_name, known);
      instance.fail("group", fmt::format("names the group {}, which does not exist{} {}", quote(group_name), hint.empty() ? ";" : hint,
                                         known.empty() ? "the scene has no [[group]]" : "there are " + list_words(known)));
    }
    const TableReader group(*definition, definition->file ? *definition->file : file, fmt::format("[[group]] {}", quote(group_name)));
    const int count = instance.integer("count", 0, 0, 10000);
    for (int number = 1; number <= std::max(count, 1); ++number) {
      Copy copy;
      copy.instance = &instance;
      copy.name = instance.has("count") ? fmt::format("{}{}", name, number) : name;
      set_parameters(group, instance, parameters, number, copy);
      TableReader placed = instance;
      placed.set_parameters(copy.all);
      copy.position = placed.vector3("position", Vec3::Zero(), "m");
      copy.turn = rotation_exp(read_rotation(placed, "rotation"));
      for (const char* kind : {"body", "joint", "force", "coupling", "block"})
        if (const TomlValue* list = definition->find(kind))
          for (const TomlValue& item : list->items)
            if (const TomlValue* own = item.find("name")) copy.inside.insert(fill(copy, own->text));
      for (const char* kind : {"output", "block"})
        if (const TomlValue* list = definition->find(kind))
          for (const TomlValue& item : list->items)
            if (const TomlValue* own = item.find("name")) copy.outputs.insert(fill(copy, own->text));
      add_copy(root, *definition, copy, file);
      for (const std::string& text : copy.own.doubts()) parameters.doubt(text);
    }
  }
}

}  // namespace flexframe::sim
