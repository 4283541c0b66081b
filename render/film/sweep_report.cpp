// The page of a sweep and the files of its diagrams.
#include "render/base/house_page.h"
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

using Rows = std::vector<std::vector<std::string>>;

// Smallest and largest of every response, with the point that has it.
std::string response_table(const sim::Sweep& sweep, const sim::SweepTable& table) {
  Rows rows{{"response", "points", "smallest", "at point", "largest", "at point"}};
  for (std::size_t k = 0; k < sweep.names.size(); ++k) {
    long count = 0, low = -1, high = -1;
    const auto y = table.responses.col(static_cast<Eigen::Index>(k));
    for (long i = 0; i < y.size(); ++i) {
      if (!std::isfinite(y[i])) continue;
      ++count;
      if (low < 0 || y[i] < y[low]) low = i;
      if (high < 0 || y[i] > y[high]) high = i;
    }
    if (count == 0) rows.push_back({sweep.names[k], "0", "", "", "", ""});
    else
      rows.push_back({sweep.names[k], fmt::format("{}", count), fmt::format("{:.6g}", y[low]), fmt::format("{}", low),
                      fmt::format("{:.6g}", y[high]), fmt::format("{}", high)});
  }
  return render::house_table(rows);
}

std::string index_table(const sim::Sweep& sweep, const std::vector<sim::Sensitivity>& indices) {
  std::string out;
  for (const sim::Sensitivity& s : indices) {
    if (s.sobol.empty() && s.morris.empty()) {
      out += fmt::format("<p>{}: no indices; it does not vary, or too few points have it.</p>\n", escape_html(s.response));
      continue;
    }
    const bool sobol = !s.sobol.empty();
    Rows rows{sobol ? std::vector<std::string>{s.response, "first", "95 %", "total", "95 %"}
                    : std::vector<std::string>{s.response, "mu*", "mu", "sigma"}};
    for (std::size_t k = 0; k < sweep.design.axes().size(); ++k) {
      const std::string& key = sweep.design.axes()[k].key;
      if (sobol) {
        const sim::SobolIndex& i = s.sobol[k];
        rows.push_back({key, fmt::format("{:.4f}", i.first), fmt::format("{:.4f} to {:.4f}", i.first_low, i.first_high),
                        fmt::format("{:.4f}", i.total), fmt::format("{:.4f} to {:.4f}", i.total_low, i.total_high)});
      } else {
        const sim::MorrisEffect& e = s.morris[k];
        rows.push_back({key, fmt::format("{:.4g}", e.mean_size), fmt::format("{:.4g}", e.mean), fmt::format("{:.4g}", e.deviation)});
      }
    }
    out += render::house_table(rows, true);
  }
  return out;
}

// What is no plain "done", by its sentence: the most frequent first.
std::string problem_table(const sim::SweepTable& table) {
  constexpr std::size_t most_told = 20;
  std::map<std::pair<int, std::string>, std::pair<long, long>> groups;  // how often, first point
  for (const auto& [point, message] : table.messages) {
    auto& group = groups.try_emplace({table.ends[point], message}, 0, point).first->second;
    ++group.first;
  }
  if (groups.empty()) return "";
  std::vector<std::pair<std::pair<int, std::string>, std::pair<long, long>>> all(groups.begin(), groups.end());
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.second.first > b.second.first; });
  Rows rows{{"end", "points", "first", "sentence"}};
  for (std::size_t k = 0; k < std::min(most_told, all.size()); ++k)
    rows.push_back({sim::point_end_words()[all[k].first.first], fmt::format("{}", all[k].second.first),
                    fmt::format("{}", all[k].second.second), all[k].first.second});
  std::string out = "<h2>Messages of the points</h2>\n" + render::house_table(rows, true);
  if (all.size() > most_told) out += fmt::format("<p>and {} more messages: table.csv</p>\n", all.size() - most_told);
  return out;
}

std::string page(const sim::Sweep& sweep, const sim::SweepTable& table, const std::vector<sim::Sensitivity>& indices,
                 const std::vector<SweepPlot>& plots) {
  const std::string name = sweep.question.scene.filename().string();
  std::string out = render::house_head("Sweep of " + name);
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
  return out + problem_table(table) + render::house_tail();
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
