// From a scene to a mechanism: bodies made, spanning tree chosen, loops cut, clusters formed, coordinates numbered.
#pragma once

#include "sim/bodies/further_shapes.h"
#include "sim/model/model.h"

namespace flexframe::sim {

// Throws InputError naming line and joint or body: missing frames, a joint between a body and itself, nothing to simulate.
// Bodies without a way to ground get a free joint; Model::notes say so.
// further: shapes that bodies of files take beside their own.
Model build_model(const Scene& scene, const FurtherOfBodies& further = {});

// The frame a scene names, as a new FramePoint of the model; a body's name alone is its own frame (a beam's: its root).
// Throws InputError with the frames that exist. `where` starts the message.
int add_frame(Model& model, const Scene& scene, const FrameRef& ref, const std::string& where);

// A frame at a part's own frame, named so; returns its index.
int add_own_frame(Model& model, int part, const std::string& name);

// Index of the tree part that carries a scene joint's coordinates, or -1 (cut or prescribed joints have none but are found too).
int joint_part(const Model& model, int scene_joint);

}  // namespace flexframe::sim
