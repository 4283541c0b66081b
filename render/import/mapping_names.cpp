// Bodies by the names of a table's columns.
#include "render/import/mapping.h"

#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

namespace flexframe::imports {
namespace {

// Whether all of BASE + ending are columns.
bool has_all(const std::set<std::string>& names, const std::string& base, std::initializer_list<const char*> endings) {
  return std::all_of(endings.begin(), endings.end(), [&](const char* ending) { return names.count(base + ending) > 0; });
}

template <size_t N>
void take(std::array<Source, N>& out, const std::string& base, std::initializer_list<const char*> endings) {
  size_t k = 0;
  for (const char* ending : endings) out[k++] = {base + ending, 1.0, 0.0, 0};
}

// Columns of a set that is not whole, as .qw .qx .qy without .qz: a body without what they say would be a wrong one.
void refuse_parts(const std::set<std::string>& names, const std::string& base, std::initializer_list<const char*> endings,
                  const std::string& file) {
  const char *there = nullptr, *missing = nullptr;
  for (const char* ending : endings) (names.count(base + ending) ? there : missing) = ending;
  if (there && missing)
    throw InputError(fmt::format("{}: {} has the column {}, but {} is missing", file, sim::quote(base), sim::quote(base + there),
                                 sim::quote(base + missing)));
}

// The orientation among the columns of a base, if any.
void find_turn(const std::set<std::string>& names, const std::string& base, const std::string& file, TurnSource& turn) {
  refuse_parts(names, base, {".qw", ".qx", ".qy", ".qz"}, file);
  refuse_parts(names, base, {".rx", ".ry", ".rz"}, file);
  refuse_parts(names, base, {".r11", ".r12", ".r13", ".r21", ".r22", ".r23", ".r31", ".r32", ".r33"}, file);
  if (has_all(names, base, {".qw", ".qx", ".qy", ".qz"})) {
    turn.writing.form = TurnForm::quaternion;
    take(turn.numbers, base, {".qw", ".qx", ".qy", ".qz"});
  } else if (has_all(names, base, {".rx", ".ry", ".rz"})) {
    turn.writing.form = TurnForm::vector;
    take(turn.numbers, base, {".rx", ".ry", ".rz"});
  } else if (has_all(names, base, {".r11", ".r12", ".r13", ".r21", ".r22", ".r23", ".r31", ".r32", ".r33"})) {
    turn.writing.form = TurnForm::matrix;
    take(turn.numbers, base, {".r11", ".r12", ".r13", ".r21", ".r22", ".r23", ".r31", ".r32", ".r33"});
  }
}

// Components with a mass and a frame: NAME.frame_a.r_0, NAME.frame_a.R.T, NAME.m. Parts of such a component are left to it.
void find_modelica_bodies(const std::set<std::string>& names, Mapping& mapping) {
  std::set<std::string> found;
  for (const std::string& name : names) {
    const std::string ending = ".frame_a.r_0[1]";
    if (!name.ends_with(ending)) continue;
    const std::string component = name.substr(0, name.size() - ending.size());
    if (names.count(component + ".m") && names.count(component + ".frame_a.R.T[1,1]") && names.count(component + ".frame_a.R.T[3,3]"))
      found.insert(component);
  }
  for (const std::string& component : found) {
    bool part = false;
    for (size_t dot = component.find('.'); dot != std::string::npos; dot = component.find('.', dot + 1))
      part = part || found.count(component.substr(0, dot));
    if (part) continue;
    BodySource body;
    body.name = component;
    take(body.position, component, {".frame_a.r_0[1]", ".frame_a.r_0[2]", ".frame_a.r_0[3]"});
    body.turn.writing.form = TurnForm::matrix;
    body.turn.writing.world_to_body = true;
    for (size_t k = 0; k < 9; ++k)
      body.turn.numbers[k] = {fmt::format("{}.frame_a.R.T[{},{}]", component, k / 3 + 1, k % 3 + 1), 1.0, 0.0, 0};
    mapping.bodies.push_back(std::move(body));
  }
}

}  // namespace

Mapping mapping_by_names(const Table& table) {
  Mapping mapping;
  std::set<std::string> names;
  for (const Column& column : table.columns) names.insert(column.name);
  if (table.kind == modelica_kind) {
    find_modelica_bodies(names, mapping);
    if (!mapping.bodies.empty()) return mapping;
    throw InputError(fmt::format(
        "{}: no component has a mass (NAME.m) and a frame (NAME.frame_a.r_0, NAME.frame_a.R.T) among its {} variables: say by a "
        "mapping file (--map) which variables are the bodies' motion",
        table.file, table.columns.size()));
  }
  std::map<std::string, size_t> bodies;
  std::string planar;
  for (const Column& column : table.columns) {
    if (!column.name.ends_with(".x")) continue;
    const std::string base = column.name.substr(0, column.name.size() - 2);
    if (base.empty() || base.find(':') != std::string::npos) continue;
    if (!has_all(names, base, {".y", ".z"})) {
      if (names.count(base + ".y") || names.count(base + ".z") || names.count(base + ".qw")) planar += (planar.empty() ? "" : ", ") + base;
      continue;
    }
    BodySource body;
    body.name = base;
    take(body.position, base, {".x", ".y", ".z"});
    find_turn(names, base, table.file, body.turn);
    if (body.turn.writing.form == TurnForm::none)
      mapping.notes.push_back(fmt::format(
          "body '{}': the table holds no orientation ({}.qw ..., .rx ..., .r11 ...): it keeps that of the world's axes", base, base));
    bodies[base] = mapping.bodies.size();
    mapping.bodies.push_back(std::move(body));
  }
  for (const Column& column : table.columns) {
    const auto colon = column.name.find(':');
    if (colon == std::string::npos || !column.name.ends_with(".ux")) continue;
    const std::string base = column.name.substr(0, column.name.size() - 3);
    const auto owner = bodies.find(column.name.substr(0, colon));
    if (owner == bodies.end()) continue;
    refuse_parts(names, base, {".ux", ".uy", ".uz"}, table.file);
    refuse_parts(names, base, {".rx", ".ry", ".rz"}, table.file);
    if (!has_all(names, base, {".x0", ".y0", ".z0"}))
      throw InputError(fmt::format("{}: node {} moves by {}.ux .uy .uz, but the columns {}.x0 .y0 .z0 of its undeformed place are missing",
                                   table.file, sim::quote(base), base, base));
    NodeSource node;
    node.name = base.substr(colon + 1);
    take(node.rest, base, {".x0", ".y0", ".z0"});
    take(node.place, base, {".ux", ".uy", ".uz"});
    if (has_all(names, base, {".rx", ".ry", ".rz"})) {
      node.has_turn = true;
      node.turn.writing.form = TurnForm::vector;
      take(node.turn.numbers, base, {".rx", ".ry", ".rz"});
    }
    BodySource& body = mapping.bodies[owner->second];
    body.kind = "modal";
    body.nodes.push_back(std::move(node));
  }
  if (!planar.empty())
    mapping.notes.push_back(fmt::format("no bodies, as one of .x .y .z is missing: {}; a mapping file (--map) can give 0 for it", planar));
  if (mapping.bodies.empty())
    throw InputError(
        fmt::format("{}: no body is found by the names of its columns: NAME.x NAME.y NAME.z with NAME.qw .qx .qy .qz (or .rx .ry .rz, .r11 "
                    "... .r33); say by a mapping file (--map) which columns are the bodies' motion",
                    table.file));
  return mapping;
}

}  // namespace flexframe::imports
