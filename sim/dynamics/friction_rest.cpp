#include "sim/dynamics/friction_rest.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// A rate that moves another by less than this share of its own does so by rounding: rows that cancel leave a few digits of 1e-16.
constexpr double cancelled = 1e-9;
// Of the largest mobility: what is less is the rounding of rates that others hold.
constexpr double independent = 1e-12;
// And of slopes of its energy, against bounds that are a 1e-9 apart (share_out).
constexpr double rounding = 1e-14;
// Share of what a joint could hold below which nothing is said of how it is shared out.
constexpr double pressing = 0.01;

// A point and the direction of its slip have only just been found; it counts with its static friction until it moves.
struct Trial {
  FrictionPoint* point;
  FrictionPhase before;
  Friction law;
};

// Whether the points of `trials`, in their present phases, all accelerate the way they are to slip; `largest`: of their accelerations so
// far, a point each.
bool slips_on(const Model& model, FrictionState& friction, const std::vector<Trial>& trials, Work& work, VecX& largest) {
  try {
    update_friction_accelerations(model, friction, work);
  } catch (const SimulationError&) {
    return false;  // it jams that way
  }
  bool all = true;
  for (size_t k = 0; k < trials.size(); ++k) {
    const FrictionPoint& p = *trials[k].point;
    const double a = work.wdot[model.parts[p.part].v0 + p.rate];
    double& size = largest[static_cast<Eigen::Index>(k)];
    size = std::max(size, std::abs(a));
    all = all && a * direction(p) > 1e-9 * size;
  }
  return all;
}

}  // namespace

bool turn_round(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work) {
  if (resting.empty() || resting.size() > 4) return false;
  std::vector<Trial> trials;
  for (int k : resting) {
    FrictionPoint& p = friction.points[k];
    if (p.phase != FrictionPhase::forward && p.phase != FrictionPhase::backward) return false;
    trials.push_back({&p, p.phase, p.law});
  }
  for (FrictionPoint& p : friction.points) {
    // What comes to rest with them (rates in proportion to one another) takes part.
    if ((p.phase != FrictionPhase::forward && p.phase != FrictionPhase::backward) ||
        std::abs(rate_of(p, model, work.w)) > at_rest / no_speed * friction_rounding(p, friction, model))
      continue;
    if (std::none_of(trials.begin(), trials.end(), [&](const Trial& t) { return t.point == &p; })) trials.push_back({&p, p.phase, p.law});
  }
  if (trials.size() > 4) return false;
  for (Trial& t : trials) t.point->law.coefficient = static_coefficient(t.law);
  VecX largest = VecX::Zero(static_cast<Eigen::Index>(trials.size()));
  unsigned chosen = 0;
  int ways = 0;
  // Twice: the largest accelerations of all ways are what a small one is measured against.
  for (int pass = 0; pass < 2; ++pass) {
    ways = 0;
    for (unsigned way = 0; way < 1u << trials.size(); ++way) {
      for (size_t k = 0; k < trials.size(); ++k) trials[k].point->phase = way >> k & 1u ? FrictionPhase::backward : FrictionPhase::forward;
      if (slips_on(model, friction, trials, work, largest)) chosen = way, ++ways;
    }
  }
  for (size_t k = 0; k < trials.size(); ++k) {
    trials[k].point->law = trials[k].law;
    trials[k].point->phase = ways != 1 ? trials[k].before : chosen >> k & 1u ? FrictionPhase::backward : FrictionPhase::forward;
  }
  return ways == 1;
}

void follow_fastest(const Model& model, FrictionState& friction, const Work& work) {
  for (const FrictionPoint& p : friction.points)
    friction.fastest = std::max(friction.fastest, std::abs(rate_of(p, model, work.w)) * rate_scale(model, p.cluster, p.local));
}

double friction_rounding(const FrictionPoint& p, const FrictionState& friction, const Model& model) {
  return p.phase == FrictionPhase::stick ? 0.0 : no_speed * friction.fastest / rate_scale(model, p.cluster, p.local);
}

bool held_by_locks(const FrictionPoint& p, const FrictionState& friction, const Model& model, const Work& work) {
  const ClusterWork& cw = work.clusters[p.cluster];
  if (cw.locked.size() == static_cast<size_t>(cw.carried)) return false;
  const double scale = rate_scale(model, p.cluster, p.local);
  if (std::abs(rate_of(p, model, work.w)) * scale > at_rest * friction.fastest) return false;
  const std::vector<int>& dep = cw.partition.dep;
  const auto at = std::find(dep.begin(), dep.end(), p.local);
  if (at == dep.end()) return false;
  // The free rates of the cluster do not move it.
  for (size_t k = 0; k < cw.partition.ind.size(); ++k) {
    const double per = cw.E(at - dep.begin(), static_cast<Eigen::Index>(k));
    if (std::abs(per) * scale > cancelled * rate_scale(model, p.cluster, cw.partition.ind[k])) return false;
  }
  return true;
}

Shares least_acceleration(const MatX& A, const VecX& a0, const VecX& bounds) {
  const Eigen::Index n = a0.size();
  // min |G x + c|, x = f / bounds within -1 .. 1 (Stark and Parker, bounded-variable least squares, 1995), from x = 0 on.
  const MatX scaled = bounds.asDiagonal() * A * bounds.asDiagonal();
  const SymmetricEigen eigen(scaled);
  const double largest = std::max(eigen.eigenvalues().maxCoeff(), 0.0);
  VecX root = VecX::Zero(n), inverse = VecX::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i)
    if (eigen.eigenvalues()[i] > independent * largest) root[i] = std::sqrt(eigen.eigenvalues()[i]), inverse[i] = 1.0 / root[i];
  const MatX G = root.asDiagonal() * eigen.eigenvectors().transpose();
  const VecX c = inverse.asDiagonal() * eigen.eigenvectors().transpose() * bounds.cwiseProduct(a0);
  Shares out{std::vector<Shares::Place>(static_cast<size_t>(n), Shares::idle), VecX::Zero(n), a0};
  VecX x = VecX::Zero(n);
  for (Eigen::Index step = 0; step < 20 * n; ++step) {
    const VecX slope = G.transpose() * (G * x + c);
    Eigen::Index next = -1;
    double most = rounding * std::max(largest, (G.transpose() * c).cwiseAbs().maxCoeff());
    for (Eigen::Index k = 0; k < n; ++k) {
      const Shares::Place place = out.place[static_cast<size_t>(k)];
      const double gain = place == Shares::idle ? std::abs(slope[k]) : place == Shares::bound ? slope[k] * x[k] : 0.0;
      if (gain > most) most = gain, next = k;
    }
    if (next < 0) break;
    out.place[static_cast<size_t>(next)] = Shares::between;
    for (;;) {
      std::vector<Eigen::Index> free;
      VecX fixed = x;
      for (Eigen::Index k = 0; k < n; ++k)
        if (out.place[static_cast<size_t>(k)] == Shares::between) free.push_back(k), fixed[k] = 0.0;
      if (free.empty()) break;
      MatX columns(n, static_cast<Eigen::Index>(free.size()));
      for (size_t k = 0; k < free.size(); ++k) columns.col(static_cast<Eigen::Index>(k)) = G.col(free[k]);
      const VecX best = least_squares(columns, VecX(-(G * fixed + c)));
      // As far towards it as the first bound.
      double part = 1.0;
      size_t first = free.size();
      for (size_t k = 0; k < free.size(); ++k) {
        const double to = best[static_cast<Eigen::Index>(k)], from = x[free[k]];
        if (std::abs(to) <= 1.0) continue;
        if (const double at = (std::copysign(1.0, to) - from) / (to - from); at < part) part = at, first = k;
      }
      for (size_t k = 0; k < free.size(); ++k) x[free[k]] += part * (best[static_cast<Eigen::Index>(k)] - x[free[k]]);
      if (first == free.size()) break;
      x[free[first]] = std::copysign(1.0, best[static_cast<Eigen::Index>(first)]);
      out.place[static_cast<size_t>(free[first])] = Shares::bound;
    }
  }
  out.force = bounds.cwiseProduct(x);
  out.acceleration += A * out.force;
  return out;
}

std::vector<int> openly_held(const Model& model, const FrictionState& friction, Work& work) {
  std::vector<char> open(friction.points.size(), 0);
  std::vector<int> out;
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    if (cw.locked.size() == static_cast<size_t>(cw.carried)) continue;
    const int cluster = static_cast<int>(c), rows = closure_row_count(model, work, cluster),
              first = rows - static_cast<int>(cw.locked.size());
    const Partition& now = cw.partition;
    const Eigen::Index nd = static_cast<Eigen::Index>(now.dep.size());
    const auto dependent = [&](int rate) { return std::find(now.dep.begin(), now.dep.end(), rate) - now.dep.begin(); };
    for (const FrictionPoint& p : friction.points) {
      if (p.cluster != cluster || p.phase == FrictionPhase::regularised) continue;
      // One that rests, but carries nothing by a row of its own: a unit of its force can be taken by these locks instead.
      const auto lock = std::find(cw.locked.begin(), cw.locked.end(), p.local);
      const int row = lock == cw.locked.end() ? -1 : first + static_cast<int>(lock - cw.locked.begin());
      const bool own = row >= 0 && std::find(now.rows.begin(), now.rows.end(), row) != now.rows.end();
      if (own || dependent(p.local) == nd || (row < 0 && !held_by_locks(p, friction, model, work))) continue;
      const VecX balance = cw.Gd.row(dependent(p.local)).transpose();
      const double most = balance.cwiseAbs().maxCoeff();
      for (size_t k = 0; k < friction.points.size(); ++k) {
        const FrictionPoint& other = friction.points[k];
        const auto held = std::find(cw.locked.begin(), cw.locked.end(), other.local);
        if (other.cluster != cluster || held == cw.locked.end()) continue;
        const auto at = std::find(now.rows.begin(), now.rows.end(), first + static_cast<int>(held - cw.locked.begin()));
        if (at != now.rows.end() && std::abs(balance[at - now.rows.begin()]) > cancelled * most) open[k] = true;
      }
      open[static_cast<size_t>(&p - friction.points.data())] = true;
    }
  }
  bool pressed = false;
  for (size_t k = 0; k < friction.points.size(); ++k) {
    const FrictionPoint& p = friction.points[k];
    if (!open[k]) continue;
    const double force = p.phase == FrictionPhase::stick ? p.hold : work.joints[p.part].friction[p.rate];
    pressed = pressed || std::abs(force) > pressing * static_coefficient(p.law) * p.normal * p.arm;
    if (std::find(out.begin(), out.end(), p.part) == out.end()) out.push_back(p.part);
  }
  return pressed ? out : std::vector<int>();
}

bool any_sticks(const FrictionState& friction) {
  return std::any_of(friction.points.begin(), friction.points.end(),
                     [](const FrictionPoint& p) { return p.phase == FrictionPhase::stick; });
}

}  // namespace flexframe::sim
