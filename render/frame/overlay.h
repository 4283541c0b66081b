// Private to the drawing: words, bars and diagrams onto the finished picture.
#pragma once

#include "render/frame/layout.h"
#include "render/frame/view.h"
#include "render/image/canvas.h"
#include "render/image/image.h"
#include "render/image/pdf_sheet.h"
#include "render/image/svg_sheet.h"

#include <span>
#include <vector>

namespace flexframe::render {

// Panels of plots without the running mark, kept from picture to picture while nothing else about them changes.
struct PlotCache {
  struct Panel {
    Plot plot;                              // without its mark; its series look at `data`
    std::vector<std::vector<double>> data;  // x and y of each series
    PixelRect panel, axes;
    Background background;
    bool dark = false;
    double unit = 0.0, text = 0.0;
    int channels = 3;
    Image image;
    std::vector<LineCover> lines;  // of each series
  };
  std::vector<Panel> panels;
};

// What the overlay needs to know of the scene below it.
struct SceneBelow {
  std::span<const ViewFrame> frames;  // one a view, then one an inset
  bool grid_seen = true;
  // By view: labels with a leader that point at something hidden by a surface; empty: none does.
  std::span<const std::vector<bool>> hidden{};
};

void draw_overlay(Image& image, const Picture& picture, const Layout& layout, const SceneBelow& below, PlotCache& cache);

// The same words, bars and diagrams at the same places as elements of a vector file.
void draw_overlay(SvgSheet& sheet, const Picture& picture, const Layout& layout, const SceneBelow& below);
void draw_overlay(PdfSheet& sheet, const Picture& picture, const Layout& layout, const SceneBelow& below);

}  // namespace flexframe::render
