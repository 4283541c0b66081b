#include "render/image/svg_sheet.h"

#include "render/base/base64.h"
#include "render/base/html.h"
#include "render/base/srgb.h"
#include "render/image/png.h"

#include <fmt/format.h>

#include <cmath>

namespace flexframe::render {
namespace {

std::string hex(const glm::vec3& color) {
  const auto part = [](float v) { return rounded(255.0f * std::min(std::max(v, 0.0f), 1.0f)); };
  return fmt::format("#{:02x}{:02x}{:02x}", part(color.x), part(color.y), part(color.z));
}

// `kind`: fill or stroke.
std::string paint_words(const char* kind, const glm::vec3& color, float opacity) {
  return opacity < 1.0f ? fmt::format("{0}=\"{1}\" {0}-opacity=\"{2:.3g}\"", kind, hex(color), std::max(0.0f, opacity))
                        : fmt::format("{}=\"{}\"", kind, hex(color));
}

std::string text_element(std::string_view text, double size, Weight weight, const std::string& place, const std::string& paint) {
  // XML has no place for control characters; in the pixels they are spaces, too.
  std::string shown(text);
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 32) c = ' ';
  return fmt::format("<text {} font-size=\"{:.2f}\"{} textLength=\"{:.2f}\" lengthAdjust=\"spacingAndGlyphs\" {}>{}</text>\n", place, size,
                     weight == Weight::bold ? " font-weight=\"bold\"" : "", text_width(text, size, weight), paint, escape_html(shown));
}

std::string at_words(const glm::dvec2& at) { return fmt::format("x=\"{:.2f}\" y=\"{:.2f}\"", at.x, at.y); }

}  // namespace

void fill_rectangle(SvgSheet& sheet, const Box& box, const Paint& paint, double corner) {
  if (!(box.width > 0.0 && box.height > 0.0)) return;
  sheet.body +=
      fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\"{} {}/>\n", box.x, box.y, box.width, box.height,
                  corner > 0.0 ? fmt::format(" rx=\"{:.2f}\"", corner) : "", paint_words("fill", paint.color, paint.opacity));
}

void draw_frame(SvgSheet& sheet, const Box& box, double line, const Paint& paint) {
  sheet.body += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"none\" stroke-width=\"{:.2f}\" {}/>\n", box.x + 0.5 * line,
      box.y + 0.5 * line, box.width - line, box.height - line, line, paint_words("stroke", paint.color, paint.opacity));
}

void draw_polyline(SvgSheet& sheet, std::span<const glm::dvec2> points, double width, const Paint& paint, double dash,
                   const glm::dvec4* clip) {
  // Points that are not finite interrupt it; a piece of one point is a dot.
  std::string path;
  bool open = false;
  glm::dvec2 last(0.0);
  for (const glm::dvec2& p : points) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      open = false;
      continue;
    }
    // Far outside, numbers would only get long.
    const glm::dvec2 q = glm::clamp(p, glm::dvec2(-1e5), glm::dvec2(1e5));
    if (open && glm::length(q - last) < 0.05 && &p != &points.back()) continue;
    path += fmt::format("{}{:.2f} {:.2f}", open ? "L" : "M", q.x, q.y);
    open = true;
    last = q;
  }
  if (path.empty()) return;
  if (clip)
    sheet.body +=
        fmt::format("<svg x=\"{0:.2f}\" y=\"{1:.2f}\" width=\"{2:.2f}\" height=\"{3:.2f}\" viewBox=\"{0:.2f} {1:.2f} {2:.2f} {3:.2f}\">",
                    clip->x, clip->y, clip->z, clip->w);
  sheet.body += fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke-width=\"{:.2f}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"{} {}/>", path, width,
      dash > 0.0 ? fmt::format(" stroke-dasharray=\"{:.2f}\"", dash) : "", paint_words("stroke", paint.color, paint.opacity));
  sheet.body += clip ? "</svg>\n" : "\n";
}

void fill_disc(SvgSheet& sheet, double x, double y, double radius, const glm::vec3& color, float opacity) {
  sheet.body += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" {}/>\n", x, y, radius, paint_words("fill", color, opacity));
}

void fill_polygon(SvgSheet& sheet, std::span<const glm::dvec2> points, const glm::vec3& color, float opacity) {
  std::string places;
  for (const glm::dvec2& p : points) places += fmt::format("{}{:.2f},{:.2f}", places.empty() ? "" : " ", p.x, p.y);
  sheet.body += fmt::format("<polygon points=\"{}\" fill-rule=\"evenodd\" {}/>\n", places, paint_words("fill", color, opacity));
}

void draw_text(SvgSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint, Weight weight) {
  if (text.empty()) return;
  sheet.body += text_element(text, size, weight, at_words(at), paint_words("fill", paint.color, paint.opacity));
}

void draw_text_rim(SvgSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const glm::vec3& color, Weight weight) {
  if (text.empty()) return;
  sheet.body += text_element(text, size, weight, at_words(at),
                             fmt::format("{} {} stroke-width=\"{:.2f}\" stroke-linejoin=\"round\"", paint_words("fill", color, 1.0f),
                                         paint_words("stroke", color, 1.0f), size / 4.5));
}

void draw_text_upwards(SvgSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint, Weight weight) {
  if (text.empty()) return;
  sheet.body += text_element(text, size, weight, fmt::format("transform=\"translate({:.2f} {:.2f}) rotate(-90)\"", at.x, at.y),
                             paint_words("fill", paint.color, paint.opacity));
}

std::string svg_text(const SvgSheet& sheet, const SvgPage& page) {
  const auto length = [&](int pixels) {
    return page.dpi > 0.0 ? fmt::format("{:.3f}mm", 25.4 * pixels / page.dpi) : std::to_string(pixels);
  };
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  if (!page.note.empty()) out += fmt::format("<!-- {} -->\n", page.note);
  out += fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {} "
      "{}\" font-family=\"DejaVu Sans, Verdana, sans-serif\">\n",
      length(sheet.width), length(sheet.height), sheet.width, sheet.height);
  if (page.below)
    out += fmt::format("<image width=\"{}\" height=\"{}\" xlink:href=\"data:image/png;base64,{}\"/>\n", page.below->width,
                       page.below->height, base64(encode_png(*page.below, {.level = 6, .text = {}})));
  return out + sheet.body + "</svg>\n";
}

}  // namespace flexframe::render
