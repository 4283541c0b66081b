// A map for nodes whose motion is known: where `auto` is in doubt between the kernel and the elastic surface, it takes the one that
// predicts the nodes' own motion better when nodes are left out.
#pragma once

#include "interp/map.h"

namespace flexframe::interp {

struct NodeMotions {
  Eigen::MatrixXd displacement;  // 3 N x n, m (modes: of any scale), n motions of the nodes as given
  Eigen::MatrixXd rotation;      // 3 N x n, rad, or 0 x 0
  bool linear = true;            // mode shapes; false: what the nodes really do, large rotations included
};

// make_map with that; other sizes than those above: InputError. Without motions (n = 0) the same as make_map.
Map make_map_for(const Nodes& nodes, const MeshView& mesh, const Options& options, const NodeMotions& known);

}  // namespace flexframe::interp
