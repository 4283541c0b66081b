// [[joint]] and [[force]] tables.
#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/scene/expression.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/named.h"
#include "sim/scene/parameters.h"
#include "sim/scene/read_curve.h"
#include "sim/scene/read_states.h"
#include "sim/scene/readings.h"
#include "sim/scene/rotation_input.h"
#include "sim/scene/scene_input.h"
#include "sim/scene/table.h"
#include "sim/scene/unit_terms.h"
#include "sim/scene/units.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace flexframe::sim {

namespace {

using Words = std::vector<std::string>;

// Those of the table, where kinds with a word stand first: a word's place is its kind.
const Words joint_words_in_order = [] {
  Words out;
  for (const JointTraits& t : joint_kinds())
    if (!t.word.empty()) out.emplace_back(t.word);
  return out;
}();
// In the order of ForceKind; a cable is a spring-damper that only pulls.
const Words force_kinds{"force", "torque", "spring-damper", "distributed", "bushing", "drag", "contact", "cable"};
constexpr std::size_t cable_word = 7;
const Words force_frames{"world", "body"};
// Units of a joint's coordinate, of its rate, and of what acts along it; none where its coordinates are of both kinds.
struct CoordinateUnits {
  const char *value = nullptr, *rate = nullptr, *load = nullptr, *stiffness = nullptr, *damping = nullptr;
};
constexpr CoordinateUnits length_units{"m", "m/s", "N", "N/m", "N s/m"}, angle_units{"rad", "rad/s", "N m", "N m/rad", "N m s/rad"};

CoordinateUnits units_of(const JointTraits& joint) {
  if (joint.rates.empty()) return length_units;  // what acts on a point
  if (joint.rates.find('m') == std::string_view::npos) return angle_units;
  return joint.rates.find_first_not_of('m') == std::string_view::npos ? length_units : CoordinateUnits{};
}

std::vector<double> read_coordinates(const TableReader& reader, std::string_view key, JointKind kind) {
  const std::size_t count = traits(kind).rates.size();
  const TomlValue& value = reader.required(key);
  // a free joint's rate may be the angular velocity alone
  if (traits(kind).quaternion == 3 && key == "rate" && value.type == TomlValue::Type::array && value.items.size() == 3) {
    std::vector<double> rate = reader.numbers(key, 3, 3, any_number.in("rad/s"));
    rate.insert(rate.begin(), 3, 0.0);
    return rate;
  }
  const std::size_t given = value.type == TomlValue::Type::array ? value.items.size() : 1;
  // A list written as one text is counted when it is split.
  const bool text_list = value.type == TomlValue::Type::text && value.text.starts_with('[');
  if (!text_list && (value.type == TomlValue::Type::array ? given != count : count != 1))
    reader.fail(key, fmt::format("of a {} joint must be {}, found {}", traits(kind).word, traits(kind).coordinates, describe(value)));
  std::vector<Range> ranges;
  for (const char letter : traits(kind).rates) {
    const CoordinateUnits& units = letter == 'm' ? length_units : angle_units;
    ranges.push_back(any_number.in(key == "rate" ? units.rate : units.value));
  }
  return count == 1 ? reader.number_or_numbers(key, 1, 1, ranges.front()) : reader.numbers(key, ranges);
}

Spring read_spring(const TableReader& reader, const CoordinateUnits& units, bool rest_is_number = true) {
  Spring spring;
  spring.stiffness = reader.number("stiffness", 0.0, not_negative.in(units.stiffness));
  spring.damping = reader.number("damping", 0.0, not_negative.in(units.damping));
  if (rest_is_number) spring.rest = reader.number("rest", 0.0, any_number.in(units.value));
  spring.preload = reader.number("preload", 0.0, any_number.in(units.load));
  return spring;
}

Friction read_friction(const TableReader& reader, const CoordinateUnits& units) {
  reader.allow({"coefficient", "normal_force", "radius", "static_coefficient", "regularised"});
  Friction friction;
  friction.coefficient = reader.number("coefficient", not_negative);
  const TomlValue& normal = reader.required("normal_force");
  friction.reaction = normal.type == TomlValue::Type::text && normal.text == "reaction";
  if (!friction.reaction)
    friction.normal_force = reader.number("normal_force", {.low = 0.0, .what = "a number >= 0 or \"reaction\"", .unit = "N"});
  friction.radius = reader.number("radius", friction.radius, positive.in("m"));
  friction.static_coefficient = reader.optional_number("static_coefficient", not_negative);
  if (friction.static_coefficient && *friction.static_coefficient < friction.coefficient)
    reader.fail("static_coefficient",
                fmt::format("must not be smaller than the coefficient {}, found {}", friction.coefficient, *friction.static_coefficient));
  friction.regularised = reader.optional_number("regularised", positive.in(units.rate));
  return friction;
}

Stop read_stop(const TableReader& reader, const CoordinateUnits& units) {
  reader.allow({"lower", "upper", "stiffness", "damping"});
  Stop stop;
  stop.lower = reader.optional_number("lower", any_number.in(units.value));
  stop.upper = reader.optional_number("upper", any_number.in(units.value));
  if (!stop.lower && !stop.upper) reader.fail("a stop needs 'lower', 'upper' or both");
  if (stop.lower && stop.upper && *stop.lower > *stop.upper)
    reader.fail("lower", fmt::format("must not exceed 'upper': {} > {}", *stop.lower, *stop.upper));
  stop.stiffness = reader.number("stiffness", positive.in(units.stiffness));
  stop.damping = reader.number("damping", 0.0, not_negative.in(units.damping));
  return stop;
}

}  // namespace

TableDef read_table(const TableReader& reader, const Scene& scene, const char* of, const char* to) {
  TableDef table;
  if (reader.has("period")) table.period = reader.number("period", positive.in(of));
  if (reader.has("table") == reader.has("file"))
    reader.fail("needs either 'table', pairs of numbers, or 'file', a text file of two columns");
  if (reader.has("file")) {
    const std::string text = reader.text("file");
    if (text.empty()) reader.fail("file", "is empty; a file name is expected");
    table.file = std::filesystem::path(text);
    if (table.file.is_relative()) table.file = scene.file.parent_path() / table.file;
    std::string content;
    try {
      content = read_text_file(table.file);
    } catch (const InputError& error) {
      reader.fail("file", fmt::format("cannot be used: {}", error.what()));
    }
    // Numbers separated by blanks, commas or semicolons; a line that starts with a letter or # is a heading.
    int line = 0;
    for (std::size_t at = 0; at < content.size();) {
      std::size_t end = content.find('\n', at);
      if (end == std::string::npos) end = content.size();
      std::string row = content.substr(at, end - at);
      at = end + 1;
      ++line;
      for (char& c : row)
        if (c == ',' || c == ';' || c == '\t' || c == '\r') c = ' ';
      const std::size_t first = row.find_first_not_of(' ');
      if (first == std::string::npos || row[first] == '#' || std::isalpha(static_cast<unsigned char>(row[first]))) continue;
      std::vector<double> numbers;
      const char* p = row.data() + first;
      const char* const stop = row.data() + row.size();
      while (p < stop) {
        if (*p == ' ') {
          ++p;
          continue;
        }
        double number = 0.0;
        const auto [next, error] = std::from_chars(*p == '+' ? p + 1 : p, stop, number);
        if (error != std::errc{} || !std::isfinite(number))
          reader.fail("file", fmt::format("{}:{}: no number at {}", table.file.string(), line, quote(std::string(p, stop))));
        numbers.push_back(number);
        p = next;
      }
      if (numbers.size() != 2)
        reader.fail("file", fmt::format("{}:{}: two numbers are expected, found {}", table.file.string(), line, numbers.size()));
      table.x.push_back(numbers[0]);
      table.y.push_back(numbers[1]);
    }
  } else {
    const Range columns[]{any_number.in(of), any_number.in(to)};
    const MatX points = reader.matrix("table", columns);
    if (points.cols() != 2) reader.fail("table", fmt::format("must be pairs of numbers [[x, y], ...], found rows of {}", points.cols()));
    for (Eigen::Index i = 0; i < points.rows(); ++i) table.x.push_back(points(i, 0)), table.y.push_back(points(i, 1));
  }
  try {
    const CubicTable made(table.x, table.y, table.period);
  } catch (const InputError& error) {
    reader.fail(reader.has("file") ? "file" : "table", fmt::format("makes no function: {}", error.what()));
  }
  return table;
}

namespace {

// A table of time must reach over the run. Where its ends are those of the run but for rounding (sums of steps), they become them: a
// motion beyond its table's last point would stand still.
void check_reach(const TableReader& reader, TableDef& table, const Scene& scene) {
  if (table.period) return;
  const double end = scene.simulation.duration, rounding = 1e-12 * end;
  if (std::abs(table.x.front()) <= rounding) table.x.front() = 0.0;
  if (std::abs(table.x.back() - end) <= rounding) table.x.back() = end;
  if (table.x.front() > 0.0 || table.x.back() < scene.simulation.duration)
    reader.fail(reader.has("file") ? "file" : "table",
                fmt::format("covers {} to {} s, the run 0 to {} s; extend the table or give its 'period'", table.x.front(), table.x.back(),
                            scene.simulation.duration));
}

// node[k] -> k, or -1
int node_number(std::string_view frame) {
  if (!frame.starts_with("node[") || !frame.ends_with("]")) return -1;
  const std::string_view digits = frame.substr(5, frame.size() - 6);
  int number = -1;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc{} && end == digits.data() + digits.size() && !digits.empty() && digits[0] != '-' ? number : -1;
}

// Frames of a body that the scene file alone tells; a modal body's are in its SID file.
void check_frame(const TableReader& reader, std::string_view key, const BodyDef& body, const std::string& frame) {
  if (frame.empty() || std::holds_alternative<ModalDef>(body.kind)) return;
  Words known;
  if (const auto* beam = std::get_if<BeamDef>(&body.kind)) {
    known = {"root", "tip"};
    for (const auto& entry : beam->frames) known.push_back(entry.first);
    if (std::find(known.begin(), known.end(), frame) != known.end()) return;
    if (!beam->modes.empty()) {
      if (frame.starts_with("node["))
        reader.fail(key, fmt::format("names the node {}, but a modal beam has no numbered nodes; it has {} (add 'frames' at any x/length)",
                                     quote(frame), list_words(known)));
    } else {
      const int last = beam->elements * (beam->model == BeamModel::mixed ? beam->volumes : 1);
      const int number = node_number(frame);
      if (number >= 0 && number <= last) return;
      known.push_back(fmt::format("node[0] ... node[{}]", last));
    }
  } else {
    const auto& frames = std::holds_alternative<RigidDef>(body.kind) ? std::get<RigidDef>(body.kind).frames
                                                                     : std::get<StateSpaceDef>(body.kind).rigid.frames;
    if (frames.contains(frame)) return;
    for (const auto& entry : frames) known.push_back(entry.first);
  }
  const std::string hint = did_you_mean(frame, known);
  reader.fail(
      key, fmt::format("names the frame {}, which is no frame of {}{}{} it has {}", quote(frame), quote(body.name), hint,
                       hint.empty() ? ";" : "", known.empty() ? "no frames but its own (write the body's name alone)" : list_words(known)));
}

}  // namespace

const BodyDef* find_body(const Scene& scene, std::string_view name) {
  const int k = body_number(scene, name);
  return k < 0 ? nullptr : &scene.bodies[static_cast<size_t>(k)];
}

const JointDef* find_joint(const Scene& scene, std::string_view name) {
  const int k = joint_number(scene, name);
  return k < 0 ? nullptr : &scene.joints[static_cast<size_t>(k)];
}

const JointDef& named_joint(const TableReader& reader, std::string_view key, std::string_view name, const Scene& scene) {
  if (const JointDef* joint = find_joint(scene, name)) return *joint;
  Words known;
  for (const JointDef& joint : scene.joints) known.push_back(joint.name);
  const std::string hint = did_you_mean(name, known);
  reader.fail(key, fmt::format("names the joint {}, which does not exist{}{} there are {}", quote(name), hint, hint.empty() ? ";" : "",
                               list_words(known)));
}

FrameRef split_frame(const std::string& text) {
  const std::size_t dot = text.find('.');
  if (dot == std::string::npos) return {text, ""};
  return {text.substr(0, dot), text.substr(dot + 1)};
}

void unknown_body(const TableReader& reader, std::string_view key, const std::string& name, const Scene& scene) {
  Words known{"ground"};
  for (const BodyDef& body : scene.bodies) known.push_back(body.name);
  const std::string hint = did_you_mean(name, known);
  reader.fail(key, fmt::format("names the body {}, which does not exist{}{} there are {}", quote(name), hint, hint.empty() ? ";" : "",
                               list_words(known)));
}

void check_name(const TableReader& reader, std::string_view key, const std::string& name, std::string_view what) {
  if (name.empty()) reader.fail(key, fmt::format("is empty; a {} needs a name", what));
  const bool bad_character = std::any_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7F || c == '.' || c == '/' || c == '\\' || c == '"' || c == '\'';
  });
  if (bad_character || name.front() == ' ' || name.back() == ' ')
    reader.fail(
        key, fmt::format("is no name for a {}: {}; a name has no '.', '/', '\\', quotes, control characters, nor spaces at its ends", what,
                         quote(name)));
  if (name.size() > 200) reader.fail(key, fmt::format("is longer than 200 bytes: {}", quote(name)));
}

namespace {

// None where the text is a number with one unit behind it, or has no unit.
std::optional<std::string> expression_with_units(const TableReader& reader, std::string_view key, const std::string& text,
                                                 const char* unit) {
  try {
    const std::optional<std::string> replaced = replace_units(text, unit);
    if (!replaced) return std::nullopt;
    const std::string plain = reader.parameters().substitute(*replaced);
    const Expression expression(plain);
    reader.parameters().doubt_units(text);
    return plain;
  } catch (const InputError& error) {
    reader.fail(key, fmt::format("is no expression of t: {}, {}", quote(text), error.what()));
  }
}

}  // namespace

std::string read_expression(const TableReader& reader, std::string_view key, const char* unit) {
  std::string driven;
  return read_driven_expression(reader, key, unit, {}, driven);
}

std::string read_driven_expression(const TableReader& reader, std::string_view key, const char* unit, const std::vector<InputDef>& inputs,
                                   std::string& driven) {
  driven.clear();
  const TomlValue& value = reader.required(key);
  if (value.type == TomlValue::Type::integer || value.type == TomlValue::Type::real) return fmt::format("{}", reader.number(key));
  if (value.type != TomlValue::Type::text)
    reader.fail(key, fmt::format("must be a number or an expression of t, found {}", describe(value)));
  try {
    const std::string named = reader.parameters().substitute(reader.text(key));
    std::string text = with_inputs(named, inputs);
    const Expression expression(text);
    if (text != named) driven = named;
    return text;
  } catch (const InputError& error) {
    // "10 kN" is a number with a unit, "5 kN*sin(50 Hz*t)" has them inside.
    if (const auto with_units = expression_with_units(reader, key, value.text, unit)) return *with_units;
    const auto [number, behind] = split_unit(value.text);
    if (behind.empty()) reader.fail(key, fmt::format("is no expression of t: {}, {}", quote(value.text), error.what()));
    const std::vector<NameInText> names = names_in(number);
    if (std::any_of(names.begin(), names.end(),
                    [number = number](const NameInText& name) { return number.substr(name.at, name.length) == "t"; }))
      reader.fail(key, fmt::format("is no expression of t: {}: the unit {} behind the whole counts for the whole, which is wanted in {}; "
                                   "to give one number a unit write both in brackets, \"t*(2 {})\"",
                                   quote(value.text), quote(behind), unit ? unit : "plain numbers", behind));
    return fmt::format("{}", reader.number(key, any_number.in(unit)));
  }
}

namespace {

FrameRef checked_frame(const TableReader& reader, std::string_view key, const std::string& text, const Scene& scene) {
  FrameRef ref = split_frame(text);
  if (ref.body == "ground") {
    if (ref.frame.empty() || scene.ground_frames.contains(ref.frame)) return ref;
    Words known;
    for (const auto& frame : scene.ground_frames) known.push_back(frame.first);
    const std::string hint = did_you_mean(ref.frame, known);
    reader.fail(key, fmt::format("names the frame {} of ground, which does not exist{} {}", quote(ref.frame), hint.empty() ? ";" : hint,
                                 known.empty() ? "give places in the world as [ground] frames = { NAME = [x, y, z] }, or use 'position'"
                                               : "there are " + list_words(known)));
  }
  const BodyDef* body = find_body(scene, ref.body);
  if (!body) unknown_body(reader, key, ref.body, scene);
  if (ref.frame.empty() && text.ends_with('.'))
    reader.fail(key, fmt::format("is {}: a frame's name is missing after the dot", quote(text)));
  check_frame(reader, key, *body, ref.frame);
  return ref;
}

}  // namespace

FrameRef read_frame_ref(const TableReader& reader, std::string_view key, const Scene& scene) {
  return checked_frame(reader, key, reader.text(key), scene);
}

std::vector<FrameRef> read_frame_refs(const TableReader& reader, std::string_view key, const Scene& scene, std::size_t least) {
  const std::vector<std::string> names = reader.texts(key);
  if (names.size() < least)
    reader.fail(key, fmt::format("must be at least {} frame{}, found {}", least, least == 1 ? "" : "s", names.size()));
  std::vector<FrameRef> out;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (k > 0 && names[k] == names[k - 1]) reader.fail(key, fmt::format("names {} twice in a row, with no way between", quote(names[k])));
    out.push_back(checked_frame(reader, key, names[k], scene));
  }
  return out;
}

JointDef read_joint(TableReader& reader, const Scene& scene) {
  JointDef joint;
  joint.line = reader.line();
  joint.name = reader.text("name");
  check_name(reader, "name", joint.name, "joint");
  reader.set_label(fmt::format("[[joint]] {}", quote(joint.name)));
  joint.kind = static_cast<JointKind>(reader.word("kind", joint_words_in_order));
  const JointTraits& facts = traits(joint.kind);
  const std::string kind(facts.word);
  reader.allow({"name", "kind", "parent", "child", "axis", "position", "rotation", "pitch", "length", "curve", "initial", "motion",
                "spring", "friction", "stop"});

  // ends and placement
  joint.parent = read_frame_ref(reader, "parent", scene);
  joint.child = read_frame_ref(reader, "child", scene);
  if (joint.child.body == "ground") reader.fail("child", "must not be ground: exchange 'parent' and 'child'");
  if (joint.child.body == joint.parent.body)
    reader.fail("child", fmt::format("is on the same body as the parent, {}", quote(joint.child.body)));
  joint.axis = reader.direction("axis", Vec3::UnitZ());
  joint.position = reader.vector3("position", Vec3::Zero(), "m");
  joint.rotation = read_rotation(reader, "rotation");
  if (joint.parent.body == "ground" && !joint.parent.frame.empty()) {
    if (const auto axes = scene.ground_axes.find(joint.parent.frame); axes != scene.ground_axes.end()) {
      joint.position = axes->second * joint.position;
      joint.rotation = rotation_log(Quat(axes->second * rotation_exp(joint.rotation)));
    }
    joint.position += scene.ground_frames.at(joint.parent.frame);
    joint.parent.frame.clear();
  }

  // numbers that belong to one kind
  if (facts.pitch) {
    joint.pitch = reader.number("pitch", any_number.in("m/rad"));
    if (joint.pitch == 0.0) reader.fail("pitch", "must not be 0 (that is a revolute joint)");
  } else if (reader.has("pitch")) {
    reader.fail("pitch", fmt::format("belongs to joints of kind '{}'; this one is '{}'",
                                     joint_words([](const JointTraits& t) { return t.pitch; }), kind));
  }
  if (facts.length) joint.length = reader.number("length", positive.in("m"));
  else if (reader.has("length"))
    reader.fail("length", fmt::format("belongs to joints of kind '{}'; this one is '{}'",
                                      joint_words([](const JointTraits& t) { return t.length; }), kind));

  if (facts.curve) joint.curve = read_curve(reader, "curve");
  else if (reader.has("curve"))
    reader.fail("curve", fmt::format("belongs to joints of kind '{}'; this one is '{}'",
                                     joint_words([](const JointTraits& t) { return t.curve; }), kind));
  if (facts.curve && reader.has("axis")) reader.fail("axis", "has no meaning for a point-on-curve joint: 'rotation' turns its curve");

  // what acts along the coordinates
  const std::size_t count = facts.rates.size();
  for (const char* key : {"initial", "motion"})
    if (count == 0 && reader.has(key)) reader.fail(key, fmt::format("has no meaning for a {} joint, which has no coordinate", kind));
  for (const char* key : {"spring", "friction", "stop"})
    if (count == 0 && !facts.split && reader.has(key))
      reader.fail(key, fmt::format("has no meaning for a {} joint, which has no coordinate", kind));
  if (const auto initial = reader.table("initial")) {
    initial->allow({"value", "guess", "rate"});
    if (initial->has("value") && initial->has("guess"))
      initial->fail("guess", "excludes 'value', which is kept exactly; a guess may be moved to close the loop");
    if (initial->has("guess")) joint.initial.guess = read_coordinates(*initial, "guess", joint.kind);
    if (initial->has("value")) joint.initial.value = read_coordinates(*initial, "value", joint.kind);
    if (initial->has("rate")) joint.initial.rate = read_coordinates(*initial, "rate", joint.kind);
  }
  if (reader.has("motion")) {
    if (count != 1)
      reader.fail("motion",
                  fmt::format("needs a joint with one coordinate ({}); a {} joint has {}", joint_words(has_one_coordinate), kind, count));
    if (reader.find("motion")->type == TomlValue::Type::table) {
      const TableReader motion = *reader.table("motion");
      if (motion.has("value"))
        motion.fail("value",
                    "does not belong here: an expression of t stands by itself, motion = \"2*t\"; points have table or file, and period");
      motion.allow({"table", "file", "period"});
      joint.motion_table = read_table(motion, scene, "s", units_of(facts).value);
      check_reach(motion, *joint.motion_table, scene);
    } else {
      joint.motion = read_expression(reader, "motion", units_of(facts).value);
    }
    if (joint.initial.value || joint.initial.guess || joint.initial.rate)
      reader.fail("initial", "excludes 'motion', which prescribes the coordinate from the start");
  }
  if (const auto spring = reader.table("spring")) {
    spring->allow({"stiffness", "damping", "rest", "preload"});
    joint.spring = read_spring(*spring, units_of(facts));
  }
  if (const auto friction = reader.table("friction")) {
    joint.friction = read_friction(*friction, units_of(facts));
    if (facts.curve && joint.friction->reaction)
      friction->fail("normal_force", "must be a number (N) for a point-on-curve joint: its own reaction is not known to its friction");
  }
  if (const auto stop = reader.table("stop")) {
    if (count > 1) reader.fail("stop", fmt::format("needs a joint with one coordinate; a {} joint has {}", kind, count));
    joint.stop = read_stop(*stop, units_of(facts));
  }
  return joint;
}

namespace {

// The rest of a spring where it is an expression of t; empty: a number.
std::string rest_of_time(const TableReader& reader) {
  const TomlValue* value = reader.find("rest");
  if (!value || value->type != TomlValue::Type::text) return {};
  try {
    const std::string text = reader.parameters().substitute(value->text);
    return Expression(text).constant() ? std::string() : text;
  } catch (const InputError&) {
    // A number with a unit, an expression of t with units inside, or what is neither.
    const auto with_units = expression_with_units(reader, "rest", value->text, "m");
    return with_units && !Expression(*with_units).constant() ? *with_units : std::string();
  }
}

// The value, in N or what `unit` says, with what it reads of the scene; own: names beside the scene's.
void read_value(const TableReader& reader, const char* unit, const Scene& scene, const std::vector<Reading>& own, ForceDef& force) {
  StateExpression read = read_state_expression(reader, "value", unit, scene, own);
  force.value = std::move(read.text);
  force.driven = std::move(read.driven);
  force.reads = std::move(read.reads);
}

// What a spring-damper pulls beside its stiffness, damping and preload.
void read_pull(const TableReader& reader, const Scene& scene, ForceDef& force) {
  read_value(reader, "N", scene, {{Reading::length, "length", 0, 0}, {Reading::rate, "rate", 0, 0}}, force);
}

// "length > rest ? max(0, k*(length - rest) + d*rate) : 0", so that slackening and tightening are located events.
void read_cable(const TableReader& reader, const Scene& scene, ForceDef& force) {
  if (!reader.has("stiffness")) reader.required("stiffness");
  force.rest = rest_of_time(reader);
  force.spring = read_spring(reader, length_units, force.rest.empty());
  if (force.spring.stiffness == 0.0) reader.fail("stiffness", "must be greater than 0");
  if (force.rest.empty() && !(force.spring.rest > 0.0))
    reader.fail("rest", fmt::format("is the cable's length without load and must be greater than 0, found {}", force.spring.rest));
  if (reader.has("through")) force.through = read_frame_refs(reader, "through", scene, 0);
  const std::string rest = force.rest.empty() ? fmt::format("{}", force.spring.rest) : "(" + force.rest + ")";
  const std::string pull = fmt::format("{}*(length - {})", force.spring.stiffness, rest);
  force.value = force.spring.damping == 0.0 ? fmt::format("max(0, {})", pull)
                                            : fmt::format("length > {} ? max(0, {} + {}*rate) : 0", rest, pull, force.spring.damping);
  force.reads.push_back({Reading::length, "length", 0, 0});
  if (force.spring.damping > 0.0) force.reads.push_back({Reading::rate, "rate", 0, 0});
}

void read_drag(const TableReader& reader, ForceDef& force) {
  if (!reader.has("linear") && !reader.has("quadratic"))
    reader.fail("needs 'linear' (N s/m), 'quadratic' (N s^2/m^2: half of density times drag coefficient times area), or both");
  force.drag = reader.number("linear", 0.0, not_negative.in("N s/m"));
  force.square_drag = reader.number("quadratic", 0.0, not_negative.in("kg/m"));
  force.wind = reader.vector3("wind", Vec3::Zero(), "m/s");
}

}  // namespace

ForceDef read_force_head(TableReader& reader) {
  ForceDef force;
  force.line = reader.line();
  force.name = reader.text("name", "");
  if (reader.has("name")) {
    check_name(reader, "name", force.name, "force");
    reader.set_label(fmt::format("[[force]] {}", quote(force.name)));
  }
  const std::size_t word = reader.word("kind", force_kinds);
  force.cable = word == cable_word;
  force.kind = force.cable ? ForceKind::spring_damper : static_cast<ForceKind>(word);
  switch (force.kind) {
    case ForceKind::force:
    case ForceKind::torque:
    case ForceKind::distributed:
      reader.allow({"name", "kind", "on", "direction", "frame", "value"});
      break;
    case ForceKind::spring_damper:
      if (force.cable) reader.allow({"name", "kind", "on", "from", "through", "stiffness", "damping", "rest"});
      else reader.allow({"name", "kind", "on", "from", "stiffness", "damping", "rest", "preload", "value"});
      break;
    case ForceKind::drag:
      reader.allow({"name", "kind", "on", "linear", "quadratic", "wind"});
      break;
    case ForceKind::contact:
      allow_contact_keys(reader);
      break;
    case ForceKind::bushing:
      reader.allow({"name", "kind", "on", "from", "stiffness", "damping"});
      break;
    case ForceKind::user:  // no word of it is read
      break;
  }
  return force;
}

ForceDef read_force(TableReader& reader, const Scene& scene) {
  ForceDef force = read_force_head(reader);

  force.on = read_frame_ref(reader, "on", scene);
  if (force.on.body == "ground") reader.fail("on", "must not be ground, which does not move");
  if (force.kind == ForceKind::distributed) {
    const BodyDef* body = find_body(scene, force.on.body);
    if (!body || !is_beam(*body))
      reader.fail("on", fmt::format("must be a beam: {} is none, and a distributed force is a force per length", quote(force.on.body)));
    if (!force.on.frame.empty())
      reader.fail("on", fmt::format("must be a beam's name alone: the force acts along all of {}", quote(force.on.body)));
  }

  if (force.kind == ForceKind::drag) {
    read_drag(reader, force);
    return force;
  }
  if (force.kind == ForceKind::contact) {
    if (reader.has("from")) force.from = read_frame_ref(reader, "from", scene);
    if (force.from.body == force.on.body) reader.fail("from", fmt::format("is on the same body as 'on', {}", quote(force.on.body)));
    force.contact = read_contact(reader);
    return force;
  }
  if (force.kind == ForceKind::spring_damper || force.kind == ForceKind::bushing) {
    if (reader.has("from")) force.from = read_frame_ref(reader, "from", scene);
    const bool passes = reader.has("through") && !read_frame_refs(reader, "through", scene, 0).empty();
    if (force.from.body == force.on.body && !passes)
      reader.fail(reader.has("from") ? "from" : "on", fmt::format("is on the same body as 'on', {}", quote(force.on.body)));
    if (force.cable) {
      read_cable(reader, scene, force);
    } else if (force.kind == ForceKind::spring_damper) {
      if (!reader.has("stiffness") && !reader.has("damping") && !reader.has("preload") && !reader.has("value"))
        reader.required("stiffness");
      force.rest = rest_of_time(reader);
      force.spring = read_spring(reader, length_units, force.rest.empty());
      if (reader.has("value")) read_pull(reader, scene, force);
      if (force.spring.rest < 0.0) reader.fail("rest", fmt::format("is a length and must be >= 0, found {}", force.spring.rest));
    } else {
      const auto six = [&](std::string_view key, const char* along, const char* about, Vec6& out) {
        if (!reader.has(key)) return;
        const Range a = not_negative.in(along), b = not_negative.in(about), ranges[]{a, a, a, b, b, b};
        const std::vector<double> numbers = reader.numbers(key, ranges);
        out = Eigen::Map<const Vec6>(numbers.data());
      };
      reader.required("stiffness");
      six("stiffness", length_units.stiffness, angle_units.stiffness, force.bushing_stiffness);
      six("damping", length_units.damping, angle_units.damping, force.bushing_damping);
    }
    return force;
  }

  reader.required("direction");
  force.direction = reader.direction("direction", Vec3::UnitZ());
  force.follower = reader.word("frame", force_frames, 0) == 1;
  const char* const unit = force.kind == ForceKind::torque ? "N m" : force.kind == ForceKind::distributed ? "N/m" : "N";
  if (reader.required("value").type != TomlValue::Type::table) {
    read_value(reader, unit, scene, {}, force);
    return force;
  }
  const TableReader value = *reader.table("value");
  value.allow({"table", "file", "period", "of"});
  if (!value.has("of")) {
    force.table = read_table(value, scene, "s", unit);
    check_reach(value, *force.table, scene);
    return force;
  }
  force.table_joint = value.text("of");
  const JointDef& joint = named_joint(value, "of", force.table_joint, scene);
  if (traits(joint.kind).rates.size() != 1)
    value.fail("of", fmt::format("needs a joint with one coordinate; {} is {} with {}", quote(joint.name), traits(joint.kind).word,
                                 traits(joint.kind).rates.size()));
  force.table = read_table(value, scene, units_of(traits(joint.kind)).value, unit);
  return force;
}

InputDef read_input(TableReader& reader) {
  InputDef input;
  input.line = reader.line();
  input.name = reader.text("name");
  reader.set_label(fmt::format("[[input]] {}", quote(input.name)));
  reader.allow({"name", "value"});
  if (reader.parameters().has(input.name)) reader.fail("name", "is the name of a parameter too");
  input.value = reader.number("value", 0.0, any_number);
  try {
    Parameters().add(input.name, "0");
  } catch (const InputError&) {
    reader.fail("name", fmt::format("is no name for an input: {}; letters, digits and _ only, no digit first, and no word of expressions",
                                    quote(input.name)));
  }
  return input;
}

}  // namespace flexframe::sim
