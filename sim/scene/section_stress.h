// Stress in the section of a beam from the strains of the section (section_strain.h).
//
//   sigma_xx = E (u' - y v'' - z w'')                   = N/A and M c/I about both axes, also of sections with iyz
//   tau = G theta' s(y, z)                              Saint-Venant torsion; s per shape as below, so that the torque is G j theta'
//   von Mises = sqrt(sigma_xx^2 + 3 tau^2)
//
// s: circle and tube (-z, y), exact; rectangle the series of Timoshenko, Goodier, Theory of Elasticity, art. 109, exact; box Bredt's T / (2
// Am t), the mean over the wall's thickness; I, U, T, L each strip as a rectangle (t on its long sides). Left out: shear from transverse
// forces (zero where bending is largest; V/A against M c/I is section height over beam length), warping that is held, concentrations in
// fillets and at loads.
#pragma once

#include "sim/scene/scene.h"

namespace flexframe::sim {

// Whether points of the section have a stress: a `general` section has moments but no shape.
bool has_stress(const Section& section);

// (tau_xy, tau_xz) over G theta' at the point (y, z), m from the centroid; points outside the section count as the nearest of its surface.
// m.
Eigen::Vector2d torsion_shear(const Section& section, double y, double z);

// Strains of a section: u', v'', w'', theta'.
using SectionStrains = Eigen::Vector4d;
// Von Mises stress, Pa, at (y, z) where torsion_shear has the length s.
double section_von_mises(const SectionStrains& strains, double youngs_modulus, double shear_modulus, double y, double z, double s);

}  // namespace flexframe::sim
