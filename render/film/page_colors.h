// What the bodies of a page can be coloured by, the viewer choosing: as the scene says, and by displacement, stress and speed, each with
// the map and the range that pictures of that colour have.
//
// Values come as shapes times weights (shape_basis.h), the stress of beams and bodies with stress modes as vectors whose length it is.
// Displacement and speed need no numbers of their own: the browser has the displacement, and the speed of a point follows from how its
// frame and its weights change.
#pragma once

#include "render/film/animation.h"
#include "render/film/page_block.h"
#include "render/film/shape_basis.h"

#include <optional>
#include <vector>

namespace flexframe::film {

struct PageColors {
  std::vector<Colors> all;            // the scene's own first, if it has values
  bool own = false;                   // it has
  std::optional<Animation> stressed;  // an animation coloured by stress: its meshes are finer and serve for all colours
};
PageColors find_page_colors(Animation& animation, const sim::Scene* scene);

// For the page: maps and ranges as an array, in that order.
nlohmann::ordered_json colors_json(const PageColors& colors, PageBlock& block);

// How one body looks by each of them: 0 own colour, 1 length of the displacement, 2 shapes of the value (`parts` 1 or 2: of vectors of 3 or
// 6 numbers whose length it is), 3 zero, 4 speed; with its motion where a speed is asked for. basis: of its displacement. Returns the
// largest error as a share of a range.
double add_body_colors(const PageColors& colors, const Animation& animation, int body, const ShapeBasis& basis, PageBlock& block,
                       nlohmann::ordered_json& out);

}  // namespace flexframe::film
