#include "sim/results/outputs.h"

#include "sim/base/words.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/model/bodies.h"
#include "sim/model/model_build.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

bool energy_quantity(Quantity q) {
  return q == Quantity::energy || q == Quantity::kinetic || q == Quantity::strain || q == Quantity::potential;
}
bool joint_quantity(Quantity q) { return q == Quantity::value || q == Quantity::rate || q == Quantity::reaction; }

// The part's own acceleration includes the field of gravity; this is the frame's true one, world axes.
Vec3 world_acceleration(const Model& model, Work& work, int frame) {
  const FramePoint& f = model.frames[frame];
  if (f.part == ground) return Vec3::Zero();
  const PartWork& p = work.parts[f.part];
  const FrameWork& fw = work.frames[frame];
  Vec6 A = to_child(fw.pose, p.A) + fw.bias;
  if (fw.flexible) A.noalias() += fw.B * p.qdd;
  const Vec3 w = fw.V.tail<3>();
  return frame_world(model, work, frame).R * (A.head<3>() + w.cross(Vec3(fw.V.head<3>()))) + model.settings.gravity;
}

void joint_columns(const Model& model, const OutputPlan& plan, Work& work, const double* previous, double* out) {
  const bool value = plan.def.quantity == Quantity::value;
  if (plan.loop >= 0) {
    out[0] = value ? loop_value(model, work, plan.loop) : loop_rate(model, work, plan.loop);
    if (value && previous && !is_length(model.loops[plan.loop].kind, 0))
      out[0] += 2.0 * std::numbers::pi * std::round((previous[0] - out[0]) / (2.0 * std::numbers::pi));
    return;
  }
  const Part& part = model.parts[plan.joint_part];
  const TreeJoint& j = part.joint;
  if (j.motion >= 0) {
    out[0] = value ? work.motion[j.motion].value : work.motion[j.motion].rate;
    return;
  }
  const double* q = work.q.data() + part.q0;
  const double* w = work.w.data() + part.v0;
  if (!has_orientation(j.kind)) {
    for (int k = 0; k < plan.count; ++k) out[k] = value ? q[k] : w[k];
    return;
  }
  const int at = traits(j.kind).quaternion;
  const Mat3 R = orientation_of(j.kind, q);
  if (value) {
    for (int k = 0; k < at; ++k) out[k] = q[k];
    Vec3 a = rotation_log(R);
    if (previous) a = continue_rotation(a, Vec3(previous[at], previous[at + 1], previous[at + 2]));
    for (int k = 0; k < 3; ++k) out[at + k] = a[k];
  } else {
    for (int block = 0; block <= at; block += 3) {
      const Vec3 v = R * Vec3(w[block], w[block + 1], w[block + 2]);
      for (int k = 0; k < 3; ++k) out[block + k] = v[k];
    }
  }
}

void reaction_columns(const Model& model, const OutputPlan& plan, const Work& work, const Reactions& reactions, double* out) {
  Vec6 F;
  Mat3 R;
  if (plan.loop >= 0) {
    F = reactions.loop[plan.loop];
    R = frame_world(model, work, model.loops[plan.loop].b).R;
  } else {
    const TreeJoint& j = model.parts[plan.joint_part].joint;
    F = reactions.part[plan.joint_part];
    R = frame_world(model, work, j.outboard).R;
    if (j.reversed) {
      // The tree's carrier is the scene's child: the opposite wrench, at the inboard frame.
      F = -wrench_to_parent(work.parts[plan.joint_part].joint.pose, F);
      R = frame_world(model, work, j.inboard).R;
    }
  }
  // The wrench is in the axes of the scene's child frame: turned to those asked for.
  if (plan.def.frame == ReactionFrame::child) R.setIdentity();
  if (plan.def.frame == ReactionFrame::parent) {
    int parent = 0;
    if (plan.loop >= 0) {
      parent = model.loops[plan.loop].a;
    } else {
      const TreeJoint& j = model.parts[plan.joint_part].joint;
      parent = j.reversed ? j.outboard : j.inboard;
    }
    R = (frame_world(model, work, parent).R.transpose() * R).eval();
  }
  const Vec3 f = R * F.head<3>(), m = R * F.tail<3>();
  for (int k = 0; k < 3; ++k) out[k] = f[k], out[3 + k] = m[k];
}

// Elastic displacement of a frame relative to the undeformed body, m, in the shown frame of the body.
Vec3 displacement(const Model& model, const OutputPlans& plans, Work& work, int frame) {
  const FramePoint& f = model.frames[frame];
  if (f.part == ground) return Vec3::Zero();
  const Part& part = model.parts[f.part];
  const Pose rest = compose(part.rest_in_body, rest_pose(model, frame));
  const Pose shown = shown_pose(model, part.scene_body, plans.shown[static_cast<size_t>(part.scene_body)], work);
  Pose now = work.frames[frame].pose;
  // Without a chain everything stays in the part, so that small displacements keep their digits far from the origin.
  const int first = model.pieces[static_cast<size_t>(part.scene_body)].front();
  if (part.piece == 0) now = compose(inverse(shown), now);
  else now = compose(inverse(compose(work.parts[first].world, shown)), compose(work.parts[f.part].world, now));
  return now.p - rest.p;
}

// A frame's motion as seen from another, in the axes of that one: its derivatives are taken there.
void relative_columns(const Model& model, const OutputPlan& plan, Work& work, const double* previous, double* out) {
  for (const int f : {plan.frame, plan.relative_to}) {
    update_frame_position(model, f, work);
    update_frame_velocity(model, f, work);
  }
  const Pose seen = frame_world(model, work, plan.frame), from = frame_world(model, work, plan.relative_to);
  const Vec6 &V = work.frames[plan.frame].V, &U = work.frames[plan.relative_to].V;
  const Vec3 apart = from.R.transpose() * (seen.p - from.p);
  const Mat3 turn = from.R.transpose() * seen.R;
  const Vec3 velocity = turn * V.head<3>() - U.head<3>() - Vec3(U.tail<3>()).cross(apart);
  Vec3 v;
  switch (plan.def.quantity) {
    case Quantity::distance:
      out[0] = apart.norm();
      return;
    case Quantity::distance_rate: {
      // Where they meet the distance has a corner; its rate there is the speed at which they come apart.
      const double distance = apart.norm();
      out[0] = distance > 0.0 ? apart.dot(velocity) / distance : velocity.norm();
      return;
    }
    case Quantity::velocity:
      v = velocity;
      break;
    case Quantity::angular_velocity:
      v = turn * V.tail<3>() - U.tail<3>();
      break;
    case Quantity::rotation:
      v = rotation_log(turn);
      if (previous) v = continue_rotation(v, Vec3(previous[0], previous[1], previous[2]));
      break;
    default:
      v = apart;
  }
  for (int k = 0; k < 3; ++k) out[k] = v[k];
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
      return "rad";
    case Quantity::angular_velocity:
      return "rad/s";
    default:
      return "m";
  }
}

}  // namespace

OutputPlans plan_outputs(Model& model, const Scene& scene, bool all_shown) {
  OutputPlans plans;
  plans.shown.resize(scene.bodies.size());
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const bool asked = std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) {
      return o.quantity == Quantity::displacement && o.of.body == scene.bodies[b].name;
    });
    if (all_shown || asked) plans.shown[b] = find_shown_frame(model, scene, static_cast<int>(b));
  }
  for (const OutputDef& def : scene.outputs) {
    const std::string where = fmt::format("{}:{}: output '{}'", scene.file.string(), def.line, def.name);
    OutputPlan plan;
    plan.def = def;
    plan.first = static_cast<int>(plans.columns.size());
    std::vector<std::string> tags{""};
    std::string unit = "m";
    std::vector<std::string> units;
    int body = -1, joint = -1;
    std::vector<std::string> body_names, joint_names;
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      body_names.push_back(scene.bodies[i].name);
      if (scene.bodies[i].name == def.of.body) body = static_cast<int>(i);
    }
    for (size_t i = 0; i < scene.joints.size(); ++i) {
      joint_names.push_back(scene.joints[i].name);
      if (scene.joints[i].name == def.of.body && def.of.frame.empty()) joint = static_cast<int>(i);
    }
    const std::vector<std::string> xyz{".x", ".y", ".z"};
    if (energy_quantity(def.quantity)) {
      unit = "J";
      plan.system = def.of.body == "system";
      plan.body = body;
      if (!plan.system && body < 0)
        throw InputError(fmt::format("{}: '{}' is no body{}; energies are of 'system' or of a body: {}", where, def.of.body,
                                     did_you_mean(def.of.body, body_names), list_words(body_names)));
    } else if (joint_quantity(def.quantity)) {
      if (joint < 0)
        throw InputError(fmt::format("{}: '{}' is no joint{}; there are: {}", where, def.of.body, did_you_mean(def.of.body, joint_names),
                                     list_words(joint_names)));
      const JointDef& j = scene.joints[joint];
      plan.joint_part = joint_part(model, joint);
      for (size_t l = 0; l < model.loops.size(); ++l)
        if (model.loops[l].scene_joint == joint) plan.loop = static_cast<int>(l);
      if (def.quantity == Quantity::reaction) {
        tags = {".x", ".y", ".z", ".mx", ".my", ".mz"};
        units = {"N", "N", "N", "N m", "N m", "N m"};
        plans.reactions = plans.accelerations = true;
      } else {
        const int n = rate_count(j.kind);
        if (n == 0)
          throw InputError(fmt::format("{}: a joint of this kind has no coordinate; the only quantity allowed is reaction", where));
        if (n > 1) tags.clear();
        for (int k = 0; k < n && n > 1; ++k) tags.push_back(traits(j.kind).quaternion == 0 ? xyz[k] : fmt::format(".{}", k + 1));
        for (int k = 0; k < n; ++k) {
          const bool length = is_length(j.kind, k);
          units.push_back(def.quantity == Quantity::value ? (length ? "m" : "rad") : (length ? "m/s" : "rad/s"));
        }
      }
    } else if (def.quantity == Quantity::q || def.quantity == Quantity::qd) {
      if (body < 0)
        throw InputError(fmt::format("{}: '{}' is no body{}; there are: {}", where, def.of.body, did_you_mean(def.of.body, body_names),
                                     list_words(body_names)));
      plan.body = body;
      const int n = coordinate_count(model, body);
      if (n == 0) throw InputError(fmt::format("{}: body '{}' has no elastic coordinates", where, def.of.body));
      tags.clear();
      for (int k = 0; k < n; ++k) tags.push_back(fmt::format(".{}", k + 1));
      unit = def.quantity == Quantity::q ? "1" : "1/s";
    } else {
      plan.frame = add_frame(model, scene, def.of, where);
      const bool scalar = def.quantity == Quantity::distance || def.quantity == Quantity::distance_rate;
      if (def.relative_to || scalar) plan.relative_to = add_frame(model, scene, def.relative_to.value_or(FrameRef{"ground", ""}), where);
      if (!scalar) tags = xyz;
      unit = frame_unit(def.quantity);
      plans.accelerations = plans.accelerations || def.quantity == Quantity::acceleration;
    }
    for (size_t k = 0; k < tags.size(); ++k) {
      plans.columns.push_back(def.name + tags[k]);
      plans.units.push_back(units.empty() ? unit : units[k]);
    }
    plan.count = static_cast<int>(tags.size());
    plans.outputs.push_back(plan);
  }
  return plans;
}

void evaluate_outputs(const Model& model, const Scene&, const OutputPlans& plans, Work& work, const Reactions& reactions,
                      const double* previous, double* row) {
  for (const OutputPlan& plan : plans.outputs) {
    double* out = row + plan.first;
    const double* last = previous ? previous + plan.first : nullptr;
    if (plan.relative_to >= 0) {
      relative_columns(model, plan, work, last, out);
    } else if (plan.frame >= 0) {
      update_frame_position(model, plan.frame, work);
      update_frame_velocity(model, plan.frame, work);
      const Pose pose = frame_world(model, work, plan.frame);
      const FrameWork& f = work.frames[plan.frame];
      Vec3 v;
      switch (plan.def.quantity) {
        case Quantity::position:
          v = pose.p;
          break;
        case Quantity::velocity:
          v = pose.R * f.V.head<3>();
          break;
        case Quantity::angular_velocity:
          v = pose.R * f.V.tail<3>();
          break;
        case Quantity::acceleration:
          v = world_acceleration(model, work, plan.frame);
          break;
        case Quantity::displacement:
          v = displacement(model, plans, work, plan.frame);
          break;
        default:
          v = rotation_log(pose.R);
          if (last) v = continue_rotation(v, Vec3(last[0], last[1], last[2]));
      }
      for (int k = 0; k < 3; ++k) out[k] = v[k];
    } else if (plan.def.quantity == Quantity::reaction) {
      reaction_columns(model, plan, work, reactions, out);
    } else if (joint_quantity(plan.def.quantity)) {
      joint_columns(model, plan, work, last, out);
    } else if (energy_quantity(plan.def.quantity)) {
      const Energy e = compute_energy(model, work, plan.system ? -1 : plan.body);
      switch (plan.def.quantity) {
        case Quantity::kinetic:
          out[0] = e.kinetic;
          break;
        case Quantity::strain:
          out[0] = e.strain;
          break;
        case Quantity::potential:
          out[0] = e.potential;
          break;
        default:
          out[0] = e.kinetic + e.strain + e.potential;
      }
    } else {
      const bool rates = plan.def.quantity == Quantity::qd;
      const VecX x = body_coordinates(model, plan.body, rates ? work.w : work.q, rates);
      for (int k = 0; k < plan.count; ++k) out[k] = x[k];
    }
  }
}

double loop_value(const Model& model, const Work& work, int loop) {
  const LoopJoint& j = model.loops[loop];
  return pose_coordinate(j.kind, j.axis, compose(inverse(frame_world(model, work, j.a)), frame_world(model, work, j.b)));
}

double loop_rate(const Model& model, Work& work, int loop) {
  const LoopJoint& j = model.loops[loop];
  for (int f : {j.a, j.b}) {
    update_frame_position(model, f, work);
    update_frame_velocity(model, f, work);
  }
  const Pose rel = compose(inverse(frame_world(model, work, j.a)), frame_world(model, work, j.b));
  return pose_rate(j.kind, j.axis, rel, work.frames[j.a].V, work.frames[j.b].V);
}

Vec3 continue_rotation(const Vec3& a, const Vec3& previous) {
  const double angle = a.norm();
  Vec3 axis;
  if (angle > 1e-9) axis = a / angle;
  else if (previous.norm() > 1e-9) axis = previous.normalized();
  else return a;
  const double turns = std::round((previous.dot(axis) - angle) / (2.0 * std::numbers::pi));
  return a + 2.0 * std::numbers::pi * turns * axis;
}

}  // namespace flexframe::sim
