// The modes of a body as the scene's joints hold it, and the damping that its ratios ask for there.
//
// Body frame and elastic coordinates move together: x = [t; theta; q], mass matrix M of the undeformed body (flexible_body.h), stiffness
// diag(0, 0, Ke). A joint holds components of its frame's motion, t + theta x p + phi q + (psi q) x (p - c) and theta + psi q, to zero; the
// modes are those of (K, M) on what is left. With mass-normalised modes x_k of frequency omega_k and elastic part q_k,
//
//   De = sum_k (2 zeta_k / omega_k^3) (Ke q_k) (Ke q_k)^T      gives   x_j^T diag(0, 0, De) x_k = 2 zeta_k omega_k delta_jk,
//
// because q_j^T Ke q_k = omega_k^2 delta_jk (Craig, Kurdila, Fundamentals of Structural Dynamics, 2006, ch. 10, for modes that make Me
// diagonal).
#pragma once

#include "sim/bodies/flexible_body.h"
#include "sim/model/supports.h"

#include <span>
#include <vector>

namespace flexframe::sim {

// The supports that hold a body for its modes: those on the ground and the first clamp; where there is no clamp all of them. A joint
// towards a part that moves, on a body that is clamped elsewhere, passes on forces and holds nothing.
std::vector<Support> mounting_of(const Scene& scene, const std::string& body);

// Rows over x that the supports hold to zero; rotations times the body's size. orientation: of every body of the scene, world axes (for
// joints that keep a point on another body's line or plane). Frames that the body lacks hold nothing.
MatX held_rows(const Scene& scene, int body, const FlexibleBody& made, const std::vector<Support>& holds,
               std::span<const Mat3> orientation);

struct MountedModes {
  VecX omega;  // rad/s, ascending, > 0: the elastic ones
  MatX q;      // n x k: elastic parts, x mass-normalised
};

// Empty where the body has no mass in some motion, or nothing is left to vibrate.
MountedModes mounted_modes(const FlexibleBody& body, const MatX& held);

// De of these ratios: one a mode, the last one for all further modes.
MatX mounted_damping(const FlexibleBody& body, const MountedModes& modes, const std::vector<double>& ratio);

// Damping ratio of each mode by the body's own De.
VecX mounted_ratios(const FlexibleBody& body, const MountedModes& modes);

}  // namespace flexframe::sim
