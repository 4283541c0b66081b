// [[coupling]] tables: conditions between coordinates of joints.
#include "sim/base/words.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/parameters.h"
#include "sim/scene/readings.h"
#include "sim/scene/scene_input.h"
#include "sim/scene/table.h"
#include "sim/scene/unit_terms.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

const std::vector<std::string> coupling_kinds{"gear", "rack", "screw", "linear", "differential", "cam", "rope"};
enum class CouplingKind { gear, rack, screw, linear, differential, cam, rope };

// A joint of a coupling: one whose coordinates are numbers, not an orientation.
const JointDef& coupled_joint(const TableReader& reader, std::string_view key, const std::string& name, const Scene& scene) {
  const JointDef& joint = named_joint(reader, key, name, scene);
  const JointTraits& facts = traits(joint.kind);
  if (!has_plain_coordinates(facts))
    reader.fail(key, fmt::format("names the joint {}, a {} joint, which has no coordinate of its own to couple; take one of {}",
                                 quote(name), facts.word, joint_words(has_plain_coordinates)));
  return joint;
}

// The joints of a kind that has a fixed number of them; letters: m a length, r an angle, * either. Of a joint with several coordinates the
// first of that sort is meant.
std::vector<CouplingTerm> fixed_joints(const TableReader& reader, const Scene& scene, std::string_view letters, const char* what) {
  const std::vector<std::string> names = reader.texts("joints");
  if (names.size() != letters.size())
    reader.fail("joints", fmt::format("must be {} joints, {}; found {}", letters.size(), what, names.size()));
  std::vector<CouplingTerm> terms;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const JointDef& joint = coupled_joint(reader, "joints", names[k], scene);
    const std::size_t at = letters[k] == '*' ? 0 : traits(joint.kind).rates.find(letters[k]);
    if (at == std::string_view::npos)
      reader.fail("joints", fmt::format("must be {}; {}, a {} joint, has no {}", what, quote(names[k]), traits(joint.kind).word,
                                        letters[k] == 'm' ? "way along an axis" : "angle"));
    for (const CouplingTerm& before : terms)
      if (before.joint == names[k]) reader.fail("joints", fmt::format("names {} twice", quote(names[k])));
    terms.push_back({names[k], static_cast<int>(at), 0.0, nullptr, std::nullopt});
  }
  return terms;
}

// A joint that turns and one that slides `key` per radian.
std::vector<CouplingTerm> turn_to_way(const TableReader& reader, const Scene& scene, const char* what, const char* key,
                                      const Range& range) {
  std::vector<CouplingTerm> terms = fixed_joints(reader, scene, "rm", what);
  terms[0].factor = reader.number(key, range);
  terms[1].factor = -1.0;
  if (terms[0].factor == 0.0) reader.fail(key, "must not be 0; negative where the second joint slides back as the first turns forward");
  return terms;
}

// How far the second wheel turns per turn of the first, with its sign: teeth of spur wheels, or a ratio.
double gear_ratio(const TableReader& reader) {
  if (reader.has("teeth") == reader.has("ratio")) reader.fail("needs either 'teeth', those of both wheels, or 'ratio'");
  if (reader.has("ratio")) {
    if (reader.has("internal"))
      reader.fail("internal", "belongs to 'teeth'; a ratio has its sign: positive where both wheels turn the same way");
    const double ratio = reader.number("ratio");
    if (ratio == 0.0) reader.fail("ratio", "must not be 0");
    return ratio;
  }
  const std::vector<double> teeth = reader.numbers("teeth", 2, 2, positive);
  return (reader.boolean("internal", false) ? 1.0 : -1.0) * teeth[0] / teeth[1];
}

// Angles of the wheels are counted from what carries them: a carrier's joint that moves one of them takes its angle off.
void add_carrier(const TableReader& reader, const Scene& scene, std::vector<CouplingTerm>& terms) {
  if (!reader.has("carrier")) return;
  const std::string name = reader.text("carrier");
  const JointDef& carrier = coupled_joint(reader, "carrier", name, scene);
  const std::size_t at = traits(carrier.kind).rates.find('r');
  if (at == std::string_view::npos) reader.fail("carrier", fmt::format("must be a joint with an angle; {} has none", quote(name)));
  double factor = 0.0;
  for (const CouplingTerm& term : terms)
    for (const JointDef& joint : scene.joints) {
      if (joint.name != term.joint) continue;
      if (joint.name == name) reader.fail("carrier", fmt::format("is one of the wheels' own joints, {}", quote(name)));
      // A wheel that turns on the carrier itself has its angle from there already.
      if (joint.parent.body != carrier.child.body && joint.child.body != carrier.child.body) factor -= term.factor;
    }
  if (factor == 0.0)
    reader.fail("carrier",
                fmt::format("is not needed: both wheels turn on {}, from which their angles are counted", quote(carrier.child.body)));
  terms.push_back({name, static_cast<int>(at), factor, nullptr, std::nullopt});
}

// Unit of a sum of coordinates that are all lengths or all angles; none of others.
const char* value_unit(const Scene& scene, const std::vector<CouplingTerm>& terms) {
  const auto length = [&](const CouplingTerm& t) { return is_length(find_joint(scene, t.joint)->kind, t.coordinate); };
  if (std::all_of(terms.begin(), terms.end(), length)) return "m";
  return std::none_of(terms.begin(), terms.end(), length) ? "rad" : nullptr;
}

// The lift of a cam: a table of its coordinate, or an expression of `angle` (of `way`, where the cam slides), whose derivatives are exact.
void read_lift(const TableReader& reader, const Scene& scene, std::vector<CouplingTerm>& terms) {
  CouplingTerm& cam = terms[0];
  const JointDef& joint = *find_joint(scene, cam.joint);
  const bool slides = is_length(joint.kind, cam.coordinate);
  if (reader.required("lift").type == TomlValue::Type::table) {
    const TableReader table = *reader.table("lift");
    table.allow({"table", "file", "period"});
    const TableDef points = read_table(table, scene, slides ? "m" : "rad", value_unit(scene, {terms[1]}));
    if (!points.period) cam.range = {points.x.front(), points.x.back()};
    cam.of = std::make_shared<const TimeFunction>(std::make_shared<const CubicTable>(points.x, points.y, points.period));
    return;
  }
  const std::string own = slides ? "way" : "angle", given = reader.text("lift");
  try {
    const bool length = is_length(find_joint(scene, terms[1].joint)->kind, terms[1].coordinate);
    const std::string text = reader.parameters().substitute(replace_units(given, length ? "m" : "rad").value_or(given));
    reader.parameters().doubt_units(given);
    doubt_parameters(reader.parameters(), given, {own});
    std::string of_t;
    std::size_t done = 0;
    for (const NameInText& name : names_in(text)) {
      const std::string word = text.substr(name.at, name.length);
      if (word == "t") reader.fail("lift", fmt::format("must be an expression of {}, not of t: {}", own, quote(given)));
      if (word != own) continue;
      of_t += text.substr(done, name.at - done) + "t";
      done = name.at + name.length;
    }
    Expression lift(of_t + text.substr(done));
    if (lift.has_switches())
      reader.fail("lift",
                  "has corners or jumps (?:, comparisons, abs, min, max), at which a cam would hit its follower; give a smooth "
                  "expression or a table of points, through which a smooth curve runs");
    if (lift.constant()) reader.fail("lift", fmt::format("does not depend on {}: {}", own, quote(given)));
    cam.of = std::make_shared<const TimeFunction>(std::move(lift));
  } catch (const InputError& error) {
    const std::string what = error.what();
    if (what.starts_with(reader.file())) throw;
    reader.fail("lift", fmt::format("is no expression of {} and no table: {}, {}", own, quote(given), what));
  }
}

// At least so many. An angle's factor in a sum with a rope's length is a drum's radius.
std::vector<CouplingTerm> free_terms(const TableReader& reader, const Scene& scene, std::size_t least, bool of_rope) {
  std::vector<CouplingTerm> terms;
  reader.required("terms");
  for (const TableReader& table : reader.tables("terms")) {
    table.allow({"joint", "coordinate", "factor"});
    const JointDef& joint = coupled_joint(table, "joint", table.text("joint"), scene);
    const int count = rates_of(joint.kind);
    CouplingTerm term{joint.name, table.integer("coordinate", 1, 1, count) - 1, 0.0, nullptr, std::nullopt};
    term.factor = table.number("factor", of_rope && !is_length(joint.kind, term.coordinate) ? any_number.in("m/rad") : any_number);
    if (term.factor == 0.0) table.fail("factor", "must not be 0");
    for (const CouplingTerm& before : terms)
      if (before.joint == term.joint && before.coordinate == term.coordinate)
        table.fail("joint", fmt::format("names {} a second time; add its factors", quote(term.joint)));
    terms.push_back(term);
  }
  if (terms.size() < least) reader.fail("terms", fmt::format("must be at least {}, found {}", least == 1 ? "one" : "two", terms.size()));
  return terms;
}

}  // namespace

CouplingDef read_coupling(TableReader& reader, const Scene& scene) {
  CouplingDef out;
  out.line = reader.line();
  out.name = reader.text("name");
  check_name(reader, "name", out.name, "coupling");
  reader.set_label(fmt::format("[[coupling]] {}", quote(out.name)));
  const auto kind = static_cast<CouplingKind>(reader.word("kind", coupling_kinds));
  switch (kind) {
    case CouplingKind::gear:
      reader.allow({"name", "kind", "joints", "teeth", "internal", "ratio", "carrier", "value"});
      out.terms = fixed_joints(reader, scene, "rr", "those of the two wheels");
      out.terms[0].factor = gear_ratio(reader);
      out.terms[1].factor = -1.0;
      add_carrier(reader, scene, out.terms);
      break;
    case CouplingKind::rack:
      reader.allow({"name", "kind", "joints", "radius", "value"});
      out.terms = turn_to_way(reader, scene, "the pinion's and the rack's", "radius", any_number.in("m"));
      break;
    case CouplingKind::screw:
      reader.allow({"name", "kind", "joints", "pitch", "value"});
      out.terms = turn_to_way(reader, scene, "the spindle's angle and the nut's way", "pitch", any_number.in("m/rad"));
      break;
    case CouplingKind::differential:
      reader.allow({"name", "kind", "joints", "ratio", "value"});
      out.terms = fixed_joints(reader, scene, "rrr", "the two outputs' and the input's");
      out.terms[0].factor = out.terms[1].factor = 0.5;
      out.terms[2].factor = -reader.number("ratio", 1.0, any_number);
      if (out.terms[2].factor == 0.0) reader.fail("ratio", "must not be 0: turns of the mean of both outputs per turn of the input");
      break;
    case CouplingKind::linear:
      reader.allow({"name", "kind", "terms", "value"});
      out.terms = free_terms(reader, scene, 2, false);
      break;
    case CouplingKind::cam:
      reader.allow({"name", "kind", "joints", "lift", "value"});
      out.terms = fixed_joints(reader, scene, "**", "the cam's and the follower's");
      out.terms[0].factor = 1.0;
      out.terms[1].factor = -1.0;
      read_lift(reader, scene, out.terms);
      out.value = reader.number("value", 0.0, any_number.in(value_unit(scene, {out.terms[1]})));
      return out;
    case CouplingKind::rope:
      reader.allow({"name", "kind", "through", "length", "terms"});
      out.through = read_frame_refs(reader, "through", scene, 2);
      if (reader.has("terms")) out.terms = free_terms(reader, scene, 1, true);
      out.value = reader.number("length", positive.in("m"));
      return out;
  }
  // What the kinds of two sorts keep is in the unit of their right side, the last term.
  const bool of_one_sort = kind == CouplingKind::linear;
  out.value = reader.optional_number("value", any_number.in(value_unit(scene, of_one_sort ? out.terms : std::vector{out.terms.back()})));
  return out;
}

}  // namespace flexframe::sim
