// Forward dynamics: accelerations of all coordinates, by an articulated-body recursion over clusters, cost O(number of clusters).
#pragma once

#include "sim/dynamics/work.h"

namespace flexframe::sim {

// Values of the expressions, and jets of prescribed motions, at t (s), within the segment frozen in work's copy.
void update_expressions(Model& model, double t, Work& work);

// Positions, closing every loop from work.q; then twists from the independent rates in work.w. elastic_masses: as in update_mass
// (body_terms.h).
void update_positions(const Model& model, Work& work, bool elastic_masses = true);
void update_velocities(const Model& model, Work& work);
// Accelerations work.wdot (all rates) and the accelerations A of the parts. Positions and velocities come first.
// Throws SimulationError naming a joint that moves without inertia.
void update_accelerations(const Model& model, Work& work);

struct Energy {
  double kinetic = 0.0, strain = 0.0, potential = 0.0;
};
// Energies of bodies, springs and gravity, J. Positions and velocities come first. body >= 0: of one scene body only.
Energy compute_energy(const Model& model, const Work& work, int scene_body = -1);

// Applied force on each rate of a joint (springs, dampers, stops, friction): out(nv), N or Nm.
void joint_forces(const Part& part, const PartWork& p, const Work& work, VecX& out);

}  // namespace flexframe::sim
