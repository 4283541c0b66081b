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

// Corner radius in pixels.
void fill_rectangle(Image& image, double x, double y, double width, double height, const glm::vec3& color, float opacity = 1.0f,
                    double corner = 0.0);

// Frame of the given line width inside the rectangle.
void draw_frame(Image& image, double x, double y, double width, double height, double line, const glm::vec3& color, float opacity = 1.0f);

// Round joins and ends; segments of one polyline do not darken each other. Points that are not finite interrupt it.
// dash: length of dashes and gaps in pixels, 0: solid. clip: x, y, width, height, null: the image.
void draw_polyline(Image& image, std::span<const glm::dvec2> points, double width, const glm::vec3& color, float opacity = 1.0f,
                   double dash = 0.0, const glm::dvec4* clip = nullptr);

// Share of each pixel that a polyline covers: computed once, it may be drawn often.
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
