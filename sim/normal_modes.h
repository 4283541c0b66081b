// The same elastic body in other coordinates: its eigenmodes, mass-normalised. Me becomes 1 and Ke diagonal, so that every coordinate
// has one frequency, and error weights and time steps can tell slow motion from fast.
#pragma once

#include "sim/flexible_body.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// All eigenmodes of (Ke, Me), ascending; V (n x n): old coordinates = V new ones. Me must be positive definite.
FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V);

// A place where joints or loads take hold of a body, and what they pass on there.
struct HeldPoint {
  std::string node;
  bool force = true, moment = false;
};

// A body in normal modes with only the `count` lowest of each direction (coordinate_direction) and, for the others, the static deflections
// under unit forces and moments at the held points: their response below their frequencies (residual flexibility: MacNeal, Computers &
// Structures 1, 1971; Rubin, AIAA J. 13, 1975), as mass-normalised coordinates of their own. count = 0: none at all, a rigid body.
// V: its columns are combined likewise.
FlexibleBody keep_lowest(const FlexibleBody& body, int count, const std::vector<HeldPoint>& held, MatX& V);

// The direction in which coordinate k of a beam moves its nodes most: 0 axial, 1 bending_xy, 2 bending_xz, 3 torsion.
int coordinate_direction(const FlexibleBody& body, int k);
inline constexpr const char* direction_names[] = {"axial", "bending_xy", "bending_xz", "torsion"};

// Coordinates of `target` that deform its nodes as unit coordinates of `source` do, up to a rigid motion of the body frame (n x n).
// The two bodies are the same beam with other boundaries of the frame: same nodes, same number of coordinates.
MatX same_deformation(const FlexibleBody& target, const FlexibleBody& source);

}  // namespace flexframe::sim
