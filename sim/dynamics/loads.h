// Applied forces: scene forces, spring-dampers, joint springs, dampers, stops.
#pragma once

#include "sim/dynamics/work.h"

#include <vector>

namespace flexframe::sim {

// Fills PartWork::load and load_e from the scene's forces. Positions and velocities come first.
void update_loads(const Model& model, Work& work);

// A force and a moment on a frame, frame axes.
struct FrameWrench {
  int frame = 0;
  Vec6 F = Vec6::Zero();
};

// What acts on frames: forces, torques, spring-dampers, bushings and the springs of loop joints. Positions and velocities come first.
std::vector<FrameWrench> frame_wrenches(const Model& model, Work& work);

// Uniform loads on a part of a beam, N per metre of its length, part axes.
Vec3 load_per_length(const Model& model, const Work& work, int part);

// Energy stored in joint springs, stops and spring-dampers, J.
double spring_energy(const Model& model, const Work& work);

// Power that applied forces feed into the mechanism (scene forces, prescribed motions excluded), W.
double applied_power(const Model& model, const Work& work);

// Power that the joints' own dampers and stops take out, W, >= 0.
double joint_dissipated_power(const Model& model, const Work& work);

// Power that dampers (structural, joints, spring-dampers) and friction take out, W, >= 0.
double dissipated_power(const Model& model, const Work& work);

}  // namespace flexframe::sim
