// What a linear elastic body cannot show: deformation whose rotations are not small in its own frame.
#pragma once

#include "sim/model/model.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// A sentence for each flexible body of one piece whose deflection is wrong by more than 3 %, judged by how far its material turned
// against its frame: how far, when, how wrong that makes it, and what to use instead. Beams: the turn of the tangent (torsion alone
// stays right); others: of a node. Linear theory of a clamped beam under an end load P turns its tip by P L^2/2 EI and errs by 0.42 of
// that squared against the elastica (K. E. Bisshopp, D. C. Drucker, Quart. Appl. Math. 3 (1945)).
std::vector<std::string> linear_limit_warnings(const Scene& scene, const Model& model, const Results& results);

}  // namespace flexframe::sim
