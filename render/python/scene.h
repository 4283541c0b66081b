// A scene as Python holds it: read and checked once, with its drawing settings.
#pragma once

#include "sim/scene/document.h"
#include "sim/scene/scene.h"

#include <string>
#include <vector>

namespace flexframe::python {

struct Scene {
  sim::SceneDocument document;
  sim::Scene scene;
};

// settings: "body.rod.length=0.4", as --set has them. Throws InputError.
Scene read_scene(const std::filesystem::path& file, const std::vector<std::string>& settings);
Scene parse_scene(const std::string& text, const std::string& name, const std::vector<std::string>& settings);

// A method by its word; throws ArgumentError that lists them.
sim::Method method_of(const std::string& word);

}  // namespace flexframe::python
