// Strains of the sections of a scene's beam, as functions of its elastic coordinates, ready for stress (sim/scene/section_stress.h).
//
// Finite elements: deflections are cubic, so an element's curvature is the line that fits the true one best, and its lengthening and twist
// are the true ones' averages; these are exact at the Gauss points (Barlow, Int. J. Numer. Methods Eng. 10, 1976). Between places where
// joints and forces take hold the parabola (of curvature) and the line (of lengthening and twist) through neighbouring elements is taken,
// which is exact under uniform loads; where they take hold section forces may jump, and neither side looks across. Eigenforms: their own
// derivatives. Lumped: the moments of the joints over the stiffness, a parabola to the ends; lengthening from the pieces' middles.
#pragma once

#include "sim/bodies/section_strain.h"
#include "sim/model/model.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// Stations of a beam of the scene, ascending, in the elastic coordinates as the scene counts them (bodies.h); two at one place where
// something takes hold or pieces meet. Empty: no beam, or nothing deforms. `left_out`: axial and torsion, where the scene may ask for them
// and the beam does not deform so: the strains lack what axial forces and torques do.
std::vector<StrainStation> strain_stations(const Model& model, const Scene& scene, int body, std::vector<std::string>& left_out);

}  // namespace flexframe::sim
