// Relative motion across a tree joint: pose of the child-side frame B in the parent-side frame A, its twist and velocity terms.
//
// Coordinates: revolute angle; prismatic distance; cylindrical [distance, angle]; screw angle; universal [angle about the axis, angle
// about the turned second axis]; spherical quaternion w x y z (rates: angular velocity in B's axes); planar [x, y, angle];
// free [position in A; quaternion] (rates: twist of B in its own axes); flexure rotation vector of B in A (its derivative is the rate);
// flexure_pair the same, about the two coordinate axes that are not the joint's axis, in the order x y z. The second axis of the universal
// joint and x, y of the planar joint are `joint_axes`.
#pragma once

#include "sim/base/plane.h"
#include "sim/model/model.h"

#include <array>

namespace flexframe::sim {

// In: Space or Plane.
template <class In>
struct JointMotionIn {
  typename In::Pose pose;                        // of B in A (of the part's side in the carrier's side, if reversed)
  typename In::Inertia S = In::Inertia::Zero();  // first nv columns: twist of B relative to A per rate, in B's axes
  typename In::Twist W = In::Twist::Zero();      // relative twist
  typename In::Twist bias = In::Twist::Zero();   // dS/dt w (and S qdd of a prescribed motion)
};
using JointMotion = JointMotionIn<Space>;

// A joint within the plane: its rates slide along directions that stay with A or turn about the normal.
struct PlaneJoint {
  bool reversed = false;
  int rates = 0;
  bool slides = false, turns = false;
  PlanePose zero;                   // planar axes of B in those of A at the coordinates' origin (reversed and without rates: of A in B)
  std::array<Vec2, 3> direction{};  // per rate, planar axes of A
  std::array<double, 3> sense{};    // of the turn about the normal, 1 or -1; 0 where the rate slides
};
// QA, QB: planar axes of the frames A and B, a column each, in their own axes. False where the joint leaves the plane.
bool in_plane(const TreeJoint& joint, const Mat3& QA, const Mat3& QB, PlaneJoint& out);

// Numbers of position coordinates and of rates of a kind.
int position_count(JointKind kind);
int rate_count(JointKind kind);
bool is_tree_kind(JointKind kind);

// Two unit vectors normal to `axis` and to each other; right-handed with it.
struct JointAxes {
  Vec3 x, y, z;
};
JointAxes joint_axes(const Vec3& axis);

// The pose alone, from the coordinates: for joints whose S is constant.
void update_joint_pose(const TreeJoint& joint, const double* q, JointMotion& out);
// Fills pose and S from the coordinates (quaternions are normalised here).
void update_joint_position(const TreeJoint& joint, const double* q, JointMotion& out);
void update_joint_position(const PlaneJoint& joint, const double* q, JointMotionIn<Plane>& out);
// Fills W and bias from the rates.
void update_joint_velocity(const TreeJoint& joint, const double* q, const double* w, JointMotion& out);
void update_joint_velocity(const PlaneJoint& joint, const double* q, const double* w, JointMotionIn<Plane>& out);
// Time derivative of the coordinates.
void coordinate_rates(JointKind kind, const double* q, const double* w, double* qd);
// Moves the coordinates by a small step of the rates' kind (loop closure, differences).
void move_coordinates(JointKind kind, double* q, const double* dw);
// The coordinates at the origin (quaternions 1).
void zero_coordinates(JointKind kind, double* q);

}  // namespace flexframe::sim
