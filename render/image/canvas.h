// Flat drawing on an image for overlays: rectangles, lines, discs, antialiased by their distance from the pixel's centre.
// Coordinates in pixels from the upper left corner of the image, y down; colours sRGB 0..1. Clipped to the image.
#pragma once

#include "render/image/image.h"

#include <glm/glm.hpp>

#include <span>
#include <vector>

namespace flexframe::render {

// color over the pixel with the given opacity; 3 or 4 channels (straight alpha). Mixed in sRGB: dark text stays dark.
void blend_pixel(Image& image, int x, int y, const glm::vec3& color, float opacity);

// What is drawn with: a colour is an opaque paint.
struct Paint {
  glm::vec3 color;
  float opacity;
  Paint(const glm::vec3& rgb, float share = 1.0f) : color(rgb), opacity(share) {}
};

// Rectangle from its upper left corner.
struct Box {
  double x, y, width, height;
  Box(double left, double top, double w, double h) : x(left), y(top), width(w), height(h) {}
};

// Corner radius in pixels.
void fill_rectangle(Image& image, const Box& box, const Paint& paint, double corner = 0.0);

// Frame of the given line width inside the rectangle.
void draw_frame(Image& image, const Box& box, double line, const Paint& paint);

// Round joins and ends; segments of one polyline do not darken each other. Points that are not finite interrupt it.
// dash: length of dashes and gaps in pixels, 0: solid. clip: x, y, width, height, null: the image.
void draw_polyline(Image& image, std::span<const glm::dvec2> points, double width, const Paint& paint, double dash = 0.0,
                   const glm::dvec4* clip = nullptr);

// Share of each pixel that a polyline covers: computed once, it may be drawn often. clip: x, y, width, height, null: the image.
struct LineCover {
  int x = 0, y = 0, width = 0, height = 0;  // pixels
  std::vector<float> values;
};
LineCover cover_polyline(int image_width, int image_height, std::span<const glm::dvec2> points, double width, double dash = 0.0,
                         const glm::dvec4* clip = nullptr);

// Draws the columns before x_end.
void blend_cover(Image& image, const LineCover& cover, const glm::vec3& color, float opacity, int x_end);

void fill_disc(Image& image, double x, double y, double radius, const glm::vec3& color, float opacity = 1.0f);

// Convex or not, even-odd rule, antialiased by 4 x 4 samples.
void fill_polygon(Image& image, std::span<const glm::dvec2> points, const glm::vec3& color, float opacity = 1.0f);

}  // namespace flexframe::render
