// The independent rates of a mechanism as directions in which it can be moved: for finite differences and for statics.
#pragma once

#include "sim/dynamics/work.h"

namespace flexframe::sim {

struct Direction {
  int v = 0;  // rate, index in w_all
  int part = 0;
  int rate = -1;       // >= 0: of the part's joint; else elastic coordinate -1 - rate
  double scale = 1.0;  // m per unit: 1 for a translation, the cluster's size for a rotation, an elastic coordinate's largest displacement
};

// Every independent rate of every cluster (ClusterWork::partition), in the order of the state.
std::vector<Direction> independent_directions(const Model& model, const Work& work);

// m per unit of every rate of w_all, as Direction::scale.
VecX rate_sizes(const Model& model);

// Moves the coordinate in work.q; positions are not updated.
void move_along(const Model& model, const Direction& direction, double step, Work& work);

}  // namespace flexframe::sim
