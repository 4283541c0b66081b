#include "sim/massless.h"

#include "sim/closure.h"
#include "sim/dynamics.h"
#include "sim/eigen_solvers.h"
#include "sim/inverse_dynamics.h"
#include "sim/joint_motion.h"
#include "sim/kinematics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace flexframe::sim {
namespace {

// A part that a scene gives neither mass nor inertia.
bool weightless(const Part& p) { return p.scene_body >= 0 && p.body.n == 0 && p.body.mass == 0.0 && p.body.J0.isZero(0.0); }

// Part whose joint has rate v; -1 for elastic rates.
int joint_of_rate(const Model& model, int v) {
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (v >= model.parts[i].v0 && v < model.parts[i].v0 + model.parts[i].joint.nv) return static_cast<int>(i);
  return -1;
}

std::string joints_of(const Model& model, const std::vector<int>& rates) {
  std::string names;
  int last = -1;
  for (int v : rates) {
    const int part = joint_of_rate(model, v);
    if (part != last) names += fmt::format("{}'{}'", names.empty() ? "" : ", ", model.parts[part].joint.name);
    last = part;
  }
  return names;
}

void place(const Model& model, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    close_positions(model, static_cast<int>(c), work);
    update_cluster_world(model, static_cast<int>(c), work);
  }
}

void move_all(const Model& model, const VecX& dw, Work& work) {
  for (const Part& p : model.parts) {
    if (p.joint.nq > 0) move_coordinates(p.joint.kind, work.q.data() + p.q0, dw.data() + p.v0);
    work.q.segment(p.eq0, p.body.n) += dw.segment(p.ev0, p.body.n);
  }
}

// Applied forces on all rates with everything at rest where it stands: no damper acts.
const VecX& forces_at_rest(const Model& model, Work& work, RestForces& rest) {
  const VecX w = work.w;
  work.w.setZero();
  for (PartWork& p : work.parts) {
    p.V.setZero();
    p.qd.setZero();
  }
  applied_forces(model, work, rest);
  work.w = w;
  return rest.force;
}

// Rates p + Z x, with the locked ones at theirs.
void set_rates(const Model& model, const VecX& p, const VecX& x, Work& work) {
  const MasslessRates& m = model.massless;
  work.w = p + m.Z * x;
  for (size_t k = 0; k < m.rates.size(); ++k) {
    ClusterWork& cw = work.clusters[m.cluster[k]];
    cw.lock_rate.setZero(static_cast<Eigen::Index>(cw.locked.size()));
  }
  for (size_t k = 0; k < m.rates.size(); ++k) work.clusters[m.cluster[k]].lock_rate[m.lock[k]] = x[static_cast<Eigen::Index>(k)];
  for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
}

// Damping along Z per metre of each rate, and the forces along Z at the rates p alone. Positions come first.
void damping_matrix(const Model& model, Work& work, const VecX& p, VecX& force, MatX& C) {
  const MasslessRates& m = model.massless;
  const Eigen::Index n = m.moving;
  RestForces rest;
  set_rates(model, p, VecX::Zero(m.Z.cols()), work);
  applied_forces(model, work, rest);
  const auto along = [&]() { return VecX((m.Z.leftCols(n).transpose() * rest.force).cwiseQuotient(m.scale.head(n))); };
  force = along();
  C.resize(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    set_rates(model, p, VecX::Unit(m.Z.cols(), k) / m.scale[k], work);
    applied_forces(model, work, rest);
    C.col(k) = force - along();
  }
}

// What is out of balance where only springs act, N.
VecX imbalance(const Model& model, Work& work, RestForces& rest) {
  const MasslessRates& m = model.massless;
  forces_at_rest(model, work, rest);
  const Eigen::Index n = m.moving;
  return work.massless.undamped.transpose() * (m.Z.leftCols(n).transpose() * rest.force).cwiseQuotient(m.scale.head(n));
}

// Fourth-order central difference of the imbalance along `move(s)`, which brings `work` to the place s beyond; step: of s.
template <class Move>
VecX derivative(const Model& model, Work& work, double step, Move&& move) {
  RestForces rest;
  VecX out = VecX::Zero(static_cast<Eigen::Index>(work.massless.stiff.size()));
  for (const auto& [at, factor] : {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
    move(at * step);
    place(model, work);
    out += factor / (12.0 * step) * imbalance(model, work, rest);
  }
  return out;
}

[[noreturn]] void refuse_balance(const Model& model, const Work& work) {
  std::vector<int> rates;
  rates.reserve(work.massless.stiff.size());
  for (int k : work.massless.stiff) rates.push_back(model.massless.rates[static_cast<size_t>(k)]);
  throw SimulationError(fmt::format("joint {}: the springs that hold what has no mass there find no balance near the last one at t = {:.6g} s: it snaps through, or no spring acts along a "
                                    "direction any more; give the body a mass, or put a damper beside the spring",
                                    joints_of(model, rates), work.time));
}

}  // namespace

void balance_positions(const Model& model, Work& work) {
  const MasslessRates& m = model.massless;
  MasslessWork& mw = work.massless;
  const Eigen::Index n = static_cast<Eigen::Index>(mw.stiff.size());
  if (n == 0) return;
  RestForces rest;
  VecX g = imbalance(model, work, rest), step;
  double last = std::numeric_limits<double>::infinity();
  bool fresh = false;
  const auto move = [&](const VecX& metres) {
    VecX dw = VecX::Zero(model.nv);
    for (Eigen::Index k = 0; k < n; ++k) {
      const size_t at = static_cast<size_t>(mw.stiff[static_cast<size_t>(k)]);
      dw[m.rates[at]] = metres[k] / m.scale[static_cast<Eigen::Index>(at)];
    }
    move_all(model, dw, work);
    place(model, work);
  };
  for (int iteration = 0;; ++iteration) {
    if (mw.stiffness.rows() != n || (!fresh && iteration > 0)) {
      const VecX q = work.q;
      const double h = 1e-6 * model.size;
      mw.stiffness.resize(n, n);
      for (Eigen::Index k = 0; k < n; ++k) {
        move(h * VecX::Unit(n, k));
        mw.stiffness.col(k) = (g - imbalance(model, work, rest)) / h;
        work.q = q;
      }
      place(model, work);
      fresh = true;
    }
    step = solve_square(mw.stiffness, g);
    const double size = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(size) || iteration == 60) refuse_balance(model, work);
    // As closure.cpp: closed to some hundred roundings, or no longer shrinking near rounding.
    if (size <= 3e-13 * model.size || (size <= 1e-10 * model.size && size > 0.25 * last)) return;
    if (size > 1e-3 * std::min(last, model.size)) fresh = false;
    last = size;
    // Half a mechanism at most, and only steps that leave less force.
    double share = std::min(1.0, 0.5 * model.size / size);
    const VecX q = work.q;
    const double before = g.norm();
    for (int halving = 0;; ++halving, share *= 0.5) {
      move(share * step);
      g = imbalance(model, work, rest);
      if (g.norm() < before || size <= 1e-10 * model.size || halving == 10) break;
      work.q = q;
    }
  }
}

void balance_velocities(const Model& model, Work& work) {
  const MasslessRates& m = model.massless;
  const MasslessWork& mw = work.massless;
  const Eigen::Index n = m.moving, n0 = static_cast<Eigen::Index>(mw.stiff.size());
  const VecX p = work.w;
  MatX A(n, n);
  VecX b(n), x = VecX::Zero(m.Z.cols());
  if (n0 < n) {
    VecX force;
    MatX C;
    damping_matrix(model, work, p, force, C);
    for (int k : mw.damped) {
      A.row(k) = C.row(k);
      b[k] = force[k];
    }
  }
  if (n0 > 0) {
    const VecX q = work.q;
    const std::vector<TimeJet> motion = work.motion;
    const std::vector<double> value = work.expression_value;
    const double step = 3e-4 * model.size;
    // Along every direction without mass.
    MatX along(n0, n);
    for (Eigen::Index k = 0; k < n; ++k)
      along.col(k) = derivative(model, work, step, [&](double s) {
        work.q = q;
        move_all(model, s / m.scale[k] * m.Z.col(k), work);
      });
    // And in time, with the masses' rates.
    double speed = 0.0;
    for (size_t c = 0; c < model.clusters.size(); ++c)
      for (int v = 0; v < model.clusters[c].nv; ++v) speed = std::max(speed, std::abs(p[model.clusters[c].v0 + v]) * std::max(1e-3, rate_scale(model, static_cast<int>(c), v)));
    for (const TimeJet& jet : motion) speed = std::max(speed, std::abs(jet.rate) * model.size);
    const VecX in_time = derivative(model, work, speed > 0.0 ? step / speed : 1e-3, [&](double s) {
      work.q = q;
      move_all(model, s * p, work);
      for (size_t i = 0; i < motion.size(); ++i) work.motion[i].value = motion[i].value + s * motion[i].rate;
      for (size_t i = 0; i < value.size(); ++i) work.expression_value[i] = value[i] + s * work.expression_rate[i];
    });
    for (Eigen::Index k = 0; k < n0; ++k) {
      A.row(mw.stiff[static_cast<size_t>(k)]) = along.row(k);
      b[mw.stiff[static_cast<size_t>(k)]] = -in_time[k];
    }
    work.q = q;
    work.motion = motion;
    work.expression_value = value;
    place(model, work);
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    const double size = A.row(k).cwiseAbs().maxCoeff();
    if (!(size > 0.0)) refuse_balance(model, work);
    A.row(k) /= size;
    b[k] /= size;
  }
  x.head(n) = solve_square(A, b);
  if (!x.allFinite()) refuse_balance(model, work);
  set_rates(model, p, x, work);

  // What nothing acts on rests, as long as nothing does.
  if (n == m.Z.cols()) return;
  RestForces rest;
  applied_forces(model, work, rest);
  for (Eigen::Index k = n; k < m.Z.cols(); ++k)
    if (std::abs(m.Z.col(k).dot(rest.force)) / m.scale[k] > 1e-9 * rest.scale)
      throw SimulationError(fmt::format("joint '{}' moves without inertia at t = {:.6g} s, driven by a force or a moment that no spring or damper meets at the start: give the bodies it carries "
                                        "mass or inertia, a spring in that direction, or fix the joint",
                                        model.parts[joint_of_rate(model, m.rates[static_cast<size_t>(k)])].joint.name, work.time));
}

void remove_massless_rates(const Model& model, VecX& w) {
  const MasslessRates& m = model.massless;
  const VecX before = w;
  for (size_t k = 0; k < m.rates.size(); ++k) w -= before[m.rates[k]] * m.Z.col(static_cast<Eigen::Index>(k));
}

void split_massless(const Model& model, Work& work) {
  const MasslessRates& m = model.massless;
  MasslessWork& mw = work.massless;
  mw = {};
  if (m.rates.empty()) return;
  const Eigen::Index n = m.moving;
  const VecX w = work.w;
  VecX force, p = w;
  MatX C;
  remove_massless_rates(model, p);
  damping_matrix(model, work, p, force, C);
  work.w = w;
  // Pivots of the damping matrix: where they end, no damper acts.
  MatX left = 0.5 * (C + C.transpose());
  const double largest = left.diagonal().maxCoeff();
  std::vector<char> damped(static_cast<size_t>(n), 0);
  while (largest > 0.0) {
    Eigen::Index at = 0;
    if (left.diagonal().maxCoeff(&at) <= 1e-10 * largest) break;
    damped[static_cast<size_t>(at)] = 1;
    mw.damped.push_back(static_cast<int>(at));
    const VecX column = left.col(at);
    left -= column * column.transpose() / column[at];
    left.row(at).setZero();
    left.col(at).setZero();
  }
  for (Eigen::Index k = 0; k < n; ++k)
    if (!damped[static_cast<size_t>(k)]) mw.stiff.push_back(static_cast<int>(k));
  const Eigen::Index n0 = static_cast<Eigen::Index>(mw.stiff.size()), n1 = n - n0;
  mw.undamped = MatX::Zero(n, n0);
  MatX Cd(n1, n1), Cs(n1, n0);
  for (Eigen::Index i = 0; i < n1; ++i) {
    for (Eigen::Index k = 0; k < n1; ++k) Cd(i, k) = C(mw.damped[static_cast<size_t>(i)], mw.damped[static_cast<size_t>(k)]);
    for (Eigen::Index k = 0; k < n0; ++k) Cs(i, k) = C(mw.damped[static_cast<size_t>(i)], mw.stiff[static_cast<size_t>(k)]);
  }
  const MatX follow = n0 > 0 && n1 > 0 ? solve_square(Cd, Cs) : MatX::Zero(n1, n0);
  for (Eigen::Index k = 0; k < n0; ++k) {
    mw.undamped(mw.stiff[static_cast<size_t>(k)], k) = 1.0;
    for (Eigen::Index i = 0; i < n1; ++i) mw.undamped(mw.damped[static_cast<size_t>(i)], k) = -follow(i, k);
  }
}

void update_massless_accelerations(System& system, double t, const VecX& y) {
  const Model& model = system.model;
  const MasslessRates& m = model.massless;
  if (m.rates.empty()) return;
  VecX dy(y.size());
  state_rate(system, t, y.data(), dy.data());
  // Short against what is output, long against the rounding of the rates (1e-12 of them).
  const double h = std::clamp(1e-5 * model.settings.duration, 1e-7, 1e-4);
  const auto rates_beside = [&](double s) {
    const VecX at = y + s * dy;
    set_state(system, t + s, at.data(), false);
    VecX out(m.Z.cols());
    for (size_t k = 0; k < m.rates.size(); ++k) out[static_cast<Eigen::Index>(k)] = system.work.w[m.rates[k]];
    return out;
  };
  const VecX before = rates_beside(-h), after = rates_beside(h);
  set_state(system, t, y.data(), true);
  system.work.wdot += m.Z * (after - before) / (2.0 * h);
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    update_base_acceleration(model, static_cast<int>(c), system.work);
    update_cluster_accelerations(model, static_cast<int>(c), system.work);
  }
}

bool follows_damper(const Model& model, const Work& work, int rate) {
  for (int k : work.massless.damped)
    if (model.massless.rates[static_cast<size_t>(k)] == rate) return true;
  return false;
}

double massless_decay(const Model& model, const Work& work) {
  const MasslessRates& m = model.massless;
  if (work.massless.damped.empty()) return 0.0;
  Work copy = work;
  VecX p = work.w, force;
  remove_massless_rates(model, p);
  MatX C;
  damping_matrix(model, copy, p, force, C);
  const Eigen::Index n = m.moving, n1 = static_cast<Eigen::Index>(work.massless.damped.size());
  MatX K(n, n), Cd(n1, n1), Kd(n1, n1);
  RestForces rest;
  const double h = 1e-6 * model.size;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = [&](double s) {
      copy.q = work.q;
      move_all(model, s / m.scale[k] * m.Z.col(k), copy);
      place(model, copy);
      return VecX((m.Z.leftCols(n).transpose() * forces_at_rest(model, copy, rest)).cwiseQuotient(m.scale.head(n)));
    };
    K.col(k) = (at(-h) - at(h)) / (2.0 * h);
  }
  for (Eigen::Index i = 0; i < n1; ++i)
    for (Eigen::Index k = 0; k < n1; ++k) {
      const int a = work.massless.damped[static_cast<size_t>(i)], b = work.massless.damped[static_cast<size_t>(k)];
      Cd(i, k) = C(a, b);
      Kd(i, k) = K(a, b);
    }
  return ComplexEigen(solve_square(Cd, Kd)).eigenvalues().cwiseAbs().maxCoeff();
}

void find_massless(System& system) {
  Model& model = system.model;
  Work& work = system.work;
  if (std::none_of(model.parts.begin(), model.parts.end(), weightless)) return;

  // The rates of trees on ground in which such a part stands; loops determine theirs by other means.
  std::vector<int> tree(model.parts.size());
  std::vector<char> concerned(model.parts.size(), 0);
  for (const Cluster& c : model.clusters)
    for (int i : c.parts) tree[i] = c.parent == ground ? c.parts.front() : tree[c.parent];
  for (size_t i = 0; i < model.parts.size(); ++i)
    if (weightless(model.parts[i])) concerned[tree[i]] = 1;
  std::vector<int> rates;
  std::vector<double> size;  // m per unit
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const Cluster& cluster = model.clusters[c];
    if (!cluster.loops.empty() || !concerned[tree[cluster.parts.front()]]) continue;
    for (int k = 0; k < cluster.nv; ++k)
      if (const double s = rate_scale(model, static_cast<int>(c), k); s > 0.0) {
        rates.push_back(cluster.v0 + k);
        size.push_back(s);
      }
  }
  const Eigen::Index nr = static_cast<Eigen::Index>(rates.size());
  if (nr == 0) return;

  // How the masses move at a unit (metre) of each rate: directions in which a body has inertia count alike, however much it is.
  std::vector<Mat6> inertial(model.parts.size(), Mat6::Zero());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    if (model.parts[i].body.mass == 0.0 && work.parts[i].terms.Mrr.isZero(0.0)) continue;
    Vec6 metre = Vec6::Ones();
    metre.tail<3>().setConstant(1.0 / model.size);
    const SymmetricEigen eigen(MatX(metre.asDiagonal() * work.parts[i].terms.Mrr * metre.asDiagonal()));
    for (int k = 0; k < 6; ++k)
      if (eigen.eigenvalues()[k] > 1e-12 * eigen.eigenvalues()[5])
        inertial[i] += metre.cwiseInverse().asDiagonal() * eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose() * metre.cwiseInverse().asDiagonal();
  }
  const auto masses_move = [&](const VecX& w) {
    const std::vector<TimeJet> motion = work.motion;
    const VecX before = work.w;
    for (TimeJet& jet : work.motion) jet.rate = jet.acceleration = 0.0;
    work.w = w;
    std::vector<Vec6> V;
    for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
    V.reserve(work.parts.size());
    for (const PartWork& p : work.parts) V.push_back(p.V);
    work.motion = motion;
    work.w = before;
    return V;
  };
  std::vector<std::vector<Vec6>> twist;
  twist.reserve(static_cast<size_t>(nr));
  for (Eigen::Index k = 0; k < nr; ++k) twist.push_back(masses_move(VecX::Unit(model.nv, rates[static_cast<size_t>(k)]) / size[static_cast<size_t>(k)]));
  MatX gram = MatX::Zero(nr, nr);
  for (size_t i = 0; i < model.parts.size(); ++i)
    for (Eigen::Index k = 0; k < nr; ++k) {
      const Vec6 there = inertial[i] * twist[static_cast<size_t>(k)][i];
      for (Eigen::Index l = 0; l <= k; ++l) gram(k, l) = gram(l, k) = gram(l, k) + twist[static_cast<size_t>(l)][i].dot(there);
    }
  const SymmetricEigen rest_of(gram);
  Eigen::Index free = 0;
  while (free < nr && rest_of.eigenvalues()[free] <= 1e-12 * std::max(rest_of.eigenvalues()[nr - 1], 1e-300)) ++free;
  if (free == 0) return;
  const MatX null = rest_of.eigenvectors().leftCols(free);

  // Stiffness and damping there.
  RestForces rest;
  const VecX q = work.q, w = work.w;
  const auto per_metre = [&](const VecX& all) {
    VecX out(nr);
    for (Eigen::Index k = 0; k < nr; ++k) out[k] = all[rates[static_cast<size_t>(k)]] / size[static_cast<size_t>(k)];
    return out;
  };
  const auto spread = [&](const VecX& metres) {
    VecX out = VecX::Zero(model.nv);
    for (Eigen::Index k = 0; k < nr; ++k) out[rates[static_cast<size_t>(k)]] = metres[k] / size[static_cast<size_t>(k)];
    return out;
  };
  const double h = 1e-6 * model.size;
  const auto force_beside = [&](const VecX& metres) {
    work.q = q;
    move_all(model, spread(metres), work);
    place(model, work);
    return per_metre(forces_at_rest(model, work, rest));
  };
  const auto force_moving = [&](const VecX& metres) {
    work.w = spread(metres);
    for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
    applied_forces(model, work, rest);
    return per_metre(rest.force);
  };
  double largest = 0.0;
  MatX Kn(nr, free), Cn(nr, free);
  for (Eigen::Index k = 0; k < free; ++k) {
    Kn.col(k) = (force_beside(-h * null.col(k)) - force_beside(h * null.col(k))) / (2.0 * h);
    largest = std::max(largest, rest.scale);
  }
  work.q = q;
  place(model, work);
  for (Eigen::Index k = 0; k < free; ++k) Cn.col(k) = 0.5 * (force_moving(-null.col(k)) - force_moving(null.col(k)));
  work.w = w;
  // Directions along which a force changes when anything moves. (Out of balance the matrix is not symmetric: the force on a point turns with the body's axes.)
  const auto range = [&](const MatX& part) {
    const ThinSvd svd(null.transpose() * part);
    MatX projector = MatX::Zero(free, free);
    const double most = svd.singularValues()[0];
    for (Eigen::Index k = 0; k < free; ++k)
      if (svd.singularValues()[k] > 1e-9 * most && most * model.size > 1e-9 * largest) projector += svd.matrixU().col(k) * svd.matrixU().col(k).transpose();
    return projector;
  };
  const SymmetricEigen acted(range(Kn) + range(Cn));
  Eigen::Index idle = 0;
  while (idle < free && acted.eigenvalues()[idle] < 1e-6) ++idle;
  if (idle == free) return;
  const MatX moving = null * acted.eigenvectors().rightCols(free - idle);
  // Of what nothing acts on only the massless parts' own joints are held here; what turns on bodies with mass keeps its rate (dynamics.cpp).
  MatX resting = null * acted.eigenvectors().leftCols(idle);
  if (idle > 0) {
    MatX others = resting;
    for (Eigen::Index k = 0; k < nr; ++k)
      if (weightless(model.parts[joint_of_rate(model, rates[static_cast<size_t>(k)])])) others.row(k).setZero();
    const SymmetricEigen own(others.transpose() * others);
    Eigen::Index count = 0;
    while (count < idle && own.eigenvalues()[count] < 1e-12) ++count;
    resting = (resting * own.eigenvectors().leftCols(count)).eval();
  }

  // The rates that the springs and dampers act on most carry the directions: identity on them.
  MatX Z(nr, moving.cols() + resting.cols());
  Z << moving, resting;
  VecX weight(nr);
  for (Eigen::Index k = 0; k < nr; ++k) {
    const VecX unit = VecX::Unit(nr, k);
    weight[k] = std::abs((force_beside(-h * unit) - force_beside(h * unit))[k]) / (2.0 * h);
  }
  work.q = q;
  place(model, work);
  VecX resist(nr);
  for (Eigen::Index k = 0; k < nr; ++k) resist[k] = 0.5 * std::abs((force_moving(-VecX::Unit(nr, k)) - force_moving(VecX::Unit(nr, k)))[k]);
  work.w = w;
  weight = (weight / std::max(weight.maxCoeff(), 1e-300) + resist / std::max(resist.maxCoeff(), 1e-300)).array() + 1e-6;
  for (Eigen::Index k = 0; k < nr; ++k) {
    const Part& p = model.parts[joint_of_rate(model, rates[static_cast<size_t>(k)])];
    // The massless body's own joint by preference, and one whose value nobody gives.
    if (weightless(p)) weight[k] *= 10.0;
    if (p.joint.scene_joint >= 0 && system.scene.joints[static_cast<size_t>(p.joint.scene_joint)].initial.value) weight[k] *= 1e-3;
  }
  MasslessRates& m = model.massless;
  std::vector<Eigen::Index> row(static_cast<size_t>(Z.cols()));
  std::vector<char> used(static_cast<size_t>(Z.cols()), 0), taken(static_cast<size_t>(nr), 0);
  for (Eigen::Index step = 0; step < Z.cols(); ++step) {
    Eigen::Index at = -1, column = -1;
    double best = -1.0;
    for (Eigen::Index c = step < moving.cols() ? 0 : moving.cols(); c < (step < moving.cols() ? moving.cols() : Z.cols()); ++c)
      for (Eigen::Index r = 0; r < nr && !used[static_cast<size_t>(c)]; ++r)
        // To a thousandth alike, the first one.
        if (!taken[static_cast<size_t>(r)] && weight[r] * std::abs(Z(r, c)) > (1.0 + 1e-3) * best) best = weight[r] * std::abs(Z(r, c)), at = r, column = c;
    used[static_cast<size_t>(column)] = taken[static_cast<size_t>(at)] = 1;
    row[static_cast<size_t>(column)] = at;
    Z.col(column) /= Z(at, column);
    for (Eigen::Index c = 0; c < Z.cols(); ++c)
      if (c != column) Z.col(c) -= (Z(at, c) * Z.col(column)).eval();
  }
  for (Eigen::Index r = 0; r < nr; ++r)
    for (Eigen::Index c = 0; c < Z.cols(); ++c)
      if (std::abs(Z(r, c)) < 1e-9) Z(r, c) = 0.0;
  m.Z = MatX::Zero(model.nv, Z.cols());
  m.scale.resize(Z.cols());
  m.moving = static_cast<int>(moving.cols());
  for (Eigen::Index c = 0; c < Z.cols(); ++c) {
    m.rates.push_back(rates[static_cast<size_t>(row[static_cast<size_t>(c)])]);
    m.scale[c] = size[static_cast<size_t>(row[static_cast<size_t>(c)])];
    m.Z.col(c) = m.scale[c] * spread(Z.col(c));
    m.Z(m.rates.back(), c) = 1.0;
  }
  const std::string names = joints_of(model, m.rates), file = system.scene.file.string();

  // The same everywhere?
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  VecX away(nr);
  for (Eigen::Index k = 0; k < nr; ++k) away[k] = uniform(random) * model.size;
  work.q = q;
  move_all(model, spread(away), work);
  place(model, work);
  double moved = 0.0;
  for (Eigen::Index c = 0; c < Z.cols(); ++c) {
    const std::vector<Vec6> V = masses_move(m.Z.col(c) / m.scale[c]);
    for (size_t i = 0; i < V.size(); ++i) moved = std::max(moved, V[i].dot(inertial[i] * V[i]));
  }
  work.q = q;
  place(model, work);
  for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
  if (moved > 1e-16)
    throw InputError(fmt::format("{}: joint {}: what has no mass there can move without any mass moving, in a way that changes with the position; that is solved for parallel slides, for turns "
                                 "about one axis and for massless bodies at the end of a tree only: give it a mass", file, names));
  for (size_t v = 0; v < static_cast<size_t>(model.nv); ++v) {
    if (m.Z.row(static_cast<Eigen::Index>(v)).isZero(0.0)) continue;
    const TreeJoint& j = model.parts[joint_of_rate(model, static_cast<int>(v))].joint;
    if (j.friction)
      throw InputError(fmt::format("{}: joint '{}' has friction and moves without any mass moving (joint {}): friction that is overcome would make it jump; give the body there a mass, or damping instead of friction",
                                   file, j.name, names));
  }

  // Locked with rates of their own.
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
  update_expressions(model, work.time, work);
  place(model, work);
  split_massless(model, work);
  remove_massless_rates(model, work.w);
  try {
    update_positions(model, work);
    update_velocities(model, work);
  } catch (const SimulationError& error) {
    throw InputError(fmt::format("{}: {}", file, error.what()));
  }
  const MasslessWork& mw = work.massless;
  if (!mw.stiff.empty()) {
    const SymmetricEigen stiffness(0.5 * (mw.stiffness + mw.stiffness.transpose()), Eigen::EigenvaluesOnly);
    if (mw.stiffness.rows() > 0 && stiffness.eigenvalues()[0] <= 0.0 && Z.cols() == 1)
      throw InputError(fmt::format("{}: joint {}: the balance of the springs there is unstable, and what moves has no mass: it would jump away; turn the spring round, or give it a mass", file, names));
  }
  const double change = (work.q - q).size() > 0 ? (work.q - q).cwiseAbs().maxCoeff() : 0.0;
  system.notes.push_back(fmt::format("joint {}: what moves there has no mass; its coordinates {}{}", names,
                                     mw.stiff.empty() ? "follow from the balance of springs, dampers and forces, in first order"
                                     : mw.damped.empty() ? "follow from the balance of springs and forces at every time"
                                                         : "follow from the balance of springs, dampers and forces",
                                     change > 1e-9 * model.size ? fmt::format("; moved by up to {:.3g} (rad or m) at the start", change) : ""));
}

}  // namespace flexframe::sim
