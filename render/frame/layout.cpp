#include "render/frame/layout.h"

#include "render/frame/backdrop.h"
#include "render/image/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::render {
namespace {

std::string number(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text[0] == '-') text.erase(0, 1);
  if (text[0] == '-') text.replace(0, 1, "−");
  return text;
}

std::string power_text(int exponent) {
  static constexpr const char* digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = "10";
  if (exponent < 0) text += "⁻";
  for (const char c : std::to_string(std::abs(exponent))) text += digits[c - '0'];
  return text;
}

// "tip.y [mm]" or "tip.y" with the power of ten that the numbers leave out: "tip.y [10⁻⁶ mm]". In no more than `room`: the name is
// shortened, then left out, the unit is not.
std::string axis_text(const std::string& label, int exponent, double size, double room) {
  std::string name = label, unit;
  if (const std::size_t open = label.rfind('['); open != std::string::npos && label.back() == ']') {
    unit = label.substr(open + 1, label.size() - open - 2);
    name = label.substr(0, open);
    while (!name.empty() && name.back() == ' ') name.pop_back();
  }
  if (exponent) unit = power_text(exponent) + (unit.empty() ? "" : " " + unit);
  if (unit.empty()) return fit_text(name, size, room);
  unit = "[" + unit + "]";
  if (name.empty()) return fit_text(unit, size, room);
  std::string whole = name + " " + unit;
  if (text_width(whole, size) <= room) return whole;
  const std::string cut = fit_text(name, size, room - text_width(" " + unit, size));
  // Three letters say nothing.
  return text_width(cut, size) < 3.5 * size && cut != name ? fit_text(unit, size, room) : cut + " " + unit;
}

// The unit alone of an axis' words, with the power of ten: "[10⁻⁶ s]".
std::string axis_unit(const std::string& label, int exponent, double size, double room) {
  const std::size_t open = label.ends_with(']') ? label.rfind('[') : std::string::npos;
  return axis_text(open == std::string::npos ? "" : label.substr(open), exponent, size, room);
}

// A name in no more than `room`; what follows its last dot stays, so that tip.x and tip.y are not cut to the same letters.
std::string fit_name(const std::string& name, double size, double room) {
  const std::size_t dot = name.rfind('.');
  if (text_width(name, size) <= room || dot == std::string::npos) return fit_text(name, size, room);
  const std::string last = name.substr(dot);
  const double left = room - text_width(last, size);
  return left > 2.5 * size ? fit_text(name.substr(0, dot), size, left) + last : fit_text(name, size, room);
}

std::string bar_text(const ScalarBar& bar, int exponent, double size, double room) {
  const std::string unit = bar.unit.empty() ? "" : "[" + bar.unit + "]";
  return axis_text(bar.label.empty() ? unit : unit.empty() ? bar.label : bar.label + " " + unit, exponent, size, room);
}

// Numbers beside a scalar bar: its ends, then round ones in between; of logarithmic colours powers of ten and twice and five times those.
Ticks bar_ticks(const ScalarMap& map, double factor, int most) {
  const double lower = std::min(map.lower, map.upper) * factor, upper = std::max(map.lower, map.upper) * factor;
  Ticks ticks = make_ticks(lower, upper, most);
  const double scale = std::pow(10.0, -ticks.exponent);
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(ticks.step) - 1e-9)), 0, 12);
  const bool decades = map.logarithmic && lower > 0.0;
  const auto text = [&](double value) {
    if (decades && (value < 999.5 || value >= 1e6)) return fmt::format("{:.3g}", value);
    if (decades) return fmt::format("{:.0f}", value);
    // One decimal more than the others, where it says something.
    const std::string fine = number(value, decimals + 1);
    return fine.back() == '0' ? number(value, decimals) : fine;
  };
  std::vector<Tick> between = std::move(ticks.values);
  if (decades) {
    between.clear();
    const auto first = static_cast<int>(std::floor(std::log10(lower * scale))),
               last = static_cast<int>(std::floor(std::log10(upper * scale)));
    for (const double lead : {1.0, 2.0, 5.0})
      for (int k = first; k <= last; ++k) between.push_back({lead * std::pow(10.0, k), text(lead * std::pow(10.0, k))});
  }
  ticks.values.clear();
  for (const double end : {upper * scale, lower * scale}) {
    // An end that is round is written as its neighbours are.
    const auto round = std::find_if(between.begin(), between.end(),
                                    [&](const Tick& t) { return std::abs(t.value - end) < 1e-9 * std::abs(upper * scale); });
    ticks.values.push_back(round != between.end() ? *round : Tick{end, text(end)});
  }
  if (map.above) ticks.values[0].text = "≥ " + ticks.values[0].text;
  if (map.below) ticks.values[1].text = "≤ " + ticks.values[1].text;
  ticks.values.insert(ticks.values.end(), between.begin(), between.end());
  return ticks;
}

double centre_baseline(double y, double size) { return y + 0.5 * cap_height(size); }

struct Builder {
  const Picture& picture;
  Layout out;
  double pad = 14.0, small = 12.0;

  explicit Builder(const Picture& p) : picture(p) {
    const double scale = std::clamp(static_cast<double>(p.overlay.text_scale), 0.3, 4.0);
    out.unit = std::min(p.size.height / 720.0, p.size.width / 960.0);
    // Nine pixels is the least that can be read.
    out.text = std::max(9.0, 14.0 * out.unit * scale);
    small = std::max(9.0, 12.5 * out.unit * scale);
    pad = std::max(5.0, 16.0 * out.unit);
  }

  void split_area() {
    const Overlay& o = picture.overlay;
    out.scene = {0, 0, picture.size.width, picture.size.height};
    if (o.plots.empty()) return;
    const double share = std::clamp(o.plot_share, 0.1, 0.7);
    const int n = static_cast<int>(o.plots.size());
    if (o.plot_place == PlotPlace::below) {
      const int h = std::max(1, static_cast<int>(std::lround(picture.size.height * share)));
      out.scene.height -= h;
      for (int i = 0; i < n; ++i) {
        const int x0 = picture.size.width * i / n, x1 = picture.size.width * (i + 1) / n;
        place_plot(i, {x0, out.scene.height, x1 - x0, h});
      }
    } else {
      const int w = std::max(1, static_cast<int>(std::lround(picture.size.width * share)));
      out.scene.width -= w;
      for (int i = 0; i < n; ++i) {
        const int y0 = picture.size.height * i / n, y1 = picture.size.height * (i + 1) / n;
        place_plot(i, {out.scene.width, y0, w, y1 - y0});
      }
    }
  }

  double line_height() const { return 1.45 * small; }

  // Ranges of the data, a little room above and below.
  static void set_ranges(const Plot& plot, PlotLayout& p) {
    double lower[2] = {1e300, 1e300}, upper[2] = {-1e300, -1e300};
    for (const Series& s : plot.series)
      for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i)
        if (std::isfinite(s.x[i]) && std::isfinite(s.y[i])) {
          lower[0] = std::min(lower[0], s.x[i]);
          upper[0] = std::max(upper[0], s.x[i]);
          lower[1] = std::min(lower[1], s.y[i]);
          upper[1] = std::max(upper[1], s.y[i]);
        }
    for (int k = 0; k < 2; ++k) {
      if (lower[k] > upper[k]) lower[k] = 0.0, upper[k] = 1.0;
      if (k == 1) {
        const double room = 0.06 * (upper[1] - lower[1]);
        lower[1] -= room;
        upper[1] += room;
      }
      // A constant still needs a range that doubles can tell apart.
      if (!(upper[k] - lower[k] > 1e-12 * std::max(std::abs(lower[k]), std::abs(upper[k])))) {
        const double room = lower[k] == 0.0 ? 1.0 : 0.1 * std::abs(lower[k]);
        lower[k] -= room;
        upper[k] += room;
      }
    }
    if (plot.x_range) lower[0] = plot.x_range->x, upper[0] = plot.x_range->y;
    if (plot.y_range) lower[1] = plot.y_range->x, upper[1] = plot.y_range->y;
    p.x0 = lower[0], p.x1 = upper[0], p.y0 = lower[1], p.y1 = upper[1];
  }

  // crowded: words stand over the numbers, too. silent: lines alone.
  void place_y_ticks(const Ticks& y_ticks, bool crowded, bool silent, PlotLayout& p) {
    const double sy = p.axes.height / (p.y1 - p.y0);
    double last_y = 1e300;
    for (const Tick& t : y_ticks.values) {
      const double y = p.axes.y + p.axes.height - (t.value * std::pow(10.0, y_ticks.exponent) - p.y0) * sy;
      p.y_ticks.push_back(y);
      if (silent || last_y - y < 1.2 * small) continue;  // a line without its number rather than two numbers over each other
      last_y = y;
      // Not below the axis, where the other axis' numbers begin.
      double baseline = std::min(centre_baseline(y, small), static_cast<double>(p.axes.y + p.axes.height));
      if (crowded) baseline = std::max(baseline, p.axes.y + cap_height(small));
      p.words.push_back({t.text, p.axes.x - 0.5 * small - text_width(t.text, small), baseline, small, false, true});
    }
  }

  // roomy: there is a line for the axis' words.
  void place_x_ticks(const Plot& plot, bool roomy, PlotLayout& p) {
    const PixelRect& panel = p.panel;
    const double sx = p.axes.width / (p.x1 - p.x0);
    Ticks x_ticks;
    // As many ticks as leave a gap of two letters between the numbers.
    for (int most = 12; most >= 2; --most) {
      x_ticks = make_ticks(p.x0, p.x1, most);
      double total = 0.0;
      for (const Tick& t : x_ticks.values) total += text_width(t.text, small) + 1.5 * small;
      if (total <= p.axes.width || most == 2) break;
    }
    const double baseline = p.axes.y + p.axes.height + 0.45 * small + cap_height(small);
    const bool worded = roomy && !plot.x_label.empty();
    double end = panel.x + panel.width - 0.25 * pad;
    // Where the axis' words have no line of their own, a power of ten still stands behind the numbers; without room for it there are none.
    if (!worded && x_ticks.exponent && baseline <= panel.y + panel.height) {
      const std::string unit = axis_unit(plot.x_label, x_ticks.exponent, small, 1e300);
      const double w = text_width(unit, small);
      if (w <= p.axes.width) p.words.push_back({unit, end - w, baseline, small, false, false});
      end = w <= p.axes.width ? end - w - 0.5 * small : -1e300;
    }
    double last_x = -1e300;
    for (const Tick& t : x_ticks.values) {
      const double x = p.axes.x + (t.value * std::pow(10.0, x_ticks.exponent) - p.x0) * sx, w = text_width(t.text, small);
      p.x_ticks.push_back(x);
      const double at = std::min(x - 0.5 * w, panel.x + panel.width - w - 0.25 * pad);
      if (at < last_x + 0.5 * small || baseline > panel.y + panel.height || at + w > end + 1e-9) continue;
      last_x = at + w;
      p.words.push_back({t.text, at, baseline, small, false, true});
    }
    if (worded) {
      const std::string text = axis_text(plot.x_label, x_ticks.exponent, small, p.axes.width);
      p.words.push_back({text, p.axes.x + 0.5 * (p.axes.width - text_width(text, small)),
                         panel.y + panel.height - 0.4 * pad - descent(small) * 0.4, small, false, false});
    }
  }

  // Names of the series above the axes: what does not fit is shortened, the longest first, then left out. unit: stands there too where the
  // axis has no room for its words, behind the name of a single series, before those of several.
  void place_names(const Plot& plot, const std::string& unit, PlotLayout& p) {
    double x = p.axes.x, right = p.axes.x + p.axes.width;
    double sample = 1.6 * small, gap = 1.6 * small;
    const double y = p.axes.y - 0.45 * line_height();
    const std::size_t count = plot.series.size();
    const bool alone = count == 1 && !plot.series[0].label.empty();
    if (!unit.empty() && !(alone && text_width(plot.series[0].label + " " + unit, small) <= right - x - sample - 0.5 * small)) {
      x = p.panel.x + 0.5 * pad;
      right = p.panel.x + p.panel.width - 0.25 * pad;
    }
    if (!unit.empty() && !alone) {
      p.words.push_back({unit, x, centre_baseline(y, small), small, false, false});
      x += text_width(unit, small) + small;
    }
    std::vector<double> widths;
    double all = 0.0;
    for (const Series& s : plot.series) {
      widths.push_back(text_width(s.label, small));
      all += sample + gap + widths.back();
    }
    // Closer together before any is cut.
    if (all - gap + 0.5 * small > right - x) {
      sample = 0.7 * small;
      gap = 0.9 * small;
      right = p.panel.x + p.panel.width - 0.25 * pad;
    }
    const double most = share_of(
        widths, right - x - static_cast<double>(count) * (sample + 0.5 * small) - (static_cast<double>(count) - 1.0) * (gap - 0.5 * small));
    for (std::size_t i = 0; i < count; ++i) {
      const double free = right - x - sample - 0.5 * small;
      if (free < std::min(3.0 * small, widths[i])) break;
      const double room = std::min(free, std::max(most, 3.0 * small));
      std::string text = fit_name(plot.series[i].label, small, room);
      if (!unit.empty() && alone) {
        const double left = free - text_width(" " + unit, small);
        text = left >= 2.5 * small ? fit_name(plot.series[i].label, small, left) + " " + unit : unit;
      }
      p.series_lines[i] = {static_cast<int>(x), static_cast<int>(std::lround(y)), static_cast<int>(sample), 1};
      p.series[i] = {text, x + sample + 0.4 * small, centre_baseline(y, small), small, false, false};
      x += sample + gap + text_width(text, small);
    }
  }

  // What a unit among the names may be wide.
  double unit_room(const Plot& plot, const PixelRect& panel) const {
    return panel.width - 0.75 * pad - (plot.series.size() == 1 && !plot.series[0].label.empty() ? 2.1 * small : 0.0);
  }

  // The largest width that all may have so that their sum is no more than `room`.
  static double share_of(std::vector<double> widths, double room) {
    std::sort(widths.begin(), widths.end());
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const double each = room / static_cast<double>(widths.size() - i);
      if (widths[i] > each) return each;
      room -= widths[i];
    }
    return 1e300;
  }

  void place_plot(int index, const PixelRect& panel) {
    const Plot& plot = picture.overlay.plots[index];
    PlotLayout p;
    p.panel = panel;
    p.plot = index;
    set_ranges(plot, p);
    const double line = line_height();
    const bool roomy = panel.height > 6.5 * line && panel.width > 18.0 * small, beside = panel.width > 14.0 * small;
    const bool unplaced = !beside && (!plot.y_label.empty() || make_ticks(p.y0, p.y1, 2).exponent != 0);
    const bool named = unplaced || std::any_of(plot.series.begin(), plot.series.end(), [](const Series& s) { return !s.label.empty(); });
    const double top = panel.y + 0.5 * pad + (named ? line : 0.3 * line);
    const double bottom = panel.y + panel.height - 0.4 * pad - line - (roomy && !plot.x_label.empty() ? line : 0.0);
    const Ticks y_ticks = make_ticks(p.y0, p.y1, std::max(2, static_cast<int>((bottom - top) / (1.9 * small))));
    double widest = 0.0;
    for (const Tick& t : y_ticks.values) widest = std::max(widest, text_width(t.text, small));
    const std::string y_label = axis_text(plot.y_label, y_ticks.exponent, small, panel.height - 2.0 * pad);
    const bool y_named = !y_label.empty() && beside;
    const double left = panel.x + 0.7 * pad + widest + 0.5 * small + (y_named ? 1.4 * small : 0.0);
    const double right = panel.x + panel.width - pad;
    p.axes = {static_cast<int>(std::lround(left)), static_cast<int>(std::lround(top)),
              std::max(1, static_cast<int>(std::lround(right - left))), std::max(1, static_cast<int>(std::lround(bottom - top)))};

    // A power of ten that has no place at all takes the numbers along.
    const std::string y_unit = axis_unit(plot.y_label, y_ticks.exponent, small, 1e300);
    const bool silent = unplaced && y_ticks.exponent && text_width(y_unit, small) > unit_room(plot, panel);
    place_y_ticks(y_ticks, unplaced, silent, p);
    place_x_ticks(plot, roomy, p);
    if (y_named) {
      const std::string& text = y_label;
      // Beside the middle of the axis, but never out of the panel.
      const double long_side = text_width(text, small), middle = p.axes.y + 0.5 * p.axes.height + 0.5 * long_side;
      const double y = std::clamp(middle, panel.y + 0.3 * pad + long_side,
                                  std::max(panel.y + 0.3 * pad + long_side, panel.y + panel.height - 0.3 * pad));
      p.y_label = {text, panel.x + 0.35 * pad + cap_height(small) + 1.0, y, small, false, false};
    }
    p.series.resize(plot.series.size());
    p.series_lines.resize(plot.series.size());
    if (named) place_names(plot, y_named || text_width(y_unit, small) > unit_room(plot, panel) ? "" : y_unit, p);
    out.plots.push_back(std::move(p));
  }

  // Title, note, time: returns the height they take.
  double place_words() {
    const Overlay& o = picture.overlay;
    const double scale = std::clamp(static_cast<double>(o.text_scale), 0.3, 4.0);
    const double title_size = std::max(11.0, 21.0 * out.unit * scale), time_size = std::max(10.0, 17.0 * out.unit * scale);
    const double width = out.scene.width - 2.0 * pad;
    double used = 0.0;
    if (o.title.empty() && o.time.empty() && o.note.empty()) return used;
    double baseline = pad + cap_height(title_size);
    double free = width;
    if (!o.time.empty()) {
      // Digits that are cut off would make it another time.
      const double w = text_width(o.time, time_size);
      if (w <= width) {
        out.words.push_back({o.time, out.scene.width - pad - w, baseline, time_size, false, false});
        free -= w + 1.2 * time_size;
        used = baseline + descent(time_size);
      }
    }
    if (!o.title.empty()) {
      const std::string title = fit_text(o.title, title_size, free, Weight::bold);
      if (!title.empty()) out.words.push_back({title, pad, baseline, title_size, true, false});
      used = baseline + descent(title_size);
    }
    if (!o.note.empty()) {
      // Next to the time if there is no title, else below.
      const bool own_row = !o.title.empty();
      if (own_row) baseline += 0.55 * title_size + cap_height(out.text);
      const double room = own_row ? width : free;
      const bool whole = o.short_note.empty() || text_width(o.note, out.text) <= room;
      const std::string note = fit_text(whole ? o.note : o.short_note, out.text, room);
      if (!note.empty()) out.words.push_back({note, pad, baseline, out.text, false, true});
      used = baseline + descent(out.text);
    }
    return used + 0.4 * pad;
  }

  void place_bar(double top, double bottom) {
    const ScalarBar& bar = *picture.overlay.scalar_bar;
    const double wide = std::max(9.0, 17.0 * out.unit), gap = 0.45 * small;
    const double free = bottom - top - 2.0 * small;
    const double height = std::min({free, 0.62 * out.scene.height, 380.0 * out.unit});
    if (height < 3.0 * small) return;
    const Ticks ticks = bar_ticks(picture.scalar_map, bar.factor, std::max(2, static_cast<int>(height / (2.1 * small))));
    const std::string label = bar_text(bar, ticks.exponent, small, (picture.views.empty() ? 0.45 : 0.25) * out.scene.width);
    double widest = 0.0;
    for (const Tick& t : ticks.values) widest = std::max(widest, text_width(t.text, small));
    BarLayout& b = out.bar;
    const double right = out.scene.width - pad;
    const double x = right - widest - gap - wide;
    const double y = top + std::max(1.6 * small, 0.5 * (bottom - top - height) + 0.8 * small);
    b.bar = {static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)), static_cast<int>(std::lround(wide)),
             static_cast<int>(std::lround(std::min(height, bottom - y - 0.5 * small)))};
    const double label_width = text_width(label, small);
    b.words.push_back({label, right - label_width, b.bar.y - 0.75 * small, small, false, false});
    // The ends come first in the list: what would touch them or the number below is left out.
    const double scale = std::pow(10.0, ticks.exponent);
    std::vector<double> taken;
    for (const Tick& t : ticks.values) {
      const double share = scalar_share(picture.scalar_map, t.value * scale / bar.factor);
      if (!(share > -1e-9 && share < 1.0 + 1e-9)) continue;
      const double ty = b.bar.y + b.bar.height * (1.0 - share);
      if (std::any_of(taken.begin(), taken.end(), [&](double other) { return std::abs(other - ty) < 1.5 * small; })) continue;
      taken.push_back(ty);
      b.ticks.push_back(ty);
      b.words.push_back({t.text, x + wide + gap, centre_baseline(ty, small), small, false, false});
    }
    const double left = std::min(x, right - label_width);
    b.panel = {static_cast<int>(left - 0.5 * pad), static_cast<int>(b.bar.y - 2.0 * small), static_cast<int>(right - left + pad),
               static_cast<int>(b.bar.height + 3.0 * small)};
    out.has_bar = true;
    out.insets.right = (out.scene.width - x + 0.8 * pad) / out.scene.width;
  }

  // Rows of entries along the lower edge, from x on; returns the height used.
  double place_legend(double from, double to) {
    const double swatch = 1.1 * out.text, line = 1.6 * out.text;
    LegendLayout legend;
    double x = from;
    int rows = 1;
    for (const LegendEntry& e : picture.overlay.legend) {
      const double free = to - from - 1.5 * swatch;
      const std::string text = fit_text(e.text, out.text, free);
      const double w = 1.5 * swatch + text_width(text, out.text);
      if (x > from && x + w > to) {
        x = from;
        ++rows;
      }
      legend.swatches.push_back(
          {static_cast<int>(std::lround(x)), rows, static_cast<int>(std::lround(swatch)), static_cast<int>(std::lround(swatch))});
      legend.words.push_back({text, x + 1.5 * swatch, 0.0, out.text, false, false});
      x += w + 1.4 * out.text;
    }
    // More than a fifth of the picture is no legend any more.
    if (rows * line > 0.2 * out.scene.height || to - from < 6.0 * out.text) return 0.0;
    for (std::size_t i = 0; i < legend.words.size(); ++i) {
      const double y = out.scene.height - 0.8 * pad - (rows - legend.swatches[i].y + 0.5) * line;
      legend.swatches[i].y = static_cast<int>(std::lround(y - 0.5 * swatch));
      legend.words[i].y = centre_baseline(y, out.text);
    }
    out.legend = std::move(legend);
    out.has_legend = true;
    return rows * line + 0.8 * pad;
  }

  // In the corners of what words leave free, one under or over the other where two share a corner; smaller where they have no room.
  void place_insets() {
    if (picture.insets.empty()) return;
    const PixelRect& room = out.views.front();
    const double free_top = picture.views.empty() ? out.inner.y : room.y;
    const double right = picture.views.empty() ? out.inner.x + out.inner.width : room.x + room.width;
    const double free_bottom = picture.views.empty() ? out.inner.y + out.inner.height : room.y + room.height;
    const auto upper = [](const Inset& i) { return i.corner == InsetCorner::upper_left || i.corner == InsetCorner::upper_right; };
    const auto at_left = [](const Inset& i) { return i.corner == InsetCorner::upper_left || i.corner == InsetCorner::lower_left; };
    // The axes stand in the lower left corner.
    const double beside_axes = !out.triads.empty() ? 2.0 * (out.triad_radius + 1.1 * small) + 0.6 * pad : pad;

    // The grid's note stands in the lower right corner.
    const double over_note = out.grid_word >= 0 ? 1.5 * small : 0.0;

    // By how much those of a side must be smaller to stand in its height, and how wide they may be where both sides have some.
    double wanted[2] = {}, gaps[2] = {0.6 * pad, 0.6 * pad};
    for (const Inset& inset : picture.insets) {
      wanted[at_left(inset)] += std::clamp(inset.size, 0.1, 0.6) * room.height;
      gaps[at_left(inset)] += 0.6 * pad;
    }
    double above = 0.0;  // of those at the upper left, which end over the axes
    for (const Inset& inset : picture.insets)
      if (upper(inset) && at_left(inset)) above += std::clamp(inset.size, 0.1, 0.6) * room.height + 0.6 * pad;
    double shrink[2] = {};
    for (int side = 0; side < 2; ++side) {
      double free = free_bottom - free_top - gaps[side];
      if (side == 1 && !out.triads.empty() && above > free - beside_axes) free -= beside_axes;
      if (side == 0) free -= over_note;
      shrink[side] = wanted[side] > 0.0 ? std::clamp(free / wanted[side], 0.0, 1.0) : 0.0;
    }
    const double width_of_all = right - room.x - pad - beside_axes;
    const double widest = wanted[0] > 0.0 && wanted[1] > 0.0 ? 0.5 * (width_of_all - pad) : std::min(0.6 * room.width, width_of_all);

    double used[4] = {};
    for (const Inset& inset : picture.insets) {
      const double height = std::clamp(inset.size, 0.1, 0.6) * room.height * shrink[at_left(inset)];
      const double width = std::min(1.3 * height, widest);
      const auto corner = static_cast<std::size_t>(inset.corner);
      const double x = at_left(inset) ? room.x + (upper(inset) ? pad : beside_axes) : right - pad - width;
      const double y = upper(inset) ? free_top + 0.4 * pad + used[corner]
                                    : free_bottom - 0.8 * pad - height - used[corner] - (at_left(inset) ? 0.0 : over_note);
      used[corner] += height + 0.6 * pad;
      out.magnified.push_back(
          within_scene({static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)),
                        std::max(8, static_cast<int>(std::lround(width))), std::max(8, static_cast<int>(std::lround(height)))}));
    }
  }

  // Whatever room there is, what is drawn lies within the picture and has a pixel at least.
  PixelRect within_scene(PixelRect r) const {
    r.width = std::clamp(r.width, 1, out.scene.width);
    r.height = std::clamp(r.height, 1, out.scene.height);
    r.x = std::clamp(r.x, 0, out.scene.width - r.width);
    r.y = std::clamp(r.y, 0, out.scene.height - r.height);
    return r;
  }

  Layout build() {
    const Overlay& o = picture.overlay;
    split_area();
    const double top = place_words();
    double bottom = out.scene.height - 0.6 * pad;
    double left = pad;
    if (o.triad && picture.views.empty()) {
      out.triad_radius = std::max(16.0, 34.0 * out.unit);
      const double reach = out.triad_radius + 1.1 * small;
      if (2.0 * reach < 0.4 * out.scene.height && 2.0 * reach < 0.4 * out.scene.width) {
        out.triads = {{0.6 * pad + reach, out.scene.height - 0.6 * pad - reach}};
        left = 0.6 * pad + 2.0 * reach + 0.5 * pad;
        out.insets.left = (0.6 * pad + 2.0 * reach) / out.scene.width;
      }
    }
    double right = out.scene.width - pad;
    if (picture.ground && picture.ground->lines && o.grid_note && picture.views.empty()) {
      const double radius = picture.bounds.empty() ? bounds_of_surfaces().radius() : picture.bounds.radius();
      const double spacing = picture.ground->spacing > 0.0 ? picture.ground->spacing : nice_step(2.0 * radius, 12.0);
      const std::string text = "grid " + length_text(spacing);
      const double w = text_width(text, small);
      if (w < 0.4 * out.scene.width) {
        out.grid_word = static_cast<int>(out.words.size());
        out.words.push_back({text, right - w, out.scene.height - 0.8 * pad, small, false, true});
        right -= w + small;
        bottom -= 1.8 * small;
      }
    }
    if (!o.legend.empty()) {
      const double used = place_legend(left, right);
      if (used > 0.0) out.insets.bottom = used / out.scene.height;
    }
    if (o.scalar_bar) place_bar(top > 0.0 ? top : 0.5 * pad, bottom);
    out.insets.top = top / out.scene.height;

    out.inner = out.scene;
    if (!picture.views.empty()) {
      out.inner.y = static_cast<int>(std::ceil(top));
      out.inner.height -= out.inner.y + static_cast<int>(std::ceil(out.insets.bottom * out.scene.height));
      if (out.has_bar) out.inner.width = std::max(1, out.bar.panel.x);
      out.inner.height = std::max(1, out.inner.height);
    } else if (picture.views.empty()) {
      out.inner.y = static_cast<int>(std::ceil(top));
      out.inner.height = std::max(1, out.scene.height - out.inner.y - static_cast<int>(std::ceil(out.insets.bottom * out.scene.height)));
      if (out.has_bar) out.inner.width = std::max(1, out.bar.panel.x);
    }
    if (picture.views.empty()) {
      out.views.push_back(out.scene);
    } else {
      for (const View& v : picture.views) {
        const int x0 = out.inner.x + static_cast<int>(std::lround(v.left * out.inner.width)),
                  x1 = out.inner.x + static_cast<int>(std::lround((v.left + v.width) * out.inner.width));
        const int y0 = out.inner.y + static_cast<int>(std::lround(v.top * out.inner.height)),
                  y1 = out.inner.y + static_cast<int>(std::lround((v.top + v.height) * out.inner.height));
        out.views.push_back(within_scene({x0, y0, x1 - x0, y1 - y0}));
        if (o.triad) {
          out.triad_radius = std::max(13.0, 24.0 * out.unit);
          const double reach = out.triad_radius + 1.1 * small;
          if (reach < 0.15 * std::min(x1 - x0, y1 - y0)) out.triads.emplace_back(x0 + 0.4 * pad + reach, y1 - 0.4 * pad - reach);
        }
        if (!v.label.empty()) {
          const std::string text = fit_text(v.label, out.text, x1 - x0 - pad);
          out.words.push_back({text, x0 + 0.5 * pad, y0 + 0.5 * pad + cap_height(out.text), out.text, false, true});
        }
      }
    }
    place_insets();
    return std::move(out);
  }

  Bounds bounds_of_surfaces() const {
    Bounds b;
    for (const Surface& s : picture.surfaces) b.add(compute_bounds(s.positions, s.pose));
    return b;
  }

  static std::string length_text(double m) {
    struct Unit {
      double size;
      const char* name;
    };
    static constexpr Unit units[] = {{1e3, "km"}, {1.0, "m"}, {1e-3, "mm"}, {1e-6, "µm"}, {1e-9, "nm"}, {1e-12, "pm"}};
    for (const Unit& u : units)
      if (m >= 0.0999 * u.size && (u.size == 1.0 || m >= 0.999 * u.size))
        return fmt::format("{:g} {}", std::round(m / u.size * 1e6) / 1e6, u.name);
    return fmt::format("{:g} m", m);
  }
};

}  // namespace

Ticks make_ticks(double lower, double upper, int most) {
  Ticks ticks;
  if (!(upper > lower) || !std::isfinite(lower) || !std::isfinite(upper)) return ticks;
  const double largest = std::max(std::abs(lower), std::abs(upper));
  const double magnitude = std::floor(std::log10(largest));
  if (magnitude >= 5.0 || magnitude <= -4.0) ticks.exponent = 3 * static_cast<int>(std::floor(magnitude / 3.0));
  const double scale = std::pow(10.0, -ticks.exponent);
  const double low = lower * scale, high = upper * scale;
  most = std::max(most, 2);
  double step = nice_step(high - low, most);
  const auto count = [&](double s) { return std::floor(high / s + 1e-9) - std::ceil(low / s - 1e-9) + 1.0; };
  // The next larger 1-2-5 step until few enough.
  while (count(step) > most) step = nice_step(step * 2.2, 1.0);
  ticks.step = step;
  // A range that is narrow against its values needs the digits that tell the ticks apart.
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
  for (double k = std::ceil(low / step - 1e-9); k <= std::floor(high / step + 1e-9) && ticks.values.size() < 100; k += 1.0)
    ticks.values.push_back({k * step, number(k * step, decimals)});
  return ticks;
}

Layout make_layout(const Picture& picture) { return Builder(picture).build(); }

}  // namespace flexframe::render
