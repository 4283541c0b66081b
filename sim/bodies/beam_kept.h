// Beams of finite elements that keep few modes: made from the elements at O(elements x shapes^2), no matrix of all their coordinates.
#pragma once

#include "sim/bodies/beam.h"

#include <array>
#include <string>
#include <vector>

namespace flexframe::sim {

// A place where joints or loads take hold of a body, and what they pass on there.
struct HeldPoint {
  std::string node;  // empty: spread along the whole body, evenly by mass (its weight, a distributed force)
  bool force = true, moment = false;
  bool load = false;  // given forces and what springs, friction and motors pass on: nothing is held
};

struct KeptBeam {
  FlexibleBody body;  // frame on the mean axes; Me = 1, Ke diagonal
  MatX coordinates;   // of make_fe_beam(def, effects) with its boundary: columns as the body's coordinates
};

// A beam of finite elements in mean axes with few shapes of each direction: its count[direction] lowest modes of the beam held where joints
// hold it (fixed interfaces: Craig, Bampton, AIAA J. 6, 1968), the deformations by motions of the joints against each other, and, for the
// modes left out, the static deflections under unit loads, weight among them (MacNeal, Computers & Structures 1, 1971). A hinge holds no
// rotation: two hinged ends move against each other as the rigid body does and add nothing. count: axial, bending_xy, bending_xz, torsion;
// 0: no shape at all of that direction. With def.keep_inertia: the deflections under the inertia of motions of the joints too
// (Holds::inertia, held_shapes.h). Where the section's principal axes are turned, bending is
// kept in the two principal directions, of which bending_xy is the one nearer to y; where shear couples these besides, so many of both
// together as of each. def.boundary: one that places the frame only (not clamped_clamped, clamped_supported). BeamDef::damping is that of
// the boundary's modes as the kept coordinates make them. Frames, nodes, errors as of make_fe_beam; the axis's particles lie at four points
// of each of the elements, or of three equal parts a mode where these are fewer.
KeptBeam make_kept_beam(const BeamDef& def, const BeamEffects& effects, const std::array<int, 4>& count,
                        const std::vector<HeldPoint>& held);

}  // namespace flexframe::sim
