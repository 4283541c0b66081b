// Positions and velocities of frames and parts, cluster by cluster. W: Work or PlaneWork.
#pragma once

#include "sim/dynamics/plane_work.h"

#include <type_traits>

namespace flexframe::sim {

// Frame of a flexible part from its elastic coordinates: its pose; B (FrameWork) at that pose; both. No-ops for rigid frames.
void update_frame_pose(const Model& model, int frame, Work& work);
void update_frame_pose(const Model& model, int frame, PlaneWork& work);
void update_frame_jacobian(const Model& model, int frame, Work& work);
void update_frame_jacobian(const Model& model, int frame, PlaneWork& work);
template <class W>
void update_frame_position(const Model& model, int frame, W& work);
// W, V and bias of a frame from its part's twist.
template <class W>
void update_frame_velocity(const Model& model, int frame, W& work);

// Copies the elastic coordinates of a cluster out of work.q and makes the poses of its frames in their parts.
template <class W>
void update_cluster_frames(const Model& model, int cluster, W& work);
// Joint poses and the poses of the parts in the base frame from work.q, frames as they are.
template <class W>
void update_cluster_chain(const Model& model, int cluster, W& work);
// The same of its parts from the first-th on, where those before stand as they stood.
template <class W>
void update_chain_from(const Model& model, int cluster, size_t first, W& work);
// Both, B of the frames, and all that update_cluster_world does but the poses in the world.
template <class W>
void update_cluster_positions(const Model& model, int cluster, W& work);
// Poses of a cluster's parts in what carries them and in the world, and their twists per rate of their joints; its parent's come first.
template <class W>
void update_cluster_world(const Model& model, int cluster, W& work);
// Twists and A0 of a cluster's parts from work.w; update_cluster_world or update_cluster_positions comes first, and its parent's twists.
template <class W>
void update_cluster_velocities(const Model& model, int cluster, W& work);
// Acceleration of the base frame of a cluster that is carried; and those of the cluster's parts from their carrier's (gravity as an
// acceleration of ground) and work.wdot: A and qdd.
template <class W>
void update_base_acceleration(const Model& model, int cluster, W& work);
template <class W>
void update_cluster_accelerations(const Model& model, int cluster, W& work);
// What the carrier of a part makes of A.
template <class W>
typename W::In::Twist carried_acceleration(const Model& model, const W& work, int part);

// Pose of a frame in world axes (positions must be up to date).
template <class W>
typename W::In::Pose frame_world(const Model& model, const W& work, int frame);
// Pose of a frame in the base frame of a cluster to which it belongs, or to whose parent it is fixed.
template <class W>
typename W::In::Pose frame_in_base(const Model& model, const W& work, int cluster, int frame) {
  const FramePoint& f = model.frames[frame];
  const auto& local = work.frames[frame].pose;
  if (f.part != ground && model.parts[f.part].cluster == cluster) return compose(work.parts[f.part].in_base, local);
  return compose(inverse(work.frames[model.clusters[cluster].base].pose), local);
}

// Pose, in the part's body frame, of the frame in which its deformation is shown (identity where the two are one). Refreshes the
// frames of root and tip.
Pose shown_pose(const Model& model, int part, Work& work);

// A wrench on a frame, in the frame's axes.
template <class W>
struct WrenchAt {
  int frame = 0;
  typename W::In::Twist F;
};
// Adds it to the generalised forces of the cluster's coordinates: out(nv of the cluster) += J^T F. elastic = false: to those of its joints
// only.
template <class W>
void project_wrench(const Model& model, const W& work, int cluster, const std::type_identity_t<WrenchAt<W>>& load, bool elastic, VecX& out);

}  // namespace flexframe::sim
