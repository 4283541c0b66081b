// What the columns of the history are of: names of the scene resolved, columns and units counted.
#include "sim/base/words.h"
#include "sim/bodies/beam_pieces.h"
#include "sim/model/bodies.h"
#include "sim/model/model_build.h"
#include "sim/results/outputs.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

const std::vector<std::string> xyz{".x", ".y", ".z"};
const std::vector<std::string> wrench_tags{".x", ".y", ".z", ".mx", ".my", ".mz"};
const std::vector<std::string> wrench_units{"N", "N", "N", "N m", "N m", "N m"};

// One output while it is resolved.
struct Planning {
  Model& model;
  const Scene& scene;
  OutputPlans& plans;
  OutputPlan plan;
  std::string where;                    // begins messages
  std::vector<std::string> tags{""};    // of its columns
  std::vector<std::string> units{"m"};  // a column each, or one for all
};

std::vector<std::string> names_of(const auto& all) {
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const auto& one : all) names.push_back(one.name);
  return names;
}

int index_of(const auto& all, const std::string& name) {
  for (size_t i = 0; i < all.size(); ++i)
    if (all[i].name == name) return static_cast<int>(i);
  return -1;
}

// The body of the scene that an output is of. Throws InputError.
int body_of(const Planning& p, const char* more) {
  const std::string& name = p.plan.def.of.body;
  const int body = index_of(p.scene.bodies, name);
  if (body >= 0) return body;
  const std::vector<std::string> known = names_of(p.scene.bodies);
  throw InputError(fmt::format("{}: '{}' is no body{}; {}{}", p.where, name, did_you_mean(name, known), more, list_words(known)));
}

void plan_energy(Planning& p) {
  p.units = {"J"};
  p.plan.system = p.plan.def.of.body == "system";
  if (!p.plan.system) p.plan.body = body_of(p, "energies are of 'system' or of a body: ");
}

void plan_elastic(Planning& p) {
  p.plan.body = body_of(p, "there are: ");
  const int n = coordinate_count(p.model, p.plan.body);
  if (n == 0) throw InputError(fmt::format("{}: body '{}' has no elastic coordinates", p.where, p.plan.def.of.body));
  p.tags.clear();
  for (int k = 0; k < n; ++k) p.tags.push_back(fmt::format(".{}", k + 1));
  p.units = {p.plan.def.quantity == Quantity::q ? "1" : "1/s"};
}

// A unit for each coordinate of a joint.
const char* coordinate_unit(Quantity quantity, bool length) {
  switch (quantity) {
    case Quantity::value:
      return length ? "m" : "rad";
    case Quantity::rate:
      return length ? "m/s" : "rad/s";
    default:
      return length ? "N" : "N m";
  }
}

void plan_joint(Planning& p) {
  const OutputDef& def = p.plan.def;
  const int joint = def.of.frame.empty() ? index_of(p.scene.joints, def.of.body) : -1;
  if (joint < 0) {
    const std::vector<std::string> known = names_of(p.scene.joints);
    throw InputError(
        fmt::format("{}: '{}' is no joint{}; there are: {}", p.where, def.of.body, did_you_mean(def.of.body, known), list_words(known)));
  }
  p.plan.joint_part = joint_part(p.model, joint);
  for (size_t l = 0; l < p.model.loops.size(); ++l)
    if (p.model.loops[l].scene_joint == joint) p.plan.loop = static_cast<int>(l);
  if (def.quantity == Quantity::reaction) {
    p.tags = wrench_tags;
    p.units = wrench_units;
    p.plans.reactions = p.plans.accelerations = true;
    return;
  }
  JointKind kind = p.scene.joints[joint].kind;
  const bool value = def.quantity == Quantity::value || def.quantity == Quantity::rate;
  // Friction by reactions is known once these are.
  if (def.quantity == Quantity::friction_force) p.plans.accelerations = true;
  // What acts along a line's point is of the joint that stands for it.
  if (!value && p.plan.loop < 0 && p.plan.joint_part >= 0) kind = p.model.parts[p.plan.joint_part].joint.kind;
  const int n = p.plan.loop >= 0 && !value ? 1 : rate_count(kind);
  if (n == 0) throw InputError(fmt::format("{}: a joint of this kind has no coordinate; the only quantity allowed is reaction", p.where));
  if (n > 1) p.tags.clear();
  for (int k = 0; k < n && n > 1; ++k) p.tags.push_back(traits(kind).quaternion == 0 ? xyz[k] : fmt::format(".{}", k + 1));
  p.units.clear();
  for (int k = 0; k < n; ++k) p.units.emplace_back(coordinate_unit(def.quantity, is_length(kind, k)));
}

// What a coupling does: the pull of a rope, or the force or moment on the coordinate of each of its terms.
void plan_coupling(Planning& p) {
  const CouplingRow& row = p.model.couplings[p.plan.coupling];
  p.plans.reactions = p.plans.accelerations = true;
  p.units = {"N"};
  if (!row.frames.empty()) return;
  p.tags.clear();
  p.units.clear();
  for (size_t k = 0; k < row.terms.size(); ++k) {
    const JointKind kind = p.model.parts[row.terms[k].part].joint.kind;
    p.tags.push_back(fmt::format(".{}", k + 1));
    p.units.emplace_back(is_length(kind, row.terms[k].rate) ? "N" : "N m");
  }
}

void plan_block(Planning& p) {
  p.plan.block = -1;
  for (size_t b = 0; b < p.model.blocks.size(); ++b)
    if (p.scene.blocks[p.model.blocks[b].scene_block].name == p.plan.def.of.body) p.plan.block = static_cast<int>(b);
  if (p.plan.block < 0) throw InputError(fmt::format("{}: '{}' is no block", p.where, p.plan.def.of.body));
  const Eigen::Index n = p.model.blocks[p.plan.block].C.rows();
  p.plans.accelerations = true;
  p.units = {p.plan.def.unit};
  if (n == 1) return;
  p.tags.clear();
  for (Eigen::Index k = 0; k < n; ++k) p.tags.push_back(fmt::format(".{}", k + 1));
}

void plan_combination(Planning& p) { p.units = {p.plan.def.unit}; }

// Finds the columns that an output reads; those of expressions only where they stand before it.
void find_reads(OutputPlan& plan, const std::vector<OutputPlan>& all, const std::vector<std::string>& columns, const std::string& where) {
  std::vector<std::string> names;
  for (const OutputPlan& other : all)
    for (int k = 0; k < other.count; ++k)
      names.push_back(family_of(other.def.quantity) != OutputFamily::combination || other.first < plan.first ? columns[other.first + k]
                                                                                                             : std::string());
  std::vector<std::string> known;
  for (const std::string& name : names)
    if (!name.empty()) known.push_back(name);
  try {
    plan.combination = Expression(plan.def.expression, known);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: key 'expression' is no expression of t and of columns of other outputs: {}; there are {}", where,
                                 error.what(), known.empty() ? "none" : list_words(known, 20)));
  }
  for (const std::string& name : plan.combination.variables())
    plan.reads.push_back(static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin()));
}

void plan_force(Planning& p) {
  const OutputDef& def = p.plan.def;
  if (def.quantity == Quantity::force)
    p.plan.coupling = index_of(p.scene.forces, def.of.body) < 0 ? index_of(p.model.couplings, def.of.body) : -1;
  if (p.plan.coupling >= 0) return plan_coupling(p);
  if (def.quantity == Quantity::work) {
    for (const ForceWork& work : p.model.works)
      if (work.force == def.of.body) p.plan.z0 = work.z0;
    p.units = {"J"};
    return;
  }
  for (size_t i = 0; i < p.model.loads.size(); ++i)
    if (p.model.loads[i].def.name == def.of.body) p.plan.loads.push_back(static_cast<int>(i));
  if (p.plan.loads.empty()) throw InputError(fmt::format("{}: '{}' is no force that acts in the model", p.where, def.of.body));
  const ForceKind kind = p.model.loads[p.plan.loads.front()].def.kind;
  // What expressions read of the state, and tables over a coordinate, is known once the loads have been.
  for (const int load : p.plan.loads)
    if (const Load& l = p.model.loads[load]; l.function >= 0 || l.table) p.plans.accelerations = true;
  if (def.quantity == Quantity::length_rate) p.units = {"m/s"};
  if (def.quantity == Quantity::power) p.units = {"W"};
  if (def.quantity != Quantity::force) return;
  p.units = {kind == ForceKind::torque ? "N m" : kind == ForceKind::distributed ? "N/m" : "N"};
  if (kind != ForceKind::bushing) return;
  p.tags = wrench_tags;
  p.units = wrench_units;
}

void plan_section(Planning& p) {
  const OutputDef& def = p.plan.def;
  p.plan.frame = add_frame(p.model, p.scene, def.of, p.where);
  // In the section's axes, however the frame is turned.
  Mat3& axes = p.model.frames[p.plan.frame].offset.R;
  axes = axes * frame_axes(p.scene, def.of).transpose();
  p.plans.reactions = p.plans.accelerations = true;
  if (def.quantity == Quantity::section_force) {
    p.tags = {".N", ".Vy", ".Vz", ".T", ".My", ".Mz"};
    p.units = wrench_units;
    return;
  }
  p.units = {"Pa"};
  const auto& beam = std::get<BeamDef>(p.scene.bodies[index_of(p.scene.bodies, def.of.body)].kind);
  const auto named = beam.frames.find(def.of.frame);
  p.plan.section = section_at(beam, named != beam.frames.end() ? named->second : def.of.frame == "tip" ? 1.0 : 0.0);
  p.plan.material = beam.material;
  p.plan.peak = SectionPeak(p.plan.section, beam.material.poisson);
}

// Unit of what a frame has.
const char* frame_unit(Quantity quantity) {
  switch (quantity) {
    case Quantity::velocity:
    case Quantity::distance_rate:
      return "m/s";
    case Quantity::acceleration:
      return "m/s^2";
    case Quantity::rotation:
    case Quantity::angle:
      return "rad";
    case Quantity::angular_velocity:
      return "rad/s";
    default:
      return "m";
  }
}

void plan_frame(Planning& p) {
  const OutputDef& def = p.plan.def;
  p.plan.frame = add_frame(p.model, p.scene, def.of, p.where);
  const bool scalar = def.quantity == Quantity::distance || def.quantity == Quantity::distance_rate || def.quantity == Quantity::angle;
  if (def.relative_to || scalar)
    p.plan.relative_to = add_frame(p.model, p.scene, def.relative_to.value_or(FrameRef{"ground", ""}), p.where);
  if (!scalar) p.tags = xyz;
  p.units = {frame_unit(def.quantity)};
  p.plans.accelerations = p.plans.accelerations || def.quantity == Quantity::acceleration;
  if (def.shown_from.empty()) return;
  p.plan.shown = shown_from_frames(p.model, p.scene, index_of(p.scene.bodies, def.of.body), def.shown_from,
                                   fmt::format("{}: key 'relative_to'", p.where));
}

}  // namespace

OutputFamily family_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::value:
    case Quantity::rate:
    case Quantity::reaction:
    case Quantity::spring_force:
    case Quantity::stop_force:
    case Quantity::friction_force:
      return OutputFamily::joint;
    case Quantity::length:
    case Quantity::length_rate:
    case Quantity::force:
    case Quantity::power:
    case Quantity::work:
      return OutputFamily::force;
    case Quantity::output:
      return OutputFamily::block;
    case Quantity::expression:
      return OutputFamily::combination;
    case Quantity::section_force:
    case Quantity::stress:
      return OutputFamily::section;
    case Quantity::q:
    case Quantity::qd:
      return OutputFamily::elastic;
    case Quantity::energy:
    case Quantity::kinetic:
    case Quantity::strain:
    case Quantity::potential:
      return OutputFamily::energy;
    default:
      return OutputFamily::frame;
  }
}

namespace {

bool at_one_place(const FramePoint& f, const FramePoint& g) {
  return f.part == g.part && f.node == g.node && f.offset.R == g.offset.R && f.offset.p == g.offset.p;
}

// A joint's frame at the place of a frame of what deforms, if there is one: its pose is known wherever positions are. Else the frame
// itself.
int joint_frame_at(const Model& model, int frame) {
  for (const Cluster& c : model.clusters)
    for (const int f : c.frames)
      if (f == frame || at_one_place(model.frames[f], model.frames[frame])) return f;
  return frame;
}

// Shown frames are found from joints' frames where these stand at the same places.
void share_joint_frames(Model& model, OutputPlans& plans) {
  const auto share = [&](int& frame) {
    if (frame >= 0 && frame < static_cast<int>(model.frames.size()) && model.frames[frame].part != ground)
      frame = joint_frame_at(model, frame);
  };
  for (Part& part : model.parts)
    if (part.shown.differs) share(part.shown.root), share(part.shown.tip);
  const auto share_shown = [&](ShownFrom& shown) {
    if (shown.kind == ShownFrom::tangent || shown.kind == ShownFrom::chord) share(shown.a);
    if (shown.kind == ShownFrom::chord) share(shown.b);
  };
  for (ShownFrom& shown : plans.shown) share_shown(shown);
  for (OutputPlan& plan : plans.outputs) {
    if (plan.shown) share_shown(*plan.shown);
    const Quantity q = plan.def.quantity;
    if (plan.relative_to < 0 && (q == Quantity::position || q == Quantity::displacement || q == Quantity::rotation)) share(plan.frame);
  }
}

// Outputs of one frame share its pose within a sample: the tip's position and its displacement.
void share_frames(const Model& model, std::vector<OutputPlan>& outputs) {
  std::vector<int> made;
  for (OutputPlan& plan : outputs) {
    if (family_of(plan.def.quantity) != OutputFamily::frame || plan.relative_to >= 0) continue;
    const FramePoint& f = model.frames[plan.frame];
    const auto same = std::find_if(made.begin(), made.end(), [&](int at) { return at_one_place(f, model.frames[at]); });
    plan.stands = same != made.end();
    if (plan.stands) plan.frame = *same;
    else made.push_back(plan.frame);
  }
}

// Whether a sample's poses and twists, coordinates and rates, and the energy of the system, are all that an output reads.
bool read_in_plane(const OutputPlan& plan) {
  switch (family_of(plan.def.quantity)) {
    case OutputFamily::frame:
      return plan.def.quantity != Quantity::acceleration;
    case OutputFamily::joint:
      return plan.def.quantity == Quantity::value || plan.def.quantity == Quantity::rate;
    case OutputFamily::energy:
      return plan.system;
    case OutputFamily::elastic:
    case OutputFamily::combination:
      return true;
    default:
      return false;
  }
}

// The frames of what deforms whose poses are read and not known from the joints.
std::vector<int> frames_read(const Model& model, const OutputPlans& plans) {
  std::vector<int> all;
  const auto take = [&](int f) {
    const FramePoint& at = model.frames[f];
    if (at.part == ground || model.parts[at.part].body.n == 0 || std::count(all.begin(), all.end(), f) > 0) return;
    const std::vector<int>& known = model.clusters[model.parts[at.part].cluster].frames;
    if (std::count(known.begin(), known.end(), f) > 0) return;
    all.push_back(f);
  };
  const auto take_all = [&](const std::vector<int>& frames) { std::for_each(frames.begin(), frames.end(), take); };
  for (size_t b = 0; b < plans.shown.size(); ++b) take_all(frames_of(model, static_cast<int>(b), plans.shown[b]));
  for (const OutputPlan& plan : plans.outputs) {
    if (plan.frame < 0 || family_of(plan.def.quantity) != OutputFamily::frame || plan.relative_to >= 0) continue;
    take(plan.frame);
    if (const int part = model.frames[plan.frame].part; plan.shown && part != ground)
      take_all(frames_of(model, model.parts[part].scene_body, *plan.shown));
  }
  return all;
}

// All frames whose poses outputs of places read.
std::vector<int> places_read(const Model& model, const OutputPlans& plans) {
  std::vector<int> all;
  const auto take = [&](const std::vector<int>& frames) {
    for (const int f : frames)
      if (std::count(all.begin(), all.end(), f) == 0) all.push_back(f);
  };
  for (size_t b = 0; b < plans.shown.size(); ++b) take(frames_of(model, static_cast<int>(b), plans.shown[b]));
  for (const OutputPlan& plan : plans.outputs) {
    if (plan.loop >= 0) take({model.loops[plan.loop].a, model.loops[plan.loop].b});
    if (plan.frame < 0) continue;
    take({plan.frame});
    if (const int part = model.frames[plan.frame].part; plan.shown && part != ground)
      take(frames_of(model, model.parts[part].scene_body, *plan.shown));
  }
  return all;
}

// Only outputs with a column that is read, and those that combinations among them read.
void leave_unread(const std::vector<bool>& read, OutputPlans& plans) {
  const auto columns_of = [](const OutputPlan& plan, const std::vector<bool>& marked) {
    return std::any_of(marked.begin() + plan.first, marked.begin() + plan.first + plan.count, [](bool marks) { return marks; });
  };
  std::vector<bool> needed = read;
  // Combinations read what stands before them.
  for (auto plan = plans.outputs.rbegin(); plan != plans.outputs.rend(); ++plan)
    if (columns_of(*plan, needed))
      for (const int column : plan->reads) needed[static_cast<size_t>(column)] = true;
  std::erase_if(plans.outputs, [&](const OutputPlan& plan) { return !columns_of(plan, needed); });
}

// Places alone do not ask how anything moves; forces and energies are measured against the energy of the system (histories.h).
bool only_places(const OutputPlan& plan) {
  const Quantity q = plan.def.quantity;
  if (family_of(q) == OutputFamily::frame)
    return plan.relative_to < 0 && (q == Quantity::position || q == Quantity::rotation || q == Quantity::displacement);
  return q == Quantity::value || q == Quantity::q || q == Quantity::expression;
}

}  // namespace

OutputPlans plan_outputs(Model& model, const Scene& scene, bool all_shown, const std::vector<bool>& read) {
  OutputPlans plans;
  plans.shown.resize(scene.bodies.size());
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const bool asked = std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) {
      return o.quantity == Quantity::displacement && o.of.body == scene.bodies[b].name;
    });
    if (all_shown || asked) plans.shown[b] = find_shown_frame(model, scene, static_cast<int>(b));
  }
  using PlanOne = void (*)(Planning&);
  // In the order of OutputFamily.
  constexpr PlanOne by_family[]{plan_frame, plan_joint, plan_force, plan_section, plan_elastic, plan_energy, plan_block, plan_combination};
  bool sections = false;
  for (const OutputDef& def : scene.outputs) {
    Planning p{.model = model, .scene = scene, .plans = plans, .plan = {}, .where = {}};
    p.plan.def = def;
    p.where = fmt::format("{}:{}: output '{}'", scene.file.string(), def.line, def.name);
    p.plan.first = static_cast<int>(plans.columns.size());
    const OutputFamily family = family_of(def.quantity);
    by_family[static_cast<size_t>(family)](p);
    sections = sections || family == OutputFamily::section;
    // The whole energy may be constant, and what an expression makes of energies their difference.
    const bool of_the_whole = (def.quantity == Quantity::energy && p.plan.system) || def.quantity == Quantity::expression;
    for (size_t k = 0; k < p.tags.size(); ++k) {
      plans.columns.push_back(def.name + p.tags[k]);
      plans.units.push_back(p.units.size() == 1 ? p.units.front() : p.units[k]);
      plans.descriptions.push_back(def.description);
      plans.sizes.push_back(def.size == 0.0 && of_the_whole && plans.units.back() == "J" ? -1.0 : def.size);
    }
    p.plan.count = static_cast<int>(p.tags.size());
    plans.outputs.push_back(std::move(p.plan));
  }
  for (OutputPlan& plan : plans.outputs)
    if (family_of(plan.def.quantity) == OutputFamily::combination)
      find_reads(plan, plans.outputs, plans.columns, fmt::format("{}:{}: output '{}'", scene.file.string(), plan.def.line, plan.def.name));
  if (!read.empty()) leave_unread(read, plans);
  share_joint_frames(model, plans);
  share_frames(model, plans.outputs);
  for (OutputPlan& plan : plans.outputs) {
    const int part = plan.frame >= 0 ? model.frames[plan.frame].part : ground;
    if (plan.def.quantity == Quantity::displacement && part != ground)
      plan.rest = compose(model.parts[part].rest_in_body, rest_pose(model, plan.frame)).p;
  }
  for (OutputPlan& plan : plans.outputs) {
    if (plan.def.quantity == Quantity::value && plan.loop >= 0 && !is_length(model.loops[plan.loop].kind, 0))
      plan.turns = TurnPath::find(model, model.loops[plan.loop].a, model.loops[plan.loop].b, model.loops[plan.loop].axis);
    if (plan.def.quantity == Quantity::rotation) plan.turns = TurnPath::find(model, plan.relative_to, plan.frame);
  }
  plans.moving = !std::all_of(plans.outputs.begin(), plans.outputs.end(), only_places);
  plans.frames = frames_read(model, plans);
  if (!plans.moving) plans.places = places_read(model, plans);
  plans.in_plane = !plans.accelerations && !plans.reactions && std::all_of(plans.outputs.begin(), plans.outputs.end(), read_in_plane);
  // Once all frames are known.
  if (sections) plans.sections = std::make_shared<SectionForces>(model, scene);
  return plans;
}

}  // namespace flexframe::sim
