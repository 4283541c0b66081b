// Frames that outputs add to a model whose mechanism moves in a plane.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// Takes the frames into the plane that were added to the model since it was made. work: has them, and the parts' poses in the world.
void grow_plane(const Model& model, const Work& work, PlaneMotion& plane);

// The pose of a frame in its part at the plane's elastic coordinates, as it is in space, into `to`; by the equations in space where the
// frame leaves the plane or the plane does not have it.
void place_frame(const Model& model, int frame, PlaneWork& from, Work& to);

// A pose between planar axes P and Q, each in the axes of its own frame, as it is between those: R and p in the axes of the first. height:
// of its origin along P's normal.
Pose pose_between(const Mat3& P, const PlanePose& at, double height, const Mat3& Q);

// shown_pose (kinematics.h) where the frames of root and tip are up to date.
Pose shown_pose_at(const Model& model, int part, const Work& work);

}  // namespace flexframe::sim
