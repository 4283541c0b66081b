// [[output]] tables.
#include "sim/base/words.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/parameters.h"
#include "sim/scene/scene_input.h"
#include "sim/scene/section_stress.h"

#include <algorithm>

#include <fmt/format.h>

namespace flexframe::sim {

namespace {

using Words = std::vector<std::string>;

const Words reaction_frames{"world", "parent", "child"};
const Words quantities{"position",
                       "velocity",
                       "acceleration",
                       "rotation",
                       "angular_velocity",
                       "displacement",
                       "value",
                       "rate",
                       "reaction",
                       "q",
                       "qd",
                       "energy",
                       "kinetic",
                       "strain",
                       "potential",
                       "distance",
                       "distance_rate",
                       "angle",
                       "length",
                       "length_rate",
                       "force",
                       "power",
                       "spring_force",
                       "stop_force",
                       "friction_force",
                       "section_force",
                       "stress",
                       "work",
                       "output"};

bool is_of_force(Quantity q) {
  return q == Quantity::length || q == Quantity::length_rate || q == Quantity::force || q == Quantity::power || q == Quantity::work;
}
bool is_of_joint(Quantity q) {
  return q == Quantity::value || q == Quantity::rate || q == Quantity::reaction || q == Quantity::spring_force ||
         q == Quantity::stop_force || q == Quantity::friction_force;
}
bool is_of_section(Quantity q) { return q == Quantity::section_force || q == Quantity::stress; }

// "names X, which is no WHAT (did you mean Y?); there are A, B"
[[noreturn]] void unknown(const TableReader& reader, const std::string& quantity, const std::string& of, const char* what,
                          const Words& known) {
  const std::string hint = did_you_mean(of, known);
  reader.fail("of", fmt::format("must be {} for the quantity '{}', and {} is none{}{} {}", what, quantity, quote(of), hint,
                                hint.empty() ? ";" : "", known.empty() ? "the scene has none" : "there are " + list_words(known)));
}

void read_of_joint(const TableReader& reader, const Scene& scene, const std::string& quantity, const OutputDef& output) {
  const JointDef* joint = find_joint(scene, output.of.body);
  if (!joint || !output.of.frame.empty()) {
    Words known;
    for (const JointDef& candidate : scene.joints) known.push_back(candidate.name);
    unknown(reader, quantity, reader.text("of"), "a joint", known);
  }
  const auto lacks = [&](bool has, const char* key) {
    if (!has) reader.fail("quantity", fmt::format("is '{}', but the joint {} has no '{}'", quantity, quote(joint->name), key));
  };
  if (output.quantity == Quantity::spring_force) lacks(joint->spring.has_value(), "spring");
  if (output.quantity == Quantity::stop_force) lacks(joint->stop.has_value(), "stop");
  if (output.quantity == Quantity::friction_force) lacks(joint->friction.has_value(), "friction");
  const bool coordinate = output.quantity == Quantity::value || output.quantity == Quantity::rate;
  if (coordinate && traits(joint->kind).rates.empty())
    reader.fail("quantity", fmt::format("is '{}', but a {} joint has no coordinate", quantity, traits(joint->kind).word));
}

// An output that is an expression of others is read here as far as it stands alone; what it names is found when all columns are known.
OutputDef read_combination(const TableReader& reader, OutputDef output) {
  reader.allow({"name", "expression", "unit", "description"});
  output.quantity = Quantity::expression;
  const TomlValue& value = reader.required("expression");
  if (value.type != TomlValue::Type::text)
    reader.fail("expression", fmt::format("must be a text, an expression of other outputs' columns and of t, found {}", describe(value)));
  try {
    output.expression = reader.parameters().substitute(value.text);
  } catch (const InputError& error) {
    reader.fail("expression", error.what());
  }
  output.unit = reader.text("unit", "");
  return output;
}

bool couples(const Scene& scene, const OutputDef& output) {
  const auto named = [&](const CouplingDef& c) { return c.name == output.of.body; };
  return output.quantity == Quantity::force && output.of.frame.empty() &&
         std::any_of(scene.couplings.begin(), scene.couplings.end(), named);
}

void read_of_force(const TableReader& reader, const Scene& scene, const std::string& quantity, const OutputDef& output) {
  const auto force = std::find_if(scene.forces.begin(), scene.forces.end(),
                                  [&](const ForceDef& f) { return !f.name.empty() && f.name == output.of.body; });
  if (force == scene.forces.end() && couples(scene, output)) return;
  if (force == scene.forces.end() || !output.of.frame.empty()) {
    Words known;
    for (const ForceDef& candidate : scene.forces)
      if (!candidate.name.empty()) known.push_back(candidate.name);
    const bool size = output.quantity == Quantity::force;
    if (size)
      for (const CouplingDef& candidate : scene.couplings) known.push_back(candidate.name);
    unknown(reader, quantity, reader.text("of"), size ? "a force with a 'name', or a coupling" : "a force with a 'name'", known);
  }
  const bool length = output.quantity == Quantity::length || output.quantity == Quantity::length_rate;
  if (length && force->kind != ForceKind::spring_damper)
    reader.fail("quantity", fmt::format("is '{}', which spring-dampers have; {} is of another kind", quantity, quote(force->name)));
}

// Of a place of a beam: a frame, or the beam's name and x/length as `at`, for which it gets a frame.
void read_of_section(const TableReader& reader, Scene& scene, const std::string& quantity, OutputDef& output) {
  const auto body = std::find_if(scene.bodies.begin(), scene.bodies.end(), [&](const BodyDef& b) { return b.name == output.of.body; });
  if (body == scene.bodies.end() || !is_beam(*body)) {
    Words known;
    for (const BodyDef& candidate : scene.bodies)
      if (is_beam(candidate)) known.push_back(candidate.name);
    unknown(reader, quantity, reader.text("of"), "a place of a beam", known);
  }
  BeamDef& beam = std::get<BeamDef>(body->kind);
  if (output.quantity == Quantity::stress && !has_stress(beam.section))
    reader.fail("quantity", fmt::format("is 'stress', but a section of shape '{}' has moments and no outline", beam.section.shape));
  if (!reader.has("at")) {
    if (output.of.frame.empty()) reader.required("at");
    read_frame_ref(reader, "of", scene);
    return;
  }
  if (!output.of.frame.empty()) reader.fail("at", fmt::format("excludes a frame: name the beam alone, {}", quote(body->name)));
  const double at = reader.number("at", {.low = 0.0, .high = 1.0, .what = "x/length, a number from 0 to 1"});
  output.of.frame = at == 0.0 ? "root" : at == 1.0 ? "tip" : fmt::format("x/length {}", at);
  if (at > 0.0 && at < 1.0) beam.frames[output.of.frame] = at;
}

// relative_to = "frame", or of a displacement ["frame", "frame"] of the same body.
void read_relative(const TableReader& reader, const Scene& scene, const std::string& quantity, OutputDef& output) {
  if (output.quantity == Quantity::displacement) {
    output.shown_from =
        reader.find("relative_to")->type == TomlValue::Type::text ? Words{reader.text("relative_to")} : reader.texts("relative_to");
    if (output.shown_from.empty() || output.shown_from.size() > 2)
      reader.fail("relative_to", fmt::format("of a displacement must be one frame of the body (its tangent) or two (their chord), found {}",
                                             output.shown_from.size()));
    for (std::string& frame : output.shown_from)
      if (const FrameRef ref = split_frame(frame); !ref.frame.empty()) {
        if (ref.body != output.of.body)
          reader.fail("relative_to",
                      fmt::format("of a displacement must name frames of {}, found {}", quote(output.of.body), quote(frame)));
        frame = ref.frame;
      }
    if (output.shown_from.size() == 2 && output.shown_from[0] == output.shown_from[1])
      reader.fail("relative_to",
                  fmt::format("names the frame {} twice, which has no chord; name it once for its tangent", quote(output.shown_from[0])));
    return;
  }
  const std::vector<Quantity> relative{Quantity::position, Quantity::velocity,      Quantity::rotation, Quantity::angular_velocity,
                                       Quantity::distance, Quantity::distance_rate, Quantity::angle};
  if (std::find(relative.begin(), relative.end(), output.quantity) == relative.end())
    reader.fail("relative_to",
                fmt::format("belongs to position, velocity, rotation, angular_velocity, displacement, distance, distance_rate "
                            "and angle; this one is '{}'",
                            quantity));
  output.relative_to = read_frame_ref(reader, "relative_to", scene);
}

void read_of_frame(const TableReader& reader, const Scene& scene, const std::string& quantity, const OutputDef& output) {
  const std::string of = reader.text("of");
  if (of == "system")
    reader.fail("of", fmt::format("is \"system\", which has energy, kinetic, strain and potential, but no '{}'", quantity));
  if (output.of.body == "ground")
    reader.fail("of", fmt::format("is {}, but the ground stands still: 'of' names a frame of a body, 'relative_to' may be the ground's",
                                  quote(of)));
  const BodyDef* body = find_body(scene, output.of.body);
  if (!body) {
    if (find_joint(scene, of))
      reader.fail("of", fmt::format("is the joint {}, which has value, rate and reaction, but no '{}': its value is its angle or length; "
                                    "all else is asked of a frame",
                                    quote(of), quantity));
    unknown_body(reader, "of", output.of.body, scene);
  }
  read_frame_ref(reader, "of", scene);
  if (output.quantity == Quantity::q || output.quantity == Quantity::qd) {
    if (!output.of.frame.empty()) reader.fail("of", fmt::format("must be a body's name alone for the quantity '{}'", quantity));
    if (is_rigid(*body)) reader.fail("of", fmt::format("is the rigid body {}, which has no elastic coordinates", quote(body->name)));
  }
}

void read_energy_of_body(const TableReader& reader, const Scene& scene, const std::string& quantity, const FrameRef& of) {
  if (find_body(scene, of.body) && of.frame.empty()) return;
  Words known{"system"};
  for (const BodyDef& body : scene.bodies) known.push_back(body.name);
  const std::string found = reader.text("of");
  reader.fail("of", fmt::format("must be \"system\" or a body's name for the quantity '{}', found {}{}", quantity, quote(found),
                                did_you_mean(of.body, known)));
}

}  // namespace

OutputDef read_output(TableReader& reader, Scene& scene) {
  OutputDef output;
  output.line = reader.line();
  output.name = reader.text("name");
  check_name(reader, "name", output.name, "output");
  reader.set_label(fmt::format("[[output]] {}", quote(output.name)));
  if (!reader.has("expression")) reader.allow({"name", "of", "quantity", "relative_to", "frame", "at", "description", "expression"});
  output.description = reader.text("description", "");
  if (reader.has("expression")) return read_combination(reader, std::move(output));
  output.quantity = static_cast<Quantity>(reader.word("quantity", quantities));
  const std::string& quantity = quantities[static_cast<std::size_t>(output.quantity)];
  output.of = split_frame(reader.text("of"));
  if (reader.has("frame") && output.quantity != Quantity::reaction)
    reader.fail("frame", fmt::format("belongs to the quantity 'reaction'; this one is '{}'", quantity));
  output.frame = static_cast<ReactionFrame>(reader.word("frame", reaction_frames, 0));
  if (reader.has("at") && !is_of_section(output.quantity))
    reader.fail("at", fmt::format("belongs to the quantities section_force and stress; this one is '{}'", quantity));
  if (reader.has("relative_to")) read_relative(reader, scene, quantity, output);

  const bool energy = output.quantity == Quantity::energy || output.quantity == Quantity::kinetic || output.quantity == Quantity::strain ||
                      output.quantity == Quantity::potential;
  if (energy && reader.text("of") != "system") read_energy_of_body(reader, scene, quantity, output.of);
  // Blocks come later than outputs: the reader of the scene looks for this one's then.
  if (energy || output.quantity == Quantity::output) return output;
  if (is_of_joint(output.quantity)) read_of_joint(reader, scene, quantity, output);
  else if (is_of_force(output.quantity)) read_of_force(reader, scene, quantity, output);
  else if (is_of_section(output.quantity)) read_of_section(reader, scene, quantity, output);
  else read_of_frame(reader, scene, quantity, output);
  return output;
}

}  // namespace flexframe::sim
