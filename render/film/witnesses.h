// Places of bodies by which pictures are judged: what a simulation is asked to keep of them, and what the pictures show of their errors.
#pragma once

#include "render/film/animation.h"
#include "sim/accuracy/settings_memory.h"
#include "sim/scene/scene.h"

#include <string>
#include <vector>

namespace flexframe::film {

// A place of a body that the simulation is asked to keep: its position in the world; where its body is exaggerated, its displacement in the
// body frame; where its body is elastic, its rotation against the root.
struct Witness {
  sim::OutputDef output;
  double allowed = 0.0;    // m, of a rotation rad
  double drawn = 1.0;      // times as large it is drawn
  glm::dvec2 beside{0.0};  // m, of a rotation: how far what is drawn lies from the axis, along y and z of the sections
  size_t body = 0;         // of the animation
  std::string place;
};

// What the names of witnesses' outputs begin with, and so the columns.
inline constexpr const char* witness_prefix = "picture(";

// All that is asked of the simulation; frames that it needs are added to the scene. pixels: whether `allowed` is px, else m.
std::vector<Witness> witnesses(sim::Scene& scene, const Animation& animation, bool pixels, double allowed);

// The largest of the errors as pictures show it, px (or m): errors of a place add up, along the axes of the world, and are seen from the
// pictures' cameras at their times. errors: of a run with the witnesses' outputs of these sizes (output.size). Negative where it is not
// known, as columns are missing.
double seen_errors(const Animation& animation, const std::vector<Witness>& places, const sim::ErrorSizes& errors, bool pixels);

}  // namespace flexframe::film
