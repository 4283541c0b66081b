#include "render/film/diagram.h"

#include "render/base/html.h"
#include "render/image/canvas.h"
#include "render/image/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace flexframe::film {
namespace {

using glm::dvec2;
using glm::vec3;

// What a diagram consists of, in pixels from the upper left corner.
struct Stroke {
  std::vector<dvec2> points;
  double width;
  vec3 color;
  float opacity;
  double dash;
};
struct Disc {
  dvec2 at;
  double radius;
  vec3 color;
  bool hollow;
};
enum class Anchor { left, middle, right };
struct Word {
  dvec2 at;
  std::string text;
  double size;
  vec3 color;
  Anchor anchor;
  bool bold = false, upwards = false;
};
struct Drawing {
  std::vector<Stroke> strokes;
  std::vector<Disc> discs;
  std::vector<Word> words;
};

// Colours that remain apart for colour-blind readers (Okabe, Ito 2008).
constexpr std::array<vec3, 8> palette = {vec3(0.0f, 0.447f, 0.698f), vec3(0.835f, 0.369f, 0.0f),   vec3(0.0f, 0.620f, 0.451f),
                                         vec3(0.8f, 0.475f, 0.655f), vec3(0.337f, 0.706f, 0.914f), vec3(0.902f, 0.624f, 0.0f),
                                         vec3(0.35f, 0.35f, 0.35f),  vec3(0.58f, 0.40f, 0.74f)};
constexpr vec3 ink(0.13f, 0.15f, 0.18f), grey(0.55f, 0.58f, 0.62f), faint(0.86f, 0.88f, 0.90f);

// Range of decades, at least one, or of values, with a little room.
struct Axis {
  double low = 0.0, high = 1.0;  // log10, linear: values
  bool linear = false;
  double mark(double value) const { return linear ? value : std::log10(value); }
  double at(double value) const { return (mark(value) - low) / (high - low); }
};

bool drawable(const Diagram& d, const DiagramPoint& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && (d.linear_x || p.x > 0.0) && (d.linear_y || p.y > 0.0);
}

Axis axis_of(const Diagram& d, double DiagramPoint::*member) {
  Axis a{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
         member == &DiagramPoint::x ? d.linear_x : d.linear_y};
  for (const DiagramSeries& s : d.series)
    for (const DiagramPoint& p : s.points)
      if (drawable(d, p)) a.low = std::min(a.low, a.mark(p.*member)), a.high = std::max(a.high, a.mark(p.*member));
  if (!(a.low <= a.high)) return {-1.0, 1.0, a.linear};
  if (a.linear) {
    const double room = a.high > a.low ? 0.04 * (a.high - a.low) : std::max(0.1 * std::abs(a.high), 1e-12);
    return {a.low - room, a.high + room, true};
  }
  const double middle = 0.5 * (a.low + a.high), half = std::max(0.5 * (a.high - a.low), 0.4);
  return {middle - 1.08 * half - 0.05, middle + 1.08 * half + 0.05, false};
}

std::string tick_text(double value) {
  if (value == 0.0 || (std::abs(value) >= 0.0099 && std::abs(value) < 9999.0)) return fmt::format("{:g}", value);
  return fmt::format("{:.0e}", value);
}

// Ticks at 1 (and 2, 5 where less than two decades are shown) of every decade.
std::vector<double> ticks(const Axis& a) {
  std::vector<double> out;
  if (a.linear) {
    // Steps of 1, 2 or 5, at most ten of them.
    double step = std::pow(10.0, std::floor(std::log10(a.high - a.low)) - 1.0);
    for (const double factor : {1.0, 2.0, 2.5, 2.0, 2.0}) {
      if (factor > 1.0 || (a.high - a.low) / step <= 10.0) step *= factor;
      if ((a.high - a.low) / step <= 10.0) break;
    }
    for (double value = step * std::ceil(a.low / step); value <= a.high; value += step)
      out.push_back(std::abs(value) < 1e-9 * step ? 0.0 : value);
    return out;
  }
  const bool dense = a.high - a.low < 2.0;
  for (int e = static_cast<int>(std::floor(a.low)); e <= static_cast<int>(std::ceil(a.high)); ++e)
    for (double m : {1.0, 2.0, 5.0}) {
      if (m > 1.0 && !dense) continue;
      const double value = m * std::pow(10.0, e);
      if (a.at(value) >= 0.0 && a.at(value) <= 1.0) out.push_back(value);
    }
  return out;
}

Drawing lay_out(const Diagram& d) {
  Drawing out;
  const double legend = 190.0, left = 78.0, top = 46.0, bottom = d.note.empty() ? 54.0 : 74.0;
  const double width = d.width - left - legend - 16.0, height = d.height - top - bottom;
  const Axis x = axis_of(d, &DiagramPoint::x), y = axis_of(d, &DiagramPoint::y);
  const auto place = [&](double px, double py) { return dvec2(left + width * x.at(px), top + height * (1.0 - y.at(py))); };

  // Grid and ticks.
  for (double t : ticks(x)) {
    const double at = left + width * x.at(t);
    out.strokes.push_back({{{at, top}, {at, top + height}}, 1.0, faint, 1.0f, 0.0});
    out.words.push_back({{at, top + height + 18.0}, tick_text(t), 12.0, ink, Anchor::middle});
  }
  for (double t : ticks(y)) {
    const double at = top + height * (1.0 - y.at(t));
    out.strokes.push_back({{{left, at}, {left + width, at}}, 1.0, faint, 1.0f, 0.0});
    out.words.push_back({{left - 8.0, at + 4.0}, tick_text(t), 12.0, ink, Anchor::right});
  }
  out.strokes.push_back({{{left, top}, {left, top + height}, {left + width, top + height}}, 1.2, ink, 1.0f, 0.0});
  out.words.push_back({{left, 28.0}, d.title, 17.0, ink, Anchor::left, true});
  out.words.push_back({{left + 0.5 * width, top + height + 40.0}, d.x_label, 13.0, ink, Anchor::middle});
  out.words.push_back({{20.0, top + 0.5 * height}, d.y_label, 13.0, ink, Anchor::middle, false, true});
  if (!d.note.empty()) out.words.push_back({{left, static_cast<double>(d.height) - 12.0}, d.note, 12.0, grey, Anchor::left});
  if (d.floor > 0.0 && y.at(d.floor) > 0.0 && y.at(d.floor) < 1.0) {
    const double at = top + height * (1.0 - y.at(d.floor));
    out.strokes.push_back({{{left, at}, {left + width, at}}, 1.0, grey, 1.0f, 5.0});
    out.words.push_back({{left + width - 4.0, at - 5.0}, "error of the reference", 11.0, grey, Anchor::right});
  }

  // Labels lie where no other does, right or left of their point, above or below; where there is no room, the point goes without.
  struct Box {
    double left, top, right, bottom;
  };
  std::vector<Box> taken;
  const auto label = [&](const dvec2& at, const std::string& text) {
    const double wide = render::text_width(text, 11.0, render::Weight::regular);
    for (const dvec2 shift : {dvec2(7.0, -6.0), dvec2(7.0, 13.0), dvec2(-7.0 - wide, -6.0), dvec2(-7.0 - wide, 13.0)}) {
      const Box b{at.x + shift.x, at.y + shift.y - 9.0, at.x + shift.x + wide, at.y + shift.y + 1.0};
      if (std::any_of(taken.begin(), taken.end(),
                      [&](const Box& o) { return b.left < o.right && o.left < b.right && b.top < o.bottom && o.top < b.bottom; }))
        continue;
      taken.push_back(b);
      out.words.push_back({at + shift, text, 11.0, ink, Anchor::left});
      return;
    }
  };

  // Series: the front below all others.
  size_t color = 0;
  double legend_at = top + 10.0;
  std::vector<Stroke> lines;
  for (const DiagramSeries& s : d.series) {
    const vec3 c = s.front ? vec3(0.70f) : palette[color % palette.size()];
    Stroke stroke{{}, s.front ? 7.0 : 1.8, c, s.front ? 0.55f : 0.9f, 0.0};
    for (const DiagramPoint& p : s.points) {
      if (!drawable(d, p)) continue;
      const dvec2 at = place(p.x, p.y);
      if (s.front && !stroke.points.empty()) stroke.points.push_back({at.x, stroke.points.back().y});
      stroke.points.push_back(at);
      if (s.front) continue;
      out.discs.push_back({at, 4.2, c, p.hollow});
      if (!p.label.empty()) label(at, p.label);
    }
    if ((s.line || s.front) && stroke.points.size() > 1) (s.front ? out.strokes : lines).push_back(stroke);
    const double swatch = left + width + 18.0;
    if (s.front) out.strokes.push_back({{{swatch, legend_at}, {swatch + 22.0, legend_at}}, 7.0, c, 0.55f, 0.0});
    else {
      if (s.line) out.strokes.push_back({{{swatch, legend_at}, {swatch + 22.0, legend_at}}, 1.8, c, 0.9f, 0.0});
      out.discs.push_back({{swatch + 11.0, legend_at}, 4.2, c, false});
      ++color;
    }
    out.words.push_back({{swatch + 30.0, legend_at + 4.0}, s.label, 12.0, ink, Anchor::left});
    legend_at += 20.0;
  }
  out.strokes.insert(out.strokes.end(), lines.begin(), lines.end());
  return out;
}

std::string svg_color(const vec3& c) {
  const auto byte = [](float v) { return static_cast<int>(std::lround(255.0f * v)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(c.x), byte(c.y), byte(c.z));
}

}  // namespace

std::string diagram_svg(const Diagram& d) {
  const Drawing drawing = lay_out(d);
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" font-family=\"DejaVu Sans, "
      "sans-serif\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      d.width, d.height);
  for (const Stroke& s : drawing.strokes) {
    out += "<polyline fill=\"none\" stroke-linejoin=\"round\" points=\"";
    for (const dvec2& p : s.points) out += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
    out += fmt::format("\" stroke=\"{}\" stroke-width=\"{:g}\" stroke-opacity=\"{:g}\"{}/>\n", svg_color(s.color), s.width, s.opacity,
                       s.dash > 0.0 ? fmt::format(" stroke-dasharray=\"{0:g} {0:g}\"", s.dash) : "");
  }
  for (const Disc& c : drawing.discs)
    out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:g}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", c.at.x, c.at.y,
                       c.radius, c.hollow ? "#ffffff" : svg_color(c.color), svg_color(c.color));
  for (const Word& w : drawing.words) {
    const char* anchor = w.anchor == Anchor::left ? "start" : w.anchor == Anchor::middle ? "middle" : "end";
    const std::string turn = w.upwards ? fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", w.at.x, w.at.y) : "";
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:g}\" text-anchor=\"{}\" fill=\"{}\"{}{}>{}</text>\n", w.at.x, w.at.y,
                       w.size, anchor, svg_color(w.color), w.bold ? " font-weight=\"bold\"" : "", turn, render::escape_html(w.text));
  }
  return out + "</svg>\n";
}

render::Image diagram_image(const Diagram& d) {
  const Drawing drawing = lay_out(d);
  render::Image image = render::make_image(d.width, d.height, 3, 255);
  for (const Stroke& s : drawing.strokes) render::draw_polyline(image, s.points, s.width, {s.color, s.opacity}, s.dash);
  for (const Disc& c : drawing.discs) {
    render::fill_disc(image, c.at.x, c.at.y, c.radius + 0.75, c.color);
    if (c.hollow) render::fill_disc(image, c.at.x, c.at.y, c.radius - 0.75, vec3(1.0f));
  }
  for (const Word& w : drawing.words) {
    const render::Weight weight = w.bold ? render::Weight::bold : render::Weight::regular;
    const double width = render::text_width(w.text, w.size, weight);
    const double back = w.anchor == Anchor::left ? 0.0 : w.anchor == Anchor::middle ? 0.5 * width : width;
    if (w.upwards) render::draw_text_upwards(image, {w.at.x, w.at.y + back}, w.text, w.size, w.color, weight);
    else render::draw_text(image, {w.at.x - back, w.at.y}, w.text, w.size, w.color, weight);
  }
  return image;
}

}  // namespace flexframe::film
