// Closing loops from afar by the least motion, where the partition says nothing yet of which coordinates follow: at the start, and between
// two states of a step.
#pragma once

#include "sim/dynamics/work.h"

namespace flexframe::sim {

// Columns of a cluster's G (update_closure_matrix) scaled to metres, angle rows to metres. columns: rates of joints, counted within the
// cluster; row_scale: closure_row_scales.
MatX scaled_columns(const Model& model, const Work& work, int cluster, const std::vector<int>& columns, const VecX& row_scale);

// Moves the coordinates of a cluster's joints by a step of these rates (m, rad).
void move_rates(const Model& model, const Cluster& c, const std::vector<int>& columns, const VecX& step, Work& work);

// Closes a cluster's loops as well as these rates can, from the coordinates in work.q: Levenberg and Marquardt's method with steps of the
// least size (Nocedal and Wright, Numerical Optimization, 10.3). Returns the largest residual left, in metres.
double descend(const Model& model, int cluster, const std::vector<int>& columns, Work& work);

}  // namespace flexframe::sim
