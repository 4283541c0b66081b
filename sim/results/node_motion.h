// Displacements and rotations of many nodes of one part at once, for recording.
#pragma once

#include "sim/bodies/body_terms.h"
#include "sim/model/model.h"

#include <vector>

namespace flexframe::sim {

class NodePaths {
 public:
  // Of these of the part's nodes, in this order.
  NodePaths(const Part& part, const std::vector<int>& nodes);
  size_t count() const { return origins_.size(); }
  // Motions relative to the undeformed body, in the axes of the body's shown frame (chains: of the first part). q: the part's elastic
  // coordinates; shown: pose of the part in that frame. translation (m), rotation (rad, a rotation vector, at most pi): three numbers a
  // node.
  void evaluate(const VecX& q, const Pose& shown, double* translation, double* rotation);

 private:
  std::vector<Vec3> origins_, rests_;     // in the part; in the body, undeformed
  Quat rest_turn_;                        // of the body seen from the undeformed part
  MatX linear_;                           // of all nodes' translations, then of their rotations, x q: rows that are not zero
  std::vector<Eigen::Index> rows_;        // which these are
  std::vector<Eigen::Index> seconds_of_;  // components of translations that are of second order too
  MatX quadratic_;                        // of these x products of two coordinates
  std::shared_ptr<const RodAxis> rod_;
  MatX weights_;  // of its points, a row a node
  RodState bent_;
  VecX values_, moved_, products_, seconds_;
};

}  // namespace flexframe::sim
