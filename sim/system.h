// A scene ready to be integrated: model, work space, and the map between the integrator's state and the mechanism.
//
// State: [q_all; independent rates of every cluster; (work supplied, work dissipated) where forces or dampers exist].
// Dependent coordinates are part of the state only as first guesses of the loop closure, so f(t, y) has no memory.
#pragma once

#include "sim/integrator.h"
#include "sim/model.h"
#include "sim/work.h"

namespace flexframe::sim {

inline constexpr double default_tolerance = 1e-6;

struct System {
  Scene scene;
  Model model;
  Work work;
  bool quadrature = false;        // two more states: work supplied and dissipated, J
  double tolerance = default_tolerance;
  VecX scale;                     // size of every state so far, for the error weights
  std::vector<std::string> notes;
};

// Builds the model and assembles the start (t = 0). Throws InputError.
System make_system(const Scene& scene);

int state_size(const System& system);
int rate_offset(const System& system);              // where the independent rates begin

// The state of the mechanism in `work`; `work_done`: the two quadrature values.
VecX pack_state(const System& system, const Eigen::Vector2d& work_done);

// Brings `work` to (t, y): positions, velocities; accelerations too on demand.
void set_state(System& system, double t, const double* y, bool accelerations);
void state_rate(System& system, double t, const double* y, double* dy);

// Error weights: 1 / (tolerance x size of the component so far). Sizes are those of groups: a body's displacements, a cluster's rates.
void update_scale(System& system, const VecX& y);
void error_weights(const System& system, const double* y, double* weight);

// New partitions where the present ones have come near a singular position. True if any changed (the state must be packed anew).
bool renew_partitions(System& system);

}  // namespace flexframe::sim
