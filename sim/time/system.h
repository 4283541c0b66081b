// A scene ready to be integrated: model, work space, and the map between the integrator's state and the mechanism.
//
// State: [q_all; independent rates of every cluster; further states of blocks and contacts; (work supplied, work dissipated) where forces
// or dampers exist]. Dependent coordinates are part of the state only as first guesses of the loop closure, so f(t, y) has no memory.
#pragma once

#include "sim/base/notes.h"
#include "sim/dynamics/friction.h"
#include "sim/dynamics/plane_work.h"
#include "sim/dynamics/work.h"
#include "sim/model/model.h"
#include "sim/time/error_weights.h"
#include "sim/time/integrator.h"

namespace flexframe::sim {

inline constexpr double default_tolerance = 1e-6;

struct System {
  Scene scene;
  Model model;
  Work work;
  // Where the scene moves in a plane: state_rate evaluates it there. Copies of a system share it: every evaluation starts
  // from the state given, but not in two threads at once.
  std::shared_ptr<PlaneMotion> plane;
  bool quadrature = false;  // two more states: work supplied and dissipated, J
  long evaluations = 0;     // of state_rate
  double price = 0.0;       // of one, s (base/work_clock.h)
  double tolerance = default_tolerance;
  FrictionState friction;
  std::vector<int> stops;  // parts whose joint has a stop
  bool driven = false;     // prescribed motions feed in work
  double softened = 1.0;   // StaticSolution::softened
  ErrorWeights weights;
  Notes notes;
};

int state_size(const System& system);

// The state of the mechanism in `work`; `work_done`: the two quadrature values.
VecX pack_state(const System& system, const Eigen::Vector2d& work_done);

// Brings `work` to (t, y): positions, velocities; accelerations too on demand.
void set_state(System& system, double t, const double* y, bool accelerations);
// Coordinates and rates of `work` alone at (t, y), every loop closed: its poses and twists stay where they are in a scene that moves in a
// plane.
void set_rates(System& system, double t, const double* y);
// Coordinates alone (rates stay), the loops' conditions that the partitions leave out looked at: throws as require_closed (closure.h).
void require_closed_loops(System& system, double t, const double* y);
void state_rate(System& system, double t, const double* y, double* dy);
// For OdeProblem: what follow_loads needs of the state that state_rate has evaluated last; and the rates dy of that state brought from
// t0 to t by the loads' values alone. False where that is not all that changes.
void keep_load_responses(System& system, VecX& kept);
bool follow_loads(System& system, double t0, double t, const VecX& kept, double* dy);

// Accelerations at the state in `work`, with friction.
void update_system_accelerations(System& system);

// After set_state with accelerations at (t, y), for outputs: those of m, which nothing else needs, by differences of the rates along the
// motion, and with them the parts' accelerations.
void update_massless_accelerations(System& system, double t, const VecX& y);

// The state packed anew after partitions or locks changed; carries the sizes of the error weights over. quadrature: work so far.
VecX repack_state(System& system, const VecX& old, const std::vector<Partition>& before);

// New partitions where the ones last evaluated have come near a singular position, chosen at state y, time t. True if any changed (the
// state must be packed anew, from work).
bool renew_partitions(System& system, double t, const VecX& y);

// Whether nothing but rounding moves it: a start in static equilibrium under loads that stay as they are.
bool stays_in_equilibrium(const System& system);

}  // namespace flexframe::sim
