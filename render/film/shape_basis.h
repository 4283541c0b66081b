// The deformation of a mesh over a whole sequence as a few fixed shapes times weights: what formats with morph targets hold.
//
// Shapes are the left singular vectors of snapshots (proper orthogonal decomposition: Sirovich, "Turbulence and the dynamics of coherent
// structures", 1987, method of snapshots); weights are the projections of every picture, so the error left is known and reported.
#pragma once

#include "render/film/animation.h"

#include <span>
#include <vector>

namespace flexframe::film {

struct ShapeBasis {
  Eigen::MatrixXf shapes;   // 3 M x n: x y z of vertex 0, of vertex 1, ...; the largest entry of each is 1
  Eigen::MatrixXf weights;  // n x pictures, m
  double largest = 0.0;     // m, displacement of any vertex in any picture
  double error = 0.0;       // m, largest difference from what is drawn
};

// body: index among the animation's bodies, a flexible one. As many shapes as keep the snapshots to `relative` of their largest
// displacement (root mean square), at most 64.
ShapeBasis make_shape_basis(const Animation& animation, int body, double relative = 1e-4);

// The same of what `settings` colour the body by: one number per shading point (M rows), in the units of the colours. Not one shape: the
// body has no such numbers (`largest` negative), or they are zero throughout.
ShapeBasis make_value_basis(const Animation& animation, const RenderSettings& settings, int body, double relative = 2e-3);

// The same of the stress as vectors whose length it is (update_stress_vectors): `width` numbers a shading point; exact where a body's
// stress is linear in few coordinates. Width 0: its stress is no such length.
struct VectorBasis {
  int width = 0;
  ShapeBasis basis;
};
VectorBasis make_stress_basis(const Animation& animation, const RenderSettings& settings, int body, double relative = 1e-4);

// Weights of the shapes that come nearest to a displacement of the vertices (3 M).
Eigen::VectorXf shape_weights(const ShapeBasis& basis, std::span<const float> displacement);

}  // namespace flexframe::film
