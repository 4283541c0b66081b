// Strains of a beam's sections from its elastic coordinates: lengthening u', curvatures v'' and w'' (of the section's slopes, where shear
// is on), twist theta' at stations along the beam. What stress at any point of the section is made of (section_stress.h).
#pragma once

#include "sim/bodies/beam.h"

#include <array>
#include <map>
#include <vector>

namespace flexframe::sim {

// A linear form of the elastic coordinates: coordinate -> factor.
using CoordinateRow = std::map<int, double>;

// One station; the four rows in the order above.
struct StrainStation {
  double x = 0.0;  // m from the root of the beam
  std::array<CoordinateRow, 4> row;
};

// An element: curvatures at its ends, constant lengthening and twist.
struct ElementStrain {
  double x0 = 0.0, x1 = 0.0;
  CoordinateRow stretch, twist;
  std::array<CoordinateRow, 2> bend_y, bend_z;  // v'', w'' at x0 and x1
};

// Of make_fe_beam(def, effects), in its coordinates (beam_fe.cpp).
std::vector<ElementStrain> fe_strains(const BeamDef& def, const BeamEffects& effects);
// Of make_modal_beam(def, effects), and of make_modal_volume(def, effects) in its eigenmodes (to_normal_modes) (beam_modal.cpp).
std::vector<StrainStation> modal_strains(const BeamDef& def, const BeamEffects& effects);
std::vector<StrainStation> volume_strains(const BeamDef& def, const BeamEffects& effects);

}  // namespace flexframe::sim
