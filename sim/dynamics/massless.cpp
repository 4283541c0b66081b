#include "sim/dynamics/massless.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/massless_forces.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {

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

void place_all(const Model& model, Work& work) {
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

namespace {

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
    place_all(model, work);
    out += factor / (12.0 * step) * imbalance(model, work, rest);
  }
  return out;
}

[[noreturn]] void refuse_balance(const Model& model, const Work& work) {
  std::vector<int> rates;
  rates.reserve(work.massless.stiff.size());
  for (int k : work.massless.stiff) rates.push_back(model.massless.rates[k]);
  throw SimulationError(
      fmt::format("joint {}: the springs of the massless bodies there have no equilibrium near the last one at t = {:.6g} s: the bodies "
                  "snap through, or move in a direction that no spring holds; give them a mass, or put a damper parallel to the spring",
                  joints_of(model, rates), work.time));
}

// Velocities from the rates in work.w, with the locked ones at rest.
void rest_locked(const Model& model, Work& work) {
  for (ClusterWork& cw : work.clusters) cw.lock_rate.setZero();
  for (size_t c = 0; c < model.clusters.size(); ++c) close_velocities(model, static_cast<int>(c), work);
}

// Coordinates of what only springs hold, at the other coordinates.
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
      const int at = mw.stiff[k];
      dw[m.rates[at]] = metres[k] / m.scale[at];
    }
    move_all(model, dw, work);
    place_all(model, work);
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
      place_all(model, work);
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

// True rates from p in work.w, at true coordinates.
void balance_rates(const Model& model, Work& work) {
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
      for (int v = 0; v < model.clusters[c].nv; ++v)
        speed = std::max(speed, std::abs(p[model.clusters[c].v0 + v]) * std::max(1e-3, rate_scale(model, static_cast<int>(c), v)));
    for (const TimeJet& jet : motion) speed = std::max(speed, std::abs(jet.rate) * model.size);
    const VecX in_time = derivative(model, work, speed > 0.0 ? step / speed : 1e-3, [&](double s) {
      work.q = q;
      move_all(model, s * p, work);
      for (size_t i = 0; i < motion.size(); ++i) work.motion[i].value = motion[i].value + s * motion[i].rate;
      for (size_t i = 0; i < value.size(); ++i) work.expression_value[i] = value[i] + s * work.expression_rate[i];
    });
    for (Eigen::Index k = 0; k < n0; ++k) {
      A.row(mw.stiff[k]) = along.row(k);
      b[mw.stiff[k]] = -in_time[k];
    }
    work.q = q;
    work.motion = motion;
    work.expression_value = value;
    place_all(model, work);
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
      throw SimulationError(
          fmt::format("a load acts on joint '{}', which moves without inertia, at t = {:.6g} s, and no spring or damper opposes it: give "
                      "the bodies that it moves mass or inertia, add a spring in that direction, or fix the joint",
                      model.parts[joint_of_rate(model, m.rates[k])].joint.name, work.time));
}

}  // namespace

void expand_rates(const Model& model, Work& work) {
  if (all_have_inertia(model)) return;
  balance_positions(model, work);
  rest_locked(model, work);
  balance_rates(model, work);
}

void reduce_rates(const Model& model, VecX& w) {
  const MasslessRates& m = model.massless;
  const VecX before = w;
  for (size_t k = 0; k < m.rates.size(); ++k) w -= before[m.rates[k]] * m.Z.col(static_cast<Eigen::Index>(k));
}

VecX massless_part(const Model& model, const VecX& w) { return model.massless.Z * w(model.massless.rates); }

void renew_motion(const Model& model, Work& work) {
  reduce_rates(model, work.w);
  update_positions(model, work);
  update_velocities(model, work);
  expand_rates(model, work);
}

void renew_dampers(const Model& model, Work& work) {
  if (all_have_inertia(model)) return;
  split_massless(model, work);
  renew_motion(model, work);
}

void keep_balance(const Work& old, Work& work) {
  work.massless = old.massless;
  work.expression_rate = old.expression_rate;
}

bool all_have_inertia(const Model& model) { return model.massless.rates.empty(); }

void split_massless(const Model& model, Work& work) {
  const MasslessRates& m = model.massless;
  MasslessWork& mw = work.massless;
  mw = {};
  if (m.rates.empty()) return;
  const Eigen::Index n = m.moving;
  const VecX w = work.w;
  VecX force, p = w;
  MatX C;
  reduce_rates(model, p);
  damping_matrix(model, work, p, force, C);
  work.w = w;
  // Pivots of the damping matrix: where they end, no damper acts.
  MatX left = 0.5 * (C + C.transpose());
  const double largest = left.diagonal().maxCoeff();
  std::vector<char> damped(n, 0);
  while (largest > 0.0) {
    Eigen::Index at = 0;
    if (left.diagonal().maxCoeff(&at) <= 1e-10 * largest) break;
    damped[at] = 1;
    mw.damped.push_back(static_cast<int>(at));
    const VecX column = left.col(at);
    left -= column * column.transpose() / column[at];
    left.row(at).setZero();
    left.col(at).setZero();
  }
  for (Eigen::Index k = 0; k < n; ++k)
    if (!damped[k]) mw.stiff.push_back(static_cast<int>(k));
  const Eigen::Index n0 = static_cast<Eigen::Index>(mw.stiff.size()), n1 = n - n0;
  mw.undamped = MatX::Zero(n, n0);
  MatX Cd(n1, n1), Cs(n1, n0);
  for (Eigen::Index i = 0; i < n1; ++i) {
    for (Eigen::Index k = 0; k < n1; ++k) Cd(i, k) = C(mw.damped[i], mw.damped[k]);
    for (Eigen::Index k = 0; k < n0; ++k) Cs(i, k) = C(mw.damped[i], mw.stiff[k]);
  }
  const MatX follow = n0 > 0 && n1 > 0 ? solve_square(Cd, Cs) : MatX::Zero(n1, n0);
  for (Eigen::Index k = 0; k < n0; ++k) {
    mw.undamped(mw.stiff[k], k) = 1.0;
    for (Eigen::Index i = 0; i < n1; ++i) mw.undamped(mw.damped[i], k) = -follow(i, k);
  }
}

bool follows_damper(const Model& model, const Work& work, int rate) {
  for (int k : work.massless.damped)
    if (model.massless.rates[k] == rate) return true;
  return false;
}

double massless_decay(const Model& model, const Work& work) {
  const MasslessRates& m = model.massless;
  if (work.massless.damped.empty()) return 0.0;
  Work copy = work;
  VecX p = work.w, force;
  reduce_rates(model, p);
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
      place_all(model, copy);
      return VecX((m.Z.leftCols(n).transpose() * forces_at_rest(model, copy, rest)).cwiseQuotient(m.scale.head(n)));
    };
    K.col(k) = (at(-h) - at(h)) / (2.0 * h);
  }
  for (Eigen::Index i = 0; i < n1; ++i)
    for (Eigen::Index k = 0; k < n1; ++k) {
      const int a = work.massless.damped[i], b = work.massless.damped[k];
      Cd(i, k) = C(a, b);
      Kd(i, k) = K(a, b);
    }
  return ComplexEigen(solve_square(Cd, Kd)).eigenvalues().cwiseAbs().maxCoeff();
}

std::optional<double> balance_energy(const Model& model, double share, double slow) {
  if (all_have_inertia(model)) return std::nullopt;
  double energy = 0.0;
  const auto add = [&](double stiffness, double damping, double reach) {
    energy = std::max(energy, (stiffness + damping * slow) * std::pow(share * reach, 2));
  };
  for (const Part& p : model.parts)
    if (p.joint.spring && p.joint.nv > 0)
      add(p.joint.spring->stiffness, p.joint.spring->damping, is_length(p.joint.kind, 0) ? model.size : 1.0);
  for (const Load& load : model.loads) {
    if (load.def.kind == ForceKind::spring_damper) add(load.def.spring.stiffness, load.def.spring.damping, model.size);
    if (load.def.kind == ForceKind::bushing)
      add(load.def.bushing_stiffness.head<3>().maxCoeff(), load.def.bushing_damping.head<3>().maxCoeff(), model.size);
  }
  return energy;
}

}  // namespace flexframe::sim
