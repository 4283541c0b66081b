// How near to buckling the loads of a static start press its beams.
//
// At rest one frame's displacement field errs by a share of the elastic forces (linear_limit.h). A beam that is pressed gives way to such
// an error as to a load, by 1 / (1 - P/Pcr); beyond buckling the elastica stiffens with its bend only, P/Pcr = 1 + turn^2 / 8, so that the
// stiffness left is turn^2 / 4 of the beam's own.
#pragma once

#include "sim/run/linear_limit.h"
#include "sim/time/system.h"

#include <array>
#include <vector>

namespace flexframe::sim {

// The pull along a beam of one frame.
struct PulledBeam {
  int body = -1;                             // of the scene
  std::vector<double> x;                     // m from the root, ascending
  std::vector<std::array<double, 2>> pulls;  // N at both ends of every interval
};

// At the state in `system`, which is at (t, y). Empty where it has no accelerations.
std::vector<PulledBeam> pulled_beams(System& system, double t, const VecX& y);

// What beams that are pressed so far at the first of the results err by at rest. P/Pcr is Rayleigh's quotient of their own deflection from
// the joints that hold them: work of the pull on what it shortens over the energy of bending.
void give_way(const Scene& scene, const std::vector<PulledBeam>& pulled, const Results& results, std::vector<LinearLimit>& limits);

}  // namespace flexframe::sim
