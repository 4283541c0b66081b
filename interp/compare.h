// Which of two maps of a body is the better one: by leaving nodes out, by smooth motions, by the softest motions of an elastic surface.
#pragma once

#include "interp/known.h"
#include "interp/partition.h"

#include <string>

namespace flexframe::interp {

// Root mean square over the motions of the map's error as leaving nodes out tells it (MeanError), relative to what deforms. A motion counts
// as 1 at most, so that one that nobody can follow does not decide. NaN: no motion, or no prediction.
// lift and leave_one_out stand in for those of the map.
double left_out_error(const Map& map, const Weld& weld, const NodeMotions& known);

// Why the elastic surface (map.lift, elastic.weights) is worse than the kernel, or empty: the kernel follows the body's softest motions as
// the elastic surface has them, and is the better one in smooth motions that every body can do. A thin body with two faces is one whose far
// face hangs on its rim alone. Limits: interp/README.md.
std::string bends_worse(const Weld& weld, const Map& map, const Partition& elastic, const Partition& kernel);

}  // namespace flexframe::interp
