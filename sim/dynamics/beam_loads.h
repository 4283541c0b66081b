// Before a run: what a beam whose effect `stiffening` is off leaves out.
#pragma once

#include "sim/dynamics/work.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// One sentence for every beam of one body without stiffening whose bending frequency an axial force or a rotation changes by more than
// 1 %, from bounds known before the run: rates of prescribed motions and of the start across the beam's axis, given forces and the own
// weight along it (at the start's orientation). `work` holds the assembled start; expressions are evaluated from 0 to the run's end.
std::vector<std::string> neglected_stiffening(const Model& model, const Scene& scene, const Work& work);

}  // namespace flexframe::sim
