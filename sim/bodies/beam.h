// Makers of elastic beams: every beam of the seeds as a FlexibleBody or as a chain of them. Theory and limits: sim/BEAMS.md.
//
// The beam lies along +x of its body frame from the root (x = 0) to the tip (x = L); its section is the same all along, given about
// its centroid. Elastic fields: lengthening u, deflections v (in xy) and w (in xz), twist theta; a section turns by (theta, -w', v').
// Euler-Bernoulli: of the sections' rotary inertia about y and z what is alike is left out; that about x (rho (Iy + Iz)) is kept.
// Timoshenko shear with all of it is an option of finite elements.
//
// The frame's boundary says which deformations exist relative to the body frame (it is no joint):
//   clamped_free         u v w theta and slopes zero at the root
//   supported_supported  u v w theta zero at the root, v w at the tip
//   supported_free       u v w theta zero at the root; the rigid rotation belongs to the frame: int x v dm = int x w dm = 0
//   free_free            mean axes: int u dm = int v dm = int w dm = int x v dm = int x w dm = int theta dm = 0
//   clamped_clamped      everything zero at both ends
//   clamped_supported    clamped at the root, v w zero at the tip
//
// Sources: Schiavo, Ferretti, Vigano 2005 eq. 30-38; Heckmann et al. 2006 eq. 4, 8-10; Chudnovsky et al. 2006
// (lumped); Friedman, Kosmatka 1993 for the shear-flexible element.
#pragma once

#include "sim/bodies/flexible_body.h"
#include "sim/scene/scene.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace flexframe::sim {

// Which elastic coordinates and terms exist. All false: the rigid beam (n = 0).
struct BeamEffects {
  bool axial = false;
  bool bending_xy = false;
  bool bending_xz = false;
  bool torsion = false;
  bool stiffening = false;     // the second-order displacement field (Heckmann et al. 2006 eq. 8): geometric stiffness, foreshortening
  bool shear = false;          // Timoshenko shear and rotary inertia, finite elements only
  bool large_bending = false;  // followed to any turn (RodAxis): with stiffening, bending in one plane and no torsion
  bool complete = false;       // kinetic energy of the axis's particles (axis_mass.h) also without torsion
};

// Finite elements: u and theta linear, v and w cubic, consistent mass; BeamDef::elements elements of equal length (at
// most 1500 coordinates).
// Coordinates node by node from root to tip: u v v' w w' theta (those that exist); in free_free and supported_free they are relative
// to the chord, and the frame is moved to the mean axes. Nodes: root, tip, BeamDef::frames (by name), node[0] .. node[elements].
// The series' second-order displacements are left out where they would need more than 4e6 numbers; root, tip and frames have them.
// Throws InputError for unusable numbers.
FlexibleBody make_fe_beam(const BeamDef& def, const BeamEffects& effects);

// The same in two steps: a body that is to have few other coordinates does not pay for constants of second order in all of the elements'.
class FeBeam {
 public:
  // As make_fe_beam, with its errors.
  FeBeam(const BeamDef& def, const BeamEffects& effects);
  ~FeBeam();
  // All but the constants of second order (md2, J2, Cr1, the nodes' phi2).
  const FlexibleBody& linear() const;
  // Adds these to it, or to the linear body in coordinates q, the elements' ones = T q.
  void add_second_order(FlexibleBody& body) const;
  void add_second_order(const MatX& T, FlexibleBody& body) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

// Eigenforms of the Euler-Bernoulli beam with the boundary's ends (Heckmann et al. 2006 eq. 8-10), chosen in BeamDef::modes: direction
// (axial, bending_xy, bending_xz, torsion) -> ordinal numbers 1 .. kMaxMode; a direction whose effect is off is left out. An empty map
// means bending 1 2 3, axial 1, torsion 1 of the effects that are on. Coordinates: by direction in the order above, then as listed. Forms
// are normalised to int phi^2 dx = L: q has the unit of the displacement, the modal mass is the beam's mass (twist: rho (Iy + Iz) L).
// Damping: 2 zeta omega on the diagonal, ratios in the order of the coordinates, the last for all further ones. Nodes: root, tip,
// BeamDef::frames, station[0] .. station[K], 4 a half wave of the highest form and at least 10 intervals. Throws InputError for unusable
// numbers and for the effect shear.
FlexibleBody make_modal_beam(const BeamDef& def, const BeamEffects& effects);

// Exact to the last digits up to here (beam_eigenforms.h); the Euler-Bernoulli beam itself ends long before.
inline constexpr int kMaxMode = 200;

// A beam of several bodies in a row, for large deformations: piece i + 1 hangs with its root on the tip of piece i by link i.
struct BeamPiece {
  std::string name;    // "volume[0]", "element[3]"
  FlexibleBody body;   // its own frame: origin at the piece's root, x along the piece
  double start = 0.0;  // x of its root in the undeformed beam, m
};

// Elastic joints of a lumped beam. theta_i: rotation of piece i + 1 relative to piece i about x y z of piece i (a rotation vector; small
// between neighbours), zero about the axes that are not free. Moments on piece i + 1, about the same axes:
//   m = -S A (theta + time_constant dtheta/dt) over the links, A = C^-1, C symmetric tridiagonal (metres): diagonal[i], off[i] = C(i, i+1).
// off empty: the local spring of Chudnovsky et al. 2006, m_i = -S theta_i / diagonal[i].
struct BeamLinks {
  std::array<bool, 3> free = {false, false, false};  // about x (torsion), y (bending_xz), z (bending_xy); none: welds
  Mat3 section = Mat3::Zero();                       // S: diag(GJ, EIy, EIz) and -EIyz, N m^2
  std::vector<double> diagonal, off;                 // of C, m
  double time_constant = 0.0;                        // Kelvin-Voigt damping, s
};

struct BeamChain {
  std::vector<BeamPiece> pieces;  // root to tip
  BeamLinks links;                // between neighbours: pieces.size() - 1
};

// A mixed beam (Schiavo et al. 2005 section 3.4) is BeamDef::volumes beams welded end to end (piece_of), each of BeamDef::elements finite
// elements, or make_modal_volume where BeamDef::modes is not empty. Volumes have mean axes (free_free) whatever BeamDef::boundary says:
// the same deformations, but a bent and twisted volume is then followed to fourth order of its length instead of third (clamped_free) or
// first (supported_supported); BEAMS.md section 7.

// A volume of a mixed beam with modes (Craig, Bampton 1968): of every effect that is on the static forms of its ends (constant and
// linear curvature, uniform elongation and twist) and besides the eigenforms between clamped ends with the numbers of BeamDef::modes.
// Eigenforms alone cannot carry the constant moment that the next volume passes on. Frame on mean axes; coordinates: by direction the
// static forms (Legendre polynomials), then the eigenforms. Nodes as of make_modal_beam. BeamDef::damping by its modes.
FlexibleBody make_modal_volume(const BeamDef& def, const BeamEffects& effects);

// Lumped beam (Chudnovsky et al. 2006): BeamDef::elements generalised elements of length l, each rigid half - joint in the middle - rigid
// half, stiffness E I / l, G J / l; axial makes the pieces extensible. BeamDef::curvature_coupling: moments vary linearly from joint to
// joint, so that a joint's angle depends on its neighbours' moments too; static deflections under end loads are then exact.
// Effects stiffening (rigid pieces have it all) and shear have no meaning here: the first is ignored, the second refused.
BeamChain make_lumped_beam(const BeamDef& def, const BeamEffects& effects);

// In mixed and lumped beams damping.ratio[0] is the ratio of the first bending mode (of the first mode where nothing bends) of the beam
// with its boundary, by Kelvin-Voigt damping: the ratio of a mode grows with its frequency. damping.stiffness adds to the time constant;
// damping.mass is refused.

// Their Kelvin-Voigt time constant, s.
double chain_time_constant(const BeamDef& def, const BeamEffects& effects);

// Moments of the links' springs, size 3 x links, from angles of that size (add time_constant times the rates for damping). O(links).
Mat3X link_moments(const BeamLinks& links, const Mat3X& theta);

// One sentence where the Euler-Bernoulli beam stops being valid for this beam (slenderness, high modes), empty where it is fine.
std::string beam_validity_note(const BeamDef& def, const BeamEffects& effects);
// The same for bending in both planes.
std::string beam_validity_note(const BeamDef& def);

}  // namespace flexframe::sim
