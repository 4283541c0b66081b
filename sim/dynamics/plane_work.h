// Motion in a plane: the constants of a model that moves in one, and the work space of the recursions (work.h) with three components where
// space has six, about five times cheaper. What rarely acts or is easier to say in space (bushings, springs across loops, reactions) goes
// through space at the frames concerned.
//
// Every frame and part has planar axes: its own axes turned so that the third is the plane's normal. Where the normal is the z of all of
// them they are the same.
#pragma once

#include "sim/bodies/plane_body.h"
#include "sim/dynamics/work.h"

#include <memory>
#include <string>

namespace flexframe::sim {

struct PlaneFrame {
  Mat3 axes = Mat3::Identity();  // planar axes in the frame's own
  double height = 0.0;           // of its origin along the normal, m
  // On a node of a flexible part: the offset from it in the node's planar axes and in the frame's.
  PlaneNode node;
  Vec2 offset = Vec2::Zero(), arm = Vec2::Zero();
  double offset_angle = 0.0;
};

struct PlaneMotion : Motion<Plane> {
  Mat3 axes = Mat3::Identity();  // of the plane in the world
  Vec2 gravity = Vec2::Zero();
  bool forces_within = true;  // nothing pulls or pushes along the normal
  std::vector<PlaneFrame> frame_constants;
  std::vector<Mat3> part_axes;
  std::vector<double> part_heights;             // of the parts' origins along the normal, m
  std::vector<PlaneBody> bodies;                // per part
  std::vector<PlaneJoint> tree;                 // per part
  std::vector<std::vector<PlanePose>> entries;  // per cluster: Cluster::entry
  std::vector<std::vector<PlaneRow>> rows;      // per loop: LoopJoint::rows
  std::vector<Vec3> load_direction;             // per load: wrench per unit of its value, planar axes of the world or of its frame
};

// From the assembled start in `work`. Null where the mechanism does not move in a plane, or as far as one knows not to the last digit;
// `why_not` then says which joint, frame or body leaves it.
std::unique_ptr<PlaneMotion> make_plane(const Model& model, const Work& work, std::string& why_not);

// The rates of a Work moving in a plane: for one evaluation, both must stay.
struct PlaneWork {
  using In = Plane;
  PlaneWork(Work& work, PlaneMotion& motion);

  Carrying& carrying;
  std::vector<JointWork>& joints;
  std::vector<ClusterWork>& clusters;
  VecX &q, &w, &wdot;
  double& time;
  std::vector<double>& expression_value;
  std::vector<TimeJet>& motion;
  double& applied;
  long &evaluations, &closure_iterations;
  int& indefinite;
  bool& idle;
  SignalWork& signals;
  std::vector<FrameMotion<Plane>>& frames;
  std::vector<PartMotion<Plane>>& parts;
  std::vector<BaseMotion<Plane>>& bases;
  std::vector<LoopMotion<Plane>>& loops;
  const PlaneMotion& plane;
};

// Constants of the model as either space sees them.
inline const FlexibleBody& kinetic_body(const Model& model, const Work& work, int part) { return kinetics(model, work, part); }
inline const PlaneBody& kinetic_body(const Model&, const PlaneWork& work, int part) { return work.plane.bodies[part]; }
inline const FlexibleBody& elastic_body(const Model& model, const Work&, int part) { return model.parts[part].body; }
inline const PlaneBody& elastic_body(const Model&, const PlaneWork& work, int part) { return work.plane.bodies[part]; }
inline const TreeJoint& tree_joint(const Model& model, const Work&, int part) { return model.parts[part].joint; }
inline const PlaneJoint& tree_joint(const Model&, const PlaneWork& work, int part) { return work.plane.tree[part]; }
inline const Pose& entry_pose(const Model& model, const Work&, int cluster, size_t entry) { return model.clusters[cluster].entry[entry]; }
inline const PlanePose& entry_pose(const Model&, const PlaneWork& work, int cluster, size_t entry) {
  return work.plane.entries[cluster][entry];
}
inline const std::vector<ClosureRow>& loop_rows(const Model& model, const Work&, int loop) { return model.loops[loop].rows; }
inline const std::vector<PlaneRow>& loop_rows(const Model&, const PlaneWork& work, int loop) { return work.plane.rows[loop]; }
inline Vec3 gravity(const Model& model, const Work&) { return model.settings.gravity; }
inline Vec2 gravity(const Model&, const PlaneWork& work) { return work.plane.gravity; }

// A frame's pose in the world and twists and wrenches at it, as they are in space, and those of space within the plane.
Pose pose_in_space(const Model& model, const Work& work, int frame);
Pose pose_in_space(const Model& model, const PlaneWork& work, int frame);
inline Vec6 within(const Work&, int, const Vec6& F) { return F; }
Vec3 within(const PlaneWork& work, int frame, const Vec6& F);
inline Vec6 in_space(const Work&, int, const Vec6& V) { return V; }
Vec6 in_space(const PlaneWork& work, int frame, const Vec3& V);

// What a plane's positions and velocities are in space, as far as frames and outputs ask for them: poses, twists, elastic coordinates and
// rates of the parts, poses of the frames by which joints and forces hold on to what deforms. Accelerations, inertias and the motion of
// frames stay as they were.
void place_in_space(const Model& model, const PlaneWork& from, Work& to);

// How far frame `on` lies above frame `from` along the plane's normal, m, which poses in a plane lack; 0 in space.
inline double height_between(const Work&, int, int) { return 0.0; }
inline double height_between(const PlaneWork& work, int from, int on) {
  return work.plane.frame_constants[on].height - work.plane.frame_constants[from].height;
}

}  // namespace flexframe::sim
