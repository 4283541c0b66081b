#include "sim/results/outputs.h"

#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/dynamics/reactions.h"
#include "sim/dynamics/stops.h"
#include "sim/model/bodies.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

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

// A rate, or a force on it, as a scene counts it: what turns freely is in the axes of the parent, the tree has it in those of the child.
void turn_to_parent(const TreeJoint& j, const double* q, const double* in, double* out) {
  const int at = traits(j.kind).quaternion;
  const Mat3 R = orientation_of(j.kind, q);
  for (int block = 0; block <= at; block += 3) {
    const Vec3 v = R * Vec3(in[block], in[block + 1], in[block + 2]);
    for (int k = 0; k < 3; ++k) out[block + k] = v[k];
  }
}

void joint_columns(const Model& model, const OutputPlan& plan, Work& work, const double* previous, double* out) {
  const bool value = plan.def.quantity == Quantity::value;
  if (plan.loop >= 0) {
    out[0] = value ? loop_value(model, work, plan.loop) : loop_rate(model, work, plan.loop);
    const double turned = value && plan.turns ? plan.turns->since_last(model, work) : 0.0;
    if (value && previous && !is_length(model.loops[plan.loop].kind, 0))
      out[0] += 2.0 * std::numbers::pi * std::round((previous[0] + turned - out[0]) / (2.0 * std::numbers::pi));
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
    turn_to_parent(j, q, w, out);
  }
}

void reaction_columns(const Model& model, const OutputPlan& plan, Work& work, const Reactions& reactions, double* out) {
  Vec6 F;
  Mat3 R;
  if (plan.loop >= 0) {
    const LoopJoint& loop = model.loops[plan.loop];
    F = reactions.loop[plan.loop];
    // Of joints of the tree it is within; axes do not turn about themselves.
    if (loop.spring) F.segment<3>(is_length(loop.kind, 0) ? 0 : 3) += loop_spring_force(model, work, plan.loop) * loop.axis;
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
Vec3 displacement(const Model& model, const OutputPlans& plans, const OutputPlan& plan, Work& work, bool placed) {
  const int frame = plan.frame;
  const FramePoint& f = model.frames[frame];
  if (f.part == ground) return Vec3::Zero();
  const Part& part = model.parts[f.part];
  const Pose shown = shown_pose(model, part.scene_body, plan.shown ? *plan.shown : plans.shown[part.scene_body], work, placed);
  const Pose& now = work.frames[frame].pose;
  // Without a chain everything stays in the part, so that small displacements keep their digits far from the origin.
  const int first = model.pieces[part.scene_body].front();
  if (part.piece == 0) {
    const Pose from = inverse(shown);
    return Vec3(from.R * now.p + from.p) - plan.rest;
  }
  return compose(inverse(compose(work.parts[first].world, shown)), compose(work.parts[f.part].world, now)).p - plan.rest;
}

// A rotation vector that goes on from that of the sample before.
Vec3 rotation_since(const Model& model, const OutputPlan& plan, const Work& work, const Vec3& v, const double* last) {
  const double turned = plan.turns ? plan.turns->since_last(model, work) : 0.0;
  return last ? continue_rotation(v, Vec3(last[0], last[1], last[2]), plan.turns ? plan.turns->axis() : Vec3(Vec3::Zero()), turned) : v;
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
    case Quantity::angle:
      out[0] = rotation_log(turn).norm();
      return;
    case Quantity::velocity:
      v = velocity;
      break;
    case Quantity::angular_velocity:
      v = turn * V.tail<3>() - U.tail<3>();
      break;
    case Quantity::rotation:
      v = rotation_log(turn);
      v = rotation_since(model, plan, work, v, previous);
      break;
    default:
      v = apart;
  }
  for (int k = 0; k < 3; ++k) out[k] = v[k];
}

}  // namespace

namespace {

void frame_columns(const Model& model, const OutputPlans& plans, const OutputPlan& plan, Work& work, const OutputRow& row) {
  double* const out = row.columns + plan.first;
  const double* const last = row.previous ? row.previous + plan.first : nullptr;
  // Where a frame stands does not ask how it moves.
  const Quantity wanted = plan.def.quantity;
  if (wanted == Quantity::velocity || wanted == Quantity::angular_velocity || wanted == Quantity::acceleration) {
    update_frame_position(model, plan.frame, work);
    update_frame_velocity(model, plan.frame, work);
  } else if (!plan.stands && !row.placed) {
    update_frame_pose(model, plan.frame, work);
  }
  const FrameWork& f = work.frames[plan.frame];
  const auto world = [&]() -> Pose { return frame_world(model, work, plan.frame); };
  Vec3 v;
  switch (wanted) {
    case Quantity::position:
      v = world().p;
      break;
    case Quantity::velocity:
      v = world().R * f.V.head<3>();
      break;
    case Quantity::angular_velocity:
      v = world().R * f.V.tail<3>();
      break;
    case Quantity::acceleration:
      v = world_acceleration(model, work, plan.frame);
      break;
    case Quantity::displacement:
      v = displacement(model, plans, plan, work, row.placed);
      break;
    default:
      v = rotation_log(world().R);
      v = rotation_since(model, plan, work, v, last);
  }
  for (int k = 0; k < 3; ++k) out[k] = v[k];
}

void energy_columns(const Model& model, const OutputPlan& plan, Work& work, const Energy* whole, double* out) {
  const Energy e = plan.system && whole ? *whole : compute_energy(model, work, plan.system ? -1 : plan.body);
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
}

// Pull of a rope, or force or moment of a coupling on the coordinate of each of its terms.
void coupling_columns(const Model& model, const OutputPlan& plan, const Work& work, const Reactions& reactions, double* out) {
  const CouplingRow& row = model.couplings[plan.coupling];
  const double multiplier = reactions.coupling[plan.coupling];
  if (!row.frames.empty()) {
    out[0] = -multiplier;
    return;
  }
  for (size_t k = 0; k < row.terms.size(); ++k) out[k] = multiplier * coupling_factor(model, work, row.terms[k]);
}

// What a force does: its length, its force, its power into the mechanism, its work.
void force_columns(const Model& model, const OutputPlan& plan, Work& work, double* out) {
  if (plan.z0 >= 0) {
    out[0] = work.signals.z[plan.z0];
    return;
  }
  const LoadState state = load_state(model, work, plan.loads);
  switch (plan.def.quantity) {
    case Quantity::length:
      out[0] = state.length;
      return;
    case Quantity::length_rate:
      out[0] = state.rate;
      return;
    case Quantity::power:
      out[0] = state.power;
      return;
    default:
      if (plan.count == 1) out[0] = state.force;
      else
        for (int k = 0; k < 6; ++k) out[k] = state.wrench[k];
  }
}

// What friction holds a rate with that sticks: the multiplier of its lock (friction.h).
double holding_force(const Model& model, Work& work, const Part& part, int rate) {
  const ClusterWork& cw = work.clusters[part.cluster];
  const auto lock = std::find(cw.locked.begin() + cw.carried, cw.locked.end(), part.v0 + rate - model.clusters[part.cluster].v0);
  if (lock == cw.locked.end()) return 0.0;
  const VecX lambda = closure_multipliers(model, work, part.cluster);
  return lambda[lambda.size() - (cw.locked.end() - lock)];
}

// Forces of a joint's spring, stop or friction on its coordinates.
void coordinate_force_columns(const Model& model, const OutputPlan& plan, Work& work, double* out) {
  if (plan.loop >= 0) {
    out[0] = loop_spring_force(model, work, plan.loop);
    return;
  }
  const Part& part = model.parts[plan.joint_part];
  const JointWork& at = work.joints[plan.joint_part];
  // Where a motion is prescribed they have no effect, as the run warns.
  if (part.joint.nv == 0) {
    std::fill_n(out, plan.count, 0.0);
  } else if (plan.def.quantity != Quantity::stop_force) {
    VecX force = VecX::Zero(part.joint.nv);
    if (plan.def.quantity == Quantity::spring_force) force = tree_spring_force(part, work);
    else
      for (int k = 0; k < plan.count; ++k) force[k] = (at.friction.size() > k ? at.friction[k] : 0.0) + holding_force(model, work, part, k);
    if (has_orientation(part.joint.kind)) turn_to_parent(part.joint, work.q.data() + part.q0, force.data(), out);
    else
      for (int k = 0; k < plan.count; ++k) out[k] = force[k];
  } else {
    const double q = work.q[part.q0], w = work.w[part.v0];
    const Stop& stop = *part.joint.stop;
    out[0] = stop_force(stop, at.stop == StopPhase::live ? find_stop_phase(stop, q, w) : at.stop, q, w);
  }
}

// Forces [N Vy Vz] and moments [T My Mz] that the tip's side exerts on the root's, section axes; where something acts at the very place,
// those on its side towards the root.
Vec6 wrench_in_section(const Model& model, const OutputPlans& plans, int frame) {
  const auto [b, k] = plans.sections->at(frame);
  const CutBeam& beam = plans.sections->beams()[b];
  const Vec6& in_piece = k == 0 ? beam.left.front() : beam.right[k - 1];
  // Of a curved beam, in the axes of its tangent.
  const Mat3 turn = model.frames[frame].offset.R.transpose();
  return joined(turn * in_piece.head<3>(), turn * in_piece.tail<3>());
}

// The largest von Mises stress in the section, of its section forces.
double section_stress(const OutputPlan& plan, const Vec6& f) {
  const Section& s = plan.section;
  const double E = plan.material.youngs_modulus, G = 0.5 * E / (1.0 + plan.material.poisson);
  // Moments are Mz = E (Iz v'' + Iyz w''), My = -E (Iyz v'' + Iy w''); transverse forces are minus their derivatives along the beam.
  Eigen::Matrix2d bending;
  bending << s.iz, s.iyz, s.iyz, s.iy;
  const Eigen::Matrix2d compliance = bending.inverse() / E;
  const Eigen::Vector2d curvature = compliance * Eigen::Vector2d(f[5], -f[4]), rates = compliance * Eigen::Vector2d(-f[1], -f[2]);
  const SectionStrains strains(f[0] / (E * s.area), curvature[0], curvature[1], f[3] / (G * s.j));
  return plan.peak.von_mises(strains, rates, E, G);
}

}  // namespace

void evaluate_outputs(const Model& model, const OutputPlans& plans, Work& work, const Reactions& reactions, const OutputRow& row) {
  if (plans.sections) plans.sections->evaluate(model, work, reactions);
  for (const OutputPlan& plan : plans.outputs) {
    double* out = row.columns + plan.first;
    const double* last = row.previous ? row.previous + plan.first : nullptr;
    switch (family_of(plan.def.quantity)) {
      case OutputFamily::section: {
        const Vec6 wrench = wrench_in_section(model, plans, plan.frame);
        if (plan.def.quantity == Quantity::stress) out[0] = section_stress(plan, wrench);
        else
          for (int k = 0; k < 6; ++k) out[k] = wrench[k];
        break;
      }
      case OutputFamily::force:
        if (plan.coupling >= 0) coupling_columns(model, plan, work, reactions, out);
        else force_columns(model, plan, work, out);
        break;
      case OutputFamily::block: {
        const VecX& y = work.signals.output[plan.block];
        for (int k = 0; k < plan.count; ++k) out[k] = y[k];
        break;
      }
      case OutputFamily::combination:
        break;  // below
      case OutputFamily::joint:
        if (plan.def.quantity == Quantity::reaction) reaction_columns(model, plan, work, reactions, out);
        else if (plan.def.quantity == Quantity::value || plan.def.quantity == Quantity::rate) joint_columns(model, plan, work, last, out);
        else coordinate_force_columns(model, plan, work, out);
        break;
      case OutputFamily::energy:
        energy_columns(model, plan, work, row.energy, out);
        break;
      case OutputFamily::elastic: {
        const bool rates = plan.def.quantity == Quantity::qd;
        const VecX x = body_coordinates(model, plan.body, rates ? work.w : work.q, rates);
        for (int k = 0; k < plan.count; ++k) out[k] = x[k];
        break;
      }
      case OutputFamily::frame:
        if (plan.relative_to >= 0) relative_columns(model, plan, work, last, out);
        else frame_columns(model, plans, plan, work, row);
    }
  }
  std::vector<double> read;
  for (const OutputPlan& plan : plans.outputs) {
    if (family_of(plan.def.quantity) != OutputFamily::combination) continue;
    read.clear();
    for (const int column : plan.reads) read.push_back(row.columns[column]);
    try {
      row.columns[plan.first] = plan.combination.value(work.time, read.data());
    } catch (const SimulationError& error) {
      throw SimulationError(fmt::format("output '{}': {}", plan.def.name, error.what()));
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

Vec3 continue_rotation(const Vec3& a, const Vec3& previous, const Vec3& axis, double turned) {
  const double angle = a.norm();
  Vec3 along;
  if (angle > 1e-9) along = a / angle;
  else if (previous.norm() > 1e-9) along = previous.normalized();
  else if (turned != 0.0) along = axis;
  else return a;
  double before = previous.dot(along);
  // Rotation vectors beside the axis about which all turns go not along with it.
  const auto beside = [&](const Vec3& v) { return v.cross(axis).norm() > 1e-6 * std::max(v.norm(), 1.0); };
  if (turned != 0.0 && !beside(a) && !beside(previous)) before += turned * axis.dot(along);
  const double turns = std::round((before - angle) / (2.0 * std::numbers::pi));
  return a + 2.0 * std::numbers::pi * turns * along;
}

}  // namespace flexframe::sim
