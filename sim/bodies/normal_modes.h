// The same elastic body in other coordinates: its eigenmodes, mass-normalised. Me becomes 1 and Ke diagonal, so that every coordinate
// has one frequency, and error weights and time steps can tell slow motion from fast.
#pragma once

#include "sim/bodies/flexible_body.h"

namespace flexframe::sim {

// All eigenmodes of (Ke, Me), ascending; V (n x n): old coordinates = V new ones. Me must be positive definite.
FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V);

// The direction in which coordinate k of a beam moves its nodes most: 0 axial, 1 bending_xy, 2 bending_xz, 3 torsion.
int coordinate_direction(const FlexibleBody& body, int k);

// Coordinates of `target` that deform its nodes as unit coordinates of `source` do, up to a rigid motion of the body frame (n x n).
// The two bodies are the same beam with other boundaries of the frame: same nodes, same number of coordinates.
MatX same_deformation(const FlexibleBody& target, const FlexibleBody& source);

}  // namespace flexframe::sim
