// Readers of what acts by the state: contacts and blocks; private to the readers of the scene.
#pragma once

#include "sim/scene/scene_input.h"

namespace flexframe::sim {

// A force's line, name and kind, all that outputs of it need to know; its unknown keys are refused.
ForceDef read_force_head(TableReader& reader);
// Refuses keys that contacts do not have.
void allow_contact_keys(const TableReader& reader);
// A contact's keys besides `name`, `kind`, `on` and `from`.
ContactDef read_contact(const TableReader& reader);
// A block without its inputs, added to scene.blocks, or the inputs of one that was added so: they may read blocks that follow.
void read_block(TableReader& reader, Scene& scene, bool inputs);

}  // namespace flexframe::sim
