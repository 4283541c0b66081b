// Results with what it takes to draw them: the scene they were made from and its render settings.
#pragma once

#include "render/cli/jobs.h"

namespace flexframe::cli {

// Settings are those of scene_file where one is given, else those of the scene in the results.
struct ResultsJob {
  sim::Results results;
  std::optional<sim::Scene> scene;  // none where the results carry none, or one whose files are gone
  film::RenderSettings settings;
  std::vector<std::string> notes;
};
// Throws sim::InputError.
ResultsJob read_results_job(const std::string& results_file, const std::string& scene_file, const RenderWords& words);

}  // namespace flexframe::cli
