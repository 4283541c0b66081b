// flexframe load-path: outputs of a scene at rest over a load, through limit points, CSV and SVG.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"

#include "render/film/diagram.h"
#include "sim/base/file_output.h"
#include "sim/run/load_path.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct LoadPathWords {
  std::string scene, out;
  std::vector<std::string> settings;
  sim::LoadPathOptions path;
  bool json = false;
};

std::string path_csv(const sim::LoadPath& path) {
  std::string csv = "load,stable,limit";
  for (const std::string& column : path.columns) csv += "," + column;
  csv += '\n';
  for (const sim::LoadPathState& state : path.states) {
    csv += fmt::format("{},{},{}", state.load, state.stable ? 1 : 0, state.limit ? 1 : 0);
    for (const double value : state.outputs) csv += fmt::format(",{}", value);
    csv += '\n';
  }
  return csv;
}

film::Diagram path_diagram(const sim::LoadPath& path, const std::string& force) {
  film::Diagram diagram{.title = "states of equilibrium",
                        .x_label = "outputs",
                        .y_label = force.empty() ? "factor of all loads" : "factor of " + force,
                        .note = "rings: unstable",
                        .series = {},
                        .linear_x = true,
                        .linear_y = true};
  for (size_t c = 0; c < path.columns.size(); ++c) {
    film::DiagramSeries series{.label = fmt::format("{}, {}", path.columns[c], path.units[c]), .points = {}};
    for (const sim::LoadPathState& state : path.states)
      series.points.push_back({state.outputs[static_cast<Eigen::Index>(c)], state.load, !state.stable,
                               state.limit ? fmt::format("{:.4g}", state.load) : std::string()});
    diagram.series.push_back(std::move(series));
  }
  return diagram;
}

// Limit points, and why the curve ends early where it does.
void report(const LoadPathWords& w, const sim::LoadPath& path, const fs::path& csv, const fs::path& svg) {
  nlohmann::ordered_json limits = nlohmann::ordered_json::array();
  for (const sim::LoadPathState& state : path.states) {
    if (!state.limit) continue;
    nlohmann::ordered_json outputs = nlohmann::ordered_json::object();
    std::string line = fmt::format("limit point  load {:.8g}", state.load);
    for (size_t c = 0; c < path.columns.size(); ++c) {
      const double value = state.outputs[static_cast<Eigen::Index>(c)];
      outputs[path.columns[c]] = value;
      line += fmt::format(", {} {:.6g} {}", path.columns[c], value, path.units[c]);
    }
    limits.push_back({{"load", state.load}, {"outputs", outputs}});
    if (!w.json) fmt::print("{}\n", line);
  }
  if (!w.json)
    for (const std::string& note : path.notes) fmt::print("note         {}\n", note);
  for (const std::string& warning : path.warnings) fmt::print(stderr, "warning: {}\n", warning);
  if (!path.complete)
    fmt::print(stderr, "warning: the curve ends at the load {:.6g}, not at {:.6g}: {}\n", path.states.back().load, w.path.to, path.ended);
  if (!w.json) return fmt::print("states       {}\nload path    {}\ndiagram      {}\n", path.states.size(), csv.string(), svg.string());
  const nlohmann::ordered_json json = {{"scene", w.scene},       {"states", path.states.size()}, {"complete", path.complete},
                                       {"ended", path.ended},    {"warnings", path.warnings},    {"notes", path.notes},
                                       {"limit_points", limits}, {"csv", csv.string()},          {"svg", svg.string()}};
  fmt::print("{}\n", json_text(json));
}

int follow(const LoadPathWords& w) {
  if (w.path.from == w.path.to) throw UsageError(fmt::format("--from and --to are both {}; give a range of loads", w.path.to));
  const Job job = read_job(w.scene, w.settings);
  const fs::path csv = w.out.empty() ? fs::path(fs::path(w.scene).stem().string() + "-load-path.csv") : fs::path(w.out);
  const fs::path svg = fs::path(csv).replace_extension(".svg");
  require_not_read({csv, svg});
  const sim::LoadPath path = sim::load_path(job.scene, w.path);
  make_folder(fs::absolute(csv).parent_path());
  sim::write_whole_file(csv, path_csv(path));
  sim::write_whole_file(svg, film::diagram_svg(path_diagram(path, w.path.force)));
  report(w, path, csv, svg);
  return 0;
}

}  // namespace

Command add_load_path(Program& program) {
  const auto w = std::make_shared<LoadPathWords>();
  Subcommand app = program.subcommand("load-path", "states of equilibrium over a load, through limit points where a structure snaps");
  app.option("SCENE", w->scene, "scene file (TOML)").required();
  app.option("--force", w->path.force, "name of the force, torque or distributed force that is varied; default: all loads, weight too")
      .as("NAME");
  app.option("--from", w->path.from, "factor of the load where the curve begins").show_default();
  app.option("--to", w->path.to, "factor where it ends").show_default();
  app.option("--states", w->path.most_states, "most states on the curve").range(2, 100000).show_default();
  app.option("-o,--out", w->out, "CSV file, beside it the diagram as SVG; default: SCENE-load-path.csv").as("FILE");
  app.flag("--json", w->json, "report as JSON: limit points");
  add_scene_words(app, w->settings);
  app.footer(R"(The curve starts at the equilibrium beside the scene's assembled start and follows the states one after the other,
stable or not, whether the load rises or falls. Factors are of the values that the scene gives at t = 0.)");
  app.example("arch.toml --force load --to 2", "outputs of arch.toml up to twice its force 'load'");
  return {app, [w] { return follow(*w); }};
}

}  // namespace flexframe::cli
