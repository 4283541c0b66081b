// Cross-sections of beams: area, moments, torsion constant, shear factors and outline from a shape and its sizes.
//
// The section lies in the body's yz plane, its centroid on the x axis. Widths run along z, heights along y: a beam that bends in the
// xy plane (bending_xy) has the depth `height` and iz = width height^3 / 12. Torsion constants: circle and tube exact; rectangle by
// Saint-Venant's series (exact); box by Bredt's closed-cell formula plus the walls' own; I, U, T, L as the sum of the exact
// constants of their rectangles (thin-walled open section, fillets left out, the error of order t/b). Warping is left free.
// Shear factors: circle 6/7 and rectangle 5/6 at poisson 0 (Cowper 1966), tube Cowper's, thin-walled sections area of the web(s)
// over the area. Sources: Timoshenko, Goodier: Theory of Elasticity, art. 109; Young, Budynas: Roark's Formulas, table 10.7;
// Cowper: The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33, 1966.
#pragma once

#include "sim/scene/scene.h"

#include <map>
#include <span>
#include <string>
#include <vector>

namespace flexframe::sim {

// The known shapes: circle tube rectangle box i u t l general.
std::span<const std::string> section_shapes();

// The sizes of a shape. Each inner list is one alternative set of required names.
// circle {diameter | radius}; tube {outer_diameter (or diameter), thickness | inner_diameter}; rectangle {width, height | y, z};
// box {width, height, thickness | width, height, web, flange}; i, u, t {height, width, web, flange}; l {height, width, thickness};
// general {area, iy, iz, j [, iyz, shear_y, shear_z, rotary_iy, rotary_iz]}.
std::vector<std::string> section_sizes(const std::string& shape);

// sizes in m (general: m^2, m^4). Throws InputError: missing, unknown, not positive, walls thicker than the section, a general
// section whose moments no area can have (iyz^2 > iy iz).
Section make_section(const std::string& shape, const std::map<std::string, double>& sizes);

// Moments iy, iz, iyz of the mass over the density, m^4: the area's, or those of `rotary_iy` and `rotary_iz`; whether there are such.
Vec3 mass_moments(const Section& section);
bool has_rotary(const Section& section);

// Shear centre (y, z) from the centroid, m, of thin walls by their middle lines (Timoshenko, Strength of Materials I, art. 53): I, U, T, L;
// zero for the others.
Eigen::Vector2d shear_centre(const Section& section);

// Among the sizes: turn of the section about x, from y towards z, rad.
inline constexpr const char* section_angle = "angle";

// Torsion constant of a solid rectangle with the sides a and b, m^4 (series, relative error below 1e-14).
double rectangle_torsion_constant(double a, double b);

}  // namespace flexframe::sim
