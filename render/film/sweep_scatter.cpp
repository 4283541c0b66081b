// What values drawn by chance show: histograms with quantiles, all columns against each other.
#include "render/film/sweep_plots.h"
#include "render/image/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace flexframe::film {
namespace {

using glm::dvec2;
using glm::vec3;

constexpr std::size_t most_columns = 9, most_dots = 1500;

std::vector<double> finite_values(const sim::VecX& column) {
  std::vector<double> out;
  for (const double x : column)
    if (std::isfinite(x)) out.push_back(x);
  return out;
}

// By linear interpolation between the sorted values (Hyndman, Fan 1996, type 7).
double quantile_of(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const double rest = at - static_cast<double>(below);
  return below + 1 < sorted.size() ? sorted[below] + rest * (sorted[below + 1] - sorted[below]) : sorted.back();
}

struct Bins {
  double low = 0.0, width = 1.0;
  std::vector<long> counts;
  long most = 1;
};
// Width by Freedman and Diaconis (1981), 5 to 60 of them.
Bins bins_of(const std::vector<double>& sorted, bool logarithmic) {
  Bins out;
  const auto place = [&](double x) { return logarithmic ? std::log10(x) : x; };
  const double low = place(sorted.front()), high = place(sorted.back());
  const double spread = place(quantile_of(sorted, 0.75)) - place(quantile_of(sorted, 0.25));
  const double wanted = 2.0 * spread / std::cbrt(static_cast<double>(sorted.size()));
  const double count = wanted > 0.0 ? std::clamp(std::ceil((high - low) / wanted), 5.0, 60.0) : 5.0;
  out.low = low;
  out.width = high > low ? (high - low) / count : 1.0;
  out.counts.assign(static_cast<std::size_t>(count), 0);
  for (const double x : sorted) {
    const auto bin = static_cast<std::size_t>(std::clamp((place(x) - low) / out.width, 0.0, count - 1.0));
    out.most = std::max(out.most, ++out.counts[bin]);
  }
  return out;
}

// Average ranks.
std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> out(values.size());
  for (std::size_t k = 0; k < order.size();) {
    std::size_t end = k;
    while (end < order.size() && values[order[end]] == values[order[k]]) ++end;
    for (std::size_t i = k; i < end; ++i) out[order[i]] = 0.5 * static_cast<double>(k + end - 1);
    k = end;
  }
  return out;
}

// Spearman's correlation of the ranks.
double rank_correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const std::vector<double> a = ranks_of(x), b = ranks_of(y);
  const double mean = 0.5 * static_cast<double>(a.size() - 1);
  double xy = 0.0, xx = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    xy += (a[k] - mean) * (b[k] - mean);
    xx += (a[k] - mean) * (a[k] - mean);
    yy += (b[k] - mean) * (b[k] - mean);
  }
  return xx > 0.0 && yy > 0.0 ? xy / std::sqrt(xx * yy) : 0.0;
}

SweepPlot histogram(const std::string& name, const std::string& file, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  SweepPlot plot{file, name, {}};
  FlatDrawing& out = plot.drawing;
  const double left = 64.0, top = 66.0, width = 856.0, height = 440.0, bottom = top + height;
  const Bins bins = bins_of(values, false);
  const FlatAxis x = flat_axis(values.front(), values.back(), true);
  const FlatAxis y{0.0, 1.06 * static_cast<double>(bins.most), true};
  const auto across = [&](double value) { return left + width * x.at(value); };
  for (const double t : flat_ticks(y)) {
    const double at = bottom - height * y.at(t);
    out.fill_box(left, at - 0.5, width, 1.0, flat_faint);
    out.words.push_back({{left - 8.0, at + 4.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::right});
  }
  for (const double t : flat_ticks(x))
    out.words.push_back({{across(t), bottom + 18.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::middle});
  for (std::size_t k = 0; k < bins.counts.size(); ++k) {
    const double a = across(bins.low + bins.width * static_cast<double>(k)), b = across(bins.low + bins.width * static_cast<double>(k + 1));
    const double tall = height * static_cast<double>(bins.counts[k]) / y.high;
    if (tall > 0.0) out.fill_box(a + 0.5, bottom - tall, std::max(0.5, b - a - 1.0), tall, {0.45f, 0.66f, 0.83f});
  }
  double last = -1e9;
  for (const double share : {0.05, 0.25, 0.5, 0.75, 0.95}) {
    const double value = quantile_of(values, share), at = across(value);
    out.strokes.push_back({{{at, top - 4.0}, {at, bottom}}, share == 0.5 ? 1.8 : 1.2, flat_palette[1], 1.0f, share == 0.5 ? 0.0 : 5.0});
    // Two rows, where quantiles stand close together.
    const bool close = at - last < 92.0;
    out.words.push_back({{at, close ? top - 22.0 : top - 8.0},
                         fmt::format("{:g} %: {:.4g}", 100.0 * share, value),
                         11.0,
                         flat_palette[1],
                         FlatAnchor::middle});
    if (!close) last = at;
  }
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  double square = 0.0;
  for (const double v : values) square += (v - mean) * (v - mean);
  const double deviation = values.size() > 1 ? std::sqrt(square / static_cast<double>(values.size() - 1)) : 0.0;
  out.strokes.push_back({{{left, bottom}, {left + width, bottom}}, 1.2, flat_ink, 1.0f, 0.0});
  out.words.push_back({{left, 24.0}, render::fit_text(name, 17.0, 850.0, render::Weight::bold), 17.0, flat_ink, FlatAnchor::left, true});
  out.words.push_back({{left, bottom + 46.0},
                       fmt::format("{} points: {:.6g} to {:.6g}, mean {:.6g}, standard deviation {:.3g}", values.size(), values.front(),
                                   values.back(), mean, deviation),
                       12.0,
                       flat_grey,
                       FlatAnchor::left});
  out.height = 570;
  return plot;
}

struct OnAxis {
  const SweepColumn& column;
  const FlatAxis& axis;
};

// Dots that show where many lie: opacity falls with their number.
void scatter(FlatDrawing& out, const dvec2& corner, double size, const OnAxis& along_x, const OnAxis& along_y) {
  const auto& [x, ax] = along_x;
  const auto& [y, ay] = along_y;
  // Of many points some, by a step that shares no pattern with the blocks of a design.
  const long n = x.values.size(), shown = std::min(n, static_cast<long>(most_dots));
  for (long k = 0; k < shown; ++k) {
    const long i = shown == n ? k : static_cast<long>(static_cast<unsigned long>(k) * 2654435761ul % static_cast<unsigned long>(n));
    if (!std::isfinite(x.values[i]) || !std::isfinite(y.values[i])) continue;
    const dvec2 at(corner.x + size * ax.at(x.values[i]), corner.y + size * (1.0 - ay.at(y.values[i])));
    out.discs.push_back({at, n > 400 ? 0.8 : 1.6, flat_palette[0], false});
  }
}

// searched: the places are a search's, whose correlations say nothing of the scene.
// Words in the middle of a box of that width, in smaller letters where they do not fit, cut off only where these would be too small.
FlatWord middle_words(const dvec2& at, const std::string& text, double size, double width, const vec3& ink, bool bold) {
  constexpr double smallest = 7.0;
  const render::Weight weight = bold ? render::Weight::bold : render::Weight::regular;
  while (size > smallest && render::text_width(text, size, weight) > width) size -= 0.25;
  return {at, render::fit_text(text, size, width, weight), size, ink, FlatAnchor::middle, bold};
}

SweepPlot matrix(const std::vector<SweepColumn>& columns, std::size_t left_out, bool searched) {
  SweepPlot plot{"matrix", "All against each other", {}};
  FlatDrawing& out = plot.drawing;
  const std::size_t n = columns.size();
  const double size = std::clamp(900.0 / static_cast<double>(n), 110.0, 220.0), gap = 10.0, left = 30.0, top = 44.0;
  constexpr double title = 600.0;  // its width
  out.width = static_cast<int>(left + std::max((size + gap) * static_cast<double>(n), title) + 20.0);
  out.height = static_cast<int>(top + (size + gap) * static_cast<double>(n) + 34.0);
  std::vector<FlatAxis> axes;
  std::vector<std::vector<double>> sorted;
  for (const SweepColumn& c : columns) {
    sorted.push_back(finite_values(c.values));
    std::sort(sorted.back().begin(), sorted.back().end());
    axes.push_back(flat_axis(sorted.back().front(), sorted.back().back(), !c.logarithmic));
  }
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t col = 0; col < n; ++col) {
      const dvec2 corner(left + (size + gap) * static_cast<double>(col), top + (size + gap) * static_cast<double>(row));
      out.strokes.push_back(
          {{corner, corner + dvec2(size, 0.0), corner + dvec2(size, size), corner + dvec2(0.0, size), corner}, 1.0, flat_grey, 1.0f, 0.0});
      if (row > col) scatter(out, corner, size, {columns[col], axes[col]}, {columns[row], axes[row]});
      if (row == col) {
        const Bins bins = bins_of(sorted[row], columns[row].logarithmic);
        for (std::size_t k = 0; k < bins.counts.size(); ++k) {
          const double span = axes[row].high - axes[row].low;
          const double a = (bins.low + bins.width * static_cast<double>(k) - axes[row].low) / span * size, wide = bins.width / span * size;
          const double tall = (size - 42.0) * static_cast<double>(bins.counts[k]) / static_cast<double>(bins.most);
          if (tall > 0.0) out.fill_box(corner.x + a, corner.y + size - tall, std::max(0.5, wide - 0.5), tall, {0.45f, 0.66f, 0.83f});
        }
        const std::string range = fmt::format("{:.4g} to {:.4g}", sorted[row].front(), sorted[row].back());
        out.words.push_back(middle_words(corner + dvec2(0.5 * size, 17.0), columns[row].name, 12.0, size - 6.0, flat_ink, true));
        out.words.push_back(middle_words(corner + dvec2(0.5 * size, 32.0), range, 10.0, size - 6.0, flat_grey, false));
      }
      if (row < col && !searched) {
        std::vector<double> x, y;
        for (long i = 0; i < columns[row].values.size(); ++i)
          if (std::isfinite(columns[row].values[i]) && std::isfinite(columns[col].values[i]))
            x.push_back(columns[col].values[i]), y.push_back(columns[row].values[i]);
        const double r = x.size() > 2 ? std::round(100.0 * rank_correlation(x, y)) / 100.0 + 0.0 : 0.0;
        // The stronger, the larger and the darker.
        const auto strength = static_cast<float>(std::abs(r));
        out.words.push_back({corner + dvec2(0.5 * size, 0.5 * size + 6.0), fmt::format("{:+.2f}", r), 13.0 + 13.0 * strength,
                             glm::mix(flat_grey, flat_ink, strength), FlatAnchor::middle, strength > 0.5f});
      }
    }
  out.words.push_back(
      {{left, 26.0},
       searched ? "Where the searches went: keys and responses" : "Keys and responses: values, distributions, correlation of ranks",
       16.0,
       flat_ink,
       FlatAnchor::left,
       true});
  if (left_out > 0)
    out.words.push_back({{left, static_cast<double>(out.height) - 10.0},
                         fmt::format("{} more columns: table.csv", left_out),
                         12.0,
                         flat_grey,
                         FlatAnchor::left});
  return plot;
}

}  // namespace

std::vector<SweepPlot> sweep_scatter_plots(const sim::Sweep& sweep, const sim::SweepTable& table) {
  std::vector<SweepPlot> out;
  const sim::Sampling sampling = sweep.design.sampling();
  if (sampling == sim::Sampling::none || sampling == sim::Sampling::morris) return out;
  std::vector<SweepColumn> columns = sweep_columns(sweep, table);
  std::erase_if(columns, [](const SweepColumn& c) {
    const std::vector<double> values = finite_values(c.values);
    return values.size() < 3 || *std::min_element(values.begin(), values.end()) == *std::max_element(values.begin(), values.end());
  });
  for (const SweepColumn& c : columns)
    // How often a search came to a value says nothing of the scene.
    if (const auto name = std::find(sweep.names.begin(), sweep.names.end(), c.name); name != sweep.names.end() && !sweep.goal)
      out.push_back(histogram(c.name, fmt::format("histogram_{}", name - sweep.names.begin() + 1), finite_values(c.values)));
  if (columns.size() < 2) return out;
  // Of many columns the responses and as many keys as there is room for.
  const std::size_t all = columns.size();
  while (columns.size() > most_columns) {
    const bool many_responses = std::find(sweep.names.begin(), sweep.names.end(), columns[1].name) != sweep.names.end();
    columns.erase(many_responses ? columns.end() - 1
                                 : columns.end() - 1 - static_cast<std::ptrdiff_t>(std::min(sweep.names.size(), columns.size() - 1)));
  }
  out.insert(out.begin(), matrix(columns, all - columns.size(), sweep.goal.has_value()));
  return out;
}

}  // namespace flexframe::film
