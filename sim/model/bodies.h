// The parts behind a scene's bodies: one a body, or a chain for mixed and lumped beams.
#pragma once

#include "sim/bodies/further_shapes.h"
#include "sim/model/model.h"

#include <vector>

namespace flexframe::sim {

// A joint between neighbouring parts of a chain.
struct ChainJoint {
  int frame_a = 0, frame_b = 0;
  TreeJoint joint;
};

// Adds the parts of every body, still without elastic coordinates; Part::body holds mass data of rigid bodies only.
std::vector<ChainJoint> make_parts(Model& model, const Scene& scene);

// Part and node of a body's frame ("" = the body's own, a beam's root). Throws InputError listing the frames.
FramePoint find_frame(const Model& model, const Scene& scene, int body, const std::string& frame, const std::string& where);

// Finds the node that a frame names, once its part's body is made. Throws InputError listing the nodes.
void resolve_node(Model& model, const std::string& where, int frame);

// Makes the flexible bodies, now that the tree (Part::parent, ::joint) says how the scene moves, and resolves the frames' nodes.
// order: parts, carriers first. further: shapes that bodies of files take beside their own.
void make_bodies(Model& model, const Scene& scene, const std::vector<int>& order, const FurtherOfBodies& further = {});

// Elastic coordinates of a scene's body as the scene file counts them: piece by piece from the root, of a lumped beam the angles of the
// link towards the piece before it (about x, y, z as far as they exist), then the piece's own.
int coordinate_count(const Model& model, int body);
// From q_all or w_all (rates), and back into them.
VecX body_coordinates(const Model& model, int body, const VecX& all, bool rates);
void body_coordinates(const Model& model, int body, const VecX& all, bool rates, double* out);
void set_body_coordinates(const Model& model, int body, const VecX& given, VecX& all, bool rates);

// Length that a part spans, m: of its nodes, or of the frames on it.
double part_size(const Model& model, int part);
// Of all parts.
std::vector<double> part_sizes(const Model& model);

// Undeformed pose of a frame in its part.
Pose rest_pose(const Model& model, int frame);

}  // namespace flexframe::sim
