#include "render/film/flat.h"

#include "render/base/html.h"
#include "render/image/canvas.h"
#include "render/image/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::film {

using glm::dvec2;
using glm::vec3;

namespace {

std::string svg_color(const vec3& c) {
  const auto byte = [](float v) { return static_cast<int>(std::lround(255.0f * v)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(c.x), byte(c.y), byte(c.z));
}

}  // namespace

double FlatAxis::mark(double value) const { return linear ? value : std::log10(value); }

FlatAxis flat_axis(double low, double high, bool linear) {
  FlatAxis a{0.0, 1.0, linear};
  a.low = a.mark(low), a.high = a.mark(high);
  if (linear) {
    const double room = a.high > a.low ? 0.04 * (a.high - a.low) : std::max(0.1 * std::abs(a.high), 1e-12);
    return {a.low - room, a.high + room, true};
  }
  const double middle = 0.5 * (a.low + a.high), half = std::max(0.5 * (a.high - a.low), 0.4);
  return {middle - 1.08 * half - 0.05, middle + 1.08 * half + 0.05, false};
}

std::string flat_tick_text(double value) {
  if (value == 0.0 || (std::abs(value) >= 0.0099 && std::abs(value) < 9999.0)) return fmt::format("{:g}", value);
  // As many digits as the value has: 1e-03, 9.5e-03.
  std::string text = fmt::format("{:.5e}", value);
  const std::size_t power = text.find('e'), last = text.find_last_not_of("0", power - 1);
  const std::size_t kept = text[last] == '.' ? last : last + 1;
  return text.erase(kept, power - kept);
}

std::vector<double> flat_ticks(const FlatAxis& a) {
  std::vector<double> out;
  if (a.linear) {
    // Steps of 1, 2 or 5, at most ten of them.
    double step = std::pow(10.0, std::floor(std::log10(a.high - a.low)) - 1.0);
    for (const double factor : {1.0, 2.0, 2.5, 2.0, 2.0}) {
      if (factor > 1.0 || (a.high - a.low) / step <= 10.0) step *= factor;
      if ((a.high - a.low) / step <= 10.0) break;
    }
    const double first = std::ceil(a.low / step - 1e-9), last = std::floor(a.high / step + 1e-9);
    for (int k = 0; first + k <= last; ++k) out.push_back(step * (first + k));
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

std::string flat_svg(const FlatDrawing& drawing) {
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" font-family=\"DejaVu Sans, "
      "sans-serif\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      drawing.width, drawing.height);
  for (const FlatFill& f : drawing.fills) {
    out += "<polygon shape-rendering=\"crispEdges\" points=\"";
    for (const dvec2& p : f.points) out += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
    out += fmt::format("\" fill=\"{}\"/>\n", svg_color(f.color));
  }
  for (const FlatStroke& s : drawing.strokes) {
    out += "<polyline fill=\"none\" stroke-linejoin=\"round\" points=\"";
    for (const dvec2& p : s.points) out += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
    out += fmt::format("\" stroke=\"{}\" stroke-width=\"{:g}\" stroke-opacity=\"{:g}\"{}/>\n", svg_color(s.color), s.width, s.opacity,
                       s.dash > 0.0 ? fmt::format(" stroke-dasharray=\"{0:g} {0:g}\"", s.dash) : "");
  }
  for (const FlatDisc& c : drawing.discs)
    out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:g}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", c.at.x, c.at.y,
                       c.radius, c.hollow ? "#ffffff" : svg_color(c.color), svg_color(c.color));
  for (const FlatWord& w : drawing.words) {
    const char* anchor = w.anchor == FlatAnchor::left ? "start" : w.anchor == FlatAnchor::middle ? "middle" : "end";
    const std::string turn = w.upwards ? fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", w.at.x, w.at.y) : "";
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:g}\" text-anchor=\"{}\" fill=\"{}\"{}{}>{}</text>\n", w.at.x, w.at.y,
                       w.size, anchor, svg_color(w.color), w.bold ? " font-weight=\"bold\"" : "", turn, render::escape_html(w.text));
  }
  return out + "</svg>\n";
}

render::Image flat_image(const FlatDrawing& drawing) {
  render::Image image = render::make_image(drawing.width, drawing.height, 3, 255);
  for (const FlatFill& f : drawing.fills) render::fill_polygon(image, f.points, f.color);
  for (const FlatStroke& s : drawing.strokes) render::draw_polyline(image, s.points, s.width, {s.color, s.opacity}, s.dash);
  for (const FlatDisc& c : drawing.discs) {
    render::fill_disc(image, c.at.x, c.at.y, c.radius + 0.75, c.color);
    if (c.hollow) render::fill_disc(image, c.at.x, c.at.y, c.radius - 0.75, vec3(1.0f));
  }
  for (const FlatWord& w : drawing.words) {
    const render::Weight weight = w.bold ? render::Weight::bold : render::Weight::regular;
    const double width = render::text_width(w.text, w.size, weight);
    const double back = w.anchor == FlatAnchor::left ? 0.0 : w.anchor == FlatAnchor::middle ? 0.5 * width : width;
    if (w.upwards) render::draw_text_upwards(image, {w.at.x, w.at.y + back}, w.text, w.size, w.color, weight);
    else render::draw_text(image, {w.at.x - back, w.at.y}, w.text, w.size, w.color, weight);
  }
  return image;
}

}  // namespace flexframe::film
