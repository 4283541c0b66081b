// flexframe run: simulate a scene and draw it.
#include "render/cli/commands.h"
#include "render/cli/engine.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"
#include "render/cli/page.h"
#include "render/cli/terminal.h"

#include "sim/results/csv.h"
#include "sim/results/results_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace flexframe::cli {

namespace {

// Simulates once, then draws in shards: what the words ask of the simulation goes to `simulate`, what they ask of pictures to `render`.
int hand_over_run(const std::string& scene, const std::filesystem::path& out, const std::string& csv, const RenderWords& render,
                  const EngineWords& engine) {
  if (!render.shard.empty()) throw UsageError("--shard excludes --engine, which hands out shards itself");
  const std::string name = std::filesystem::path(scene).stem().string(), results = (out / "results.h5").string();
  const std::vector<std::string> simulation = {
      "--set", "--tolerance", "--accuracy", "--method", "--max-steps", "--no-error-estimate", "--no-effect-check", "--strict", "--fresh"};
  const std::vector<std::string> ours = {"-o", "--out", "--csv", "--json"},
                                 alone = {"--no-error-estimate", "--no-effect-check", "--strict", "--fresh", "--json"};
  EngineJob job;
  job.name = "flexframe-" + name;
  job.folder = std::filesystem::absolute(out).lexically_normal();
  job.shards = engine.shards > 0 ? engine.shards : 4;
  job.first = {"simulate", scene, "-o", results, "--csv", csv.empty() ? (out / "histories.csv").string() : csv};
  job.last = {"render", results, "-o", out.string(), "--resume"};
  if (render.video.empty() && !render.no_video) job.last.insert(job.last.end(), {"--video", (out / (name + ".mp4")).string()});
  const std::vector<std::string> words = words_without_engine();
  const auto is_in = [](const std::vector<std::string>& list, const std::string& word) {
    return std::find(list.begin(), list.end(), word) != list.end();
  };
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string option = words[k].starts_with("--") ? words[k].substr(0, words[k].find('=')) : words[k];
    if (words[k] == "run" || words[k] == scene || words[k] == "--resume") continue;
    const bool drawn = !is_in(simulation, option) && !is_in(ours, option);
    std::vector<std::string>& into = drawn ? job.last : job.first;
    const bool value_follows = !drawn && option == words[k] && !is_in(alone, option);
    if (!is_in(ours, option)) into.push_back(words[k]);
    if (!value_follows) continue;
    ++k;
    if (!is_in(ours, option) && k < words.size()) into.push_back(words[k]);
  }
  job.task = job.last;
  for (const char* word : {"--shard", "{}", "--workers", "{cpus}"}) job.task.emplace_back(word);
  return hand_over(job, engine);
}

}  // namespace

Command add_run(Program& program) {
  struct Words {
    std::string scene, out, csv;
    std::vector<std::string> settings;
    bool json = false, html = false;
    SimulationWords simulation;
    RenderWords render;
    EngineWords engine;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("run", "simulate a scene and draw it: results, histories, pictures, video");
  app.option("SCENE", words->scene, "scene file (TOML)").required();
  add_scene_words(app, words->settings);
  app.option("-o,--out", words->out, "output folder; default: the scene's name").as("DIR");
  app.option("--csv", words->csv, "histories there instead of in the output folder").as("FILE");
  app.flag("--html", words->html, "besides, one HTML page for any browser: the scene to be turned round, playing, with plots (NAME.html)");
  app.flag("--json", words->json, "summary as JSON");
  add_simulation_words(app, words->simulation);
  add_fresh_word(app, words->simulation);
  add_render_words(app, words->render);
  add_engine_words(app, words->engine);
  app.example("slider_crank.toml", "simulate and draw: slider_crank/results.h5, histories.csv, frames/, slider_crank.mp4");
  app.example("crane.toml -o out --accuracy 1e-3 --scales 1,20 --size 1920x1080",
              "outputs good to a thousandth; in scale and twenty times");
  app.example("crane.toml --accuracy \"0.5 px\"", "every vertex of every picture within half a pixel of where it belongs");
  app.example("crane.toml --engine slurm --shards 40", "simulate, then draw by forty tasks of a cluster, then the video");
  app.example("crane.toml --set body.boom.length=3 --view front,iso --colormap turbo", "another boom, two views, other colours");

  return {
      app, [words] {
        namespace fs = std::filesystem;
        Job job = read_job(words->scene, words->settings, &words->render);
        apply_words(words->render, job.settings);
        // A page offers stress among its colours.
        const film::ColorBy by = job.settings.color_by;
        job.scene.colored_by_stress |= words->html || by == film::ColorBy::stress || by == film::ColorBy::strain;
        const std::string name = fs::path(words->scene).stem().string();
        const fs::path out = words->out.empty() ? fs::path(name) : fs::path(words->out);
        require_writable(out);
        const fs::path csv = words->csv.empty() ? out / "histories.csv" : fs::path(words->csv);
        require_not_read({out / "results.h5", csv});
        if (words->engine.elsewhere()) {
          if (words->html) throw UsageError("--html does not go with --engine: flexframe export RESULTS --to html makes the page");
          return hand_over_run(words->scene, out, words->csv, words->render, words->engine);
        }

        const bool asked = asks_accuracy(job.scene, words->simulation);
        std::optional<sim::SettingsMemory> memory;
        if (asked) memory = settings_memory(words->scene, words->settings, words->simulation, out / (name + ".settings.toml"));
        const sim::Results results = run_simulation(job, words->simulation, memory ? &*memory : nullptr);
        make_folder(out);
        sim::write_results(results, out / "results.h5");
        sim::write_histories_csv(results, csv);
        // A component that an output does not have is known only now: what was simulated stays.
        film::check_render_settings(job.settings, results, words->scene);
        const DrawingReport drawing = run_drawing(results, job.settings, &job.scene, words->render, out, name);
        nlohmann::ordered_json page;
        Told said;  // the pictures said it already
        if (words->html) page = write_page(results, job.settings, &job.scene, out / (name + ".html"), said);

        if (words->json) {
          nlohmann::ordered_json json = {
              {"scene", words->scene}, {"title", results.title}, {"results", (out / "results.h5").string()}, {"histories", csv.string()}};
          json["simulation"] = simulation_json(results);
          json["drawing"] = drawing_json(drawing);
          if (words->html) json["page"] = page;
          fmt::print("{}\n", json_text(json));
          return 0;
        }
        if (!results.title.empty() && verbosity() != Verbosity::quiet) fmt::print("{}\n", results.title);
        print_simulation(results);
        if (verbosity() != Verbosity::quiet) fmt::print("results      {}, {}\n", (out / "results.h5").string(), csv.string());
        print_drawing(drawing);
        if (words->html && verbosity() != Verbosity::quiet) print_page(page);
        return 0;
      }};
}

}  // namespace flexframe::cli
