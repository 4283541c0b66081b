#include "sim/run/stop_reasons.h"

#include "sim/dynamics/closure.h"
#include "sim/dynamics/contacts.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/dynamics/signals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Friction by reaction that slides and is fed by its own reaction; empty where none slides.
std::string self_locking(const System& system) {
  const FrictionPoint* worst = nullptr;
  for (const FrictionPoint& p : system.friction.points)
    if (p.law.reaction && p.phase != FrictionPhase::stick && (!worst || p.normal > worst->normal)) worst = &p;
  if (!worst) return "";
  return fmt::format(
      "joint '{}' is self-locking (Painleve): its reaction grows with its friction (now {:.3g} N); lower the coefficient, give "
      "normal_force as a number, or give friction a velocity scale (regularised)",
      system.model.parts[worst->part].joint.name, worst->normal);
}

// A loop near a position in which the driven rates grow without bound; empty where there is none.
std::string limit_of_reach(const System& system) {
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const Cluster& cluster = system.model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    if (!has_closure(cluster)) continue;
    const auto speed = [&](int rate) {
      return std::abs(system.work.w[cluster.v0 + rate]) * rate_scale(system.model, static_cast<int>(c), rate);
    };
    double driving = 0.0, driven = 0.0;
    for (int k : cw.partition.ind) driving = std::max(driving, speed(k));
    for (int k : cw.partition.dep) driven = std::max(driven, speed(k));
    for (int i : cluster.parts)
      if (const int motion = system.model.parts[i].joint.motion; motion >= 0)
        driving = std::max(driving, std::abs(system.work.motion[motion].rate) * cluster.size);
    if (driven > 100.0 * driving)
      return fmt::format(
          "the mechanism is at the limit of its reach, where the rates in the loop of {} grow without bound; if it should go on, "
          "another way to assemble the loop may be meant: choose it by initial = {{ guess = ... }}",
          closure_of(system.model, cluster));
  }
  return "";
}

// A rate whose inertia, with the others free, has almost gone; empty where none has.
std::string moves_without_inertia(const System& system) {
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const ClusterWork& cw = system.work.clusters[c];
    const MatX& L = cw.L;
    for (size_t k = 0; k < cw.partition.ind.size() && L.rows() == cw.inertia.size(); ++k) {
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      const int rate = cw.partition.ind[k];
      if (i >= L.rows()) continue;
      const double whole = std::max(cw.inertia[i], system.model.mass * std::pow(rate_scale(system.model, static_cast<int>(c), rate), 2));
      if (L(i, i) * L(i, i) > 1e-6 * whole) continue;
      for (const Part& p : system.model.parts)
        if (const int v = system.model.clusters[c].v0 + rate; v >= p.v0 && v < p.v0 + p.joint.nv)
          return fmt::format(
              "joint '{}' reaches a position in which it moves almost without inertia: give the bodies that it moves mass or inertia",
              p.joint.name);
    }
  }
  return "";
}

}  // namespace

std::string likely_cause(System system, double t, const VecX& y, const std::string& complaint) {
  if (!complaint.empty()) return complaint;
  try {
    set_state(system, t, y.data(), true);
  } catch (const SimulationError& error) {
    return error.what();
  }
  for (const auto reason : {self_locking, limit_of_reach, moves_without_inertia})
    if (std::string words = reason(system); !words.empty()) return words;
  return "an acceleration grows without bound";
}

int lost_inertia(System& system) {
  try {
    if (system.plane) {
      PlaneWork work(system.work, *system.plane);
      complete_mass_matrices(system.model, work);
    } else {
      complete_mass_matrices(system.model, system.work);
    }
  } catch (const SimulationError&) {
    if (system.work.indefinite >= 0) return system.work.indefinite;
  }
  int lost = -1;
  double least = 1e-3;
  for (size_t c = 0; c < system.model.clusters.size(); ++c) {
    const Cluster& cluster = system.model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    const MatX& L = cw.L;
    for (size_t k = 0; k < cw.partition.ind.size() && L.rows() == static_cast<Eigen::Index>(cw.partition.ind.size()); ++k)
      for (int i : cluster.parts) {
        const Part& p = system.model.parts[i];
        const int e = cluster.v0 + cw.partition.ind[k] - p.ev0;
        if (e < 0 || e >= p.body.n || p.body.Me(e, e) <= 0.0) continue;
        const double pivot = L(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)), left = pivot * pivot / p.body.Me(e, e);
        if (left < least) least = left, lost = i;
      }
  }
  return lost;
}

std::string unsettled_phases(const System& system, const std::vector<int>& directions) {
  std::string names;
  const auto add = [&](int part) { names += fmt::format("{}'{}'", names.empty() ? "" : ", ", system.model.parts[part].joint.name); };
  for (size_t k = 0; k < system.friction.points.size(); ++k)
    if (directions[k] < 0) add(system.friction.points[k].part);
  for (size_t k = 0; k < system.stops.size(); ++k)
    if (directions[system.friction.points.size() + 2 * k] < 0 || directions[system.friction.points.size() + 2 * k + 1] < 0)
      add(system.stops[k]);
  const size_t switches = system.friction.points.size() + 2 * system.stops.size(), contacts = switches + switch_count(system.model);
  for (size_t k = contacts; k < directions.size(); ++k)
    if (directions[k] < 0)
      return fmt::format("{} goes endlessly between its states; give it damping, its friction too, or a smaller stiffness",
                         contact_name(system.model, static_cast<int>((k - contacts) / 3)));
  for (size_t k = switches; k < contacts && names.empty(); ++k)
    if (directions[k] < 0)
      return fmt::format(
          "{} switches endlessly: both pieces of its expression drive it back over the threshold between them; make the step in it steep "
          "instead of sharp (tanh(v/0.01) for sign(v)), or let a joint's friction or stop do it",
          switch_owner(system.model, static_cast<int>(k - switches)).owner);
  return fmt::format(
      "friction or stop of joint {} switches endlessly between its states, no force satisfies any of them; give friction a velocity scale "
      "(regularised), or the stop damping",
      names);
}

}  // namespace flexframe::sim
