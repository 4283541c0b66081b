// Stress in the section of a beam from the strains of the section (section_strain.h).
//
//   sigma_xx = E (u' - y v'' - z w'')                   = N/A and M c/I about both axes, also of sections with iyz
//   tau = G theta' s(y, z) + E S(y, z) [v''' w''']      Saint-Venant torsion, so that the torque is G j theta', and transverse forces
//   von Mises = sqrt(sigma_xx^2 + 3 |tau|^2)
//
// S: circle and tube Saint-Venant's exact solution with the material's Poisson's ratio. Others by Jourawski's formula, what the change of
// sigma_xx along the beam leaves on a cut through the section; the forces are -E (Iz v''' + Iyz w''') along y and -E (Iy w''' + Iyz v''')
// along z. Rectangle: cuts across its height and its width. Box, I, U, T, L: cuts across the walls; forces across a wall are not in it. The
// shear centre is taken to be the centroid, as by the beams themselves.
//
// s: circle and tube (-z, y), exact; rectangle the series of Timoshenko, Goodier, Theory of Elasticity, art. 109, exact; box Bredt's T / (2
// Am t), the mean over the wall's thickness; I, U, T, L each strip as a rectangle (t on its long sides). Left out: warping that is held,
// concentrations in fillets and at loads.
#pragma once

#include "sim/scene/scene.h"

namespace flexframe::sim {

// Whether points of the section have a stress: a `general` section has moments but no shape.
bool has_stress(const Section& section);

// (tau_xy, tau_xz) over G theta' at the point (y, z), m from the centroid; points outside the section count as the nearest of its surface.
// m.
Eigen::Vector2d torsion_shear(const Section& section, double y, double z);

// (tau_xy, tau_xz) over E v''' (first column) and over E w''' (second) at the same point. m^2.
Eigen::Matrix2d force_shear(const Section& section, double y, double z, double poisson);

// Strains of a section: u', v'', w'', theta'.
using SectionStrains = Eigen::Vector4d;
// What the stress at a point of the section depends on beside its strains.
struct SectionPoint {
  double y = 0.0, z = 0.0;                            // m from the centroid
  Eigen::Vector2d torsion = Eigen::Vector2d::Zero();  // torsion_shear
  Eigen::Matrix2d force = Eigen::Matrix2d::Zero();    // force_shear
};
// y, z: m from the centroid, in the section's axes. A corner of the polygon that draws a circle or a tube stands for its rim.
SectionPoint section_point(const Section& section, double y, double z, double poisson);
// The same point of the section turned about x by `angle`, rad.
SectionPoint turned(const SectionPoint& point, double angle);
// m; no hole: 0.
struct SectionRadii {
  double outer = 0.0, inner = 0.0;
};
// A circle or a tube, whose outline is a polygon of the same area.
bool is_round(const Section& section);
SectionRadii section_radii(const Section& section);
// Von Mises stress, Pa. bend_rates: v''' and w''', 1/m^2.
double section_von_mises(const SectionStrains& strains, const Eigen::Vector2d& bend_rates, double youngs_modulus, double shear_modulus,
                         const SectionPoint& at);
struct SectionStress {
  double normal = 0.0, shear = 0.0;  // sigma_xx and |tau|, Pa
};
// Both of the same point.
SectionStress stress_at(const SectionStrains& strains, const Eigen::Vector2d& bend_rates, double youngs_modulus, double shear_modulus,
                        const SectionPoint& at);

}  // namespace flexframe::sim
