// Flat drawing into an SVG file: the functions of canvas.h and text.h with a sheet in place of an image, so that words and diagrams can be
// drawn onto either. Same coordinates: pixels from the upper left corner, y down.
// Source: Scalable Vector Graphics (SVG) 1.1, Second Edition, W3C 2011.
#pragma once

#include "render/image/canvas.h"
#include "render/image/text.h"

#include <glm/glm.hpp>

#include <span>
#include <string>
#include <string_view>

namespace flexframe::render {

struct SvgSheet {
  int width = 0, height = 0;  // pixels
  std::string body;           // elements drawn so far
};

void fill_rectangle(SvgSheet& sheet, const Box& box, const Paint& paint, double corner = 0.0);
void draw_frame(SvgSheet& sheet, const Box& box, double line, const Paint& paint);

// clip: x, y, width, height; null: nothing is cut off.
void draw_polyline(SvgSheet& sheet, std::span<const glm::dvec2> points, double width, const Paint& paint, double dash = 0.0,
                   const glm::dvec4* clip = nullptr);
void fill_disc(SvgSheet& sheet, double x, double y, double radius, const glm::vec3& color, float opacity = 1.0f);
void fill_polygon(SvgSheet& sheet, std::span<const glm::dvec2> points, const glm::vec3& color, float opacity = 1.0f);

// Words stay words, as wide as in pixels whatever font the viewer has.
void draw_text(SvgSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint,
               Weight weight = Weight::regular);
void draw_text_rim(SvgSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const glm::vec3& color,
                   Weight weight = Weight::regular);
void draw_text_upwards(SvgSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint,
                       Weight weight = Weight::regular);

struct SvgPage {
  const Image* below = nullptr;  // pixels of the sheet's size under everything, held as PNG
  double dpi = 0.0;              // pixels an inch; the page then has a size in mm. 0: in pixels
  std::string note;              // comment at the head of the file; must not hold two hyphens in a row
};

// The whole file.
std::string svg_text(const SvgSheet& sheet, const SvgPage& page);

}  // namespace flexframe::render
