#include "sim/dynamics/dynamics.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/dynamics/massless.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// The products below have six inner terms or fewer: coefficient by coefficient, as blocking for the cache would cost more than it saves.

// M += A^T B + B^T A for the lower half of a symmetric block, mirrored; A, B: 6 x n.
template <class Block>
void add_symmetric(const Mat6X& A, const Mat6X& B, Block&& M) {
  const Eigen::Index n = M.cols();
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec6 a = A.col(k), b = B.col(k);
    for (Eigen::Index i = k; i < n; ++i) M(i, k) += A.col(i).dot(b) + B.col(i).dot(a);
  }
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index i = k + 1; i < n; ++i) M(k, i) = M(i, k);
}

// out += A^T f.
template <class Out>
void add_dots(const Mat6X& A, const Vec6& f, Out&& out) {
  for (Eigen::Index k = 0; k < A.cols(); ++k) out[k] += A.col(k).dot(f);
}

// Own inertia, velocity terms and applied loads of every part; child clusters and parts are added on the way down.
void start_composites(const Model& model, Work& work) {
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const FlexibleBody& body = model.parts[i].body;
    PartWork& p = work.parts[i];
    update_velocity_terms(kinetics(model, work, static_cast<int>(i)), p.V, p.qd, p.terms);
    p.Mrr = p.terms.Mrr;
    p.fr = p.terms.cr - p.load;
    p.fr.noalias() += p.terms.Mrr * p.A0;
    if (body.n > 0) {
      elastic_force(body, p.q, p.qd, p.elastic);
      p.Mre = p.terms.Mre;
      p.Mee = elastic_mass(kinetics(model, work, static_cast<int>(i)), p.terms);
      p.fe = p.terms.ce + p.elastic - p.load_e;
      p.fe.noalias() += p.terms.Mre.transpose() * p.A0;
    }
    joint_forces(model.parts[i], p, work, p.tau);
  }
  add_flexure_moments(model, work);
}

// Adds the inertia I and the force f, both at a frame (frame axes), to the composite of the frame's part.
void add_at_frame(const FrameWork& frame, const Mat6& I, const Vec6& f, PartWork& p) {
  const Mat6 X = child_matrix(frame.pose);
  Mat6 XtI;
  XtI.noalias() = X.transpose().lazyProduct(I);
  p.Mrr += XtI.lazyProduct(X);
  p.fr += wrench_to_parent(frame.pose, f);
  if (p.q.size() > 0 && frame.flexible) {
    p.Mre += XtI.lazyProduct(frame.B);
    p.scratch.noalias() = (0.5 * I).lazyProduct(frame.B);
    add_symmetric(frame.B, p.scratch, p.Mee);
    add_dots(frame.B, f, p.fe);
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
    if (o.flexible)
      for (int k = 0; k < part.body.n; ++k) p.C.col(k) = -to_parent(o.pose, o.B.col(k));
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
      p.Fj.noalias() = p.Mrr.lazyProduct(p.Hj);
      cw.M.block(jv, jv, nj, nj).noalias() = p.Hj.transpose().lazyProduct(p.Fj);
      for (int k = 0; k < nj; ++k) cw.r[jv + k] = p.Hj.col(k).dot(p.fr) - p.tau[k];
    }
    if (n > 0) {
      auto Mee = cw.M.block(ev, ev, n, n);
      Mee = p.Mee;
      cw.r.segment(ev, n) = p.fe;
      if (o.flexible) {
        // Mee + C^T Mre + Mre^T C + C^T Mrr C.
        p.scratch.noalias() = p.Mrr.lazyProduct(p.C);
        p.Fe = p.Mre + p.scratch;
        p.scratch = p.Mre + 0.5 * p.scratch;
        add_symmetric(p.C, p.scratch, Mee);
        add_dots(p.C, p.fr, cw.r.segment(ev, n));
      } else {
        p.Fe = p.Mre;
      }
      for (int j = 0; j < nj; ++j)
        for (int k = 0; k < n; ++k) cw.M(ev + k, jv + j) = cw.M(jv + j, ev + k) = p.Hj.col(j).dot(p.Fe.col(k));
    }

    // Towards the base: this part's columns on its ancestors' coordinates, its composite on its parent.
    const Mat6 Y = child_matrix(p.step);
    Mat6X& F = p.F;
    for (int k = 0; k < nj; ++k) F.col(k) = wrench_to_parent(p.step, p.Fj.col(k));
    for (int k = 0; k < n; ++k) F.col(nj + k) = wrench_to_parent(p.step, p.Fe.col(k));
    const Mat6 IA = Y.transpose().lazyProduct(Mat6(p.Mrr.lazyProduct(Y)));
    const Vec6 fA = wrench_to_parent(p.step, p.fr);
    int child = i;
    // An entry of the mass matrix between a coordinate of an ancestor and column k of F.
    const auto write = [&](int row, int k, double value) {
      const int column = k < nj ? jv + k : ev + k - nj;
      cw.M(row, column) = cw.M(column, row) = value;
    };
    for (int a = part.parent; a != ground && model.parts[a].cluster == cluster; a = model.parts[a].parent) {
      const Part& pa = model.parts[a];
      PartWork& pw = work.parts[a];
      const FrameWork& f = work.frames[model.parts[child].joint.inboard];
      const bool turns = work.frames[pa.joint.outboard].flexible;
      if (child == i) add_at_frame(f, IA, fA, pw);
      const int aj = pa.v0 - c.v0, ae = pa.ev0 - c.v0;
      for (int k = 0; k < nj + n; ++k) {
        const Vec6 here = F.col(k), on_part = wrench_to_parent(f.pose, here);
        for (int j = 0; j < pa.joint.nv; ++j) write(aj + j, k, pw.Hj.col(j).dot(on_part));
        for (int j = 0; j < pa.body.n; ++j)
          write(ae + j, k, (f.flexible ? f.B.col(j).dot(here) : 0.0) + (turns ? pw.C.col(j).dot(on_part) : 0.0));
        F.col(k) = wrench_to_parent(pw.step, on_part);
      }
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
    const Pose& in = c.entry[e];
    for (int k = 0; k < nj; ++k) cw.Ib.col(jv + k) = wrench_to_parent(in, F.col(k));
    for (int k = 0; k < n; ++k) cw.Ib.col(ev + k) = wrench_to_parent(in, F.col(nj + k));
    if (outside) {
      const Mat6 X = child_matrix(in);
      cw.Ibb.noalias() += X.transpose() * IA * X;
      cw.pb += wrench_to_parent(in, fA);
    }
  }
}

// A pivot that cancels to 1e-14 of its diagonal, or is not positive, is a coordinate without inertia.
bool has_inertia(const ClusterWork& cw, Eigen::Index k) {
  const auto& L = cw.llt.matrixLLT();
  return cw.llt.info() == Eigen::Success && cw.D(k, k) > 0.0 && L(k, k) * L(k, k) > 1e-14 * cw.D(k, k);
}

bool has_inertia(const ClusterWork& cw) {
  for (Eigen::Index k = 0; k < cw.D.rows(); ++k)
    if (!has_inertia(cw, k)) return false;
  return true;
}

// What turns without inertia and without a moment, a thin rod about itself or a point mass on a ball, keeps its rate: there (D v = 0, v . h
// = 0) the matrix gets an inertia of its own, which changes no other acceleration. False where something drives it, where a body at the end
// of a tree has no mass at all, and where the kinetic energy is not positive.
bool hold_idle(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const std::vector<int>& ind = cw.partition.ind;
  const Eigen::Index n = cw.D.rows();
  VecX per_metre(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double scale = rate_scale(model, cluster, ind[k]);
    if (scale == 0.0) return false;  // deformations
    per_metre[k] = 1.0 / scale;
  }
  const SymmetricEigen eigen(MatX(per_metre.asDiagonal() * cw.D * per_metre.asDiagonal()));
  const double largest = eigen.eigenvalues()[n - 1];
  if (!(largest > 0.0) || eigen.eigenvalues()[0] < -1e-12 * largest) return false;
  const VecX force = per_metre.cwiseProduct(cw.h);
  double size = force.cwiseAbs().maxCoeff();
  for (int i : c.parts) size = std::max({size, work.parts[i].fr.head<3>().norm(), work.parts[i].fr.tail<3>().norm() / c.size});
  for (Eigen::Index e = 0; e < n && eigen.eigenvalues()[e] <= 1e-14 * largest; ++e) {
    const VecX v = eigen.eigenvectors().col(e);
    if (std::abs(v.dot(force)) > 1e-9 * size) return false;
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      if (!c.loops.empty() || work.parts[i].Mrr.topLeftCorner<3, 3>().trace() > 0.0) continue;
      for (Eigen::Index k = 0; k < n; ++k)
        if (c.v0 + ind[k] >= p.v0 && c.v0 + ind[k] < p.v0 + p.joint.nv && std::abs(v[k]) > 1e-6) return false;
    }
    const VecX u = v.cwiseQuotient(per_metre);
    cw.D += largest * u * u.transpose();
  }
  cw.llt.compute(cw.D);
  work.idle = has_inertia(cw);
  return work.idle;
}

[[noreturn]] void refuse_singular(const Model& model, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const int ni = static_cast<int>(cw.partition.ind.size());
  // Where the factorisation broke off, the coordinate that moves most in the direction of least inertia is to blame.
  Eigen::Index blamed = -1;
  if (cw.llt.info() != Eigen::Success) {
    const VecX unit = cw.D.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const SymmetricEigen eigen(MatX(unit.asDiagonal() * cw.D * unit.asDiagonal()));
    VecX least = eigen.eigenvectors().col(0).cwiseAbs();
    // Rigid motions have no negative energy: then it is a deformation, however much joints move along with it.
    if (eigen.eigenvalues()[0] < -1e-9)
      for (Eigen::Index k = 0; k < ni; ++k)
        if (rate_scale(model, cluster, cw.partition.ind[static_cast<size_t>(k)]) > 0.0) least[k] = 0.0;
    least.maxCoeff(&blamed);
  }
  for (int k = 0; k < ni; ++k) {
    if (blamed >= 0 ? k != blamed : has_inertia(cw, k)) continue;
    const int v = c.v0 + cw.partition.ind[k];
    int part = -1;
    bool elastic = false;
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      if (v >= p.v0 && v < p.v0 + p.joint.nv) part = i;
      if (v >= p.ev0 && v < p.ev0 + p.body.n) part = i, elastic = true;
    }
    const Part& p = model.parts[part];
    // What a deformation had of inertia at rest, only deformation takes away.
    if (elastic && p.body.Me(v - p.ev0, v - p.ev0) > 0.0) {
      work.indefinite = part;
      throw SimulationError(fmt::format(
          "the kinetic energy of elastic coordinate {} of body '{}' is no longer positive at t = {:.6g} s: its deformation is too large "
          "for second-order displacements; use model = \"mixed\" with more volumes, fewer modes (keep_modes), or leave out stiffening",
          v - p.ev0 + 1, p.name, work.time));
    }
    throw SimulationError(fmt::format(
        "a load acts on {}, which moves without inertia, at t = {:.6g} s: give the bodies that it moves mass or inertia, or fix the joint",
        elastic ? fmt::format("elastic coordinate {} of body '{}'", v - p.ev0 + 1, p.name) : fmt::format("joint '{}'", p.joint.name),
        work.time));
  }
  throw SimulationError(fmt::format("the mass matrix of '{}' is singular at t = {:.6g} s", model.parts[c.parts.front()].name, work.time));
}

// Projects on the independent rates and factorises.
void reduce_cluster(const Model& model, int cluster, Work& work) {
  ClusterWork& cw = work.clusters[cluster];
  const Partition& part = cw.partition;
  const int nd = static_cast<int>(part.dep.size()), ni = static_cast<int>(part.ind.size());
  if (nd == 0) {
    cw.D = cw.M;
    cw.U = cw.Ib;
    cw.h = -cw.r;
  } else {
    // D = N^T M N with N = [1; E]; h = -N^T (r + M [0; gamma]).
    cw.D.resize(ni, ni);
    cw.U.resize(6, ni);
    cw.h.resize(ni);
    cw.Mid.resize(ni, nd);
    cw.T.resize(nd, ni);
    cw.Et = cw.E.transpose();
    for (int d = 0; d < nd; ++d)
      for (int i = 0; i < ni; ++i) cw.Mid(i, d) = cw.M(part.ind[i], part.dep[d]);
    cw.T = cw.Mid.transpose();
    for (int d = 0; d < nd; ++d)
      for (int e = 0; e < nd; ++e) {
        const double m = cw.M(part.dep[d], part.dep[e]);
        for (int i = 0; i < ni; ++i) cw.T(d, i) += m * cw.Et(i, e);
      }
    for (int k = 0; k < ni; ++k) {
      const int column = part.ind[k], left = ni - k;
      double* const D = &cw.D(0, k);
      const double* const M = &cw.M(0, column);
      for (int i = k; i < ni; ++i) D[i] = M[part.ind[i]];
      for (int d = 0; d < nd; ++d) cw.D.col(k).tail(left) += cw.T(d, k) * cw.Et.col(d).tail(left) + cw.E(d, k) * cw.Mid.col(d).tail(left);
      for (int i = k + 1; i < ni; ++i) cw.D(k, i) = D[i];
      cw.U.col(k) = cw.Ib.col(column);
      cw.h[k] = -cw.r[column];
    }
    for (int d = 0; d < nd; ++d) {
      const Vec6 Ud = cw.Ib.col(part.dep[d]);
      double rd = cw.r[part.dep[d]];
      for (int e = 0; e < nd; ++e) rd += cw.M(part.dep[d], part.dep[e]) * cw.gamma[e];
      for (int k = 0; k < ni; ++k) cw.U.col(k) += Ud * cw.E(d, k);
      cw.h -= cw.Et.col(d) * rd + cw.Mid.col(d) * cw.gamma[d];
      cw.pb += Ud * cw.gamma[d];
    }
  }
  if (ni == 0) return;
  cw.llt.compute(cw.D);
  if (!has_inertia(cw)) {
    if (hold_idle(model, cluster, work)) return;
    refuse_singular(model, cluster, work);
  }
}

}  // namespace
void update_expressions(Model& model, double t, Work& work) {
  work.time = t;
  for (const Load& load : model.loads)
    if (load.expression >= 0) work.expression_value[load.expression] = model.expressions[load.expression].value(t);
  for (const Part& part : model.parts)
    if (part.joint.motion >= 0) work.motion[part.joint.motion] = model.expressions[part.joint.motion].jet(t);
  if (model.massless.rates.empty()) return;
  work.expression_rate.assign(model.expressions.size(), 0.0);
  for (const Load& load : model.loads)
    if (load.expression >= 0 && !load.table) work.expression_rate[load.expression] = model.expressions[load.expression].jet(t).rate;
}

void update_positions(const Model& model, Work& work, bool elastic_masses) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    close_positions(model, static_cast<int>(c), work);
    update_cluster_world(model, static_cast<int>(c), work);
  }
  for (size_t i = 0; i < model.parts.size(); ++i)
    update_mass(kinetics(model, work, static_cast<int>(i)), work.parts[i].q, work.parts[i].terms, elastic_masses);
  if (!model.massless.rates.empty()) balance_positions(model, work);
}

void update_velocities(const Model& model, Work& work) {
  for (ClusterWork& cw : work.clusters) cw.lock_rate.setZero();
  for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
  if (!model.massless.rates.empty()) balance_velocities(model, work);
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
    update_base_acceleration(model, static_cast<int>(at), work);
    const int ni = static_cast<int>(cw.partition.ind.size()), nd = static_cast<int>(cw.partition.dep.size());
    VecX& a = cw.a;
    a = cw.h;
    if (ni > 0) {
      for (int k = 0; k < ni; ++k) a[k] -= cw.U.col(k).dot(cw.base_A);
      cw.llt.solveInPlace(a);
    }
    for (int k = 0; k < ni; ++k) cw.wdot[cw.partition.ind[k]] = a[k];
    if (nd > 0) {
      for (int k = 0; k < nd; ++k) cw.wdot[cw.partition.dep[k]] = cw.gamma[k] + (ni > 0 ? cw.E.row(k).dot(a) : 0.0);
    }
    work.wdot.segment(c.v0, c.nv) = cw.wdot;
    update_cluster_accelerations(model, static_cast<int>(at), work);
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
  }
  e.strain += flexure_energy(model, work, scene_body);
  if (scene_body < 0) e.potential += spring_energy(model, work);
  return e;
}

}  // namespace flexframe::sim
