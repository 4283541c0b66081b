// Small motions about the start: complex modes of the whole mechanism, with damping, gyroscopic and circulatory terms and steady rotation.
#pragma once

#include "sim/start/complex_modes.h"
#include "sim/time/system.h"

#include <complex>

namespace flexframe::sim {

struct LinearMode {
  enum Kind { unstable, rigid, vibration, overdamped };
  Kind kind = rigid;
  std::complex<double> pole;  // rad/s; of a pair the one with Im >= 0. rigid: 0 (the motion meets no stiffness)
  double frequency = 0.0;     // Hz, |Im| / 2 pi
  double growth = 0.0;        // 1/s, > 0: unstable, the real part
  double damping = 0.0;       // -Re / |pole|; 1: overdamped, < 0: unstable
  VecX shape;                 // rates of w_all in phase with the largest entry, which is 1
  VecX quadrature;            // and a quarter of a period ahead of it
};

// Ascending: unstable first, then rigid modes, then vibrations, then what only decays.
struct Linearisation {
  std::vector<LinearMode> modes;
  bool equilibrium = true;    // the state's accelerations vanish; otherwise it is linearised about a state that it leaves
  bool moving = false;        // about a steady motion: rates of the start, or prescribed ones, are not zero
  bool constant = true;       // the equations' coefficients stay the same as the motion goes on
  bool turning_axes = false;  // frequencies as seen from bodies that turn: seen from outside they differ by multiples of the turning rate
  std::vector<std::string> notes;     // what to know about the state, one sentence each
  std::vector<std::string> warnings;  // what the modes leave out although it may change them
  SecondOrder equations;  // of the independent directions (directions.h), in their units; those of what has mass where something has none
  MatX rates;             // w_all x n: rates that unit rates of the directions make
};

// About the positions in system.work at its time (assembled: 0). Where the start's rates are those of a steady motion (a spinning top, a
// rotor, a body that spins freely) they count, and so do the rates of prescribed motions at that time, taken as constant; rates of the
// start that are no steady motion count as zero, and a note says so. A body without joints may fall or fly: the modes are those beside that
// motion.
//
// States of continuous blocks move along (PID, filters: a lag may make a mechanism unstable); what sampled blocks put out is held, and a
// warning says so.
//
// M is exact, K and D hold structural stiffness and damping exactly and all else (gravity, forces, springs, dampers, geometric stiffness,
// centrifugal and gyroscopic terms) by central differences of sixth order of the forces at rest (inverse_dynamics.h), entry by entry with
// an estimate of their error; complex_modes.h sets to zero what their error does not resolve. Bodies that turn freely about a fixed axis
// are described in axes that do not turn with them where the coefficients are constant in those, else in their own. Throws SimulationError
// for a mechanism without inertia.
Linearisation linearise(const System& system);

// Whether small motions about a start at rest are known to be stable without their modes, for a tenth of the price: a positive definite
// stiffness, symmetric to 1e-4 of its softest motion, and a damping that feeds nothing are proof of it (Kelvin, Tait), where they are so
// beyond the digits of either. False says nothing: rigid modes, follower loads, blocks, rates and what has no mass are for linearise.
bool surely_stable(const System& system);

// The note of equations that are not constant.
inline constexpr const char* equations_change =
    "the linearised equations change as the mechanism moves: frequencies and damping hold at t = 0 only and do not decide stability";

// Contacts whose friction is no part of small motions, and the sentence that says so.
bool has_contact_friction(const Model& model);
inline constexpr const char* free_by_friction =
    "friction of contacts holds nothing in small motions: what rests by it alone counts as free, with the friction's damping";

}  // namespace flexframe::sim
