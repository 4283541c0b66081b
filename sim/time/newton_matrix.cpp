#include "sim/time/newton_matrix.h"

#include "sim/base/small_matrices.h"
#include "sim/dynamics/force_responses.h"
#include "sim/dynamics/line_stiffness.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/model/joint_motion.h"
#include "sim/time/unpack.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// Independent rate k of a cluster: its part, its rate of the joint (or -1) or elastic coordinate (or -1), its place among the rates.
struct Direction {
  int cluster = 0, part = 0, rate = -1, elastic = -1;
};

std::vector<Direction> directions(const System& system) {
  std::vector<Direction> out;
  for (size_t c = 0; c < system.model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) {
      const int v = system.model.clusters[c].v0 + k;
      for (int i : system.model.clusters[c].parts) {
        const Part& p = system.model.parts[i];
        if (v >= p.v0 && v < p.v0 + p.joint.nv) out.push_back({static_cast<int>(c), i, v - p.v0, -1});
        else if (v >= p.ev0 && v < p.ev0 + p.body.n) out.push_back({static_cast<int>(c), i, -1, v - p.ev0});
      }
    }
  return out;
}

bool all_on_ground(const Model& model) {
  return std::all_of(model.clusters.begin(), model.clusters.end(), [](const Cluster& c) { return c.parent == ground; });
}

bool has_lines(const Model& model) { return std::any_of(model.loads.begin(), model.loads.end(), is_line); }

// Whether what is stiff beside joints is the bodies' stiffness alone, and that of springs and cables between frames.
bool closed_form(const System& system) {
  const Model& model = system.model;
  for (const Load& load : model.loads)
    if (const ForceKind kind = load.def.kind;
        !is_line(load) && (load.function >= 0 || (kind != ForceKind::force && kind != ForceKind::torque && kind != ForceKind::distributed)))
      return false;
  for (const LoopJoint& loop : model.loops)
    if (loop.spring) return false;
  if (all_on_ground(model)) return true;
  // Of a tree what is left out (the pull of a blade that spins) costs steps: a blade in a plane took 884 for 338, a cart's pendulum 638 for
  // 192. In space two evaluations for each of many coordinates cost more (newton_matrix.h).
  constexpr int many = 30;
  int elastic = 0;
  for (const Part& p : model.parts) elastic += p.body.n;
  return !system.plane && elastic > many;
}

bool is_elastic(const Model& model, const Cluster& cluster, int rate) {
  const int v = cluster.v0 + rate;
  return std::any_of(cluster.parts.begin(), cluster.parts.end(), [&](int i) {
    const Part& p = model.parts[i];
    return v >= p.ev0 && v < p.ev0 + p.body.n;
  });
}

// Whether deformations close loops: a rod held at both ends but for its spin lengthens so that they meet.
bool closed_by_deformation(const System& system) {
  for (size_t c = 0; c < system.model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.dep)
      if (is_elastic(system.model, system.model.clusters[c], k)) return true;
  return false;
}

// T: rates of all coordinates per independent rate.
void coordinate_matrix(const System& system, const double* y, SparseEntries& T) {
  const Model& model = system.model;
  static thread_local std::vector<int> place;
  int first = 0;
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const Cluster& cluster = model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    const int ni = static_cast<int>(cw.partition.ind.size());
    // Where a rate stands among the independent ones, or -1 - its place among the dependent ones; `none` for one that is locked.
    constexpr int none = std::numeric_limits<int>::max();
    place.assign(static_cast<size_t>(cluster.nv), none);
    for (size_t k = 0; k < cw.partition.ind.size(); ++k) place[cw.partition.ind[k]] = static_cast<int>(k);
    for (size_t d = 0; d < cw.partition.dep.size(); ++d) place[cw.partition.dep[d]] = -1 - static_cast<int>(d);
    // Row of N for a rate of the cluster: a unit row, or one of E.
    const auto add = [&](int row, int rate, double factor) {
      const int at = place[rate];
      if (at == none) return;
      if (at >= 0) T.entries.push_back({row, first + at, factor});
      else
        for (int k = 0; k < ni; ++k) T.entries.push_back({row, first + k, factor * cw.E(-1 - at, k)});
    };
    for (int i : cluster.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nv; ++k) {
        double e[6] = {}, dq[7] = {};
        e[k] = 1.0;
        coordinate_rates(p.joint.kind, y + p.q0, e, dq);
        for (int a = 0; a < p.joint.nq; ++a)
          if (dq[a] != 0.0) add(p.q0 + a, p.v0 - cluster.v0 + k, dq[a]);
      }
      for (int k = 0; k < p.body.n; ++k) add(p.eq0 + k, p.ev0 - cluster.v0 + k, 1.0);
    }
    first += ni;
  }
}

// How columns are differenced: about (t, y), whose rates are `rates`; `share` of the size of each component is the step; joints_only:
// those of elastic coordinates stay; A_only: those of B are made.
struct Differences {
  double t;
  const double* y;
  const VecX& rates;
  const std::vector<Direction>& all;
  double share;
  bool joints_only, A_only = false;
};

// Columns of B by one-sided differences about the state evaluated last: nothing but rates changes, and with the first of them come the
// mass matrices where they are wanted, as these do not depend on rates. False where there is no column, or more follows the rates.
bool difference_speeds(System& system, const Differences& how, bool masses, MatX& B) {
  const auto& [t, y, rates, all, share, joints_only, A_only] = how;
  if (!system.friction.points.empty() || !all_have_inertia(system.model)) return false;
  const int nq = system.model.nq, nw = static_cast<int>(all.size());
  VecX at = Eigen::Map<const VecX>(y, nq + nw), wdot(nw);
  bool any = false;
  for (int k = 0; k < nw; ++k) {
    if (joints_only && all[k].elastic >= 0) continue;
    const double step = share * std::max(std::abs(y[nq + k]), system.weights.size(nq + k));
    at[nq + k] += step;
    accelerate_beside(system, at.data(), masses && !any, wdot.data());
    B.col(k) = (wdot - rates.segment(nq, nw)) / step;
    at[nq + k] = y[nq + k];
    any = true;
  }
  return any;
}

// Columns of A and B by one-sided differences.
void difference_columns(System& system, const Differences& how, MatX& A, MatX& B) {
  const auto& [t, y, rates, all, share, joints_only, A_only] = how;
  const Model& model = system.model;
  const int nq = model.nq, nw = static_cast<int>(all.size()), size = state_size(system);
  VecX at = Eigen::Map<const VecX>(y, size), rate(size);
  const auto base = rates.segment(nq, nw);
  for (int k = 0; k < nw; ++k) {
    if (joints_only && all[k].elastic >= 0) continue;
    const Part& p = model.parts[all[k].part];
    const int q = all[k].elastic >= 0 ? p.eq0 + all[k].elastic : p.q0 + std::min(all[k].rate, std::max(0, p.joint.nq - 1));
    double step = share * std::max(std::abs(y[q]), system.weights.size(q));
    if (all[k].elastic >= 0) {
      at[q] += step;
    } else {
      double dw[6] = {};
      dw[all[k].rate] = step;
      move_coordinates(p.joint.kind, at.data() + p.q0, dw);
    }
    state_rate(system, t, at.data(), rate.data());
    A.col(k) = (rate.segment(nq, nw) - base) / step;
    at.segment(0, nq) = Eigen::Map<const VecX>(y, nq);
    if (A_only) continue;
    step = share * std::max(std::abs(y[nq + k]), system.weights.size(nq + k));
    at[nq + k] += step;
    state_rate(system, t, at.data(), rate.data());
    B.col(k) = (rate.segment(nq, nw) - base) / step;
    at[nq + k] = y[nq + k];
  }
}

// T and P at the state evaluated last.
void update_directions(const System& system, const double* y, const std::vector<Direction>& all, MechanicalJacobian& out) {
  const Model& model = system.model;
  const int nq = model.nq, nw = static_cast<int>(all.size());
  out.T.rows = out.P.cols = nq;
  out.T.cols = out.P.rows = nw;
  out.T.entries.clear();
  coordinate_matrix(system, y, out.T);
  // P: the independent directions in a change of the coordinates.
  out.P.entries.clear();
  for (int k = 0; k < nw; ++k) {
    const Part& p = model.parts[all[k].part];
    if (all[k].elastic >= 0) {
      out.P.entries.push_back({k, p.eq0 + all[k].elastic, 1.0});
      continue;
    }
    const int nj = p.joint.nq;
    double e[6] = {}, dq[7] = {};
    e[all[k].rate] = 1.0;
    coordinate_rates(p.joint.kind, y + p.q0, e, dq);
    // Columns of a joint's rates are orthogonal: the pseudo-inverse is column by column.
    double norm2 = 0.0;
    for (int a = 0; a < nj; ++a) norm2 += dq[a] * dq[a];
    for (int a = 0; a < nj; ++a)
      if (dq[a] != 0.0) out.P.entries.push_back({k, p.q0 + a, dq[a] / norm2});
  }
}

// The mass matrices of the state evaluated last.
void complete_mass_matrices(System& system) {
  if (!system.plane) return sim::complete_mass_matrices(system.model, system.work);
  PlaneWork work(system.work, *system.plane);
  sim::complete_mass_matrices(system.model, work);
}

// Of a cluster whose loops deformations close: K = -N^T Ke N and D = -N^T De N for those of its independent rates that are `elastic`, as
// rows, N what all of its elastic rates are per independent one (the loops' own change with the coordinates is left out).
void add_closing_stiffness(const System& system, size_t cluster, const std::vector<int>& elastic, MatX& K, MatX& D) {
  const Cluster& c = system.model.clusters[cluster];
  const ClusterWork& cw = system.work.clusters[cluster];
  const Eigen::Index ni = static_cast<Eigen::Index>(cw.partition.ind.size());
  MatX N = MatX::Zero(c.nv, ni);
  for (Eigen::Index k = 0; k < ni; ++k) N(cw.partition.ind[static_cast<size_t>(k)], k) = 1.0;
  for (size_t d = 0; d < cw.partition.dep.size(); ++d) N.row(cw.partition.dep[d]) = cw.E.row(static_cast<Eigen::Index>(d));
  for (const int i : c.parts) {
    const Part& part = system.model.parts[i];
    if (part.body.n == 0) continue;
    const MatX all = N.middleRows(part.ev0 - c.v0, part.body.n), moved = all(Eigen::all, elastic);
    K -= (part.body.Ke * moved).transpose() * all;
    if (part.body.De.size() > 0) D -= (part.body.De * moved).transpose() * all;
  }
}

// Of a cluster's elastic rates the forces of bodies' stiffness and damping on all of its independent ones, as rows.
struct ElasticForces {
  std::vector<int> elastic;
  MatX K, D;  // D empty: nothing damps them
};

ElasticForces elastic_forces(const System& system, const std::vector<Direction>& all, size_t cluster, int first) {
  const Model& model = system.model;
  const ClusterWork& cw = system.work.clusters[cluster];
  const int ni = static_cast<int>(cw.partition.ind.size());
  ElasticForces out;
  bool damped = false;
  for (int i = 0; i < ni; ++i)
    if (all[first + i].elastic >= 0) {
      out.elastic.push_back(i);
      damped = damped || model.parts[all[first + i].part].body.De.size() > 0;
    }
  const Eigen::Index ne = static_cast<Eigen::Index>(out.elastic.size());
  out.K = MatX::Zero(ne, ni);
  const std::vector<int>& dep = cw.partition.dep;
  const bool closing = std::any_of(dep.begin(), dep.end(), [&](int k) { return is_elastic(model, model.clusters[cluster], k); });
  for (const int i : model.clusters[cluster].parts) damped = damped || (closing && model.parts[i].body.De.size() > 0);
  if (damped) out.D = out.K;
  if (closing) add_closing_stiffness(system, cluster, out.elastic, out.K, out.D);
  for (Eigen::Index r = 0; r < ne && !closing; ++r) {
    const Direction& a = all[first + out.elastic[r]];
    const FlexibleBody& body = model.parts[a.part].body;
    for (int i : out.elastic) {
      const Direction& b = all[first + i];
      if (b.part != a.part) continue;
      out.K(r, i) = -body.Ke(b.elastic, a.elastic);
      if (body.De.size() > 0) out.D(r, i) = -body.De(b.elastic, a.elastic);
    }
  }
  return out;
}

// Adds what springs and cables between frames make of columns to forces on all rates: X and of their damping Y, whose columns belong to
// `columns` of the directions. Whether any of them damps.
bool add_lines(const System& system, const std::vector<int>& columns, MatX& X, MatX& Y) {
  const LineStiffness lines = system.plane ? line_stiffness(system.model, PlaneWork(const_cast<Work&>(system.work), *system.plane))
                                           : line_stiffness(system.model, system.work);
  const MatX at = lines.forces(columns, Eigen::all);
  X.noalias() -= lines.forces * lines.stiffness.asDiagonal() * at.transpose();
  if (lines.damping.size() == 0 || lines.damping.isZero(0.0)) return false;
  Y.noalias() -= lines.forces * lines.damping.asDiagonal() * at.transpose();
  return true;
}

// The columns of A and B that follow from the stiffness and damping of bodies and of springs between frames, through the mass matrix of
// the state evaluated last.
void update_closed_columns(System& system, const std::vector<Direction>& all, MechanicalJacobian& out) {
  const bool lines = has_lines(system.model), alone = all_on_ground(system.model) && !lines;
  const Eigen::Index nw = static_cast<Eigen::Index>(all.size());
  std::vector<int> columns;  // of the whole tree
  std::vector<ElasticForces> forces;
  int first = 0;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const ClusterWork& cw = system.work.clusters[c];
    const int ni = static_cast<int>(cw.partition.ind.size());
    ElasticForces own = elastic_forces(system, all, c, first);
    const Eigen::Index ne = static_cast<Eigen::Index>(own.elastic.size());
    for (const int i : own.elastic) columns.push_back(first + i);
    if (ne > 0 && alone) {
      const MatX& L = cw.L;
      solve_rows(L, own.K);
      if (own.D.size() > 0) solve_rows(L, own.D);
      for (Eigen::Index r = 0; r < ne; ++r) {
        const int column = first + own.elastic[r];
        out.A.col(column).setZero();
        out.A.col(column).segment(first, ni) = own.K.row(r).transpose();
        out.B.col(column).setZero();
        if (own.D.size() > 0) out.B.col(column).segment(first, ni) = own.D.row(r).transpose();
      }
    }
    if (!alone) forces.push_back(std::move(own));
    first += ni;
  }
  if (alone || columns.empty()) return;
  MatX of_lines = MatX::Zero(nw, static_cast<Eigen::Index>(columns.size())), of_dampers = of_lines;
  const bool dampers = lines && add_lines(system, columns, of_lines, of_dampers);
  const auto respond = [&](MatX ElasticForces::*of, MatX X, bool any, MatX& to) {
    Eigen::Index row = 0, column = 0;
    for (size_t c = 0; c < forces.size(); ++c) {
      const Eigen::Index ni = static_cast<Eigen::Index>(system.work.clusters[c].partition.ind.size());
      const Eigen::Index ne = static_cast<Eigen::Index>(forces[c].elastic.size());
      if ((forces[c].*of).size() > 0) X.block(row, column, ni, ne) += (forces[c].*of).transpose(), any = true;
      row += ni, column += ne;
    }
    if (any && system.plane) {
      PlaneWork work(system.work, *system.plane);
      force_responses(system.model, work, X);
    } else if (any) {
      force_responses(system.model, system.work, X);
    }
    for (size_t k = 0; k < columns.size(); ++k) to.col(columns[k]) = X.col(static_cast<Eigen::Index>(k));
  };
  respond(&ElasticForces::K, std::move(of_lines), lines, out.A);
  respond(&ElasticForces::D, std::move(of_dampers), dampers, out.B);
}

// The n rates of a piece.
void set_stiffness(const Model& model, const std::vector<Direction>& all, Eigen::Index n, MechanicalJacobian::Piece& piece) {
  piece.stiffness.setZero(n, n);
  piece.damping.resize(0, 0);
  for (Eigen::Index c = 0; c < n; ++c)
    for (Eigen::Index r = 0; r < n; ++r) {
      const Direction &a = all[static_cast<size_t>(piece.first + r)], &b = all[static_cast<size_t>(piece.first + c)];
      if (a.elastic < 0 || b.elastic < 0 || a.part != b.part) continue;
      const FlexibleBody& body = model.parts[a.part].body;
      piece.stiffness(r, c) = body.Ke(a.elastic, b.elastic);
      if (body.De.size() == 0) continue;
      if (piece.damping.size() == 0) piece.damping.setZero(n, n);
      piece.damping(r, c) = body.De(a.elastic, b.elastic);
    }
  piece.diagonal = piece.stiffness.diagonal();
  if (piece.stiffness.isDiagonal(0.0)) piece.stiffness.resize(0, 0);
}

// The same as pieces, one a cluster.
void update_pieces(const System& system, const std::vector<Direction>& all, MechanicalJacobian& out) {
  const Model& model = system.model;
  static thread_local std::vector<int> beside;
  beside.clear();
  for (size_t k = 0; k < all.size(); ++k)
    if (all[k].elastic < 0) beside.push_back(static_cast<int>(k));
  // Every elastic rate is independent, part by part: where joints stand tells where these do.
  bool same = !out.pieces.empty() && beside == out.beside;
  out.beside = beside;
  size_t used = 0;
  Eigen::Index first = 0;
  for (const ClusterWork& cw : system.work.clusters) {
    const Eigen::Index ni = static_cast<Eigen::Index>(cw.partition.ind.size());
    if (ni == 0) continue;
    if (out.pieces.size() == used) out.pieces.emplace_back(), same = false;
    MechanicalJacobian::Piece& piece = out.pieces[used++];
    same = same && piece.first == first && piece.diagonal.size() == ni;
    piece.first = first;
    reduced_mass(cw, piece.mass);
    if (!same) set_stiffness(model, all, ni, piece);
    first += ni;
  }
  out.pieces.resize(used);
}

std::ptrdiff_t joint_count(const std::vector<Direction>& all) {
  return std::count_if(all.begin(), all.end(), [](const Direction& d) { return d.elastic < 0; });
}
// Of a system whose matrix is known in closed form.
bool few_joints(const std::vector<Direction>& all) { return joint_count(all) <= 3; }

}  // namespace

bool matrix_is_cheap(const System& system) {
  return closed_form(system) && !has_lines(system.model) && all_on_ground(system.model) && !closed_by_deformation(system) &&
         few_joints(directions(system));
}

void update_newton_matrix(System& system, double t, const double* y, const double* rates, const Renewal& renewal, MechanicalJacobian& out) {
  const std::vector<Direction> all = directions(system);
  const int nw = static_cast<int>(all.size()), size = state_size(system);
  const bool fresh = renewal.fresh || out.A.rows() != nw;
  const bool known = closed_form(system), cheap = known && matrix_is_cheap(system);

  // Coordinates first: differences move work.
  VecX base_rate(size);
  if (rates) base_rate = Eigen::Map<const VecX>(rates, size);
  else state_rate(system, t, y, base_rate.data());
  if (fresh) {
    out.A.setZero(nw, nw);
    out.B.setZero(nw, nw);
  }
  // Differences, a hundred-millionth of the size of the component so far: rounding and truncation balance.
  const bool differences = fresh || (cheap && !renewal.keep_joints);
  Differences how{t, y, base_rate, all, 1.5e-8, known};
  how.A_only = differences && difference_speeds(system, how, known, out.B);
  if (known && !how.A_only) complete_mass_matrices(system);
  update_directions(system, y, all, out);
  // What turns without inertia has one lent to it in the factors alone.
  if (cheap && joint_count(all) < nw && !system.work.idle) {
    update_pieces(system, all, out);
  } else {
    out.pieces.clear();
    if (known) update_closed_columns(system, all, out);
  }
  if (differences) difference_columns(system, how, out.A, out.B);
}

void update_closed_matrix(System& system, const double* y, MechanicalJacobian& out) {
  const std::vector<Direction> all = directions(system);
  const bool known = closed_form(system) && !has_lines(system.model);
  if (known) complete_mass_matrices(system);
  update_directions(system, y, all, out);
  out.A.setZero(static_cast<Eigen::Index>(all.size()), static_cast<Eigen::Index>(all.size()));
  out.B = out.A;
  if (known) update_closed_columns(system, all, out);
}

void difference_rates(System& system, double t, const double* y, const double* rates, MatX& A, MatX& B) {
  const std::vector<Direction> all = directions(system);
  VecX base(state_size(system));
  if (rates) base = Eigen::Map<const VecX>(rates, base.size());
  else state_rate(system, t, y, base.data());
  A.setZero(static_cast<Eigen::Index>(all.size()), static_cast<Eigen::Index>(all.size()));
  B = A;
  Differences how{t, y, base, all, 1e-6, false};
  how.A_only = difference_speeds(system, how, false, B);
  difference_columns(system, how, A, B);
}

}  // namespace flexframe::sim
