// Small vibrations about a state at rest, or turning steadily where prescribed motions do: natural frequencies, damping and unstable
// poles of the whole mechanism.
#pragma once

#include "sim/time/system.h"

namespace flexframe::sim {

struct LinearMode {
  double frequency = 0.0;   // Hz, of the undamped system; 0 for a rigid or unstable mode
  double growth = 0.0;      // rad/s, > 0: an unstable real pole
  double damping = 0.0;     // damping ratio
  VecX shape;               // rates of w_all, largest entry 1
};

// Ascending: unstable first, then rigid modes, then vibrations.
struct Linearisation {
  std::vector<LinearMode> modes;
  bool equilibrium = true;  // the state's accelerations vanish; otherwise it is linearised about a state that it leaves
};

// About the positions in system.work (assembled), free rates zero, prescribed ones those of t = 0 and taken as constant (a rotor:
// centrifugal and gyroscopic terms count, and the modes are those of the full first-order system, damping included). The elastic stiffness enters exactly; gravity, forces, springs
// and geometric stiffness by central differences of the accelerations. Throws SimulationError for a mechanism without inertia.
Linearisation linearise(System system);

}  // namespace flexframe::sim
