// Numbers without a unit, which are read in SI, that look as if they were meant in other units.
#pragma once

#include <string>

namespace flexframe::sim {

// Whether an angle of so many radians looks like one in degrees: beyond a turn, and whole or half.
bool looks_like_degrees(double angle);

// Whether a gravity of so many m/s^2 looks like the earth's in mm/s^2.
bool looks_like_millimetres(double gravity);

// The units, "t/mm^3 and MPa" or only "MPa", in which a density and a Young's modulus make a solid that machines are built of, where they
// make none in kg/m^3 and Pa; empty where they do in SI or where no usual units make one.
std::string meant_material_units(double density, double youngs_modulus);

}  // namespace flexframe::sim
