#include "sim/dynamics/plane_work.h"

#include "sim/bodies/axis_mass.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/plane_frames.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// Why a model is left to the equations in space.
struct LeavesPlane {
  std::string why;
};

// Whether weight along the plane's normal n deforms the body, in first or second order.
bool bends_under_weight_along(const Vec3& n, const FlexibleBody& body) {
  if (body.n == 0) return false;
  constexpr double rounding = 1e-12;
  if ((n.transpose() * body.md1).cwiseAbs().maxCoeff() > rounding * body.md1.cwiseAbs().maxCoeff()) return true;
  MatX second = MatX::Zero(body.n, body.n);
  double largest = 0.0;
  for (int k = 0; k < 3; ++k) {
    if (body.md2[k].size() == 0) continue;
    second += n[k] * body.md2[k];
    largest = std::max(largest, body.md2[k].cwiseAbs().maxCoeff());
  }
  return second.cwiseAbs().maxCoeff() > rounding * largest;
}

// The plane's data of a model, step by step; throws LeavesPlane.
struct Builder {
  const Model& model;
  const Work& work;
  PlaneMotion& d;
  Vec3 normal = Vec3::Zero();  // of the plane, world axes
  bool weight_across = false;  // gravity has a part along the normal

  void build() {
    find_normal();
    for (const PartWork& p : work.parts) {
      d.part_axes.push_back(axes_about(p.world.R.transpose() * normal));
      d.part_heights.push_back(normal.dot(p.world.p));
    }
    for (size_t i = 0; i < model.frames.size(); ++i) add_frame(i);
    for (size_t i = 0; i < model.parts.size(); ++i) add_part(i);
    for (size_t k = 0; k < model.clusters.size(); ++k) add_cluster(static_cast<int>(k));
    for (const LoopJoint& loop : model.loops) add_loop(loop);
    for (const CouplingRow& coupling : model.couplings)
      if (!coupling.frames.empty()) throw LeavesPlane{fmt::format("the rope '{}' is computed in space", coupling.name)};
    for (const Load& load : model.loads) add_load(load);
    for (const Cluster& c : model.clusters) d.forces_within = d.forces_within && (c.loops.empty() || flat(c));
  }

  const Mat3& axes_of(int part) const { return part == ground ? d.axes : d.part_axes[part]; }
  const Mat3& frame_axes(int frame) const { return d.frame_constants[frame].axes; }

  // The axis of the first hinge.
  void find_normal() {
    for (const Part& p : model.parts)
      if (traits(p.joint.kind).in_plane == InPlane::axis_normal) {
        normal = frame_world(model, work, p.joint.reversed ? p.joint.outboard : p.joint.inboard).R * p.joint.axis;
        break;
      }
    if (normal.isZero(0.0)) throw LeavesPlane{"no hinge gives a plane"};
    d.axes = axes_about(normal);
    const Vec3 g = d.axes.transpose() * model.settings.gravity;
    d.gravity = g.head<2>();
    weight_across = std::abs(g.z()) > 1e-12 * g.norm();
    d.forces_within = !weight_across;
  }

  void add_frame(size_t i) {
    const FramePoint& f = model.frames[i];
    const FrameWork& fw = work.frames[i];
    const Mat3& Q = axes_of(f.part);
    PlaneFrame frame;
    FrameMotion<Plane> motion;
    motion.flexible = fw.flexible;
    frame.axes = axes_about(fw.pose.R.transpose() * Q.col(2));
    frame.height = normal.dot(frame_world(model, work, static_cast<int>(i)).p);
    if (!rotation_in_plane(Q.transpose() * fw.pose.R * frame.axes, motion.pose)) throw LeavesPlane{"a frame is turned out of the plane"};
    motion.pose.p = (Q.transpose() * fw.pose.p).head<2>();
    if (fw.flexible) take_node(f, Q, frame, motion);
    d.frame_constants.push_back(std::move(frame));
    d.frames.push_back(std::move(motion));
  }

  void take_node(const FramePoint& f, const Mat3& Q, PlaneFrame& frame, FrameMotion<Plane>& motion) const {
    const FlexibleNode& node = model.parts[f.part].body.nodes[f.node];
    const Mat3 Qn = axes_about(node.rotation.transpose() * Q.col(2));
    PlanePose at_node, offset;
    if (!rotation_in_plane(Q.transpose() * node.rotation * Qn, at_node) ||
        !rotation_in_plane(Qn.transpose() * f.offset.R * frame.axes, offset))
      throw LeavesPlane{"a node is turned out of the plane"};
    if (leaves_plane(node, Q)) throw LeavesPlane{fmt::format("'{}' deforms out of the plane", model.parts[f.part].name)};
    const auto& rod = model.parts[f.part].body.rod;
    frame.node = in_plane(node, Q, Qn, rod ? rod->towards : 1);
    frame.offset = (Qn.transpose() * f.offset.p).head<2>();
    frame.offset_angle = std::atan2(offset.s, offset.c);
    frame.arm = turn_back(offset, frame.offset);
    const Eigen::Index n = node.phi.cols();
    motion.phi2q = Eigen::MatrixX2d::Zero(n, 2);
    motion.scratch = VecX::Zero(n);
    motion.B = MatX3::Zero(n, 3);
    motion.B.col(2) = frame.node.psi;
  }

  void add_part(size_t i) {
    const Part& part = model.parts[i];
    const TreeJoint& j = part.joint;
    if (has_axis_mass(part.body)) throw LeavesPlane{fmt::format("'{}' has the complete kinetic energy of its axis", part.name)};
    if (weight_across && bends_under_weight_along(d.part_axes[i].col(2), part.body))
      throw LeavesPlane{fmt::format("its weight bends '{}' out of the plane", part.name)};
    PlaneJoint joint;
    const int A = j.reversed ? j.outboard : j.inboard, B = j.reversed ? j.inboard : j.outboard;
    if (!in_plane(j, frame_axes(A), frame_axes(B), joint)) throw LeavesPlane{fmt::format("joint '{}' leaves the plane", j.name)};
    d.tree.push_back(joint);
    d.bodies.push_back(in_plane(part.body, d.part_axes[i]));
    PartMotion<Plane> p;
    size_part(part, p);
    reserve(d.bodies.back(), p.terms);
    if (work.carrying.fixed[i] != Carrying::moving) set_fixed_twists(part, joint, d.frames[j.outboard].pose, p);
    d.parts.push_back(std::move(p));
  }

  void add_cluster(int k) {
    const Cluster& c = model.clusters[k];
    BaseMotion<Plane> base;
    base.Ib = base.U = MatX3::Zero(c.nv, 3);
    d.bases.push_back(std::move(base));
    d.loops.emplace_back();
    d.entries.emplace_back();
    for (int i : c.parts) {
      if (hangs_inside(model, i)) continue;
      const Pose& e = c.entry[d.entries.back().size()];
      const Mat3& Q = frame_axes(c.base);
      PlanePose out;
      if (!rotation_in_plane(Q.transpose() * e.R * frame_axes(model.parts[i].joint.inboard), out))
        throw LeavesPlane{"a frame is turned out of the plane"};
      out.p = (Q.transpose() * e.p).head<2>();
      d.entries.back().push_back(out);
    }
  }

  void add_loop(const LoopJoint& loop) {
    const double height = d.frame_constants[loop.b].height - d.frame_constants[loop.a].height;
    d.rows.emplace_back();
    for (const ClosureRow& r : loop.rows) {
      PlaneRow row;
      row.kind = r.kind;
      row.length = r.length;
      const Vec3 u = frame_axes(loop.a).transpose() * r.u, b = frame_axes(loop.b).transpose() * r.b;
      row.u = u.head<2>();
      row.b = b.head<2>();
      row.constant = r.kind == ClosureRow::translation ? u.z() * height : u.z() * b.z();
      row.height2 = height * height;
      d.rows.back().push_back(row);
    }
    if (loop.spring) d.forces_within = false;
  }

  // Whether a tensor (xx yy zz xy xz yz) has no products with the normal n.
  static bool no_products(const Vec6& J, const Vec3& n) {
    Mat3 T;
    T << J[0], J[3], J[4], J[3], J[1], J[5], J[4], J[5], J[2];
    const Vec3 a = T * n;
    return (a - n.dot(a) * n).norm() <= 1e-9 * T.norm();
  }

  // Whether masses, joints and loads of a cluster lie in one plane. Where they do not, moments about axes within the plane are shared out
  // over the joints of a loop as forces along the normal.
  bool flat(const Cluster& c) const {
    const double height = d.frame_constants[model.loops[c.loops.front()].a].height, little = 1e-9 * model.size;
    const auto apart = [&](int frame) { return std::abs(d.frame_constants[frame].height - height) > little; };
    for (int l : c.loops)
      if (apart(model.loops[l].a) || apart(model.loops[l].b)) return false;
    for (int i : c.parts) {
      const FlexibleBody& body = model.parts[i].body;
      const Vec3 n = d.part_axes[i].col(2);
      if (apart(model.parts[i].joint.inboard) || apart(model.parts[i].joint.outboard)) return false;
      if (std::abs(normal.dot(work.parts[i].world.p) - height) > little || std::abs(n.dot(body.md0)) > little * body.mass) return false;
      if (!no_products(body.J0, n)) return false;
      for (int k = 0; k < body.n; ++k)
        if (std::abs(n.dot(body.md1.col(k))) > 1e-9 * body.md1.col(k).norm() || !no_products(body.J1.col(k), n)) return false;
    }
    for (const Load& load : model.loads)
      for (int frame : {load.on, load.from})
        if (const int part = model.frames[frame].part;
            part != ground && std::count(c.parts.begin(), c.parts.end(), part) > 0 && apart(frame))
          return false;
    return true;
  }

  // What touches within the plane keeps to it.
  void require_flat(const Load& load) const {
    const ContactDef& c = *load.def.contact;
    const double height = d.frame_constants[load.on].height - d.frame_constants[load.from].height;
    const auto along = [&](int frame, const Vec3& u) { return std::abs((frame_axes(frame).transpose() * u).z()); };
    const bool tilted = c.from_radius > 0.0 ? std::abs(height) > 1e-12 * model.size : along(load.from, c.normal) > 1e-12;
    if (tilted || (c.cylinder && along(load.on, c.axis) < 1.0 - 1e-12)) throw LeavesPlane{"a contact pushes out of the plane"};
  }

  void add_load(const Load& load) {
    d.load_direction.push_back(Vec3::Zero());
    const ForceKind kind = load.def.kind;
    if (kind == ForceKind::user) throw LeavesPlane{"a user's force may point anywhere"};
    if (!load.path.empty()) throw LeavesPlane{"a cable over pulleys is computed in space"};
    if (load.def.contact && load.def.contact->curve) throw LeavesPlane{"a contact with a curve is computed in space"};
    if (kind == ForceKind::spring_damper || kind == ForceKind::bushing) {
      const double height = d.frame_constants[load.on].height - d.frame_constants[load.from].height;
      d.forces_within = d.forces_within && kind == ForceKind::spring_damper && std::abs(height) <= 1e-12 * model.size;
      return;
    }
    if (kind == ForceKind::drag || kind == ForceKind::contact) {
      d.forces_within = false;
      if (kind == ForceKind::contact) require_flat(load);
      return;
    }
    const int part = model.frames[load.on].part;
    const Mat3 Q = !load.def.follower ? d.axes : kind == ForceKind::distributed ? axes_of(part) : frame_axes(load.on);
    const Vec3 u = Q.transpose() * load.def.direction;
    d.load_direction.back() = kind == ForceKind::torque ? Vec3(0.0, 0.0, u.z()) : Vec3(u.x(), u.y(), 0.0);
    d.forces_within = d.forces_within && (kind == ForceKind::torque || std::abs(u.z()) <= 1e-12 * u.norm());
  }
};

// Of frames that leave the plane: they have no height in it.
constexpr double no_height = std::numeric_limits<double>::quiet_NaN();

}  // namespace

void grow_plane(const Model& model, const Work& work, PlaneMotion& plane) {
  Builder builder{model, work, plane};
  builder.normal = plane.axes.col(2);
  for (size_t i = plane.frames.size(); i < model.frames.size(); ++i) try {
      builder.add_frame(i);
    } catch (const LeavesPlane&) {
      PlaneFrame beside;
      beside.height = no_height;
      plane.frame_constants.push_back(std::move(beside));
      plane.frames.emplace_back();
    }
}

std::unique_ptr<PlaneMotion> make_plane(const Model& model, const Work& work, std::string& why_not) {
  auto out = std::make_unique<PlaneMotion>();
  try {
    Builder{model, work, *out}.build();
  } catch (const LeavesPlane& leaves) {
    why_not = leaves.why;
    return nullptr;
  }
  return out;
}

PlaneWork::PlaneWork(Work& work, PlaneMotion& m)
    : carrying(work.carrying),
      joints(work.joints),
      clusters(work.clusters),
      q(work.q),
      w(work.w),
      wdot(work.wdot),
      time(work.time),
      expression_value(work.expression_value),
      motion(work.motion),
      applied(work.applied),
      evaluations(work.evaluations),
      closure_iterations(work.closure_iterations),
      indefinite(work.indefinite),
      idle(work.idle),
      signals(work.signals),
      frames(m.frames),
      parts(m.parts),
      bases(m.bases),
      loops(m.loops),
      plane(m) {}

Pose pose_in_space(const Model& model, const Work& work, int frame) { return frame_world(model, work, frame); }

Pose pose_between(const Mat3& P, const PlanePose& at, double height, const Mat3& Q) {
  Mat3 turned;
  turned.col(0) = at.c * P.col(0) + at.s * P.col(1);
  turned.col(1) = at.c * P.col(1) - at.s * P.col(0);
  turned.col(2) = P.col(2);
  Pose out;
  out.R.noalias() = turned * Q.transpose();
  out.p = at.p.x() * P.col(0) + at.p.y() * P.col(1) + height * P.col(2);
  return out;
}

namespace {

void lift_frame(const Model& model, int f, const PlaneWork& from, Work& to) {
  if (!from.frames[f].flexible) return;
  const PlaneMotion& plane = from.plane;
  const PlaneFrame& at = plane.frame_constants[f];
  const int part = model.frames[f].part;
  to.frames[f].pose = pose_between(plane.part_axes[part], from.frames[f].pose, at.height - plane.part_heights[part], at.axes);
}

}  // namespace

Pose pose_in_space(const Model& model, const PlaneWork& work, int frame) {
  const PlaneFrame& f = work.plane.frame_constants[frame];
  return pose_between(work.plane.axes, frame_world(model, work, frame), f.height, f.axes);
}

void place_in_space(const Model& model, const PlaneWork& from, Work& to) {
  const PlaneMotion& plane = from.plane;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const PartMotion<Plane>& p = from.parts[i];
    const Mat3& Q = plane.part_axes[i];
    PartWork& out = to.parts[i];
    out.world = pose_between(plane.axes, p.world, plane.part_heights[i], Q);
    out.V = joined(Vec3(p.V.x() * Q.col(0) + p.V.y() * Q.col(1)), Vec3(p.V.z() * Q.col(2)));
    if (model.parts[i].body.n == 0) continue;
    out.q = p.q;
    out.qd = p.qd;
  }
  for (const Cluster& c : model.clusters) {
    lift_frame(model, c.base, from, to);
    for (const int f : c.frames) lift_frame(model, f, from, to);
  }
}

void place_frame(const Model& model, int frame, PlaneWork& from, Work& to) {
  const bool has = static_cast<size_t>(frame) < from.frames.size() && !std::isnan(from.plane.frame_constants[frame].height);
  if (!has) return update_frame_pose(model, frame, to);
  update_frame_pose(model, frame, from);
  lift_frame(model, frame, from, to);
}

Vec3 within(const PlaneWork& work, int frame, const Vec6& F) {
  const Mat3& Q = work.plane.frame_constants[frame].axes;
  return joined(Vec2(Q.leftCols<2>().transpose() * F.head<3>()), Q.col(2).dot(F.tail<3>()));
}

Vec6 in_space(const PlaneWork& work, int frame, const Vec3& V) {
  const Mat3& Q = work.plane.frame_constants[frame].axes;
  return joined(Q.leftCols<2>() * linear(V), Vec3(Q.col(2) * angular(V)));
}

}  // namespace flexframe::sim
