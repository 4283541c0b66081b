// Forward dynamics: accelerations of all coordinates, by an articulated-body recursion over clusters, cost O(number of clusters).
// W: Work or PlaneWork.
#pragma once

#include "sim/dynamics/plane_work.h"

namespace flexframe::sim {

// Values of the expressions, and jets of prescribed motions, at t (s), within the segment frozen in work's copy.
void update_expressions(Model& model, double t, Work& work);

// Positions, closing every loop from work.q; then twists from the independent rates in work.w. elastic_masses: as in update_mass
// (body_terms.h).
template <class W>
void update_positions(const Model& model, W& work, bool elastic_masses = true);
template <class W>
void update_velocities(const Model& model, W& work);
// Accelerations work.wdot (all rates) and the accelerations A of the parts. Positions and velocities come first.
// Throws SimulationError naming a joint that moves without inertia.
template <class W>
void update_accelerations(const Model& model, W& work);
// Of the state evaluated last, load by load: change of the independent accelerations and of the power per unit of the load's value, n + 1
// numbers each. Springs and uniform loads have none here: NaN. Empty where more than the loads enters: prescribed motions, clusters that
// carry others.
template <class W>
void load_responses(const Model& model, W& work, VecX& out);

struct Energy {
  double kinetic = 0.0, strain = 0.0, potential = 0.0;
};
// Kinetic and strain energy alone, from the positions and velocities that W has.
template <class W>
Energy energy_of_motion(const Model& model, const W& work);
// Energies of bodies, springs and gravity, J. Positions and velocities come first. body >= 0: of one scene body only.
Energy compute_energy(const Model& model, const Work& work, int scene_body = -1);
// The same of a plane whose positions and velocities `placed` has in space (place_in_space). Gravity lies within the plane.
Energy compute_energy(const Model& model, const PlaneWork& work, const Work& placed, int scene_body = -1);

// Applied force on each rate of a joint (springs, dampers, stops, friction): out(nv), N or Nm.
void joint_forces(const Part& part, const JointWork& at, const VecX& all_q, const VecX& all_w, VecX& out);

}  // namespace flexframe::sim
