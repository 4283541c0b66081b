// Dimensions of [render]: distances and angles between frames as lines with their value over the picture.
#pragma once

#include "render/film/animation.h"

#include <vector>

namespace flexframe::film {

// Finds the frames and chooses the unit and digits of each for the whole run. Throws sim::InputError for a frame that there is not.
void add_dimensions(Animation& animation, const sim::Scene* scene);

// What a fitted camera has to see of them, over the run.
void append_dimensions(const Animation& animation, std::vector<glm::dvec3>& points);

// Lines and values at a moment: values of the true motion, at the place where bodies are drawn.
void update_dimensions(const Animation& animation, const SamplePlace& now, render::Picture& picture);

}  // namespace flexframe::film
