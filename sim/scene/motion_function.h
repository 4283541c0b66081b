// What a joint is made to follow.
#pragma once

#include "sim/scene/scene.h"
#include "sim/scene/table.h"

namespace flexframe::sim {

inline bool follows_motion(const JointDef& joint) { return joint.motion_table || !joint.motion.empty(); }

// The prescribed coordinate of a joint that follows a motion over time, s: m or rad. Throws InputError where its text is no function of
// time.
TimeFunction motion_function(const JointDef& joint);

}  // namespace flexframe::sim
