// Points of a model where something is attached or looked at: their translation and rotation as linear functions of the nodal motions.
#pragma once

#include "sim/reduce/fe_system.h"

namespace flexframe::sim {

struct FeAttachment {
  std::string id;  // node number of the file, or a spider's name
  Vec3 position = Vec3::Zero();
  Eigen::SparseMatrix<double, Eigen::RowMajor> motion;  // 6 x size: translations, rotations; its transpose distributes a force and a moment
  bool own_rotation = true;                             // false: from the neighbours' motion
  Mat3 spread = Mat3::Zero();                           // of an averaging spider: sum w r r^T about its middle
  Mat3 fitted = Mat3::Zero();                           // (tr spread 1 - spread)^-1, zero about a line that holds all nodes
  Vec3 arm = Vec3::Zero();  // from the place whose translation is taken (an averaging spider's middle): in second order the point moves by
                            // theta x (theta x arm) / 2 besides
};

// A node. Translations are its own. Rotations are its own where it has any; in a solid they are those of the least-squares rigid motion of
// the nodes of the elements around it (equal weights), which is exact for rigid motion and for uniform strain on a symmetric neighbourhood.
// `neighbours` from node_neighbours.
FeAttachment node_attachment(const FeModel& model, const FeSystem& system, const std::vector<std::vector<int>>& neighbours, int node);

// An averaging spider's reference point: the weighted least-squares rigid motion of its nodes. Throws InputError where no node moves.
FeAttachment averaging_attachment(const FeModel& model, const FeSystem& system, const FeSpider& spider);

// A spider's reference point: rigid, its own motion; averaging, as above.
FeAttachment spider_attachment(const FeModel& model, const FeSystem& system, const FeSpider& spider);

// Nodes that share an element with each of `nodes`, themselves included (in the order of `nodes`).
std::vector<std::vector<int>> node_neighbours(const FeModel& model, const std::vector<int>& nodes);

// `count` nodes spread well over the candidates: each is the one farthest from all before it (farthest point sampling; T. Gonzalez,
// Clustering to minimize the maximum intercluster distance, 1985), starting from those already chosen, or from the candidate farthest from
// the middle.
std::vector<int> spread_nodes(const FeModel& model, const std::vector<int>& candidates, const std::vector<Vec3>& chosen, int count);

}  // namespace flexframe::sim
