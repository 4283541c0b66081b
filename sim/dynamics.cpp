#include "sim/dynamics.h"

#include "sim/closure.h"
#include "sim/kinematics.h"
#include "sim/loads.h"

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

Mat6 parent_matrix(const Pose& pose) {
  Mat6 X;
  X.topLeftCorner<3, 3>() = pose.R;
  X.topRightCorner<3, 3>().noalias() = skew(pose.p) * pose.R;
  X.bottomLeftCorner<3, 3>().setZero();
  X.bottomRightCorner<3, 3>() = pose.R;
  return X;
}

// Own inertia, velocity terms and applied loads of every part; child clusters and parts are added on the way down.
void start_composites(const Model& model, Work& work) {
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const FlexibleBody& body = model.parts[i].body;
    PartWork& p = work.parts[i];
    update_velocity_terms(body, p.V, p.qd, p.terms);
    p.Mrr = p.terms.Mrr;
    p.fr = p.terms.cr - p.load;
    p.fr.noalias() += p.terms.Mrr * p.A0;
    if (body.n > 0) {
      elastic_force(body, p.q, p.qd, p.elastic);
      p.Mre = p.terms.Mre;
      p.Mee = body.Me;
      p.fe = p.terms.ce + p.elastic - p.load_e;
      p.fe.noalias() += p.terms.Mre.transpose() * p.A0;
    }
    joint_forces(model.parts[i], work, p.tau);
  }
}

// Adds the inertia I and the force f, both at a frame (frame axes), to the composite of the frame's part.
void add_at_frame(const FrameWork& frame, const Mat6& I, const Vec6& f, PartWork& p) {
  const Mat6 X = child_matrix(frame.pose);
  const Mat6 XtI = X.transpose() * I;
  p.Mrr.noalias() += XtI * X;
  p.fr.noalias() += X.transpose() * f;
  if (p.q.size() > 0 && frame.flexible) {
    p.Mre.noalias() += XtI * frame.B;
    const Mat6X IB = I * frame.B;
    p.Mee += frame.B.transpose().lazyProduct(IB);
    p.fe.noalias() += frame.B.transpose() * f;
  }
}

// Mass matrix, base coupling and bias of a cluster by composite bodies (Featherstone 2008 sec. 6.2, with elastic coordinates).
void assemble_cluster(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  cw.Ibb.setZero();
  cw.pb.setZero();
  if (c.parts.size() > 1) cw.M.setZero();
  for (int i : c.parts) {
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const FrameWork& o = work.frames[part.joint.outboard];
    for (int k = 0; k < part.joint.nv; ++k) p.Hj.col(k) = to_parent(o.pose, p.joint.S.col(k));
    if (o.flexible) p.C.noalias() = -(parent_matrix(o.pose) * o.B);
  }
  size_t entry = c.entry.size();
  for (size_t at = c.parts.size(); at-- > 0;) {
    const int i = c.parts[at];
    const Part& part = model.parts[i];
    PartWork& p = work.parts[i];
    const FrameWork& o = work.frames[part.joint.outboard];
    const int nj = part.joint.nv, n = part.body.n;
    const int jv = part.v0 - c.v0, ev = part.ev0 - c.v0;

    // Diagonal block and bias.
    if (nj > 0) {
      p.Fj.noalias() = p.Mrr * p.Hj;
      cw.M.block(jv, jv, nj, nj).noalias() = p.Hj.transpose() * p.Fj;
      cw.r.segment(jv, nj).noalias() = p.Hj.transpose() * p.fr;
      cw.r.segment(jv, nj) -= p.tau;
    }
    if (n > 0) {
      p.Fe = p.Mre;
      auto Mee = cw.M.block(ev, ev, n, n);
      Mee = p.Mee;
      cw.r.segment(ev, n) = p.fe;
      if (o.flexible) {
        p.Fe.noalias() += p.Mrr * p.C;
        // Products with six inner terms: blocking for the cache would cost more than it saves.
        Mee += p.C.transpose().lazyProduct(p.Fe);
        Mee += p.Mre.transpose().lazyProduct(p.C);
        cw.r.segment(ev, n).noalias() += p.C.transpose() * p.fr;
      }
      if (nj > 0) {
        cw.M.block(jv, ev, nj, n).noalias() = p.Hj.transpose() * p.Fe;
        cw.M.block(ev, jv, n, nj) = cw.M.block(jv, ev, nj, n).transpose();
      }
    }

    // Towards the base: this part's columns on its ancestors' coordinates, its composite on its parent.
    const Mat6 Y = child_matrix(p.step);
    Mat6X F(6, nj + n);
    if (nj > 0) F.leftCols(nj).noalias() = Y.transpose() * p.Fj;
    if (n > 0) F.rightCols(n).noalias() = Y.transpose() * p.Fe;
    const Mat6 IA = Y.transpose() * p.Mrr * Y;
    const Vec6 fA = Y.transpose() * p.fr;
    int child = i;
    for (int a = part.parent; a != ground && model.parts[a].cluster == cluster; a = model.parts[a].parent) {
      const Part& pa = model.parts[a];
      PartWork& pw = work.parts[a];
      const FrameWork& f = work.frames[model.parts[child].joint.inboard];
      if (child == i) add_at_frame(f, IA, fA, pw);
      const Mat6X Fp = child_matrix(f.pose).transpose() * F;
      const int aj = pa.v0 - c.v0, ae = pa.ev0 - c.v0;
      const auto write = [&](int row, const MatX& block) {
        if (nj > 0) {
          cw.M.block(row, jv, block.rows(), nj) = block.leftCols(nj);
          cw.M.block(jv, row, nj, block.rows()) = block.leftCols(nj).transpose();
        }
        if (n > 0) {
          cw.M.block(row, ev, block.rows(), n) = block.rightCols(n);
          cw.M.block(ev, row, n, block.rows()) = block.rightCols(n).transpose();
        }
      };
      if (pa.joint.nv > 0) write(aj, pw.Hj.transpose() * Fp);
      if (pa.body.n > 0) {
        MatX block = MatX::Zero(pa.body.n, nj + n);
        if (f.flexible) block.noalias() += f.B.transpose() * F;
        if (work.frames[pa.joint.outboard].flexible) block.noalias() += pw.C.transpose() * Fp;
        write(ae, block);
      }
      F = child_matrix(pw.step).transpose() * Fp;
      child = a;
    }
    // Which entry the chain came in by: entries are counted backwards for parts attached outside.
    const bool outside = part.parent == ground || model.parts[part.parent].cluster != cluster;
    int root = child;
    size_t e = 0;
    if (outside) {
      e = --entry;
    } else {
      for (int k : c.parts) {
        if (k == root) break;
        if (model.parts[k].parent == ground || model.parts[model.parts[k].parent].cluster != cluster) ++e;
      }
    }
    const Mat6 X = child_matrix(c.entry[e]);
    if (nj > 0) cw.Ib.middleCols(jv, nj).noalias() = X.transpose() * F.leftCols(nj);
    if (n > 0) cw.Ib.middleCols(ev, n).noalias() = X.transpose() * F.rightCols(n);
    if (outside) {
      cw.Ibb.noalias() += X.transpose() * IA * X;
      cw.pb.noalias() += X.transpose() * fA;
    }
  }
}

// Projects on the independent rates and factorises.
void reduce_cluster(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  if (nd == 0) {
    cw.D = cw.M;
    cw.U = cw.Ib;
    cw.h = -cw.r;
  } else {
    // D = N^T M N with N = [1; E]; h = -N^T (r + M [0; gamma]).
    MatX Mdd(nd, nd), Mdi(nd, ni);
    cw.D.resize(ni, ni);
    cw.U.resize(6, ni);
    cw.h.resize(ni);
    for (int k = 0; k < ni; ++k) {
      const int col = part.ind[k];
      for (int i = 0; i < ni; ++i) cw.D(i, k) = cw.M(part.ind[i], col);
      for (int i = 0; i < nd; ++i) Mdi(i, k) = cw.M(part.dep[i], col);
      cw.U.col(k) = cw.Ib.col(col);
      cw.h[k] = -cw.r[col];
    }
    VecX rd(nd);
    Mat6X Ud(6, nd);
    for (int k = 0; k < nd; ++k) {
      for (int i = 0; i < nd; ++i) Mdd(i, k) = cw.M(part.dep[i], part.dep[k]);
      rd[k] = cw.r[part.dep[k]];
      Ud.col(k) = cw.Ib.col(part.dep[k]);
    }
    const MatX T = Mdi + Mdd * cw.E;
    cw.D.noalias() += cw.E.transpose() * T;
    cw.D.noalias() += Mdi.transpose() * cw.E;
    cw.U.noalias() += Ud * cw.E;
    rd.noalias() += Mdd * cw.gamma;
    cw.h.noalias() -= cw.E.transpose() * rd;
    cw.h.noalias() -= Mdi.transpose() * cw.gamma;
    cw.pb.noalias() += Ud * cw.gamma;
  }
  if (ni == 0) return;
  cw.llt.compute(cw.D);
  // A pivot that cancels to 1e-14 of its diagonal, or is not positive, is a coordinate without inertia.
  const auto& L = cw.llt.matrixLLT();
  for (int k = 0; k < ni; ++k) {
    const double d = cw.D(k, k);
    if (cw.llt.info() == Eigen::Success && d > 0.0 && L(k, k) * L(k, k) > 1e-14 * d) continue;
    const int v = c.v0 + part.ind[k];
    std::string who = "an elastic coordinate";
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      if (v >= p.v0 && v < p.v0 + p.joint.nv) who = fmt::format("joint '{}'", p.joint.name);
      if (v >= p.ev0 && v < p.ev0 + p.body.n) who = fmt::format("elastic coordinate {} of body '{}'", v - p.ev0 + 1, p.name);
    }
    const bool elastic = who.rfind("elastic", 0) == 0;
    if (elastic && cw.llt.info() != Eigen::Success && d > 0.0)
      throw SimulationError(fmt::format("the kinetic energy of {} is no longer positive at t = {:.6g} s: it is deformed beyond what the second-order "
                                        "displacement field describes; use model = \"mixed\" with more volumes, or leave out torsion or stiffening",
                                        who, work.time));
    if (cw.llt.info() == Eigen::Success || d <= 0.0 || k == ni - 1)
      throw SimulationError(fmt::format("{} moves without inertia at t = {:.6g} s: give the bodies it carries mass or inertia, or fix the joint", who, work.time));
  }
}

}  // namespace

void update_expressions(Model& model, double t, Work& work) {
  work.time = t;
  for (const Load& load : model.loads)
    if (load.expression >= 0) work.expression_value[load.expression] = model.expressions[load.expression].value(t);
  for (const Part& part : model.parts)
    if (part.joint.motion >= 0) work.motion[part.joint.motion] = model.expressions[part.joint.motion].jet(t);
}

void update_positions(const Model& model, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    close_positions(model, static_cast<int>(c), work);
    update_cluster_world(model, static_cast<int>(c), work);
  }
  for (size_t i = 0; i < model.parts.size(); ++i) update_mass(model.parts[i].body, work.parts[i].q, work.parts[i].terms);
}

void update_velocities(const Model& model, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
}

void update_accelerations(const Model& model, Work& work) {
  ++work.evaluations;
  update_loads(model, work);
  start_composites(model, work);
  for (size_t at = model.clusters.size(); at-- > 0;) {
    const Cluster& c = model.clusters[at];
    ClusterWork& cw = work.clusters[at];
    assemble_cluster(model, static_cast<int>(at), work);
    reduce_cluster(model, static_cast<int>(at), work);
    if (c.parent == ground) continue;
    // Articulated inertia and bias of the cluster at its base frame, added to the part that carries it.
    Mat6 IA = cw.Ibb;
    Vec6 pA = cw.pb;
    if (!cw.partition.ind.empty()) {
      cw.DinvUt = cw.llt.solve(cw.U.transpose());
      IA.noalias() -= cw.U * cw.DinvUt;
      pA.noalias() += cw.DinvUt.transpose() * cw.h;
    }
    const FrameWork& f = work.frames[c.base];
    PartWork& carrier = work.parts[c.parent];
    pA.noalias() += IA * (to_child(f.pose, carrier.A0) + f.bias);
    add_at_frame(f, IA, pA, carrier);
  }
  for (size_t at = 0; at < model.clusters.size(); ++at) {
    const Cluster& c = model.clusters[at];
    ClusterWork& cw = work.clusters[at];
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
    const int ni = static_cast<int>(cw.partition.ind.size()), nd = static_cast<int>(cw.partition.dep.size());
    VecX a(ni);
    if (ni > 0) {
      a = cw.h;
      a.noalias() -= cw.U.transpose() * cw.base_A;
      cw.llt.solveInPlace(a);
    }
    for (int k = 0; k < ni; ++k) cw.wdot[cw.partition.ind[k]] = a[k];
    if (nd > 0) {
      VecX d = cw.gamma;
      if (ni > 0) d.noalias() += cw.E * a;
      for (int k = 0; k < nd; ++k) cw.wdot[cw.partition.dep[k]] = d[k];
    }
    work.wdot.segment(c.v0, c.nv) = cw.wdot;
    size_t entry = 0;
    for (int i : c.parts) {
      const Part& part = model.parts[i];
      PartWork& p = work.parts[i];
      const TreeJoint& j = part.joint;
      if (part.body.n > 0) p.qdd = work.wdot.segment(part.ev0, part.body.n);
      Vec6 AA;
      if (part.parent != ground && model.parts[part.parent].cluster == static_cast<int>(at)) {
        const FrameWork& in = work.frames[j.inboard];
        const PartWork& carrier = work.parts[part.parent];
        AA = to_child(in.pose, carrier.A) + in.bias;
        if (in.flexible) AA.noalias() += in.B * carrier.qdd;
      } else {
        AA = to_child(c.entry[entry++], cw.base_A);
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
}

Energy compute_energy(const Model& model, const Work& work, int scene_body) {
  Energy e;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    if (scene_body >= 0 && part.scene_body != scene_body) continue;
    const PartWork& p = work.parts[i];
    e.kinetic += kinetic_energy(part.body, p.terms, p.V, p.qd);
    e.strain += strain_energy(part.body, p.q);
    e.potential -= model.settings.gravity.dot(part.body.mass * p.world.p + p.world.R * p.terms.md);
    for (int k = 0; k < part.joint.nv; ++k)
      if (part.joint.bending_stiffness.size() > k)
        e.strain += 0.5 * part.joint.bending_stiffness[k] * work.q[part.q0 + k] * work.q[part.q0 + k];
  }
  if (scene_body < 0) e.potential += spring_energy(model, work);
  return e;
}

}  // namespace flexframe::sim
