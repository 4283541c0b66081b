#include "sim/dynamics/loads.h"

#include "sim/base/sized.h"
#include "sim/dynamics/contacts.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/signals.h"
#include "sim/dynamics/stops.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

namespace flexframe::sim {
namespace {

// Adds a wrench (frame axes) on a frame to its part's load.
template <class W>
void apply_wrench(const Model& model, W& work, int frame, const typename W::In::Twist& F) {
  const FramePoint& f = model.frames[frame];
  if (f.part == ground) return;
  auto& p = work.parts[f.part];
  const auto& fw = work.frames[frame];
  p.load += wrench_to_parent(fw.pose, F);
  if (fw.flexible) add_transposed(fw.B, F, p.load_e);
}

// Line of a spring-damper from frame `from` to frame `on`: unit vector in world axes (its part within the plane), length, rate of length.
template <class S>
struct Line {
  typename S::Linear direction;
  double length, rate;
};

template <class W>
Line<typename W::In> line_between(const Model& model, const W& work, int from, int on, double height) {
  using S = typename W::In;
  const typename S::Pose a = frame_world(model, work, from), b = frame_world(model, work, on);
  const typename S::Linear d = b.p - a.p;
  const double length = height == 0.0 ? d.norm() : std::hypot(d.norm(), height);
  // Two ends at one point have no direction: the spring of zero length pulls nowhere.
  const typename S::Linear u = length > 0.0 ? typename S::Linear(d / length) : typename S::Linear(S::Linear::Zero());
  const typename S::Linear va = turn(a, linear(work.frames[from].V)), vb = turn(b, linear(work.frames[on].V));
  return {u, length, u.dot(vb - va)};
}

// The same of a load: of a cable over pulleys its whole length, without a direction.
template <class W>
Line<typename W::In> line_between(const Model& model, const W& work, const Load& load) {
  if (load.path.empty()) return line_between(model, work, load.from, load.on, height_between(work, load.from, load.on));
  Line<typename W::In> sum{W::In::Linear::Zero(), 0.0, 0.0};
  for (size_t k = 1; k < load.path.size(); ++k) {
    const auto stretch = line_between(model, work, load.path[k - 1], load.path[k], 0.0);
    sum.length += stretch.length;
    sum.rate += stretch.rate;
  }
  return sum;
}

// Relative position (in the axes of `from`) and rotation vector of a bushing, and their rates.
struct Bushing {
  Vec6 deflection, rate;
  Pose relative;
};

template <class W>
Bushing bushing_state(const Model& model, const W& work, const Load& load) {
  Bushing out;
  out.relative = compose(inverse(pose_in_space(model, work, load.from)), pose_in_space(model, work, load.on));
  const Vec6 Va = in_space(work, load.from, work.frames[load.from].V), Vb = in_space(work, load.on, work.frames[load.on].V);
  const Vec3 wa = Va.tail<3>();
  out.deflection.head<3>() = out.relative.p;
  out.deflection.tail<3>() = rotation_log(out.relative.R);
  out.rate.head<3>() = out.relative.R * Vb.head<3>() - Va.head<3>() - wa.cross(out.relative.p);
  out.rate.tail<3>() = out.relative.R * Vb.tail<3>() - wa;
  return out;
}

// Force of a bushing on `on`, in the axes of `from`, about the origin of `on`. The moment is the gradient of the energy of the
// rotation vector, so that the bushing conserves: with a = log(R), power = K a . da/dt and da/dt = J_l(a)^-1 w.
Vec6 bushing_force(const Load& load, const Bushing& b) {
  Vec6 f = -load.def.bushing_stiffness.cwiseProduct(b.deflection);
  const Vec3 a = b.deflection.tail<3>(), m = f.tail<3>();
  const RotationSeries k(a.squaredNorm());
  const Mat3 A = skew(a);
  const Mat3 Jl = Mat3::Identity() + k.b * A + k.c * A * A;
  f.tail<3>() = Jl.transpose().partialPivLu().solve(m);
  return f - load.def.bushing_damping.cwiseProduct(b.rate);
}

// Rest of a spring at the present time and its rate.
TimeJet spring_rest(const Model& model, const Load& load, double t) {
  return load.rest >= 0 ? model.expressions[load.rest].jet(t) : TimeJet{load.def.spring.rest, 0.0, 0.0};
}

// What pulls its ends together beside stiffness, damping and preload, N.
double extra_pull(const Load& load, const std::vector<double>& expression_value) {
  return load.expression >= 0 ? expression_value[load.expression] : 0.0;
}

template <class W>
double spring_damper_force(const Model& model, const W& work, const Load& load, const Line<typename W::In>& line) {
  const Spring& s = load.def.spring;
  if (load.def.cable) return -extra_pull(load, work.expression_value);
  const double rest = load.rest >= 0 ? spring_rest(model, load, work.time).value : s.rest;
  return -s.preload - s.stiffness * (line.length - rest) - s.damping * line.rate - extra_pull(load, work.expression_value);
}

// How far a spring is stretched, m: a slack cable not at all.
double stretched(const Model& model, const Load& load, double length, double t) {
  const double d = length - spring_rest(model, load, t).value;
  return load.def.cable ? std::max(d, 0.0) : d;
}

// What a spring's stretch pulls with, N: of a cable as long as its pull has it, on both sides of where it tightens or slackens. A step that
// ends beyond that place sees one of them all along; what is kinked within a step, the work that is integrated with it lacks.
template <class W>
double elastic_pull(const Model& model, const W& work, const Load& load, const Line<typename W::In>& line) {
  const double d = line.length - spring_rest(model, load, work.time).value;
  if (!load.def.cable) return load.def.spring.stiffness * d;
  if (load.def.spring.damping == 0.0) return extra_pull(load, work.expression_value);
  // "length > rest" is the first choice of its pull (read_cable).
  const bool stays = first_margin(model.functions[load.function], work.signals, work.time) > 0.0;
  return stays == (d > 0.0) ? load.def.spring.stiffness * d : 0.0;
}

// Drag on a frame in its axes, and the velocity of what flows past it.
template <class W>
Vec3 drag_force(const Model& model, const W& work, const Load& load, Vec3& wind) {
  wind = pose_in_space(model, work, load.on).R.transpose() * load.def.wind;
  const Vec3 v = in_space(work, load.on, work.frames[load.on].V).template head<3>() - wind;
  return -(load.def.drag + load.def.square_drag * v.norm()) * v;
}

template <class W>
void refresh_frames(const Model& model, W& work, const Load& load) {
  for (int f : {load.on, load.from}) {
    update_frame_position(model, f, work);
    update_frame_velocity(model, f, work);
    if (load.on == load.from) break;
  }
  for (size_t k = 1; k + 1 < load.path.size(); ++k) {
    update_frame_position(model, load.path[k], work);
    update_frame_velocity(model, load.path[k], work);
  }
}

// Direction of a force, torque or uniform load: a wrench per unit of its value, world axes or those of its frame.
Vec6 direction_of(const Model& model, const Work&, int load) {
  const ForceDef& def = model.loads[load].def;
  return def.kind == ForceKind::torque ? joined(Vec3::Zero(), def.direction) : joined(def.direction, Vec3::Zero());
}
Vec3 direction_of(const Model&, const PlaneWork& work, int load) { return work.plane.load_direction[load]; }

// Wrench of a force or torque in the frame's axes.
template <class W>
typename W::In::Twist frame_wrench(const Model& model, const W& work, int load, double value) {
  using S = typename W::In;
  const ForceDef& def = model.loads[load].def;
  typename S::Twist F = direction_of(model, work, load) * value;
  if (def.follower) return F;
  if (def.kind == ForceKind::torque)
    return joined(typename S::Linear(S::Linear::Zero()), turn_back(frame_world(model, work, model.loads[load].on), angular(F)));
  return joined(turn_back(frame_world(model, work, model.loads[load].on), linear(F)), S::no_turn());
}

void elastic_weight(const Mat6X& Mre, const Vec3& d, VecX& out) { out = Mre.topRows<3>().transpose() * d; }
void elastic_weight(const MatX3& Mre, const Vec2& d, VecX& out) { out = Mre.col(0) * d.x() + Mre.col(1) * d.y(); }

// Resultant about the body frame and generalised elastic forces of a uniform load per length: a uniform field of acceleration.
template <class W>
void distributed_load(const Model& model, const W& work, int load, typename W::In::Twist& F, VecX& Fe) {
  const Load& l = model.loads[load];
  const int part = model.frames[l.on].part;
  const auto& p = work.parts[part];
  typename W::In::Linear d =
      linear(direction_of(model, work, load)) * (work.expression_value[l.expression] * model.parts[part].load_factor);
  if (!l.def.follower) d = turn_back(p.world, d);
  F = joined(model.parts[part].body.mass * d, cross(p.terms.md, d));
  elastic_weight(p.terms.Mre, d, Fe);
}

// Spring of a joint that closes a loop (JointTraits::read_off): deflection, its rate, and the relative pose. An angle counts by the
// shorter way round from the spring's rest.
struct LoopSpring {
  double deflection, rate;
  Pose relative;
};

template <class W>
LoopSpring loop_spring(const Model& model, const W& work, const LoopJoint& loop) {
  LoopSpring out;
  out.relative = compose(inverse(pose_in_space(model, work, loop.a)), pose_in_space(model, work, loop.b));
  out.deflection = pose_coordinate(loop.kind, loop.axis, out.relative) - loop.spring->rest;
  if (!is_length(loop.kind, 0)) out.deflection = std::remainder(out.deflection, 2.0 * std::numbers::pi);
  out.rate = pose_rate(loop.kind, loop.axis, out.relative, in_space(work, loop.a, work.frames[loop.a].V),
                       in_space(work, loop.b, work.frames[loop.b].V));
  return out;
}

// Calls on_frame(frame, wrench) for both ends of a loop joint's spring.
template <class W, class OnFrame>
void visit_loop_spring(const Model& model, W& work, const LoopJoint& loop, const OnFrame& on_frame) {
  for (int f : {loop.a, loop.b}) {
    update_frame_position(model, f, work);
    update_frame_velocity(model, f, work);
  }
  const LoopSpring s = loop_spring(model, work, loop);
  const Vec3 push = -(loop.spring->preload + loop.spring->stiffness * s.deflection + loop.spring->damping * s.rate) * loop.axis;
  Vec6 on = Vec6::Zero(), back = Vec6::Zero();
  if (is_length(loop.kind, 0)) {
    on.head<3>() = s.relative.R.transpose() * push;
    back.head<3>() = -push;
    back.tail<3>() = -s.relative.p.cross(push);
  } else {
    on.tail<3>() = s.relative.R.transpose() * push;
    back.tail<3>() = -push;
  }
  on_frame(loop.b, within(work, loop.b, on));
  on_frame(loop.a, within(work, loop.a, back));
}

// At most six rates: no memory is asked for.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
using JointMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

// Joint coordinates as a scene counts them (orientations as rotation vectors), and dc/dt = J w. Where the two are one, J stays empty.
void scene_joint_coordinates(const TreeJoint& joint, const double* q, JointVector& c, JointMatrix& J) {
  if (!has_orientation(joint.kind)) {
    c = Eigen::Map<const JointVector>(q, joint.nv);
    J.resize(0, 0);
    return;
  }
  const int at = traits(joint.kind).quaternion;
  const Mat3 R = orientation_of(joint.kind, q);
  const Vec3 a = rotation_log(R);
  c.resize(joint.nv);
  J = JointMatrix::Zero(joint.nv, joint.nv);
  c.tail<3>() = a;
  J.bottomRightCorner<3, 3>() = right_jacobian(a, RotationSeries(a.squaredNorm())).inverse();
  if (at == 0) return;
  c.head<3>() = Vec3(q[0], q[1], q[2]);
  J.topLeftCorner<3, 3>() = R;
}

// Spring force on every rate of a joint: the gradient of its energy, and the damper.
void joint_spring_forces(const TreeJoint& joint, const double* q, const double* w, VecX& out) {
  const Spring& s = *joint.spring;
  JointVector c;
  JointMatrix J;
  scene_joint_coordinates(joint, q, c, J);
  c = (s.stiffness * (c.array() - s.rest) + s.preload).matrix();
  if (J.size() > 0) out.noalias() -= J.transpose() * c;
  else out -= c;
  for (int k = 0; k < joint.nv; ++k) out[k] -= s.damping * w[k];
}

double joint_spring_energy(const TreeJoint& joint, const double* q) {
  const Spring& s = *joint.spring;
  JointVector c;
  JointMatrix J;
  scene_joint_coordinates(joint, q, c, J);
  const Eigen::ArrayXd d = c.array() - s.rest;
  return 0.5 * s.stiffness * d.square().sum() + s.preload * d.sum();
}

}  // namespace

namespace {

// What a user's function says, in the frame's axes. A mechanism with one is not taken as one in a plane.
template <class W, class OnFrame>
void visit_user(const Model& model, W& work, const Load& load, const OnFrame& on_frame) {
  if constexpr (std::is_same_v<typename W::In, Space>) {
    const Pose pose = frame_world(model, work, load.on);
    const Vec6& V = work.frames[load.on].V;
    const UserWrench said = load.def.user({work.time, pose.p, pose.R, pose.R * V.head<3>(), pose.R * V.tail<3>()});
    if (!said.force.allFinite() || !said.torque.allFinite())
      throw SimulationError(fmt::format("the user's force on '{}' is not finite at t = {:.9g} s", model.frames[load.on].name, work.time));
    const Vec6 F = joined(turn_back(pose, said.force), turn_back(pose, said.torque));
    on_frame(load.on, F);
    work.applied += F.dot(V);
  }
}

// A spring-damper's or bushing's wrenches on both its ends, or what a user's function says.
template <class W, class OnFrame>
void visit_link(const Model& model, W& work, const Load& load, const OnFrame& on_frame) {
  using S = typename W::In;
  if (load.def.kind == ForceKind::user) return visit_user(model, work, load, on_frame);
  if (load.def.kind == ForceKind::bushing) {
    const Bushing b = bushing_state(model, work, load);
    const Vec6 f = bushing_force(load, b);
    on_frame(load.on, within(work, load.on, joined(turn_back(b.relative, linear(f)), turn_back(b.relative, angular(f)))));
    Vec6 back = -f;
    back.tail<3>() -= b.relative.p.cross(Vec3(f.head<3>()));
    on_frame(load.from, within(work, load.from, back));
    return;
  }
  const Line<S> line = line_between(model, work, load);
  const double push = spring_damper_force(model, work, load, line);
  if (!load.def.cable) work.applied -= extra_pull(load, work.expression_value) * line.rate;
  if (load.rest >= 0)
    work.applied -= (elastic_pull(model, work, load, line) + load.def.spring.preload) * spring_rest(model, load, work.time).rate;
  const auto pull = [&](int from, int on, const typename S::Linear& force) {
    on_frame(on, joined(turn_back(frame_world(model, work, on), force), S::no_turn()));
    on_frame(from, joined(typename S::Linear(-turn_back(frame_world(model, work, from), force)), S::no_turn()));
  };
  if (load.path.empty()) pull(load.from, load.on, push * line.direction);
  for (size_t k = 1; k < load.path.size(); ++k)
    pull(load.path[k - 1], load.path[k], push * line_between(model, work, load.path[k - 1], load.path[k], 0.0).direction);
}

// Calls on_frame(frame, wrench) for what acts on a frame, on_length(load) for what acts along a beam, in the scene's order; the power of
// forces and torques goes into Rates::applied.
template <class W, class OnFrame, class OnLength>
void visit_loads(const Model& model, W& work, const OnFrame& on_any, const OnLength& on_length) {
  work.applied = 0.0;
  update_signals(model, work);
  double power = 0.0;  // of one load, where works are asked for
  const auto on_frame = [&](int frame, const auto& F) {
    if (!model.works.empty()) power += F.dot(work.frames[frame].V);
    on_any(frame, F);
  };
  for (const ForceWork& done : model.works) work.signals.zdot[done.z0] = 0.0;
  for (const LoopJoint& loop : model.loops)
    if (loop.spring) visit_loop_spring(model, work, loop, on_frame);
  for (size_t i = 0; i < model.loads.size(); ++i) {
    const Load& load = model.loads[i];
    const int at = static_cast<int>(i);
    if (load.table) {
      const TreeJoint& j = model.parts[load.table_part].joint;
      work.expression_value[load.expression] =
          load.table->value(j.motion >= 0 ? work.motion[j.motion].value : work.q[model.parts[load.table_part].q0]);
    }
    if (load.function >= 0)
      work.expression_value[load.expression] = function_value(model.functions[load.function], work.signals, work.time);
    refresh_frames(model, work, load);
    power = 0.0;
    if (load.def.kind == ForceKind::distributed) {
      const double before = work.applied;
      on_length(at);
      power = work.applied - before;
    } else if (load.def.kind == ForceKind::force || load.def.kind == ForceKind::torque) {
      const auto F = frame_wrench(model, work, at, work.expression_value[load.expression]);
      on_frame(load.on, F);
      work.applied += F.dot(work.frames[load.on].V);
    } else if (load.def.kind == ForceKind::contact) {
      visit_contacts(model, work, at, on_frame);
    } else if (load.def.kind == ForceKind::drag) {
      Vec3 wind;
      const Vec3 force = drag_force(model, work, load, wind);
      on_frame(load.on, within(work, load.on, joined(force, Vec3::Zero())));
      work.applied += force.dot(wind);
    } else {
      visit_link(model, work, load, on_frame);
    }
    for (const ForceWork& done : model.works)
      if (std::find(done.loads.begin(), done.loads.end(), at) != done.loads.end()) work.signals.zdot[done.z0] += power;
  }
}

}  // namespace

template <class W>
void update_loads(const Model& model, W& work) {
  // They are zero from the beginning.
  if (!work.carrying.loaded) {
    work.applied = 0.0;
    return;
  }
  for (auto& p : work.parts) {
    p.load.setZero();
    if (p.load_e.size() > 0) p.load_e.setZero();
  }
  static thread_local VecX Fe;
  visit_loads(
      model, work, [&](int frame, const auto& F) { apply_wrench(model, work, frame, F); },
      [&](int load) {
        typename W::In::Twist F;
        distributed_load(model, work, load, F, Fe);
        auto& p = work.parts[model.frames[model.loads[load].on].part];
        p.load += F;
        p.load_e += Fe;
        work.applied += F.dot(p.V) + Fe.dot(p.qd);
      });
}

template <class W>
typename W::In::Twist unit_wrench(const Model& model, const W& work, int load) {
  return frame_wrench(model, work, load, 1.0);
}

std::vector<FrameWrench> frame_wrenches(const Model& model, Work& work) {
  std::vector<FrameWrench> out;
  visit_loads(
      model, work,
      [&](int frame, const Vec6& F) {
        out.push_back({frame, F});
      },
      [](int) {});
  return out;
}

Vec3 load_per_length(const Model& model, const Work& work, int part) {
  Vec3 out = Vec3::Zero();
  for (const Load& load : model.loads) {
    if (load.def.kind != ForceKind::distributed || model.frames[load.on].part != part) continue;
    const Vec3 d = load.def.direction * work.expression_value[load.expression];
    out += load.def.follower ? d : Vec3(work.parts[part].world.R.transpose() * d);
  }
  return out;
}

LoadState load_state(const Model& model, Work& work, const std::vector<int>& loads) {
  LoadState out;
  for (const int i : loads) {
    const Load& load = model.loads[i];
    refresh_frames(model, work, load);
    switch (load.def.kind) {
      case ForceKind::spring_damper: {
        const Line<Space> line = line_between(model, work, load);
        out.length = line.length;
        out.rate = line.rate;
        out.force = -spring_damper_force(model, work, load, line);
        out.power -= out.force * line.rate;
        break;
      }
      case ForceKind::bushing: {
        const Bushing b = bushing_state(model, work, load);
        out.wrench = bushing_force(load, b);
        out.turn = b.deflection.tail<3>();
        out.power += out.wrench.dot(b.rate);
        break;
      }
      case ForceKind::distributed: {
        out.force = work.expression_value[load.expression];
        Vec6 F;
        VecX Fe;
        distributed_load(model, work, i, F, Fe);
        const PartWork& p = work.parts[model.frames[load.on].part];
        out.power += F.dot(p.V) + Fe.dot(p.qd);
        break;
      }
      case ForceKind::drag: {
        Vec3 wind;
        const Vec3 force = drag_force(model, work, load, wind);
        out.force = force.norm();
        out.power += force.dot(Vec3(work.frames[load.on].V.head<3>()));
        break;
      }
      case ForceKind::contact:
        visit_contacts(model, work, i, [&](int frame, const Vec6& F) { out.power += F.dot(work.frames[frame].V); });
        for (size_t k = 0; k < model.contacts.size(); ++k)
          if (model.contacts[k].load == i) out.force += work.signals.contacts[k].force;
        break;
      case ForceKind::user:
        visit_user(model, work, load, [&](int frame, const Vec6& F) {
          out.force = F.head<3>().norm();
          out.power += F.dot(work.frames[frame].V);
        });
        break;
      default:
        out.force = work.expression_value[load.expression];
        out.power += frame_wrench(model, work, i, out.force).dot(work.frames[load.on].V);
    }
  }
  return out;
}

VecX tree_spring_force(const Part& part, const Work& work) {
  VecX out = VecX::Zero(part.joint.nv);
  joint_spring_forces(part.joint, work.q.data() + part.q0, work.w.data() + part.v0, out);
  return out;
}

double loop_spring_force(const Model& model, Work& work, int loop) {
  const LoopJoint& joint = model.loops[loop];
  for (const int f : {joint.a, joint.b}) {
    update_frame_position(model, f, work);
    update_frame_velocity(model, f, work);
  }
  const LoopSpring s = loop_spring(model, work, joint);
  return -(joint.spring->preload + joint.spring->stiffness * s.deflection + joint.spring->damping * s.rate);
}

void joint_forces(const Part& part, const JointWork& at, const VecX& all_q, const VecX& all_w, VecX& out) {
  const TreeJoint& j = part.joint;
  if (j.nv == 0) return;
  out.setZero();
  if (j.spring) joint_spring_forces(j, all_q.data() + part.q0, all_w.data() + part.v0, out);
  for (int k = 0; k < j.nv; ++k) {
    const double q = all_q[part.q0 + k], w = all_w[part.v0 + k];
    if (j.stop && k == 0) out[k] += stop_force(*j.stop, at.stop == StopPhase::live ? find_stop_phase(*j.stop, q, w) : at.stop, q, w);
    if (at.friction.size() > k) out[k] += at.friction[k];
  }
}

double spring_energy(const Model& model, const Work& work) {
  double e = 0.0;
  for (const Part& part : model.parts) {
    const TreeJoint& j = part.joint;
    if (j.spring && j.nv > 0) e += joint_spring_energy(j, work.q.data() + part.q0);
    for (int k = 0; k < j.nv; ++k) {
      const double q = work.q[part.q0 + k];
      if (j.stop && k == 0) {
        if (j.stop->lower && q < *j.stop->lower) e += 0.5 * j.stop->stiffness * (q - *j.stop->lower) * (q - *j.stop->lower);
        if (j.stop->upper && q > *j.stop->upper) e += 0.5 * j.stop->stiffness * (q - *j.stop->upper) * (q - *j.stop->upper);
      }
    }
  }
  for (const LoopJoint& loop : model.loops) {
    if (!loop.spring) continue;
    const double d = loop_spring(model, work, loop).deflection;
    e += 0.5 * loop.spring->stiffness * d * d + loop.spring->preload * d;
  }
  for (const Load& load : model.loads) {
    if (load.def.kind == ForceKind::spring_damper) {
      const double d = stretched(model, load, line_between(model, work, load).length, work.time);
      e += 0.5 * load.def.spring.stiffness * d * d + load.def.spring.preload * d;
    } else if (load.def.kind == ForceKind::bushing) {
      const Bushing b = bushing_state(model, work, load);
      e += 0.5 * b.deflection.dot(load.def.bushing_stiffness.cwiseProduct(b.deflection));
    }
  }
  return e + contact_energy(model, work);
}

namespace {

// Power that the joints' own dampers and stops take out, W, >= 0.
template <class W>
double joint_dissipated_power(const Model& model, const W& work) {
  double power = model.flexures.empty() ? 0.0 : flexure_power(model, work.w);
  for (const int i : work.carrying.resisting) {
    const Part& part = model.parts[i];
    const JointWork& at = work.joints[i];
    const TreeJoint& j = part.joint;
    for (int k = 0; k < j.nv; ++k) {
      const double q = work.q[part.q0 + k], w = work.w[part.v0 + k];
      if (j.spring) power += j.spring->damping * w * w;
      if (at.friction.size() > k) power -= at.friction[k] * w;
      if (j.stop && k == 0) {
        // What the stop takes out: its force's part that is not elastic.
        const StopPhase phase = at.stop == StopPhase::live ? find_stop_phase(*j.stop, q, w) : at.stop;
        power += (stop_elastic_force(*j.stop, phase, q) - stop_force(*j.stop, phase, q, w)) * w;
      }
    }
  }
  return power;
}

}  // namespace

template <class W>
double dissipated_power(const Model& model, const W& work) {
  double power = joint_dissipated_power(model, work);
  for (const int i : work.carrying.damped) {
    const FlexibleBody& body = model.parts[i].body;
    const auto& p = work.parts[i];
    if (body.De.size() == 0) continue;
    by_count(
        body.n, [&](auto n) __attribute__((always_inline)) {
          for (Eigen::Index k = 0; k < (n() > 0 ? n() : body.n); ++k)
            power += p.qd[k] * component_of<n()>(body.De, static_cast<int>(k)).dot(sized<n()>(p.qd));
        });
  }
  for (const LoopJoint& loop : model.loops)
    if (loop.spring) power += loop.spring->damping * std::pow(loop_spring(model, work, loop).rate, 2);
  for (const Load& load : model.loads) {
    if (load.def.kind == ForceKind::spring_damper) {
      if (load.def.spring.damping == 0.0) continue;
      const auto line = line_between(model, work, load);
      power += load.def.cable ? (extra_pull(load, work.expression_value) - elastic_pull(model, work, load, line)) * line.rate
                              : load.def.spring.damping * line.rate * line.rate;
    } else if (load.def.kind == ForceKind::drag) {
      Vec3 wind;
      const Vec3 force = drag_force(model, work, load, wind);
      power -= force.dot(Vec3(in_space(work, load.on, work.frames[load.on].V).template head<3>() - wind));
    } else if (load.def.kind == ForceKind::bushing) {
      const Bushing b = bushing_state(model, work, load);
      power += b.rate.dot(load.def.bushing_damping.cwiseProduct(b.rate));
    }
  }
  if (!model.contacts.empty()) power += contact_power(model, work.signals);
  return power;
}

#define FLEXFRAME_FOR(W)                                          \
  template void update_loads(const Model&, W&);                   \
  template W::In::Twist unit_wrench(const Model&, const W&, int); \
  template double dissipated_power(const Model&, const W&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

}  // namespace flexframe::sim
