// The page of a sweep and the files of its diagrams.
#include "render/base/html.h"
#include "render/film/sweep_plots.h"
#include "render/image/png.h"
#include "sim/base/file_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

using render::escape_html;

std::string row(const std::vector<std::string>& cells, const char* tag = "td") {
  std::string out = "<tr>";
  for (const std::string& cell : cells) out += fmt::format("<{0}>{1}</{0}>", tag, escape_html(cell));
  return out + "</tr>\n";
}

// Smallest and largest of every response, with the point that has it.
std::string response_table(const sim::Sweep& sweep, const sim::SweepTable& table) {
  std::string out = "<table>\n" + row({"response", "points", "smallest", "at point", "largest", "at point"}, "th");
  for (std::size_t k = 0; k < sweep.names.size(); ++k) {
    long count = 0, low = -1, high = -1;
    const auto y = table.responses.col(static_cast<Eigen::Index>(k));
    for (long i = 0; i < y.size(); ++i) {
      if (!std::isfinite(y[i])) continue;
      ++count;
      if (low < 0 || y[i] < y[low]) low = i;
      if (high < 0 || y[i] > y[high]) high = i;
    }
    if (count == 0) out += row({sweep.names[k], "0", "", "", "", ""});
    else
      out += row({sweep.names[k], fmt::format("{}", count), fmt::format("{:.6g}", y[low]), fmt::format("{}", low),
                  fmt::format("{:.6g}", y[high]), fmt::format("{}", high)});
  }
  return out + "</table>\n";
}

std::string index_table(const sim::Sweep& sweep, const std::vector<sim::Sensitivity>& indices) {
  std::string out;
  for (const sim::Sensitivity& s : indices) {
    if (s.sobol.empty() && s.morris.empty()) {
      out += fmt::format("<p>{}: no indices; it does not vary, or too few points have it.</p>\n", escape_html(s.response));
      continue;
    }
    const bool sobol = !s.sobol.empty();
    out += "<table>\n" + row(sobol ? std::vector<std::string>{s.response, "first", "95 %", "total", "95 %"}
                                   : std::vector<std::string>{s.response, "mu*", "mu", "sigma"},
                             "th");
    for (std::size_t k = 0; k < sweep.design.axes().size(); ++k) {
      const std::string& key = sweep.design.axes()[k].key;
      if (sobol) {
        const sim::SobolIndex& i = s.sobol[k];
        out += row({key, fmt::format("{:.4f}", i.first), fmt::format("{:.4f} to {:.4f}", i.first_low, i.first_high),
                    fmt::format("{:.4f}", i.total), fmt::format("{:.4f} to {:.4f}", i.total_low, i.total_high)});
      } else {
        const sim::MorrisEffect& e = s.morris[k];
        out += row({key, fmt::format("{:.4g}", e.mean_size), fmt::format("{:.4g}", e.mean), fmt::format("{:.4g}", e.deviation)});
      }
    }
    out += "</table>\n";
  }
  return out;
}

// What is no plain "done", by its sentence: the most frequent first.
std::string problem_table(const sim::SweepTable& table) {
  constexpr std::size_t most_told = 20;
  std::map<std::pair<int, std::string>, std::pair<long, long>> groups;  // how often, first point
  for (const auto& [point, message] : table.messages) {
    auto& group = groups.try_emplace({table.ends[static_cast<std::size_t>(point)], message}, 0, point).first->second;
    ++group.first;
  }
  if (groups.empty()) return "";
  std::vector<std::pair<std::pair<int, std::string>, std::pair<long, long>>> all(groups.begin(), groups.end());
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.second.first > b.second.first; });
  std::string out = "<h2>What points had to say</h2>\n<table>\n" + row({"end", "points", "first", "sentence"}, "th");
  for (std::size_t k = 0; k < std::min(most_told, all.size()); ++k)
    out += row({sim::point_end_words()[static_cast<std::size_t>(all[k].first.first)], fmt::format("{}", all[k].second.first),
                fmt::format("{}", all[k].second.second), all[k].first.second});
  out += "</table>\n";
  if (all.size() > most_told) out += fmt::format("<p>and {} more sentences: table.csv</p>\n", all.size() - most_told);
  return out;
}

constexpr const char* style =
    "body{font:15px/1.5 'DejaVu Sans',sans-serif;margin:2em auto;max-width:1000px;padding:0 1em;color:#21262e}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border-bottom:1px solid #dbe0e5;padding:.2em .8em;text-align:left;"
    "font-variant-numeric:tabular-nums}svg{max-width:100%;height:auto;margin:.5em 0}code{background:#f0f2f4;padding:0 .2em}";

std::string page(const sim::Sweep& sweep, const sim::SweepTable& table, const std::vector<sim::Sensitivity>& indices,
                 const std::vector<SweepPlot>& plots) {
  const std::string name = sweep.question.scene.filename().string();
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Sweep of "
      "{0}</title><style>{1}</style></head><body>\n<h1>Sweep of {0}</h1>\n",
      escape_html(name), style);
  std::string ends;
  for (std::size_t k = 0; k < sim::point_end_words().size(); ++k)
    if (const long n = table.count(static_cast<sim::PointEnd>(k)); n > 0)
      ends += fmt::format("{}{} {}", ends.empty() ? "" : ", ", n, sim::point_end_words()[k]);
  out += fmt::format(
      "<p>{} of {} points: {}; {:.4g} CPU s. Table: <a href=\"table.csv\">table.csv</a>, <a href=\"table.h5\">table.h5</a>.</p>\n<p>",
      table.rows(), sweep.design.size(), escape_html(ends), table.cpu.sum());
  for (const std::string& setting : sweep.question.design.settings) out += fmt::format("<code>--set {}</code> ", escape_html(setting));
  if (!sweep.question.design.sample.empty()) out += fmt::format("<code>--sample {}</code> ", escape_html(sweep.question.design.sample));
  if (!sweep.question.design.sensitivity.empty())
    out += fmt::format("<code>--sensitivity {}</code> ", escape_html(sweep.question.design.sensitivity));
  if (sweep.goal) {
    const sim::GoalWords& goal = sweep.question.goal;
    out += fmt::format("<code>--{} {}</code> ", goal.maximise ? "maximise" : "minimise", escape_html(goal.text));
    for (const std::string& limit : goal.limits) out += fmt::format("<code>--limit {}</code> ", escape_html(limit));
  }
  out += "</p>\n" + response_table(sweep, table) + index_table(sweep, indices);
  for (const SweepPlot& plot : plots)
    out += fmt::format("<h2 id=\"{}\">{}</h2>\n{}", plot.name, escape_html(plot.title), flat_svg(plot.drawing));
  return out + problem_table(table) + "</body></html>\n";
}

}  // namespace

void write_sweep_report(const sim::Sweep& sweep, const sim::SweepTable& table, const std::filesystem::path& folder) {
  const std::vector<sim::Sensitivity> indices = sim::sensitivities(sweep, table);
  const std::vector<SweepPlot> plots = sweep_plots(sweep, table, indices);
  for (const SweepPlot& plot : plots) {
    sim::write_whole_file(folder / (plot.name + ".svg"), flat_svg(plot.drawing));
    render::write_png(folder / (plot.name + ".png"), flat_image(plot.drawing));
  }
  sim::write_whole_file(folder / "report.html", page(sweep, table, indices, plots));
}

}  // namespace flexframe::film
