// The same elastic body in other coordinates: its eigenmodes, mass-normalised. Me becomes 1 and Ke diagonal, so that every coordinate
// has one frequency, and error weights and time steps can tell slow motion from fast.
#pragma once

#include "sim/bodies/flexible_body.h"

#include <array>
#include <string>
#include <vector>

namespace flexframe::sim {

// All eigenmodes of (Ke, Me), ascending; V (n x n): old coordinates = V new ones. Me must be positive definite. by_direction: coordinates
// that neither mass nor stiffness couples are solved by themselves. Where two directions have the same frequencies, as of a round section,
// an eigensolver of the whole gives any mixture of both, which belongs to neither (keep_lowest needs them apart).
FlexibleBody to_normal_modes(const FlexibleBody& body, MatX& V, bool by_direction = false);

// A place where joints or loads take hold of a body, and what they pass on there.
struct HeldPoint {
  std::string node;  // empty: spread along the whole body, evenly by mass (its weight, a distributed force)
  bool force = true, moment = false;
  bool load = false;  // given forces and what springs, friction and motors pass on: nothing is held
};

// A body in normal modes of mean axes with few shapes of each direction (coordinate_direction): its count[direction] lowest modes of the
// body held where joints hold it (fixed interfaces: Craig, Bampton, AIAA J. 6, 1968), the deformations by motions of the joints against
// each other, and, for the modes left out, the static deflections under unit loads, weight among them (MacNeal, Computers & Structures 1,
// 1971). A hinge holds no rotation: two hinged ends move against each other as the rigid body does and add nothing. All as mass-normalised
// coordinates. count: axial, bending_xy, bending_xz, torsion; 0: no shape at all of that direction. V: its columns are combined likewise.
FlexibleBody keep_lowest(const FlexibleBody& body, const std::array<int, 4>& count, const std::vector<HeldPoint>& held, MatX& V);

// The direction in which coordinate k of a beam moves its nodes most: 0 axial, 1 bending_xy, 2 bending_xz, 3 torsion.
int coordinate_direction(const FlexibleBody& body, int k);

// Coordinates of `target` that deform its nodes as unit coordinates of `source` do, up to a rigid motion of the body frame (n x n).
// The two bodies are the same beam with other boundaries of the frame: same nodes, same number of coordinates.
MatX same_deformation(const FlexibleBody& target, const FlexibleBody& source);

}  // namespace flexframe::sim
