// A table and a mapping to results.
#pragma once

#include "render/import/mapping.h"
#include "sim/results/results.h"

namespace flexframe::imports {

// Positions in m, world axes; orientations as unit quaternions body to world; displacements in the body frame, m. Columns that no body
// uses become outputs. Throws InputError naming the mapping's line and the column that is missing, of a wrong unit or no rotation.
sim::Results assemble(const Table& table, const Mapping& mapping);

}  // namespace flexframe::imports
