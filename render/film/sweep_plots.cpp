#include "render/film/sweep_plots.h"

#include "render/film/diagram.h"
#include "render/image/text.h"
#include "render/picture/colormap.h"
#include "sim/sweep/minimise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace flexframe::film {
namespace {

using glm::dvec2;
using glm::vec3;

constexpr std::size_t most_series = 8;

// "deflection", "max_abs_rod_middle_y": a name for files.
std::string file_name(const std::string& kind, const std::string& text) {
  std::string out = kind + "_";
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (plain) out += c;
    else if (out.back() != '_') out += '_';
  }
  while (out.back() == '_') out.pop_back();
  return out.substr(0, 80);
}

// ---- Curves of a grid: a response over the key of numbers with most values, a line for each combination of the others.

struct Grid {
  std::vector<std::size_t> numeric;  // axes of numbers, most values first
};
Grid grid_of(const sim::Design& design) {
  Grid out;
  for (std::size_t k = 0; k < design.axes().size(); ++k)
    if (!design.axes()[k].chance && !design.axes()[k].numbers.empty()) out.numeric.push_back(k);
  std::stable_sort(out.numeric.begin(), out.numeric.end(),
                   [&](std::size_t a, std::size_t b) { return design.axes()[a].values.size() > design.axes()[b].values.size(); });
  return out;
}

// Points on a line of the grid: all that have the same values of the other axes. index: one of them.
std::vector<long> line_through(const sim::Design& design, std::size_t axis, long index) {
  long step = 1;
  for (std::size_t k = axis + 1; k < design.axes().size(); ++k) step *= static_cast<long>(design.axes()[k].values.size());
  const auto count = static_cast<long>(design.axes()[axis].values.size());
  const long first = index - (index / step % count) * step;
  std::vector<long> out;
  for (long k = 0; k < count; ++k) out.push_back(first + k * step);
  return out;
}

std::string others_text(const sim::Design& design, std::size_t axis, long index) {
  const std::vector<sim::Design::Value> values = design.point(index);
  std::string out;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (k != axis)
      out += fmt::format("{}{} = {}", out.empty() ? "" : ", ", short_key(design, k),
                         design.axes()[k].numbers.empty() ? values[k].text : fmt::format("{:.4g}", values[k].number));
  return out;
}

std::optional<SweepPlot> curves(const sim::Sweep& sweep, const sim::SweepTable& table, std::size_t response) {
  const sim::Design& design = sweep.design;
  const std::size_t axis = grid_of(design).numeric.front();
  const sim::SweepAxis& x = design.axes()[axis];
  std::vector<long> firsts;  // a point of each line
  for (long i = 0; i < design.size(); ++i)
    if (line_through(design, axis, i).front() == i) firsts.push_back(i);
  Diagram d;
  d.title = sweep.names[response];
  d.x_label = x.key;
  d.y_label = sweep.names[response];
  d.linear_x = !x.logarithmic, d.linear_y = true;
  const std::size_t shown = std::min(most_series, firsts.size());
  // The name of one other key stands below, once.
  const std::size_t other = axis == 0 ? 1 : 0;
  const bool one = design.axes().size() == 2;
  if (one) d.note = fmt::format("lines: {}", design.axes()[other].key);
  if (shown < firsts.size()) d.note += fmt::format("{}{} of {} lines are shown; table.csv has all", one ? "; " : "", shown, firsts.size());
  bool any = false;
  for (std::size_t s = 0; s < shown; ++s) {
    const long first = firsts[shown > 1 ? s * (firsts.size() - 1) / (shown - 1) : 0];
    DiagramSeries series;
    const std::string text = others_text(design, axis, first);
    series.label = render::fit_text(one ? text.substr(text.find("= ") + 2) : text, 12.0, 155.0);
    for (const long i : line_through(design, axis, first)) {
      const double y = table.responses(i, static_cast<Eigen::Index>(response));
      if (std::isfinite(y)) series.points.push_back({design.point(i)[axis].number, y, false, {}});
    }
    std::sort(series.points.begin(), series.points.end(), [](const DiagramPoint& a, const DiagramPoint& b) { return a.x < b.x; });
    any = any || series.points.size() > 1;
    d.series.push_back(std::move(series));
  }
  if (!any) return std::nullopt;
  return SweepPlot{file_name("curve", d.title), d.title + " over " + x.key, diagram_drawing(d)};
}

// ---- Contour maps: a response over two keys.

struct Corner {
  dvec2 at;
  double z;
};

// The part of a triangle where z >= level, as a polygon.
std::vector<dvec2> above(const std::array<Corner, 3>& t, double level) {
  std::vector<dvec2> out;
  for (std::size_t k = 0; k < 3; ++k) {
    const Corner &a = t[k], &b = t[(k + 1) % 3];
    if (a.z >= level) out.push_back(a.at);
    if ((a.z >= level) != (b.z >= level)) out.push_back(a.at + (b.at - a.at) * ((level - a.z) / (b.z - a.z)));
  }
  return out;
}
// The line z = level in a triangle; empty or two points.
std::vector<dvec2> crossing(const std::array<Corner, 3>& t, double level) {
  std::vector<dvec2> out;
  for (std::size_t k = 0; k < 3; ++k) {
    const Corner &a = t[k], &b = t[(k + 1) % 3];
    if ((a.z >= level) != (b.z >= level)) out.push_back(a.at + (b.at - a.at) * ((level - a.z) / (b.z - a.z)));
  }
  return out;
}

struct Frame {
  double left, top, width, height;
  FlatAxis x, y;
  dvec2 place(double px, double py) const { return {left + width * x.at(px), top + height * (1.0 - y.at(py))}; }
};

void draw_frame(FlatDrawing& out, const Frame& f, const std::string& x_label, const std::string& y_label) {
  for (const double t : flat_ticks(f.x)) {
    const double at = f.left + f.width * f.x.at(t);
    out.strokes.push_back({{{at, f.top + f.height}, {at, f.top + f.height + 5.0}}, 1.0, flat_ink, 1.0f, 0.0});
    out.words.push_back({{at, f.top + f.height + 20.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::middle});
  }
  for (const double t : flat_ticks(f.y)) {
    const double at = f.top + f.height * (1.0 - f.y.at(t));
    out.strokes.push_back({{{f.left - 5.0, at}, {f.left, at}}, 1.0, flat_ink, 1.0f, 0.0});
    out.words.push_back({{f.left - 8.0, at + 4.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::right});
  }
  const dvec2 a(f.left, f.top), b(f.left + f.width, f.top + f.height);
  out.strokes.push_back({{{a.x, a.y}, {b.x, a.y}, {b.x, b.y}, {a.x, b.y}, {a.x, a.y}}, 1.2, flat_ink, 1.0f, 0.0});
  out.words.push_back({{f.left + 0.5 * f.width, f.top + f.height + 40.0}, x_label, 13.0, flat_ink, FlatAnchor::middle});
  out.words.push_back({{20.0, f.top + 0.5 * f.height}, y_label, 13.0, flat_ink, FlatAnchor::middle, false, true});
}

// An axis that ends at its values.
FlatAxis tight_axis(const sim::SweepAxis& axis) {
  const auto [low, high] = std::minmax_element(axis.numbers.begin(), axis.numbers.end());
  FlatAxis out{0.0, 1.0, !axis.logarithmic};
  out.low = out.mark(*low), out.high = out.mark(*high);
  return out;
}

// Order of an axis' values by size.
std::vector<std::size_t> ascending(const sim::SweepAxis& axis) {
  std::vector<std::size_t> out(axis.numbers.size());
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = k;
  std::sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) { return axis.numbers[a] < axis.numbers[b]; });
  return out;
}

// The triangles of the map, four a cell of the grid about its middle; cells with a missing corner are left out.
std::vector<std::array<Corner, 3>> triangles(const sim::Sweep& sweep, const sim::SweepTable& table, std::size_t response, std::size_t ax,
                                             std::size_t ay, const Frame& frame) {
  const sim::Design& design = sweep.design;
  std::vector<std::vector<Corner>> corners;
  for (const std::size_t i : ascending(design.axes()[ax])) {
    std::vector<Corner> row;
    const long first = line_through(design, ax, 0)[i];
    for (const std::size_t j : ascending(design.axes()[ay])) {
      const long point = line_through(design, ay, first)[j];
      row.push_back({frame.place(design.axes()[ax].numbers[i], design.axes()[ay].numbers[j]),
                     table.responses(point, static_cast<Eigen::Index>(response))});
    }
    corners.push_back(std::move(row));
  }
  std::vector<std::array<Corner, 3>> out;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i)
    for (std::size_t j = 0; j + 1 < corners[i].size(); ++j) {
      const std::array<Corner, 4> c = {corners[i][j], corners[i + 1][j], corners[i + 1][j + 1], corners[i][j + 1]};
      const Corner middle{0.25 * (c[0].at + c[1].at + c[2].at + c[3].at), 0.25 * (c[0].z + c[1].z + c[2].z + c[3].z)};
      if (!std::isfinite(middle.z)) continue;
      for (std::size_t k = 0; k < 4; ++k) out.push_back({c[k], c[(k + 1) % 4], middle});
    }
  return out;
}

// Levels at round numbers between low and high, eight or so.
std::vector<double> levels_between(double low, double high) {
  std::vector<double> out;
  for (const double t : flat_ticks({low, high, true}))
    if (t > low && t < high) out.push_back(t);
  return out;
}

std::optional<SweepPlot> contour_map(const sim::Sweep& sweep, const sim::SweepTable& table, std::size_t response) {
  const sim::Design& design = sweep.design;
  const Grid grid = grid_of(design);
  const std::size_t ax = std::min(grid.numeric[0], grid.numeric[1]), ay = std::max(grid.numeric[0], grid.numeric[1]);
  SweepPlot plot{file_name("map", sweep.names[response]), sweep.names[response], {}};
  FlatDrawing& out = plot.drawing;
  const Frame frame{84.0, 46.0, 680.0, 480.0, tight_axis(design.axes()[ax]), tight_axis(design.axes()[ay])};
  const std::vector<std::array<Corner, 3>> all = triangles(sweep, table, response, ax, ay, frame);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& t : all)
    for (const Corner& c : t) low = std::min(low, c.z), high = std::max(high, c.z);
  if (!(high > low)) return std::nullopt;
  const std::vector<double> levels = levels_between(low, high);
  const auto color = [&](std::size_t band) {
    return render::colormap_color(render::Colormap::viridis,
                                  static_cast<double>(band) / static_cast<double>(std::max<std::size_t>(1, levels.size())));
  };
  // The lowest band under whole cells, a little larger than they are, then each band over the one below: no gaps between triangles show.
  for (std::size_t k = 0; k + 3 < all.size(); k += 4) {
    const dvec2 one = all[k][0].at, other = all[k + 2][0].at;
    const dvec2 upper = glm::min(one, other) - 0.5, size = glm::abs(one - other) + 1.0;
    out.fill_box(upper.x, upper.y, size.x, size.y, color(0));
  }
  for (std::size_t band = 1; band <= levels.size(); ++band)
    for (const auto& t : all)
      if (std::vector<dvec2> part = above(t, levels[band - 1]); part.size() > 2) out.fills.push_back({std::move(part), color(band)});
  for (const double level : levels)
    for (const auto& t : all)
      if (std::vector<dvec2> line = crossing(t, level); line.size() == 2)
        out.strokes.push_back({std::move(line), 1.0, vec3(1.0f), 0.7f, 0.0});
  draw_frame(out, frame, design.axes()[ax].key, design.axes()[ay].key);
  // The bar: bands of equal height, their borders named.
  const double bar = 800.0, step = frame.height / static_cast<double>(levels.size() + 1);
  for (std::size_t band = 0; band <= levels.size(); ++band) {
    const double y = frame.top + frame.height - step * static_cast<double>(band + 1);
    out.fill_box(bar, y, 22.0, step + 0.5, color(band));
    if (band < levels.size()) out.words.push_back({{bar + 28.0, y + 4.0}, flat_tick_text(levels[band]), 12.0, flat_ink, FlatAnchor::left});
  }
  out.words.push_back({{bar + 28.0, frame.top + frame.height}, fmt::format("{:.4g}", low), 12.0, flat_grey, FlatAnchor::left});
  out.words.push_back({{bar + 28.0, frame.top + 8.0}, fmt::format("{:.4g}", high), 12.0, flat_grey, FlatAnchor::left});
  std::string title = sweep.names[response];
  const std::vector<sim::Design::Value> values = design.point(0);
  for (std::size_t k = 0; k < values.size(); ++k)
    if (k != ax && k != ay) title += fmt::format(", {} = {}", design.axes()[k].key, values[k].text);
  out.words.push_back(
      {{frame.left, 28.0}, render::fit_text(title, 17.0, 820.0, render::Weight::bold), 17.0, flat_ink, FlatAnchor::left, true});
  return plot;
}

// ---- Indices of sensitivity as bars.

// Where a bar lies: its axis from left over width, px, and its upper edge.
struct BarPlace {
  const FlatAxis& axis;
  double left, width, y;
};

void bar_with_range(FlatDrawing& out, const BarPlace& place, double value, const std::optional<dvec2>& range, const vec3& color) {
  constexpr double height = 15.0;
  const auto along = [&](double x) { return place.left + place.width * place.axis.at(x); };
  const double zero = along(0.0), end = along(value);
  out.fill_box(std::min(zero, end), place.y, std::max(0.5, std::abs(end - zero)), height, color);
  if (!range) return;
  const double a = along(range->x), b = along(range->y), middle = place.y + 0.5 * height;
  out.strokes.push_back({{{a, middle}, {b, middle}}, 1.2, flat_ink, 1.0f, 0.0});
  for (const double x : {a, b}) out.strokes.push_back({{{x, middle - 4.0}, {x, middle + 4.0}}, 1.2, flat_ink, 1.0f, 0.0});
}

SweepPlot bars(const sim::Sweep& sweep, const sim::Sensitivity& s) {
  const bool sobol = !s.sobol.empty();
  const std::size_t keys = sweep.design.axes().size();
  SweepPlot plot{file_name("sensitivity", s.response), (sobol ? "Sobol's indices of " : "Elementary effects on ") + s.response, {}};
  FlatDrawing& out = plot.drawing;
  double widest = 60.0;
  for (const sim::SweepAxis& axis : sweep.design.axes()) widest = std::max(widest, render::text_width(axis.key, 13.0));
  const double left = std::min(320.0, widest) + 28.0, top = 74.0, row = 46.0, width = 960.0 - left - 40.0;
  out.height = static_cast<int>(top + row * static_cast<double>(keys) + 62.0);
  double low = 0.0, high = 0.0;
  for (std::size_t k = 0; k < keys; ++k) {
    if (sobol)
      low = std::min({low, s.sobol[k].first_low, s.sobol[k].total_low}),
      high = std::max({high, s.sobol[k].first_high, s.sobol[k].total_high});
    else high = std::max({high, s.morris[k].mean_size, s.morris[k].deviation});
  }
  if (!(high > low)) high = low + 1.0;
  const FlatAxis axis = {low - 0.02 * (high - low), high + 0.04 * (high - low), true};
  for (const double t : flat_ticks(axis)) {
    const double at = left + width * axis.at(t), bottom = top + row * static_cast<double>(keys);
    out.fill_box(at - 0.5, top, 1.0, bottom - top, flat_faint);
    out.words.push_back({{at, bottom + 18.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::middle});
  }
  const vec3 first = flat_palette[0], second = flat_palette[5];
  for (std::size_t k = 0; k < keys; ++k) {
    const double y = top + row * static_cast<double>(k) + 6.0;
    const double one = sobol ? s.sobol[k].first : s.morris[k].mean_size, two = sobol ? s.sobol[k].total : s.morris[k].deviation;
    const auto range = [&](double a, double b) { return sobol ? std::optional<dvec2>(dvec2(a, b)) : std::nullopt; };
    bar_with_range(out, {axis, left, width, y}, one, sobol ? range(s.sobol[k].first_low, s.sobol[k].first_high) : std::nullopt, first);
    bar_with_range(out, {axis, left, width, y + 17.0}, two, sobol ? range(s.sobol[k].total_low, s.sobol[k].total_high) : std::nullopt,
                   second);
    out.words.push_back(
        {{left - 8.0, y + 21.0}, render::fit_text(sweep.design.axes()[k].key, 13.0, left - 24.0), 13.0, flat_ink, FlatAnchor::right});
  }
  out.words.push_back(
      {{20.0, 28.0}, render::fit_text(plot.title, 17.0, 900.0, render::Weight::bold), 17.0, flat_ink, FlatAnchor::left, true});
  const char* names[2] = {sobol ? "first: by this key alone" : "mean size of the effect (mu*)",
                          sobol ? "total: with all that it does together with others" : "its deviation (sigma)"};
  for (int k = 0; k < 2; ++k) {
    out.fill_box(left + 330.0 * k, 46.0, 22.0, 12.0, k == 0 ? first : second);
    out.words.push_back({{left + 330.0 * k + 30.0, 56.0}, names[k], 12.0, flat_ink, FlatAnchor::left});
  }
  out.words.push_back({{left, static_cast<double>(out.height) - 14.0},
                       fmt::format("{} {}{}{}", s.used, sobol ? "blocks" : "paths",
                                   s.left_out > 0 ? fmt::format(", {} without a response left out", s.left_out) : "",
                                   sobol ? "; intervals: 95 % of 500 resamplings" : "; over the whole range of each key"),
                       12.0,
                       flat_grey,
                       FlatAnchor::left});
  return plot;
}

}  // namespace

namespace {

// The best that each search had found after so many runs.
SweepPlot progress_of_searches(const sim::Sweep& sweep, const sim::SweepTable& table) {
  const sim::SweepGoal& goal = *sweep.goal;
  Diagram d;
  d.title = fmt::format("{} of {}", goal.maximise ? "largest" : "smallest", sweep.names[goal.response]);
  d.x_label = "runs of the search";
  d.y_label = sweep.names[goal.response];
  d.linear_x = d.linear_y = true;
  if (!goal.limits.empty()) d.note = "of the runs that keep all limits";
  const int shown = std::min<int>(static_cast<int>(most_series), sweep.design.searches());
  if (shown < sweep.design.searches())
    d.note += fmt::format("{}the first {} of {} searches", d.note.empty() ? "" : "; ", shown, sweep.design.searches());
  for (int s = 0; s < shown; ++s) {
    DiagramSeries series;
    series.label = fmt::format("search {}", s + 1);
    double best = std::numeric_limits<double>::quiet_NaN();
    for (int k = 0; k < sweep.design.runs(); ++k) {
      const long point = static_cast<long>(s) * sweep.design.runs() + k;
      if (!table.has(point)) continue;
      const double y = table.responses(point, static_cast<Eigen::Index>(goal.response));
      if (std::isfinite(y) && sim::keeps_limits(sweep, table, point) && !(goal.maximise ? y <= best : y >= best)) best = y;
      if (std::isfinite(best)) series.points.push_back({static_cast<double>(k + 1), best, false, {}});
    }
    d.series.push_back(std::move(series));
  }
  return {"searches", d.title + " over the runs of each search", diagram_drawing(d)};
}

}  // namespace

std::string short_key(const sim::Design& design, std::size_t axis) {
  const std::string& key = design.axes()[axis].key;
  std::size_t dot = key.rfind('.');
  const auto shared = [&](const std::string& end) {
    return std::count_if(design.axes().begin(), design.axes().end(),
                         [&](const sim::SweepAxis& other) { return other.key == end || other.key.ends_with("." + end); }) > 1;
  };
  while (dot != std::string::npos && dot > 0 && shared(key.substr(dot + 1))) dot = key.rfind('.', dot - 1);
  return dot == std::string::npos ? key : key.substr(dot + 1);
}

std::vector<SweepColumn> sweep_columns(const sim::Sweep& sweep, const sim::SweepTable& table) {
  std::vector<SweepColumn> out;
  std::vector<std::size_t> axes;
  for (std::size_t k = 0; k < sweep.design.axes().size(); ++k) {
    const sim::SweepAxis& axis = sweep.design.axes()[k];
    if (!axis.chance && axis.numbers.empty()) continue;
    axes.push_back(k);
    out.push_back({short_key(sweep.design, k), sim::VecX(sweep.design.size()), axis.logarithmic});
  }
  for (long i = 0; i < sweep.design.size(); ++i) {
    if (!sweep.design.has(i)) {
      for (SweepColumn& column : out) column.values[i] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    const std::vector<sim::Design::Value> values = sweep.design.point(i);
    for (std::size_t k = 0; k < axes.size(); ++k) out[k].values[i] = values[axes[k]].number;
  }
  for (std::size_t k = 0; k < sweep.names.size(); ++k)
    out.push_back({sweep.names[k], table.responses.col(static_cast<Eigen::Index>(k)), false});
  return out;
}

std::vector<SweepPlot> sweep_plots(const sim::Sweep& sweep, const sim::SweepTable& table, const std::vector<sim::Sensitivity>& indices) {
  std::vector<SweepPlot> out;
  const Grid grid = grid_of(sweep.design);
  const auto values = [&](std::size_t k) { return sweep.design.axes()[grid.numeric[k]].values.size(); };
  if (sweep.design.sampling() == sim::Sampling::none && !grid.numeric.empty())
    for (std::size_t k = 0; k < sweep.names.size(); ++k) {
      if (std::optional<SweepPlot> plot = curves(sweep, table, k)) out.push_back(std::move(*plot));
      if (grid.numeric.size() < 2 || values(0) < 3 || values(1) < 3) continue;
      if (std::optional<SweepPlot> plot = contour_map(sweep, table, k)) out.push_back(std::move(*plot));
    }
  if (sweep.goal && table.rows() > 0) out.push_back(progress_of_searches(sweep, table));
  for (const sim::Sensitivity& s : indices)
    if (!s.sobol.empty() || !s.morris.empty()) out.push_back(bars(sweep, s));
  for (SweepPlot& plot : sweep_scatter_plots(sweep, table)) out.push_back(std::move(plot));
  // Two responses may come to one name of a file.
  for (std::size_t k = 0; k < out.size(); ++k)
    for (std::size_t j = 0; j < k; ++j)
      if (out[j].name == out[k].name) out[k].name += fmt::format("_{}", k);
  return out;
}

}  // namespace flexframe::film
