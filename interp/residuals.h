// The misses behind leave_one_out, node by node.
#pragma once

#include "interp/map.h"

namespace flexframe::interp {

// What each merged node is missed by when it is predicted from the others, m (rows of Map::node_positions); a row of NaN where the layout
// has no prediction. displacement N x 3, m; rotation N x 3, rad, or 0 x 3. Throws InputError as apply does.
Points node_residuals(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation);

// Data of the merged nodes in their order: means of those that became one. data: N x 3 or 0 x 3.
Points merge_data(const Map& map, const Eigen::Ref<const Points>& data);

}  // namespace flexframe::interp
