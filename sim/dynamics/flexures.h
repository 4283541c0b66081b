// Springs of lumped beams: the moments between their rigid pieces, where a link's moment may depend on its neighbours' angles.
// The angles are coordinates of the tree joints inside the chain, so the moments are generalised forces as they stand; O(links).
#pragma once

#include "sim/dynamics/plane_work.h"
#include "sim/model/model.h"

namespace flexframe::sim {

// Adds the moments to PartMotion::tau of the parts that carry the links, Nm. W: Work or PlaneWork.
template <class W>
void add_flexure_moments(const Model& model, W& work);

// Energy in the springs of one body (-1: of all) at the coordinates q_all, J.
double flexure_energy(const Model& model, const VecX& q_all, int scene_body = -1);

// Power that the links' damping takes out, W, >= 0.
double flexure_power(const Model& model, const VecX& w_all);

// Adds the links' stiffness and damping to K and D, n x n. N (w_all x n): rates of w_all per unit coordinate.
void add_flexure_matrices(const Model& model, const MatX& N, MatX& K, MatX& D);

// From now on the springs' moments are the constant ones of the present angles.
void hold_flexures(Model& model, const Work& work);

// Highest frequency of the links about the axes that are free, rad/s: that of the shortest wave, two links long.
double flexure_frequency(const Flexure& flexure);

}  // namespace flexframe::sim
