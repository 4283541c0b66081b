// Applied forces: scene forces, spring-dampers, joint springs, dampers, stops. W: Work or PlaneWork.
#pragma once

#include "sim/dynamics/plane_work.h"

#include <vector>

namespace flexframe::sim {

// Fills PartMotion::load and load_e from the scene's forces, and Rates::applied. Positions and velocities come first.
template <class W>
void update_loads(const Model& model, W& work);

// Wrench on a force's or torque's frame per unit of its value, frame axes.
template <class W>
typename W::In::Twist unit_wrench(const Model& model, const W& work, int load);

// A force and a moment on a frame, frame axes.
struct FrameWrench {
  int frame = 0;
  Vec6 F = Vec6::Zero();
};

// What acts on frames: forces, torques, spring-dampers, bushings and the springs of loop joints. Positions and velocities come first.
std::vector<FrameWrench> frame_wrenches(const Model& model, Work& work);

// Uniform loads on a part of a beam, N per metre of its length, part axes.
Vec3 load_per_length(const Model& model, const Work& work, int part);

// What a force of the scene does at the state in `work`. loads: indices in Model::loads, several where it acts on a chain of parts.
struct LoadState {
  double length = 0.0, rate = 0.0;  // spring-damper: m, m/s
  double force = 0.0;               // spring-damper: N, positive where it pulls; force, torque, uniform load: its value; contact: the
                                    // normal force; drag: its size
  Vec6 wrench = Vec6::Zero();       // bushing: on `on` about its origin, axes of `from`
  Vec3 turn = Vec3::Zero();         // bushing: rotation vector of `on` seen from `from`, rad, at most half a turn
  double power = 0.0;               // W, into the mechanism
};
LoadState load_state(const Model& model, Work& work, const std::vector<int>& loads);

// Force or moment of a joint's spring and damper on its rates, or on the coordinate of a joint that closes a loop. N, N m.
VecX tree_spring_force(const Part& part, const Work& work);
double loop_spring_force(const Model& model, Work& work, int loop);

// Energy stored in joint springs, stops and spring-dampers, J.
double spring_energy(const Model& model, const Work& work);

// Power that dampers (structural, joints, spring-dampers) and friction take out, W, >= 0.
template <class W>
double dissipated_power(const Model& model, const W& work);

}  // namespace flexframe::sim
