// Deformations of a beam of finite elements in the coordinates of another boundary.
#pragma once

#include "sim/bodies/beam.h"

namespace flexframe::sim {

// Columns of T: coordinates of make_fe_beam(def, effects) with free ends (free_free). The same deformations in the coordinates of a
// boundary that places the frame only (clamped_free, supported_supported, supported_free): both are values at the nodes, beside other rigid
// motions.
MatX in_boundary(const BeamDef& def, const BeamEffects& effects, Boundary boundary, const MatX& T);

}  // namespace flexframe::sim
