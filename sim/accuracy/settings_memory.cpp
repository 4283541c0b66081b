#include "sim/accuracy/settings_memory.h"

#include "sim/base/error.h"
#include "sim/base/file_output.h"
#include "sim/scene/toml_output.h"
#include "sim/time/system.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

TomlValue effects_table(const EffectChoice& effects) {
  TomlValue out;
  toml_put(out, "automatic", toml_truth(effects.automatic));
  toml_put(out, "names", toml_texts(effects.names));
  toml_put(out, "without", toml_texts(effects.without));
  return out;
}
EffectChoice read_effects(const TableReader& t) {
  EffectChoice out;
  out.automatic = t.boolean("automatic", true);
  out.names = t.texts("names");
  out.without = t.texts("without");
  return out;
}

// What a search may choose of a beam.
TomlValue beam_table(const BeamDef& beam) {
  TomlValue out, modes;
  toml_put(out, "model", toml_count(static_cast<int>(beam.model)));
  toml_put(out, "boundary", toml_count(static_cast<int>(beam.boundary)));
  toml_put(out, "elements", toml_count(beam.elements));
  toml_put(out, "volumes", toml_count(beam.volumes));
  if (beam.keep_modes) toml_put(out, "keep_modes", toml_count(*beam.keep_modes));
  if (beam.keep_axial) toml_put(out, "keep_axial", toml_count(*beam.keep_axial));
  if (beam.keep_torsion) toml_put(out, "keep_torsion", toml_count(*beam.keep_torsion));
  toml_put(out, "keep_static", toml_truth(beam.keep_static));
  toml_put(out, "keep_inertia", toml_truth(beam.keep_inertia));
  for (const auto& [direction, numbers] : beam.modes) {
    std::vector<TomlValue> items;
    for (const int n : numbers) items.push_back(toml_count(n));
    toml_put(modes, direction, toml_list(std::move(items)));
  }
  toml_put(out, "modes", modes);
  toml_put(out, "effects", effects_table(beam.effects));
  toml_put(out, "chosen_effects", toml_truth(beam.chosen.effects));
  toml_put(out, "held_by", toml_text(beam.chosen.held_by));
  toml_put(out, "complete_inertia", toml_truth(beam.chosen.complete_inertia));
  toml_put(out, "first_bending", toml_number(beam.chosen.first_bending));
  return out;
}
void read_beam(const TableReader& t, BeamDef& beam) {
  beam.model = static_cast<BeamModel>(t.integer("model", 0, 3));
  beam.boundary = static_cast<Boundary>(t.integer("boundary", 0, 5));
  beam.elements = t.integer("elements", 1, 1000000);
  beam.volumes = t.integer("volumes", 1, 1000000);
  beam.keep_modes.reset();
  if (t.has("keep_modes")) beam.keep_modes = t.integer("keep_modes", 0, 1000000);
  beam.keep_axial.reset();
  beam.keep_torsion.reset();
  if (t.has("keep_axial")) beam.keep_axial = t.integer("keep_axial", 0, 1000000);
  if (t.has("keep_torsion")) beam.keep_torsion = t.integer("keep_torsion", 0, 1000000);
  beam.keep_static = t.boolean("keep_static", true);
  beam.keep_inertia = t.boolean("keep_inertia", false);
  beam.modes.clear();
  if (const auto modes = t.table("modes"))
    for (const std::string& direction : modes->value().keys) beam.modes[direction] = modes->integers(direction, 1, 1000000);
  if (const auto effects = t.table("effects")) beam.effects = read_effects(*effects);
  beam.chosen.effects = t.boolean("chosen_effects", false);
  beam.chosen.held_by = t.text("held_by");
  beam.chosen.complete_inertia = t.boolean("complete_inertia", false);
  beam.chosen.first_bending = t.number("first_bending", 0.0, not_negative);
}

TomlValue statement_table(const SolverStatistics& s) {
  TomlValue out;
  const AccuracyStatement& a = *s.accuracy;
  const std::pair<const char*, double> numbers[] = {{"error", s.error_estimate}, {"asked", a.asked},     {"time", a.time},
                                                    {"space", a.space},          {"effects", a.effects}, {"half_cost", a.half_cost},
                                                    {"search_cpu", a.search_cpu}};
  for (const auto& [key, number] : numbers) toml_put(out, key, toml_number(number));
  toml_put(out, "error_column", toml_text(s.error_column));
  toml_put(out, "column", toml_text(a.column));
  toml_put(out, "chosen", toml_texts(a.chosen));
  std::vector<std::string> notes;
  for (const Note& note : s.notes.all()) {
    notes.push_back(note.severity == Severity::warning ? "warning" : "note");
    notes.push_back(note.owner);
    notes.push_back(note.text);
  }
  toml_put(out, "told", toml_texts(notes));
  return out;
}
void read_statement(const TableReader& t, SolverStatistics& s) {
  AccuracyStatement a;
  s.error_estimate = t.number("error");
  s.error_column = t.text("error_column");
  a.asked = t.number("asked");
  a.time = t.number("time");
  a.space = t.number("space");
  a.effects = t.number("effects");
  a.half_cost = t.number("half_cost");
  a.search_cpu = t.number("search_cpu");
  a.column = t.text("column");
  a.chosen = t.texts("chosen");
  s.accuracy = a;
  const std::vector<std::string> told = t.texts("told");
  for (size_t k = 0; k + 2 < told.size(); k += 3) {
    if (told[k] == "warning") s.notes.warn(told[k + 1], told[k + 2]);
    else s.notes.tell(told[k + 1], told[k + 2]);
  }
}

RememberedSettings read_settings(const TomlValue& document, const std::string& file, const Scene& scene) {
  const TableReader root(document, file, "");
  RememberedSettings out;
  out.scene = scene;
  out.scene.simulation.accuracy.reset();
  out.scene.simulation.tolerance = root.number("tolerance");
  if (root.has("method")) out.method = static_cast<Method>(root.word("method", method_words()));
  if (!root.boolean("gravity", true)) out.scene.simulation.gravity.setZero();
  out.outputs = root.text("outputs");
  out.seen = root.optional_number("seen").value_or(1.0);
  for (const TableReader& t : root.tables("body"))
    for (BodyDef& body : out.scene.bodies) {
      if (body.name != t.text("name")) continue;
      if (auto* beam = std::get_if<BeamDef>(&body.kind)) read_beam(t, *beam);
      if (auto* modal = std::get_if<ModalDef>(&body.kind))
        if (const auto effects = t.table("effects")) modal->effects = read_effects(*effects);
    }
  for (JointDef& joint : out.scene.joints) {
    const std::vector<std::string> bare = root.texts("without_friction"), free = root.texts("without_stops");
    if (std::find(bare.begin(), bare.end(), joint.name) != bare.end()) joint.friction.reset();
    if (std::find(free.begin(), free.end(), joint.name) != free.end()) joint.stop.reset();
  }
  root.required("statement");
  read_statement(*root.table("statement"), out.statistics);
  return out;
}

}  // namespace

void take_choices(const Scene& chosen, Scene& scene) {
  scene.simulation.accuracy.reset();
  scene.simulation.tolerance = chosen.simulation.tolerance;
  for (size_t b = 0; b < scene.bodies.size() && b < chosen.bodies.size(); ++b) {
    const auto* from_beam = std::get_if<BeamDef>(&chosen.bodies[b].kind);
    const auto* from_modal = std::get_if<ModalDef>(&chosen.bodies[b].kind);
    auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    auto* modal = std::get_if<ModalDef>(&scene.bodies[b].kind);
    if (from_modal && modal) modal->effects = from_modal->effects;
    if (!from_beam || !beam) continue;
    beam->model = from_beam->model;
    beam->boundary = from_beam->boundary;
    beam->elements = from_beam->elements;
    beam->volumes = from_beam->volumes;
    beam->keep_modes = from_beam->keep_modes;
    beam->keep_axial = from_beam->keep_axial;
    beam->keep_torsion = from_beam->keep_torsion;
    beam->keep_static = from_beam->keep_static;
    beam->keep_inertia = from_beam->keep_inertia;
    beam->modes = from_beam->modes;
    beam->effects = from_beam->effects;
    beam->chosen = from_beam->chosen;
  }
}

bool same_choices(const Scene& a, const Scene& b) {
  const auto choices = [](const Scene& scene) {
    TomlValue out;
    toml_put(out, "method", toml_count(static_cast<int>(scene.simulation.method)));
    std::vector<TomlValue> bodies, joints;
    for (const BodyDef& body : scene.bodies) {
      const auto* beam = std::get_if<BeamDef>(&body.kind);
      const auto* modal = std::get_if<ModalDef>(&body.kind);
      TomlValue table = beam ? beam_table(*beam) : modal ? effects_table(modal->effects) : TomlValue{};
      toml_put(table, "kind", toml_text(fmt::format("{} {}", body.name, body.kind.index())));
      bodies.push_back(std::move(table));
    }
    for (const JointDef& joint : scene.joints)
      joints.push_back(toml_text(fmt::format("{} {} {}", joint.name, joint.friction.has_value(), joint.stop.has_value())));
    toml_put(out, "bodies", toml_list(std::move(bodies)));
    toml_put(out, "joints", toml_list(std::move(joints)));
    toml_put(out, "gravity", toml_truth(!scene.simulation.gravity.isZero(0.0)));
    return write_toml(out);
  };
  return choices(a) == choices(b);
}

std::string outputs_fingerprint(const Results& results) {
  std::string bytes;
  const auto add = [&](const VecX& values) {
    bytes.append(reinterpret_cast<const char*>(values.data()), static_cast<size_t>(values.size()) * sizeof(double));
  };
  add(results.times);
  for (const ResultOutput& output : results.outputs) add(output.values);
  return sha256(bytes);
}

std::optional<RememberedSettings> recall_settings(const SettingsMemory& memory, const Scene& scene) {
  std::error_code error;
  if (memory.fresh || memory.file.empty() || !std::filesystem::is_regular_file(memory.file, error)) return std::nullopt;
  try {
    const TomlValue document = read_toml(memory.file);
    if (TableReader(document, memory.file.string(), "").text("question") != memory.question) return std::nullopt;
    return read_settings(document, memory.file.string(), scene);
  } catch (const InputError&) {
    // A damaged file is as good as none: it is written anew.
    return std::nullopt;
  }
}

void remember_settings(const SettingsMemory& memory, const RememberedSettings& settings) {
  if (memory.file.empty()) return;
  TomlValue root;
  toml_put(root, "question", toml_text(memory.question));
  toml_put(root, "outputs", toml_text(settings.outputs));
  toml_put(root, "seen", toml_number(settings.seen));
  toml_put(root, "tolerance", toml_number(settings.scene.simulation.tolerance.value_or(default_tolerance)));
  if (settings.method) toml_put(root, "method", toml_text(method_words()[static_cast<size_t>(*settings.method)]));
  toml_put(root, "gravity", toml_truth(!settings.scene.simulation.gravity.isZero(0.0)));
  std::vector<std::string> bare, free;
  for (const JointDef& joint : settings.scene.joints) {
    if (!joint.friction) bare.push_back(joint.name);
    if (!joint.stop) free.push_back(joint.name);
  }
  toml_put(root, "without_friction", toml_texts(bare));
  toml_put(root, "without_stops", toml_texts(free));
  std::vector<TomlValue> bodies;
  for (const BodyDef& body : settings.scene.bodies) {
    const auto* beam = std::get_if<BeamDef>(&body.kind);
    const auto* modal = std::get_if<ModalDef>(&body.kind);
    if (!beam && !modal) continue;
    TomlValue table;
    toml_put(table, "name", toml_text(body.name));
    const TomlValue chosen = beam ? beam_table(*beam) : TomlValue{};
    for (size_t k = 0; k < chosen.keys.size(); ++k) toml_put(table, chosen.keys[k], chosen.items[k]);
    if (modal) toml_put(table, "effects", effects_table(modal->effects));
    bodies.push_back(std::move(table));
  }
  if (!bodies.empty()) toml_put(root, "body", toml_list(std::move(bodies)));
  toml_put(root, "statement", statement_table(settings.statistics));
  std::error_code error;
  if (memory.file.has_parent_path()) std::filesystem::create_directories(memory.file.parent_path(), error);
  write_whole_file(
      memory.file,
      "# Settings that a search for an accuracy found (flexframe --accuracy): reused while scene, program and question are the\n"
      "# same; --fresh searches anew.\n" +
          write_toml(root));
}

}  // namespace flexframe::sim
