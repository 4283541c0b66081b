// flexframe study: what accuracy costs in time.
#include "render/cli/commands.h"
#include "render/cli/engine.h"
#include "render/cli/jobs.h"
#include "render/cli/shell_word.h"
#include "render/cli/terminal.h"

#include "render/film/picture_accuracy.h"
#include "render/film/study.h"
#include "render/film/study_page.h"
#include "sim/base/file_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>

namespace flexframe::cli {
namespace {

void print_study(const film::Study& study, const std::filesystem::path& folder) {
  if (study.overview && study.overview->recommended >= 0) {
    const film::OverviewPoint& p = study.overview->points[static_cast<size_t>(study.overview->recommended)];
    fmt::print("recommended  {}: {} off at most ({:.2g} % of the motion), {:.3g} CPU s of simulation, {:.3g} of map and drawing\n", p.name,
               film::distance_words(p.pixels, "px"), p.percent, p.cpu_run, p.cpu_pictures);
    fmt::print("figure       {}\n", (folder / "overview.png").string());
  }
  const std::string good = study.reference_judged ? fmt::format("good to {:.1e}", study.reference_error) : "its own error is not known";
  fmt::print("reference    {}, {}, {:.2f} CPU s\n", study.reference, good, study.reference_cpu);
  for (const film::StudyOrder& o : study.orders) fmt::print("order        {} ({}): {:.2f}\n", o.axis, o.series, o.order);
  for (const film::StudyAdvice& a : study.advice) {
    if (a.point < 0) {
      fmt::print("{:<12g} no setting of this study reaches it\n", a.wanted);
      continue;
    }
    const film::StudyPoint& p = study.points[a.point];
    fmt::print("{:<12g} {}: {:.4f} CPU s, error {:.1e}\n", a.wanted, p.setting, p.median_cpu, p.error);
  }
  int failed = 0;
  for (const film::StudyPoint& p : study.points) failed += !p.failure.empty();
  fmt::print("points       {} ({} without a number: study.csv says why)\n", study.points.size(), failed);
  for (const std::string& note : study.notes) fmt::print("note         {}\n", note);
  fmt::print("report       {}, study.csv, study.json, front.svg, front.png\n", (folder / "study.md").string());
}

// Shards of the runs as tasks, then the study itself, which finds them all.
int hand_over_study(const std::filesystem::path& folder, const EngineWords& engine) {
  EngineJob work;
  work.name = "flexframe-study";
  work.folder = std::filesystem::absolute(folder).lexically_normal();
  work.shards = engine.shards > 0 ? engine.shards : 4;
  work.last = words_without_engine();
  if (std::find(work.last.begin(), work.last.end(), "--resume") == work.last.end()) work.last.emplace_back("--resume");
  work.task = work.last;
  for (const char* word : {"--shard", "{}"}) work.task.emplace_back(word);
  return hand_over(work, engine);
}

}  // namespace

Command add_study(Program& program) {
  struct Words {
    std::string scene, out, reference;
    std::vector<std::string> settings;
    std::vector<std::string> axes;
    std::string shard;
    EngineWords engine;
    int repeats = 3;
    double longest = 0.0, seconds = 60.0, reference_seconds = 0.0;
    bool resume = false, html = false, json = false;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("study", "accuracy against CPU time: sweeps, table, diagrams, recommendation");
  app.option("SCENE", words->scene, "scene file (TOML)").required();
  add_scene_words(app, words->settings);
  app.option("-o,--out", words->out, "output folder; default: NAME-study").as("DIR");
  app.option("--axes", words->axes, fmt::format("any of {}; default: all that the scene has", fmt::join(film::study_axes(), ",")))
      .as("LIST")
      .list([](const std::string& item) {
        return std::find(film::study_axes().begin(), film::study_axes().end(), item) != film::study_axes().end();
      })
      .separated_by(',');
  app.option("--repeats", words->repeats, "runs per point, for the median CPU time").range(1, 99).show_default();
  app.option("--longest", words->longest, "CPU seconds after which a run is stopped; default: twenty times those of the scene as written")
      .positive();
  app.option("--reference", words->reference, "histories (CSV) as the reference; default: computed").as("FILE");
  app.option("--seconds", words->seconds, "CPU seconds that the study may take in all; what does not fit is left out, which it says")
      .positive()
      .show_default();
  app.option("--reference-seconds", words->reference_seconds,
             "CPU seconds that a computed reference may take; default: a sixth of --seconds")
      .positive();
  app.flag("--resume", words->resume, "keep the runs of an interrupted study of the same scene");
  app.option("--shard", words->shard, "every N-th run from the I-th on, without report: study --resume makes that of all; needs --longest")
      .as("I/N");
  app.flag("--html", words->html, "the report as one HTML page besides: study.html, diagrams inside, tables to sort");
  app.flag("--json", words->json, "the report as JSON on stdout");
  add_engine_words(app, words->engine);
  app.example("crane.toml -o crane-study --axes tolerance,elements", "error against CPU time over tolerances and elements");

  return {app, [words] {
            namespace fs = std::filesystem;
            const Job job = read_job(words->scene, words->settings);
            const std::string name = fs::path(words->scene).stem().string();
            film::StudyOptions options;
            options.axes = words->axes;
            options.repeats = words->repeats;
            options.longest = words->longest;
            options.seconds = words->seconds;
            options.reference_seconds = words->reference_seconds;
            if (!words->reference.empty()) options.reference = words->reference;
            options.folder = words->out.empty() ? fs::path(name + "-study") : fs::path(words->out);
            options.resume = words->resume;
            options.version = FLEXFRAME_VERSION;
            options.command = fmt::format("flexframe study {}", shell_word(words->scene));
            for (const std::string& one : words->settings) options.command += fmt::format(" --set {}", shell_word(one));
            if (!words->axes.empty()) options.command += fmt::format(" --axes {}", fmt::join(words->axes, ","));
            if (words->longest > 0.0) options.command += fmt::format(" --longest {:g}", words->longest);
            options.command += fmt::format(" --seconds {:g}", words->seconds);
            if (!words->reference.empty()) options.command += fmt::format(" --reference {}", shell_word(words->reference));
            else if (words->reference_seconds > 0.0) options.command += fmt::format(" --reference-seconds {:g}", words->reference_seconds);
            options.command += fmt::format(" --repeats {}", words->repeats);
            require_writable(options.folder);
            if ((!words->shard.empty() || words->engine.elsewhere()) && !(options.longest > 0.0))
              throw UsageError("--shard and --engine need --longest: every task must stop long runs at the same CPU seconds");
            if (words->engine.elsewhere()) return hand_over_study(options.folder, words->engine);
            Progress progress("studying");
            double at = 0.0;
            options.progress = [&](double fraction, const std::string&) {
              if (fraction >= 0.0) at = fraction;
              progress.show(at);
            };
            if (!words->shard.empty()) {
              const auto [shard, shards] = shard_of(words->shard);
              film::run_study_shard(job.scene, options, shard, shards);
              return 0;
            }
            const film::Study study = film::run_study(job.scene, options);
            film::write_study(study, options.folder);
            if (words->html) sim::write_whole_file(options.folder / "study.html", film::study_page(study));
            if (words->json) {
              std::ifstream file(options.folder / "study.json");
              fmt::print("{}", std::string(std::istreambuf_iterator<char>(file), {}));
              return 0;
            }
            print_study(study, options.folder);
            if (words->html) fmt::print("page         {}\n", (options.folder / "study.html").string());
            return 0;
          }};
}

}  // namespace flexframe::cli
