#include "sim/dynamics/dynamics.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/four.h"
#include "sim/base/sized.h"
#include "sim/bodies/rigid_terms.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/few_rates.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loads.h"
#include "sim/dynamics/places.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/dynamics/velocities.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace flexframe::sim {
namespace {

// Whether a cluster stands on ground: nothing asks what it weighs there, and gravity acts on its parts themselves instead of through its
// base.
bool stands_on_ground(const Model& model, int cluster) { return model.clusters[cluster].parent == ground; }

// Whether a cluster's equation is a number: that of a link (Carrying) which moves.
bool is_link(const Carrying& carries, int cluster, const ClusterWork& cw) { return carries.link[cluster] && cw.partition.ind.size() == 1; }

// A0 of a part, with gravity where its cluster stands on ground.
template <class W>
FLEXFRAME_INLINE typename W::In::Twist falling(const Model& model, const W& work, int part) {
  using S = typename W::In;
  typename S::Twist A = work.parts[part].A0;
  if (!stands_on_ground(model, model.parts[part].cluster)) return A;
  A.template head<S::linear>() -= turn_back(work.parts[part].world, typename S::Linear(gravity(model, work)));
  return A;
}

// Coupling and forces of a part's own coordinates, N as in sized.h.
template <int N, class S>
FLEXFRAME_INLINE void start_elastic(const typename S::Twist& A0, PartMotion<S>& p) {
  sized_columns<N>(p.Mre) = sized_columns<N>(p.terms.Mre);
  sized<N>(p.fe) = sized<N>(p.terms.ce) + sized<N>(p.elastic) - sized<N>(p.load_e) + dots_sized<N>(p.terms.Mre, A0);
}

// Own inertia, velocity terms and applied loads of every part; child clusters and parts are added on the way down.
template <class W>
FLEXFRAME_INLINE void start_composites(const Model& model, W& work) {
  const bool weightless = gravity(model, work).isZero(0.0);
  for (size_t at = 0; at < model.parts.size(); ++at) {
    const int i = static_cast<int>(at);
    auto& p = work.parts[at];
    const auto& body = kinetic_body(model, work, i);
    if (body.n == 0 && !body.rod) rigid_velocity_terms(p.V, p.terms);
    else update_velocity_terms(body, p.V, p.qd, p.terms);
    p.Mrr = p.terms.Mrr;
    p.fr = p.terms.cr - p.load;
    const typename W::In::Twist A0 = weightless ? p.A0 : falling(model, work, i);
    p.fr.noalias() += p.terms.Mrr * A0;
    if (body.n > 0) {
      elastic_force(elastic_body(model, work, i), p.q, p.qd, p.elastic);
      if (work.carrying.elastic[at]) {
        const MatX& own = elastic_mass(body, p.terms);
        std::copy_n(own.data(), own.size(), p.Mee.data());
      }
      by_larger_count(
          body.n, [&](auto n) __attribute__((always_inline)) { start_elastic<n()>(A0, p); });
    }
    const TreeJoint& j = model.parts[at].joint;
    if (j.spring || j.stop || work.joints[at].friction.size() > 0) joint_forces(model.parts[at], work.joints[at], work.q, work.w, p.tau);
    else if (j.nv == 1) p.tau[0] = 0.0;
    else p.tau.setZero();
  }
  if (!model.flexures.empty()) add_flexure_moments(model, work);
}

// Adds the inertia I and the force f, both at a frame (frame axes), to the composite of the frame's part.
template <class S>
FLEXFRAME_INLINE void add_at_frame(const FrameMotion<S>& frame, const typename S::Inertia& I, const typename S::Twist& f,
                                   PartMotion<S>& p) {
  p.Mrr += inertia_at_parent(frame.pose, I);
  p.fr += wrench_to_parent(frame.pose, f);
  if (p.q.size() == 0 || !frame.flexible) return;
  const Eigen::Index n = p.q.size();
  set_momenta(I, frame.B, p.scratch);
  // F has room for a column a coordinate.
  place_columns(p.scratch, n, p.F, 0);
  wrenches_to_parent(frame.pose, p.F, n);
  add_columns(p.F, n, p.Mre);
  p.scratch *= 0.5;
  add_symmetric(frame.B, p.scratch, p.Mee, 0);
  add_dots(frame.B, f, p.fe.data());
}

// Adds the composite of a part to that of the one on whose rigid frame it hangs.
template <class S>
FLEXFRAME_INLINE void add_rigidly(const PartMotion<S>& part, PartMotion<S>& carrier) {
  carrier.Mrr += inertia_at_parent(part.in_carrier, part.Mrr);
  carrier.fr += wrench_to_parent(part.in_carrier, part.fr);
}

// The block of M of a part's own coordinates, their bias, and their wrenches on the part: Fj, Fe.
template <class S>
FLEXFRAME_INLINE void own_block(const Part& part, const Cluster& c, const FrameMotion<S>& o, const MatX& Mee, PartMotion<S>& p,
                                ClusterWork& cw) {
  const int nj = part.joint.nv, n = part.body.n, jv = part.v0 - c.v0, ev = part.ev0 - c.v0;
  if (nj > 0) {
    set_momenta(p.Mrr, p.Hj, p.Fj);
    for (int k = 0; k < nj; ++k) {
      const typename S::Twist h = column(p.Hj, k);
      for (int i = k; i < nj; ++i) cw.M(jv + i, jv + k) = column(p.Hj, i).dot(column(p.Fj, k));
      cw.r[jv + k] = h.dot(p.fr) - p.tau[k];
    }
  }
  if (n == 0) return;
  for (int k = 0; k < n; ++k) copy_fours(&Mee(k, k), n - k, &cw.M(ev + k, ev + k));
  cw.r.segment(ev, n) = p.fe;
  if (o.flexible) {
    // Mee + C^T Mre + Mre^T C + C^T Mrr C.
    set_momenta(p.Mrr, p.C, p.scratch);
    p.Fe = p.Mre + p.scratch;
    p.scratch = p.Mre + 0.5 * p.scratch;
    add_symmetric(p.C, p.scratch, cw.M, ev);
    add_dots(p.C, p.fr, cw.r.data() + ev);
  } else {
    p.Fe = p.Mre;
  }
  for (int j = 0; j < nj; ++j) set_dots(p.Fe, n, column(p.Hj, j), cw.M, ev, jv + j);
}

// Mass matrix (lower half) and bias of a cluster by composite bodies (Featherstone 2008 sec. 6.2, with elastic coordinates), and of one
// that is carried its base coupling. Blocks that are never written stay zero from make_work.
template <class W>
FLEXFRAME_INLINE void assemble_cluster(const Model& model, int cluster, W& work) {
  using S = typename W::In;
  const Cluster& c = model.clusters[cluster];
  const Carrying& carries = work.carrying;
  ClusterWork& cw = work.clusters[cluster];
  BaseMotion<S>& base = work.bases[cluster];
  const bool carried = !stands_on_ground(model, cluster);
  const bool weighs = carried && carries.moves[c.parent];
  if (weighs) base.Ibb.setZero(), base.pb.setZero();
  for (size_t at = c.parts.size(); at-- > 0;) {
    const int i = c.parts[at];
    const Part& part = model.parts[i];
    PartMotion<S>& p = work.parts[i];
    const MatX& Mee = carries.elastic[i] ? p.Mee : elastic_mass(kinetic_body(model, work, i), p.terms);
    own_block(part, c, work.frames[part.joint.outboard], Mee, p, cw);
    const int nj = part.joint.nv, n = part.body.n, jv = part.v0 - c.v0, columns = nj + n;
    if (!carried && !(hangs_inside(model, i) && carries.moves[part.parent])) continue;

    // Towards the base: this part's columns on its ancestors' coordinates, its composite on its parent.
    typename S::Columns& F = p.F;
    place_columns(p.Fj, nj, F, 0);
    place_columns(p.Fe, n, F, nj);
    int child = i;
    for (int a = part.parent; a != ground && model.parts[a].cluster == cluster; a = model.parts[a].parent) {
      const Part& pa = model.parts[a];
      PartMotion<S>&pw = work.parts[a], &pc = work.parts[child];
      const FrameMotion<S>& f = work.frames[model.parts[child].joint.inboard];
      const int aj = pa.v0 - c.v0, ae = pa.ev0 - c.v0;
      const bool adds = child == i && carries.moves[a];
      // Rows of M: this part's coordinates come after its ancestors'.
      if (f.flexible) {
        if (adds) add_at_frame(f, inertia_at_parent(p.step, p.Mrr), typename S::Twist(wrench_to_parent(p.step, p.fr)), pw);
        wrenches_to_parent(pc.step, F, columns);
        set_outer(F, columns, f.B, cw.M, jv, ae);
        wrenches_to_parent(f.pose, F, columns);
      } else {
        if (adds) add_rigidly(p, pw);
        wrenches_to_parent(pc.in_carrier, F, columns);
      }
      for (int j = 0; j < pa.joint.nv; ++j) set_dots(F, columns, column(pw.Hj, j), cw.M, jv, aj + j);
      if (work.frames[pa.joint.outboard].flexible) {
        if (f.flexible) add_outer(F, columns, pw.C, cw.M, jv, ae);
        else set_outer(F, columns, pw.C, cw.M, jv, ae);
      }
      child = a;
    }
    if (!carried) continue;
    wrenches_to_parent(work.parts[child].in_base, F, columns);
    place_columns(F, columns, base.Ib, jv);
    if (child != i || !weighs) continue;
    base.Ibb += inertia_at_parent(p.in_base, p.Mrr);
    base.pb += wrench_to_parent(p.in_base, p.fr);
  }
}

// A pivot that cancels to 1e-14 of its diagonal, or is not positive, is a coordinate without inertia.
bool has_inertia(const ClusterWork& cw, Eigen::Index k) { return cw.inertia[k] > 0.0 && cw.L(k, k) * cw.L(k, k) > 1e-14 * cw.inertia[k]; }

bool has_inertia(const ClusterWork& cw) {
  for (Eigen::Index k = 0; k < cw.L.rows(); ++k)
    if (!has_inertia(cw, k)) return false;
  return true;
}

// What turns without inertia and without a moment, a thin rod about itself or a point mass on a ball, keeps its rate: there (D v = 0, v . h
// = 0) the matrix gets an inertia of its own, which changes no other acceleration. False where something drives it, where a body at the end
// of a tree has no mass at all, and where the kinetic energy is not positive. beside: masses beside which an inertia is rounding
// (idle_mass).
template <class W>
bool hold_idle(const Model& model, int cluster, MatX D, double beside, W& work) {
  constexpr int linear = W::In::linear;
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const std::vector<int>& ind = cw.partition.ind;
  const Eigen::Index n = D.rows();
  VecX per_metre(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double scale = rate_scale(model, cluster, ind[k]);
    if (scale == 0.0) return false;  // deformations
    per_metre[k] = 1.0 / scale;
  }
  const SymmetricEigen eigen(MatX(per_metre.asDiagonal() * D * per_metre.asDiagonal()));
  const double largest = eigen.eigenvalues()[n - 1];
  if (!(largest >= -idle_share * beside) || eigen.eigenvalues()[0] < -1e-12 * std::max(largest, beside)) return false;
  const VecX force = per_metre.cwiseProduct(cw.h);
  double size = force.cwiseAbs().maxCoeff();
  for (int i : c.parts)
    size =
        std::max({size, work.parts[i].fr.template head<linear>().norm(), work.parts[i].fr.template tail<W::In::angular>().norm() / c.size});
  const double lent = std::max(largest, beside), none = std::max(1e-14 * largest, idle_share * beside);
  for (Eigen::Index e = 0; e < n && eigen.eigenvalues()[e] <= none; ++e) {
    const VecX v = eigen.eigenvectors().col(e);
    if (std::abs(v.dot(force)) > 1e-9 * size) return false;
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      if (has_closure(c) || work.parts[i].Mrr.template topLeftCorner<linear, linear>().trace() > 0.0) continue;
      for (Eigen::Index k = 0; k < n; ++k)
        if (c.v0 + ind[k] >= p.v0 && c.v0 + ind[k] < p.v0 + p.joint.nv && std::abs(v[k]) > 1e-6) return false;
    }
    const VecX u = v.cwiseQuotient(per_metre);
    D += (lent > 0.0 ? lent : 1.0) * u * u.transpose();
  }
  cw.inertia = D.diagonal();
  work.idle = cholesky(D, cw.L) && has_inertia(cw);
  return work.idle;
}

// D: the mass matrix.
template <class W>
[[noreturn]] void refuse_singular(const Model& model, int cluster, const MatX& D, W& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const int ni = static_cast<int>(cw.partition.ind.size());
  cw.inertia = D.diagonal();
  // Where the factorisation broke off, the coordinate that moves most in the direction of least inertia is to blame.
  Eigen::Index blamed = -1;
  const Eigen::LLT<MatX> llt(D);
  cw.L = llt.matrixL();
  if (llt.info() != Eigen::Success) {
    const VecX unit = D.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const SymmetricEigen eigen(MatX(unit.asDiagonal() * D * unit.asDiagonal()));
    VecX least = eigen.eigenvectors().col(0).cwiseAbs();
    // Rigid motions have no negative energy: then it is a deformation, however much joints move along with it.
    if (eigen.eigenvalues()[0] < -1e-9)
      for (Eigen::Index k = 0; k < ni; ++k)
        if (rate_scale(model, cluster, cw.partition.ind[k]) > 0.0) least[k] = 0.0;
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
    const std::string what =
        elastic ? fmt::format("elastic coordinate {} of body '{}'", v - p.ev0 + 1, p.name) : fmt::format("joint '{}'", p.joint.name);
    throw SimulationError(
        fmt::format("{} without inertia, at t = {:.6g} s: give the bodies that it moves mass or inertia, or fix the joint",
                    cw.h[k] != 0.0 ? fmt::format("a load acts on {}, which moves", what) : what + " moves", work.time));
  }
  throw SimulationError(fmt::format("the mass matrix of '{}' is singular at t = {:.6g} s", model.parts[c.parts.front()].name, work.time));
}

// Lower half of N^T M N with N = [1; E], by E^T and the products with M that `project` leaves in T and Mid.
void project_mass(const ClusterWork& cw, MatX& D) {
  const Eigen::Index ni = static_cast<Eigen::Index>(cw.partition.ind.size());
  D.resize(ni, ni);
  for (Eigen::Index k = 0; k < ni; ++k) {
    // Independent rates are ascending: between the dependent ones they are copied as they lie.
    const double* const M = &cw.M(0, cw.partition.ind[k]);
    double* to = &D(0, k);
    for (const auto& [from, count] : cw.plan.runs) to = std::copy(M + from, M + from + count, to);
  }
  add_products(cw.T, cw.Et, cw.Mid, D);
}

// Forces on the independent rates, h = -N^T (r + M [0; gamma]), and of a cluster that is carried the base coupling, U = N^T Ib.
template <class S>
FLEXFRAME_INLINE void project(ClusterWork& cw, bool carried, BaseMotion<S>& base) {
  const std::vector<int>&dep = cw.partition.dep, &ind = cw.partition.ind;
  const Eigen::Index nd = static_cast<Eigen::Index>(dep.size()), ni = static_cast<Eigen::Index>(ind.size());
  if (nd == 0) {
    if (carried) base.U = base.Ib;
    cw.h = -cw.r;
    return;
  }
  cw.h.resize(ni);
  cw.Mid.resize(ni, nd);
  cw.T.resize(ni, nd);
  cw.Et.resize(ni, nd);
  double* const h = cw.h.data();
  for (Eigen::Index k = 0; k < ni; ++k) h[k] = -cw.r[ind[k]];
  const Eigen::Index nv = cw.M.rows();
  for (Eigen::Index d = 0; d < nd; ++d) {
    const int at = dep[d];
    // The row before the diagonal, the column from there on.
    const double *const row = &cw.M(at, 0), *const column = &cw.M(0, at);
    double *const mid = cw.Mid.data() + d * ni, *const t = cw.T.data() + d * ni, *const e = cw.Et.data() + d * ni;
    for (Eigen::Index i = 0; i < ni; ++i) {
      mid[i] = t[i] = ind[i] < at ? row[ind[i] * nv] : column[ind[i]];
      e[i] = cw.E(d, i);
    }
  }
  for (Eigen::Index d = 0; d < nd; ++d) {
    double rd = cw.r[dep[d]];
    double *const t = cw.T.data() + d * ni, *const mid = cw.Mid.data() + d * ni, *const own = cw.Et.data() + d * ni;
    for (Eigen::Index k = 0; k < nd; ++k) {
      const double m = dep[d] >= dep[k] ? cw.M(dep[d], dep[k]) : cw.M(dep[k], dep[d]);
      const double* const e = cw.Et.data() + k * ni;
      rd += m * cw.gamma[k];
      for (Eigen::Index i = 0; i < ni; ++i) t[i] += m * e[i];
    }
    const double gamma = cw.gamma[d];
    for (Eigen::Index i = 0; i < ni; ++i) h[i] -= own[i] * rd + mid[i] * gamma;
  }
  if (!carried) return;
  size_columns(base.U, ni);
  for (Eigen::Index k = 0; k < ni; ++k) column(base.U, k) = column(base.Ib, ind[k]);
  for (Eigen::Index d = 0; d < nd; ++d) {
    const typename S::Twist Ud = column(base.Ib, dep[d]);
    add_multiples(Ud, cw.Et.col(d), base.U);
    base.pb += Ud * cw.gamma[d];
  }
}

// Projects on the independent rates and factorises.
template <class W>
FLEXFRAME_INLINE void reduce_cluster(const Model& model, int cluster, W& work) {
  ClusterWork& cw = work.clusters[cluster];
  project(cw, !stands_on_ground(model, cluster), work.bases[cluster]);
  if (cw.partition.ind.empty()) return;
  static thread_local MatX projected;
  if (!cw.partition.dep.empty()) project_mass(cw, projected);
  const MatX& mass = cw.partition.dep.empty() ? cw.M : projected;
  cw.inertia = mass.diagonal();
  double idle_beside = cw.partition.dep.empty() ? 0.0 : idle_mass(model, cluster, cw);
  if (idle_beside > 0.0 && !has_thin_body(model, cluster)) idle_beside = 0.0;
  if (cholesky(mass, cw.L) && has_inertia(cw) && idle_beside == 0.0) return;
  MatX D = mass;
  D.triangularView<Eigen::StrictlyUpper>() = D.transpose();
  if (hold_idle(model, cluster, D, idle_beside, work)) return;
  refuse_singular(model, cluster, D, work);
}

}  // namespace

void reduced_mass(const ClusterWork& cw, MatX& D) {
  if (!cw.whole) {
    // Above its diagonal a factor may have anything.
    static thread_local MatX L;
    L = cw.L.triangularView<Eigen::Lower>();
    D.noalias() = L * L.transpose();
    return;
  }
  if (cw.partition.dep.empty()) D = cw.M;
  else project_mass(cw, D);
  for (Eigen::Index c = 1; c < D.cols(); ++c)
    for (Eigen::Index r = 0; r < c; ++r) D(r, c) = D(c, r);
}

void update_expressions(Model& model, double t, Work& work) {
  work.time = t;
  for (const Load& load : model.loads)
    if (load.expression >= 0) work.expression_value[load.expression] = model.expressions[load.expression].value(t);
  for (const int i : work.carrying.following) {
    const int motion = model.parts[i].joint.motion;
    work.motion[motion] = model.expressions[motion].jet(t);
  }
  if (work.expression_rate.empty()) return;  // nobody asked for them
  for (const Load& load : model.loads)
    if (load.expression >= 0 && !load.table) work.expression_rate[load.expression] = model.expressions[load.expression].jet(t).rate;
}

namespace {

// rates: what closes those of loops too.
template <class W>
void place_clusters(const Model& model, W& work, bool rates) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const int cluster = static_cast<int>(c);
    // A link has nothing to close and nothing that deforms.
    if (is_link(work.carrying, cluster, work.clusters[c])) update_cluster_chain(model, cluster, work);
    else if (rates) close_positions(model, cluster, work);
    else close_places(model, cluster, work);
    update_cluster_world(model, cluster, work);
  }
}

}  // namespace

template <class W>
void update_places(const Model& model, W& work) {
  place_clusters(model, work, false);
}

template <class W>
void update_positions(const Model& model, W& work, bool elastic_masses) {
  place_clusters(model, work, true);
  // Of rigid parts it never changes (reserve).
  for (const int i : work.carrying.deforming)
    update_mass(kinetic_body(model, work, i), work.parts[i].q, work.parts[i].terms, elastic_masses);
}

template <class W>
void update_velocities(const Model& model, W& work) {
  for (ClusterWork& cw : work.clusters)
    if (cw.lock_rate.size() > 0) cw.lock_rate.setZero();
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const int cluster = static_cast<int>(c);
    if (is_link(work.carrying, cluster, work.clusters[c])) update_cluster_velocities(model, cluster, work);
    else close_velocities(model, cluster, work);
  }
}

template <class W>
void update_velocities_alone(const Model& model, W& work) {
  for (ClusterWork& cw : work.clusters) cw.lock_rate.setZero();
  for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities_alone(model, static_cast<int>(c), work);
}

namespace {

// Articulated inertia and bias of the cluster at its base frame, added to the part that carries it.
template <class W>
FLEXFRAME_INLINE void add_to_carrier(const Model& model, int cluster, W& work) {
  using S = typename W::In;
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  BaseMotion<S>& base = work.bases[cluster];
  typename S::Inertia IA = base.Ibb;
  typename S::Twist pA = base.pb;
  if (!cw.partition.ind.empty()) reduce_inertia(cw.L, base.U, cw.h, cw.DinvUt, IA, pA);
  const FrameMotion<S>& f = work.frames[c.base];
  PartMotion<S>& carrier = work.parts[c.parent];
  pA.noalias() += IA * (to_child(f.pose, falling(model, work, c.parent)) + f.bias);
  add_at_frame(f, IA, pA, carrier);
}

// assemble_cluster, reduce_cluster and, where it weighs on what carries it, add_to_carrier of a link, in the axes of its part and of its
// carrier. False where it has no inertia.
template <class W>
FLEXFRAME_INLINE bool reduce_link(const Model& model, int cluster, bool weighs, W& work) {
  using S = typename W::In;
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  PartMotion<S>& p = work.parts[c.parts.front()];
  const typename S::Twist h = column(p.Hj, 0);
  const typename S::Twist F = p.Mrr.lazyProduct(h);
  const double inertia = h.dot(F), force = p.tau[0] - h.dot(p.fr);
  if (!(inertia > 0.0)) return false;
  if (cw.L.rows() != 1 || cw.inertia.size() != 1 || cw.h.size() != 1) {
    cw.L.resize(1, 1);
    cw.inertia.resize(1);
    cw.h.resize(1);
  }
  column(p.Fj, 0) = F;
  cw.M(0, 0) = cw.inertia[0] = inertia;
  cw.h[0] = force;
  cw.r[0] = -force;
  cw.L(0, 0) = std::sqrt(inertia);
  if (!weighs) return true;
  const typename S::Inertia IA = p.Mrr - F.lazyProduct((F / inertia).transpose());
  const typename S::Twist pA = p.fr + F * (force / inertia), A0 = falling(model, work, c.parent);
  const FrameMotion<S>& f = work.frames[c.base];
  PartMotion<S>& carrier = work.parts[c.parent];
  if (f.flexible) {
    const typename S::Inertia at_base = inertia_at_parent(p.in_base, IA);
    const typename S::Twist A = to_child(f.pose, A0) + f.bias;
    add_at_frame(f, at_base, typename S::Twist(wrench_to_parent(p.in_base, pA) + at_base.lazyProduct(A)), carrier);
    return true;
  }
  const typename S::Inertia at_carrier = inertia_at_parent(p.in_carrier, IA);
  carrier.Mrr += at_carrier;
  carrier.fr += wrench_to_parent(p.in_carrier, pA) + at_carrier.lazyProduct(A0);
  return true;
}

// The acceleration of such a link, and with it that of its part.
template <class W>
FLEXFRAME_INLINE void solve_link(const Model& model, int cluster, W& work) {
  const Cluster& c = model.clusters[cluster];
  const ClusterWork& cw = work.clusters[cluster];
  const int i = c.parts.front();
  auto& p = work.parts[i];
  using Twist = typename W::In::Twist;
  const bool rigidly = c.parent != ground && !work.frames[c.base].flexible;
  const Twist carried = rigidly ? Twist(to_child(p.in_carrier, work.parts[c.parent].A)) : carried_acceleration(model, work, i);
  const double force = c.parent == ground ? cw.h[0] : cw.h[0] - carried.dot(column(p.Fj, 0));
  work.wdot[c.v0] = force / cw.inertia[0];
  p.A = carried + p.own + column(p.Hj, 0) * work.wdot[c.v0];
}

// Accelerations of a cluster's coordinates, once its carrier's are known.
template <class W>
FLEXFRAME_INLINE void solve_cluster(const Model& model, int cluster, W& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const auto& base = work.bases[cluster];
  const int ni = static_cast<int>(cw.partition.ind.size()), nd = static_cast<int>(cw.partition.dep.size());
  VecX& a = cw.a;
  a = cw.h;
  if (ni > 0) {
    if (c.parent != ground) subtract_dots(base.U, base.A, a.data());
    solve(cw.L, a.data());
  }
  for (int k = 0; k < ni; ++k) work.wdot[c.v0 + cw.partition.ind[k]] = a[k];
  for (int k = 0; k < nd; ++k) work.wdot[c.v0 + cw.partition.dep[k]] = cw.gamma[k] + (ni > 0 ? cw.E.row(k).dot(a) : 0.0);
}

// Whether motions drive rigid parts on ground only, and nothing but links hangs on these: a rotor.
bool feeds_at_root(const Model& model, const Carrying& carries) {
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const Cluster& c = model.clusters[k];
    const bool on_ground = c.parent == ground;
    if (carries.follows[k] && (!on_ground || c.parts.size() != 1 || has_closure(c) || carries.moves[c.parts.front()])) return false;
    if (!carries.follows[k] && !on_ground && !carries.moves[c.parent] && !carries.link[k]) return false;
  }
  return true;
}

// Power that motions feed in where they all drive such parts: that of the wrench which such a part needs, or a link on one, on what moves
// it while the link's own rate rests. Others take nothing.
template <class W>
FLEXFRAME_INLINE double root_power(const Model& model, int cluster, const W& work) {
  const Cluster& c = model.clusters[cluster];
  const Part& part = model.parts[c.parts.front()];
  const auto& p = work.parts[c.parts.front()];
  if (part.joint.motion >= 0) return work.motion[part.joint.motion].rate * p.driven.dot(p.fr);
  if (c.parent == ground || work.carrying.moves[c.parent]) return 0.0;
  const int motion = model.parts[c.parent].joint.motion;
  if (motion < 0) return 0.0;
  const typename W::In::Twist V = to_child(p.in_carrier, work.parts[c.parent].driven);
  return work.motion[motion].rate * V.dot(p.fr + p.Mrr.lazyProduct(p.A - p.own));
}

template <class W>
FLEXFRAME_INLINE void assemble(const Model& model, int cluster, W& work) {
  work.clusters[cluster].whole = true;
  assemble_cluster(model, cluster, work);
  reduce_cluster(model, cluster, work);
}
FLEXFRAME_WIDE void wide_assemble(const Model& model, int cluster, Work& work) { assemble(model, cluster, work); }
FLEXFRAME_WIDE void wide_assemble(const Model& model, int cluster, PlaneWork& work) { assemble(model, cluster, work); }

// rates_alone: as update_accelerations_alone.
template <class W>
FLEXFRAME_INLINE void accelerate(const Model& model, W& work, bool rates_alone) {
  ++work.evaluations;
  update_loads(model, work);
  start_composites(model, work);
  // How a cluster's accelerations are found.
  enum class By : char { link, few, reduced, matrix };
  static thread_local std::vector<By> way;
  const Carrying& carries = work.carrying;
  const int clusters = static_cast<int>(model.clusters.size());
  way.assign(model.clusters.size(), By::matrix);
  // Then nobody asks for the parts' accelerations.
  bool felt = rates_alone && carries.driven && feeds_at_root(model, carries);
  for (int k = clusters; k-- > 0;) {
    const int carrier = model.clusters[k].parent;
    const bool weighs = carrier != ground && carries.moves[carrier];
    if (is_link(carries, k, work.clusters[k]) && reduce_link(model, k, weighs, work)) {
      way[k] = By::link;
      continue;
    }
    felt = felt && (weighs || carrier == ground) && work.clusters[k].carried == 0;
    if (rates_alone && !weighs && has_few_rates(k, work)) {
      way[k] = By::few;
    } else if (rates_alone && !weighs && prefers_reduced(model, k, work)) {
      way[k] = By::reduced;
    } else {
      wide_assemble(model, k, work);
      if (weighs) add_to_carrier(model, k, work);
    }
  }
  for (int k = 0; k < clusters; ++k) {
    if (way[k] == By::link) {
      solve_link(model, k, work);
      continue;
    }
    if (!stands_on_ground(model, k)) update_base_acceleration(model, k, work);
    work.clusters[k].fed_known = false;
    const bool solved = (way[k] == By::few && solve_few(model, k, work)) || (way[k] == By::reduced && solve_reduced(model, k, work));
    if (!solved) {
      if (way[k] != By::matrix) wide_assemble(model, k, work);
      solve_cluster(model, k, work);
    }
    // Of the parts themselves only the power of motions asks, and what hangs on them.
    const bool asked = carries.driven && !felt && !(clusters == 1 && work.clusters[k].fed_known);
    if (!rates_alone || asked || k + 1 < clusters) update_cluster_accelerations(model, k, work);
  }
  for (int k = 0; carries.driven && k < clusters; ++k) {
    ClusterWork& cw = work.clusters[k];
    if (felt) cw.fed = root_power(model, k, work);
    if (felt || way[k] == By::link) cw.fed_known = felt;
  }
}

FLEXFRAME_WIDE void wide_accelerate(const Model& model, Work& work, bool rates_alone) { accelerate(model, work, rates_alone); }
FLEXFRAME_WIDE void wide_accelerate(const Model& model, PlaneWork& work, bool rates_alone) { accelerate(model, work, rates_alone); }

}  // namespace

template <class W>
void update_accelerations(const Model& model, W& work) {
  wide_accelerate(model, work, false);
}

template <class W>
void update_accelerations_alone(const Model& model, W& work) {
  wide_accelerate(model, work, true);
}

template <class W>
void load_responses(const Model& model, W& work, VecX& out) {
  out.resize(0);
  if (std::any_of(model.parts.begin(), model.parts.end(), [](const Part& p) { return p.joint.motion >= 0; }) ||
      std::any_of(model.clusters.begin(), model.clusters.end(), [](const Cluster& c) { return c.parent != ground; }))
    return;
  Eigen::Index n = 0;
  for (const ClusterWork& cw : work.clusters) n += static_cast<Eigen::Index>(cw.partition.ind.size());
  out.setZero(static_cast<Eigen::Index>(model.loads.size()) * (n + 1));
  const Eigen::Index loads = static_cast<Eigen::Index>(model.loads.size());
  MatX responses;
  Eigen::Index first = 0;
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const int k = static_cast<int>(c);
    ClusterWork& cw = work.clusters[c];
    const Partition& split = cw.partition;
    const Eigen::Index ni = static_cast<Eigen::Index>(split.ind.size());
    responses.setZero(ni, loads);
    bool any = false;
    for (Eigen::Index i = 0; i < loads; ++i) {
      const Load& load = model.loads[static_cast<size_t>(i)];
      auto column = out.segment(i * (n + 1), n + 1);
      if (load.table || load.function >= 0 || (load.def.kind != ForceKind::force && load.def.kind != ForceKind::torque)) {
        column.setConstant(std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      const int part = model.frames[load.on].part;
      if (part == ground || model.parts[part].cluster != k) continue;
      const auto wrench = unit_wrench(model, work, static_cast<int>(i));
      cw.line.setZero(model.clusters[c].nv);
      project_wrench(model, work, k, {load.on, wrench}, true, cw.line);
      auto response = responses.col(i);
      for (Eigen::Index a = 0; a < ni; ++a) response[a] = cw.line[split.ind[a]];
      for (size_t e = 0; e < split.dep.size(); ++e) response += cw.E.row(static_cast<Eigen::Index>(e)).transpose() * cw.line[split.dep[e]];
      column[n] = wrench.dot(work.frames[load.on].V);
      any = true;
    }
    if (any && ni > 0) {
      solve_mass(model, k, work, responses);
      for (Eigen::Index i = 0; i < loads; ++i)
        if (!std::isnan(out[i * (n + 1)])) out.segment(i * (n + 1) + first, ni) += responses.col(i);
    }
    first += ni;
  }
}

template <class W>
Energy energy_of_motion(const Model& model, const W& work) {
  Energy e;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const auto& p = work.parts[i];
    e.kinetic += kinetic_energy(kinetic_body(model, work, static_cast<int>(i)), p.terms, p.V, p.qd);
    e.strain += strain_energy(model.parts[i].body, p.q);
  }
  e.strain += flexure_energy(model, work.q);
  return e;
}

#define FLEXFRAME_FOR(W)                                      \
  template void update_places(const Model&, W&);              \
  template void update_positions(const Model&, W&, bool);     \
  template void update_velocities(const Model&, W&);          \
  template void update_velocities_alone(const Model&, W&);    \
  template void update_accelerations(const Model&, W&);       \
  template void update_accelerations_alone(const Model&, W&); \
  template void load_responses(const Model&, W&, VecX&);      \
  template Energy energy_of_motion(const Model&, const W&);
FLEXFRAME_FOR(Work)
FLEXFRAME_FOR(PlaneWork)
#undef FLEXFRAME_FOR

namespace {

// Energies of the bodies alone.
template <class W>
Energy body_energy(const Model& model, const W& work, int scene_body) {
  Energy e;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    if (scene_body >= 0 && part.scene_body != scene_body) continue;
    const auto& p = work.parts[i];
    const auto& body = kinetic_body(model, work, static_cast<int>(i));
    e.kinetic += kinetic_energy(body, p.terms, p.V, p.qd);
    e.strain += strain_energy(part.body, p.q);
    e.potential -= gravity(model, work).dot(body.mass * p.world.p + turn(p.world, p.terms.md));
  }
  e.strain += flexure_energy(model, work.q, scene_body);
  return e;
}

}  // namespace

Energy compute_energy(const Model& model, const Work& work, int scene_body) {
  Energy e = body_energy(model, work, scene_body);
  if (scene_body < 0) e.potential += spring_energy(model, work);
  return e;
}

Energy compute_energy(const Model& model, const PlaneWork& work, const Work& placed, int scene_body) {
  Energy e = body_energy(model, work, scene_body);
  if (scene_body < 0) e.potential += spring_energy(model, placed);
  return e;
}

}  // namespace flexframe::sim
