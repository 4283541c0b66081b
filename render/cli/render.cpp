// flexframe render: results to pictures.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "sim/results_file.h"
#include "sim/scene_reader.h"

#include <fmt/format.h>

#include <memory>
#include <optional>

namespace flexframe::cli {
namespace {

// The scene that the results were made from, for shapes and axes they do not hold. Its files may be gone by now: then the
// pictures do without.
std::optional<sim::Scene> scene_of(const sim::Results& results, std::vector<std::string>& notes) {
  if (results.scene_text.empty()) return std::nullopt;
  try {
    return sim::parse_scene(results.scene_text, results.scene_file);
  } catch (const sim::InputError& e) {
    notes.push_back(fmt::format("joints and bodies without mesh are drawn without the scene's measures: {}", e.what()));
    return std::nullopt;
  }
}

}  // namespace

Command add_render(CLI::App& program) {
  struct Words {
    std::string results, scene, out;
    bool json = false;
    RenderWords render;
  };
  const auto words = std::make_shared<Words>();
  CLI::App* app = program.add_subcommand("render", "draw results: PNG pictures, video");
  app->add_option("RESULTS", words->results, "results file (HDF5)")->required();
  app->add_option("--scene", words->scene, "scene file whose [render] table is used, in place of the one in the results");
  app->add_option("-o,--out", words->out, "output folder; default: the name of the results");
  app->add_flag("--json", words->json, "summary as JSON");
  add_render_words(*app, words->render);

  return {app, [words] {
            namespace fs = std::filesystem;
            const sim::Results results = sim::read_results(words->results);
            std::vector<std::string> notes;
            std::optional<sim::Scene> scene;
            film::RenderSettings settings;
            if (!words->scene.empty()) {
              scene = sim::read_scene(words->scene);
              settings = film::read_render_settings(words->scene);
            } else {
              scene = scene_of(results, notes);
              settings = film::parse_render_settings(results.scene_text, results.scene_file.empty() ? words->results : results.scene_file);
            }
            apply_words(words->render, settings);
            film::check_render_settings(settings, results, words->scene.empty() ? words->results : words->scene);
            const std::string name = fs::path(words->results).stem().string();
            const fs::path out = words->out.empty() ? fs::path(name) : fs::path(words->out);
            require_writable(out);
            DrawingReport drawing = run_drawing(results, settings, scene ? &*scene : nullptr, words->render, out, name);
            drawing.notes.insert(drawing.notes.end(), notes.begin(), notes.end());

            if (words->json) fmt::print("{}\n", drawing_json(drawing).dump(2));
            else print_drawing(drawing);
            return 0;
          }};
}

}  // namespace flexframe::cli
