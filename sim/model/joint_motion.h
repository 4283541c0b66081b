// Relative motion across a tree joint: pose of the child-side frame B in the parent-side frame A, its twist and velocity terms.
//
// Coordinates: revolute angle; prismatic distance; cylindrical [distance, angle]; screw angle; universal [angle about the axis, angle
// about the turned second axis]; spherical quaternion w x y z (rates: angular velocity in B's axes); planar [x, y, angle];
// free [position in A; quaternion] (rates: twist of B in its own axes); flexure rotation vector of B in A (its derivative is the rate);
// flexure_pair the same, about the two coordinate axes that are not the joint's axis, in the order x y z. The second axis of the universal
// joint and x, y of the planar joint are `joint_axes`.
#pragma once

#include "sim/model/model.h"

namespace flexframe::sim {

struct JointMotion {
  Pose pose;                      // of B in A (of the part's side in the carrier's side, if reversed)
  Eigen::Matrix<double, 6, 6> S;  // first nv columns: twist of B relative to A per rate, in B's axes
  Vec6 W = Vec6::Zero();          // relative twist
  Vec6 bias = Vec6::Zero();       // dS/dt w (and S qdd of a prescribed motion)
};

// Numbers of position coordinates and of rates of a kind.
int position_count(JointKind kind);
int rate_count(JointKind kind);
bool is_tree_kind(JointKind kind);

// Two unit vectors normal to `axis` and to each other; right-handed with it.
struct JointAxes {
  Vec3 x, y, z;
};
JointAxes joint_axes(const Vec3& axis);

// Fills pose and S from the coordinates (quaternions are normalised here).
void update_joint_position(const TreeJoint& joint, const double* q, JointMotion& out);
// Fills W and bias from the rates.
void update_joint_velocity(const TreeJoint& joint, const double* q, const double* w, JointMotion& out);
// Time derivative of the coordinates.
void coordinate_rates(JointKind kind, const double* q, const double* w, double* qd);
// Moves the coordinates by a small step of the rates' kind (loop closure, differences).
void move_coordinates(JointKind kind, double* q, const double* dw);
// The coordinates at the origin (quaternions 1).
void zero_coordinates(JointKind kind, double* q);

}  // namespace flexframe::sim
