// Diagrams: points and lines over logarithmic or linear axes, as SVG or as pixels.
//
// The diagram is laid out once into strokes, discs and words; SVG and PNG show the same. Sizes in pixels of the given width.
#pragma once

#include "render/film/flat.h"
#include "render/image/image.h"

#include <string>
#include <vector>

namespace flexframe::film {

struct DiagramPoint {
  double x = 0.0, y = 0.0;  // on a logarithmic axis > 0; others are left out
  bool hollow = false;      // at the floor: only an upper bound
  std::string label;        // beside the point, may be empty
};

struct DiagramSeries {
  std::string label;
  std::vector<DiagramPoint> points;
  bool line = true;    // joined in the order given
  bool front = false;  // the Pareto front: a broad grey line, no marks, a staircase
};

struct Diagram {
  std::string title, x_label, y_label, note;
  std::vector<DiagramSeries> series;
  double floor = 0.0;  // a dashed line: errors below it are not to be told; 0: none
  int width = 960, height = 600;
  bool linear_x = false, linear_y = false;
};

FlatDrawing diagram_drawing(const Diagram& diagram);
std::string diagram_svg(const Diagram& diagram);
render::Image diagram_image(const Diagram& diagram);

}  // namespace flexframe::film
