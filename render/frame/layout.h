// Where the words and diagrams of a picture go: measured, so that nothing is clipped and nothing lies over something else
// from 320 x 240 to 4k. What does not fit is shortened, then left out: legend first, then note, plots' axis words, ticks.
#pragma once

#include "render/frame/camera.h"
#include "render/frame/view.h"

#include <string>
#include <vector>

namespace flexframe::render {

// A line of text with its baseline's left end.
struct TextLine {
  std::string text;
  double x = 0.0, y = 0.0, size = 12.0;
  bool bold = false;
  bool faint = false;
};

struct Tick {
  double value = 0.0;  // shown number
  std::string text;
};

// Values at 1-2-5 steps in [lower, upper], at most `most`, with just the decimals they need; common power of ten taken out
// into `exponent` where numbers would get longer than five characters.
struct Ticks {
  std::vector<Tick> values;
  double step = 1.0;
  int exponent = 0;
};
Ticks make_ticks(double lower, double upper, int most);

struct BarLayout {
  PixelRect bar;                // of the colours
  std::vector<TextLine> words;  // label and numbers
  std::vector<double> ticks;    // y of the tick lines, pixels
  PixelRect panel;              // all of it
};

struct LegendLayout {
  std::vector<PixelRect> swatches;  // one an entry
  std::vector<TextLine> words;
  PixelRect panel;
};

struct PlotLayout {
  PixelRect panel, axes;
  int plot = 0;                                   // index in Overlay::plots
  double x0 = 0.0, x1 = 1.0, y0 = 0.0, y1 = 1.0;  // ranges
  std::vector<double> x_ticks, y_ticks;           // pixels
  std::vector<TextLine> words;
  TextLine y_label;              // reads upwards
  std::vector<TextLine> series;  // labels of the series, one each
  std::vector<PixelRect> series_lines;
};

struct Layout {
  double unit = 1.0;   // pixels of one pixel at 720 lines
  double text = 13.0;  // usual text size, px
  PixelRect scene;
  PixelRect inner;                   // the scene less the insets above and at the right: what several views share
  std::vector<PixelRect> views;      // one a view; without views the scene
  std::vector<PixelRect> magnified;  // one of Picture::insets each
  std::vector<TextLine> words;       // title, note, time, grid note, view labels
  int grid_word = -1;                // the grid note among them; drawn only where the grid is seen
  std::vector<PixelRect> panels;     // behind words, kept readable over the scene
  bool has_bar = false;
  BarLayout bar;
  bool has_legend = false;
  LegendLayout legend;
  std::vector<PlotLayout> plots;
  std::vector<glm::dvec2> triads;  // centres, px, one a view; empty: none
  double triad_radius = 0.0;
  Insets insets;
};

Layout make_layout(const Picture& picture);

}  // namespace flexframe::render
