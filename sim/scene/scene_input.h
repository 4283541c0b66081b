// The parts of the scene reader, one function a table; private to scene_reader.cpp and read_*.cpp.
#pragma once

#include "sim/scene/scene.h"
#include "sim/scene/toml_input.h"

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// Tables of the scene file. `folder`: relative file names start there. All throw InputError.
SimulationSettings read_simulation(const TableReader& reader);
BodyDef read_body(TableReader& reader, const std::filesystem::path& folder);
// References are checked against what the scene holds so far (bodies before joints before forces and outputs).
JointDef read_joint(TableReader& reader, const Scene& scene);
ForceDef read_force(TableReader& reader, const Scene& scene);
// Gives the beam a frame where the output asks for a place x/length.
OutputDef read_output(TableReader& reader, Scene& scene);
InputDef read_input(TableReader& reader);
CouplingDef read_coupling(TableReader& reader, const Scene& scene);

// The table "frames" of a body or the ground: name -> position, m, or { position, rotation }. axes: of those that are turned, columns.
// order: the names as the file lists them.
struct FrameTable {
  std::map<std::string, Vec3> position;
  std::map<std::string, Mat3> axes;
  std::vector<std::string> order;
};
FrameTable read_frames(const TableReader& reader);

// A number or an expression of t as expression text without parameters; wrong syntax is refused. unit: as Range::unit.
std::string read_expression(const TableReader& reader, std::string_view key, const char* unit);
// The same where inputs may stand in it: with their first values. `driven`: with their names, empty where it names none.
std::string read_driven_expression(const TableReader& reader, std::string_view key, const char* unit, const std::vector<InputDef>& inputs,
                                   std::string& driven);

// { table = [[x, y], ...] } or { file = "two_columns.csv" }, and period; the points are checked by making the spline. `of`,
// `to`: units of x and y where the scene holds them (a file has SI numbers).
TableDef read_table(const TableReader& reader, const Scene& scene, const char* of, const char* to);

// "ground", "body" or "body.frame", split at the first dot, existing as far as the scene tells.
FrameRef read_frame_ref(const TableReader& reader, std::string_view key, const Scene& scene);
// Several, at least so many.
std::vector<FrameRef> read_frame_refs(const TableReader& reader, std::string_view key, const Scene& scene, std::size_t least);

// The solids that a rigid body is drawn with; `frames`: those of the body, which they may name.
std::vector<ShapeDef> read_shapes(const TableReader& body, const std::map<std::string, Vec3>& frames);

// The body's mesh: a file's name, or { file, unit, scale, position, rotation }.
void read_mesh(const TableReader& body, const std::filesystem::path& folder, BodyDef& out);

// A file that exists, absolute; relative names start in `folder`.
std::filesystem::path read_file_path(const TableReader& reader, std::string_view key, const std::filesystem::path& folder);

// Drawing words as text: numbers as written by fmt, lists as "[1, 0, 0]".
std::string drawing_text(const TableReader& reader, std::string_view key, const TomlValue& value);

// "body.frame" at its first dot.
FrameRef split_frame(const std::string& text);

// None of that name: nullptr.
const BodyDef* find_body(const Scene& scene, std::string_view name);
const JointDef* find_joint(const Scene& scene, std::string_view name);
// The joint that a key names; refused with those that there are.
const JointDef& named_joint(const TableReader& reader, std::string_view key, std::string_view name, const Scene& scene);

// Refuses the name of a body that the scene does not have, with those that it has.
[[noreturn]] void unknown_body(const TableReader& reader, std::string_view key, const std::string& name, const Scene& scene);

// A name of a body, joint, output or frame: not empty, no '.', '/', quote, control character, no space at an end.
void check_name(const TableReader& reader, std::string_view key, const std::string& name, std::string_view what);

bool is_beam(const BodyDef& body);
bool is_rigid(const BodyDef& body);

}  // namespace flexframe::sim
