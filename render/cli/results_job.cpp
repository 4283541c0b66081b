#include "render/cli/results_job.h"

#include "sim/results/results_file.h"
#include "sim/scene/scene_reader.h"

#include <fmt/format.h>

namespace flexframe::cli {
namespace {

// No more than [render]: how something looks, not what it is.
bool is_look(const sim::SceneDocument& document) { return !document.root.find("body") && !document.root.find("simulation"); }

// The scene that the results were made from, for shapes and axes that they do not hold. Pictures without them would be other pictures:
// where its files are gone that is an error.
std::optional<sim::Scene> scene_of(const sim::Results& results, const std::string& results_file) {
  if (results.scene_text.empty()) return std::nullopt;
  try {
    if (is_look(sim::parse_document(results.scene_text, results.scene_file))) return std::nullopt;
    return sim::parse_scene(results.scene_text, results.scene_file);
  } catch (const sim::InputError& e) {
    throw sim::InputError(
        fmt::format("{}: its scene, which joint symbols, forces and bodies without a mesh are drawn from, cannot be read any more: {}; put "
                    "the file back, or name the scene where it lies now with --scene",
                    results_file, e.what()));
  }
}

}  // namespace

ResultsJob read_results_job(const std::string& results_file, const std::string& scene_file, const RenderWords& words) {
  ResultsJob job;
  job.results = sim::read_results(results_file);
  if (!scene_file.empty()) {
    const sim::SceneDocument document = sim::read_document(scene_file, render_settings(words));
    job.settings = film::read_render_settings(document);
    // A file with no more than [render] changes how the results look; what they show stands in themselves.
    job.scene = is_look(document) ? scene_of(job.results, results_file) : sim::make_scene(document);
  } else {
    job.scene = scene_of(job.results, results_file);
    const std::string& name = job.results.scene_file.empty() ? results_file : job.results.scene_file;
    job.settings = film::read_render_settings(sim::parse_document(job.results.scene_text, name, render_settings(words)));
  }
  apply_words(words, job.settings);
  film::check_render_settings(job.settings, job.results, scene_file.empty() ? results_file : scene_file);
  return job;
}

}  // namespace flexframe::cli
