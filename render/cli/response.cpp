// flexframe response: steady response of a scene's outputs to one of its forces over the frequency, CSV and SVG.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"

#include "render/film/diagram.h"
#include "sim/base/file_output.h"
#include "sim/run/frequency_check.h"
#include "sim/run/frequency_response.h"
#include "sim/run/run_scene.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct ResponseWords {
  std::string scene, force, out;
  std::vector<std::string> settings;
  double from = 0.0, to = 0.0;
  int points = 400;
  bool json = false;
};

// Evenly spaced logarithms; the frequencies of the modes between them too, where peaks are.
sim::VecX frequencies_of(const ResponseWords& w, const std::vector<double>& modes) {
  const double lowest = modes.empty() ? 1.0 : modes.front(), highest = modes.empty() ? 100.0 : modes[std::min<size_t>(modes.size(), 6) - 1];
  const double from = w.from > 0.0 ? w.from : 0.1 * lowest, to = w.to > 0.0 ? w.to : 2.0 * highest;
  if (!(from < to)) throw UsageError(fmt::format("--from {} must be smaller than --to {}", from, to));
  std::vector<double> all;
  for (int i = 0; i < w.points; ++i) all.push_back(from * std::pow(to / from, static_cast<double>(i) / (w.points - 1)));
  for (const double f : modes)
    if (f > from && f < to) all.push_back(f);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return Eigen::Map<const sim::VecX>(all.data(), static_cast<Eigen::Index>(all.size()));
}

std::string response_csv(const sim::FrequencyResponse& r, const sim::VecX& frequencies) {
  std::string csv = "frequency";
  for (const std::string& column : r.columns) csv += fmt::format(",{0},{0}:phase", column);
  csv += '\n';
  for (Eigen::Index f = 0; f < frequencies.size(); ++f) {
    csv += fmt::format("{}", frequencies[f]);
    for (Eigen::Index c = 0; c < r.values.rows(); ++c)
      csv += fmt::format(",{},{}", std::abs(r.values(c, f)), std::arg(r.values(c, f)) * 180.0 / std::numbers::pi);
    csv += '\n';
  }
  return csv;
}

film::Diagram response_diagram(const sim::FrequencyResponse& r, const sim::VecX& frequencies, const std::string& force) {
  film::Diagram diagram{
      .title = "response to " + force, .x_label = "frequency, Hz", .y_label = "amplitude per unit of the force", .note = {}, .series = {}};
  const double largest = r.values.size() > 0 ? r.values.cwiseAbs().maxCoeff() : 0.0;
  for (Eigen::Index c = 0; c < r.values.rows(); ++c) {
    // What moves by rounding only is no curve.
    if (!(r.values.row(c).cwiseAbs().maxCoeff() > 1e-12 * largest)) continue;
    film::DiagramSeries series{.label = fmt::format("{}, {}", r.columns[c], r.units[c]), .points = {}};
    for (Eigen::Index f = 0; f < frequencies.size(); ++f) series.points.push_back({frequencies[f], std::abs(r.values(c, f)), false, {}});
    diagram.series.push_back(std::move(series));
  }
  return diagram;
}

// Where each output is largest: the whole report with --json.
void report(const ResponseWords& w, const sim::FrequencyResponse& r, const sim::VecX& frequencies, const sim::Notes& told,
            const fs::path& csv, const fs::path& svg) {
  const std::vector<std::string> warnings = told.texts(sim::Severity::warning);
  std::vector<std::string> notes = r.notes;
  for (std::string& note : told.texts(sim::Severity::note)) notes.push_back(std::move(note));
  nlohmann::ordered_json json = {{"scene", w.scene}, {"force", w.force}, {"modes", r.modes}, {"outputs", nlohmann::ordered_json::array()}};
  for (Eigen::Index c = 0; c < r.values.rows(); ++c) {
    Eigen::Index peak = 0;
    const double most = r.values.row(c).cwiseAbs().maxCoeff(&peak);
    json["outputs"].push_back({{"column", r.columns[c]}, {"unit", r.units[c]}, {"largest", most}, {"frequency", frequencies[peak]}});
    if (!w.json) fmt::print("{:<20} largest {:.5g} {} per unit at {:.5g} Hz\n", r.columns[c], most, r.units[c], frequencies[peak]);
  }
  json.update({{"warnings", warnings}, {"notes", notes}, {"left_out", r.left_out}, {"csv", csv.string()}, {"svg", svg.string()}});
  if (w.json) return fmt::print("{}\n", json_text(json));
  for (const std::string& warning : warnings) fmt::print("WARNING      {}\n", warning);
  for (const std::string& note : notes) fmt::print("note         {}\n", note);
  if (!r.left_out.empty()) fmt::print("note         left out, no linear answer: {}\n", fmt::join(r.left_out, ", "));
  fmt::print("response     {}\ndiagram      {}\n", csv.string(), svg.string());
}

// At the frequency of a vibration without damping the response has no limit.
void tell_of_undamped(const sim::Linearisation& linear, const sim::VecX& frequencies, sim::Notes& told) {
  std::vector<double> hertz;
  for (const sim::LinearMode& mode : linear.modes)
    if (mode.kind == sim::LinearMode::vibration && mode.damping < 1e-9 && mode.frequency >= frequencies[0] &&
        mode.frequency <= frequencies[frequencies.size() - 1])
      hertz.push_back(mode.frequency);
  if (hertz.empty()) return;
  std::sort(hertz.begin(), hertz.end());
  told.warn(
      {fmt::format("{} at {:.5g} Hz{} without damping: the response there has no limit, and its numbers are rounding; give what "
                   "vibrates damping",
                   hertz.size() == 1 ? "a vibration" : fmt::format("{} vibrations, the first", hertz.size()), hertz.front(),
                   hertz.size() == 1 ? " is" : ", are")});
}

int respond(const ResponseWords& w) {
  const Job job = read_job(w.scene, w.settings);
  const fs::path csv = w.out.empty() ? fs::path(fs::path(w.scene).stem().string() + "-response.csv") : fs::path(w.out);
  const fs::path svg = fs::path(csv).replace_extension(".svg");
  require_not_read({csv, svg});
  const sim::System system = sim::make_system(job.scene);
  const sim::FrequencyResponse first = sim::frequency_response(system, w.force, sim::VecX::Ones(1));
  const sim::VecX frequencies = frequencies_of(w, first.modes);
  const sim::FrequencyResponse r = sim::frequency_response(system, w.force, frequencies);
  make_folder(fs::absolute(csv).parent_path());
  sim::write_whole_file(csv, response_csv(r, frequencies));
  sim::write_whole_file(svg, film::diagram_svg(response_diagram(r, frequencies, w.force)));
  sim::Notes told = system.notes;
  for (const std::string& warning : r.warnings) told.warn("", warning);
  const std::vector<sim::RicherBeams> richer = sim::richer_beams(system, told);
  const sim::Linearisation linear = sim::linearise(system);
  tell_of_undamped(linear, frequencies, told);
  // A resonance just above the range is seen within it.
  constexpr double beyond = 1.1;
  sim::tell_of_frequencies(system, linear, richer, sim::unasked_accuracy, beyond * frequencies[frequencies.size() - 1], told);
  sim::tell_of_last_modes(system, frequencies[frequencies.size() - 1], told);
  sim::tell_of_response(system, linear, r, richer, sim::unasked_accuracy, told);
  report(w, r, frequencies, told, csv, svg);
  return 0;
}

}  // namespace

Command add_response(Program& program) {
  const auto w = std::make_shared<ResponseWords>();
  Subcommand app = program.subcommand("response", "frequency response of outputs to a force, for small motions about the start");
  app.option("SCENE", w->scene, "scene file (TOML)").required();
  app.option("--force", w->force, "name of a force, torque or distributed force of the scene").as("NAME").required();
  app.option("--from", w->from, "lowest frequency, Hz; default: a tenth of the first mode's").positive();
  app.option("--to", w->to, "highest frequency, Hz; default: twice the sixth mode's").positive();
  app.option("--points", w->points, "number of frequencies, evenly spaced in their logarithms").range(2, 100000).show_default();
  app.option("-o,--out", w->out, "CSV file, beside it the diagram as SVG; default: SCENE-response.csv").as("FILE");
  app.flag("--json", w->json, "report as JSON: modes in Hz, where each output is largest");
  add_scene_words(app, w->settings);
  app.footer(
      R"(Amplitudes are those per N (N m, N/m) of the force, phases in degrees ahead of it. Outputs: places, angles, displacements,
joint values, lengths, forces of springs, their rates and accelerations; energies, reactions and section forces are left out, and
what has a corner at the start: an angle or distance that is zero there.)");
  app.example("bridge.toml --force load", "amplitude and phase of all outputs per newton of the force 'load'");
  app.example("bridge.toml --force load --from 1 --to 50 --points 1000 --json", "between 1 and 50 Hz, peaks as JSON");
  return {app, [w] { return respond(*w); }};
}

}  // namespace flexframe::cli
