// The figure that a study leads with: how far the drawn vertices are off, over what it costs, and what one sees of it.
//
// It makes its own runs, a ladder of tolerances for each of a few settings (the scene's own method; vibrations followed exactly; half and
// twice the elements or modes), and measures them by the vertices of all pictures (vertex_errors.h) against a run of twice to four
// times the resolution whose own error is the difference of the last two of these.
#pragma once

#include "render/image/image.h"
#include "sim/scene/scene.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::film {

struct OverviewOptions {
  double seconds = 20.0;                 // CPU s that its runs may take in all
  std::function<void(double)> progress;  // 0..1; may throw to stop
};

struct OverviewPoint {
  std::string name;     // "dirk, 1e-05, twice the elements"
  std::string series;   // without the tolerance
  std::string command;  // words for the command line, as far as there are
  double tolerance = 0.0;
  double cpu_run = 0.0, cpu_pictures = 0.0;  // s: the simulation; map and drawing of all pictures
  double pixels = 0.0, percent = 0.0;        // largest distance of a vertex; of the largest way that one goes
  bool front = false;
  double cpu() const { return cpu_run + cpu_pictures; }
};

struct StudyOverview {
  std::vector<OverviewPoint> points;
  int recommended = -1;           // index: the cheapest that is right to half a pixel, else the best
  double reference_pixels = 0.0;  // its estimated error
  std::string reference;          // what it is, in words
  double map_pixels = 0.0;        // what the map from nodes to vertices takes besides, in every setting alike
  std::string map_body;           // where
  int pictures = 0;
  double motion_pixels = 0.0;         // the largest way of a vertex
  std::vector<std::string> left_out;  // in words
  render::Image figure;
};

// None where the scene has nothing to draw or no run comes to an end; why says so.
std::optional<StudyOverview> study_overview(const sim::Scene& scene, const OverviewOptions& options, std::string& why);

}  // namespace flexframe::film
