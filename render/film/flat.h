// Flat drawings in pixels, as SVG and as an image alike: fills, lines, discs and words over white, in this order.
#pragma once

#include "render/image/image.h"

#include <glm/glm.hpp>

#include <array>
#include <string>
#include <vector>

namespace flexframe::film {

// What a drawing consists of, in pixels from the upper left corner; colours sRGB 0..1.
struct FlatFill {
  std::vector<glm::dvec2> points;  // of a polygon
  glm::vec3 color;
};
struct FlatStroke {
  std::vector<glm::dvec2> points;
  double width;
  glm::vec3 color;
  float opacity;
  double dash;  // 0: solid
};
struct FlatDisc {
  glm::dvec2 at;
  double radius;
  glm::vec3 color;
  bool hollow;
};
enum class FlatAnchor { left, middle, right };
struct FlatWord {
  glm::dvec2 at;  // of the baseline
  std::string text;
  double size;
  glm::vec3 color;
  FlatAnchor anchor;
  bool bold = false, upwards = false;
};
struct FlatDrawing {
  int width = 960, height = 600;
  std::vector<FlatFill> fills;
  std::vector<FlatStroke> strokes;
  std::vector<FlatDisc> discs;
  std::vector<FlatWord> words;

  void fill_box(double x, double y, double w, double h, const glm::vec3& color) {
    fills.push_back({{{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}}, color});
  }
};

std::string flat_svg(const FlatDrawing& drawing);
render::Image flat_image(const FlatDrawing& drawing);

// Colours that remain apart for colour-blind readers (Okabe, Ito 2008).
inline constexpr std::array<glm::vec3, 8> flat_palette = {
    glm::vec3(0.0f, 0.447f, 0.698f),   glm::vec3(0.835f, 0.369f, 0.0f), glm::vec3(0.0f, 0.620f, 0.451f), glm::vec3(0.8f, 0.475f, 0.655f),
    glm::vec3(0.337f, 0.706f, 0.914f), glm::vec3(0.902f, 0.624f, 0.0f), glm::vec3(0.35f, 0.35f, 0.35f),  glm::vec3(0.58f, 0.40f, 0.74f)};
inline constexpr glm::vec3 flat_ink(0.13f, 0.15f, 0.18f), flat_grey(0.55f, 0.58f, 0.62f), flat_faint(0.86f, 0.88f, 0.90f);

// An axis of numbers.
struct FlatAxis {
  double low = 0.0, high = 1.0;  // log10, linear: values
  bool linear = false;
  double mark(double value) const;                                              // log10 or the value
  double at(double value) const { return (mark(value) - low) / (high - low); }  // 0 at low, 1 at high
};
// A little more than all values from low to high; logarithmic: at least most of a decade.
FlatAxis flat_axis(double low, double high, bool linear);
// At most about ten: 1 (and 2, 5 where less than two decades are shown) of every decade, or steps of 1, 2 or 5.
std::vector<double> flat_ticks(const FlatAxis& axis);
std::string flat_tick_text(double value);

}  // namespace flexframe::film
