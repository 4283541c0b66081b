// Forces and moments in the sections of beams, from what acts beyond each section: joints, forces, weight and inertia (a free-body cut).
// They need no stiffness, so that they are also there where the model has no deformation that goes with them.
#pragma once

#include "sim/dynamics/reactions.h"
#include "sim/dynamics/work.h"

#include <array>
#include <vector>

namespace flexframe::sim {

// One part of a beam (a whole beam, a volume of a mixed one, a piece of a lumped one), cut at ascending places x.
struct CutBeam {
  int part = -1;
  int body = -1;                 // of the scene
  double mass_per_length = 0.0;  // kg/m
  Mat3 rotary = Mat3::Zero();    // of the sections per length, section axes, kg m: what the part's inertia has of it
  bool turns = false;            // it is there about y and z too, and turns with the sections
  bool tilts = false;            // with their slopes too, not with their twist alone (the effect shear)
  bool shortens = false;         // where it bends (the effect stiffening)
  std::vector<double> x;         // m from the part's root: its nodes, what joints and loads hold, and points between them
  double longer = 1.0;           // length of a curved axis over that of the part, which is its chord
  std::vector<Vec3> beside;      // from the part's axis to the curved one, at each place
  MatX shapes;                   // 6 rows a place: displacement and rotation per elastic coordinate (cubic and straight between nodes)
  // Of the state last evaluated: place and axes of every section in the part's body frame, and the wrench that the outboard side exerts on
  // the inboard one [N Vy Vz T My Mz] about the section's centre, section axes, at both ends of every interval (N, Nm; tension positive).
  std::vector<Vec3> place;
  std::vector<Mat3> axes;
  MatX moved = {};  // shapes times the elastic coordinates, their rates and their accelerations: 6 rows a place, 3 columns
  Vec3 shift(size_t at, int order) const { return moved.block<3, 1>(6 * static_cast<Eigen::Index>(at), order); }
  Vec3 turn(size_t at, int order) const { return moved.block<3, 1>(6 * static_cast<Eigen::Index>(at) + 3, order); }
  // What bending moves the places by beyond first order: its rate and its acceleration, body frame, m/s and m/s^2.
  std::vector<Vec3> beyond_rate, beyond_second;
  std::vector<Vec6> left, right;  // x.size() - 1
};

class SectionForces {
 public:
  // All beams of the model; frames that are added to it later are not known.
  SectionForces(const Model& model, const Scene& scene);

  // At the state in `work`: positions, velocities, accelerations, loads and reactions come first. O(sections).
  void evaluate(const Model& model, Work& work, const Reactions& reactions);

  const std::vector<CutBeam>& beams() const { return beams_; }
  // Where a frame of the model sits: index into beams() and into x; {-1, -1} where it is on no beam.
  std::array<int, 2> at(int frame) const { return at_[frame]; }

 private:
  void collect(const Model& model, Work& work, const Reactions& reactions);
  void cut(const Model& model, const Work& work, size_t beam);

  std::vector<CutBeam> beams_;
  std::vector<std::array<int, 2>> at_;
  std::vector<std::vector<Vec6>> acting_;  // a beam, a place: what acts there, part axes, about the place
};

}  // namespace flexframe::sim
