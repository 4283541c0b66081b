// flexframe render: results to pictures.
#include "render/cli/commands.h"
#include "render/cli/engine.h"
#include "render/cli/json_text.h"
#include "render/cli/results_job.h"

#include "render/film/runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct FilmWords {
  std::vector<std::string> results;
  std::string scene, out;
  bool json = false, overlay = false, beside = false;
  RenderWords render;
  EngineWords engine;
};

// The files' names without folder and ending; numbered where two are alike.
std::vector<std::string> run_names(const std::vector<std::string>& files) {
  std::vector<std::string> names;
  for (const std::string& file : files) {
    std::string stem = fs::path(file).stem().string();
    const auto taken = [&](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); };
    // A dot parts body and frame in names.
    std::replace(stem.begin(), stem.end(), '.', '_');
    std::string name = stem;
    for (int k = 2; taken(name); ++k) name = fmt::format("{} ({})", stem, k);
    names.push_back(name);
  }
  return names;
}

DrawingReport draw_runs(const FilmWords& words, const fs::path& out, const std::string& name, nlohmann::ordered_json& differences) {
  std::vector<ResultsJob> jobs;
  std::vector<film::Run> runs;
  for (const std::string& file : words.results) jobs.push_back(read_results_job(file, words.scene, words.render));
  const std::vector<std::string> names = run_names(words.results);
  for (size_t r = 0; r < jobs.size(); ++r) runs.push_back({&jobs[r].results, jobs[r].scene ? &*jobs[r].scene : nullptr, names[r]});
  film::RenderSettings settings = jobs.front().settings;
  // Each run in its colour unless colours of values are asked for.
  const bool by_run = words.render.color_by.empty();
  if (by_run) settings.color_by = film::ColorBy::none;
  const film::RunsTogether together = film::put_together(runs, words.beside, by_run, settings);
  DrawingReport drawing = run_drawing(together.results, settings, &together.scene, words.render, out, name);
  drawing.notes.insert(drawing.notes.end(), together.notes.begin(), together.notes.end());
  for (size_t r = 0; r < jobs.size(); ++r)
    for (const std::string& warning : jobs[r].results.statistics.notes.texts(sim::Severity::warning))
      drawing.warnings.insert(drawing.warnings.begin(), fmt::format("{}: {}", names[r], warning));
  differences = nlohmann::ordered_json::array();
  for (const film::RunDifference& d : together.differences) {
    differences.push_back(
        {{"column", d.column}, {"run", d.run}, {"unit", d.unit}, {"largest", d.largest}, {"of_range", d.share}, {"t", d.at}});
    if (d.share == 0.0) continue;
    const double percent = 100.0 * d.share;
    drawing.notes.push_back(fmt::format("{} of {} differs by up to {:.3g} {} ({} % of its range), at t = {:.4g} s", d.column, d.run,
                                        d.largest, d.unit, percent < 99.5 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent),
                                        d.at));
  }
  return drawing;
}

DrawingReport draw_one(const FilmWords& words, const fs::path& out, const std::string& name) {
  const ResultsJob job = read_results_job(words.results.front(), words.scene, words.render);
  DrawingReport drawing = run_drawing(job.results, job.settings, job.scene ? &*job.scene : nullptr, words.render, out, name);
  // What the simulation warned of holds for its pictures too.
  const std::vector<std::string> warned = job.results.statistics.notes.texts(sim::Severity::warning);
  drawing.warnings.insert(drawing.warnings.begin(), warned.begin(), warned.end());
  drawing.notes.insert(drawing.notes.end(), job.notes.begin(), job.notes.end());
  return drawing;
}

// Shards of the pictures as tasks; at the end all of them once more with --resume: pictures that are whole and of the same inputs stay,
// those that are missing are drawn, and the video is made.
int hand_over_drawing(const std::filesystem::path& out, const RenderWords& words, const EngineWords& engine) {
  if (!words.shard.empty()) throw UsageError("--shard excludes --engine, which hands out shards itself");
  EngineJob work;
  work.name = "flexframe-" + std::filesystem::path(out).filename().string();
  work.folder = std::filesystem::absolute(out).lexically_normal();
  work.shards = engine.shards > 0 ? engine.shards : 4;
  work.last = words_without_engine();
  if (!words.resume) work.last.emplace_back("--resume");
  work.task = work.last;
  for (const char* word : {"--shard", "{}", "--workers", "{cpus}"}) work.task.emplace_back(word);
  return hand_over(work, engine);
}

}  // namespace

Command add_render(Program& program) {
  const auto words = std::make_shared<FilmWords>();
  Subcommand app = program.subcommand("render", "draw results: PNG pictures, video");
  app.option("RESULTS", words->results, "results file (HDF5); several with --overlay or --beside").as("FILE").required();
  app.option("--scene", words->scene, "file whose [render] table is used, in place of the one in the results: a scene, or that table alone")
      .as("FILE");
  app.option("-o,--out", words->out, "output folder; default: the name of the results").as("DIR");
  app.flag("--overlay", words->overlay, "several runs at their place, each in its colour, with curves and their differences");
  app.flag("--beside", words->beside, "several runs side by side, likewise");
  app.flag("--json", words->json, "summary as JSON");
  add_render_words(app, words->render);
  add_engine_words(app, words->engine);
  app.example("crane.h5 -o pictures --color-by stress --scales 1 50", "stress, in scale and fifty times");
  app.example("crane.h5 --frames 0:100 --shard 1/4", "a quarter of the first hundred pictures, for one of four machines");
  app.example("crane.h5 --engine slurm --shards 40 --sbatch partition=short", "forty tasks of a cluster, then the video");
  app.example("fine.h5 coarse.h5 --overlay", "two runs in one picture: two settings, two simulators, before and after");
  app.example("crane.h5 --scene style.toml --camera 4,2,3 --target 0,1,0", "another [render] table and camera");

  return {app, [words] {
            const bool several = words->results.size() > 1;
            if (several && words->overlay == words->beside)
              throw UsageError(fmt::format("render of {} results needs --overlay or --beside", words->results.size()));
            if (!several && (words->overlay || words->beside)) throw UsageError("--overlay and --beside need two or more results files");
            const std::string name =
                several ? fmt::format("{}", fmt::join(run_names(words->results), "_")) : fs::path(words->results[0]).stem().string();
            const fs::path out = words->out.empty() ? fs::path(name) : fs::path(words->out);
            require_writable(out);
            if (words->engine.elsewhere()) return hand_over_drawing(out, words->render, words->engine);
            nlohmann::ordered_json differences;
            const DrawingReport drawing = several ? draw_runs(*words, out, name, differences) : draw_one(*words, out, name);
            nlohmann::ordered_json json = drawing_json(drawing);
            if (several) json["differences"] = differences;
            if (words->json) fmt::print("{}\n", json_text(json));
            else print_drawing(drawing);
            return 0;
          }};
}

}  // namespace flexframe::cli
