// Which joints of the scene hold a body, and how: what its deformation is shown from (shown_frame.h) and in which modes its damping
// ratios are meant (mounted_damping.h).
#pragma once

#include "sim/scene/scene.h"

#include <vector>

namespace flexframe::sim {

// A joint that holds a body, seen from the body.
struct Support {
  const JointDef* joint = nullptr;
  FrameRef frame;          // where it takes hold
  bool parent = false;     // the body is the joint's parent: the joint's frame is moved by its `position` and `rotation`
  bool on_ground = false;  // the other side is the ground itself
  bool clamp = false;      // no rotation is left between the two sides: a weld, a prismatic joint, a joint whose motion is prescribed
};

// The joints from which a way along joints leads to ground without passing the body again, in the scene's order: what merely hangs on a
// body does not hold it. Where no way leads to ground (a mechanism that flies) the heaviest rigid body takes the ground's place,
// and where there is none all joints count. Joints of kind "free" hold nothing and make no way.
std::vector<Support> supports_of(const Scene& scene, const std::string& body);

}  // namespace flexframe::sim
