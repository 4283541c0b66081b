// Words, bars and plots of an animation's pictures.
#pragma once

#include "render/film/animation.h"

#include <string>
#include <utility>

namespace flexframe::film {

// Fills picture.overlay, scalar_map and background for the time t; the plots look at the animation's panels.
void fill_overlay(const Animation& animation, double t, render::Picture& picture);

// The unit a length is read best in, and the factor from m: {"mm", 1000}.
std::pair<std::string, double> length_unit(double largest);

}  // namespace flexframe::film
