// The parts of the scene reader, one function a table; private to scene_reader.cpp and read_*.cpp.
#pragma once

#include "sim/scene/scene.h"
#include "sim/scene/toml_input.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace flexframe::sim {

// Tables of the scene file. `folder`: relative file names start there. All throw InputError.
SimulationSettings read_simulation(const TableReader& reader);
BodyDef read_body(TableReader& reader, const std::filesystem::path& folder);
// References are checked against what the scene holds so far (bodies before joints before forces and outputs).
JointDef read_joint(TableReader& reader, const Scene& scene);
ForceDef read_force(TableReader& reader, const Scene& scene);
OutputDef read_output(TableReader& reader, const Scene& scene);
InputDef read_input(TableReader& reader);

// The table "frames" of a body or the ground: name -> position, m. `order`: the names as the file lists them.
std::map<std::string, Vec3> read_frame_positions(const TableReader& reader, std::vector<std::string>* order = nullptr);

// A number or an expression of t as expression text without parameters; wrong syntax is refused. unit: as Range::unit.
std::string read_expression(const TableReader& reader, std::string_view key, const char* unit);
// The same where inputs may stand in it: with their first values. `driven`: with their names, empty where it names none.
std::string read_driven_expression(const TableReader& reader, std::string_view key, const char* unit, const std::vector<InputDef>& inputs,
                                   std::string& driven);

// "ground", "body" or "body.frame", split at the first dot, existing as far as the scene tells.
FrameRef read_frame_ref(const TableReader& reader, std::string_view key, const Scene& scene);

// A name of a body, joint, output or frame: not empty, no '.', '/', quote, control character, no space at an end.
void check_name(const TableReader& reader, std::string_view key, const std::string& name, std::string_view what);

bool is_beam(const BodyDef& body);
bool is_rigid(const BodyDef& body);

}  // namespace flexframe::sim
