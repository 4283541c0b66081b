// Scene files (every key, type, unit and default: sim/SCENE.md) into a Scene.
// Everything that can be known from the file alone is checked here; whether the mechanism can be assembled is not.
#pragma once

#include "sim/scene/document.h"
#include "sim/scene/scene.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// Throws InputError "FILE:LINE: [[body]] 'crank': key 'lenght' is unknown; did you mean 'length'? allowed: ...".
// settings: "body.rod.length=0.4" or, of a parameter, "L=0.4", each in place of the file's value, as --set has them.
Scene read_scene(const std::filesystem::path& file, const std::vector<std::string>& settings = {});

// The same from a text. `name` appears in messages; files that the scene names are looked for relative to its folder.
Scene parse_scene(std::string_view text, const std::filesystem::path& name);

// The scene of a document that was read already (with settings of the command line, for example).
Scene make_scene(const SceneDocument& document);

}  // namespace flexframe::sim
