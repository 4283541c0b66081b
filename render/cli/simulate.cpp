// flexframe simulate: a scene to results, without pictures.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"

#include "sim/results/csv.h"
#include "sim/results/results_file.h"

#include <fmt/format.h>

#include <memory>

namespace flexframe::cli {

Command add_simulate(Program& program) {
  struct Words {
    std::string scene, out, csv;
    std::vector<std::string> settings;
    bool json = false;
    SimulationWords simulation;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("simulate", "simulate a scene: results as HDF5, histories as CSV");
  app.option("SCENE", words->scene, "scene file (TOML)").required();
  add_scene_words(app, words->settings);
  app.option("-o,--out", words->out, "results file (HDF5)").as("FILE");
  app.option("--csv", words->csv, "histories file (CSV): the scene's outputs against t").as("FILE");
  app.flag("--json", words->json, "summary as JSON");
  add_simulation_words(app, words->simulation);
  add_fresh_word(app, words->simulation);
  app.example("crane.toml -o crane.h5 --csv crane.csv", "results for pictures, histories for a spreadsheet");
  app.example("crane.toml --csv loose.csv --tolerance 1e-4 --method dirk", "another tolerance and method than the scene's");

  return {app, [words] {
            namespace fs = std::filesystem;
            if (words->out.empty() && words->csv.empty()) throw UsageError("simulate needs -o RESULTS.h5 or --csv HISTORIES.csv");
            const Job job = read_job(words->scene, words->settings);
            for (const std::string& file : {words->out, words->csv})
              if (!file.empty()) require_writable_file(file);
            const bool asked = asks_accuracy(job.scene, words->simulation);
            const fs::path beside = words->out.empty() ? words->csv : words->out;
            const fs::path kept = asked ? beside.parent_path() / (beside.stem().string() + ".settings.toml") : fs::path();
            std::optional<sim::SettingsMemory> memory;
            if (asked) memory = settings_memory(words->scene, words->settings, words->simulation, kept);
            require_not_read({words->out, words->csv, kept});
            const sim::Results results = run_simulation(job, words->simulation, memory ? &*memory : nullptr);
            for (const std::string& file : {words->out, words->csv})
              if (!file.empty()) make_folder(fs::absolute(file).parent_path());
            if (!words->out.empty()) sim::write_results(results, words->out);
            if (!words->csv.empty()) sim::write_histories_csv(results, words->csv);
            if (words->json) {
              nlohmann::ordered_json json = {{"scene", words->scene}, {"title", results.title}, {"simulation", simulation_json(results)}};
              fmt::print("{}\n", json_text(json));
              return 0;
            }
            print_simulation(results);
            return 0;
          }};
}

}  // namespace flexframe::cli
