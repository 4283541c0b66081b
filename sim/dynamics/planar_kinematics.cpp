#include "sim/dynamics/planar_data.h"

#include "sim/dynamics/closure.h"

#include <limits>

namespace flexframe::sim {

using namespace planar;

// Pose, phi2 q.
void PlanarDynamics::Data::frame_pose(Frame& f, const VecX& q) {
  if (!f.flexible) return;
  const double node = f.node_angle + f.psi.dot(q), angle = node + f.offset_angle;
  Vec2 at = f.origin + Vec2(f.phi_x.dot(q), f.phi_y.dot(q));
  if (f.phi2_x.size() > 0) {
    multiply(f.phi2_x, q.data(), f.h_x.data());
    at.x() += 0.5 * f.h_x.dot(q);
  }
  if (f.phi2_y.size() > 0) {
    multiply(f.phi2_y, q.data(), f.h_y.data());
    at.y() += 0.5 * f.h_y.dot(q);
  }
  f.pose.c = std::cos(angle);
  f.pose.s = std::sin(angle);
  f.pose.p = at;
  if (!f.offset.isZero(0.0)) f.pose.p += turn({std::cos(node), std::sin(node), Vec2::Zero()}, f.offset);
}

void PlanarDynamics::Data::frame_jacobian(Frame& f) {
  if (!f.flexible) return;
  const double c = f.pose.c, s = f.pose.s;
  if (f.phi2_x.size() > 0) f.h_x += f.phi_x;
  if (f.phi2_y.size() > 0) f.h_y += f.phi_y;
  const VecX& x = f.phi2_x.size() > 0 ? f.h_x : f.phi_x;
  const VecX& y = f.phi2_y.size() > 0 ? f.h_y : f.phi_y;
  f.B.col(0) = c * x + s * y;
  f.B.col(1) = c * y - s * x;
  if (f.arm.isZero(0.0)) return;
  f.B.col(0) -= f.arm.y() * f.psi;
  f.B.col(1) += f.arm.x() * f.psi;
}

// Twist and bias from the part's twist; kinematics.h has the same in space.
void PlanarDynamics::Data::frame_velocity(Frame& f) {
  if (f.part == ground) {
    f.V.setZero();
    f.bias.setZero();
    return;
  }
  const PlanarPart& p = parts[f.part];
  f.V = to_child(f.pose, p.V);
  if (!f.flexible) {
    f.bias.setZero();
    return;
  }
  f.W = dots(f.B, p.qd);
  f.V += f.W;
  Vec2 second = Vec2::Zero();
  if (f.phi2_x.size() > 0) {
    multiply(f.phi2_x, p.qd.data(), f.scratch.data());
    second.x() = f.scratch.dot(p.qd);
  }
  if (f.phi2_y.size() > 0) {
    multiply(f.phi2_y, p.qd.data(), f.scratch.data());
    second.y() = f.scratch.dot(p.qd);
  }
  const double omega = f.W.z();
  const Vec2 node_rate = f.W.head<2>() - cross(omega, f.arm);
  const Vec2 head = turn_back(f.pose, second) - cross(omega, node_rate);
  f.bias = Vec3(head.x(), head.y(), 0.0) - bracket(f.W, f.V);
}

namespace {

void joint_position(const TreeJoint& def, Joint& j, const double* q) {
  j.pose = j.zero;
  const auto rotate = [&](double angle) {
    const Pose2 r{std::cos(angle), std::sin(angle), Vec2::Zero()};
    j.pose = compose(r, j.zero);
  };
  switch (j.kind) {
    case JointKind::revolute:
      rotate(j.sense * q[0]);
      j.S.col(0) = Vec3(0.0, 0.0, j.sense);
      break;
    case JointKind::prismatic: {
      j.pose.p = j.direction * q[0];
      const Vec2 d = turn_back(j.pose, j.direction);
      j.S.col(0) = Vec3(d.x(), d.y(), 0.0);
      break;
    }
    case JointKind::planar: {
      rotate(j.sense * q[2]);
      j.pose.p = j.direction * q[0] + j.direction_y * q[1];
      const Vec2 x = turn_back(j.pose, j.direction), y = turn_back(j.pose, j.direction_y);
      j.S.col(0) = Vec3(x.x(), x.y(), 0.0);
      j.S.col(1) = Vec3(y.x(), y.y(), 0.0);
      j.S.col(2) = Vec3(0.0, 0.0, j.sense);
      break;
    }
    default:
      return;
  }
  if (!def.reversed) return;
  for (int k = 0; k < rate_count(j.kind); ++k) j.S.col(k) = -to_parent(j.pose, j.S.col(k));
  j.pose = inverse(j.pose);
}

void joint_velocity(const TreeJoint& def, Joint& j, const double* w) {
  j.W.setZero();
  j.bias.setZero();
  for (int k = 0; k < rate_count(j.kind); ++k) j.W += j.S.col(k) * w[k];
  if (j.kind != JointKind::planar) return;
  const Pose2 forward = def.reversed ? inverse(j.pose) : j.pose;
  const Vec2 head = -cross(j.sense * w[2], turn_back(forward, j.direction * w[0] + j.direction_y * w[1]));
  j.bias = Vec3(head.x(), head.y(), 0.0);
  if (def.reversed) j.bias = -to_parent(forward, j.bias);
}

}  // namespace

void PlanarDynamics::Data::cluster_frames(const Model& model, int k, Work& work) {
  const Cluster& c = model.clusters[k];
  for (int i : c.parts)
    if (parts[i].body.n > 0) parts[i].q = work.q.segment(model.parts[i].eq0, parts[i].body.n);
  for (int f : c.frames) frame_pose(frames[f], parts[frames[f].part].q);
}

void PlanarDynamics::Data::cluster_chain(const Model& model, int k, const Work& work) {
  const Cluster& c = model.clusters[k];
  size_t entry = 0;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PlanarPart& p = parts[i];
    const TreeJoint& j = part.joint;
    joint_position(j, p.joint, j.motion >= 0 ? &work.motion[j.motion].value : work.q.data() + part.q0);
    p.step = compose(p.joint.pose, inverse(frames[j.outboard].pose));
    if (part.parent != ground && model.parts[part.parent].cluster == k)
      p.in_base = compose(compose(parts[part.parent].in_base, frames[j.inboard].pose), p.step);
    else p.in_base = compose(clusters[k].entry[entry++], p.step);
  }
}

Pose2 PlanarDynamics::Data::in_base(const Model& model, int cluster, int frame) const {
  const Frame& f = frames[frame];
  if (f.part != ground && model.parts[f.part].cluster == cluster) return compose(parts[f.part].in_base, f.pose);
  return compose(inverse(frames[model.clusters[cluster].base].pose), f.pose);
}

double PlanarDynamics::Data::row_residual(const Model& model, int cluster, const Row& row, const Work& work) const {
  if (row.loop < 0) {
    const ClusterWork& cw = work.clusters[cluster];
    const int v = model.clusters[cluster].v0 + cw.locked[row.lock];
    for (int i : model.clusters[cluster].parts) {
      const Part& p = model.parts[i];
      if (v >= p.v0 && v < p.v0 + p.joint.nv) return work.q[p.q0 + v - p.v0] - cw.lock_value[row.lock];
    }
    return 0.0;
  }
  const LoopJoint& loop = model.loops[row.loop];
  const Pose2 r = compose(inverse(in_base(model, cluster, loop.a)), in_base(model, cluster, loop.b));
  switch (row.kind) {
    case ClosureRow::translation:
      return row.u.dot(r.p) + row.constant;
    case ClosureRow::angle:
      return row.u.dot(turn(r, row.b)) + row.constant;
    default:
      return (r.p.squaredNorm() + row.out_of_plane2 - row.length * row.length) / (2.0 * row.length);
  }
}

void PlanarDynamics::Data::project(const Model& model, int cluster, int frame, const Vec3& F, bool elastic, VecX& out) {
  const Cluster& c = model.clusters[cluster];
  int at = frame;
  Vec3 force = F;
  for (int i = frames[frame].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent) {
    const Part& part = model.parts[i];
    const PlanarPart& p = parts[i];
    const Frame& f = frames[at];
    const Frame& o = frames[part.joint.outboard];
    const Vec3 on_joint = wrench_to_child(o.pose, wrench_to_parent(f.pose, force));
    for (int k = 0; k < part.joint.nv; ++k) out[part.v0 - c.v0 + k] += p.joint.S.col(k).dot(on_joint);
    if (elastic) {
      double* const e = out.data() + (part.ev0 - c.v0);
      if (f.flexible) add_dots(f.B, force, e);
      if (o.flexible) add_dots(o.B, -on_joint, e);
    }
    force = wrench_to_parent(p.joint.pose, on_joint);
    at = part.joint.inboard;
  }
}

void PlanarDynamics::Data::closure_line(const Model& model, int cluster, const Row& row, bool elastic, VecX& line) {
  const Cluster& c = model.clusters[cluster];
  line.setZero(c.nv);
  if (row.loop < 0) {
    // A locked rate.
    return;
  }
  const LoopJoint& loop = model.loops[row.loop];
  const Pose2 r = compose(inverse(in_base(model, cluster, loop.a)), in_base(model, cluster, loop.b));
  Vec2 force = Vec2::Zero();
  double moment = 0.0;
  if (row.kind == ClosureRow::translation) force = row.u;
  if (row.kind == ClosureRow::distance) force = r.p / row.length;
  if (row.kind == ClosureRow::angle) moment = cross(turn(r, row.b), row.u);
  const Vec2 back = turn_back(r, force);
  project(model, cluster, loop.b, {back.x(), back.y(), moment}, elastic, line);
  project(model, cluster, loop.a, {-force.x(), -force.y(), -(moment + cross(r.p, force))}, elastic, line);
}

// closure.h's close_positions; what does not converge here is left to it.
void PlanarDynamics::Data::close_positions(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  cluster_frames(model, cluster, work);
  cluster_chain(model, cluster, work);
  const auto jacobians = [&]() {
    for (int f : c.frames) frame_jacobian(frames[f]);
  };
  if (nd == 0) {
    jacobians();
    return;
  }
  const std::vector<Row>& rows = clusters[cluster].rows;
  const int loop_rows = static_cast<int>(rows.size());
  const auto row_at = [&](int r) {
    if (r < loop_rows) return rows[r];
    Row lock{};
    lock.lock = r - loop_rows;
    return lock;
  };
  const auto line_at = [&](int r, bool elastic) {
    closure_line(model, cluster, row_at(r), elastic, cw.line);
    if (r >= loop_rows) cw.line[cw.locked[r - loop_rows]] = 1.0;
  };
  cw.res.resize(nd);
  cw.Gd.resize(nd, nd);
  const bool elastic = deformation_closes(model, work, cluster);
  bool fresh = false;
  double last = std::numeric_limits<double>::infinity();
  if (elastic) {
    // Deformations among what closes the loop: rare (a structure of beams), and not worth a second version.
    sim::close_positions(model, cluster, work);
    cluster_frames(model, cluster, work);
    cluster_chain(model, cluster, work);
  }
  for (int iteration = 0; !elastic; ++iteration) {
    for (int i = 0; i < nd; ++i) cw.res[i] = row_residual(model, cluster, row_at(part.rows[i]), work);
    if (!fresh) {
      for (int i = 0; i < nd; ++i) {
        line_at(part.rows[i], false);
        for (int k = 0; k < nd; ++k) cw.Gd(i, k) = cw.line[part.dep[k]];
      }
      cw.lu.compute(cw.Gd);
      fresh = true;
    }
    cw.step = cw.lu.solve(cw.res);
    ++work.closure_iterations;
    double size = cw.res.cwiseAbs().maxCoeff();
    for (int k = 0; k < nd; ++k) size = std::max(size, std::abs(cw.step[k]) * rate_scale(model, cluster, part.dep[k]));
    if (size <= 3e-13 * c.size || (size <= 1e-10 * c.size && size > 0.25 * last)) break;
    if (!std::isfinite(size) || iteration == 40 || (iteration > 4 && size > c.size)) {
      sim::close_positions(model, cluster, work);
      cluster_frames(model, cluster, work);
      cluster_chain(model, cluster, work);
      break;
    }
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < nd; ++k) {
        const int v = c.v0 + part.dep[k];
        if (v >= p.v0 && v < p.v0 + p.joint.nv) work.q[p.q0 + v - p.v0] -= cw.step[k];
      }
    }
    cluster_chain(model, cluster, work);
    if (std::isfinite(last) ? size <= 1e-3 * last && size * size / last <= 1e-15 * c.size : size <= 1e-10 * c.size) break;
    if (size > 1e-3 * std::min(last, c.size)) fresh = false;
    last = size;
  }
  jacobians();
  cw.Gi.resize(nd, ni);
  for (int i = 0; i < nd; ++i) {
    line_at(part.rows[i], true);
    for (int k = 0; k < nd; ++k) cw.Gd(i, k) = cw.line[part.dep[k]];
    for (int k = 0; k < ni; ++k) cw.Gi(i, k) = -cw.line[part.ind[k]];
  }
  cw.lu.compute(cw.Gd);
  solve(cw.lu, cw.Gi, cw.E);
}

void PlanarDynamics::Data::cluster_velocities(const Model& model, int cluster, const Work& work) {
  const Cluster& c = model.clusters[cluster];
  PlanarCluster& pc = clusters[cluster];
  frame_velocity(frames[c.base]);
  pc.base_V = frames[c.base].V;
  size_t entry = 0;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PlanarPart& p = parts[i];
    if (p.body.n > 0) p.qd = work.w.segment(part.ev0, p.body.n);
    const TreeJoint& j = part.joint;
    if (j.motion >= 0) {
      const TimeJet& m = work.motion[j.motion];
      joint_velocity(j, p.joint, &m.rate);
      p.joint.bias += p.joint.S.col(0) * m.acceleration;
    } else {
      joint_velocity(j, p.joint, work.w.data() + part.v0);
    }
    Vec3 VA, AA;
    if (part.parent != ground && model.parts[part.parent].cluster == cluster) {
      Frame& f = frames[j.inboard];
      frame_velocity(f);
      VA = f.V;
      AA = to_child(f.pose, parts[part.parent].A0) + f.bias;
    } else {
      VA = to_child(pc.entry[entry++], pc.base_V);
      AA.setZero();
    }
    const Vec3 VB = to_child(p.joint.pose, VA) + p.joint.W;
    const Vec3 AB = to_child(p.joint.pose, AA) - bracket(p.joint.W, VB) + p.joint.bias;
    Frame& out = frames[j.outboard];
    out.V = VB;
    if (!out.flexible) {
      p.V = to_parent(out.pose, VB);
      p.A0 = to_parent(out.pose, AB);
    } else {
      p.V = to_parent(out.pose, VB - dots(out.B, p.qd));
      frame_velocity(out);
      p.A0 = to_parent(out.pose, AB - out.bias);
    }
  }
}

void PlanarDynamics::Data::close_velocities(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  if (nd == 0) {
    cluster_velocities(model, cluster, work);
    return;
  }
  // Rate (from prescribed motions) and acceleration at zero coordinate accelerations of each row: closure.h's update_closure_rates.
  const auto rates = [&](VecX* rate, VecX* bias) {
    const auto motion = [&](int frame, Vec3& V, Vec3& A) {
      Frame& f = frames[frame];
      if (f.part != ground && model.parts[f.part].cluster == cluster) {
        frame_velocity(f);
        V = f.V;
        A = to_child(f.pose, parts[f.part].A0) + f.bias;
      } else {
        V = to_child(compose(inverse(frames[c.base].pose), f.pose), clusters[cluster].base_V);
        A.setZero();
      }
    };
    int have = -1;
    Pose2 r;
    Vec3 Va, Aa, Vb, Ab;
    for (int i = 0; i < nd; ++i) {
      const int at = part.rows[i];
      if (at >= static_cast<int>(clusters[cluster].rows.size())) {
        if (rate) (*rate)[i] = work.w[c.v0 + cw.locked[at - static_cast<int>(clusters[cluster].rows.size())]];
        if (bias) (*bias)[i] = 0.0;
        continue;
      }
      const Row& row = clusters[cluster].rows[at];
      const LoopJoint& loop = model.loops[row.loop];
      if (have != row.loop) {
        r = compose(inverse(in_base(model, cluster, loop.a)), in_base(model, cluster, loop.b));
        motion(loop.a, Va, Aa);
        motion(loop.b, Vb, Ab);
        have = row.loop;
      }
      const Vec2 vb = turn(r, Vb.head<2>());
      const double wa = Va.z(), w = Vb.z() - wa, wd = Ab.z() - Aa.z();
      const Vec2 pd = vb - Va.head<2>() - cross(wa, r.p);
      const Vec2 pdd = turn(r, Ab.head<2>()) + cross(w, vb) - Aa.head<2>() - cross(Aa.z(), r.p) - cross(wa, pd);
      const Vec2 b = turn(r, row.b);
      Vec2 lv = Vec2::Zero();
      double lw = 0.0;
      if (row.kind == ClosureRow::translation) lv = row.u;
      if (row.kind == ClosureRow::distance) lv = r.p / row.length;
      if (row.kind == ClosureRow::angle) lw = cross(b, row.u);
      if (rate) (*rate)[i] = lv.dot(pd) + lw * w;
      if (bias) {
        (*bias)[i] = lv.dot(pdd) + lw * wd;
        if (row.kind == ClosureRow::angle) (*bias)[i] -= w * w * b.dot(row.u);
        if (row.kind == ClosureRow::distance) (*bias)[i] += pd.squaredNorm() / row.length;
      }
    }
  };
  cw.ind_rate.resize(ni);
  for (int k = 0; k < ni; ++k) cw.ind_rate[k] = work.w[c.v0 + part.ind[k]];
  cw.step.noalias() = cw.E * cw.ind_rate;
  bool prescribed = false;
  for (int i : c.parts) prescribed = prescribed || model.parts[i].joint.motion >= 0;
  cw.e0.setZero(nd);
  cw.res.resize(nd);
  if (prescribed) {
    work.w.segment(c.v0, c.nv).setZero();
    cluster_velocities(model, cluster, work);
    rates(&cw.res, nullptr);
    cw.e0 = -cw.lu.solve(cw.res);
    cw.step += cw.e0;
  }
  for (int k = 0; k < ni; ++k) work.w[c.v0 + part.ind[k]] = cw.ind_rate[k];
  for (int k = 0; k < nd; ++k) work.w[c.v0 + part.dep[k]] = cw.step[k];
  cluster_velocities(model, cluster, work);
  rates(nullptr, &cw.res);
  cw.gamma = -cw.lu.solve(cw.res);
}

}  // namespace flexframe::sim
