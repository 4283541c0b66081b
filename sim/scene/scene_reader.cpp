#include "sim/scene/scene_reader.h"

#include "sim/base/words.h"
#include "sim/scene/meant_units.h"
#include "sim/scene/picture_accuracy.h"
#include "sim/scene/read_states.h"
#include "sim/scene/readings.h"
#include "sim/scene/scene_input.h"
#include "sim/scene/toml_input.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

namespace flexframe::sim {

namespace {

const std::vector<std::string> starts{"assembled", "static"};

// Results are kept in memory: beyond this many samples the rate is a slip of the pen.
constexpr double most_samples = 1e7;

class Names {
 public:
  Names(std::string what) : what_(std::move(what)) {}
  void add(const TableReader& reader, const std::string& name) {
    const auto [at, fresh] = lines_.emplace(name, reader.line());
    if (!fresh) reader.fail("name", fmt::format("is already the name of the {} in line {}", what_, at->second));
  }

 private:
  std::string what_;
  std::map<std::string, int> lines_;
};

// A beam whose elastic coordinates are output keeps one for every element's.
void note_coordinates(Scene& scene, const OutputDef& output) {
  if (output.quantity != Quantity::q && output.quantity != Quantity::qd) return;
  for (BodyDef& body : scene.bodies)
    if (auto* beam = std::get_if<BeamDef>(&body.kind); beam && body.name == output.of.body) beam->all_elements = true;
}

// Outputs of blocks name blocks that there are.
void check_block_outputs(const TableReader& root, const Scene& scene) {
  std::vector<std::string> known;
  for (const BlockDef& block : scene.blocks) known.push_back(block.name);
  const std::vector<TableReader> tables = root.tables("output");
  for (std::size_t k = 0; k < tables.size(); ++k) {
    const OutputDef& output = scene.outputs[k];
    if (output.quantity != Quantity::output || std::find(known.begin(), known.end(), output.of.body) != known.end()) continue;
    const std::string hint = did_you_mean(output.of.body, known);
    tables[k].fail("of", fmt::format("must be a block for the quantity 'output', and {} is none{}{} {}", quote(output.of.body), hint,
                                     hint.empty() ? ";" : "", known.empty() ? "the scene has none" : "there are " + list_words(known)));
  }
}

// Outputs that are expressions of others know these when all are read.
void doubt_expressions(const TableReader& root, const Scene& scene) {
  std::vector<std::string> columns;
  for (const OutputDef& output : scene.outputs) {
    const std::vector<std::string> own = output_columns(output, scene);
    columns.insert(columns.end(), own.begin(), own.end());
    if (output.quantity == Quantity::expression) columns.push_back(output.name);
  }
  for (const TableReader& table : root.tables("output")) {
    const TomlValue* value = table.find("expression");
    if (!value) continue;
    std::vector<std::string> others = columns;
    std::erase(others, table.text("name"));
    doubt_parameters(root.parameters(), value->text, others);
    doubt_operators(root.parameters(), root.parameters().substitute(value->text), others);
  }
}

// A share of the outputs' ranges, or a distance in the pictures.
void read_accuracy(const TableReader& reader, SimulationSettings& settings) {
  const TomlValue* value = reader.find("accuracy");
  if (!value) return;
  if (value->type == TomlValue::Type::text) {
    try {
      settings.picture_accuracy = parse_picture_accuracy(value->text);
    } catch (const InputError& error) {
      reader.fail("accuracy", error.what());
    }
  }
  constexpr const char* what =
      "a number from 1e-12 to 0.5 (a share of the outputs' ranges), or a distance in the pictures: \"0.5 px\", \"0.1 mm\"";
  if (!settings.picture_accuracy) settings.accuracy = reader.number("accuracy", {.low = 1e-12, .high = 0.5, .what = what});
}

}  // namespace

SimulationSettings read_simulation(const TableReader& reader) {
  reader.allow({"duration", "output_rate", "gravity", "tolerance", "accuracy", "method", "max_steps", "start"});
  SimulationSettings settings;
  settings.duration = reader.number("duration", positive.in("s"));
  settings.output_rate = reader.number("output_rate", settings.output_rate, positive.in("Hz"));
  if (settings.duration * settings.output_rate > most_samples)
    reader.fail(reader.has("output_rate") ? "output_rate" : "duration",
                fmt::format("gives {:.3g} samples (duration x output_rate); at most {:.0e} are allowed",
                            settings.duration * settings.output_rate, most_samples));
  settings.gravity = reader.vector3("gravity", settings.gravity, "m/s^2");
  if (const double pull = settings.gravity.norm(); looks_like_millimetres(pull) && reader.unitless("gravity"))
    reader.doubt("gravity",
                 fmt::format("is {:.5g} m/s^2, a thousand times the earth's: for millimetres write \"{:.5g} mm/s^2\", for so much "
                             "\"{:.5g} m/s^2\"",
                             pull, pull, pull));
  settings.tolerance = reader.optional_number("tolerance", {.low = 1e-13, .high = 0.1, .what = "a number from 1e-13 to 0.1"});
  read_accuracy(reader, settings);
  if (settings.tolerance && (settings.accuracy || settings.picture_accuracy))
    reader.fail("accuracy", "excludes 'tolerance': give the local error or the requested error of the outputs, not both");
  settings.method = static_cast<Method>(reader.word("method", method_words(), 0));
  settings.max_steps = reader.optional_number("max_steps", {.low = 1.0, .what = "a number >= 1"});
  settings.static_start = reader.word("start", starts, 0) == 1;
  return settings;
}

Scene make_scene(const SceneDocument& document) {
  const std::filesystem::path& name = document.file;
  TableReader root(document.root, name.string(), "");
  root.set_parameters(document.parameters);

  Scene scene;
  scene.file = name;
  scene.text = document.text;
  scene.title = root.text("title", name.stem().string());
  root.required("simulation");
  scene.simulation = read_simulation(*root.table("simulation"));
  // A table; its content is the renderer's, but for what the pictures need of the run.
  if (const auto render = root.table("render"))
    if (const TomlValue* color_by = render->find("color_by"))
      scene.colored_by_stress = color_by->type == TomlValue::Type::text && (color_by->text == "stress" || color_by->text == "strain");
  if (const auto table = root.table("ground")) {
    table->allow({"frames"});
    FrameTable frames = read_frames(*table);
    scene.ground_frames = std::move(frames.position);
    scene.ground_axes = std::move(frames.axes);
  }

  const std::filesystem::path folder = name.parent_path();
  Names inputs("input"), bodies("body"), joints("joint"), forces("force"), outputs("output"), couplings("coupling");
  for (TableReader& reader : root.tables("input")) {
    scene.inputs.push_back(read_input(reader));
    inputs.add(reader, scene.inputs.back().name);
  }
  root.required("body");
  for (TableReader& reader : root.tables("body")) {
    scene.bodies.push_back(read_body(reader, folder));
    bodies.add(reader, scene.bodies.back().name);
  }
  if (scene.bodies.empty()) root.fail("body", "is empty; a scene needs at least one [[body]]");
  for (TableReader& reader : root.tables("joint")) {
    scene.joints.push_back(read_joint(reader, scene));
    joints.add(reader, scene.joints.back().name);
  }
  for (TableReader& reader : root.tables("coupling")) {
    scene.couplings.push_back(read_coupling(reader, scene));
    couplings.add(reader, scene.couplings.back().name);
  }
  // Outputs may be of forces, whose names are enough for them, and forces may read outputs.
  for (TableReader& reader : root.tables("force")) scene.forces.push_back(read_force_head(reader));
  for (TableReader& reader : root.tables("output")) {
    scene.outputs.push_back(read_output(reader, scene));
    outputs.add(reader, scene.outputs.back().name);
    note_coordinates(scene, scene.outputs.back());
  }
  // Blocks may read one another: their names and the number of their outputs first.
  for (const bool with_inputs : {false, true})
    for (TableReader& reader : root.tables("block")) read_block(reader, scene, with_inputs);
  check_block_outputs(root, scene);
  scene.forces.clear();
  for (TableReader& reader : root.tables("force")) {
    scene.forces.push_back(read_force(reader, scene));
    if (!scene.forces.back().name.empty()) forces.add(reader, scene.forces.back().name);
  }
  doubt_expressions(root, scene);
  scene.doubts = document.parameters.doubts();
  return scene;
}

Scene parse_scene(std::string_view text, const std::filesystem::path& name) { return make_scene(parse_document(text, name)); }

Scene read_scene(const std::filesystem::path& file, const std::vector<std::string>& settings) {
  return make_scene(read_document(file, settings));
}

}  // namespace flexframe::sim
