// Flat drawing into a PDF file of one page: the functions of canvas.h and text.h with a sheet in place of an image, as svg_sheet.h has
// them. Same coordinates: pixels from the upper left corner, y down.
// Source: Document management, Portable document format, Part 1: PDF 1.7, ISO 32000-1:2008; the file itself is PDF 1.4.
#pragma once

#include "render/image/canvas.h"
#include "render/image/text.h"

#include <glm/glm.hpp>

#include <set>
#include <span>
#include <string>
#include <string_view>

namespace flexframe::render {

struct PdfSheet {
  int width = 0, height = 0;  // pixels
  std::string body;           // operators drawn so far
  std::set<int> opacities;    // used, in per mille
};

void fill_rectangle(PdfSheet& sheet, const Box& box, const Paint& paint, double corner = 0.0);
void draw_frame(PdfSheet& sheet, const Box& box, double line, const Paint& paint);

// clip: x, y, width, height; null: nothing is cut off.
void draw_polyline(PdfSheet& sheet, std::span<const glm::dvec2> points, double width, const Paint& paint, double dash = 0.0,
                   const glm::dvec4* clip = nullptr);
void fill_disc(PdfSheet& sheet, double x, double y, double radius, const glm::vec3& color, float opacity = 1.0f);
void fill_polygon(PdfSheet& sheet, std::span<const glm::dvec2> points, const glm::vec3& color, float opacity = 1.0f);

// Words are outlines of their letters: the page looks the same wherever it is shown, without any font.
void draw_text(PdfSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint,
               Weight weight = Weight::regular);
void draw_text_rim(PdfSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const glm::vec3& color,
                   Weight weight = Weight::regular);
void draw_text_upwards(PdfSheet& sheet, const glm::dvec2& at, std::string_view text, double size, const Paint& paint,
                       Weight weight = Weight::regular);

struct PdfPage {
  const Image* below = nullptr;  // pixels of the sheet's size under everything
  double dpi = 0.0;              // pixels an inch of the page; 0: 96
  std::string note;              // comment in the second line of the file; one line
};

// The bytes of the whole file.
std::string pdf_text(const PdfSheet& sheet, const PdfPage& page);

}  // namespace flexframe::render
