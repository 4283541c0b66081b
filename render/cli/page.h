// A run as an HTML page, as `export --to html` and `run --html` write it.
#pragma once

#include "render/film/settings.h"
#include "sim/results/results.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace flexframe::cli {

// What was said while an animation was made and exported.
struct Told {
  std::vector<std::string> warnings, notes;
};

// Written whole or not at all. Returns what is told of it: pictures, bodies, triangles, bytes, errors. scene may be null.
nlohmann::ordered_json write_page(const sim::Results& results, const film::RenderSettings& settings, const sim::Scene* scene,
                                  const std::filesystem::path& out, Told& told);
void print_page(const nlohmann::ordered_json& page);

// said: an Animation, a DrawingReport.
template <class Said>
void add_notes(Told& told, const Said& said) {
  told.warnings.insert(told.warnings.end(), said.warnings.begin(), said.warnings.end());
  told.notes.insert(told.notes.end(), said.notes.begin(), said.notes.end());
}

}  // namespace flexframe::cli
