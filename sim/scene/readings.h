// What expressions of a scene may read beside t: columns of its outputs and of its blocks, by name.
#pragma once

#include "sim/scene/scene_input.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// "tip.x", "tip.y", "tip.z" of an output of a vector, its name of a scalar, "joint.1", ... of a joint with several coordinates. Those of an
// elastic body's coordinates, whose number the scene does not tell, are not among them.
std::vector<std::string> output_columns(const OutputDef& output, const Scene& scene);

// Notes as doubts of the scene the parameters in an expression whose names are among `names` too.
void doubt_parameters(const Parameters& parameters, std::string_view text, const std::vector<std::string>& names);

// Notes those of the names that an expression reads though they are expressions of the others too: "a-b" where there are a, b and "a-b".
void doubt_operators(const Parameters& parameters, std::string_view text, const std::vector<std::string>& names);

// A number or an expression of t and of readings.
struct StateExpression {
  std::string text;            // without parameters, inputs of the scene with their first values
  std::string driven;          // the same with the inputs' names; empty where it names none
  std::vector<Reading> reads;  // what its variables are, in their order
};
// own: further names that this key may read ("length", "rate"). Wrong syntax, and readings on which no force can depend (accelerations,
// forces, energies, angles that jump after a turn), are refused. Outputs and blocks of the scene come first. unit: as Range::unit.
StateExpression read_state_expression(const TableReader& reader, std::string_view key, const char* unit, const Scene& scene,
                                      const std::vector<Reading>& own = {});

}  // namespace flexframe::sim
