// A run as one HTML page that opens from disk in any browser with WebGL 2: the scene in three dimensions, playing, with the deformation
// scaled by a slider, colours to choose from (page_colors.h), plots, the summary of the run. Nothing is fetched from a network.
//
// Bodies are kept undeformed, with the shapes of their deformation (shape_basis.h) and weights over time, so that the browser deforms them;
// numbers are rounded to 16 bits (positions, shapes) or 8 bits (changes of normals). How far that is from what the pictures show is told.
#pragma once

#include "render/film/animation.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace flexframe::film {

struct PageReport {
  int pictures = 0, bodies = 0;
  std::size_t triangles = 0;
  double error = 0.0;               // m, largest distance of a vertex from where it is drawn, in scale
  double value_error = 0.0;         // of the colours, as a share of their range
  std::vector<std::string> colors;  // what bodies can be coloured by, as color_by says it
  std::vector<std::string> notes;
};

// scene: what make_animation was given. png: a still picture for browsers without WebGL; may be empty. The animation is as before.
// Throws FileError if the data are more than a browser takes (1 GiB).
std::string make_page(Animation& animation, const sim::Scene* scene, std::span<const std::uint8_t> png, PageReport& report);

}  // namespace flexframe::film
