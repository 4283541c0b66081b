// Steady response of outputs to a force that varies as a sine, for small motions about the start at rest.
//
// M x'' + D x' + K x = F e^(i w t) with the matrices of linearise.h; y = (C + i w C') x with the outputs' derivatives by coordinates and
// rates (central differences); an output of the force's own value has that 1 besides. Outputs with a corner at the start (an angle or a
// distance that is zero there) follow no sine and are left out. A force's F is the power that its unit value has at unit rates. Continuous
// blocks with states z that the motion drives, z' = A z + B x + B' x', and whose outputs act as the forces G z, add
// -G (i w - A)^-1 (B + i w B') to the stiffness.
#pragma once

#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

struct FrequencyResponse {
  std::string force;                        // that it answers
  std::vector<std::string> columns, units;  // of the outputs
  VecX frequencies;                         // Hz, those that were asked for
  Eigen::MatrixXcd values;                  // columns x frequencies: unit of the output per N (N m, N/m)
  std::vector<std::string> left_out;        // outputs without a linear answer: energies, reactions, section forces, corners at the start
  std::vector<std::string> notes;           // on the state about which motions are small
  std::vector<std::string> warnings;        // what the response is without although it may change it
  std::vector<double> modes, damping;       // Hz, ascending: frequencies of the vibrations; their shares of critical damping
};

// force: name of a force, torque or distributed force of the scene. frequencies: Hz, > 0. Throws InputError: unknown force, a
// start that moves or is no equilibrium, springs that hold what has no mass, sampled blocks that forces read.
FrequencyResponse frequency_response(const System& system, const std::string& force, const VecX& frequencies);

}  // namespace flexframe::sim
