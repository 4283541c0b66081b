// The motion of results at any time: poses, node displacements and coordinates between the samples.
//
// Between two samples positions, displacements and coordinates run linearly, orientations along the shortest turn (slerp), and a
// time within 1e-9 of a sample's spacing takes that sample bit for bit. With samples h apart the error is h^2/8 times the acceleration:
// at 1000 samples a second and 100 m/s^2 that is 13 micrometres.
#pragma once

#include "interp/types.h"
#include "sim/base/spatial.h"
#include "sim/bodies/body_file.h"
#include "sim/results/results.h"

#include <glm/glm.hpp>

#include <vector>

namespace flexframe::film {

// The place of a time among the samples: sample `index` and a share 0 <= share < 1 of the next.
struct SamplePlace {
  Eigen::Index index = 0;
  double share = 0.0;
};

// times must rise; before the first and after the last sample the motion stands still.
SamplePlace find_sample(const sim::VecX& times, double t);

// World from body.
glm::dmat4 body_pose(const sim::ResultBody& body, const SamplePlace& place);
// The same between any two samples, share (0 to 1) of the way from one to the other.
glm::dmat4 pose_between(const sim::ResultBody& body, Eigen::Index from, Eigen::Index to, double share);
glm::dmat4 joint_pose(const sim::ResultJoint& joint, const SamplePlace& place);

// Displacements and rotation vectors of the nodes, nn x 3; rotations 0 x 3 where the results have none. Memory is reused.
void node_motion(const sim::ResultBody& body, const SamplePlace& place, interp::Points& displacement, interp::Points& rotation);

// Pose of the frame of the elastic coordinates in the body frame; identity where the results have none.
sim::Pose held_pose(const sim::ResultBody& body, const SamplePlace& place);

// Strains by loads that a beam carries without deforming (sim::ResultBody::load_strain), memory reused; empty: unknown or none.
void load_strains(const sim::ResultBody& body, const SamplePlace& place, std::vector<double>& out);

// What inertia and weight load a body with in the frame of its elastic coordinates, by its places in three samples, `apart` from each other
// (nearest to the ends where the time is near one; fewer than three samples tell of weight alone). gravity: world axes, m/s^2.
sim::InertiaLoads inertia_loads(const sim::ResultBody& body, const sim::VecX& times, const SamplePlace& place, const sim::Vec3& gravity,
                                Eigen::Index apart = 1);

// The largest turn of a body from one sample to the next, rad.
double turn_between_samples(const sim::ResultBody& body);

// Elastic coordinates, memory reused.
void elastic_coordinates(const sim::ResultBody& body, const SamplePlace& place, std::vector<double>& q);

// Times of pictures: the first sample, then every speed / frame_rate seconds as far as the samples reach.
int picture_count(const sim::VecX& times, double frame_rate, double speed);
double picture_time(const sim::VecX& times, double frame_rate, double speed, int picture);

}  // namespace flexframe::film
