#include "sim/scene/readings.h"

#include "sim/base/words.h"
#include "sim/scene/expression.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/named.h"
#include "sim/scene/parameters.h"
#include "sim/scene/unit_terms.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

const JointDef* joint_of(const OutputDef& output, const Scene& scene) {
  const int k = output.of.frame.empty() ? joint_number(scene, output.of.body) : -1;
  return k < 0 ? nullptr : &scene.joints[static_cast<size_t>(k)];
}

// Why a force cannot depend on an output, a half sentence; empty: it can.
std::string why_not(const OutputDef& output, int component, const Scene& scene) {
  switch (output.quantity) {
    case Quantity::position:
    case Quantity::velocity:
    case Quantity::angular_velocity:
    case Quantity::distance:
    case Quantity::distance_rate:
      return {};
    case Quantity::value:
    case Quantity::rate: {
      const JointDef* joint = joint_of(output, scene);
      const int at = joint ? traits(joint->kind).quaternion : -1;
      if (at < 0) return {};
      return component < at && output.quantity == Quantity::value
                 ? std::string()
                 : "which belongs to a joint with an orientation; take position, velocity or angular_velocity of a frame";
    }
    case Quantity::acceleration:
    case Quantity::reaction:
      return fmt::format("{}, which follows from the forces themselves (an algebraic loop); take positions or velocities",
                         output.quantity == Quantity::reaction ? "a reaction" : "an acceleration");
    case Quantity::rotation:
      return "a rotation vector, which jumps after half a turn; take the value of a joint, or an angular velocity";
    case Quantity::displacement:
      return "an elastic displacement; take position with relative_to a frame of the body";
    default:
      return "no position, velocity, distance or joint coordinate";
  }
}

struct Known {
  Reading reading;
  std::string why;  // it cannot be read
};

std::vector<Known> known_readings(const Scene& scene, const std::vector<Reading>& own) {
  std::vector<Known> out;
  out.reserve(own.size());
  for (const Reading& r : own) out.push_back({r, ""});
  for (std::size_t i = 0; i < scene.blocks.size(); ++i) {
    const BlockDef& block = scene.blocks[i];
    const Eigen::Index outputs = block.C.rows();
    for (Eigen::Index k = 0; k < outputs; ++k)
      out.push_back(
          {{Reading::block, outputs == 1 ? block.name : fmt::format("{}.{}", block.name, k + 1), static_cast<int>(i), static_cast<int>(k)},
           ""});
  }
  for (std::size_t i = 0; i < scene.outputs.size(); ++i) {
    const std::vector<std::string> columns = output_columns(scene.outputs[i], scene);
    for (std::size_t k = 0; k < columns.size(); ++k)
      out.push_back(
          {{Reading::output, columns[k], static_cast<int>(i), static_cast<int>(k)}, why_not(scene.outputs[i], static_cast<int>(k), scene)});
  }
  return out;
}

}  // namespace

void doubt_parameters(const Parameters& parameters, std::string_view text, const std::vector<std::string>& names) {
  const std::vector<UnitWord> units = unit_words(text);
  for (const NameInText& one : names_in(text)) {
    const std::string word(text.substr(one.at, one.length));
    const bool component = one.at > 0 && text[one.at - 1] == '.';
    const bool unit = std::any_of(units.begin(), units.end(), [&](const UnitWord& u) { return u.at == one.at; });
    if (component || unit || !parameters.has(word) || std::find(names.begin(), names.end(), word) == names.end()) continue;
    parameters.doubt(
        fmt::format("in {} the parameter {} is read, though what an expression may read here has that name too: give one of "
                    "them another name",
                    quote(std::string(text)), quote(word)));
  }
}

void doubt_operators(const Parameters& parameters, std::string_view text, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (name.find_first_of("+-*^?<>=&|,()") == std::string::npos || text.find(name) == std::string_view::npos) continue;
    std::vector<std::string> others;
    std::copy_if(names.begin(), names.end(), std::back_inserter(others), [&](const std::string& other) { return other != name; });
    try {
      const std::vector<std::string> used = Expression(std::string(text), names).variables();
      if (std::find(used.begin(), used.end(), name) == used.end()) continue;
      const Expression parts(parameters.substitute(name), others);
      parameters.doubt(
          fmt::format("{} is read as what has this name, not as an expression, which it is with blanks beside its operators", quote(name)));
    } catch (const InputError&) {
      // It can be read in one way, or not at all.
    }
  }
}

std::vector<std::string> output_columns(const OutputDef& output, const Scene& scene) {
  const std::vector<std::string> xyz{".x", ".y", ".z"};
  std::vector<std::string> tags;
  switch (output.quantity) {
    case Quantity::position:
    case Quantity::velocity:
    case Quantity::acceleration:
    case Quantity::rotation:
    case Quantity::angular_velocity:
    case Quantity::displacement:
      tags = xyz;
      break;
    case Quantity::reaction:
      tags = {".x", ".y", ".z", ".mx", ".my", ".mz"};
      break;
    case Quantity::value:
    case Quantity::rate: {
      const JointDef* joint = joint_of(output, scene);
      const int n = joint ? rates_of(joint->kind) : 1;
      for (int k = 0; k < n; ++k) tags.push_back(n == 1 ? "" : traits(joint->kind).quaternion == 0 ? xyz[k] : fmt::format(".{}", k + 1));
      break;
    }
    case Quantity::q:
    case Quantity::qd:
    case Quantity::output:      // the block itself is read
    case Quantity::expression:  // what it reads is
      break;
    default:
      tags = {""};
  }
  for (std::string& tag : tags) tag.insert(0, output.name);
  return tags;
}

StateExpression read_state_expression(const TableReader& reader, std::string_view key, const char* unit, const Scene& scene,
                                      const std::vector<Reading>& own) {
  const TomlValue& value = reader.required(key);
  if (value.type == TomlValue::Type::integer || value.type == TomlValue::Type::real)
    return {.text = fmt::format("{}", reader.number(key)), .driven = {}, .reads = {}};
  if (value.type != TomlValue::Type::text) reader.fail(key, fmt::format("must be a number or an expression, found {}", describe(value)));
  const std::vector<Known> known = known_readings(scene, own);
  std::vector<std::string> names;
  names.reserve(known.size());
  for (const Known& k : known) names.push_back(k.reading.name);
  StateExpression out;
  std::vector<std::string> used;
  const auto compile = [&](const std::string& written) {
    const std::string named = reader.parameters().substitute(written);
    out.text = with_inputs(named, scene.inputs);
    if (out.text != named) out.driven = named;
    used = Expression(out.text, names).variables();
  };
  try {
    compile(reader.text(key));
  } catch (const InputError& error) {
    // "10 kN" is a number with a unit, "5 kN*sin(50 Hz*t)" has them inside.
    std::string why = error.what();
    bool inside = false, compiled = false;
    try {
      if (const std::optional<std::string> replaced = replace_units(value.text, unit)) {
        inside = true;
        compile(*replaced);
        compiled = true;
        reader.parameters().doubt_units(value.text, names);
      }
    } catch (const InputError& with_units) {
      inside = true;
      why = with_units.what();
    }
    if (!inside && !split_unit(value.text).second.empty())
      return {.text = fmt::format("{}", reader.number(key, any_number.in(unit))), .driven = {}, .reads = {}};
    if (!compiled) reader.fail(key, fmt::format("is no expression of t and of outputs of the scene: {}, {}", quote(value.text), why));
  }
  doubt_parameters(reader.parameters(), value.text, names);
  doubt_operators(reader.parameters(), out.text, names);
  if (used.size() > 64) reader.fail(key, fmt::format("reads {} values; at most 64 are allowed", used.size()));
  for (const std::string& name : used) {
    const Known& k = known[std::find(names.begin(), names.end(), name) - names.begin()];
    if (!k.why.empty()) reader.fail(key, fmt::format("reads the output {}, {}", quote(name), k.why));
    out.reads.push_back(k.reading);
  }
  return out;
}

}  // namespace flexframe::sim
