#include "sim/dynamics/kinematics.h"

#include "sim/base/sine_cosine.h"
#include "sim/base/sized.h"
#include "sim/base/wide.h"
#include "sim/bodies/rod_axis.h"
#include "sim/dynamics/chain.h"
#include "sim/dynamics/plane_frames.h"
#include "sim/dynamics/signals.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

template <class S>
void size_part(const Part& part, PartMotion<S>& p) {
  const int n = part.body.n, nv = part.joint.nv;
  p.q = p.qd = p.qdd = p.elastic = p.load_e = p.fe = VecX::Zero(n);
  p.Mee = MatX::Zero(n, n);
  p.Mre = p.Fe = p.C = p.scratch = zero_columns<S>(n);
  p.Hj = p.Fj = zero_columns<S>(nv);
  p.F = zero_columns<S>(nv + n);
  p.tau = VecX::Zero(nv);
}
template void size_part(const Part&, PartMotion<Space>&);
template void size_part(const Part&, PartMotion<Plane>&);

namespace {

// Whether the twists of a joint's frame per rate, in its axes, are the same wherever it stands: those of hinges, slides, balls.
bool has_constant_twists(const TreeJoint& joint) {
  if (joint.curve) return false;
  double q[7] = {};
  zero_coordinates(joint.kind, q);
  JointMotion at_zero, elsewhere;
  update_joint_position(joint, q, at_zero);
  // Neither zeros nor multiples of one another.
  double dw[6] = {0.3, 0.7, 0.2, 0.9, 0.4, 0.6};
  move_coordinates(joint.kind, q, dw);
  update_joint_position(joint, q, elsewhere);
  return at_zero.S == elsewhere.S;
}

Carrying find_carrying(const Model& model) {
  Carrying out;
  out.elastic.assign(model.parts.size(), 0);
  out.moves.assign(model.parts.size(), 0);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    const TreeJoint& joint = part.joint;
    const int at = static_cast<int>(i);
    out.moves[i] = joint.nv + part.body.n > 0 || (part.parent != ground && out.moves[part.parent]);
    if (part.parent != ground && model.parts[part.parent].body.n > 0) out.elastic[part.parent] = 1;
    out.inside.push_back(hangs_inside(model, at));
    if (part.body.n > 0) out.deforming.push_back(at);
    if (joint.motion >= 0) out.following.push_back(at);
    if (joint.nv > 0 && (joint.spring || joint.stop || joint.friction)) out.resisting.push_back(at);
    if (part.body.De.size() > 0) out.damped.push_back(at);
  }
  out.driven = !out.following.empty();
  out.loaded = !model.loads.empty() || !model.works.empty() || !model.signals.empty() || !model.functions.empty() ||
               !model.blocks.empty() || std::any_of(model.loops.begin(), model.loops.end(), [](const LoopJoint& l) { return l.spring; });
  for (const Cluster& c : model.clusters) {
    const Part& part = model.parts[c.parts.front()];
    out.link.push_back(c.parts.size() == 1 && !has_closure(c) && part.body.n == 0 && part.joint.nv == 1);
    out.follows.push_back(std::any_of(c.parts.begin(), c.parts.end(), [&](int i) { return model.parts[i].joint.motion >= 0; }));
  }
  return out;
}

}  // namespace

Work make_work(const Model& model) {
  Work work;
  work.carrying = find_carrying(model);
  work.frames.resize(model.frames.size());
  work.parts.resize(model.parts.size());
  work.joints.resize(model.parts.size());
  work.bases.resize(model.clusters.size());
  work.loops.resize(model.clusters.size());
  work.clusters.resize(model.clusters.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    reserve(part.body, p.terms);
    p.like = static_cast<int>(i);
    if (i > 0 && same_kinetics(model.parts[i - 1].body, part.body)) {
      p.like = work.parts[i - 1].like;
      p.terms.axis.scratch = work.parts[i - 1].terms.axis.scratch;
    }
    size_part(part, p);
  }
  for (size_t i = 0; i < model.frames.size(); ++i) {
    const FramePoint& f = model.frames[i];
    FrameWork& fw = work.frames[i];
    fw.pose = f.offset;
    if (f.part == ground || f.node < 0) continue;
    const FlexibleBody& body = model.parts[f.part].body;
    const FlexibleNode& node = body.nodes[f.node];
    fw.pose = compose({node.rotation, node.origin}, f.offset);
    bool moves = body.n > 0 && (node.phi.cwiseAbs().maxCoeff() > 0.0 || node.psi.cwiseAbs().maxCoeff() > 0.0);
    for (const MatX& h : node.phi2) moves = moves || (h.size() > 0 && h.cwiseAbs().maxCoeff() > 0.0);
    for (const MatX& h : node.psi2) moves = moves || (h.size() > 0 && h.cwiseAbs().maxCoeff() > 0.0);
    fw.flexible = moves;
    if (!moves) continue;
    fw.B = Mat6X::Zero(6, body.n);
    fw.rest_axes = f.offset.R.transpose() * node.rotation.transpose();
    for (const MatX& h : node.phi2)
      if (h.size() > 0 || node.along.size() > 0) fw.phi2q = Eigen::MatrixX3d::Zero(body.n, 3);
    for (const MatX& h : node.psi2)
      if (h.size() > 0) fw.psi2q = Eigen::MatrixX3d::Zero(body.n, 3);
    fw.scratch = VecX::Zero(body.n);
  }
  for (const Cluster& c : model.clusters) {
    work.carrying.bent.emplace_back();
    std::copy_if(c.frames.begin(), c.frames.end(), std::back_inserter(work.carrying.bent.back()),
                 [&](int frame) { return work.frames[frame].flexible; });
  }
  work.carrying.fixed.assign(model.parts.size(), Carrying::moving);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const TreeJoint& j = model.parts[i].joint;
    const FrameWork& outboard = work.frames[j.outboard];
    if (outboard.flexible || !has_constant_twists(j)) continue;
    const bool at_body = outboard.pose.R == Mat3::Identity() && outboard.pose.p.isZero(0.0);
    work.carrying.fixed[i] = at_body ? Carrying::at_body : Carrying::constant;
    set_fixed_twists(model.parts[i], j, outboard.pose, work.parts[i]);
  }
  for (size_t i = 0; i < model.clusters.size(); ++i) {
    const Cluster& c = model.clusters[i];
    ClusterWork& cw = work.clusters[i];
    cw.M = MatX::Zero(c.nv, c.nv);
    work.bases[i].Ib = Mat6X::Zero(6, c.nv);
    cw.r = VecX::Zero(c.nv);
    for (int k = 0; k < c.nv; ++k) cw.partition.ind.push_back(k);
  }
  work.q = VecX::Zero(model.nq);
  work.w = work.wdot = VecX::Zero(model.nv);
  for (const Part& part : model.parts)
    if (part.joint.nq > 0) zero_coordinates(part.joint.kind, work.q.data() + part.q0);
  work.expression_value.assign(model.expressions.size(), 0.0);
  work.motion.resize(model.expressions.size());
  reserve_signals(model, work);
  return work;
}

namespace {

// A node of a rod: its displacement beyond the linear one, along and across, and the derivative of that by q.
template <class W>
Eigen::Vector2d beyond_linear(const Model& model, int part, const VecX& weights, double* along, double* across, W& work) {
  auto& p = work.parts[part];
  update_rod_fields(*kinetic_body(model, work, part).rod, p.q, p.terms.rod.front());
  rod_jacobian(weights, p.terms.rod.front(), along, across);
  return rod_displacement(weights, p.terms.rod.front());
}
// Its acceleration at rest of the rates.
template <class W>
Eigen::Vector2d rod_bias(const Model& model, int part, const VecX& weights, W& work) {
  auto& p = work.parts[part];
  const RodAxis& rod = *kinetic_body(model, work, part).rod;
  update_rod_fields(rod, p.q, p.terms.rod.front());
  update_rod_rates(rod, p.qd, p.terms.rod.front());
  return rod_acceleration(weights, p.terms.rod.front());
}

// 1 + x T + y T^2 with T = skew(theta), T^2 = theta theta^T - |theta|^2.
FLEXFRAME_INLINE Mat3 by_powers(const Vec3& theta, double x, double y) {
  Mat3 out = (y * theta) * theta.transpose() + x * skew(theta);
  out.diagonal().array() += 1.0 - y * theta.squaredNorm();
  return out;
}

// Whether an undeformed frame has the axes of its body.
FLEXFRAME_INLINE bool has_body_axes(const FrameWork& fw) {
  const double* const R = fw.rest_axes.data();
  for (int k = 0; k < 9; ++k)
    if (R[k] != (k % 4 == 0 ? 1.0 : 0.0)) return false;
  return true;
}

// Node: r = origin + phi q + 1/2 q phi2 q,  R = exp(psi q + 1/2 q psi2 q) R0. N as in sized.h.
template <int N>
FLEXFRAME_INLINE void pose_frame(const FlexibleNode& node, const Pose& offset, const VecX& q, FrameWork& fw) {
  fw.theta = combine_sized<N>(node.psi, q);
  for (int a = 0; a < 3; ++a) {
    if (node.psi2[a].size() == 0) continue;
    multiply_sized<N>(node.psi2[a], q.data(), &fw.psi2q(0, a));
    fw.theta[a] += 0.5 * component_of<N>(fw.psi2q, a).dot(sized<N>(q));
  }
  fw.series = RotationSeries(fw.theta.squaredNorm());
  const Mat3 turned = by_powers(fw.theta, fw.series.s, fw.series.b);
  Vec3 at = node.origin + combine_sized<N>(node.phi, q);
  for (int a = 0; a < 3; ++a) {
    if (node.phi2[a].size() == 0) continue;
    multiply_sized<N>(node.phi2[a], q.data(), &fw.phi2q(0, a));
    at[a] += 0.5 * component_of<N>(fw.phi2q, a).dot(sized<N>(q));
  }
  // Most frames have the body's axes at rest, and stand at their node.
  if (has_body_axes(fw)) fw.pose.R = turned;
  else fw.pose.R.noalias() = (turned * node.rotation).eval() * offset.R;
  fw.pose.p = at;
  if (!offset.p.isZero(0.0)) fw.pose.p += turned * (node.rotation * offset.p);
}

template <int N>
FLEXFRAME_INLINE void fill_jacobian(const FlexibleNode& node, const Pose& offset, FrameWork& fw) {
  const Mat3 Rt = fw.pose.R.transpose();
  // right_jacobian of theta.
  Mat3 Jr = by_powers(fw.theta, -fw.series.b, fw.series.c);
  if (!has_body_axes(fw)) Jr = (fw.rest_axes * Jr).eval();
  const bool arm = !offset.p.isZero(0.0);
  const Mat3 A = arm ? Mat3(skew(Vec3(offset.R.transpose() * offset.p)) * Jr) : Mat3(Mat3::Zero());
  const bool second = fw.phi2q.size() > 0, turned_twice = fw.psi2q.size() > 0;
  const Eigen::Index n = N > 0 ? N : fw.B.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    Vec3 u = node.phi.col(k);
    if (second) u += fw.phi2q.row(k).transpose();
    Vec3 turn = node.psi.col(k);
    if (turned_twice) turn += fw.psi2q.row(k).transpose();
    Vec3 v;
    v.noalias() = Rt * u;
    if (arm) v.noalias() -= A * turn;
    fw.B.col(k).head<3>() = v;
    fw.B.col(k).tail<3>().noalias() = Jr * turn;
  }
}

// The same in the plane.
template <int N>
FLEXFRAME_INLINE void pose_frame(const PlaneFrame& f, const VecX& q, FrameMotion<Plane>& fm) {
  const PlaneNode& node = f.node;
  const auto x = sized<N>(q);
  const double turned = node.angle + sized<N>(node.psi).dot(x), angle = turned + f.offset_angle;
  Vec2 at = node.origin + Vec2(component_of<N>(node.phi, 0).dot(x), component_of<N>(node.phi, 1).dot(x));
  for (int a = 0; a < 2; ++a) {
    if (node.phi2[a].size() == 0) continue;
    multiply_sized<N>(node.phi2[a], q.data(), &fm.phi2q(0, a));
    at[a] += 0.5 * component_of<N>(fm.phi2q, a).dot(x);
  }
  fm.pose.p = at;
  sine_cosine(angle, fm.pose.s, fm.pose.c);
  if (f.offset.isZero(0.0)) return;
  PlanePose of_node;
  sine_cosine(turned, of_node.s, of_node.c);
  fm.pose.p += turn(of_node, f.offset);
}

template <int N>
FLEXFRAME_INLINE void fill_jacobian(const PlaneFrame& f, FrameMotion<Plane>& fm) {
  const PlaneNode& node = f.node;
  const double c = fm.pose.c, s = fm.pose.s, arm_x = f.arm.x(), arm_y = f.arm.y();
  const Eigen::Index n = N > 0 ? N : fm.B.rows();
  const bool second = node.phi2[0].size() + node.phi2[1].size() + node.along.size() > 0, arm = !f.arm.isZero(0.0);
  const double *const x = node.phi.data(), *const y = x + n, *const x2 = fm.phi2q.data(), *const y2 = x2 + n;
  const double* const psi = node.psi.data();
  double* __restrict const along = fm.B.data(), * __restrict const across = along + n;
  const auto fill = [&](const auto& displacement_x, const auto& displacement_y) {
    for (Eigen::Index k = 0; k < n; ++k) {
      const double u = displacement_x(k), v = displacement_y(k);
      along[k] = c * u + s * v;
      across[k] = c * v - s * u;
    }
  };
  if (second) fill([&](Eigen::Index k) { return x[k] + x2[k]; }, [&](Eigen::Index k) { return y[k] + y2[k]; });
  else fill([&](Eigen::Index k) { return x[k]; }, [&](Eigen::Index k) { return y[k]; });
  if (!arm) return;
  for (Eigen::Index k = 0; k < n; ++k) {
    along[k] -= arm_y * psi[k];
    across[k] += arm_x * psi[k];
  }
}

FLEXFRAME_INLINE void set_frame_pose(const Model& model, int frame, Work& work) {
  FrameWork& fw = work.frames[frame];
  const FramePoint& f = model.frames[frame];
  const FlexibleNode& node = kinetics(model, work, f.part).nodes[f.node];
  const VecX& q = work.parts[f.part].q;
  by_larger_count(
      q.size(), [&](auto n) __attribute__((always_inline)) { pose_frame<n()>(node, f.offset, q, fw); });
  if (node.along.size() == 0) return;
  const int across = kinetics(model, work, f.part).rod->towards;
  const Eigen::Vector2d beyond = beyond_linear(model, f.part, node.along, &fw.phi2q(0, 0), &fw.phi2q(0, across), work);
  fw.pose.p[0] += beyond[0];
  fw.pose.p[across] += beyond[1];
}

FLEXFRAME_INLINE void set_frame_jacobian(const Model& model, int frame, Work& work) {
  FrameWork& fw = work.frames[frame];
  const FramePoint& f = model.frames[frame];
  const FlexibleNode& node = kinetics(model, work, f.part).nodes[f.node];
  by_larger_count(
      fw.B.cols(), [&](auto n) __attribute__((always_inline)) { fill_jacobian<n()>(node, f.offset, fw); });
}

FLEXFRAME_INLINE void set_frame_pose(const Model& model, int frame, PlaneWork& work) {
  FrameMotion<Plane>& fm = work.frames[frame];
  const PlaneFrame& f = work.plane.frame_constants[frame];
  const VecX& q = work.parts[model.frames[frame].part].q;
  by_larger_count(
      q.size(), [&](auto n) __attribute__((always_inline)) { pose_frame<n()>(f, q, fm); });
  const PlaneNode& node = f.node;
  if (node.along.size() == 0) return;
  fm.pose.p += node.rod_axes * beyond_linear(model, model.frames[frame].part, node.along, fm.phi2q.data(), &fm.phi2q(0, 1), work);
  fm.phi2q = (fm.phi2q * node.rod_axes.transpose()).eval();
}

FLEXFRAME_INLINE void set_frame_jacobian(const Model&, int frame, PlaneWork& work) {
  FrameMotion<Plane>& fm = work.frames[frame];
  const PlaneFrame& f = work.plane.frame_constants[frame];
  by_larger_count(
      fm.B.rows(), [&](auto n) __attribute__((always_inline)) { fill_jacobian<n()>(f, fm); });
}
FLEXFRAME_WIDE void wide_frame_pose(const Model& model, int frame, Work& work) { set_frame_pose(model, frame, work); }
FLEXFRAME_WIDE void wide_frame_pose(const Model& model, int frame, PlaneWork& work) { set_frame_pose(model, frame, work); }
FLEXFRAME_WIDE void wide_frame_jacobian(const Model& model, int frame, Work& work) { set_frame_jacobian(model, frame, work); }
FLEXFRAME_WIDE void wide_frame_jacobian(const Model& model, int frame, PlaneWork& work) { set_frame_jacobian(model, frame, work); }

}  // namespace

void update_frame_pose(const Model& model, int frame, Work& work) {
  if (work.frames[frame].flexible) wide_frame_pose(model, frame, work);
}
void update_frame_pose(const Model& model, int frame, PlaneWork& work) {
  if (work.frames[frame].flexible) wide_frame_pose(model, frame, work);
}
void update_frame_jacobian(const Model& model, int frame, Work& work) {
  if (work.frames[frame].flexible) wide_frame_jacobian(model, frame, work);
}
void update_frame_jacobian(const Model& model, int frame, PlaneWork& work) {
  if (work.frames[frame].flexible) wide_frame_jacobian(model, frame, work);
}

template <class W>
void update_frame_position(const Model& model, int frame, W& work) {
  update_frame_pose(model, frame, work);
  update_frame_jacobian(model, frame, work);
}

namespace {

// What the displacement of second order adds to the acceleration of a frame's node (axes of the part), what its turning does (axes of the
// frame), and the frame's origin as seen from the node (axes of the frame).
template <int N, class Node, class S>
FLEXFRAME_INLINE typename S::Linear second_order(const Node& node, const VecX& qd, FrameMotion<S>& frame) {
  typename S::Linear out = S::Linear::Zero();
  for (int a = 0; a < S::linear; ++a)
    if (node.phi2[a].size() > 0) {
      multiply_sized<N>(node.phi2[a], qd.data(), frame.scratch.data());
      out[a] = sized<N>(frame.scratch).dot(sized<N>(qd));
    }
  return out;
}
const FlexibleNode& node_of(const Model& model, int frame, const Work& work) {
  const FramePoint& f = model.frames[frame];
  return kinetics(model, work, f.part).nodes[f.node];
}
const PlaneNode& node_of(const Model&, int frame, const PlaneWork& work) { return work.plane.frame_constants[frame].node; }
// The same of a rod's node.
Vec3 rod_second(const Model& model, int frame, Work& work) {
  const int part = model.frames[frame].part;
  const Eigen::Vector2d bias = rod_bias(model, part, node_of(model, frame, work).along, work);
  Vec3 out = Vec3::Zero();
  out[0] = bias[0];
  out[kinetics(model, work, part).rod->towards] = bias[1];
  return out;
}
Vec2 rod_second(const Model& model, int frame, PlaneWork& work) {
  const PlaneNode& node = node_of(model, frame, work);
  return node.rod_axes * rod_bias(model, model.frames[frame].part, node.along, work);
}
Vec3 turning_rate(const Model& model, int frame, Work& work) {
  FrameWork& fw = work.frames[frame];
  const VecX& qd = work.parts[model.frames[frame].part].qd;
  const FlexibleNode& node = node_of(model, frame, work);
  Vec3 turning = combine(node.psi, qd), more = Vec3::Zero();
  for (int a = 0; a < 3; ++a) {
    if (node.psi2[a].size() == 0) continue;
    turning[a] += fw.psi2q.col(a).dot(qd);
    multiply_sized<0>(node.psi2[a], qd.data(), fw.scratch.data());
    more[a] = fw.scratch.dot(qd);
  }
  Vec3 rate = right_jacobian_rate(fw.theta, turning, fw.series);
  if (fw.psi2q.size() > 0) rate += by_powers(fw.theta, -fw.series.b, fw.series.c) * more;
  return has_body_axes(fw) ? rate : Vec3(fw.rest_axes * rate);
}
double turning_rate(const Model&, int, const PlaneWork&) { return 0.0; }
Vec3 frame_arm(const Model& model, int frame, const Work&) {
  const Pose& offset = model.frames[frame].offset;
  return offset.R.transpose() * offset.p;
}
Vec2 frame_arm(const Model&, int frame, const PlaneWork& work) { return work.plane.frame_constants[frame].arm; }

}  // namespace

namespace {

// V and bias of a flexible frame from its part's twist and its own rates, W.
template <class W>
FLEXFRAME_INLINE void finish_frame_velocity(const Model& model, int frame, W& work) {
  using S = typename W::In;
  FrameMotion<S>& fw = work.frames[frame];
  fw.V = to_child(fw.pose, work.parts[model.frames[frame].part].V) + fw.W;
  // dB/dt qd: the displacement's second-order part and the rotation's, and the turning of the frame's axes.
  typename S::Linear second;
  const VecX& qd = work.parts[model.frames[frame].part].qd;
  by_larger_count(
      qd.size(), [&](auto n) __attribute__((always_inline)) { second = second_order<n()>(node_of(model, frame, work), qd, fw); });
  if (node_of(model, frame, work).along.size() > 0) second += rod_second(model, frame, work);
  const typename S::Linear arm = frame_arm(model, frame, work);
  const typename S::Angular alpha = turning_rate(model, frame, work), omega = angular(fw.W);
  // Linear part of B qd = R^T (node velocity) + omega x arm.
  const typename S::Linear node_rate = linear(fw.W) - cross(omega, arm);
  fw.bias = joined(turn_back(fw.pose, second) - cross(omega, node_rate) + cross(alpha, arm), alpha) - bracket(fw.W, fw.V);
}

template <class W>
FLEXFRAME_INLINE void set_frame_velocity(const Model& model, int frame, W& work) {
  auto& fw = work.frames[frame];
  const int part = model.frames[frame].part;
  if (part == ground) {
    fw.V.setZero();
    fw.bias.setZero();
  } else if (!fw.flexible) {
    fw.V = to_child(fw.pose, work.parts[part].V);
    fw.bias.setZero();
  } else {
    fw.W = combine_few(fw.B, work.parts[part].qd);
    finish_frame_velocity(model, frame, work);
  }
}
FLEXFRAME_WIDE void wide_frame_velocity(const Model& model, int frame, Work& work) { set_frame_velocity(model, frame, work); }
FLEXFRAME_WIDE void wide_frame_velocity(const Model& model, int frame, PlaneWork& work) { set_frame_velocity(model, frame, work); }

}  // namespace

template <class W>
void update_frame_velocity(const Model& model, int frame, W& work) {
  wide_frame_velocity(model, frame, work);
}

template <class W>
void update_cluster_frames(const Model& model, int cluster, W& work) {
  bend_frames(model, cluster, work);
}

namespace {

FLEXFRAME_WIDE void wide_place_chain(const Model& model, int cluster, size_t first, Work& work) {
  place_chain(model, cluster, first, work);
}
FLEXFRAME_WIDE void wide_place_chain(const Model& model, int cluster, size_t first, PlaneWork& work) {
  place_chain(model, cluster, first, work);
}

}  // namespace

template <class W>
void update_cluster_chain(const Model& model, int cluster, W& work) {
  wide_place_chain(model, cluster, 0, work);
}

template <class W>
void update_chain_from(const Model& model, int cluster, size_t first, W& work) {
  wide_place_chain(model, cluster, first, work);
}

namespace {

// The frame that carries a part: that of its joint or, where it hangs outside its cluster, the cluster's base frame; and the part's body
// frame as that sees it.
template <class W>
int carrying_frame(const Model& model, const W&, int part) {
  return hangs_inside(model, part) ? model.parts[part].joint.inboard : model.clusters[model.parts[part].cluster].base;
}
template <class W>
const typename W::In::Pose& from_carrying_frame(const Model& model, const W& work, int part) {
  return hangs_inside(model, part) ? work.parts[part].step : work.parts[part].in_base;
}

// The part's pose in what carries it (place_chain has it within the cluster), and its twists per rate.
template <class W>
FLEXFRAME_INLINE void seat_part(const Model& model, int i, W& work) {
  using Twist = typename W::In::Twist;
  const Part& part = model.parts[i];
  auto& p = work.parts[i];
  if (!work.carrying.inside[static_cast<size_t>(i)]) p.in_carrier = compose(work.frames[carrying_frame(model, work, i)].pose, p.in_base);
  const auto& o = work.frames[part.joint.outboard];
  if (work.carrying.fixed[static_cast<size_t>(i)] == Carrying::moving) {
    for (int k = 0; k < part.joint.nv; ++k) column(p.Hj, k) = to_parent(o.pose, Twist(p.joint.S.col(k)));
    if (part.joint.motion >= 0) p.driven = to_parent(o.pose, Twist(p.joint.S.col(0)));
  }
  if (o.flexible) set_negative_to_parent(o.pose, o.B, p.C);
}

template <class W>
FLEXFRAME_INLINE void place_in_world(const Model& model, int cluster, W& work) {
  const Cluster& c = model.clusters[cluster];
  if (c.parent != ground && work.frames[c.base].flexible) update_frame_position(model, c.base, work);
  for (int i : c.parts) {
    auto& p = work.parts[i];
    seat_part(model, i, work);
    p.world = model.parts[i].parent == ground ? p.in_carrier : compose(work.parts[model.parts[i].parent].world, p.in_carrier);
  }
}
FLEXFRAME_WIDE void wide_place_in_world(const Model& model, int cluster, Work& work) { place_in_world(model, cluster, work); }
FLEXFRAME_WIDE void wide_place_in_world(const Model& model, int cluster, PlaneWork& work) { place_in_world(model, cluster, work); }

}  // namespace

template <class W>
void update_cluster_world(const Model& model, int cluster, W& work) {
  wide_place_in_world(model, cluster, work);
}

template <class W>
void update_cluster_positions(const Model& model, int cluster, W& work) {
  update_cluster_frames(model, cluster, work);
  for (int f : model.clusters[cluster].frames) update_frame_jacobian(model, f, work);
  update_cluster_chain(model, cluster, work);
  for (int i : model.clusters[cluster].parts) seat_part(model, i, work);
}

namespace {

template <class W>
FLEXFRAME_INLINE void move_parts(const Model& model, int cluster, W& work) {
  using Twist = typename W::In::Twist;
  const Cluster& c = model.clusters[cluster];
  if (c.parent != ground && (has_closure(c) || work.frames[c.base].flexible)) {
    update_frame_velocity(model, c.base, work);
    work.bases[cluster].V = work.frames[c.base].V;
  }
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    auto& p = work.parts[i];
    if (part.body.n > 0) copy_few(work.w.data() + part.ev0, part.body.n, p.qd.data());
    const TreeJoint& j = part.joint;
    const auto& joint = tree_joint(model, work, i);
    // Twist across the joint, in the axes of the body.
    Twist across = Twist::Zero();
    const bool fixed = work.carrying.fixed[static_cast<size_t>(i)] != Carrying::moving;
    if (j.motion >= 0) {
      const TimeJet& m = work.motion[j.motion];
      if (!fixed) {
        update_joint_velocity(joint, &m.value, &m.rate, p.joint);
        p.joint.bias += p.joint.S.col(0) * m.acceleration;
      }
      across = p.driven * m.rate;
    } else {
      if (!fixed) update_joint_velocity(joint, work.q.data() + part.q0, work.w.data() + part.v0, p.joint);
      for (int k = 0; k < j.nv; ++k) across += column(p.Hj, k) * work.w[part.v0 + k];
    }
    p.V = across;
    const bool inside = work.carrying.inside[static_cast<size_t>(i)];
    const int at = inside ? j.inboard : c.base;
    const auto& in = work.frames[at];
    if (part.parent != ground) {
      p.V += to_child(p.in_carrier, work.parts[part.parent].V);
      if (in.flexible) {
        if (inside) update_frame_velocity(model, at, work);
        p.V += to_child(from_carrying_frame(model, work, i), in.W);
      }
    }
    // Accelerations at zero coordinate accelerations: what the joint and the outboard frame make, and what the carrier's passes on.
    auto& out = work.frames[j.outboard];
    if (out.flexible) {
      out.W = combine_few(out.B, p.qd);
      p.V -= to_parent(out.pose, out.W);
      finish_frame_velocity(model, j.outboard, work);
      p.own = to_parent(out.pose, Twist(p.joint.bias - bracket(p.joint.W, out.V) - out.bias));
    } else if (fixed) {
      p.own = -bracket(across, p.V);
      if (j.motion >= 0) p.own += p.driven * work.motion[j.motion].acceleration;
    } else {
      p.own = to_parent(out.pose, p.joint.bias) - bracket(across, p.V);
    }
    p.A0 = p.own;
    if (!inside) continue;
    p.A0 += to_child(p.in_carrier, work.parts[part.parent].A0);
    if (in.flexible) p.A0 += to_child(p.step, in.bias);
  }
}
FLEXFRAME_WIDE void wide_move_parts(const Model& model, int cluster, Work& work) { move_parts(model, cluster, work); }
FLEXFRAME_WIDE void wide_move_parts(const Model& model, int cluster, PlaneWork& work) { move_parts(model, cluster, work); }

}  // namespace

template <class W>
void update_cluster_velocities(const Model& model, int cluster, W& work) {
  wide_move_parts(model, cluster, work);
}

template <class W>
void update_base_acceleration(const Model& model, int cluster, W& work) {
  const Cluster& c = model.clusters[cluster];
  if (c.parent == ground) return;
  auto& base = work.bases[cluster];
  const auto& f = work.frames[c.base];
  const auto& carrier = work.parts[c.parent];
  base.A = to_child(f.pose, carrier.A);
  if (!f.flexible) return;
  base.A += f.bias;
  add_product(f.B, carrier.qdd, base.A);
}

template <class W>
typename W::In::Twist carried_acceleration(const Model& model, const W& work, int part) {
  using S = typename W::In;
  const auto& p = work.parts[part];
  const int parent = model.parts[part].parent;
  if (parent == ground) {
    typename S::Twist g = S::Twist::Zero();
    g.template head<S::linear>() = -turn_back(p.world, gravity(model, work));
    return g;
  }
  const auto& carrier = work.parts[parent];
  typename S::Twist A = to_child(p.in_carrier, carrier.A);
  const auto& in = work.frames[carrying_frame(model, work, part)];
  if (!in.flexible) return A;
  typename S::Twist of_frame = in.bias;
  add_product(in.B, carrier.qdd, of_frame);
  return A + to_child(from_carrying_frame(model, work, part), of_frame);
}

namespace {

template <class W>
FLEXFRAME_INLINE void accelerate_parts(const Model& model, int cluster, W& work) {
  for (int i : model.clusters[cluster].parts) {
    const Part& part = model.parts[i];
    auto& p = work.parts[i];
    if (part.body.n > 0) copy_few(work.wdot.data() + part.ev0, part.body.n, p.qdd.data());
    p.A = carried_acceleration(model, work, i) + p.own;
    for (int k = 0; k < part.joint.nv; ++k) p.A += column(p.Hj, k) * work.wdot[part.v0 + k];
    if (work.frames[part.joint.outboard].flexible) p.A += combine_few(p.C, p.qdd);
  }
}
FLEXFRAME_WIDE void wide_accelerate_parts(const Model& model, int cluster, Work& work) { accelerate_parts(model, cluster, work); }
FLEXFRAME_WIDE void wide_accelerate_parts(const Model& model, int cluster, PlaneWork& work) { accelerate_parts(model, cluster, work); }

}  // namespace

template <class W>
void update_cluster_accelerations(const Model& model, int cluster, W& work) {
  wide_accelerate_parts(model, cluster, work);
}

template <class W>
typename W::In::Pose frame_world(const Model& model, const W& work, int frame) {
  const FramePoint& f = model.frames[frame];
  const auto& local = work.frames[frame].pose;
  return f.part == ground ? local : compose(work.parts[f.part].world, local);
}

Pose shown_pose(const Model& model, int part, Work& work) {
  const ShownFrame& shown = model.parts[part].shown;
  if (!shown.differs) return {};
  update_frame_pose(model, shown.root, work);
  if (shown.boundary != Boundary::clamped_free) update_frame_pose(model, shown.tip, work);
  return shown_pose_at(model, part, work);
}

Pose shown_pose_at(const Model& model, int part, const Work& work) {
  const ShownFrame& shown = model.parts[part].shown;
  Pose out;
  if (!shown.differs) return out;
  const Pose& root = work.frames[shown.root].pose;
  if (shown.boundary == Boundary::clamped_free) return root;
  const Vec3 chord = work.frames[shown.tip].pose.p - root.p;
  out.p = root.p;
  if (shown.boundary == Boundary::supported_supported) {
    // x along the chord, turned about it as the root section is.
    const Vec3 x = chord.normalized();
    const Vec3 y = (root.R.col(1) - x.dot(root.R.col(1)) * x).normalized();
    out.R << x, y, x.cross(y);
  } else {
    // supported-free: the root stays on the axis and int x v dm = 0; from mean axes of a uniform beam that is a turn by
    // -3/2 v_root / L about z (and 3/2 w_root / L about y). The twist is the root's.
    const double length = chord.norm();
    out.R = rotation_exp(Vec3(rotation_log(root.R).x(), 1.5 * root.p.z() / length, -1.5 * root.p.y() / length));
  }
  return out;
}

template <class W>
void project_wrench(const Model& model, const W& work, int cluster, const std::type_identity_t<WrenchAt<W>>& load, bool elastic,
                    VecX& out) {
  using Twist = typename W::In::Twist;
  const Cluster& c = model.clusters[cluster];
  int at = load.frame;
  Twist force = load.F;
  for (int i = model.frames[at].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent) {
    const Part& part = model.parts[i];
    const auto& p = work.parts[i];
    const auto& f = work.frames[at];
    const auto& o = work.frames[part.joint.outboard];
    const Twist on_joint = wrench_to_child(o.pose, wrench_to_parent(f.pose, force));
    for (int k = 0; k < part.joint.nv; ++k) out[part.v0 - c.v0 + k] += p.joint.S.col(k).dot(on_joint);
    if (elastic) {
      double* const e = out.data() + (part.ev0 - c.v0);
      if (f.flexible) add_dots(f.B, force, e);
      if (o.flexible) subtract_dots(o.B, on_joint, e);
    }
    force = wrench_to_parent(p.joint.pose, on_joint);
    at = part.joint.inboard;
  }
}

#define FLEXFRAME_FOR(W)                                                            \
  template void update_frame_position(const Model&, int, W&);                       \
  template void update_frame_velocity(const Model&, int, W&);                       \
  template void update_cluster_frames(const Model&, int, W&);                       \
  template void update_cluster_chain(const Model&, int, W&);                        \
  template void update_chain_from(const Model&, int, size_t, W&);                   \
  template void update_cluster_positions(const Model&, int, W&);                    \
  template void update_cluster_world(const Model&, int, W&);                        \
  template void update_cluster_velocities(const Model&, int, W&);                   \
  template void update_base_acceleration(const Model&, int, W&);                    \
  template void update_cluster_accelerations(const Model&, int, W&);                \
  template typename W::In::Twist carried_acceleration(const Model&, const W&, int); \
  template typename W::In::Pose frame_world(const Model&, const W&, int);           \
  template void project_wrench(const Model&, const W&, int, const WrenchAt<W>&, bool, VecX&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

}  // namespace flexframe::sim
