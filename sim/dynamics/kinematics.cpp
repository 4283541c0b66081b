#include "sim/dynamics/kinematics.h"

#include "sim/base/small_matrices.h"

namespace flexframe::sim {
namespace {

// A x for few rows, column by column: a general product's set-up costs more than the work here.
template <int Rows>
Eigen::Matrix<double, Rows, 1> times(const Eigen::Matrix<double, Rows, Eigen::Dynamic>& A, const VecX& x) {
  double sum[Rows] = {};
  const double* a = A.data();
  for (Eigen::Index k = 0; k < x.size(); ++k, a += Rows) {
    const double factor = x[k];
    for (int r = 0; r < Rows; ++r) sum[r] += a[r] * factor;
  }
  return Eigen::Map<const Eigen::Matrix<double, Rows, 1>>(sum);
}

}  // namespace

Work make_work(const Model& model) {
  Work work;
  work.frames.resize(model.frames.size());
  work.parts.resize(model.parts.size());
  work.clusters.resize(model.clusters.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const int n = part.body.n, nv = part.joint.nv;
    p.terms.reserve(part.body);
    p.like = static_cast<int>(i);
    if (i > 0 && same_kinetics(model.parts[i - 1].body, part.body)) {
      p.like = work.parts[i - 1].like;
      p.terms.axis.scratch = work.parts[i - 1].terms.axis.scratch;
    }
    p.q = p.qd = p.qdd = p.elastic = p.load_e = p.fe = VecX::Zero(n);
    p.Mre = Mat6X::Zero(6, n);
    p.Mee = MatX::Zero(n, n);
    p.Fe = Mat6X::Zero(6, n);
    p.Hj = p.Fj = Mat6X::Zero(6, nv);
    p.F = Mat6X::Zero(6, nv + n);
    p.scratch = Mat6X::Zero(6, n);
    p.tau = VecX::Zero(nv);
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
    fw.flexible = moves;
    if (!moves) continue;
    fw.B = Mat6X::Zero(6, body.n);
    fw.rest_axes = f.offset.R.transpose() * node.rotation.transpose();
    for (const MatX& h : node.phi2)
      if (h.size() > 0) fw.phi2q = Eigen::MatrixX3d::Zero(body.n, 3);
    fw.scratch = VecX::Zero(body.n);
  }
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (work.frames[model.parts[i].joint.outboard].flexible) work.parts[i].C = Mat6X::Zero(6, model.parts[i].body.n);
  for (size_t i = 0; i < model.clusters.size(); ++i) {
    const Cluster& c = model.clusters[i];
    ClusterWork& cw = work.clusters[i];
    cw.M = MatX::Zero(c.nv, c.nv);
    cw.Ib = Mat6X::Zero(6, c.nv);
    cw.r = cw.wdot = VecX::Zero(c.nv);
    for (int k = 0; k < c.nv; ++k) cw.partition.ind.push_back(k);
  }
  work.q = VecX::Zero(model.nq);
  work.w = work.wdot = VecX::Zero(model.nv);
  for (const Part& part : model.parts)
    if (part.joint.nq > 0) zero_coordinates(part.joint.kind, work.q.data() + part.q0);
  work.expression_value.assign(model.expressions.size(), 0.0);
  work.motion.resize(model.expressions.size());
  return work;
}

void update_frame_pose(const Model& model, int frame, Work& work) {
  FrameWork& fw = work.frames[frame];
  if (!fw.flexible) return;
  const FramePoint& f = model.frames[frame];
  const FlexibleNode& node = kinetics(model, work, f.part).nodes[f.node];
  const VecX& q = work.parts[f.part].q;

  // Node: r = origin + phi q + 1/2 q phi2 q,  R = exp(psi q) R0.
  fw.theta = times(node.psi, q);
  fw.series = RotationSeries(fw.theta.squaredNorm());
  // 1 + s T + b T^2 with T = skew(theta), T^2 = theta theta^T - |theta|^2.
  Mat3 turn = (fw.series.b * fw.theta) * fw.theta.transpose() + fw.series.s * skew(fw.theta);
  turn.diagonal().array() += 1.0 - fw.series.b * fw.theta.squaredNorm();
  Mat3 R;
  R.noalias() = turn * node.rotation;
  Vec3 at = node.origin + times(node.phi, q);
  for (int a = 0; a < 3; ++a) {
    if (node.phi2[a].size() == 0) continue;
    multiply(node.phi2[a], q.data(), &fw.phi2q(0, a));
    at[a] += 0.5 * fw.phi2q.col(a).dot(q);
  }
  fw.pose.R.noalias() = R * f.offset.R;
  fw.pose.p = at + R * f.offset.p;
}

void update_frame_jacobian(const Model& model, int frame, Work& work) {
  FrameWork& fw = work.frames[frame];
  if (!fw.flexible) return;
  const FramePoint& f = model.frames[frame];
  const FlexibleNode& node = kinetics(model, work, f.part).nodes[f.node];
  const Mat3 Rt = fw.pose.R.transpose();
  const Mat3 Jr = fw.rest_axes * right_jacobian(fw.theta, fw.series);
  const bool arm = !f.offset.p.isZero(0.0);
  const Mat3 A = arm ? Mat3(skew(Vec3(f.offset.R.transpose() * f.offset.p)) * Jr) : Mat3(Mat3::Zero());
  const bool second = fw.phi2q.size() > 0;
  for (Eigen::Index k = 0; k < fw.B.cols(); ++k) {
    Vec3 u = node.phi.col(k);
    if (second) u += fw.phi2q.row(k).transpose();
    const Vec3 turn = node.psi.col(k);
    Vec3 v;
    v.noalias() = Rt * u;
    if (arm) v.noalias() -= A * turn;
    fw.B.col(k).head<3>() = v;
    fw.B.col(k).tail<3>().noalias() = Jr * turn;
  }
}

void update_frame_position(const Model& model, int frame, Work& work) {
  update_frame_pose(model, frame, work);
  update_frame_jacobian(model, frame, work);
}

void update_frame_velocity(const Model& model, int frame, Work& work) {
  FrameWork& fw = work.frames[frame];
  const FramePoint& f = model.frames[frame];
  if (f.part == ground) {
    fw.V.setZero();
    fw.bias.setZero();
    return;
  }
  const PartWork& part = work.parts[f.part];
  fw.V = to_child(fw.pose, part.V);
  if (!fw.flexible) {
    fw.bias.setZero();
    return;
  }
  fw.W = times(fw.B, part.qd);
  fw.V += fw.W;

  // dB/dt qd: the displacement's second-order part and the rotation's, and the turning of the frame's axes.
  const FlexibleNode& node = kinetics(model, work, f.part).nodes[f.node];
  Vec3 second = Vec3::Zero();
  for (int a = 0; a < 3; ++a)
    if (node.phi2[a].size() > 0) {
      fw.scratch.noalias() = node.phi2[a] * part.qd;
      second[a] = part.qd.dot(fw.scratch);
    }
  const Vec3 alpha = fw.rest_axes * right_jacobian_rate(fw.theta, times(node.psi, part.qd), fw.series);
  const Vec3 arm = f.offset.R.transpose() * f.offset.p;
  const Vec3 omega = fw.W.tail<3>();
  // Linear part of B qd = R^T (node velocity) + omega x arm.
  const Vec3 node_rate = fw.W.head<3>() - omega.cross(arm);
  Vec6 bdot;
  bdot.head<3>() = fw.pose.R.transpose() * second - omega.cross(node_rate) + alpha.cross(arm);
  bdot.tail<3>() = alpha;
  fw.bias = bdot - bracket(fw.W, fw.V);
}

void update_cluster_frames(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    if (part.body.n > 0) work.parts[i].q = work.q.segment(part.eq0, part.body.n);
  }
  for (int f : c.frames) update_frame_pose(model, f, work);
}

void update_cluster_chain(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  size_t entry = 0;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const TreeJoint& j = part.joint;
    if (j.motion >= 0) update_joint_position(j, &work.motion[j.motion].value, p.joint);
    else update_joint_position(j, work.q.data() + part.q0, p.joint);
    p.step = compose(p.joint.pose, inverse(work.frames[j.outboard].pose));
    const bool inside = part.parent != ground && model.parts[part.parent].cluster == cluster;
    if (inside) p.in_base = compose(compose(work.parts[part.parent].in_base, work.frames[j.inboard].pose), p.step);
    else p.in_base = compose(c.entry[entry++], p.step);
  }
}

void update_cluster_positions(const Model& model, int cluster, Work& work) {
  update_cluster_frames(model, cluster, work);
  for (int f : model.clusters[cluster].frames) update_frame_jacobian(model, f, work);
  update_cluster_chain(model, cluster, work);
}

void update_cluster_world(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  if (c.parent != ground) update_frame_position(model, c.base, work);
  cw.base_world = frame_world(model, work, c.base);
  for (int i : c.parts) work.parts[i].world = compose(cw.base_world, work.parts[i].in_base);
}

void update_cluster_velocities(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  update_frame_velocity(model, c.base, work);
  cw.base_V = work.frames[c.base].V;
  size_t entry = 0;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    if (part.body.n > 0) p.qd = work.w.segment(part.ev0, part.body.n);
    const TreeJoint& j = part.joint;
    if (j.motion >= 0) {
      const TimeJet& m = work.motion[j.motion];
      update_joint_velocity(j, &m.value, &m.rate, p.joint);
      p.joint.bias += p.joint.S.col(0) * m.acceleration;
    } else {
      update_joint_velocity(j, work.q.data() + part.q0, work.w.data() + part.v0, p.joint);
    }
    // Inboard frame: its twist, and its acceleration at zero coordinate accelerations.
    Vec6 VA, AA;
    const bool inside = part.parent != ground && model.parts[part.parent].cluster == cluster;
    if (inside) {
      update_frame_velocity(model, j.inboard, work);
      const FrameWork& f = work.frames[j.inboard];
      VA = f.V;
      AA = to_child(f.pose, work.parts[part.parent].A0) + f.bias;
    } else {
      VA = to_child(c.entry[entry++], cw.base_V);
      AA.setZero();
    }
    const Vec6 VB = to_child(p.joint.pose, VA) + p.joint.W;
    const Vec6 AB = to_child(p.joint.pose, AA) - bracket(p.joint.W, VB) + p.joint.bias;
    FrameWork& out = work.frames[j.outboard];
    out.V = VB;
    if (!out.flexible) {
      p.V = to_parent(out.pose, VB);
      p.A0 = to_parent(out.pose, AB);
    } else {
      out.W = times(out.B, p.qd);
      p.V = to_parent(out.pose, VB - out.W);
      update_frame_velocity(model, j.outboard, work);
      p.A0 = to_parent(out.pose, AB - out.bias);
    }
  }
}

void update_base_acceleration(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const FrameWork& f = work.frames[c.base];
  if (c.parent == ground) {
    Vec6 g = Vec6::Zero();
    g.head<3>() = -model.settings.gravity;
    cw.base_A = to_child(f.pose, g);
  } else {
    const PartWork& carrier = work.parts[c.parent];
    cw.base_A = to_child(f.pose, carrier.A) + f.bias;
    if (f.flexible) cw.base_A.noalias() += f.B * carrier.qdd;
  }
}

void update_cluster_accelerations(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  size_t entry = 0;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const TreeJoint& j = part.joint;
    if (part.body.n > 0) p.qdd = work.wdot.segment(part.ev0, part.body.n);
    Vec6 AA;
    if (part.parent != ground && model.parts[part.parent].cluster == cluster) {
      const FrameWork& in = work.frames[j.inboard];
      const PartWork& carrier = work.parts[part.parent];
      AA = to_child(in.pose, carrier.A) + in.bias;
      if (in.flexible) AA.noalias() += in.B * carrier.qdd;
    } else {
      AA = to_child(c.entry[entry++], work.clusters[cluster].base_A);
    }
    const FrameWork& o = work.frames[j.outboard];
    Vec6 AB = to_child(p.joint.pose, AA) - bracket(p.joint.W, o.V) + p.joint.bias;
    for (int k = 0; k < j.nv; ++k) AB += p.joint.S.col(k) * work.wdot[part.v0 + k];
    if (o.flexible) {
      AB -= o.bias;
      AB.noalias() -= o.B * p.qdd;
    }
    p.A = to_parent(o.pose, AB);
  }
}

Pose frame_world(const Model& model, const Work& work, int frame) {
  const FramePoint& f = model.frames[frame];
  const Pose& local = work.frames[frame].pose;
  return f.part == ground ? local : compose(work.parts[f.part].world, local);
}

Pose frame_in_base(const Model& model, const Work& work, int cluster, int frame) {
  const FramePoint& f = model.frames[frame];
  const Cluster& c = model.clusters[cluster];
  const Pose& local = work.frames[frame].pose;
  if (f.part != ground && model.parts[f.part].cluster == cluster) return compose(work.parts[f.part].in_base, local);
  return compose(inverse(work.frames[c.base].pose), local);
}

Pose shown_pose(const Model& model, int part, Work& work) {
  const ShownFrame& shown = model.parts[part].shown;
  Pose out;
  if (!shown.differs) return out;
  update_frame_pose(model, shown.root, work);
  update_frame_pose(model, shown.tip, work);
  const Pose& root = work.frames[shown.root].pose;
  const Vec3 chord = work.frames[shown.tip].pose.p - root.p;
  out.p = root.p;
  if (shown.boundary == Boundary::clamped_free) {
    out.R = root.R;
  } else if (shown.boundary == Boundary::supported_supported) {
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

void project_wrench(const Model& model, const Work& work, int cluster, int frame, const Vec6& F, bool elastic, VecX& out) {
  const Cluster& c = model.clusters[cluster];
  int at = frame;
  Vec6 force = F;
  for (int i = model.frames[frame].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent) {
    const Part& part = model.parts[i];
    const PartWork& p = work.parts[i];
    const FrameWork& f = work.frames[at];
    const FrameWork& o = work.frames[part.joint.outboard];
    const Vec6 on_part = wrench_to_parent(f.pose, force);
    const Vec6 on_joint = wrench_to_child(o.pose, on_part);
    for (int k = 0; k < part.joint.nv; ++k) out[part.v0 - c.v0 + k] += p.joint.S.col(k).dot(on_joint);
    if (elastic) {
      double* const e = out.data() + (part.ev0 - c.v0);
      if (f.flexible)
        for (int k = 0; k < part.body.n; ++k) e[k] += f.B.col(k).dot(force);
      if (o.flexible)
        for (int k = 0; k < part.body.n; ++k) e[k] -= o.B.col(k).dot(on_joint);
    }
    force = wrench_to_parent(p.joint.pose, on_joint);
    at = part.joint.inboard;
  }
}

}  // namespace flexframe::sim
