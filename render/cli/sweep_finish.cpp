#include "render/cli/sweep_finish.h"

#include "render/cli/json_text.h"
#include "render/cli/shell_word.h"
#include "render/cli/terminal.h"

#include "render/film/sweep_plots.h"
#include "render/film/sweep_sheet.h"
#include "sim/base/words.h"
#include "sim/sweep/minimise.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

// Shards that lack points, of the cut that the sweep was begun with: shard -> points.
std::map<int, long> lacking_shards(const sim::Sweep& sweep, const sim::SweepTable& table) {
  std::map<int, long> out;
  if (sweep.goal) return out;
  for (long i = 0; i < sweep.design.size(); ++i)
    if (!table.has(i)) ++out[static_cast<int>(i % sweep.shards == 0 ? sweep.shards : i % sweep.shards)];
  return out;
}

std::string run_again(const sim::Sweep& sweep, int shard) {
  return fmt::format("flexframe sweep {} --shard {}/{} --resume", shell_word(sweep.folder.string()), shard, sweep.shards);
}

struct Range {
  double low = 0.0, high = 0.0;
  long low_at = -1, high_at = -1, count = 0;
};
Range range_of(const sim::SweepTable& table, Eigen::Index response) {
  Range out;
  for (long i = 0; i < table.responses.rows(); ++i) {
    const double x = table.responses(i, response);
    if (!std::isfinite(x)) continue;
    if (out.count == 0 || x < out.low) out.low = x, out.low_at = i;
    if (out.count == 0 || x > out.high) out.high = x, out.high_at = i;
    ++out.count;
  }
  return out;
}

void print_shards(const sim::Sweep& sweep, const sim::Collected& all) {
  constexpr std::size_t most_told = 20;
  for (const sim::Collected::Shard& s : all.shards) {
    const std::string file =
        (sweep.goal ? sim::search_file(sweep.folder, s.shard, s.shards) : sim::rows_file(sweep.folder, s.shard, s.shards)).string();
    if (!s.problem.empty()) fmt::print(stderr, "WARNING      {} {}; its rows are left out\n", file, s.problem);
    if (s.damaged > 0)
      fmt::print(stderr, "WARNING      {} has {} damaged {}, whose points count as missing\n", file, s.damaged,
                 s.damaged == 1 ? "row" : "rows");
  }
  if (all.missing == 0) return;
  if (sweep.goal) {
    fmt::print("missing      {} of {} searches have not ended\n             go on with them here: flexframe collect {} --run-missing\n",
               all.missing, sweep.design.searches(), shell_word(sweep.folder.string()));
    return;
  }
  const std::map<int, long> lacking = lacking_shards(sweep, all.table);
  fmt::print("missing      {} of {} points\n", all.missing, sweep.design.size());
  std::size_t told = 0;
  for (const auto& [shard, points] : lacking) {
    if (++told > most_told) break;
    fmt::print("             shard {}/{} lacks {}: {}\n", shard, sweep.shards, points, run_again(sweep, shard));
  }
  if (lacking.size() > most_told) fmt::print("             and {} more shards\n", lacking.size() - most_told);
  fmt::print("             all of them here: flexframe collect {} --run-missing\n", shell_word(sweep.folder.string()));
}

const char* end_words(sim::SearchEnd end) {
  switch (end) {
    case sim::SearchEnd::settled:
      return "settled";
    case sim::SearchEnd::out_of_runs:
      return "out of runs";
    case sim::SearchEnd::no_start:
      break;
  }
  return "no start";
}

nlohmann::ordered_json found_json(const sim::Sweep& sweep, const sim::SweepTable& table, const sim::FoundMinimum& found) {
  const auto goal = static_cast<Eigen::Index>(sweep.goal->response);
  nlohmann::ordered_json json = {{"goal", sweep.names[sweep.goal->response]}, {"point", nullptr}};
  if (found.best >= 0) {
    json["point"] = found.best;
    json["value"] = table.responses(found.best, goal);
    for (std::size_t k = 0; k < sweep.design.axes().size(); ++k)
      json["settings"][sweep.design.axes()[k].key] = sweep.design.point(found.best)[k].number;
    for (const sim::SweepLimit& limit : sweep.goal->limits)
      json["limits"].push_back({{"limit", limit.text}, {"value", table.responses(found.best, static_cast<Eigen::Index>(limit.response))}});
  }
  json["at_ends"] = found.at_ends;
  json["active_limits"] = found.active;
  json["warnings"] = found.warnings;
  for (const sim::FoundMinimum::Search& s : found.searches) {
    nlohmann::ordered_json one = {
        {"runs", s.runs}, {"without", s.without}, {"end", s.ended ? end_words(s.end) : "not ended"}, {"same", s.same}};
    if (s.best >= 0) one["value"] = table.responses(s.best, goal);
    json["searches"].push_back(one);
  }
  return json;
}

void print_found(const sim::Sweep& sweep, const sim::SweepTable& table, const sim::FoundMinimum& found) {
  const auto goal = static_cast<Eigen::Index>(sweep.goal->response);
  for (const std::string& warning : found.warnings) fmt::print(stderr, "WARNING      {}\n", warning);
  if (found.best >= 0) {
    const double error = table.error[found.best];
    fmt::print("{:<12} {} = {:.6g} (point {}){}\n", sweep.goal->maximise ? "maximum" : "minimum", sweep.names[sweep.goal->response],
               table.responses(found.best, goal), found.best,
               error >= 0.0 ? fmt::format("; estimated error of its run {:.2g} of the range of its outputs", error) : "");
    std::string settings;
    const std::vector<sim::Design::Value> values = sweep.design.point(found.best);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const std::string& key = sweep.design.axes()[k].key;
      fmt::print("{:<12} {} = {:.6g}\n", k == 0 ? "at" : "", key, values[k].number);
      settings += " --set " + shell_word(fmt::format("{}={}", key, values[k].text));
    }
    for (const std::string& setting : sweep.design.fixed()) settings += " --set " + shell_word(setting);
    if (!found.at_ends.empty())
      fmt::print("at an end    {}: the result may be {} beyond\n", fmt::join(found.at_ends, ", "),
                 sweep.goal->maximise ? "larger" : "smaller");
    for (const sim::SweepLimit& limit : sweep.goal->limits) {
      const bool active = std::find(found.active.begin(), found.active.end(), limit.text) != found.active.end();
      fmt::print("limit        {}: {:.6g}{}\n", limit.text, table.responses(found.best, static_cast<Eigen::Index>(limit.response)),
                 active ? ", which holds it back" : "");
    }
    fmt::print("to see it    flexframe run {}{}\n", shell_word(sweep.question.scene.string()), settings);
  }
  for (std::size_t k = 0; k < found.searches.size(); ++k) {
    const sim::FoundMinimum::Search& s = found.searches[k];
    fmt::print(
        "{:<12} {}: {} runs{}, {}{}\n", k == 0 ? "searches" : "", k + 1, s.runs,
        s.without > 0 ? fmt::format(", {} without response", s.without) : "", s.ended ? end_words(s.end) : "not ended",
        s.best < 0 ? ", none keeps all limits" : fmt::format(", {:.6g}{}", table.responses(s.best, goal), s.same ? "" : " (elsewhere)"));
  }
}

nlohmann::ordered_json to_json(const sim::Sweep& sweep, const sim::Collected& all) {
  nlohmann::ordered_json json = {{"folder", sweep.folder.string()}, {"points", sweep.design.size()}, {"missing", all.missing}};
  for (std::size_t k = 0; k < sim::point_end_words().size(); ++k)
    json["ends"][sim::point_end_words()[k]] = all.table.count(static_cast<sim::PointEnd>(k));
  json["cpu_seconds"] = all.table.cpu.sum();
  json["responses"] = nlohmann::ordered_json::object();
  for (std::size_t k = 0; k < sweep.names.size(); ++k) {
    const Range r = range_of(all.table, static_cast<Eigen::Index>(k));
    nlohmann::ordered_json one = {{"count", r.count}};
    if (r.count > 0) one.update({{"min", r.low}, {"min_at", r.low_at}, {"max", r.high}, {"max_at", r.high_at}});
    json["responses"][sweep.names[k]] = one;
  }
  json["run_again"] = nlohmann::ordered_json::array();
  for (const auto& [shard, points] : lacking_shards(sweep, all.table)) json["run_again"].push_back(run_again(sweep, shard));
  return json;
}

}  // namespace

void add_finish_words(Subcommand words, FinishWords& values) {
  words.flag("--no-plots", values.no_plots, "table only");
  words.option("--sheet", values.sheet, "a contact sheet besides: the scene at this time, s, at points over the design (sheet.png)")
      .not_negative();
  words.option("--sheet-points", values.sheet_points, "pictures of the contact sheet").range(1, 400).show_default();
  words.flag("--json", values.json, "summary as JSON");
}

int finish_sweep(sim::Sweep& sweep, const FinishWords& words) {
  sim::FoundMinimum found;
  const sim::Collected all = sweep.goal ? sim::collect_searches(sweep, found) : sim::collect_rows(sweep);
  sim::write_table_csv(sweep, all.table, sweep.folder / "table.csv");
  sim::write_table_hdf5(sweep, all.table, sweep.folder / "table.h5");
  if (!words.no_plots) film::write_sweep_report(sweep, all.table, sweep.folder);
  if (words.sheet) {
    Progress progress("drawing");
    film::SweepSheet sheet;
    sheet.time = *words.sheet;
    sheet.most = words.sheet_points;
    sheet.progress = [&](int done, int of) { progress.show(static_cast<double>(done) / of); };
    for (const std::string& note : film::write_sweep_sheet(sweep, sheet, sweep.folder / "sheet.png"))
      fmt::print(stderr, "note         {}\n", note);
  }
  const bool any = all.table.responses.size() > 0 && all.table.responses.array().isFinite().any();
  const int code = all.missing > 0 || !any || (sweep.goal && found.best < 0) ? 1 : 0;
  if (words.json) {
    nlohmann::ordered_json json = to_json(sweep, all);
    if (sweep.goal) json["found"] = found_json(sweep, all.table, found);
    fmt::print("{}\n", json_text(json));
    return code;
  }
  std::string ends;
  for (std::size_t k = 0; k < sim::point_end_words().size(); ++k)
    if (const long n = all.table.count(static_cast<sim::PointEnd>(k)); n > 0)
      ends += fmt::format("{}{} {}", ends.empty() ? "" : ", ", n, sim::point_end_words()[k]);
  if (sweep.goal) print_found(sweep, all.table, found);
  fmt::print("points       {}: {}; {:.2f} CPU s\n",
             sweep.goal ? fmt::format("{} runs of {} searches", all.table.rows(), sweep.design.searches())
                        : fmt::format("{} of {}", all.table.rows(), sweep.design.size()),
             ends.empty() ? "none" : ends, all.table.cpu.sum());
  for (std::size_t k = 0; k < sweep.names.size(); ++k) {
    const Range r = range_of(all.table, static_cast<Eigen::Index>(k));
    if (r.count == 0) fmt::print("{:<12} no value\n", sweep.names[k]);
    else fmt::print("{:<12} {:.6g} (point {}) to {:.6g} (point {})\n", sweep.names[k], r.low, r.low_at, r.high, r.high_at);
  }
  print_shards(sweep, all);
  for (const sim::Sensitivity& s : sim::sensitivities(sweep, all.table))
    for (std::size_t k = 0; k < s.sobol.size(); ++k)
      fmt::print("{:<12} {}: first {:.4f}, total {:.4f}\n", k == 0 ? s.response : "", sweep.design.axes()[k].key, s.sobol[k].first,
                 s.sobol[k].total);
  fmt::print("table        {}, table.h5{}\n", (sweep.folder / "table.csv").string(), words.no_plots ? "" : "; page: report.html, diagrams");
  return code;
}

}  // namespace flexframe::cli
