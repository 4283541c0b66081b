// Values beside probes and extremes: numbers as on the bar, of what is drawn.
#pragma once

#include "render/film/animation.h"

#include <array>

namespace flexframe::film {

// The smallest length of a vector that changes linearly over a triangle from corner to corner, and where: shares of the corners. Its
// largest length is that of a corner.
struct LeastWithin {
  double length = 0.0;
  std::array<double, 3> shares{};
};
LeastWithin least_within(const std::array<std::array<double, 6>, 3>& corners);

// Labels of the picture in memory, whose camera is aimed.
void add_labels(const Animation& animation, const SamplePlace& place, PictureMemory& memory);

}  // namespace flexframe::film
