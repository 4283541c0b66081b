// Text in pictures: DejaVu Sans through stb_truetype, crisp from 9 pixels up.
//
// The font is looked for in $FLEXFRAME_FONT (a file, or a folder with DejaVuSans.ttf and DejaVuSans-Bold.ttf), then in the
// usual places of the Debian package fonts-dejavu-core and of other systems; FileError lists the places if there
// is none. Characters that it lacks come from the first fallback font that has them (fonts-droid-fallback, fonts-wqy-*, fonts-noto-cjk,
// fonts-arphic-*, $FLEXFRAME_FONT_FALLBACK); what no font has is drawn as a box. Text is UTF-8. Sizes are the em in pixels.
#pragma once

#include "render/image/canvas.h"

#include <glm/glm.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace flexframe::render {

enum class Weight { regular, bold };

// Advance width in pixels.
double text_width(std::string_view text, double size, Weight weight = Weight::regular);

// Height of capital letters and digits above the baseline, and depth of descenders below it.
double cap_height(double size);
double descent(double size);

// Longest beginning of the text that fits, with an ellipsis if something was cut off.
std::string fit_text(std::string_view text, double size, double width, Weight weight = Weight::regular);

// Draws with the left end of the baseline at a point, pixels from the upper left; what lies outside is clipped.
void draw_text(Image& image, const glm::dvec2& at, std::string_view text, double size, const Paint& paint, Weight weight = Weight::regular);

// A rim around the same words, a ninth of the size wide: drawn first, it keeps them readable over anything.
void draw_text_rim(Image& image, const glm::dvec2& at, std::string_view text, double size, const glm::vec3& color,
                   Weight weight = Weight::regular);

// The outline of words, closed shapes one after the other: each begins with a move; filled by the non-zero rule they are the letters.
struct OutlineStep {
  enum Kind { move, line, curve } kind = move;
  glm::dvec2 to{0.0}, first{0.0}, second{0.0};  // pixels from the left end of the baseline, y down; handles of a cubic curve
};
std::vector<OutlineStep> text_outline(std::string_view text, double size, Weight weight = Weight::regular);

// Characters of the text that no font here has, as UTF-8; empty: all are there.
std::string missing_characters(std::string_view text);

// The same as draw_text turned a quarter counterclockwise: reads upwards from the point.
void draw_text_upwards(Image& image, const glm::dvec2& at, std::string_view text, double size, const Paint& paint,
                       Weight weight = Weight::regular);

}  // namespace flexframe::render
