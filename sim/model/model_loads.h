// What acts on a mechanism whose parts are numbered: forces, contacts, blocks of control, works that outputs ask for.
#pragma once

#include "sim/model/model.h"

namespace flexframe::sim {

// Throws InputError naming line and force or block: missing frames, an expression that cannot be read, blocks that wait for themselves.
void add_loads(Model& model, const Scene& scene);

}  // namespace flexframe::sim
