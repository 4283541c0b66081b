// What hangs on the bodies of an animation: traces of points, triads, force arrows, springs. Set up once, placed in every picture.
#pragma once

#include "render/film/animation.h"

namespace flexframe::film {

// The frame that a key of [render] names. Throws sim::InputError if there is none, with the line in the scene and what there is.
FramePlace require_place(const Animation& animation, const sim::Scene* scene, const std::string& name, const char* key, int line);

// Looks up the frames that the settings name and the scene's forces and springs. size: m, of the machine.
// Throws sim::InputError for a frame that is not there, with the line in the scene.
void add_attachments(Animation& animation, const sim::Scene* scene, double size);

// Ends of the arrows and springs at 200 samples, so that the camera sees them; m, world. window: only in that time, s; null: always.
void append_ends(const Animation& animation, std::vector<glm::dvec3>& points, const std::pair<double, double>* window = nullptr);

// Lines, triads, arrows and springs of picture `picture` into memory.picture.
void update_attachments(const Animation& animation, int picture, PictureMemory& memory);

}  // namespace flexframe::film
