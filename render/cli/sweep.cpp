// flexframe sweep: a scene over ranges, lists and distributions of its keys.
#include "render/cli/commands.h"
#include "render/cli/engine.h"
#include "render/cli/jobs.h"
#include "render/cli/shell_word.h"
#include "render/cli/sweep_finish.h"
#include "render/cli/terminal.h"

#include "sim/sweep/sweep.h"
#include "sim/sweep/workers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct SweepWords {
  std::string scene, out, sample, sensitivity, shard, minimise, maximise;
  std::vector<std::string> settings, responses, limits;
  double longest = 0.0, precision = sim::GoalWords{}.precision;
  int seed = 1, workers = 0, searches = 4, runs = 200;
  bool resume = false;
  SimulationWords simulation;
  EngineWords engine;
  FinishWords finish;
};

sim::SweepQuestion question_of(const SweepWords& words) {
  sim::SweepQuestion q;
  q.scene = words.scene;
  q.design = {words.settings, words.sample, words.sensitivity, static_cast<std::uint64_t>(words.seed)};
  q.responses = words.responses;
  if (!words.minimise.empty() || !words.maximise.empty()) {
    q.goal = {words.minimise.empty() ? words.maximise : words.minimise, words.minimise.empty(), words.limits, words.precision};
    q.design.searches = words.searches;
    q.design.runs = words.runs;
  } else if (!words.limits.empty()) {
    throw UsageError("--limit belongs to --minimise or --maximise");
  }
  q.tolerance = words.simulation.tolerance;
  const AskedAccuracy accuracy = asked_accuracy(words.simulation);
  if (accuracy.pictures)
    throw UsageError("--accuracy: a sweep compares numbers, not pictures: give a share of the outputs' ranges, such as 1e-3");
  q.accuracy = accuracy.share;
  q.max_steps = words.simulation.max_steps;
  q.method = words.simulation.method;
  q.estimate_error = !words.simulation.no_estimate;
  q.check_effects = !words.simulation.no_check;
  q.strict = words.simulation.strict;
  q.longest = words.longest;
  return q;
}

// The sweep that the words ask for, or the one that was begun in the folder that stands in the scene's place.
sim::Sweep sweep_of(const SweepWords& words) {
  std::error_code error;
  const std::string program = program_fingerprint();
  if (fs::is_directory(words.scene, error)) {
    if (!words.settings.empty() || !words.responses.empty() || !words.sample.empty() || !words.sensitivity.empty() || !words.out.empty() ||
        !words.minimise.empty() || !words.maximise.empty())
      throw UsageError(
          fmt::format("{} is the folder of a sweep, which keeps the options that it was begun with: --set, --response, --sample, "
                      "--sensitivity, --minimise, --maximise and --out belong to a scene file",
                      words.scene));
    return sim::read_sweep(words.scene, program);
  }
  if (!words.minimise.empty() && !words.maximise.empty())
    throw UsageError("--minimise excludes --maximise: of two goals one can be a --limit");
  const fs::path folder = words.out.empty() ? fs::path(fs::path(words.scene).stem().string() + "-sweep") : fs::path(words.out);
  sim::Sweep sweep = sim::make_sweep(question_of(words), folder, program);
  require_writable(folder);
  make_folder(folder);
  return sweep;
}

sim::ShardReport run_here(const sim::Sweep& sweep, const SweepWords& words, int shard, int shards) {
  Progress progress("sweeping");
  sim::SweepShard options;
  options.shard = shard;
  options.shards = shards;
  options.workers = words.workers;
  options.resume = words.resume;
  options.progress = [&](long done, long all) { progress.show(all > 0 ? static_cast<double>(done) / static_cast<double>(all) : 1.0); };
  return sim::run_shard(sweep, options);
}

// Cuts the sweep for another engine: tasks of about ten minutes by a pilot run, or four a core of this machine.
int hand_over_sweep(sim::Sweep& sweep, const SweepWords& words) {
  constexpr double wanted_seconds = 600.0, pilot_seconds = 20.0;
  const double each = sim::pilot_cpu(sweep, 5, pilot_seconds), all = each * static_cast<double>(sweep.design.size());
  const long most = sweep.goal ? sweep.design.searches() : sweep.design.size();
  // One that was begun keeps its cut, so that each task goes on with its rows.
  long shards = words.engine.shards > 0 ? words.engine.shards : fs::is_directory(words.scene) ? sweep.shards : 0;
  if (shards == 0)
    shards = words.engine.engine == "slurm" ? std::lround(std::ceil(all / (wanted_seconds * words.engine.cpus))) : 4L * sim::usable_cores();
  sweep.shards = static_cast<int>(std::clamp<long>(shards, 1, std::min(words.engine.shards > 0 ? 100000L : 1000L, most)));
  sim::write_question(sweep);
  EngineJob job;
  job.name = fmt::format("flexframe-{}", sweep.question.scene.stem().string());
  job.folder = fs::absolute(sweep.folder).lexically_normal();
  job.task = {"sweep", job.folder.string(), "--shard", "{}", "--resume", "--workers", "{cpus}", "--quiet"};
  job.last = {"collect", job.folder.string()};
  job.shards = sweep.shards;
  job.task_seconds = all / (sweep.shards * words.engine.cpus);
  fmt::print("pilot        {:.3g} CPU s a point, {:.3g} s a task: {} tasks\n", each, job.task_seconds, sweep.shards);
  return hand_over(job, words.engine);
}

int act(const SweepWords& words) {
  if (!words.shard.empty() && words.engine.elsewhere()) throw UsageError("--shard excludes --engine, which hands out shards itself");
  const auto [shard, shards] = shard_of(words.shard);
  sim::Sweep sweep = sweep_of(words);
  if (!words.shard.empty()) {
    if (!fs::exists(sweep.folder / "sweep.toml")) {
      sweep.shards = shards;
      sim::write_question(sweep);
    }
    const sim::ShardReport report = run_here(sweep, words, shard, shards);
    if (verbosity() != Verbosity::quiet)
      fmt::print(
          "shard        {}/{}: {} points, {} kept, {} made in {:.2f} CPU s, {} of these without a response; then: flexframe collect {}\n",
          shard, shards, report.points, report.kept, report.made, report.cpu, report.without, shell_word(sweep.folder.string()));
    return 0;
  }
  if (words.engine.elsewhere()) return hand_over_sweep(sweep, words);
  if (!fs::is_directory(words.scene)) sim::write_question(sweep);
  const sim::ShardReport report = run_here(sweep, words, 1, 1);
  if (!words.finish.json && verbosity() != Verbosity::quiet && !report.settings.empty())
    fmt::print("settings     of all points: {}; {:.2f} CPU s\n", report.settings, report.settings_cpu);
  if (!words.finish.json && verbosity() != Verbosity::quiet && report.made > 0)
    fmt::print("sweep        {} points made, {} kept; {:.2f} CPU s, {:.1f} s: {:.4f} CPU s a point\n", report.made, report.kept, report.cpu,
               report.wall, report.cpu / static_cast<double>(report.made));
  return finish_sweep(sweep, words.finish);
}

}  // namespace

Command add_sweep(Program& program) {
  const auto words = std::make_shared<SweepWords>();
  Subcommand app = program.subcommand("sweep", "a scene over ranges, lists and distributions of its keys: table, plots, sensitivities");
  app.option("SCENE", words->scene, "scene file (TOML), or the folder of a sweep that was begun").required();
  app.option("--set", words->settings,
             "a parameter or key with its values: A:B:N (:log), a list V,V,V, or by chance A:B, uniform(a,b), loguniform(a,b), "
             "normal(mean,deviation[,low,high]); with one value it is the same at every point")
      .as("KEY=VALUES")
      .one_word();
  app.option("--response", words->responses,
             "a number of every run, NAME=EXPRESSION of max, min, mean, rms, range, final, initial, integral, time_of_max, time_of_min, "
             "time_of and frequency of the outputs, and of the keys set")
      .as("NAME=EXPRESSION")
      .one_word();
  app.option("--sample", words->sample, "points by chance: lhs:N, sobol:N or random:N").as("WORD:N");
  app.option("--sensitivity", words->sensitivity,
             "points for indices of sensitivity: sobol:N (N (keys + 2) points) or morris:N (N (keys + 1))")
      .as("WORD:N");
  app.option(
         "--minimise", words->minimise,
         "search for the values of the keys, each in its range A:B, that make this smallest: a response's name or an expression like one")
      .as("EXPRESSION")
      .one_word();
  app.option("--maximise", words->maximise, "likewise, largest").as("EXPRESSION").one_word();
  app.option("--limit", words->limits, "what the values must keep: EXPRESSION <= NUMBER or >=; may be repeated").as("CONDITION").one_word();
  app.option("--searches", words->searches, "from so many places: the middle of the ranges and points over them")
      .range(1, 10000)
      .show_default();
  app.option("--runs", words->runs, "of each search at most").range(2, 100000).show_default();
  app.option("--precision", words->precision, "of the keys that are found, in shares of their ranges").range(1e-9, 0.1).show_default();
  app.option("--seed", words->seed, "of lhs, random, morris and searches").range(0, 2147483647).show_default();
  app.option("-o,--out", words->out, "output folder; default: NAME-sweep").as("DIR");
  app.option("--longest", words->longest, "CPU seconds after which a point is given up").positive();
  app.option("--workers", words->workers, "processes; default: one per core").range(1, 1024);
  app.option("--shard", words->shard, "every N-th point from the I-th on, without table: flexframe collect DIR makes that of all")
      .as("I/N");
  app.flag("--resume", words->resume, "keep the rows of an interrupted sweep of the same scene, options and program");
  add_finish_words(app, words->finish);
  add_engine_words(app, words->engine);
  add_simulation_words(app, words->simulation);
  app.example("crane.toml --set body.rod.length=0.2:0.4:21 --set mu=0.05,0.1 --response \"max(abs(tip.x))\"", "a grid of 42 points");
  app.example("crane.toml --set L=normal(0.3,0.001) --set E=2e11:2.2e11 --sample lhs:500 --response \"tip=range(tip.y)\"",
              "500 points by chance");
  app.example("crane.toml --set L=0.2:0.4 --set c=1:100:log --minimise \"rms(tip.x)\" --limit \"max(abs(force)) <= 200\"",
              "the length and the damping that swing least within a limit");
  app.example("crane-sweep --engine slurm --sbatch partition=short", "go on with a sweep that was begun, on a cluster");
  return {app, [words] { return act(*words); }};
}

Command add_collect(Program& program) {
  struct CollectWords {
    std::string folder;
    bool run_missing = false, other_program = false;
    int workers = 0;
    FinishWords finish;
  };
  const auto words = std::make_shared<CollectWords>();
  Subcommand app = program.subcommand("collect", "what the shards of a sweep have done: verified, put together, what is missing named");
  app.option("DIR", words->folder, "folder of the sweep").required();
  app.flag("--run-missing", words->run_missing, "run the points that are missing, here and now");
  app.flag("--other-program", words->other_program, "take the rows of another build of the program as they are: to draw them again");
  app.option("--workers", words->workers, "processes for them; default: one per core").range(1, 1024);
  add_finish_words(app, words->finish);
  app.example("crane-sweep", "table and plots of all shards, and what is missing");
  return {app, [words] {
            if (words->run_missing && words->other_program)
              throw UsageError("--run-missing excludes --other-program: all rows of a table are of one program");
            sim::Sweep sweep = sim::read_sweep(words->folder, words->other_program ? "" : program_fingerprint());
            if (words->run_missing) {
              SweepWords run;
              run.workers = words->workers;
              run.resume = true;
              run_here(sweep, run, 1, 1);
            }
            return finish_sweep(sweep, words->finish);
          }};
}

}  // namespace flexframe::cli
