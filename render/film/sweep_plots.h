// Diagrams of a sweep's table (sim/sweep/table.h), made of what its design shows: curves and contour maps of grids; histograms with
// quantiles and the matrix of scatter plots where values were drawn by chance; indices of sensitivity.
#pragma once

#include "render/film/flat.h"
#include "sim/sweep/sensitivity.h"

#include <filesystem>
#include <string>
#include <vector>

namespace flexframe::film {

struct SweepPlot {
  std::string name;   // of its files
  std::string title;  // above it on the page
  FlatDrawing drawing;
};

// A column of numbers of the table: a key or a response.
struct SweepColumn {
  std::string name;
  sim::VecX values;  // one a point; not a number where there is none
  bool logarithmic = false;
};
// "rod.length", "youngs_modulus": the last words of a key that tell it from the other keys of the design.
std::string short_key(const sim::Design& design, std::size_t axis);

// Keys of numbers, then responses.
std::vector<SweepColumn> sweep_columns(const sim::Sweep& sweep, const sim::SweepTable& table);

// All plots that the table has numbers for.
std::vector<SweepPlot> sweep_plots(const sim::Sweep& sweep, const sim::SweepTable& table, const std::vector<sim::Sensitivity>& indices);
std::vector<SweepPlot> sweep_scatter_plots(const sim::Sweep& sweep, const sim::SweepTable& table);

// Writes each plot as NAME.svg and NAME.png into the folder and all of them with a table of figures as report.html. Throws FileError.
void write_sweep_report(const sim::Sweep& sweep, const sim::SweepTable& table, const std::filesystem::path& folder);

}  // namespace flexframe::film
