// Nodes tied to faces they lie on.
#pragma once

#include "sim/reduce/fe_model.h"

namespace flexframe::sim {

struct TieResult {
  std::vector<FeEquation> equations;  // three for each tied node: its motion is that of the place on the face
  int tied = 0, left = 0;
  double tolerance = 0.0, nearest = 0.0, moved = 0.0;  // m: used; smallest distance of a node; largest way of a moved node
};

// Area of a face of 3, 4, 6 or 8 nodes (corners, then middles), m^2; 0 for others.
double face_area(const FeModel& model, const std::vector<int>& face);

// Ties each slave node that lies within `tolerance` (m; negative: a twentieth of the faces' mean edge) of a face to that face, by its shape
// functions at the nearest place. adjust: moves the node there, so that turning costs no energy. Nodes of the face itself are left alone.
TieResult tie_nodes(FeModel& model, const std::vector<int>& slaves, const std::vector<std::vector<int>>& faces, double tolerance,
                    bool adjust);

// An averaging spider that gives some motions (0..5) of its reference point only, in directions Q: an equation each, the point's own motion
// first. Throws InputError where rotations are asked for and the nodes are on a line or at one place.
std::vector<FeEquation> averaging_equations(const FeModel& model, const FeSpider& spider, const std::vector<int>& motions, const Mat3& Q);

struct PartialMean {
  FeSpider spider;
  std::vector<int> motions;
  Mat3 axes = Mat3::Identity();
};
// Adds them to the model, once all else is there: as equations where something uses the point's other motions, which are free then; as
// spiders where nothing does, so that the point can be an interface. turning: nodes whose elements have rotations.
void add_partial_means(FeModel& model, std::vector<PartialMean> means, const std::vector<bool>& turning);

}  // namespace flexframe::sim
