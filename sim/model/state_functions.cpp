#include "sim/model/state_functions.h"

#include "sim/model/model_build.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

int add_signal(Model& model, const Signal& signal) {
  model.signals.push_back(signal);
  return static_cast<int>(model.signals.size()) - 1;
}

Signal signal_of(Model& model, const Scene& scene, const std::string& owner, const FunctionSource& source, const Reading& reading) {
  Signal s;
  s.component = reading.component;
  if (reading.kind == Reading::block) {
    for (size_t b = 0; b < model.blocks.size(); ++b)
      if (model.blocks[b].scene_block == reading.index) s.block = static_cast<int>(b);
    return s;
  }
  if (reading.kind != Reading::output) {
    s.quantity = reading.kind == Reading::length ? Quantity::distance : Quantity::distance_rate;
    s.frame = source.on;
    s.relative_to = source.from;
    s.path = source.path;
    return s;
  }
  const OutputDef& output = scene.outputs[reading.index];
  s.quantity = output.quantity;
  if (s.quantity == Quantity::value || s.quantity == Quantity::rate) {
    for (size_t k = 0; k < scene.joints.size(); ++k)
      if (scene.joints[k].name == output.of.body) s.part = joint_part(model, static_cast<int>(k));
    s.rate = reading.component;
    return s;
  }
  const bool distance = s.quantity == Quantity::distance || s.quantity == Quantity::distance_rate;
  s.frame = add_frame(model, scene, output.of, owner);
  if (output.relative_to || distance) s.relative_to = add_frame(model, scene, output.relative_to.value_or(FrameRef{"ground", ""}), owner);
  return s;
}

}  // namespace

int add_function(Model& model, const Scene& scene, const std::string& owner, const FunctionSource& source) {
  StateFunction f;
  f.owner = owner;
  std::vector<std::string> names;
  for (const Reading& r : source.reads) names.push_back(r.name);
  try {
    f.expression = Expression(source.text, names);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", owner, error.what()));
  }
  for (const std::string& name : f.expression.variables()) {
    const auto at = std::find(names.begin(), names.end(), name) - names.begin();
    f.signals.push_back(add_signal(model, signal_of(model, scene, owner, source, source.reads[at])));
  }
  model.functions.push_back(std::move(f));
  return static_cast<int>(model.functions.size()) - 1;
}

bool is_read(const Scene& scene, const JointDef& joint) {
  const auto reads = [&](const std::vector<Reading>& all) {
    return std::any_of(all.begin(), all.end(), [&](const Reading& r) {
      if (r.kind != Reading::output) return false;
      const OutputDef& output = scene.outputs[r.index];
      return (output.quantity == Quantity::value || output.quantity == Quantity::rate) && output.of.body == joint.name;
    });
  };
  for (const ForceDef& f : scene.forces)
    if (reads(f.reads)) return true;
  for (const BlockDef& b : scene.blocks)
    for (const auto& r : b.reads)
      if (reads(r)) return true;
  return false;
}

}  // namespace flexframe::sim
