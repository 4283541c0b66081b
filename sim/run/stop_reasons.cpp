#include "sim/run/stop_reasons.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/contacts.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/dynamics/signals.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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

// A loop near a position in which rates grow without bound against those that make them: those of prescribed motions, or its independent
// ones. Empty where there is none. That rates are fast says nothing: deformations may make them.
std::string limit_of_reach(const System& system) {
  constexpr double without_bound = 100.0;
  const Model& model = system.model;
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const Cluster& cluster = model.clusters[c];
    const ClusterWork& cw = system.work.clusters[c];
    if (!has_closure(cluster) || cw.partition.dep.empty()) continue;
    const int at = static_cast<int>(c);
    double driving = 0.0, driven = 0.0;
    for (size_t k = 0; k < cw.partition.dep.size(); ++k)
      driven = std::max(driven, std::abs(cw.e0[static_cast<Eigen::Index>(k)]) * rate_scale(model, at, cw.partition.dep[k]));
    for (const int i : cluster.parts)
      if (const TreeJoint& joint = model.parts[static_cast<size_t>(i)].joint; joint.motion >= 0)
        driving = std::max(driving, std::abs(system.work.motion[joint.motion].rate) * (is_length(joint.kind, 0) ? 1.0 : cluster.size));
    if ((driving > 0.0 && driven > without_bound * driving) || partition_growth(model, at, system.work) > without_bound)
      return fmt::format(
          "the mechanism is at the limit of its reach, where the rates in the loop of {} grow without bound; if it should go on, "
          "another way to assemble the loop may be meant: choose it by initial = {{ guess = ... }}",
          closure_of(model, cluster));
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

// The direction of a cluster's independent rates along which deformation leaves least of the kinetic energy, that with undeformed masses 1;
// empty where it leaves a tenth everywhere. D: reduced mass matrix, `undeformed` the same with undeformed masses.
VecX lost_direction(const MatX& D, const MatX& undeformed) {
  if (D.rows() == 0 || D.rows() != undeformed.rows()) return {};
  const GeneralizedEigen eigen(D, undeformed);
  // Adams and DIRK come to rest where a billionth is left, the exponential method at loose tolerances where 4 % are: it linearises. Where
  // something else makes the steps small, this costs one run more.
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] > 0.1) return {};
  return eigen.eigenvectors().col(0);
}

// Of the bodies that move along `direction` of a cluster's independent rates the one from whose kinetic energy deformation takes most. The
// positions in `system` are known.
int most_deformed(System& system, size_t cluster, const VecX& direction) {
  const Model& model = system.model;
  Work& work = system.work;
  for (TimeJet& motion : work.motion) motion.rate = 0.0;
  work.w.setZero();
  const std::vector<int>& ind = work.clusters[cluster].partition.ind;
  for (size_t k = 0; k < ind.size(); ++k) work.w[model.clusters[cluster].v0 + ind[k]] = direction[static_cast<Eigen::Index>(k)];
  update_velocities(model, work);
  int lost = -1;
  double most = 0.0;
  for (const int i : work.carrying.deforming) {
    PartWork& p = work.parts[static_cast<size_t>(i)];
    const FlexibleBody& body = kinetics(model, work, i);
    // The complete energy of an axis is lost nowhere.
    if (body.axis.root_mass.size() > 0 || body.rod) continue;
    update_mass(body, p.q, p.terms);
    const double now = kinetic_energy(body, p.terms, p.V, p.qd);
    update_mass(body, VecX::Zero(body.n), p.terms);
    if (const double taken = kinetic_energy(body, p.terms, p.V, p.qd) - now; taken > most) most = taken, lost = i;
  }
  return lost;
}

std::string words_of_lost(const Part& part, double t) {
  return fmt::format(
      "body '{}' deforms so far at t = {:.6g} s that its kinetic energy, of second order in the deformation, is all but lost along some "
      "direction: use model = \"mixed\" with more volumes, fewer modes (keep_modes), or leave out stiffening",
      part.name, t);
}

}  // namespace

int lost_inertia(System system, double t, const VecX& y) {
  Work& work = system.work;
  work.indefinite = -1;
  try {
    set_state(system, t, y.data(), true);
    std::vector<MatX> deformed(work.clusters.size());
    for (size_t c = 0; c < deformed.size(); ++c) reduced_mass(work.clusters[c], deformed[c]);
    System straight = system;
    for (const int i : work.carrying.deforming) {
      const FlexibleBody& body = kinetics(system.model, straight.work, i);
      update_mass(body, VecX::Zero(body.n), straight.work.parts[static_cast<size_t>(i)].terms);
    }
    update_accelerations(straight.model, straight.work);
    MatX undeformed;
    for (size_t c = 0; c < deformed.size(); ++c) {
      reduced_mass(straight.work.clusters[c], undeformed);
      const VecX direction = lost_direction(deformed[c], undeformed);
      if (direction.size() == 0) continue;
      if (const int part = most_deformed(system, c, direction); part >= 0) return part;
    }
  } catch (const SimulationError&) {
    return work.indefinite;
  }
  return -1;
}

std::string bent_too_far(System system, double t, const VecX& y) {
  // From one radian on the displacements that a linear field leaves out are as large as those it has.
  constexpr double too_far = 1.0;
  try {
    set_state(system, t, y.data(), false);
  } catch (const SimulationError&) {}  // loops that cannot be closed; deformations that nothing depends on are set before
  double farthest = 0.0;
  const Part* worst = nullptr;
  for (const int i : system.work.carrying.deforming) {
    const Part& part = system.model.parts[static_cast<size_t>(i)];
    const FlexibleBody& body = part.body;
    const VecX& q = system.work.parts[static_cast<size_t>(i)].q;
    if (body.rod || !q.allFinite()) continue;
    for (const FlexibleNode& node : body.nodes)
      if (const double turn = (node.psi * q).norm(); turn > farthest) farthest = turn, worst = &part;
  }
  if (farthest < too_far) return "";
  const double degrees = farthest * 180.0 / std::numbers::pi;
  return fmt::format(
      "body '{}' bends by {} within its own frame by then, where linear displacements are wrong, and that may be all the reason: use model "
      "= \"mixed\" with more volumes, or the effect large_bending",
      worst->name, degrees < 360.0 ? fmt::format("{:.2g} degrees", degrees) : "more than a whole turn");
}

std::string likely_cause(const System& at_start, double t, const VecX& y, const std::string& complaint) {
  System system = at_start;
  system.work.indefinite = -1;
  try {
    set_state(system, t, y.data(), true);
  } catch (const SimulationError& error) {
    // What bends without bound takes loops beyond their reach.
    const std::string bent = bent_too_far(system, t, y);
    return bent.empty() ? error.what() : fmt::format("{}; {}", error.what(), bent);
  }
  if (const int part = lost_inertia(system, t, y); part >= 0) return words_of_lost(system.model.parts[static_cast<size_t>(part)], t);
  if (std::string words = bent_too_far(system, t, y); !words.empty()) return words;
  if (!complaint.empty()) return complaint;
  for (const auto reason : {self_locking, limit_of_reach, moves_without_inertia})
    if (std::string words = reason(system); !words.empty()) return words;
  return "an acceleration grows without bound";
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
