#include "render/import/mapping.h"

#include "sim/base/words.h"
#include "sim/scene/toml_input.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::imports {
namespace {

using sim::TableReader;
using sim::TomlValue;

// "name", "-name", a number, or { column, factor, offset }.
Source read_source(const TableReader& reader, std::string_view key, const TomlValue& value) {
  Source source;
  source.line = value.line;
  if (value.type == TomlValue::Type::integer || value.type == TomlValue::Type::real) {
    source.constant = value.type == TomlValue::Type::integer ? static_cast<double>(value.integer) : value.real;
    return source;
  }
  if (value.type == TomlValue::Type::table) {
    const TableReader inside(value, reader.file(), fmt::format("'{}'", key));
    inside.allow({"column", "factor", "offset"});
    source.column = inside.text("column");
    source.factor = inside.number("factor", 1.0, sim::any_number);
    source.constant = inside.number("offset", 0.0, sim::any_number);
    return source;
  }
  if (value.type != TomlValue::Type::text || value.text.empty())
    reader.fail(key, fmt::format("must hold names of columns, numbers or {{ column, factor, offset }}, found {}", sim::describe(value)));
  source.column = value.text;
  if (value.text[0] == '-' && value.text.size() > 1) {
    source.column = value.text.substr(1);
    source.factor = -1.0;
  }
  return source;
}

// Exactly `count` sources, or one text that stands for "NAME.x", "NAME.y", ... by `endings`.
template <size_t N>
void read_sources(const TableReader& reader, std::string_view key, std::span<const std::string> endings, std::array<Source, N>& out) {
  const TomlValue& value = reader.required(key);
  if (value.type == TomlValue::Type::text) {
    for (size_t k = 0; k < endings.size(); ++k) out[k] = {value.text + endings[k], 1.0, 0.0, value.line};
    return;
  }
  if (value.type != TomlValue::Type::array || value.items.size() != endings.size())
    reader.fail(key, fmt::format("must be {} columns or numbers, or the one name before {}, found {}", endings.size(),
                                 sim::list_words(endings), sim::describe(value)));
  for (size_t k = 0; k < endings.size(); ++k) out[k] = read_source(reader, key, value.items[k]);
}

const std::vector<std::string> xyz = {".x", ".y", ".z"};

// The numbers of an orientation, their form, and the words of how it is written.
void read_turn(const TableReader& reader, TurnSource& turn) {
  static const std::vector<std::string> forms = {"quaternion", "euler", "matrix", "rotation_vector", "angle"};
  static const std::vector<std::vector<std::string>> endings = {{".qw", ".qx", ".qy", ".qz"},
                                                                {".1", ".2", ".3"},
                                                                {".r11", ".r12", ".r13", ".r21", ".r22", ".r23", ".r31", ".r32", ".r33"},
                                                                {".rx", ".ry", ".rz"},
                                                                {""}};
  std::vector<std::string> given;
  for (const std::string& form : forms)
    if (reader.has(form)) given.push_back(form);
  if (given.size() > 1) reader.fail(given[1], fmt::format("stands beside '{}': one orientation is enough", given[0]));
  TurnWriting& writing = turn.writing;
  if (given.empty()) {
    for (const char* word : {"order", "sequence", "axes", "turns", "axis"})
      if (reader.has(word)) reader.fail(word, fmt::format("needs an orientation beside it: {}", sim::list_words(forms)));
    return;
  }
  const size_t form = std::find(forms.begin(), forms.end(), given[0]) - forms.begin();
  writing.form = static_cast<TurnForm>(form + 1);
  if (writing.form == TurnForm::angle) turn.numbers[0] = read_source(reader, "angle", reader.required("angle"));
  else read_sources(reader, given[0], endings[form], turn.numbers);

  const auto only_for = [&](const char* word, TurnForm wanted, const char* what) {
    if (reader.has(word) && writing.form != wanted) reader.fail(word, fmt::format("belongs to {}", what));
  };
  if (writing.form == TurnForm::quaternion) {
    const std::vector<std::string> orders = {"wxyz", "xyzw"};
    writing.scalar_last = reader.word("order", orders, 0) == 1;
  } else if (writing.form == TurnForm::matrix) {
    const std::vector<std::string> orders = {"rows", "columns"};
    writing.by_columns = reader.word("order", orders, 0) == 1;
  } else if (reader.has("order")) {
    reader.fail("order", "belongs to 'quaternion' (wxyz, xyzw) and 'matrix' (rows, columns)");
  }
  only_for("sequence", TurnForm::euler, "'euler'");
  only_for("axes", TurnForm::euler, "'euler'");
  only_for("axis", TurnForm::angle, "'angle'");
  if (writing.form == TurnForm::euler) {
    writing.sequence = reader.text("sequence");
    const std::string& s = writing.sequence;
    if (s.size() != 3 || s.find_first_not_of("xyz") != std::string::npos || s[0] == s[1] || s[1] == s[2])
      reader.fail("sequence",
                  fmt::format("must be three of the letters x, y, z, no two neighbours alike (\"xyz\", \"zxz\"), found {}", sim::quote(s)));
    const std::vector<std::string> axes = {"body", "fixed"};
    writing.fixed_axes = reader.word("axes", axes, 0) == 1;
  }
  if (writing.form == TurnForm::angle) writing.axis = reader.direction("axis", sim::Vec3::UnitZ());
  const std::vector<std::string> ways = {"body to world", "world to body"};
  writing.world_to_body = reader.word("turns", ways, 0) == 1;
}

NodeSource read_node(const TableReader& reader) {
  reader.allow({"name", "origin", "displacement", "position", "axes_of", "quaternion", "euler", "matrix", "rotation_vector", "angle",
                "order", "sequence", "axes", "turns", "axis"});
  NodeSource node;
  node.name = reader.text("name");
  node.origin = reader.vector3("origin", "m");
  node.by_position = reader.has("position");
  if (node.by_position == reader.has("displacement")) reader.fail("needs either 'displacement' or 'position'");
  if (node.by_position) read_sources(reader, "position", xyz, node.place);
  else read_sources(reader, "displacement", std::vector<std::string>{".ux", ".uy", ".uz"}, node.place);
  const std::vector<std::string> frames = {"body", "world"};
  node.world_axes = reader.word("axes_of", frames, 0) == 1;
  if (node.by_position && reader.has("axes_of")) reader.fail("axes_of", "belongs to 'displacement': a position is in world axes");
  read_turn(reader, node.turn);
  node.has_turn = node.turn.writing.form != TurnForm::none;
  return node;
}

// A Modelica.Mechanics.MultiBody frame: r_0 in world axes, R.T from world to frame (v_frame = T v_world).
void use_modelica_frame(const std::string& frame, int line, BodySource& body) {
  for (size_t k = 0; k < 3; ++k) body.position[k] = {fmt::format("{}.r_0[{}]", frame, k + 1), 1.0, 0.0, line};
  body.turn.writing.form = TurnForm::matrix;
  body.turn.writing.world_to_body = true;
  for (size_t k = 0; k < 9; ++k) body.turn.numbers[k] = {fmt::format("{}.R.T[{},{}]", frame, k / 3 + 1, k % 3 + 1), 1.0, 0.0, line};
}

double read_unit(const TableReader& reader, const char* key, const sim::Dimension& wanted, const char* like, bool& given) {
  if (!reader.has(key)) return 1.0;
  given = true;
  const std::string text = reader.text(key);
  const auto unit = sim::parse_unit(text);
  if (!unit || unit->dimension != wanted) reader.fail(key, fmt::format("must be a unit like {}, found {}", like, sim::quote(text)));
  return unit->factor;
}

BodySource read_body(const TableReader& reader, const std::filesystem::path& folder) {
  reader.allow({"name",
                "kind",
                "mesh",
                "mesh_unit",
                "length",
                "color",
                "frame",
                "position",
                "point",
                "quaternion",
                "euler",
                "matrix",
                "rotation_vector",
                "angle",
                "order",
                "sequence",
                "axes",
                "turns",
                "axis",
                "node",
                "sid",
                "q"});
  BodySource body;
  body.line = reader.line();
  body.name = reader.text("name");
  if (body.name.empty() || body.name.find('/') != std::string::npos) reader.fail("name", "must be a name without '/'");
  const std::vector<std::string> kinds = {"rigid", "beam", "modal"};
  body.kind = kinds[reader.word("kind", kinds, reader.has("sid") || reader.has("node") ? 2 : 0)];
  if (reader.has("mesh")) body.mesh = std::filesystem::absolute(folder / reader.text("mesh")).lexically_normal().string();
  bool unit_given = false;
  body.mesh_unit = read_unit(reader, "mesh_unit", {.metre = 1}, "\"mm\"", unit_given);
  body.length = reader.number("length", 0.0, sim::not_negative.in("m"));
  if (reader.has("color")) body.color = reader.numbers("color", 3, 3, sim::fraction);
  body.point = reader.vector3("point", sim::Vec3::Zero(), "m");
  if (reader.has("frame")) {
    for (const char* word : {"position", "quaternion", "euler", "matrix", "rotation_vector", "angle"})
      if (reader.has(word)) reader.fail(word, "stands beside 'frame', which gives position and orientation");
    use_modelica_frame(reader.text("frame"), reader.line("frame"), body);
  } else {
    read_sources(reader, "position", xyz, body.position);
    read_turn(reader, body.turn);
  }
  for (const TableReader& node : reader.tables("node")) body.nodes.push_back(read_node(node));
  if (reader.has("sid")) {
    body.sid = folder / reader.text("sid");
    if (!body.nodes.empty()) reader.fail("sid", "stands beside 'node': the SID file gives the nodes");
    const TomlValue& q = reader.required("q");
    if (q.type != TomlValue::Type::array) reader.fail("q", "must be a list of columns, one a mode of the SID file");
    for (const TomlValue& item : q.items) body.q.push_back(read_source(reader, "q", item));
  } else if (reader.has("q")) {
    reader.fail("q", "needs 'sid', the file with the mode shapes");
  }
  return body;
}

}  // namespace

Mapping read_mapping(const std::filesystem::path& path) {
  const TomlValue document = sim::read_toml(path);
  const TableReader root(document, path.string(), "");
  root.allow({"title", "units", "table", "body", "outputs"});
  Mapping mapping;
  mapping.file = path.string();
  mapping.title = root.text("title", "");
  if (const auto units = root.table("units")) {
    units->allow({"length", "angle", "time"});
    mapping.length_unit = read_unit(*units, "length", {.metre = 1}, "\"mm\"", mapping.units_given);
    mapping.angle_unit = read_unit(*units, "angle", {.radian = 1}, "\"deg\"", mapping.units_given);
    mapping.format.time_unit = read_unit(*units, "time", {.second = 1}, "\"ms\"", mapping.format.time_unit_given);
  }
  if (const auto table = root.table("table")) {
    table->allow({"time", "columns", "step"});
    mapping.format.time = table->text("time", "");
    if (table->has("columns")) mapping.format.columns = table->texts("columns");
    mapping.format.step = table->optional_number("step", sim::positive.in("s"));
  }
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (const TableReader& reader : root.tables("body")) {
    mapping.bodies.push_back(read_body(reader, folder));
    for (size_t k = 0; k + 1 < mapping.bodies.size(); ++k)
      if (mapping.bodies[k].name == mapping.bodies.back().name)
        reader.fail("name", fmt::format("'{}' is there twice", mapping.bodies[k].name));
  }
  if (mapping.bodies.empty()) root.fail("needs at least one [[body]]");
  if (root.has("outputs")) {
    mapping.outputs = root.texts("outputs");
    mapping.all_outputs = false;
  }
  return mapping;
}

}  // namespace flexframe::imports
