// Prescribed motions that no finite force can follow, and tables through which no smooth curve runs as they are meant.
#pragma once

#include "sim/model/model.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// Throws InputError where the value of a motion jumps within the run; notes where its rate does (the bodies are struck there, which the
// equations of motion do not know), and what is without effect in a joint that follows a motion.
void check_motions(Model& model, const Scene& scene, Notes& notes);

// Notes where the curve through a table leaves the range of its values by more than half of it.
void check_tables(const Scene& scene, Notes& notes);

}  // namespace flexframe::sim
