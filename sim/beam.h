// Makers of elastic beams: every beam of the seeds as a FlexibleBody or as a chain of them. Theory and limits: sim/BEAMS.md.
//
// The beam lies along +x of its body frame from the root (x = 0) to the tip (x = L); its section is the same all along, given about
// its centroid. Elastic fields: lengthening u, deflections v (in xy) and w (in xz), twist theta; a section turns by (theta, -w', v').
// Euler-Bernoulli: the sections' rotary inertia about y and z is left out, that about x (rho (Iy + Iz)) is kept. Timoshenko shear
// with rotary inertia is an option of finite elements.
//
// The frame's boundary says which deformations exist relative to the body frame (it is no joint):
//   clamped_free         u v w theta and slopes zero at the root
//   supported_supported  u v w theta zero at the root, v w at the tip
//   supported_free       u v w theta zero at the root; the rigid rotation belongs to the frame: int x v dm = int x w dm = 0
//   free_free            mean axes: int u dm = int v dm = int w dm = int x v dm = int x w dm = int theta dm = 0
//   clamped_clamped      everything zero at both ends
//   clamped_supported    clamped at the root, v w zero at the tip
//
// Sources: Schiavo, Ferretti, Vigano 2005 (seed 000) eq. 30-38; Heckmann et al. 2006 (seed 001) eq. 4, 8-10; MathWorks 2006 (seed
// 003); Friedman, Kosmatka 1993 for the shear-flexible element.
#pragma once

#include "sim/flexible_body.h"
#include "sim/scene.h"

namespace flexframe::sim {

// Which elastic coordinates and terms exist. All false: the rigid beam (n = 0).
struct BeamEffects {
  bool axial = false;
  bool bending_xy = false;
  bool bending_xz = false;
  bool torsion = false;
  bool stiffening = false;  // the second-order displacement field (seed 001 eq. 8): geometric stiffness, foreshortening
  bool shear = false;       // Timoshenko shear and rotary inertia, finite elements only
};

// Finite elements: u and theta linear, v and w cubic, consistent mass; BeamDef::elements elements of equal length.
// Coordinates node by node from root to tip: u v v' w w' theta (those that exist); in free_free and supported_free they are relative
// to the chord, and the frame is moved to the mean axes. Nodes: root, tip, BeamDef::frames (by name), node[0] .. node[elements].
// The series' second-order displacements are left out where they would need more than 4e6 numbers; root, tip and frames have them.
// Throws InputError for unusable numbers.
FlexibleBody make_fe_beam(const BeamDef& def, const BeamEffects& effects);

// Eigenforms of the Euler-Bernoulli beam with the boundary's ends (seed 001 eq. 8-10), chosen in BeamDef::modes: direction (axial,
// bending_xy, bending_xz, torsion) -> ordinal numbers 1 .. kMaxMode; a direction whose effect is off is left out. An empty map means
// bending 1 2 3, axial 1, torsion 1 of the effects that are on.
// Coordinates: by direction in the order above, then as listed. Forms are normalised to int phi^2 dx = L: q has the unit of the
// displacement, the modal mass is the beam's mass (twist: rho (Iy + Iz) L). Damping: 2 zeta omega on the diagonal, ratios in the
// order of the coordinates, the last for all further ones.
// Nodes: root, tip, BeamDef::frames, station[0] .. station[K], 4 a half wave of the highest form and at least 10 intervals.
// Throws InputError for unusable numbers and for the effect shear.
FlexibleBody make_modal_beam(const BeamDef& def, const BeamEffects& effects);

// Exact to the last digits up to here (beam_eigenforms.h); the Euler-Bernoulli beam itself ends long before.
inline constexpr int kMaxMode = 200;

}  // namespace flexframe::sim
