// What layered shells leave out where their layers shear one by one.
//
// The normal of a shell stays straight: soft cores and layers shear with it as one, by the stiffness S of all (fe_sections). In short waves
// stiff layers bend each about its own middle besides, which a straight normal has too little of: frequencies are too low and deflections
// too large. To the first order of that, of the bending energy U and the shear energy V of a mode, the share R V^2 / (U (U + V)) of U + V
// is missing; R by layer_warping. As told by layers of solids: REDUCE.md.
#pragma once

#include "sim/reduce/fe_system.h"

namespace flexframe::sim {

// By how much the frequency of each field of U (size of the system x m, M-orthonormal modes), whose squared frequencies are `eigenvalues`
// ((rad/s)^2), is too low: its relative error.
VecX layer_error(const FeModel& model, const FeSystem& system, const MatX& U, const VecX& eigenvalues);

}  // namespace flexframe::sim
