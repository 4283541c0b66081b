#include "sim/model/model_build.h"

#include "sim/base/words.h"
#include "sim/model/bodies.h"
#include "sim/model/clusters.h"
#include "sim/model/model_loads.h"
#include "sim/model/spanning_tree.h"
#include "sim/scene/joint_kinds.h"
#include "sim/scene/named.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// What the scene's start makes of a coupling's coordinate.
double coordinate_at_start(const Model& model, const Scene& scene, const CouplingRow::Term& term) {
  const TreeJoint& joint = model.parts[term.part].joint;
  if (joint.motion >= 0) return model.expressions[joint.motion].value(0.0);
  const JointInitial& initial = scene.joints[joint.scene_joint].initial;
  const auto& given = initial.value ? initial.value : initial.guess;
  return given ? (*given)[term.rate] : 0.0;
}

// Rows by parts; factors such that the largest is one, of lengths where there are any.
void add_couplings(Model& model, const Scene& scene) {
  for (size_t i = 0; i < scene.couplings.size(); ++i) {
    const CouplingDef& def = scene.couplings[i];
    CouplingRow row;
    row.name = def.name;
    row.scene_coupling = static_cast<int>(i);
    double lengths = 0.0, angles = 0.0;
    for (const CouplingTerm& t : def.terms) {
      CouplingRow::Term term{-1, t.coordinate, t.factor, t.of};
      for (size_t k = 0; k < scene.joints.size(); ++k)
        if (scene.joints[k].name == t.joint) term.part = joint_part(model, static_cast<int>(k));
      if (term.part < 0)
        throw InputError(
            fmt::format("{}:{}: coupling '{}': joint '{}' has no coordinate", scene.file.string(), def.line, def.name, t.joint));
      double& largest = is_length(model.parts[term.part].joint.kind, t.coordinate) ? lengths : angles;
      largest = std::max(largest, std::abs(t.factor));
      if (!def.value) row.value += t.factor * coordinate_at_start(model, scene, term);
      row.terms.push_back(std::move(term));
    }
    const std::string where = fmt::format("{}:{}: coupling '{}'", scene.file.string(), def.line, def.name);
    for (const FrameRef& frame : def.through) row.frames.push_back(add_frame(model, scene, frame, where));
    if (!row.frames.empty()) lengths = 1.0;
    row.length = lengths > 0.0;
    const double scale = row.length ? lengths : angles;
    row.value = def.value.value_or(row.value) / scale;
    row.scale = scale;
    for (CouplingRow::Term& term : row.terms) term.factor /= scale;
    const auto moved = [&](const CouplingRow::Term& t) { return model.parts[t.part].joint.motion >= 0; };
    if (row.frames.empty() && std::all_of(row.terms.begin(), row.terms.end(), moved))
      throw InputError(fmt::format("{}: all its joints have a prescribed motion; leave one of them free", where));
    model.couplings.push_back(std::move(row));
  }
}

}  // namespace

int add_frame(Model& model, const Scene& scene, const FrameRef& ref, const std::string& where) {
  FramePoint f;
  f.name = ref.frame.empty() ? ref.body : ref.body + "." + ref.frame;
  if (ref.body != "ground") {
    const int body = body_number(scene, ref.body);
    if (body < 0) {
      std::vector<std::string> names{"ground"};
      for (const BodyDef& b : scene.bodies) names.push_back(b.name);
      throw InputError(fmt::format("{}: '{}' is no body{}", where, ref.body, did_you_mean(ref.body, names)));
    }
    f = find_frame(model, scene, body, ref.frame, where);
  } else if (!ref.frame.empty()) {
    const auto at = scene.ground_frames.find(ref.frame);
    if (at == scene.ground_frames.end()) throw InputError(fmt::format("{}: 'ground' has no frame '{}'", where, ref.frame));
    f.offset = {frame_axes(scene, ref), at->second};
  }
  model.frames.push_back(f);
  const int index = static_cast<int>(model.frames.size()) - 1;
  if (f.part != ground && !model.parts[f.part].body.nodes.empty()) resolve_node(model, where, index);
  return index;
}

int add_own_frame(Model& model, int part, const std::string& name) {
  model.frames.push_back(FramePoint{part, -1, {}, "", name});
  return static_cast<int>(model.frames.size()) - 1;
}

int joint_part(const Model& model, int scene_joint) {
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (model.parts[i].joint.scene_joint == scene_joint) return static_cast<int>(i);
  return -1;
}

Model build_model(const Scene& scene, const FurtherOfBodies& further) {
  Model model;
  model.title = scene.title;
  model.settings = scene.simulation;
  if (scene.bodies.empty()) throw InputError(fmt::format("{}: there is no [[body]], nothing to simulate", scene.file.string()));

  SpanningTree tree = make_spanning_tree(model, scene);
  // Bodies' elastic coordinates depend on how the scene moves; now the tree is known.
  make_bodies(model, scene, tree.order, further);
  model.loops = std::move(tree.loops);
  add_couplings(model, scene);
  form_clusters(model, scene, tree.order);
  for (const Part& p : model.parts) model.mass += p.body.mass;
  add_loads(model, scene);
  return model;
}

}  // namespace flexframe::sim
