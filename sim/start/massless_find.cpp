#include "sim/start/massless_find.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/massless_forces.h"
#include "sim/start/assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace flexframe::sim {
namespace {

// A part that a scene gives neither mass nor inertia.
bool weightless(const Part& p) { return p.scene_body >= 0 && p.body.n == 0 && p.body.mass == 0.0 && p.body.J0.isZero(0.0); }

// The rates of trees on ground in which such a part stands; loops determine theirs by other means. Vectors over them are in metres.
struct Candidates {
  const Model& model;
  Work& work;
  std::vector<int> rates;      // of w_all
  std::vector<double> size;    // m per unit
  std::vector<Mat6> inertial;  // per part: directions of twists in which it has inertia
  VecX q, w;                   // at the start
  RestForces rest;

  Eigen::Index count() const { return static_cast<Eigen::Index>(rates.size()); }

  VecX per_metre(const VecX& all) const {
    VecX out(count());
    for (Eigen::Index k = 0; k < count(); ++k) out[k] = all[rates[k]] / size[k];
    return out;
  }
  VecX spread(const VecX& metres) const {
    VecX out = VecX::Zero(model.nv);
    for (Eigen::Index k = 0; k < count(); ++k) out[rates[k]] = metres[k] / size[k];
    return out;
  }
  // Twists of all parts at rates w_all, prescribed motions at rest.
  std::vector<Vec6> masses_move(const VecX& rates_of_all) {
    const std::vector<TimeJet> motion = work.motion;
    const VecX before = work.w;
    for (TimeJet& jet : work.motion) jet.rate = jet.acceleration = 0.0;
    work.w = rates_of_all;
    std::vector<Vec6> V;
    for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
    V.reserve(work.parts.size());
    for (const PartWork& p : work.parts) V.push_back(p.V);
    work.motion = motion;
    work.w = before;
    return V;
  }
  // Forces at rest `metres` beside the start, and at the start with so many metres a second.
  VecX force_beside(const VecX& metres) {
    work.q = q;
    move_all(model, spread(metres), work);
    place_all(model, work);
    return per_metre(forces_at_rest(model, work, rest));
  }
  VecX force_moving(const VecX& metres) {
    work.w = spread(metres);
    for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
    applied_forces(model, work, rest);
    return per_metre(rest.force);
  }
  void back_to_start() {
    work.q = q;
    work.w = w;
    place_all(model, work);
  }
  double step() const { return 1e-6 * model.size; }
};

void find_rates(Candidates& c) {
  std::vector<int> tree(c.model.parts.size());
  std::vector<char> concerned(c.model.parts.size(), 0);
  for (const Cluster& cluster : c.model.clusters)
    for (int i : cluster.parts) tree[i] = cluster.parent == ground ? cluster.parts.front() : tree[cluster.parent];
  for (size_t i = 0; i < c.model.parts.size(); ++i)
    if (weightless(c.model.parts[i])) concerned[tree[i]] = 1;
  for (size_t at = 0; at < c.model.clusters.size(); ++at) {
    const Cluster& cluster = c.model.clusters[at];
    if (has_closure(cluster) || !concerned[tree[cluster.parts.front()]]) continue;
    for (int k = 0; k < cluster.nv; ++k)
      if (const double s = rate_scale(c.model, static_cast<int>(at), k); s > 0.0) {
        c.rates.push_back(cluster.v0 + k);
        c.size.push_back(s);
      }
  }
}

// Directions in which a body has inertia count alike, however much it is.
void find_inertial_directions(Candidates& c) {
  c.inertial.assign(c.model.parts.size(), Mat6::Zero());
  for (size_t i = 0; i < c.model.parts.size(); ++i) {
    if (c.model.parts[i].body.mass == 0.0 && c.work.parts[i].terms.Mrr.isZero(0.0)) continue;
    Vec6 metre = Vec6::Ones();
    metre.tail<3>().setConstant(1.0 / c.model.size);
    const SymmetricEigen eigen(MatX(metre.asDiagonal() * c.work.parts[i].terms.Mrr * metre.asDiagonal()));
    for (int k = 0; k < 6; ++k)
      if (eigen.eigenvalues()[k] > 1e-12 * eigen.eigenvalues()[5])
        c.inertial[i] += metre.cwiseInverse().asDiagonal() * eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose() *
                         metre.cwiseInverse().asDiagonal();
  }
}

// Orthonormal directions of the rates in which no mass moves, columns.
MatX directions_without_inertia(Candidates& c) {
  const Eigen::Index n = c.count();
  std::vector<std::vector<Vec6>> twist;
  twist.reserve(n);
  for (Eigen::Index k = 0; k < n; ++k) twist.push_back(c.masses_move(VecX::Unit(c.model.nv, c.rates[k]) / c.size[k]));
  MatX gram = MatX::Zero(n, n);
  for (size_t i = 0; i < c.model.parts.size(); ++i)
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vec6 there = c.inertial[i] * twist[k][i];
      for (Eigen::Index l = 0; l <= k; ++l) gram(k, l) = gram(l, k) = gram(l, k) + twist[l][i].dot(there);
    }
  const SymmetricEigen eigen(gram);
  Eigen::Index free = 0;
  while (free < n && eigen.eigenvalues()[free] <= 1e-12 * std::max(eigen.eigenvalues()[n - 1], 1e-300)) ++free;
  return eigen.eigenvectors().leftCols(free);
}

// Of directions without inertia those along which forces change when anything moves, and those of the massless parts' own joints on which
// nothing acts: they rest. What turns on bodies with mass keeps its rate (dynamics.cpp).
void split_directions(Candidates& c, const MatX& null, MatX& moving, MatX& resting) {
  const Eigen::Index n = c.count(), free = null.cols();
  const double h = c.step();
  double largest = 0.0;
  MatX K(n, free), C(n, free);
  for (Eigen::Index k = 0; k < free; ++k) {
    K.col(k) = (c.force_beside(-h * null.col(k)) - c.force_beside(h * null.col(k))) / (2.0 * h);
    largest = std::max(largest, c.rest.scale);
  }
  c.back_to_start();
  for (Eigen::Index k = 0; k < free; ++k) C.col(k) = 0.5 * (c.force_moving(-null.col(k)) - c.force_moving(null.col(k)));
  c.work.w = c.w;
  // Out of balance the matrix is not symmetric: the force on a point turns with the body's axes.
  const auto range = [&](const MatX& part) {
    const ThinSvd svd(null.transpose() * part);
    MatX projector = MatX::Zero(free, free);
    const double most = svd.singularValues()[0];
    for (Eigen::Index k = 0; k < free; ++k)
      if (svd.singularValues()[k] > 1e-9 * most && most * c.model.size > 1e-9 * largest)
        projector += svd.matrixU().col(k) * svd.matrixU().col(k).transpose();
    return projector;
  };
  const SymmetricEigen acted(range(K) + range(C));
  Eigen::Index idle = 0;
  while (idle < free && acted.eigenvalues()[idle] < 1e-6) ++idle;
  moving = null * acted.eigenvectors().rightCols(free - idle);
  resting = null * acted.eigenvectors().leftCols(idle);
  if (idle == 0) return;
  MatX others = resting;
  for (Eigen::Index k = 0; k < n; ++k)
    if (weightless(c.model.parts[joint_of_rate(c.model, c.rates[k])])) others.row(k).setZero();
  const SymmetricEigen own(others.transpose() * others);
  Eigen::Index count = 0;
  while (count < idle && own.eigenvalues()[count] < 1e-12) ++count;
  resting = (resting * own.eigenvectors().leftCols(count)).eval();
}

// How well each rate stands for a direction: those that springs and dampers act on most, the massless body's own joint by preference, and
// one whose value nobody gives.
VecX preferences(Candidates& c, const Scene& scene) {
  const Eigen::Index n = c.count();
  const double h = c.step();
  VecX held(n), resisted(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const VecX unit = VecX::Unit(n, k);
    held[k] = std::abs((c.force_beside(-h * unit) - c.force_beside(h * unit))[k]) / (2.0 * h);
  }
  c.back_to_start();
  for (Eigen::Index k = 0; k < n; ++k)
    resisted[k] = 0.5 * std::abs((c.force_moving(-VecX::Unit(n, k)) - c.force_moving(VecX::Unit(n, k)))[k]);
  c.work.w = c.w;
  VecX out = (held / std::max(held.maxCoeff(), 1e-300) + resisted / std::max(resisted.maxCoeff(), 1e-300)).array() + 1e-6;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Part& p = c.model.parts[joint_of_rate(c.model, c.rates[k])];
    if (weightless(p)) out[k] *= 10.0;
    if (p.joint.scene_joint >= 0 && scene.joints[p.joint.scene_joint].initial.value) out[k] *= 1e-3;
  }
  return out;
}

// Combines the columns of Z (the first `moving` among themselves and with the others, those last) so that each is 1 in a row of its own,
// where the others are 0. Returns these rows, column by column.
std::vector<Eigen::Index> make_identity(MatX& Z, Eigen::Index moving, const VecX& weight) {
  std::vector<Eigen::Index> row(Z.cols());
  std::vector<char> used(Z.cols(), 0), taken(Z.rows(), 0);
  for (Eigen::Index step = 0; step < Z.cols(); ++step) {
    Eigen::Index at = -1, column = -1;
    double best = -1.0;
    for (Eigen::Index c = step < moving ? 0 : moving; c < (step < moving ? moving : Z.cols()); ++c)
      for (Eigen::Index r = 0; r < Z.rows() && !used[c]; ++r)
        // To a thousandth alike, the first one.
        if (!taken[r] && weight[r] * std::abs(Z(r, c)) > (1.0 + 1e-3) * best) best = weight[r] * std::abs(Z(r, c)), at = r, column = c;
    used[column] = taken[at] = 1;
    row[column] = at;
    Z.col(column) /= Z(at, column);
    for (Eigen::Index c = 0; c < Z.cols(); ++c)
      if (c != column) Z.col(c) -= (Z(at, c) * Z.col(column)).eval();
  }
  for (Eigen::Index r = 0; r < Z.rows(); ++r)
    for (Eigen::Index c = 0; c < Z.cols(); ++c)
      if (std::abs(Z(r, c)) < 1e-9) Z(r, c) = 0.0;
  return row;
}

// The directions as the model keeps them.
void keep_directions(const Candidates& c, const MatX& Z, Eigen::Index moving, const std::vector<Eigen::Index>& row, MasslessRates& out) {
  out.Z = MatX::Zero(c.model.nv, Z.cols());
  out.scale.resize(Z.cols());
  out.moving = static_cast<int>(moving);
  for (Eigen::Index k = 0; k < Z.cols(); ++k) {
    const size_t at = row[k];
    out.rates.push_back(c.rates[at]);
    out.scale[k] = c.size[at];
    out.Z.col(k) = out.scale[k] * c.spread(Z.col(k));
    out.Z(out.rates.back(), k) = 1.0;
  }
}

// What the balance does not solve is refused: directions that depend on the position, looked for at another place, and dry friction.
void require_solvable(Candidates& c, const MasslessRates& m, const std::string& file, const std::string& names) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  VecX away(c.count());
  for (Eigen::Index k = 0; k < c.count(); ++k) away[k] = uniform(random) * c.model.size;
  c.work.q = c.q;
  move_all(c.model, c.spread(away), c.work);
  place_all(c.model, c.work);
  double moved = 0.0;
  for (Eigen::Index k = 0; k < m.Z.cols(); ++k) {
    const std::vector<Vec6> V = c.masses_move(m.Z.col(k) / m.scale[k]);
    for (size_t i = 0; i < V.size(); ++i) moved = std::max(moved, V[i].dot(c.inertial[i] * V[i]));
  }
  c.back_to_start();
  for (size_t k = 0; k < c.model.clusters.size(); ++k) close_velocities(c.model, static_cast<int>(k), c.work);
  if (moved > 1e-16)
    throw InputError(
        fmt::format("{}: joint {}: the massless bodies there can move in directions that change with the position; this is supported for "
                    "parallel slides, rotations about one axis and massless bodies at the end of a chain only: give them a mass",
                    file, names));
  for (int v = 0; v < c.model.nv; ++v) {
    if (m.Z.row(v).isZero(0.0)) continue;
    const TreeJoint& j = c.model.parts[joint_of_rate(c.model, v)].joint;
    if (j.friction)
      throw InputError(
          fmt::format("{}: joint '{}' has friction, but moves without inertia (joint {}): it would jump as soon as friction is overcome; "
                      "give the body there a mass, or use damping instead of friction",
                      file, j.name, names));
  }
}

// Locks them with rates of their own.
void lock_rates(Model& model, Work& work) {
  MasslessRates& m = model.massless;
  for (int v : m.rates) {
    const int cluster = model.parts[joint_of_rate(model, v)].cluster;
    ClusterWork& cw = work.clusters[cluster];
    m.cluster.push_back(cluster);
    m.lock.push_back(static_cast<int>(cw.locked.size()));
    cw.locked.push_back(v - model.clusters[cluster].v0);
    ++cw.carried;
  }
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    if (cw.carried == 0) continue;
    cw.lock_value = VecX::Zero(cw.carried);
    cw.lock_rate = VecX::Zero(cw.carried);
    cw.partition = choose_partition(model, static_cast<int>(c), work, false);
  }
}

// The balance of forces at rest knows springs and dampers only.
void refuse_state_forces(const System& system) {
  const Model& model = system.model;
  for (const Load& load : model.loads)
    if (load.function >= 0 || load.rest >= 0 || load.contact >= 0 || load.def.kind == ForceKind::drag)
      throw InputError(
          fmt::format("{}:{}: force{}: depends on the state or has a rest that moves, but joint '{}' moves without mass or inertia, by "
                      "the balance of springs and dampers; give the bodies there a mass",
                      system.scene.file.string(), load.def.line, load.def.name.empty() ? "" : fmt::format(" '{}'", load.def.name),
                      model.parts[joint_of_rate(model, model.massless.rates.front())].joint.name));
}

// Brings them into balance at the start, from coordinates q, and tells of it.
void balance_start(System& system, const VecX& q, const std::string& file, const std::string& names) {
  Model& model = system.model;
  Work& work = system.work;
  update_expressions(model, work.time, work);
  place_all(model, work);
  split_massless(model, work);
  try {
    renew_motion(model, work);
  } catch (const SimulationError& error) {
    throw InputError(fmt::format("{}: {}", file, error.what()));
  }
  const MasslessWork& mw = work.massless;
  if (!mw.stiff.empty() && mw.stiffness.rows() > 0 && model.massless.rates.size() == 1) {
    const SymmetricEigen stiffness(0.5 * (mw.stiffness + mw.stiffness.transpose()), Eigen::EigenvaluesOnly);
    if (stiffness.eigenvalues()[0] <= 0.0)
      throw InputError(
          fmt::format("{}: joint {}: the equilibrium of the springs there is unstable, and the bodies that move have no mass: they would "
                      "jump away; reverse the spring, or give them a mass",
                      file, names));
  }
  const std::string moved = largest_moves(model, q, work.q, 1e-9 * model.size);
  system.notes.tell("joint " + names,
                    fmt::format("moves bodies without mass; its coordinates {}{}{}",
                                mw.stiff.empty()    ? "follow from the equilibrium of springs, dampers and forces, in first order"
                                : mw.damped.empty() ? "follow from the equilibrium of springs and forces at every time"
                                                    : "follow from the equilibrium of springs, dampers and forces",
                                moved.empty() ? "" : "; initial positions were adjusted by up to ", moved));
}

}  // namespace

bool find_massless(System& system) {
  Model& model = system.model;
  Work& work = system.work;
  if (std::none_of(model.parts.begin(), model.parts.end(), weightless)) return false;
  Candidates c{model, work, {}, {}, {}, work.q, work.w, {}};
  find_rates(c);
  if (c.count() == 0) return false;
  find_inertial_directions(c);
  const MatX null = directions_without_inertia(c);
  if (null.cols() == 0) return false;
  MatX moving, resting;
  split_directions(c, null, moving, resting);
  if (moving.cols() == 0) return false;
  MatX Z(c.count(), moving.cols() + resting.cols());
  Z << moving, resting;
  const std::vector<Eigen::Index> row = make_identity(Z, moving.cols(), preferences(c, system.scene));
  keep_directions(c, Z, moving.cols(), row, model.massless);
  const std::string names = joints_of(model, model.massless.rates), file = system.scene.file.string();
  require_solvable(c, model.massless, file, names);
  lock_rates(model, work);
  work.expression_rate.assign(model.expressions.size(), 0.0);  // asks for them
  balance_start(system, c.q, file, names);
  refuse_state_forces(system);
  return true;
}

}  // namespace flexframe::sim
