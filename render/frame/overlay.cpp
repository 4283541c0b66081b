#include "render/frame/overlay.h"

#include "render/base/srgb.h"
#include "render/image/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstring>
#include <numbers>
#include <optional>

namespace flexframe::render {
namespace {

// Files of elements, in contrast to pixels.
template <class Sheet>
concept VectorSheet = std::same_as<Sheet, SvgSheet> || std::same_as<Sheet, PdfSheet>;

struct Ink {
  glm::vec3 strong, faint, panel, grid;
  float coming = 0.28f;  // opacity of what is to come in plots: as far from either panel (contrast 1.7)
  bool rimmed = false;   // words get a rim of the panel's colour: what lies behind the picture is not known
};

Ink ink_of(const Picture& picture) {
  const bool clear = picture.background.transparent;
  if (picture.overlay.dark)
    return {{0.95f, 0.96f, 0.97f}, {0.72f, 0.75f, 0.79f}, {0.10f, 0.11f, 0.13f}, {0.28f, 0.30f, 0.33f}, 0.4f, clear};
  return {{0.10f, 0.12f, 0.15f}, {0.33f, 0.37f, 0.42f}, {1.0f, 1.0f, 1.0f}, {0.86f, 0.88f, 0.90f}, 0.28f, clear};
}

Box box_of(const PixelRect& r) { return Box(r.x, r.y, r.width, r.height); }

template <class Sheet>
void draw_line_of_text(Sheet& image, const TextLine& line, const Ink& ink) {
  const Weight weight = line.bold ? Weight::bold : Weight::regular;
  if (ink.rimmed) draw_text_rim(image, {line.x, line.y}, line.text, line.size, ink.panel, weight);
  draw_text(image, {line.x, line.y}, line.text, line.size, line.faint && !ink.rimmed ? ink.faint : ink.strong, weight);
}

void fill_bar(Image& image, const PixelRect& b, const ScalarMap& map) {
  for (int j = 0; j < b.height; ++j) {
    const glm::vec3 c = map_color(map, 1.0 - (j + 0.5) / b.height);
    for (int i = 0; i < b.width; ++i) blend_pixel(image, b.x + i, b.y + j, c, 1.0f);
  }
}

// Each colour down to the end of the bar, the next over it: viewers show no seams between them.
template <VectorSheet Sheet>
void fill_bar(Sheet& sheet, const PixelRect& b, const ScalarMap& map) {
  glm::vec3 last(-1.0f);
  for (int j = 0; j < b.height; ++j) {
    const glm::vec3 c = map_color(map, 1.0 - (j + 0.5) / b.height);
    if (c != last) fill_rectangle(sheet, Box(b.x, b.y + j, b.width, b.height - j), c);
    last = c;
  }
}

template <class Sheet>
void draw_bar(Sheet& image, const Picture& picture, const BarLayout& layout, const Ink& ink, double unit) {
  const PixelRect& b = layout.bar;
  fill_bar(image, b, picture.scalar_map);
  const double line = std::max(1.0, std::round(unit));
  draw_frame(image, {b.x - line, b.y - line, b.width + 2.0 * line, b.height + 2.0 * line}, line, {ink.faint, 0.9f});
  for (const double y : layout.ticks) {
    const double at = std::clamp(std::round(y - 0.5 * line), double(b.y), b.y + b.height - line);
    fill_rectangle(image, Box(b.x + b.width, at, std::max(3.0, 5.0 * unit), line), ink.faint);
  }
  for (const TextLine& w : layout.words) draw_line_of_text(image, w, ink);
}

template <class Sheet>
void draw_triad(Sheet& image, const Layout& layout, const glm::dvec2& centre, const ViewFrame& frame, const Ink& ink) {
  struct Axis {
    glm::dvec3 direction;
    glm::vec3 color;
    const char* name;
  };
  std::array<Axis, 3> axes = {
      {{{1, 0, 0}, {0.82f, 0.20f, 0.17f}, "x"}, {{0, 1, 0}, {0.18f, 0.58f, 0.24f}, "y"}, {{0, 0, 1}, {0.16f, 0.37f, 0.80f}, "z"}}};
  for (Axis& a : axes) a.direction = glm::dmat3(frame.view) * a.direction;
  // Farthest first.
  std::sort(axes.begin(), axes.end(), [](const Axis& a, const Axis& b) { return a.direction.z < b.direction.z; });
  const double radius = layout.triad_radius, width = std::max(1.6, 2.6 * layout.unit), head = std::max(5.0, 9.0 * layout.unit);
  const double size = std::max(9.0, 12.5 * layout.unit);
  std::vector<glm::dvec2> labels;
  for (const Axis& a : axes) {
    const glm::dvec2 d(a.direction.x, -a.direction.y);
    const double length = glm::length(d);
    const glm::dvec2 tip = centre + d * radius;
    if (length > 0.12) {
      const glm::dvec2 e = d / length, across(-e.y, e.x);
      const double h = std::min(head, 0.8 * length * radius);
      const std::array<glm::dvec2, 2> shaft = {centre, tip - e * h};
      draw_polyline(image, shaft, width, a.color);
      const std::array<glm::dvec2, 3> triangle = {tip, tip - e * h + across * h * 0.42, tip - e * h - across * h * 0.42};
      fill_polygon(image, triangle, a.color);
    } else {
      // Along the line of sight: a dot for an arrow's tip, a cross in a ring for its tail.
      const double r = 0.4 * head;
      if (a.direction.z > 0.0) {
        fill_disc(image, centre.x, centre.y, r, a.color);
      } else {
        std::vector<glm::dvec2> ring;
        for (int k = 0; k <= 24; ++k) {
          const double angle = 2.0 * std::numbers::pi * k / 24.0;
          ring.push_back(centre + r * glm::dvec2(std::cos(angle), std::sin(angle)));
        }
        const double thin = 0.5 * width, q = r * std::numbers::sqrt2 / 2.0;
        draw_polyline(image, ring, thin, a.color);
        draw_polyline(image, std::array{centre + glm::dvec2(-q, -q), centre + glm::dvec2(q, q)}, thin, a.color);
        draw_polyline(image, std::array{centre + glm::dvec2(-q, q), centre + glm::dvec2(q, -q)}, thin, a.color);
      }
    }
    const glm::dvec2 away = length > 0.12 ? d / length : glm::dvec2(-0.8, 0.7);
    // Two axes may point the same way as seen: the second name goes beside its tip, then to the other side.
    const glm::dvec2 root = length > 0.12 ? tip : centre;
    glm::dvec2 place = root + away * (0.72 * size);
    for (const double side : {0.9, -0.9, 1.8, -1.8}) {
      const auto taken = [&](const glm::dvec2& other) { return glm::length(other - place) < 0.95 * size; };
      if (std::none_of(labels.begin(), labels.end(), taken)) break;
      place = root + glm::dvec2(-away.y, away.x) * (side * size);
    }
    labels.push_back(place);
    draw_line_of_text(image, {a.name, place.x - 0.5 * text_width(a.name, size), place.y + 0.36 * size, size, false, false}, ink);
  }
}

// Points of a series on the picture. Many samples a pixel: the first, lowest, highest and last of each column keep the shape.
template <class Place>
std::vector<glm::dvec2> series_points(const Series& s, int columns, bool rising, Place place) {
  std::vector<glm::dvec2> points;
  const std::size_t n = std::min(s.x.size(), s.y.size());
  if (n <= 8 * std::size_t(columns) || !rising) {
    for (std::size_t i = 0; i < n; ++i) points.push_back(place(s.x[i], s.y[i]));
    return points;
  }
  std::size_t i = 0;
  while (i < n) {
    const double column = std::floor(place(s.x[i], 0.0).x * 2.0);
    std::size_t j = i, low = i, high = i;
    for (; j < n && std::floor(place(s.x[j], 0.0).x * 2.0) == column; ++j) {
      if (s.y[j] < s.y[low]) low = j;
      if (s.y[j] > s.y[high]) high = j;
    }
    if (j == i) j = i + 1;  // not a number
    const std::array<std::size_t, 4> keep = {i, std::min(low, high), std::max(low, high), j - 1};
    for (const std::size_t q : keep) points.push_back(place(s.x[q], s.y[q]));
    i = j;
  }
  return points;
}

bool rises(const Series& s) {
  return std::is_sorted(s.x.begin(), s.x.begin() + static_cast<std::ptrdiff_t>(std::min(s.x.size(), s.y.size())));
}

// Colours are made for white panels: on a dark one those that are nearer to it than to white are lightened to the middle (contrast 4.2).
glm::vec3 color_of(const Plot& plot, std::size_t k, const Ink& ink) {
  const glm::vec3 color = plot.series[k].color.x < 0.0f ? category_color(static_cast<int>(k)) : plot.series[k].color;
  const glm::vec3 weights(0.2126f, 0.7152f, 0.0722f), light = linear_from_srgb(color);
  const float middle = std::sqrt(1.05f * (glm::dot(weights, linear_from_srgb(ink.panel)) + 0.05f)) - 0.05f, own = glm::dot(weights, light);
  if (glm::dot(weights, ink.panel) > 0.5f || own >= middle) return color;
  return srgb_from_linear(glm::mix(light, glm::vec3(1.0f), (middle - own) / (1.0f - own)));
}

// Whether a kept panel is that of this plot.
bool same_panel(const PlotCache::Panel& kept, const Plot& plot, const Picture& picture, const PlotLayout& layout, const Layout& all,
                int channels) {
  const Background& b = picture.background;
  if (kept.panel != layout.panel || kept.axes != layout.axes || kept.unit != all.unit || kept.text != all.text ||
      kept.dark != picture.overlay.dark || kept.channels != channels)
    return false;
  if (kept.background.top != b.top || kept.background.bottom != b.bottom || kept.background.transparent != b.transparent) return false;
  if (kept.plot.x_label != plot.x_label || kept.plot.y_label != plot.y_label || kept.plot.x_range != plot.x_range ||
      kept.plot.y_range != plot.y_range)
    return false;
  if (kept.plot.series.size() != plot.series.size()) return false;
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series &a = kept.plot.series[k], &s = plot.series[k];
    // Bytes: what is not a number is equal to itself.
    const auto same = [](std::span<const double> p, std::span<const double> q) {
      return p.size() == q.size() && (p.empty() || std::memcmp(p.data(), q.data(), p.size_bytes()) == 0);
    };
    if (a.label != s.label || a.color != s.color || !same(a.x, s.x) || !same(a.y, s.y)) return false;
  }
  return true;
}

// Panel, grid and axes.
template <class Sheet>
void draw_axes(Sheet& image, const PlotLayout& layout, const Ink& ink, double unit) {
  const PixelRect &panel = layout.panel, &axes = layout.axes;
  fill_rectangle(image, box_of(panel), {ink.panel, 0.88f});
  const double line = std::max(1.0, std::round(unit));
  for (const double y : layout.y_ticks) fill_rectangle(image, Box(axes.x, std::round(y - 0.5 * line), axes.width, line), ink.grid);
  for (const double x : layout.x_ticks) fill_rectangle(image, Box(std::round(x - 0.5 * line), axes.y, line, axes.height), ink.grid);
  fill_rectangle(image, Box(axes.x, axes.y, line, axes.height), ink.faint);
  fill_rectangle(image, Box(axes.x, axes.y + axes.height - line, axes.width, line), ink.faint);
}

glm::dvec4 clip_of(const PixelRect& axes) { return glm::dvec4(axes.x, axes.y - 1, axes.width + 1, axes.height + 2); }

double series_width(double unit) { return std::max(1.2, 2.0 * unit); }

// Points of a series on the picture.
std::vector<glm::dvec2> placed_series(const Series& s, const PlotLayout& layout) {
  const PixelRect& axes = layout.axes;
  const double sx = axes.width / (layout.x1 - layout.x0), sy = axes.height / (layout.y1 - layout.y0);
  return series_points(s, axes.width, rises(s), [&](double x, double y) {
    return glm::dvec2(axes.x + (x - layout.x0) * sx, axes.y + axes.height - (y - layout.y0) * sy);
  });
}

template <class Sheet>
void draw_series_name(Sheet& image, const Plot& plot, const PlotLayout& layout, std::size_t k, const Ink& ink, double unit) {
  if (layout.series[k].text.empty()) return;
  const PixelRect& l = layout.series_lines[k];
  const double thick = std::max(2.0, 2.4 * unit);
  fill_rectangle(image, Box(l.x, l.y - 0.5 * thick, l.width, thick), color_of(plot, k, ink), 0.5 * thick);
  draw_line_of_text(image, layout.series[k], ink);
}

template <class Sheet>
void draw_plot_words(Sheet& image, const PlotLayout& layout, const Ink& ink) {
  for (const TextLine& w : layout.words) draw_line_of_text(image, w, ink);
  if (!layout.y_label.text.empty())
    draw_text_upwards(image, {layout.y_label.x, layout.y_label.y}, layout.y_label.text, layout.y_label.size, ink.strong);
}

// Everything of a plot but what runs with time: what is to come is faint everywhere, what has been goes over it.
PlotCache::Panel make_panel(Image& image, const Picture& picture, const PlotLayout& layout, const Layout& all, const Ink& ink,
                            bool marked) {
  const Plot& plot = picture.overlay.plots[layout.plot];
  const double unit = all.unit;
  PlotCache::Panel out;
  const PixelRect &panel = layout.panel, &axes = layout.axes;
  draw_axes(image, layout, ink, unit);
  const glm::dvec4 clip = clip_of(axes);
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const Series& s = plot.series[k];
    out.lines.push_back(cover_polyline(image.width, image.height, placed_series(s, layout), series_width(unit), 0.0, &clip));
    blend_cover(image, out.lines.back(), color_of(plot, k, ink), marked && rises(s) ? ink.coming : 1.0f, image.width);
    draw_series_name(image, plot, layout, k, ink, unit);
  }
  draw_plot_words(image, layout, ink);

  // What decides it, for the next picture.
  out.panel = panel;
  out.axes = axes;
  out.background = picture.background;
  out.dark = picture.overlay.dark;
  out.unit = unit;
  out.text = all.text;
  out.channels = image.channels;
  out.plot = plot;
  for (const Series& s : plot.series) {
    out.data.emplace_back(s.x.begin(), s.x.end());
    out.data.emplace_back(s.y.begin(), s.y.end());
  }
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    out.plot.series[k].x = out.data[2 * k];
    out.plot.series[k].y = out.data[2 * k + 1];
  }
  return out;
}

// Copies a part of an image to where `to` has its upper left corner.
void copy_part(const Image& from, const PixelRect& part, Image& to, const glm::ivec2& corner) {
  for (int y = 0; y < part.height; ++y)
    std::copy_n(&from.pixels[(std::size_t(part.y + y) * from.width + part.x) * from.channels], std::size_t(part.width) * from.channels,
                &to.pixels[(std::size_t(corner.y + y) * to.width + corner.x) * to.channels]);
}

double mark_of(const Plot& plot, const PlotLayout& layout) {
  const double sx = layout.axes.width / (layout.x1 - layout.x0);
  return layout.axes.x + (plot.mark - layout.x0) * sx;
}

bool is_marked(const PixelRect& axes, double mark) { return mark >= axes.x - 0.5 && mark <= axes.x + axes.width + 0.5; }

template <class Sheet>
void draw_mark(Sheet& image, const PlotLayout& layout, double mark, const Ink& ink, double unit) {
  const double line = std::max(1.0, std::round(unit));
  fill_rectangle(image, Box(std::round(mark - 0.5 * line), layout.axes.y, line, layout.axes.height), {ink.faint, 0.8f});
}

struct Dot {
  double mark;  // x on the picture
  const Ink& ink;
  double unit;
};

// Where series k is now; not out of the axes.
template <class Sheet>
void draw_dot(Sheet& image, const Plot& plot, const PlotLayout& layout, std::size_t k, const Dot& dot) {
  const Series& s = plot.series[k];
  const std::size_t n = std::min(s.x.size(), s.y.size());
  const double sy = layout.axes.height / (layout.y1 - layout.y0);
  const auto after = std::upper_bound(s.x.begin(), s.x.begin() + static_cast<std::ptrdiff_t>(n), plot.mark);
  const std::size_t i = std::max<std::ptrdiff_t>(after - s.x.begin() - 1, 0);
  const std::size_t j = std::min(i + 1, n - 1);
  const double span = s.x[j] - s.x[i], t = span > 0.0 ? std::clamp((plot.mark - s.x[i]) / span, 0.0, 1.0) : 0.0;
  const double value = s.now.value_or(s.y[i] + t * (s.y[j] - s.y[i]));
  if (!std::isfinite(value) || value < layout.y0 || value > layout.y1 || plot.mark < s.x.front() || plot.mark > s.x[n - 1]) return;
  const glm::dvec2 p(dot.mark, layout.axes.y + layout.axes.height - (value - layout.y0) * sy);
  fill_disc(image, p.x, p.y, std::max(3.0, 4.6 * dot.unit), dot.ink.panel);
  fill_disc(image, p.x, p.y, std::max(2.0, 3.4 * dot.unit), color_of(plot, k, dot.ink));
}

// index: which of the plots; its place in the cache too.
void draw_plot(Image& image, const Picture& picture, const Layout& all, std::size_t index, const Ink& ink, PlotCache& cache) {
  const PlotLayout& layout = all.plots[index];
  const Plot& plot = picture.overlay.plots[layout.plot];
  const PixelRect &panel = layout.panel, &axes = layout.axes;
  const double mark = mark_of(plot, layout);
  const bool marked = is_marked(axes, mark);

  if (index < cache.panels.size() && marked && same_panel(cache.panels[index], plot, picture, layout, all, image.channels)) {
    copy_part(cache.panels[index].image, {0, 0, panel.width, panel.height}, image, {panel.x, panel.y});
  } else {
    PlotCache::Panel fresh = make_panel(image, picture, layout, all, ink, marked);
    if (!marked) return;
    fresh.image = make_image(panel.width, panel.height, image.channels);
    copy_part(image, panel, fresh.image, {0, 0});
    cache.panels.resize(std::max(cache.panels.size(), index + 1));
    cache.panels[index] = std::move(fresh);
  }

  // What has been, strong up to the mark, and a dot where each series is now.
  draw_mark(image, layout, mark, ink, all.unit);
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    if (plot.series[k].x.empty() || plot.series[k].y.empty() || !rises(plot.series[k])) continue;
    blend_cover(image, cache.panels[index].lines[k], color_of(plot, k, ink), 1.0f, static_cast<int>(std::ceil(mark)));
    draw_dot(image, plot, layout, k, {mark, ink, all.unit});
  }
}

// The same for a file of one picture: lines by their points, nothing is kept.
template <VectorSheet Sheet>
void draw_plot(Sheet& sheet, const Picture& picture, const Layout& all, std::size_t index, const Ink& ink) {
  const PlotLayout& layout = all.plots[index];
  const Plot& plot = picture.overlay.plots[layout.plot];
  const PixelRect& axes = layout.axes;
  const double mark = mark_of(plot, layout);
  const bool marked = is_marked(axes, mark);
  draw_axes(sheet, layout, ink, all.unit);
  const glm::dvec4 clip = clip_of(axes);
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    draw_polyline(sheet, placed_series(plot.series[k], layout), series_width(all.unit),
                  {color_of(plot, k, ink), marked && rises(plot.series[k]) ? ink.coming : 1.0f}, 0.0, &clip);
    draw_series_name(sheet, plot, layout, k, ink, all.unit);
  }
  draw_plot_words(sheet, layout, ink);
  if (!marked) return;
  draw_mark(sheet, layout, mark, ink, all.unit);
  const glm::dvec4 past(clip.x, clip.y, std::ceil(mark) - clip.x, clip.w);
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    if (plot.series[k].x.empty() || plot.series[k].y.empty() || !rises(plot.series[k])) continue;
    if (past.z > 0.0)
      draw_polyline(sheet, placed_series(plot.series[k], layout), series_width(all.unit), color_of(plot, k, ink), 0.0, &past);
    draw_dot(sheet, plot, layout, k, {mark, ink, all.unit});
  }
}

// Labels next to their points, or farther off where they would cover others; what finds no room is left out.
bool lies_in(const glm::dvec4& box, const PixelRect& area) {
  return box.x >= area.x && box.y >= area.y && box.z <= area.x + area.width && box.w <= area.y + area.height;
}
bool overlap(const glm::dvec4& a, const glm::dvec4& b) { return a.x < b.z && b.x < a.z && a.y < b.w && b.y < a.w; }

// The line of a dimension on the picture; empty if a point of it is behind the viewer.
std::vector<glm::dvec2> projected(const ViewFrame& frame, std::span<const glm::dvec3> points) {
  std::vector<glm::dvec2> out(points.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    if (!project(frame, points[k], out[k])) return {};
  return out;
}

// The head of an arrow that ends at `tip` and comes from `from`.
template <class Sheet>
void draw_head(Sheet& image, const glm::dvec2& tip, const glm::dvec2& from, double length, const glm::vec3& color) {
  if (!(glm::length(tip - from) > 0.0)) return;
  const glm::dvec2 e = glm::normalize(tip - from), across(-e.y, e.x);
  const std::array<glm::dvec2, 3> triangle = {tip, tip - e * length + across * length * 0.28, tip - e * length - across * length * 0.28};
  fill_polygon(image, triangle, color);
}

// Lines with heads and their values: in the middle where there is room, else beside it. taken: boxes of words, which grow by these.
template <class Sheet>
void draw_dimensions(Sheet& image, const Picture& picture, const ViewFrame& frame, const Layout& layout, std::vector<glm::dvec4>& taken) {
  const glm::vec3 ink = picture.overlay.dark ? glm::vec3(0.92f) : glm::vec3(0.08f, 0.10f, 0.14f);
  const glm::vec3 rim = picture.overlay.dark ? glm::vec3(0.1f) : glm::vec3(1.0f);
  const double thin = std::max(1.0, 1.2 * layout.unit), size = std::max(9.0, 14.0 * picture.overlay.text_scale * layout.unit);
  const double head = std::max(6.0, 10.0 * layout.unit);
  // Of an inset, or of one view of several, only what lies within it.
  const PixelRect& area = frame.area;
  const glm::dvec4 whole(area.x, area.y, area.width, area.height);
  const auto within_area = [&](const glm::dvec2& at) {
    return at.x >= area.x && at.y >= area.y && at.x <= area.x + area.width && at.y <= area.y + area.height;
  };
  const auto clip = [&](const std::vector<glm::dvec2>& points) {
    return std::all_of(points.begin(), points.end(), within_area) ? nullptr : &whole;
  };
  for (const Dimension& dimension : picture.dimensions) {
    const std::vector<glm::dvec2> line = projected(frame, dimension.line);
    if (line.size() < 2) continue;
    double length = 0.0;
    for (std::size_t k = 1; k < line.size(); ++k) length += glm::length(line[k] - line[k - 1]);
    for (const auto& helper : dimension.helpers)
      if (const std::vector<glm::dvec2> ends = projected(frame, helper); !ends.empty())
        draw_polyline(image, ends, 0.8 * thin, {ink, 0.55f}, 0.0, clip(ends));
    // Seen over light and dark alike.
    draw_polyline(image, line, 3.0 * thin, {rim, 0.6f}, 0.0, clip(line));
    draw_polyline(image, line, thin, ink, 0.0, clip(line));
    if (length > 2.5 * head) {
      // An arc's heads lie along chords as long as they are.
      const auto inner = [&](bool first) {
        double left = head;
        for (std::size_t k = 1; k < line.size(); ++k) {
          const glm::dvec2 a = line[first ? k - 1 : line.size() - k], b = line[first ? k : line.size() - k - 1];
          if (glm::length(b - a) >= left) return a + (b - a) * (left / glm::length(b - a));
          left -= glm::length(b - a);
        }
        return line[line.size() / 2];
      };
      if (within_area(line.front())) draw_head(image, line.front(), inner(true), head, ink);
      if (within_area(line.back())) draw_head(image, line.back(), inner(false), head, ink);
    } else {
      for (const glm::dvec2& end : {line.front(), line.back()})
        if (within_area(end)) fill_disc(image, end.x, end.y, 1.8 * thin, ink);
    }
    if (dimension.text.empty()) continue;

    const glm::dvec2 middle = line.size() == 2 ? 0.5 * (line[0] + line[1]) : line[line.size() / 2];
    const glm::dvec2 chord = line.back() - line.front();
    glm::dvec2 away = glm::length(chord) > 0.0 ? glm::dvec2(-chord.y, chord.x) / glm::length(chord) : glm::dvec2(0.0, -1.0);
    // Of an arc: outwards.
    const glm::dvec2 outwards = middle - 0.5 * (line.front() + line.back());
    if (line.size() > 2 ? glm::dot(away, outwards) < 0.0 : away.y > 0.0) away = -away;
    const double w = text_width(dimension.text, size), h = cap_height(size);
    const double beside = 0.5 * (std::abs(away.x) * w + std::abs(away.y) * h) + 0.9 * size;
    const bool within = line.size() == 2 && length > 1.5 * w + 4.0 * head;
    const glm::dvec2 places[] = {middle + (within ? glm::dvec2(0.0) : beside * away),
                                 middle + beside * away,
                                 middle - beside * away,
                                 middle + 2.0 * beside * away,
                                 middle - 2.0 * beside * away,
                                 middle + 3.0 * beside * away,
                                 middle - 3.0 * beside * away};
    for (const glm::dvec2& centre : places) {
      const glm::dvec2 p(centre.x - 0.5 * w, centre.y + 0.5 * h);
      const glm::dvec4 box(p.x - 3.0, p.y - h - 3.0, p.x + w + 3.0, p.y + descent(size) + 2.0);
      if (!lies_in(box, frame.area)) continue;
      if (std::any_of(taken.begin(), taken.end(), [&](const glm::dvec4& other) { return overlap(box, other); })) continue;
      taken.push_back(box);
      fill_rectangle(image, {box.x, box.y, box.z - box.x, box.w - box.y}, {rim, 0.85f}, 0.3 * size);
      draw_text(image, p, dimension.text, size, ink);
      break;
    }
  }
}

// From a label's words to its point: a line to a dot; to what is hidden a dashed line to a ring.
template <class Sheet>
void draw_leader(Sheet& image, const std::array<glm::dvec2, 2>& line, const glm::vec3& ink, const glm::vec3& rim, double unit,
                 bool hidden) {
  const glm::dvec2& at = line[0];
  draw_polyline(image, line, std::max(2.4, 3.4 * unit), {rim, 0.6f});
  draw_polyline(image, line, std::max(1.0, 1.3 * unit), ink, hidden ? std::max(3.0, 4.0 * unit) : 0.0);
  fill_disc(image, at.x, at.y, std::max(2.4, 3.6 * unit), hidden ? ink : rim);
  fill_disc(image, at.x, at.y, std::max(1.6, 2.6 * unit), hidden ? rim : ink);
}

// What stands in the upper left corner of an inset.
struct Caption {
  std::string text;  // empty: there is no room
  double size = 0.0, line = 0.0;
  Box box{0.0, 0.0, 0.0, 0.0};
};

// A long label is cut; how much larger the inset is stays.
Caption caption_of(const Picture& picture, const Layout& layout, std::size_t i) {
  const Inset& inset = picture.insets[i];
  const PixelRect& r = layout.magnified[i];
  Caption out;
  out.line = std::max(1.0, std::round(1.3 * layout.unit));
  out.size = std::max(9.0, 12.5 * layout.unit * picture.overlay.text_scale);
  const double gap = 0.5 * out.size, room = r.width - 2.0 * gap - 2.0 * out.line;
  const std::string scale = scale_text(inset.zoom);
  const std::string label = inset.label.empty() ? "" : fit_text(inset.label, out.size, room - text_width(", " + scale, out.size));
  out.text = label.empty() ? fit_text(scale, out.size, room) : label + ", " + scale;
  out.box = Box(r.x + out.line, r.y + out.line, text_width(out.text, out.size) + 2.0 * gap, cap_height(out.size) + 2.0 * gap);
  return out;
}

template <class Sheet>
void draw_labels(Sheet& image, const Picture& picture, const SceneBelow& below, const Layout& layout) {
  std::vector<glm::dvec4> taken;
  // Words of the scene keep out of the insets, which have their own, of the bar and of what is written already.
  const auto add = [&](const PixelRect& r) { taken.emplace_back(r.x, r.y, r.x + r.width, r.y + r.height); };
  for (const PixelRect& r : layout.magnified) add(r);
  const auto add_words = [&](const std::vector<TextLine>& words) {
    for (const TextLine& w : words)
      taken.emplace_back(w.x, w.y - cap_height(w.size), w.x + text_width(w.text, w.size, w.bold ? Weight::bold : Weight::regular),
                         w.y + descent(w.size));
  };
  if (layout.has_bar) {
    add(layout.bar.bar);
    add_words(layout.bar.words);
  }
  add_words(layout.words);
  const auto is_hidden = [&](std::size_t view, std::size_t k) {
    return view < below.hidden.size() && k < below.hidden[view].size() && below.hidden[view][k];
  };
  for (std::size_t view = 0; view < below.frames.size(); ++view) {
    const ViewFrame& frame = below.frames[view];
    const bool inset = view >= layout.views.size();
    if (view == layout.views.size()) {
      taken.clear();
      for (std::size_t i = 0; i < layout.magnified.size() && i < picture.insets.size(); ++i) {
        const Box box = caption_of(picture, layout, i).box;
        taken.emplace_back(box.x, box.y, box.x + box.width, box.y + box.height);
      }
    }
    draw_dimensions(image, picture, frame, layout, taken);
    for (std::size_t k = 0; k < picture.labels.size(); ++k) {
      const Label& label = picture.labels[k];
      glm::dvec2 at;
      if (label.text.empty() || !project(frame, label.point, at)) continue;
      const PixelRect& part = frame.area;
      if (inset && (at.x < part.x || at.y < part.y || at.x > part.x + part.width || at.y > part.y + part.height)) continue;
      const bool hidden = is_hidden(view, k);
      const std::string text = hidden ? label.text + " (hidden)" : label.text;
      const double size = std::max(9.0, static_cast<double>(label.size) * picture.overlay.text_scale * layout.unit);
      const double w = text_width(text, size), h = cap_height(size), gap = 0.7 * size;
      const auto box_at = [&](const glm::dvec2& p) {
        return glm::dvec4(p.x - 2.0, p.y - h - 2.0, p.x + w + 2.0, p.y + descent(size) + 2.0);
      };
      const auto free_place = [&](double off) -> std::optional<glm::dvec2> {
        const glm::dvec2 places[] = {{gap + off, -0.4 * gap - off},      {gap + off, h + 0.6 * gap + off},
                                     {-gap - w - off, -0.4 * gap - off}, {-0.5 * w, -gap - 1.4 * off},
                                     {-0.5 * w, gap + h + 1.4 * off},    {-gap - w - off, h + 0.6 * gap + off}};
        for (const glm::dvec2& offset : places) {
          const glm::dvec4 box = box_at(at + offset);
          if (lies_in(box, frame.area) && std::none_of(taken.begin(), taken.end(), [&](const auto& other) { return overlap(box, other); }))
            return at + offset;
        }
        return std::nullopt;
      };
      // Beside the point, or with a leader two and a half lines off; where there is no room, with a leader farther off.
      const double far = 2.6 * size;
      for (const double off : {label.leader ? far : 0.0, label.leader ? 2.0 * far : far, 3.0 * far}) {
        const std::optional<glm::dvec2> free = free_place(off);
        if (!free) continue;
        const glm::dvec4 box = box_at(*free);
        taken.push_back(box);
        if (off > 0.0) {
          const glm::dvec2 end(std::clamp(at.x, box.x, box.z), std::clamp(at.y, box.y, box.w));
          const std::array<glm::dvec2, 2> line = {at, end};
          const glm::vec3 ink = picture.overlay.dark ? glm::vec3(0.9f) : label.color;
          draw_leader(image, line, ink, picture.overlay.dark ? glm::vec3(0.1f) : glm::vec3(1.0f), layout.unit, hidden);
        }
        // A light rim keeps the words readable over bodies.
        const glm::vec3 rim = picture.overlay.dark ? glm::vec3(0.1f) : glm::vec3(1.0f);
        fill_rectangle(image, {box.x - 1.0, box.y - 1.0, box.z - box.x + 2.0, box.w - box.y + 2.0}, {rim, off > 0.0 ? 0.8f : 0.55f},
                       0.3 * size);
        draw_text(image, *free, text, size, picture.overlay.dark ? glm::vec3(0.95f) : label.color);
        break;
      }
    }
  }
}

// The frame of an inset, its words, and what part of the first view it shows larger.
template <class Sheet>
void draw_insets(Sheet& image, const Picture& picture, const Layout& layout, std::span<const ViewFrame> frames, const Ink& ink) {
  const double line = std::max(1.0, std::round(1.3 * layout.unit));
  for (std::size_t i = 0; i < layout.magnified.size() && i < picture.insets.size(); ++i) {
    const Inset& inset = picture.insets[i];
    const PixelRect &r = layout.magnified[i], &whole = frames.front().area;
    glm::dvec2 at;
    if (project(frames.front(), inset.point, at)) {
      const double w = r.width / inset.zoom, h = r.height / inset.zoom;
      const Box part(at.x - 0.5 * w, at.y - 0.5 * h, w, h);
      if (part.x > whole.x && part.y > whole.y && part.x + w < whole.x + whole.width && part.y + h < whole.y + whole.height) {
        draw_frame(image, part, line, {ink.strong, 0.8f});
        // Two lines between the corners that face each other, outside of both.
        const bool beside = std::abs(at.x - r.x - 0.5 * r.width) * r.height > std::abs(at.y - r.y - 0.5 * r.height) * r.width;
        for (const bool second : {false, true}) {
          const glm::dvec2 from = beside ? glm::dvec2(at.x < r.x ? part.x + w : part.x, second ? part.y + h : part.y)
                                         : glm::dvec2(second ? part.x + w : part.x, at.y < r.y ? part.y + h : part.y);
          const glm::dvec2 to = beside ? glm::dvec2(at.x < r.x ? r.x : r.x + r.width, second ? r.y + r.height : r.y)
                                       : glm::dvec2(second ? r.x + r.width : r.x, at.y < r.y ? r.y : r.y + r.height);
          const std::array<glm::dvec2, 2> ends = {from, to};
          draw_polyline(image, ends, 0.7 * line, {ink.faint, 0.7f});
        }
      }
    }
    draw_frame(image, box_of(r), line, {ink.strong, 0.8f});
    const Caption caption = caption_of(picture, layout, i);
    if (caption.text.empty()) continue;
    fill_rectangle(image, caption.box, {ink.panel, 0.75f});
    const double gap = 0.5 * caption.size;
    draw_text(image, {caption.box.x + gap, caption.box.y + gap + cap_height(caption.size)}, caption.text, caption.size, ink.strong);
  }
}

// All but the plots, which lie between what is before and after them.
template <class Sheet, class DrawPlots>
void draw_all(Sheet& image, const Picture& picture, const Layout& layout, const SceneBelow& below, const DrawPlots& draw_plots) {
  const std::span<const ViewFrame> frames = below.frames;
  const Ink ink = ink_of(picture);
  draw_labels(image, picture, below, layout);
  draw_insets(image, picture, layout, frames, ink);
  if (layout.views.size() > 1) {
    const double line = std::max(1.0, std::round(layout.unit));
    for (const PixelRect& v : layout.views) {
      if (v.x > layout.inner.x) fill_rectangle(image, Box(v.x - 0.5 * line, v.y, line, v.height), {ink.faint, 0.35f});
      if (v.y > layout.inner.y) fill_rectangle(image, Box(v.x, v.y - 0.5 * line, v.width, line), {ink.faint, 0.35f});
    }
  }
  draw_plots(ink);
  if (layout.has_bar) draw_bar(image, picture, layout.bar, ink, layout.unit);
  if (layout.has_legend)
    for (std::size_t i = 0; i < layout.legend.words.size(); ++i) {
      const PixelRect& s = layout.legend.swatches[i];
      const LegendEntry& e = picture.overlay.legend[i];
      fill_rectangle(image, box_of(s), {e.color, 0.25f + 0.75f * std::clamp(e.opacity, 0.0f, 1.0f)}, 0.2 * s.width);
      if (e.opacity < 1.0f) draw_frame(image, box_of(s), std::max(1.0, layout.unit), {e.color, 0.8f});
      draw_line_of_text(image, layout.legend.words[i], ink);
    }
  for (std::size_t i = 0; i < std::min(layout.triads.size(), frames.size()); ++i)
    draw_triad(image, layout, layout.triads[i], frames[i], ink);
  for (std::size_t i = 0; i < layout.words.size(); ++i)
    if (static_cast<int>(i) != layout.grid_word || below.grid_seen) draw_line_of_text(image, layout.words[i], ink);
}

}  // namespace

void draw_overlay(Image& image, const Picture& picture, const Layout& layout, const SceneBelow& below, PlotCache& cache) {
  draw_all(image, picture, layout, below, [&](const Ink& ink) {
    for (std::size_t i = 0; i < layout.plots.size(); ++i) draw_plot(image, picture, layout, i, ink, cache);
  });
}

namespace {

template <VectorSheet Sheet>
void draw_elements(Sheet& sheet, const Picture& picture, const Layout& layout, const SceneBelow& below) {
  draw_all(sheet, picture, layout, below, [&](const Ink& ink) {
    for (std::size_t i = 0; i < layout.plots.size(); ++i) draw_plot(sheet, picture, layout, i, ink);
  });
}

}  // namespace

void draw_overlay(SvgSheet& sheet, const Picture& picture, const Layout& layout, const SceneBelow& below) {
  draw_elements(sheet, picture, layout, below);
}

void draw_overlay(PdfSheet& sheet, const Picture& picture, const Layout& layout, const SceneBelow& below) {
  draw_elements(sheet, picture, layout, below);
}

namespace {

// Decimals that show the times of pictures: exactly where few do, else to a fortieth of the time between two pictures. Steps of 0.125 are
// shown with three, thirtieths, which have no end, with three too.
int time_decimals(double start, double step) {
  for (int decimals = 0; decimals < 12; ++decimals) {
    double worst = 0.0;
    for (int k = 0; k <= 60; ++k) {
      const double x = (start + k * step) * std::pow(10.0, decimals);
      worst = std::max(worst, std::abs(x - std::round(x)));
    }
    if (worst < 1e-6 || worst * std::pow(10.0, -decimals) <= 0.025 * step) return decimals;
  }
  return 12;
}

}  // namespace

std::string time_text(double t, double step, double duration, double start) {
  struct Unit {
    double size;
    const char* name;
  };
  static constexpr Unit units[] = {{1.0, "s"}, {1e-3, "ms"}, {1e-6, "µs"}, {1e-9, "ns"}};
  Unit unit = units[0];
  for (const Unit& u : units) {
    unit = u;
    if (!(std::abs(duration) < 0.0999999 * u.size) || duration == 0.0) break;
  }
  const double shown = step > 0.0 ? step / unit.size : 1e-3;
  const int decimals = time_decimals(start / unit.size, shown);
  std::string text = fmt::format("{:.{}f}", t / unit.size, decimals);
  if (text[0] == '-') text = text.find_first_not_of("-0.") == std::string::npos ? text.substr(1) : "−" + text.substr(1);
  return "t = " + text + " " + unit.name;
}

std::string scale_text(double scale) {
  if (!(scale >= 1e4 && scale < 1e9) || scale != std::floor(scale)) return fmt::format("× {:g}", scale);
  // Thousands apart: 20 000.
  std::string digits = fmt::format("{:.0f}", scale);
  for (std::size_t at = digits.size(); at > 3; at -= 3) digits.insert(at - 3, "\u202f");
  return "× " + digits;
}

}  // namespace flexframe::render
