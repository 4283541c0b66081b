#include "sim/model/model_loads.h"

#include "sim/model/model_build.h"
#include "sim/model/state_functions.h"
#include "sim/scene/force_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

namespace flexframe::sim {
namespace {

// What a force's value follows: an expression or table of time, a table of a joint's coordinate, or an expression that reads the state.
void add_value(Model& model, const Scene& scene, const std::string& where, Load& load) {
  const ForceDef& def = load.def;
  if (!def.reads.empty()) {
    load.expression = static_cast<int>(model.expressions.size());
    model.expressions.emplace_back();
    load.function = add_function(model, scene, where, {def.value, def.reads, load.on, load.from, load.path});
    return;
  }
  load.expression = static_cast<int>(model.expressions.size());
  if (!def.table) {
    try {
      model.expressions.emplace_back(Expression(def.value));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: key 'value': {}", where, error.what()));
    }
    return;
  }
  const auto table = std::make_shared<const CubicTable>(def.table->x, def.table->y, def.table->period);
  if (def.table_joint.empty()) {
    model.expressions.emplace_back(table);
    return;
  }
  model.expressions.emplace_back();
  load.table = table;
  for (size_t k = 0; k < scene.joints.size(); ++k)
    if (scene.joints[k].name == def.table_joint) load.table_part = joint_part(model, static_cast<int>(k));
}

// A load along a chain acts on every part of it.
void spread_along_beam(Model& model, const Scene& scene, const std::string& where, Load load) {
  const ForceDef& def = load.def;
  const int body = model.frames[load.on].part == ground ? -1 : model.parts[model.frames[load.on].part].scene_body;
  if (body < 0 || !std::holds_alternative<BeamDef>(scene.bodies[body].kind))
    throw InputError(fmt::format("{}: a distributed load needs a beam, '{}' is none", where, def.on.body));
  for (size_t i = 0; i < model.parts.size(); ++i) {
    if (model.parts[i].scene_body != body) continue;
    load.on = load.from = add_own_frame(model, static_cast<int>(i), def.on.body);
    model.loads.push_back(load);
  }
}

// A cylinder with a width touches a plane at both its ends.
void add_contact(Model& model, const ForceDef& def, Load& load) {
  load.contact = static_cast<int>(model.contacts.size());
  std::vector<int> sides{0};
  if (def.contact->cylinder && def.contact->width > 0.0 && def.contact->from_radius == 0.0) sides = {-1, 1};
  for (const int side : sides) {
    Contact contact{static_cast<int>(model.loads.size()), side, -1};
    if (def.contact->static_friction > 0.0) {
      contact.z0 = model.nz;
      model.nz += 3;
    }
    model.contacts.push_back(contact);
  }
}

std::vector<int> blocks_read(const BlockDef& def) {
  std::vector<int> out;
  for (const auto& reads : def.reads)
    for (const Reading& r : reads)
      if (r.kind == Reading::block) out.push_back(r.index);
  return out;
}

// Sampled blocks in an order in which each comes after those whose output of the same sample it passes on, also by way of continuous
// ones; in a circle of them one takes what was held.
std::vector<int> sampled_order(const Scene& scene) {
  std::vector<int> order;
  std::vector<char> seen(scene.blocks.size(), 0);
  const std::function<void(int)> place = [&](int k) {
    if (seen[k]++ != 0) return;
    const BlockDef& def = scene.blocks[k];
    if (!def.D.isZero(0.0))
      for (const int other : blocks_read(def)) place(other);
    if (def.sample > 0.0) order.push_back(k);
  };
  for (size_t k = 0; k < scene.blocks.size(); ++k)
    if (scene.blocks[k].sample > 0.0) place(static_cast<int>(k));
  return order;
}

// Continuous blocks in an order in which each that passes its input on comes after what it reads.
std::vector<int> continuous_order(const Scene& scene) {
  std::vector<int> order;
  std::vector<char> state(scene.blocks.size(), 0);  // 1: being placed, 2: placed
  const std::function<void(int)> place = [&](int k) {
    const BlockDef& def = scene.blocks[k];
    if (def.sample > 0.0 || state[k] == 2) return;
    if (state[k] == 1)
      throw InputError(
          fmt::format("{}:{}: [[block]] '{}': its output waits for itself (an algebraic loop): it passes its input on at once and "
                      "reads, by way of other blocks, its own output; put a delay into the loop (a transfer function whose "
                      "denominator is of higher order, or a sampled block)",
                      scene.file.string(), def.line, def.name));
    state[k] = 1;
    if (!def.D.isZero(0.0))
      for (const int other : blocks_read(def)) place(other);
    state[k] = 2;
    order.push_back(k);
  };
  for (size_t k = 0; k < scene.blocks.size(); ++k) place(static_cast<int>(k));
  return order;
}

void add_blocks(Model& model, const Scene& scene) {
  std::vector<int> order = sampled_order(scene);
  for (const int k : continuous_order(scene)) order.push_back(k);
  for (const int k : order) {
    const BlockDef& def = scene.blocks[k];
    Block block{k, {}, def.A, def.B, def.C, def.D, def.initial, def.sample, -1};
    if (def.sample == 0.0) {
      block.z0 = model.nz;
      model.nz += static_cast<int>(def.A.rows());
    }
    model.blocks.push_back(std::move(block));
  }
  for (Block& block : model.blocks) {
    const BlockDef& def = scene.blocks[block.scene_block];
    for (size_t k = 0; k < def.inputs.size(); ++k)
      block.inputs.push_back(add_function(model, scene, fmt::format("{}:{}: [[block]] '{}'", scene.file.string(), def.line, def.name),
                                          {def.inputs[k], def.reads[k]}));
  }
}

// Works of forces that outputs ask for: a further state each.
void add_works(Model& model, const Scene& scene) {
  for (const OutputDef& output : scene.outputs) {
    const std::string& name = output.of.body;
    const auto known = [&](const ForceWork& w) { return w.force == name; };
    if (output.quantity != Quantity::work || std::any_of(model.works.begin(), model.works.end(), known)) continue;
    ForceWork work{name, {}, model.nz++};
    for (size_t i = 0; i < model.loads.size(); ++i)
      if (model.loads[i].def.name == name) work.loads.push_back(static_cast<int>(i));
    model.works.push_back(std::move(work));
  }
}

void add_forces(Model& model, const Scene& scene) {
  for (const ForceDef& def : scene.forces) {
    // A program's own force stands in no line of the file.
    const std::string where = def.kind == ForceKind::user ? fmt::format("{}: {}", scene.file.string(), def.name)
                                                          : fmt::format("{}:{}: force '{}'", scene.file.string(), def.line, def.name);
    Load load;
    load.def = def;
    load.on = load.from = add_frame(model, scene, def.on, where);
    if (traits(def.kind).between) load.from = add_frame(model, scene, def.from, where);
    if (!def.through.empty()) {
      load.path = {load.from};
      for (const FrameRef& frame : def.through) load.path.push_back(add_frame(model, scene, frame, where));
      load.path.push_back(load.on);
    }
    if (traits(def.kind).value || (def.kind == ForceKind::spring_damper && (!def.reads.empty() || def.value != "0")))
      add_value(model, scene, where, load);
    if (def.kind == ForceKind::contact) add_contact(model, def, load);
    if (!def.rest.empty()) {
      load.rest = static_cast<int>(model.expressions.size());
      model.expressions.emplace_back(Expression(def.rest));
    }
    if (def.kind == ForceKind::distributed) spread_along_beam(model, scene, where, load);
    else model.loads.push_back(load);
  }
}

}  // namespace

void add_loads(Model& model, const Scene& scene) {
  add_blocks(model, scene);
  add_forces(model, scene);
  add_works(model, scene);
}

}  // namespace flexframe::sim
