#include "sim/dynamics/planar_data.h"

#include "sim/dynamics/dynamics.h"

#include <fmt/format.h>

namespace flexframe::sim {

using namespace planar;

// body_terms.h's update_mass for the components that motion in the plane meets.
void PlanarDynamics::Data::body_mass(PlanarPart& p) {
  Body& b = p.body;
  Vec2 md = b.md0;
  double J = b.J0;
  if (b.n > 0) {
    b.Mre.col(0) = b.md1_x;
    b.Mre.col(1) = b.md1_y;
    b.Mre.col(2) = b.Cr0;
    md += Vec2(b.md1_x.dot(p.q), b.md1_y.dot(p.q));
    J += b.J1.dot(p.q);
    if (b.md2_x.size() > 0) {
      multiply(b.md2_x, p.q.data(), b.work.data());
      b.Mre.col(0) += b.work;
      md.x() += 0.5 * b.work.dot(p.q);
    }
    if (b.md2_y.size() > 0) {
      multiply(b.md2_y, p.q.data(), b.work.data());
      b.Mre.col(1) += b.work;
      md.y() += 0.5 * b.work.dot(p.q);
    }
    if (b.Cr1.size() > 0) b.Mre.col(2).noalias() += b.Cr1 * p.q;
    if (b.J2.size() > 0) {
      multiply(b.J2, p.q.data(), b.J2q.data());
      J += 0.5 * b.J2q.dot(p.q);
    }
  }
  b.Mrr << b.mass, 0.0, -md.y(), 0.0, b.mass, md.x(), -md.y(), md.x(), J;
}

void PlanarDynamics::Data::body_velocity_terms(PlanarPart& p) {
  Body& b = p.body;
  const double w = p.V.z();
  Vec3 P = b.Mrr * p.V;
  Vec2 mdd = Vec2::Zero(), mddd = Vec2::Zero();
  double Jd = 0.0, Crd = 0.0;
  if (b.n > 0) {
    const Vec3 Pe = dots(b.Mre, p.qd);
    P += Pe;
    mdd = Pe.head<2>();
    // -Ct (v x w) - 1/2 w^2 dJ/dq + w (Cr1 - Cr1^T) qd.
    b.ce = (-p.V.y() * w) * b.Mre.col(0) + (p.V.x() * w) * b.Mre.col(1) - (0.5 * w * w) * b.J1;
    Jd = b.J1.dot(p.qd);
    if (b.J2.size() > 0) {
      Jd += b.J2q.dot(p.qd);
      b.ce -= (0.5 * w * w) * b.J2q;
    }
    if (b.Cr1.size() > 0) {
      // The symmetric part alone feeds qd . Cr1 qd, the other alone the gyroscopic force.
      multiply(b.Cr1, p.qd.data(), b.work.data());
      Crd = b.work.dot(p.qd);
      if (b.Cr1_difference.size() > 0) b.ce.noalias() += w * (b.Cr1_difference * p.qd);
    }
    if (b.md2_x.size() > 0) {
      multiply(b.md2_x, p.qd.data(), b.work.data());
      mddd.x() = b.work.dot(p.qd);
    }
    if (b.md2_y.size() > 0) {
      multiply(b.md2_y, p.qd.data(), b.work.data());
      mddd.y() = b.work.dot(p.qd);
    }
  }
  const Vec2 head = cross(w, Vec2(P.head<2>())) + cross(w, mdd) + mddd, v = p.V.head<2>();
  b.cr = Vec3(head.x(), head.y(), cross(v, Vec2(P.head<2>())) + cross(mdd, v) + Jd * w + Crd);
}

namespace {

// Wrenches as rows of F, moved from a frame to the one that sees it at pose a.
void move_wrenches(const Pose2& a, MatX3& F, Eigen::Index rows) {
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double x = a.c * F(k, 0) - a.s * F(k, 1), y = a.s * F(k, 0) + a.c * F(k, 1);
    F(k, 2) += a.p.x() * y - a.p.y() * x;
    F(k, 0) = x;
    F(k, 1) = y;
  }
}

// Twists of a part's frame by its joint's rates (Hj) and elastic ones (C).
void part_twists(const TreeJoint& joint, const Frame& o, PlanarPart& p) {
  for (int k = 0; k < joint.nv; ++k) p.Hj.col(k) = to_parent(o.pose, p.joint.S.col(k));
  if (!o.flexible) return;
  // C = -to_parent(B) column by column; B's third column is the rotation.
  p.C.col(0) = -o.pose.c * o.B.col(0) + o.pose.s * o.B.col(1) - o.pose.p.y() * o.B.col(2);
  p.C.col(1) = -o.pose.s * o.B.col(0) - o.pose.c * o.B.col(1) + o.pose.p.x() * o.B.col(2);
  p.C.col(2) = -o.B.col(2);
}

// The block of M of a part's own coordinates (jv: its first joint rate, ev: its first elastic one), their bias, and their wrenches on the
// part: Fj, Fe.
void own_block(const Part& part, const Cluster& c, const Frame& o, PlanarPart& p, ClusterWork& cw) {
  const int nj = part.joint.nv, n = part.body.n, jv = part.v0 - c.v0, ev = part.ev0 - c.v0;
  for (int k = 0; k < nj; ++k) {
    p.Fj.col(k) = p.Mrr * p.Hj.col(k);
    for (int j = 0; j <= k; ++j) cw.M(jv + k, jv + j) = p.Hj.col(j).dot(p.Fj.col(k));
    cw.r[jv + k] = p.Hj.col(k).dot(p.fr) - p.tau[k];
  }
  if (n == 0) return;
  cw.M.block(ev, ev, n, n) = p.Mee;
  cw.r.segment(ev, n) = p.fe;
  if (o.flexible) {
    p.Fe.setZero();
    add_rows(p.C, p.Mrr, p.Fe);
    p.scratch = p.Mre + 0.5 * p.Fe;
    p.Fe += p.Mre;
    add_symmetric(p.C, p.scratch, &cw.M(ev, ev), cw.M.rows());
    add_dots(p.C, p.fr, cw.r.data() + ev);
  } else {
    p.Fe = p.Mre;
  }
  for (int j = 0; j < nj; ++j)
    cw.M.block(ev, jv + j, n, 1) = p.Fe.col(0) * p.Hj(0, j) + p.Fe.col(1) * p.Hj(1, j) + p.Fe.col(2) * p.Hj(2, j);
}

// A composite's inertia and bias at a frame of the part that carries it.
void add_at_frame(const Frame& f, const Mat3& IA, const Vec3& fA, PlanarPart& carrier) {
  const Mat3 X = child_matrix(f.pose);
  const Mat3 XtI = X.transpose() * IA;
  carrier.Mrr += XtI * X;
  carrier.fr += wrench_to_parent(f.pose, fA);
  if (!f.flexible) return;
  add_rows(f.B, XtI, carrier.Mre);
  carrier.scratch.setZero();
  add_rows(f.B, 0.5 * IA, carrier.scratch);
  add_symmetric(f.B, carrier.scratch, carrier.Mee.data(), carrier.Mee.rows());
  add_dots(f.B, fA, carrier.fe.data());
}

// Which entry of the cluster a part stands at that hangs on what carries the cluster.
size_t entry_of(const Model& model, int cluster, int part) {
  size_t entry = 0;
  for (int k : model.clusters[cluster].parts) {
    if (k == part) break;
    if (model.parts[k].parent == ground || model.parts[model.parts[k].parent].cluster != cluster) ++entry;
  }
  return entry;
}

}  // namespace

// dynamics.cpp's assemble_cluster with three components; the lower half of M only.
void PlanarDynamics::Data::assemble(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  PlanarCluster& pc = clusters[cluster];
  pc.Ibb.setZero();
  pc.pb.setZero();
  // Blocks that are never written stay zero from make_work.
  for (int i : c.parts) part_twists(model.parts[i].joint, frames[model.parts[i].joint.outboard], parts[i]);
  for (size_t at = c.parts.size(); at-- > 0;) {
    const int i = c.parts[at];
    const Part& part = model.parts[i];
    PlanarPart& p = parts[i];
    own_block(part, c, frames[part.joint.outboard], p, cw);
    const int nj = part.joint.nv, n = part.body.n, columns = nj + n;
    const int jv = part.v0 - c.v0;

    // Wrenches of this part's columns, moved towards the base.
    MatX3& F = p.F;
    for (int k = 0; k < nj; ++k) F.row(k) = p.Fj.col(k).transpose();
    if (n > 0) F.bottomRows(n) = p.Fe;
    move_wrenches(p.step, F, columns);
    const Mat3 Y = child_matrix(p.step);
    const Mat3 IA = Y.transpose() * p.Mrr * Y;
    const Vec3 fA = wrench_to_parent(p.step, p.fr);
    int child = i;
    for (int a = part.parent; a != ground && model.parts[a].cluster == cluster; a = model.parts[a].parent) {
      const Part& pa = model.parts[a];
      PlanarPart& pw = parts[a];
      const Frame& f = frames[model.parts[child].joint.inboard];
      const Frame& turns = frames[pa.joint.outboard];
      const int aj = pa.v0 - c.v0, ae = pa.ev0 - c.v0;
      if (child == i) add_at_frame(f, IA, fA, pw);
      // Rows of M: this part's coordinates come after its ancestors'.
      if (f.flexible) set_outer(F, columns, f.B, &cw.M(jv, ae), cw.M.rows());
      move_wrenches(f.pose, F, columns);
      for (int j = 0; j < pa.joint.nv; ++j)
        cw.M.block(jv, aj + j, columns, 1) = F.col(0) * pw.Hj(0, j) + F.col(1) * pw.Hj(1, j) + F.col(2) * pw.Hj(2, j);
      if (turns.flexible) {
        if (f.flexible) add_outer(F, columns, pw.C, &cw.M(jv, ae), cw.M.rows());
        else set_outer(F, columns, pw.C, &cw.M(jv, ae), cw.M.rows());
      }
      move_wrenches(pw.step, F, columns);
      child = a;
    }
    const Pose2& in = pc.entry[entry_of(model, cluster, child)];
    move_wrenches(in, F, columns);
    pc.Ib.middleRows(jv, columns) = F.topRows(columns);
    if (child != i) continue;
    const Mat3 X = child_matrix(in);
    pc.Ibb += X.transpose() * IA * X;
    pc.pb += wrench_to_parent(in, fA);
  }
}

// dynamics.cpp's reduce_cluster; a matrix that cannot be factorised is left to it for its message.
void PlanarDynamics::Data::reduce(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  PlanarCluster& pc = clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  if (nd == 0) {
    cw.D = cw.M;
    pc.U = pc.Ib;
    cw.h = -cw.r;
  } else {
    const auto entry = [&](int i, int k) { return i >= k ? cw.M(i, k) : cw.M(k, i); };
    // Independent rates are ascending: between the dependent ones they are copied as they lie.
    pc.runs.clear();
    for (int k : part.ind) {
      if (!pc.runs.empty() && pc.runs.back().first + pc.runs.back().second == k) ++pc.runs.back().second;
      else pc.runs.emplace_back(k, 1);
    }
    cw.D.resize(ni, ni);
    pc.U.resize(ni, 3);
    cw.h.resize(ni);
    cw.Mid.resize(ni, nd);
    cw.T.resize(ni, nd);
    cw.Et = cw.E.transpose();
    for (int d = 0; d < nd; ++d)
      for (int i = 0; i < ni; ++i) cw.Mid(i, d) = entry(part.ind[i], part.dep[d]);
    cw.T = cw.Mid;
    for (int d = 0; d < nd; ++d)
      for (int e = 0; e < nd; ++e) cw.T.col(d) += entry(part.dep[d], part.dep[e]) * cw.Et.col(e);
    for (int k = 0; k < ni; ++k) {
      const int column = part.ind[k];
      double* const D = &cw.D(0, k);
      const double* const M = &cw.M(0, column);
      int i = 0;
      for (const auto& [from, count] : pc.runs) {
        std::copy(M + from, M + from + count, D + i);
        i += count;
      }
      pc.U.row(k) = pc.Ib.row(column);
      cw.h[k] = -cw.r[column];
    }
    add_products(cw.T, cw.Et, cw.Mid, cw.D);
    for (int d = 0; d < nd; ++d) {
      double rd = cw.r[part.dep[d]];
      for (int e = 0; e < nd; ++e) rd += entry(part.dep[d], part.dep[e]) * cw.gamma[e];
      cw.h -= cw.Et.col(d) * rd + cw.Mid.col(d) * cw.gamma[d];
      for (int r = 0; r < 3; ++r) pc.U.col(r) += cw.Et.col(d) * pc.Ib(part.dep[d], r);
      pc.pb += pc.Ib.row(part.dep[d]).transpose() * cw.gamma[d];
    }
  }
  if (ni == 0) return;
  if (cholesky(cw.D)) return;
  sim::update_positions(model, work);
  sim::update_velocities(model, work);
  sim::update_accelerations(model, work);
  throw SimulationError(fmt::format("the mass matrix of '{}' is singular at t = {:.6g} s", model.parts[c.parts.front()].name, work.time));
}

// Inertia, bias and forces of every part by itself.
void PlanarDynamics::Data::start_composites(const Model& model, const Work& work) {
  for (size_t i = 0; i < parts.size(); ++i) {
    PlanarPart& p = parts[i];
    body_velocity_terms(p);
    p.Mrr = p.body.Mrr;
    p.fr = p.body.cr - p.load + p.body.Mrr * p.A0;
    if (p.body.n > 0) {
      const Body& b = p.body;
      p.fe = b.ce - p.load_e;
      if (b.stiffness.size() > 0) p.fe += b.stiffness.cwiseProduct(p.q);
      else {
        multiply(b.Ke, p.q.data(), p.body.work.data());
        p.fe += b.work;
      }
      if (b.ksigma.size() > 0) p.fe += b.ksigma;
      if (b.De.size() > 0) {
        multiply(b.De, p.qd.data(), p.body.work.data());
        p.fe += b.work;
      }
      add_dots(b.Mre, p.A0, p.fe.data());
      p.Mre = b.Mre;
      p.Mee = b.Me;
    }
    joint_forces(model.parts[i], work.parts[i], work, p.tau);
  }
}

// Adds the articulated inertia and bias of a cluster to the part that carries it.
void PlanarDynamics::Data::add_to_carrier(const Model& model, int cluster, const Work& work) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  PlanarCluster& pc = clusters[cluster];
  Mat3 IA = pc.Ibb;
  Vec3 pA = pc.pb;
  if (!cw.partition.ind.empty()) {
    pc.DinvUt = pc.U;
    for (int r = 0; r < 3; ++r) solve(cw.D, pc.DinvUt.col(r).data());
    IA.noalias() -= pc.U.transpose().lazyProduct(pc.DinvUt);
    pA += dots(pc.DinvUt, cw.h);
  }
  PlanarPart& carrier = parts[c.parent];
  const Frame& f = frames[c.base];
  pA += IA * (to_child(f.pose, carrier.A0) + f.bias);
  add_at_frame(f, IA, pA, carrier);
}

// Accelerations of a cluster's coordinates, once its carrier's are known.
void PlanarDynamics::Data::solve_cluster(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  PlanarCluster& pc = clusters[cluster];
  const Frame& f = frames[c.base];
  if (c.parent == ground) {
    pc.base_A = to_child(f.pose, -gravity);
  } else {
    const PlanarPart& carrier = parts[c.parent];
    pc.base_A = to_child(f.pose, carrier.A) + f.bias;
    if (f.flexible) pc.base_A += dots(f.B, carrier.qdd);
  }
  const int ni = static_cast<int>(cw.partition.ind.size()), nd = static_cast<int>(cw.partition.dep.size());
  VecX& a = cw.a;
  a = cw.h;
  if (ni > 0) {
    a -= pc.U.col(0) * pc.base_A[0] + pc.U.col(1) * pc.base_A[1] + pc.U.col(2) * pc.base_A[2];
    solve(cw.D, a.data());
  }
  for (int k = 0; k < ni; ++k) work.wdot[c.v0 + cw.partition.ind[k]] = a[k];
  for (int k = 0; k < nd; ++k) work.wdot[c.v0 + cw.partition.dep[k]] = cw.gamma[k] + (ni > 0 ? cw.Et.col(k).dot(a) : 0.0);
}

// Twist rates of what carries other clusters.
void PlanarDynamics::Data::part_accelerations(const Model& model, int cluster, const Work& work) {
  const Cluster& c = model.clusters[cluster];
  PlanarCluster& pc = clusters[cluster];
  size_t entry = 0;
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PlanarPart& p = parts[i];
    const TreeJoint& j = part.joint;
    if (p.body.n > 0) p.qdd = work.wdot.segment(part.ev0, p.body.n);
    Vec3 AA;
    if (part.parent != ground && model.parts[part.parent].cluster == cluster) {
      const Frame& in = frames[j.inboard];
      const PlanarPart& carrier = parts[part.parent];
      AA = to_child(in.pose, carrier.A) + in.bias;
      if (in.flexible) AA += dots(in.B, carrier.qdd);
    } else {
      AA = to_child(pc.entry[entry++], pc.base_A);
    }
    const Frame& o = frames[j.outboard];
    Vec3 AB = to_child(p.joint.pose, AA) - bracket(p.joint.W, o.V) + p.joint.bias;
    for (int k = 0; k < j.nv; ++k) AB += p.joint.S.col(k) * work.wdot[part.v0 + k];
    if (o.flexible) AB -= o.bias + dots(o.B, p.qdd);
    p.A = to_parent(o.pose, AB);
  }
}

void PlanarDynamics::Data::accelerations(const Model& model, Work& work) {
  ++work.evaluations;
  loads(model, work);
  start_composites(model, work);
  for (int k = static_cast<int>(model.clusters.size()); k-- > 0;) {
    assemble(model, k, work);
    reduce(model, k, work);
    if (model.clusters[k].parent != ground) add_to_carrier(model, k, work);
  }
  for (int k = 0; k < static_cast<int>(model.clusters.size()); ++k) {
    solve_cluster(model, k, work);
    part_accelerations(model, k, work);
  }
}

PlanarDynamics::PlanarDynamics(std::unique_ptr<Data> data) : data_(std::move(data)) {}
PlanarDynamics::~PlanarDynamics() = default;

void PlanarDynamics::evaluate(const Model& model, Work& work) {
  Data& d = *data_;
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const Cluster& c = model.clusters[k];
    d.close_positions(model, static_cast<int>(k), work);
    Frame& base = d.frames[c.base];
    if (base.flexible) {
      d.frame_pose(base, d.parts[base.part].q);
      d.frame_jacobian(base);
    }
    const Pose2 base_world = base.part == ground ? base.pose : compose(d.parts[base.part].world, base.pose);
    for (int i : c.parts) d.parts[i].world = compose(base_world, d.parts[i].in_base);
  }
  for (PlanarPart& p : d.parts) d.body_mass(p);
  for (size_t k = 0; k < model.clusters.size(); ++k) d.close_velocities(model, static_cast<int>(k), work);
  d.accelerations(model, work);
}

}  // namespace flexframe::sim
