// flexframe effects: what is simulated of a scene and what is left out, why, what each costs and is worth.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/terminal.h"

#include "sim/run/effect_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <memory>

namespace flexframe::cli {
namespace {

// What the effect adds to the scene's CPU time, or would add: against the run as it stands.
double cpu_share(const sim::EffectRow& row, const sim::EffectReport& report) {
  return report.cpu > 0.0 ? (row.cpu_on - row.cpu_off) / report.cpu : 0.0;
}

std::string share_text(const sim::EffectRow& row) {
  if (!row.state.possible) return "0";
  if (!row.measured) return "not measured";
  // Where the runs differ by the whole range whatever is switched, or a share is more than rounding can be of, there is no number.
  if (row.floor >= 1.0 || !std::isfinite(row.share)) return "not measurable here";
  // At rest time integration has no error.
  if (row.share <= row.floor) return row.floor > 0.0 ? fmt::format("below {:.1g}", row.floor) : "0";
  return fmt::format("{:.2g} of {}", row.share, row.column);
}

// "+12 %", or in words where a percentage says nothing: without the effect the run takes several times as long.
std::string price_text(const sim::EffectRow& row, const sim::EffectReport& report) {
  if (!row.measured) return "";
  const double share = cpu_share(row, report);
  return share < -1.0 ? "shorter" : fmt::format("{:+.0f} %", 100.0 * share);
}

void print_table(const std::string& scene, const sim::EffectReport& report) {
  fmt::print("{}: {:.4f} CPU s at tolerance {:g}; {}\n", scene, report.cpu, report.tolerance,
             report.floor == 0.0  ? "time integration has no error here"
             : report.floor < 1.0 ? fmt::format("effects below {:.1g} % cannot be resolved", 100.0 * report.floor)
                                  : "no effect can be resolved: at this tolerance the time error is as large as the outputs");
  fmt::print("{:<16} {:<11} {:<4} {:<9} {:>4} {:>7}  {:<28} {}\n", "owner", "effect", "", "decided", "DOF", "CPU", "influence", "why");
  for (const sim::EffectRow& row : report.rows) {
    const sim::EffectState& s = row.state;
    const std::string cpu = price_text(row, report);
    fmt::print("{:<16} {:<11} {:<4} {:<9} {:>4} {:>7}  {:<28} {}{}{}\n", s.owner, s.effect, s.on ? "on" : "off", s.by, s.coordinates, cpu,
               share_text(row), s.why, row.note.empty() ? "" : "; ", row.note);
  }
  fmt::print(
      "influence: the largest change of an output when the effect is switched, relative to the output's range; CPU: the time that the "
      "effect adds to the run, or would add (shorter: this effect shortens the run to less than half)\n");
}

nlohmann::ordered_json report_json(const std::string& scene, const sim::EffectReport& report) {
  nlohmann::ordered_json out = {{"scene", scene}, {"cpu_seconds", report.cpu}, {"tolerance", report.tolerance}, {"floor", report.floor}};
  out["effects"] = nlohmann::ordered_json::array();
  for (const sim::EffectRow& row : report.rows) {
    const sim::EffectState& s = row.state;
    nlohmann::ordered_json one = {
        {"owner", s.owner}, {"effect", s.effect},          {"on", s.on}, {"possible", s.possible}, {"decided_by", s.by},
        {"why", s.why},     {"coordinates", s.coordinates}};
    if (!s.possible || row.measured) {
      one["share"] = row.share;
      one["column"] = row.column;
      one["floor"] = row.floor;
      nlohmann::ordered_json shares = nlohmann::ordered_json::object();
      for (size_t k = 0; k < report.columns.size(); ++k) shares[report.columns[k]] = row.shares[static_cast<Eigen::Index>(k)];
      one["shares"] = shares;
      one["cpu_share"] = row.measured ? cpu_share(row, report) : 0.0;
    } else {
      one["share"] = nullptr;
    }
    if (!row.note.empty()) one["note"] = row.note;
    if (const sim::EffectInfo* info = sim::find_effect(s.effect))
      one["registry"] = {
          {"meaning", info->meaning}, {"equation", info->equation}, {"matters", info->matters}, {"estimate", info->estimate}};
    out["effects"].push_back(one);
  }
  return out;
}

void print_registry() {
  for (const sim::EffectInfo& e : sim::effect_registry())
    fmt::print("{}\n  what      {}\n  equation  {}\n  matters   {}\n  estimate  {}\n", e.name, e.meaning, e.equation, e.matters,
               e.estimate);
}

}  // namespace

Command add_effects(Program& program) {
  struct Words {
    std::string scene;
    std::vector<std::string> settings;
    std::optional<double> tolerance;
    bool json = false, list = false;
  };
  const auto words = std::make_shared<Words>();
  Subcommand app = program.subcommand("effects", "which effects are on, who decided and why, the CPU time and the influence of each");
  app.option("SCENE", words->scene, "scene file (TOML)");
  add_scene_words(app, words->settings);
  app.option("--tolerance", words->tolerance, "tolerance of the compared runs; default: ten times the scene's").range(1e-13, 1e-1);
  app.flag("--list", words->list, "list all effects with equation, when they matter and how they are estimated");
  app.flag("--json", words->json, "report as JSON");
  app.example("crane.toml", "the influence of every effect and the CPU time it takes");
  app.example("--list", "all effects that there are");

  return {app, [words] {
            if (words->list) {
              print_registry();
              if (words->scene.empty()) return 0;
            }
            if (words->scene.empty()) throw UsageError("effects needs a SCENE or --list");
            const Job job = read_job(words->scene, words->settings);
            sim::EffectOptions options;
            options.tolerance = words->tolerance.value_or(0.0);
            Progress progress("measuring");
            options.progress = [&](double fraction) { progress.show(fraction); };
            const sim::EffectReport report = sim::report_effects(job.scene, options);
            if (words->json) fmt::print("{}\n", json_text(report_json(words->scene, report)));
            else print_table(words->scene, report);
            return 0;
          }};
}

}  // namespace flexframe::cli
