// Words, bars and plots of an animation's pictures.
#pragma once

#include "render/film/animation.h"

#include <string>
#include <utility>

namespace flexframe::film {

// Fills picture.overlay, scalar_map and background for the time t; the plots look at the animation's panels.
void fill_overlay(const Animation& animation, double t, render::Picture& picture);

// The unit in which values up to `largest` (>= 0, in `unit`) are read best, and the factor to it: lengths down to nm ({"mm", 1000}),
// forces, moments, pressures, power and energy up to G ({"MPa", 1e-6}), from ten thousand on; of other units themselves and 1.
std::pair<std::string, double> readable_unit(const std::string& unit, double largest);

// A history of many samples, thinned so that every column of pixels keeps its extremes.
PlotSeries thin_series(const std::string& label, const sim::VecX& times, const sim::VecX& values);

}  // namespace flexframe::film
