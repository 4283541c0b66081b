// flexframe render: results to pictures.
#include "render/cli/commands.h"
#include "render/cli/engine.h"
#include "render/cli/results_job.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace flexframe::cli {

namespace {

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
  struct Words {
    std::string results, scene, out;
    bool json = false;
    RenderWords render;
    EngineWords engine;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("render", "draw results: PNG pictures, video");
  app.option("RESULTS", words->results, "results file (HDF5)").required();
  app.option("--scene", words->scene, "file whose [render] table is used, in place of the one in the results: a scene, or that table alone")
      .as("FILE");
  app.option("-o,--out", words->out, "output folder; default: the name of the results").as("DIR");
  app.flag("--json", words->json, "summary as JSON");
  add_render_words(app, words->render);
  add_engine_words(app, words->engine);
  app.example("crane.h5 -o pictures --color-by stress --scales 1 50", "stress, in scale and fifty times");
  app.example("crane.h5 --frames 0:100 --shard 1/4", "a quarter of the first hundred pictures, for one of four machines");
  app.example("crane.h5 --engine slurm --shards 40 --sbatch partition=short", "forty tasks of a cluster, then the video");
  app.example("crane.h5 --scene style.toml --camera 4,2,3 --target 0,1,0", "another [render] table and camera");

  return {app, [words] {
            namespace fs = std::filesystem;
            const ResultsJob job = read_results_job(words->results, words->scene, words->render);
            const std::string name = fs::path(words->results).stem().string();
            const fs::path out = words->out.empty() ? fs::path(name) : fs::path(words->out);
            require_writable(out);
            if (words->engine.elsewhere()) return hand_over_drawing(out, words->render, words->engine);
            DrawingReport drawing = run_drawing(job.results, job.settings, job.scene ? &*job.scene : nullptr, words->render, out, name);
            // What the simulation warned of holds for its pictures too.
            const std::vector<std::string> warned = job.results.statistics.notes.texts(sim::Severity::warning);
            drawing.warnings.insert(drawing.warnings.begin(), warned.begin(), warned.end());
            drawing.notes.insert(drawing.notes.end(), job.notes.begin(), job.notes.end());

            if (words->json) fmt::print("{}\n", drawing_json(drawing).dump(2));
            else print_drawing(drawing);
            return 0;
          }};
}

}  // namespace flexframe::cli
