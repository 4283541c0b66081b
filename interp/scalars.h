// Fields known at some nodes -> values at the vertices, for what is drawn as colour and moves nothing: stresses, temperatures.
//
// The geodesic partition of unity of the kernel map (partition.h) without rigid arms: each component for itself, linear fields exactly. The
// kernel is |r|, which shoots over far less than r^3 where a field is steep, as stress is at a notch; its kinks at the nodes no colour
// shows.
#pragma once

#include "interp/types.h"

#include <span>

namespace flexframe::interp {

// values: (parts N) x F, F fields of `parts` components: row parts i + c is component c at node i. Returns (parts M) x F alike for the
// vertices, float32, so that a modal body's field is apply_modes of it (ModeColumns). Nodes at one place (to 1e-6 of the mesh) count as
// one, with their mean. Throws InputError on wrong sizes, numbers that are not finite, a mesh without faces.
Eigen::MatrixXf map_scalars(const Points& nodes, const MeshView& mesh, int parts, const Eigen::Ref<const Eigen::MatrixXd>& values);

// Of M stresses xx yy zz xy yz xz, 6 M floats; out M, in their unit.
// Von Mises equivalent.
void compute_von_mises(std::span<const float> stress, std::span<float> out);
// Principal stress: 0 the smallest, 1 the middle one, 2 the largest (tension is positive); by the cosine of a third of the angle whose
// cosine is the third invariant of the deviator (O. K. Smith, Eigenvalues of a symmetric 3 x 3 matrix, Comm. ACM 4, 1961).
void compute_principal(std::span<const float> stress, int which, std::span<float> out);
// Tresca equivalent: largest less smallest principal stress.
void compute_tresca(std::span<const float> stress, std::span<float> out);

}  // namespace flexframe::interp
