#include "render/film/diagram.h"

#include "render/film/flat.h"
#include "render/image/text.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::film {
namespace {

using glm::dvec2;
using glm::vec3;

bool drawable(const Diagram& d, const DiagramPoint& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && (d.linear_x || p.x > 0.0) && (d.linear_y || p.y > 0.0);
}

FlatAxis axis_of(const Diagram& d, double DiagramPoint::*member) {
  const bool linear = member == &DiagramPoint::x ? d.linear_x : d.linear_y;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const DiagramSeries& s : d.series)
    for (const DiagramPoint& p : s.points)
      if (drawable(d, p)) low = std::min(low, p.*member), high = std::max(high, p.*member);
  if (!(low <= high)) return {-1.0, 1.0, linear};
  return flat_axis(low, high, linear);
}

FlatDrawing lay_out(const Diagram& d) {
  FlatDrawing out;
  out.width = d.width, out.height = d.height;
  // Room for the longest label, as far as the diagram keeps half of the width.
  double legend = 190.0;
  for (const DiagramSeries& s : d.series) legend = std::max(legend, 42.0 + render::text_width(s.label, 12.0, render::Weight::regular));
  legend = std::min(legend, 0.5 * d.width);
  const double left = 78.0, top = 46.0, bottom = d.note.empty() ? 54.0 : 74.0;
  const double width = d.width - left - legend - 16.0, height = d.height - top - bottom;
  const FlatAxis x = axis_of(d, &DiagramPoint::x), y = axis_of(d, &DiagramPoint::y);
  const auto place = [&](double px, double py) { return dvec2(left + width * x.at(px), top + height * (1.0 - y.at(py))); };

  // Grid and ticks.
  for (double t : flat_ticks(x)) {
    const double at = left + width * x.at(t);
    out.strokes.push_back({{{at, top}, {at, top + height}}, 1.0, flat_faint, 1.0f, 0.0});
    out.words.push_back({{at, top + height + 18.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::middle});
  }
  for (double t : flat_ticks(y)) {
    const double at = top + height * (1.0 - y.at(t));
    out.strokes.push_back({{{left, at}, {left + width, at}}, 1.0, flat_faint, 1.0f, 0.0});
    out.words.push_back({{left - 8.0, at + 4.0}, flat_tick_text(t), 12.0, flat_ink, FlatAnchor::right});
  }
  out.strokes.push_back({{{left, top}, {left, top + height}, {left + width, top + height}}, 1.2, flat_ink, 1.0f, 0.0});
  out.words.push_back({{left, 28.0}, d.title, 17.0, flat_ink, FlatAnchor::left, true});
  out.words.push_back({{left + 0.5 * width, top + height + 40.0}, d.x_label, 13.0, flat_ink, FlatAnchor::middle});
  out.words.push_back({{20.0, top + 0.5 * height}, d.y_label, 13.0, flat_ink, FlatAnchor::middle, false, true});
  if (!d.note.empty()) out.words.push_back({{left, static_cast<double>(d.height) - 12.0}, d.note, 12.0, flat_grey, FlatAnchor::left});
  if (d.floor > 0.0 && y.at(d.floor) > 0.0 && y.at(d.floor) < 1.0) {
    const double at = top + height * (1.0 - y.at(d.floor));
    out.strokes.push_back({{{left, at}, {left + width, at}}, 1.0, flat_grey, 1.0f, 5.0});
    out.words.push_back({{left + width - 4.0, at - 5.0}, "error of the reference", 11.0, flat_grey, FlatAnchor::right});
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
      out.words.push_back({at + shift, text, 11.0, flat_ink, FlatAnchor::left});
      return;
    }
  };

  // Series: the front below all others.
  size_t color = 0;
  double legend_at = top + 10.0;
  std::vector<FlatStroke> lines;
  for (const DiagramSeries& s : d.series) {
    const vec3 c = s.front ? vec3(0.70f) : flat_palette[color % flat_palette.size()];
    FlatStroke stroke{{}, s.front ? 7.0 : 1.8, c, s.front ? 0.55f : 0.9f, 0.0};
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
    out.words.push_back({{swatch + 30.0, legend_at + 4.0}, s.label, 12.0, flat_ink, FlatAnchor::left});
    legend_at += 20.0;
  }
  out.strokes.insert(out.strokes.end(), lines.begin(), lines.end());
  return out;
}

}  // namespace

FlatDrawing diagram_drawing(const Diagram& d) { return lay_out(d); }
std::string diagram_svg(const Diagram& d) { return flat_svg(lay_out(d)); }
render::Image diagram_image(const Diagram& d) { return flat_image(lay_out(d)); }

}  // namespace flexframe::film
