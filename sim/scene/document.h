// A scene file made whole before it is read as a scene: settings of the command line, included files, instances of groups.
//
//   include = "parts/arm.toml"            # its tables, before the file's own; or a list of files
//   [parameters]                          # named numbers (parameters.h)
//   [[group]] name = "blade" ...          # bodies, joints, forces and outputs that [[instance]] places, as often as asked
//   [[instance]] group = "blade" name = "b1" position = [...] rotation = [...] parameters = { ... }
#pragma once

#include "sim/scene/parameters.h"
#include "sim/scene/toml_input.h"

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace flexframe::sim {

struct SceneDocument {
  std::filesystem::path file;  // as given; appears in messages
  TomlValue root;              // without include, group and instance
  Parameters parameters;
  std::string text;  // the file's own text; where something was set, included or placed: the whole written as one TOML text
};

// settings: "L=0.4" (a parameter) or "body.rod.elements=12" (a key of a table: simulation, render; body, joint, force or output by name).
// What the file says in another way goes: a set view takes the place of the file's camera path, a set tolerance that of an accuracy.
// Throws InputError naming file, line and key.
SceneDocument read_document(const std::filesystem::path& file, std::span<const std::string> settings = {});
SceneDocument parse_document(std::string_view text, const std::filesystem::path& name, std::span<const std::string> settings = {});

}  // namespace flexframe::sim
