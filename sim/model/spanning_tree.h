// Which joints carry coordinates and which close loops: the spanning tree of the graph whose nodes are parts and whose edges are joints.
#pragma once

#include "sim/model/model.h"

namespace flexframe::sim {

struct SpanningTree {
  std::vector<int> order;        // parts, parents before children
  std::vector<LoopJoint> loops;  // joints that are cut; their frames are the model's
};

// Makes the parts of all bodies (without their elastic coordinates), auxiliary massless links and free joints, and directs the tree away
// from ground: joint and parent of each part. Joints that are driven, read or started come into the tree first.
// Throws InputError naming line and joint: missing frames, a joint between a body and itself, a motion of a joint with several coordinates.
SpanningTree make_spanning_tree(Model& model, const Scene& scene);

}  // namespace flexframe::sim
