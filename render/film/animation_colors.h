// What the colours of bodies mean: their range over the whole sequence, the bar's unit, and what has to be said of them.
#pragma once

#include "render/film/animation.h"
#include "render/film/survey.h"

#include <vector>

namespace flexframe::film {

// Whether some body has a yield stress, so that colours by stress are shares of it.
bool shares_of_yield(const std::vector<BodyModel>& bodies);

// Sets map and bar of `animation` by the values of the surveyed moments; warnings and notes tell of what is left out, of what is no more
// than rounding, and of values that the samples cannot give. Throws sim::InputError where [render] color_range.window holds no moment.
void set_colors(Animation& animation, const Survey& survey);

// Marks the bodies whose faces are too coarse to colour them by what their corners have, at the moment when that is largest.
void mark_coarse(Animation& animation, const Survey& survey);

}  // namespace flexframe::film
