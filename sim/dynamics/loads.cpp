#include "sim/dynamics/loads.h"

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/stops.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// Adds a wrench (frame axes) on a frame to its part's load.
void apply_wrench(const Model& model, Work& work, int frame, const Vec6& F) {
  const FramePoint& f = model.frames[frame];
  if (f.part == ground) return;
  PartWork& p = work.parts[f.part];
  const FrameWork& fw = work.frames[frame];
  p.load += wrench_to_parent(fw.pose, F);
  if (fw.flexible) p.load_e.noalias() += fw.B.transpose() * F;
}

// Line of a spring-damper from frame `from` to frame `on`: unit vector in world axes, length, rate of length.
struct Line {
  Vec3 direction;
  double length, rate;
};

Line line_between(const Model& model, const Work& work, const Load& load) {
  const Pose a = frame_world(model, work, load.from), b = frame_world(model, work, load.on);
  const Vec3 d = b.p - a.p;
  const double length = d.norm();
  // Two ends at one point have no direction: the spring of zero length pulls nowhere.
  const Vec3 u = length > 0.0 ? Vec3(d / length) : Vec3(Vec3::Zero());
  const Vec3 va = a.R * work.frames[load.from].V.head<3>(), vb = b.R * work.frames[load.on].V.head<3>();
  return {u, length, u.dot(vb - va)};
}

// Relative position (in the axes of `from`) and rotation vector of a bushing, and their rates.
struct Bushing {
  Vec6 deflection, rate;
  Pose relative;
};

Bushing bushing_state(const Model& model, const Work& work, const Load& load) {
  Bushing out;
  out.relative = compose(inverse(frame_world(model, work, load.from)), frame_world(model, work, load.on));
  const Vec6& Va = work.frames[load.from].V;
  const Vec6& Vb = work.frames[load.on].V;
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

double spring_damper_force(const Load& load, const Line& line) {
  const Spring& s = load.def.spring;
  return -s.preload - s.stiffness * (line.length - s.rest) - s.damping * line.rate;
}

void refresh_frames(const Model& model, Work& work, const Load& load) {
  for (int f : {load.on, load.from}) {
    update_frame_position(model, f, work);
    update_frame_velocity(model, f, work);
  }
}

// Wrench of a force or torque in the frame's axes.
Vec6 frame_wrench(const Model& model, const Work& work, const Load& load) {
  Vec6 F = Vec6::Zero();
  Vec3 d = load.def.direction * work.expression_value[load.expression];
  if (!load.def.follower) d = frame_world(model, work, load.on).R.transpose() * d;
  if (load.def.kind == ForceKind::torque) F.tail<3>() = d;
  else F.head<3>() = d;
  return F;
}

// Resultant about the body frame and generalised elastic forces of a uniform load per length: a uniform field of acceleration.
void distributed_load(const Model& model, const Work& work, const Load& load, Vec6& F, VecX& Fe) {
  const FramePoint& f = model.frames[load.on];
  const PartWork& p = work.parts[f.part];
  Vec3 d = load.def.direction * (work.expression_value[load.expression] * model.parts[f.part].load_factor);
  if (!load.def.follower) d = p.world.R.transpose() * d;
  F.head<3>() = model.parts[f.part].body.mass * d;
  F.tail<3>() = p.terms.md.cross(d);
  Fe = p.terms.Mre.topRows<3>().transpose() * d;
}

// Spring of a joint that closes a loop (JointTraits::read_off): deflection, its rate, and the relative pose. An angle counts by the
// shorter way round from the spring's rest.
struct LoopSpring {
  double deflection, rate;
  Pose relative;
};

LoopSpring loop_spring(const Model& model, const Work& work, const LoopJoint& loop) {
  LoopSpring out;
  out.relative = compose(inverse(frame_world(model, work, loop.a)), frame_world(model, work, loop.b));
  out.deflection = pose_coordinate(loop.kind, loop.axis, out.relative) - loop.spring->rest;
  if (!is_length(loop.kind, 0)) out.deflection = std::remainder(out.deflection, 2.0 * std::numbers::pi);
  out.rate = pose_rate(loop.kind, loop.axis, out.relative, work.frames[loop.a].V, work.frames[loop.b].V);
  return out;
}

// Calls on_frame(frame, wrench) for both ends of a loop joint's spring.
template <class OnFrame>
void visit_loop_spring(const Model& model, Work& work, const LoopJoint& loop, const OnFrame& on_frame) {
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
  on_frame(loop.b, on);
  on_frame(loop.a, back);
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

// Calls on_frame(frame, wrench) for what acts on a frame, on_length(load) for what acts along a beam, in the scene's order.
template <class OnFrame, class OnLength>
void visit_loads(const Model& model, Work& work, const OnFrame& on_frame, const OnLength& on_length) {
  for (const LoopJoint& loop : model.loops)
    if (loop.spring) visit_loop_spring(model, work, loop, on_frame);
  for (const Load& load : model.loads) {
    if (load.table) {
      const TreeJoint& j = model.parts[load.table_part].joint;
      work.expression_value[load.expression] =
          load.table->value(j.motion >= 0 ? work.motion[j.motion].value : work.q[model.parts[load.table_part].q0]);
    }
    refresh_frames(model, work, load);
    switch (load.def.kind) {
      case ForceKind::force:
      case ForceKind::torque:
        on_frame(load.on, frame_wrench(model, work, load));
        break;
      case ForceKind::distributed:
        on_length(load);
        break;
      case ForceKind::spring_damper: {
        const Line line = line_between(model, work, load);
        const Vec3 force = spring_damper_force(load, line) * line.direction;
        Vec6 F = Vec6::Zero();
        F.head<3>() = frame_world(model, work, load.on).R.transpose() * force;
        on_frame(load.on, F);
        F.head<3>() = -(frame_world(model, work, load.from).R.transpose() * force);
        on_frame(load.from, F);
        break;
      }
      case ForceKind::bushing: {
        const Bushing b = bushing_state(model, work, load);
        const Vec6 f = bushing_force(load, b);
        Vec6 on;
        on.head<3>() = b.relative.R.transpose() * f.head<3>();
        on.tail<3>() = b.relative.R.transpose() * f.tail<3>();
        on_frame(load.on, on);
        Vec6 back = -f;
        back.tail<3>() -= b.relative.p.cross(Vec3(f.head<3>()));
        on_frame(load.from, back);
        break;
      }
    }
  }
}

}  // namespace

void update_loads(const Model& model, Work& work) {
  for (PartWork& p : work.parts) {
    p.load.setZero();
    p.load_e.setZero();
  }
  VecX Fe;
  visit_loads(
      model, work, [&](int frame, const Vec6& F) { apply_wrench(model, work, frame, F); },
      [&](const Load& load) {
        Vec6 F;
        distributed_load(model, work, load, F, Fe);
        PartWork& p = work.parts[model.frames[load.on].part];
        p.load += F;
        p.load_e += Fe;
      });
}

std::vector<FrameWrench> frame_wrenches(const Model& model, Work& work) {
  std::vector<FrameWrench> out;
  visit_loads(
      model, work,
      [&](int frame, const Vec6& F) {
        out.push_back({frame, F});
      },
      [](const Load&) {});
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

void joint_forces(const Part& part, const PartWork& p, const Work& work, VecX& out) {
  const TreeJoint& j = part.joint;
  if (j.nv == 0) return;
  out.setZero();
  if (j.spring) joint_spring_forces(j, work.q.data() + part.q0, work.w.data() + part.v0, out);
  for (int k = 0; k < j.nv; ++k) {
    const double q = work.q[part.q0 + k], w = work.w[part.v0 + k];
    if (j.stop && k == 0) out[k] += stop_force(*j.stop, p.stop == StopPhase::live ? find_stop_phase(*j.stop, q, w) : p.stop, q, w);
    if (p.friction.size() > k) out[k] += p.friction[k];
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
      const double d = line_between(model, work, load).length - load.def.spring.rest;
      e += 0.5 * load.def.spring.stiffness * d * d + load.def.spring.preload * d;
    } else if (load.def.kind == ForceKind::bushing) {
      const Bushing b = bushing_state(model, work, load);
      e += 0.5 * b.deflection.dot(load.def.bushing_stiffness.cwiseProduct(b.deflection));
    }
  }
  return e;
}

double applied_power(const Model& model, const Work& work) {
  double power = 0.0;
  for (const Load& load : model.loads) {
    if (load.def.kind == ForceKind::force || load.def.kind == ForceKind::torque) {
      power += frame_wrench(model, work, load).dot(work.frames[load.on].V);
    } else if (load.def.kind == ForceKind::distributed) {
      Vec6 F;
      VecX Fe;
      distributed_load(model, work, load, F, Fe);
      const PartWork& p = work.parts[model.frames[load.on].part];
      power += F.dot(p.V) + Fe.dot(p.qd);
    }
  }
  return power;
}

double joint_dissipated_power(const Model& model, const Work& work) {
  double power = flexure_power(model, work);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    const PartWork& p = work.parts[i];
    const TreeJoint& j = part.joint;
    for (int k = 0; k < j.nv; ++k) {
      const double q = work.q[part.q0 + k], w = work.w[part.v0 + k];
      if (j.spring) power += j.spring->damping * w * w;
      if (p.friction.size() > k) power -= p.friction[k] * w;
      if (j.stop && k == 0) {
        // What the stop takes out: its force's part that is not elastic.
        const StopPhase phase = p.stop == StopPhase::live ? find_stop_phase(*j.stop, q, w) : p.stop;
        power += (stop_elastic_force(*j.stop, phase, q) - stop_force(*j.stop, phase, q, w)) * w;
      }
    }
  }
  return power;
}

double dissipated_power(const Model& model, const Work& work) {
  double power = joint_dissipated_power(model, work);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const FlexibleBody& body = model.parts[i].body;
    const PartWork& p = work.parts[i];
    if (body.De.size() > 0) power += p.qd.dot(body.De * p.qd);
  }
  for (const LoopJoint& loop : model.loops)
    if (loop.spring) power += loop.spring->damping * std::pow(loop_spring(model, work, loop).rate, 2);
  for (const Load& load : model.loads) {
    if (load.def.kind == ForceKind::spring_damper) {
      const Line line = line_between(model, work, load);
      power += load.def.spring.damping * line.rate * line.rate;
    } else if (load.def.kind == ForceKind::bushing) {
      const Bushing b = bushing_state(model, work, load);
      power += b.rate.dot(load.def.bushing_damping.cwiseProduct(b.rate));
    }
  }
  return power;
}

}  // namespace flexframe::sim
