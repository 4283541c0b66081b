// What expressions of a scene may read beside t: columns of its outputs and of its blocks, by name.
#pragma once

#include "sim/scene/scene_input.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// "tip.x", "tip.y", "tip.z" of an output of a vector, its name of a scalar, "joint.1", ... of a joint with several coordinates. Those of an
// elastic body's coordinates, whose number the scene does not tell, are not among them.
std::vector<std::string> output_columns(const OutputDef& output, const Scene& scene);

// A number or an expression of t and of readings, as text without parameters; what it reads goes into `reads`. own: further names
// that this key may read ("length", "rate"). driven: inputs of the scene may stand in it, with their first values in what is returned and
// with their names there; empty where it names none. Wrong syntax, and readings on which no force can depend (accelerations, forces,
// energies, angles that jump after a turn), are refused. Outputs and blocks of the scene come first. unit: as Range::unit.
std::string read_state_expression(const TableReader& reader, std::string_view key, const char* unit, const Scene& scene,
                                  const std::vector<Reading>& own, std::vector<Reading>& reads, std::string* driven = nullptr);

}  // namespace flexframe::sim
