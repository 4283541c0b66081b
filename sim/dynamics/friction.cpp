#include "sim/dynamics/friction.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/friction_rest.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/massless.h"
#include "sim/dynamics/reduced_mass.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace flexframe::sim {
namespace {

// A force that is so near to its bound, relative to it, is let go: that is how sticking ends.
constexpr double let_go = 1e-9;
// So often groups that start together are aimed one after the other.
constexpr size_t most_turns = 60;

// Component of a joint's reaction force (axes of its outboard frame) that presses together the surfaces on which the point slips.
template <class W>
Vec3 reaction_force(const FrictionPoint& p, const Model& model, const FrictionState& friction, const W& work) {
  const TreeJoint& joint = model.parts[p.part].joint;
  const Vec3 force = friction.scratch.part[p.part].head<3>();
  switch (traits(joint.kind).pressing) {
    case Pressing::across_axis:
      return force - joint.axis.dot(force) * joint.axis;
    case Pressing::along_axis:
      return joint.axis.dot(force) * joint.axis;
    case Pressing::across_slide: {
      // Springs and friction along it are the joint's force too.
      if (!is_length(joint.kind, p.rate)) return force;
      const typename W::In::Twist motion = work.parts[p.part].joint.S.col(p.rate);
      const Vec3 way = in_space(work, joint.outboard, motion).template head<3>();
      return force - way * (way.dot(force) / way.squaredNorm());
    }
    default:
      return force;
  }
}

// A group that sticks and slips as one.
bool grouped(const FrictionPoint& p) { return p.count > 1 && p.phase != FrictionPhase::regularised; }
bool leads(const FrictionState& friction, const FrictionPoint& p) { return &p == &friction.points[p.first]; }

template <class State>
auto group_of(State& friction, const FrictionPoint& p) {
  return std::span(friction.points).subspan(p.first, p.count);
}

double slip_speed(const FrictionState& friction, const FrictionPoint& p, const Model& model, const VecX& w_all) {
  double square = 0.0;
  for (const FrictionPoint& other : group_of(friction, p)) square += std::pow(other.weight * rate_of(other, model, w_all), 2);
  return std::sqrt(square);
}

// Speed along the direction of the last step.
double slip_along(const FrictionState& friction, const FrictionPoint& p, const Model& model, const VecX& w_all) {
  double speed = 0.0;
  for (const FrictionPoint& other : group_of(friction, p)) speed += other.along * other.weight * rate_of(other, model, w_all);
  return speed;
}

// The group's slip starts, or goes on, along d.
void aim(FrictionState& friction, const FrictionPoint& p, const VecX& d) {
  Eigen::Index k = 0;
  for (FrictionPoint& other : group_of(friction, p)) other.along = d[k++];
}

// Force of a sticking group on its surface, N.
double held(const FrictionState& friction, const FrictionPoint& p) {
  double square = 0.0;
  for (const FrictionPoint& other : group_of(friction, p)) square += std::pow(other.hold / other.arm, 2);
  return std::sqrt(square);
}

// Acceleration of a rate (m/s^2 or rad/s^2) that is rounding: beside the fastest one of the mechanism and beside what the friction's
// bound would give the mechanism.
double no_acceleration(const Model& model, const Work& work, const FrictionPoint& p) {
  const double inertia = model.mass * (is_length(model.parts[p.part].joint.kind, p.rate) ? 1.0 : model.size * model.size);
  const double bound = static_coefficient(p.law) * p.normal * p.arm / std::max(inertia, 1e-300);
  return 1e-9 * std::max(work.wdot.cwiseAbs().maxCoeff(), bound);
}

// Friction force per newton of normal force, for points that do not stick.
double factor(const FrictionState& friction, const FrictionPoint& p, const Model& model, const VecX& w_all) {
  if (p.phase == FrictionPhase::slip) {
    const double speed = slip_speed(friction, p, model, w_all);
    const double part = speed <= no_speed * std::max(friction.fastest, 1e-100)
                            ? p.along
                            : std::copysign(1.0, slip_along(friction, p, model, w_all)) * p.weight * rate_of(p, model, w_all) / speed;
    return -p.law.coefficient * p.arm * part;
  }
  if (p.phase != FrictionPhase::regularised) return -direction(p) * p.law.coefficient * p.arm;
  const double w = p.weight * rate_of(p, model, w_all), v = *p.law.regularised, mu = p.law.coefficient;
  const double slip = slip_speed(friction, p, model, w_all);
  if (slip == 0.0) return 0.0;
  return -(mu + (static_coefficient(p.law) - mu) * std::exp(-(slip / (5.0 * v)) * (slip / (5.0 * v)))) * p.arm * std::tanh(slip / v) *
         (w / slip);
}

double& force_of(const FrictionPoint& p, std::vector<JointWork>& joints) { return joints[p.part].friction[p.rate]; }

template <class W>
void accelerate(const Model& model, FrictionState& friction, W& work) {
  update_accelerations(model, work);
  compute_reactions(model, work, friction.scratch);
}

// Normal forces that are reactions: R(f) = R0 + sum_j f_j R_j is linear in the friction forces f of the points that slip.
template <class W>
void solve_reaction_friction(const Model& model, FrictionState& friction, W& work) {
  std::vector<int> slipping;
  for (size_t k = 0; k < friction.points.size(); ++k)
    if (friction.points[k].law.reaction && friction.points[k].phase != FrictionPhase::stick) slipping.push_back(static_cast<int>(k));
  const Eigen::Index m = static_cast<Eigen::Index>(slipping.size());
  for (int k : slipping) force_of(friction.points[k], work.joints) = 0.0;
  accelerate(model, friction, work);
  if (m == 0) return;

  std::vector<Vec3> none(m);
  std::vector<std::vector<Vec3>> per(m, std::vector<Vec3>(m));
  const auto reaction = [&](Eigen::Index i) { return reaction_force(friction.points[slipping[i]], model, friction, work); };
  for (Eigen::Index i = 0; i < m; ++i) none[i] = reaction(i);
  // A probe as large as the forces that are about to act keeps its digits.
  for (Eigen::Index j = 0; j < m; ++j) {
    const double probe = std::max(none[j].norm(), 1e-6 * model.mass);
    force_of(friction.points[slipping[j]], work.joints) = probe;
    accelerate(model, friction, work);
    for (Eigen::Index i = 0; i < m; ++i) per[i][j] = (reaction(i) - none[i]) / probe;
    force_of(friction.points[slipping[j]], work.joints) = 0.0;
  }
  // From none on: |R| is convex, so that Newton's steps from there come up to the least friction that fits, the one that a growing
  // coefficient leads to, and do not jump over to another.
  VecX f = VecX::Zero(m), c(m), residual(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const FrictionPoint& p = friction.points[slipping[i]];
    c[i] = factor(friction, p, model, work.w);
  }
  MatX J(m, m);
  double size = 0.0;
  for (int iteration = 0;; ++iteration) {
    size = 0.0;
    for (Eigen::Index i = 0; i < m; ++i) {
      Vec3 R = none[i];
      for (Eigen::Index j = 0; j < m; ++j) R += f[j] * per[i][j];
      const double N = R.norm();
      residual[i] = f[i] - c[i] * N;
      size = std::max({size, N, std::abs(f[i])});
      for (Eigen::Index j = 0; j < m; ++j) J(i, j) = (i == j ? 1.0 : 0.0) - (N > 0.0 ? c[i] * R.dot(per[i][j]) / N : 0.0);
    }
    if (residual.cwiseAbs().maxCoeff() <= 1e-14 * size) break;
    f -= J.partialPivLu().solve(residual);
    bool wrong = !f.allFinite();
    // Friction pulls against the slip; a solution with the other sign is no solution (Painleve's paradox).
    if (iteration > 25)
      for (Eigen::Index i = 0; i < m; ++i) wrong = wrong || f[i] * c[i] < 0.0 || residual.cwiseAbs().maxCoeff() > 1e-10 * size;
    if (wrong)
      throw SimulationError(
          fmt::format("joint '{}' is self-locking at t = {:.6g} s (Painleve): no finite friction force is in balance with its reaction; "
                      "lower the coefficient or give normal_force as a number",
                      model.parts[friction.points[slipping.front()].part].joint.name, work.time));
    if (iteration > 25) break;
  }
  for (Eigen::Index i = 0; i < m; ++i) force_of(friction.points[slipping[i]], work.joints) = f[i];
  accelerate(model, friction, work);
}

// Where loops leave a sticking group fewer ways to slip than it has rates, its forces across these ways are open, and the locks that carry
// took all of it: what it holds is the least that does the same, the part along the ways. Of given normal forces: a reaction has what the
// locks carry across them, and would hold the group by its own wedging.
template <class W>
void hold_along_ways(const Model& model, FrictionState& friction, const W& work, const FrictionPoint& lead) {
  const ClusterWork& cw = work.clusters[lead.cluster];
  const Partition& now = cw.partition;
  const auto group = group_of(friction, lead);
  const int first = closure_row_count(model, work, lead.cluster) - static_cast<int>(cw.locked.size());
  const auto place = [](const std::vector<int>& in, int what) { return std::find(in.begin(), in.end(), what) - in.begin(); };
  std::vector<Eigen::Index> carrying;
  for (const FrictionPoint& p : group)
    if (const auto at = place(now.rows, first + static_cast<int>(place(cw.locked, p.local))); at < std::ssize(now.rows))
      carrying.push_back(at);
  if (carrying.size() == group.size()) return;
  MatX ways(lead.count, static_cast<Eigen::Index>(carrying.size()));
  VecX force(lead.count);
  for (Eigen::Index k = 0; k < lead.count; ++k) {
    const FrictionPoint& p = group[k];
    const auto dependent = place(now.dep, p.local);
    force[k] = p.hold / p.arm;
    for (size_t c = 0; c < carrying.size(); ++c)
      ways(k, static_cast<Eigen::Index>(c)) = dependent < std::ssize(now.dep) ? p.weight * cw.Gd(dependent, carrying[c]) : 0.0;
  }
  if (carrying.empty()) force.setZero();
  else force = ways * least_squares(ways, force);
  for (Eigen::Index k = 0; k < lead.count; ++k) group[k].hold = force[k] * group[k].arm;
}

// Gives every cluster the locks of the points that stick, with the partition that goes with them.
void renew_locks(const Model& model, const FrictionState& friction, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    std::vector<int> locked(cw.locked.begin(), cw.locked.begin() + cw.carried);
    std::vector<double> value(locked.size(), 0.0);
    bool ours = false;
    for (const FrictionPoint& p : friction.points) {
      if (p.cluster != static_cast<int>(c)) continue;
      ours = true;
      if (p.phase != FrictionPhase::stick) continue;
      const Part& part = model.parts[p.part];
      locked.push_back(p.local);
      value.push_back(part.joint.nq == part.joint.nv ? work.q[part.q0 + p.rate] : 0.0);
    }
    if (!ours || (locked.empty() && cw.locked.empty())) continue;
    cw.locked = locked;
    cw.lock_value = Eigen::Map<const VecX>(value.data(), static_cast<Eigen::Index>(value.size()));
    cw.lock_rate.setZero(cw.lock_value.size());
    if (locked.empty() && !has_closure(model.clusters[c])) {
      // A tree has nothing to close.
      cw.partition = {};
      for (int k = 0; k < model.clusters[c].nv; ++k) cw.partition.ind.push_back(k);
    } else {
      cw.partition = choose_partition(model, static_cast<int>(c), work, false);
    }
  }
  renew_motion(model, work);
}

// The direction in which a group starts to slip from rest: that of its acceleration, which friction opposes. Its locks are gone; other
// forces stay. False where its kinetic friction would hold it.
bool aim_breakaway(const Model& model, FrictionState& friction, FrictionPoint& lead, Work& work) {
  const auto group = group_of(friction, lead);
  const Eigen::Index n = lead.count;
  const auto slip_acceleration = [&]() {
    update_accelerations(model, work);
    VecX a(n);
    Eigen::Index k = 0;
    for (const FrictionPoint& p : group) a[k++] = p.weight * work.wdot[model.parts[p.part].v0 + p.rate];
    return a;
  };
  bool slips = true;
  // Its normal force depends on the friction itself: a few rounds.
  for (int round = 0; round < 20; ++round) {
    update_friction_accelerations(model, friction, work);
    const double force = lead.law.coefficient * lead.normal;
    VecX before(n), d(n);
    Eigen::Index k = 0;
    for (const FrictionPoint& p : group) before[k++] = p.along;
    if (force == 0.0) return true;
    for (FrictionPoint& p : group) force_of(p, work.joints) = 0.0;
    const VecX free = slip_acceleration();
    MatX mobility(n, n);
    for (k = 0; k < n; ++k) {
      force_of(group[k], work.joints) = force * group[k].arm;
      mobility.col(k) = slip_acceleration() - free;
      force_of(group[k], work.joints) = 0.0;
    }
    // |d| falls with lambda, from at least 1 at zero to below at |A F|.
    double low = 0.0, high = free.norm();
    slips = (1e-14 * mobility.norm() * MatX::Identity(n, n) + mobility).partialPivLu().solve(free).norm() > 1.0 - 2.0 * let_go;
    for (int halving = 0; halving < 200 && high - low > 1e-16 * high; ++halving) {
      const double lambda = 0.5 * (low + high);
      d = (lambda * MatX::Identity(n, n) + mobility).partialPivLu().solve(free);
      (d.norm() > 1.0 ? low : high) = lambda;
    }
    d = (high * MatX::Identity(n, n) + mobility).partialPivLu().solve(free).normalized();
    aim(friction, lead, d);
    if (!lead.law.reaction || (d - before).norm() <= 1e-12) break;
  }
  return slips;
}

// Finds the points that wait. A group that the locks no longer hold starts in the direction in which it is driven.
void wait_for_locks(const Model& model, FrictionState& friction, Waiting& waiting, Work& work) {
  std::vector<FrictionPoint*> started;
  for (size_t k = 0; k < friction.points.size(); ++k) {
    FrictionPoint& p = friction.points[k];
    if (grouped(p) && !leads(friction, p)) continue;
    bool waits = p.phase != FrictionPhase::stick && p.phase != FrictionPhase::regularised && !waiting.driven[k];
    const auto surface = grouped(p) ? group_of(friction, p) : std::span(&p, 1);
    for (const FrictionPoint& point : surface) waits = waits && held_by_locks(point, friction, model, work);
    if (waiting.waits[k] && !waits && p.phase == FrictionPhase::slip) started.push_back(&p);
    waiting.waits[k] = waits;
    for (FrictionPoint& point : surface)
      point.law.coefficient = waiting.idle[k] && waits ? 0.0
                              : waits ? static_coefficient(point.law) * (waiting.shared[p.cluster] == Waiting::found ? 1.0 - let_go : 1.0)
                                      : model.parts[point.part].joint.friction->coefficient;
  }
  for (FrictionPoint* p : started) aim_breakaway(model, friction, *p, work);
}

// The shares of a cluster's sticking rates, none in a group and their normal forces given, where letting go of one after the other may miss
// those that hold everything: which of them stick, wait at their bounds, carry nothing, or slip. False where their shares are not open.
bool share_out(const Model& model, FrictionState& friction, int cluster, Waiting& waiting, Work& work) {
  std::vector<size_t> resting;
  for (size_t k = 0; k < friction.points.size(); ++k) {
    const FrictionPoint& p = friction.points[k];
    if (p.cluster != cluster || p.phase != FrictionPhase::stick) continue;
    if (grouped(p) || p.law.reaction) return false;
    resting.push_back(k);
  }
  const ClusterWork& cw = work.clusters[cluster];
  const auto carried = std::count_if(cw.partition.rows.begin(), cw.partition.rows.end(), [&](int row) {
    return row >= closure_row_count(model, work, cluster) - static_cast<int>(cw.locked.size()) + cw.carried;
  });
  if (carried >= static_cast<std::ptrdiff_t>(resting.size())) return false;
  const auto law_of = [&](const FrictionPoint& p) { return *model.parts[p.part].joint.friction; };
  // Accelerations without their friction, and for a unit of each.
  for (const size_t k : resting) friction.points[k].phase = FrictionPhase::forward, friction.points[k].law.coefficient = 0.0;
  renew_locks(model, friction, work);
  update_friction_accelerations(model, friction, work);
  const Eigen::Index n = static_cast<Eigen::Index>(resting.size());
  const auto accelerations = [&]() {
    update_accelerations(model, work);
    VecX a(n);
    for (Eigen::Index k = 0; k < n; ++k) a[k] = rate_of(friction.points[resting[k]], model, work.wdot);
    return a;
  };
  const VecX a0 = accelerations();
  MatX A(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const FrictionPoint& p = friction.points[resting[k]];
    const double probe = std::max(static_coefficient(law_of(p)) * p.normal * p.arm, 1e-6 * model.mass);
    force_of(p, work.joints) = probe;
    A.col(k) = (accelerations() - a0) / probe;
    force_of(p, work.joints) = 0.0;
  }
  const MatX mobility = 0.5 * (A + A.transpose());
  Shares shares;
  VecX holds(n), rubs(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const FrictionPoint& p = friction.points[resting[k]];
    holds[k] = static_coefficient(law_of(p)) * p.normal * p.arm * (1.0 - let_go);
    rubs[k] = law_of(p).coefficient * p.normal * p.arm;
  }
  std::vector<char> moves(resting.size(), 0), slid(resting.size(), 0);  // slid: has moved on the way there
  for (bool more = true; more;) {
    VecX bounds = holds;
    for (Eigen::Index k = 0; k < n; ++k)
      if (slid[k]) bounds[k] = std::min(rubs[k], holds[k]);
    shares = least_acceleration(mobility, a0, bounds);
    more = false;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double size = mobility.row(k).cwiseAbs().dot(bounds) + std::abs(a0[k]);
      moves[k] = shares.place[k] == Shares::bound && std::abs(shares.acceleration[k]) > 1e-13 * size;
      if (!moves[k] || slid[k]) continue;
      // It rubs with less than it held, and others may follow.
      slid[k] = more = true;
    }
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    FrictionPoint& p = friction.points[resting[k]];
    p.law = law_of(p);
    const bool bound = shares.place[k] == Shares::bound && (moves[k] || !slid[k]);
    waiting.idle[resting[k]] = shares.place[k] == Shares::idle;
    if (!bound && shares.place[k] != Shares::idle) p.phase = FrictionPhase::stick;
    else p.phase = shares.force[k] > 0.0 ? FrictionPhase::backward : FrictionPhase::forward;
  }
  return true;
}

// Whether a point that was let go holds after all, since what was let go after it took its load, or a group starts another way: found anew.
bool hold_again(const Model& model, FrictionState& friction, Waiting& waiting, Work& work) {
  // In a cycle (normal forces that follow friction) a choice stays after as many rounds; the run then tells what it finds.
  constexpr int rounds = 3;
  for (size_t k = 0; k < friction.points.size(); ++k) {
    FrictionPoint& p = friction.points[k];
    if (!waiting.released[k] || waiting.waits[k]) continue;
    if (p.phase == FrictionPhase::forward || p.phase == FrictionPhase::backward) {
      if (waiting.again[k] == rounds || rate_of(p, model, work.wdot) * direction(p) >= -100.0 * no_acceleration(model, work, p)) continue;
      p.phase = FrictionPhase::stick;
      ++waiting.again[k];
      return true;
    }
    if (p.phase != FrictionPhase::slip || !leads(friction, p)) continue;
    VecX before(p.count), now(p.count);
    Eigen::Index i = 0;
    for (const FrictionPoint& other : group_of(friction, p)) before[i++] = other.along;
    const bool slips = aim_breakaway(model, friction, p, work);
    i = 0;
    for (const FrictionPoint& other : group_of(friction, p)) now[i++] = other.along;
    // Once it slips the rest of a direction turns by itself.
    constexpr double near = 1e-6;
    if (!slips && waiting.again[k] < rounds) {
      for (FrictionPoint& other : group_of(friction, p)) other.phase = FrictionPhase::stick;
      ++waiting.again[k];
      return true;
    }
    if ((now - before).norm() > near) return true;
  }
  return false;
}

// Points that wait, but are driven: whether there are new ones.
bool find_driven(const Model& model, const FrictionState& friction, const Work& work, Waiting& waiting) {
  bool found = false;
  for (size_t k = 0; k < friction.points.size(); ++k) {
    const FrictionPoint& p = friction.points[k];
    const size_t lead = grouped(p) ? p.first : k;
    if (!waiting.waits[lead] || std::abs(work.wdot[model.parts[p.part].v0 + p.rate]) <= no_acceleration(model, work, p)) continue;
    waiting.driven[lead] = found = true;
  }
  return found;
}

// Joints whose points have other phases than before.
void tell_changes(const Model& model, const FrictionState& friction, const std::vector<FrictionPhase>& before,
                  std::vector<std::string>& changes) {
  for (size_t k = 0; k < friction.points.size(); ++k) {
    const FrictionPoint& p = friction.points[k];
    if (p.phase == before[k] || (grouped(p) && !leads(friction, p))) continue;
    const TreeJoint& joint = model.parts[p.part].joint;
    changes.push_back(fmt::format("joint '{}'{} {}", joint.name,
                                  joint.nv == 1 || joint.nv == p.count ? ""
                                  : p.count > 1 ? fmt::format(" (coordinates {} to {})", p.rate + 1, p.rate + p.count)
                                                : fmt::format(" (coordinate {})", p.rate + 1),
                                  p.phase == FrictionPhase::stick     ? "sticks"
                                  : before[k] == FrictionPhase::stick ? "slips"
                                                                      : "turns round"));
  }
}

}  // namespace

FrictionState make_friction(const Model& model, Work& work) {
  FrictionState out;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    if (!part.joint.friction || part.joint.nv == 0) continue;
    work.joints[i].friction = VecX::Zero(part.joint.nv);
    for (int k = 0; k < part.joint.nv; ++k) {
      FrictionPoint p;
      p.part = static_cast<int>(i);
      p.rate = k;
      p.cluster = part.cluster;
      p.local = part.v0 + k - model.clusters[part.cluster].v0;
      p.law = *part.joint.friction;
      p.arm = is_length(part.joint.kind, k) ? 1.0 : p.law.radius;
      p.normal = p.law.normal_force;
      const auto [from, count] = shared_slip(part.joint.kind, k);
      p.phase = p.law.regularised ? FrictionPhase::regularised : count > 1 ? FrictionPhase::slip : FrictionPhase::forward;
      p.first = static_cast<int>(out.points.size()) - k + from;
      p.count = count;
      // Where lengths and angles slip on one surface, an angle counts by its radius.
      for (int other = from; other < from + count; ++other)
        if (is_length(part.joint.kind, other)) p.weight = p.arm;
      out.reactions = out.reactions || p.law.reaction;
      out.points.push_back(p);
    }
  }
  return out;
}

template <class W>
void update_friction_accelerations(const Model& model, FrictionState& friction, W& work, bool rates_alone) {
  bool sticking = false;
  for (FrictionPoint& p : friction.points) {
    sticking = sticking || p.phase == FrictionPhase::stick;
    if (p.phase == FrictionPhase::stick) force_of(p, work.joints) = 0.0;
    else if (!p.law.reaction) force_of(p, work.joints) = factor(friction, p, model, work.w) * p.law.normal_force;
  }
  if (friction.reactions) solve_reaction_friction(model, friction, work);
  else if (rates_alone && !sticking) update_accelerations_alone(model, work);
  else update_accelerations(model, work);
  if (friction.reactions)
    for (FrictionPoint& p : friction.points)
      if (p.law.reaction) p.normal = reaction_force(p, model, friction, work).norm();
  if (!sticking) return;
  // Multipliers of the locks.
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    const ClusterWork& cw = work.clusters[c];
    if (cw.locked.empty()) continue;
    const VecX lambda = closure_multipliers(model, work, static_cast<int>(c));
    const Eigen::Index loops = lambda.size() - static_cast<Eigen::Index>(cw.locked.size());
    for (FrictionPoint& p : friction.points) {
      if (p.cluster != static_cast<int>(c) || p.phase != FrictionPhase::stick) continue;
      const auto at = std::find(cw.locked.begin(), cw.locked.end(), p.local);
      p.hold = lambda[loops + (at - cw.locked.begin())];
    }
    for (const FrictionPoint& p : friction.points)
      if (p.cluster == static_cast<int>(c) && p.phase == FrictionPhase::stick && !p.law.reaction && grouped(p) && leads(friction, p))
        hold_along_ways(model, friction, work, p);
  }
}

template void update_friction_accelerations(const Model&, FrictionState&, Work&, bool);
template void update_friction_accelerations(const Model&, FrictionState&, PlaneWork&, bool);

void settle_friction(const Model& model, FrictionState& friction, const std::vector<int>& resting, Work& work,
                     std::vector<std::string>& changes) {
  std::vector<FrictionPhase> before;
  before.reserve(friction.points.size());
  for (const FrictionPoint& p : friction.points) before.push_back(p.phase);
  follow_fastest(model, friction, work);
  const auto set_phase = [&](FrictionPoint& p, FrictionPhase phase) {
    if (!grouped(p)) p.phase = phase;
    else
      for (FrictionPoint& other : group_of(friction, p)) other.phase = phase;
  };
  const std::vector<char> none(friction.points.size(), 0);
  Waiting waiting{none, none, none, none, none, std::vector<Waiting::Sharing>(model.clusters.size(), Waiting::open)};
  for (FrictionPoint& p : friction.points) p.law = *model.parts[p.part].joint.friction;
  const bool turned = turn_round(model, friction, resting, work);
  for (int k : resting)
    if (!turned && friction.points[k].phase != FrictionPhase::regularised) set_phase(friction.points[k], FrictionPhase::stick);
  const bool settled = turned && !any_sticks(friction);
  for (size_t pass = 0; pass <= 12 * friction.points.size() + most_turns && !settled; ++pass) {
    renew_locks(model, friction, work);
    wait_for_locks(model, friction, waiting, work);
    // What comes to rest with the others (rates in proportion to one another) is settled with them.
    bool more = false;
    for (FrictionPoint& p : friction.points) {
      if (pass > 0) break;
      const double scale = rate_scale(model, p.cluster, p.local), rest = at_rest * friction.fastest;
      const bool one = !turned && (p.phase == FrictionPhase::forward || p.phase == FrictionPhase::backward) &&
                       std::abs(rate_of(p, model, work.w)) * scale <= rest;
      const bool all = p.phase == FrictionPhase::slip && leads(friction, p) && slip_speed(friction, p, model, work.w) * scale <= rest;
      if (!one && !all) continue;
      set_phase(p, FrictionPhase::stick);
      more = true;
    }
    if (more) continue;
    update_friction_accelerations(model, friction, work);
    if (find_driven(model, friction, work, waiting)) continue;
    FrictionPoint* worst = nullptr;
    double excess = 1.0;
    for (FrictionPoint& p : friction.points) {
      if (p.phase != FrictionPhase::stick || (grouped(p) && !leads(friction, p))) continue;
      if (grouped(p)) {
        // Locks that the rest of the mechanism already holds carry nothing; what it drives slips the way it is taken.
        VecX a(p.count);
        Eigen::Index k = 0;
        for (const FrictionPoint& other : group_of(friction, p)) a[k++] = other.weight * work.wdot[model.parts[other.part].v0 + other.rate];
        if (a.norm() > no_acceleration(model, work, p)) {
          set_phase(p, FrictionPhase::slip);
          aim(friction, p, a.normalized());
          worst = &p;
          excess = -1.0;
          break;
        }
        const double force = held(friction, p), ratio = force / std::max(static_coefficient(p.law) * p.normal, 1e-300);
        if (force > 0.0 && ratio > (1.0 - let_go) * excess) excess = ratio, worst = &p;
        continue;
      }
      const ClusterWork& cw = work.clusters[p.cluster];
      const int row = closure_row_count(model, work, p.cluster) -
                      static_cast<int>(cw.locked.end() - std::find(cw.locked.begin(), cw.locked.end(), p.local));
      if (std::find(cw.partition.rows.begin(), cw.partition.rows.end(), row) == cw.partition.rows.end()) {
        // Held or driven by the rest of the mechanism: driven, it slips the way it is taken.
        const double a = work.wdot[model.parts[p.part].v0 + p.rate];
        if (std::abs(a) <= no_acceleration(model, work, p)) continue;
        p.phase = a > 0.0 ? FrictionPhase::forward : FrictionPhase::backward;
        worst = &p;
        excess = -1.0;
        break;
      }
      const double bound = static_coefficient(p.law) * p.normal * p.arm;
      const double ratio = std::abs(p.hold) / std::max(bound, 1e-300);
      // Shares that were found stay below.
      if (std::abs(p.hold) > 0.0 && ratio > (1.0 - (waiting.shared[p.cluster] == Waiting::found ? 0.5 : 1.0) * let_go) * excess)
        excess = ratio, worst = &p;
    }
    if (!worst) {
      if (hold_again(model, friction, waiting, work)) continue;
      break;
    }
    waiting.released[static_cast<size_t>(worst - friction.points.data())] = true;
    if (excess < 0.0) continue;
    if (auto& shared = waiting.shared[worst->cluster]; shared == Waiting::open) {
      const bool found = share_out(model, friction, worst->cluster, waiting, work);
      shared = found ? Waiting::found : Waiting::known;
      if (found) continue;
    }
    if (grouped(*worst)) {
      VecX d(worst->count);
      Eigen::Index k = 0;
      for (const FrictionPoint& other : group_of(friction, *worst)) d[k++] = -other.hold / other.arm;
      aim(friction, *worst, d.normalized());
      set_phase(*worst, FrictionPhase::slip);
      renew_locks(model, friction, work);
      wait_for_locks(model, friction, waiting, work);
      if (!waiting.waits[worst->first]) aim_breakaway(model, friction, *worst, work);
    } else {
      worst->phase = worst->hold < 0.0 ? FrictionPhase::forward : FrictionPhase::backward;
    }
  }
  tell_changes(model, friction, before, changes);
}

void follow_slip(const Model& model, FrictionState& friction, const Work& work, bool turn) {
  follow_fastest(model, friction, work);
  for (FrictionPoint& p : friction.points) {
    if (p.phase != FrictionPhase::slip || !leads(friction, p)) continue;
    const double speed = slip_speed(friction, p, model, work.w);
    if (speed <= no_speed * friction.fastest || (!turn && slip_along(friction, p, model, work.w) <= 0.0)) continue;
    VecX d(p.count);
    Eigen::Index k = 0;
    for (const FrictionPoint& other : group_of(friction, p)) d[k++] = other.weight * rate_of(other, model, work.w) / speed;
    aim(friction, p, d);
  }
}

bool slip_rests(const FrictionPoint& p, const FrictionState& friction, const Model& model, const Work& work) {
  return slip_speed(friction, p, model, work.w) * rate_scale(model, p.cluster, p.local) <=
         std::max(friction.tolerance, 1e-9) * friction.fastest;
}

double friction_margin(const FrictionPoint& p, const FrictionState& friction, const Model& model, const Work& work) {
  if (grouped(p)) {
    if (!leads(friction, p)) return 1.0;
    return p.phase == FrictionPhase::stick ? static_coefficient(p.law) * p.normal - held(friction, p)
                                           : slip_along(friction, p, model, work.w);
  }
  switch (p.phase) {
    case FrictionPhase::stick:
      return static_coefficient(p.law) * p.normal * p.arm - std::abs(p.hold);
    case FrictionPhase::forward:
      return rate_of(p, model, work.w);
    case FrictionPhase::backward:
      return -rate_of(p, model, work.w);
    default:
      return 1.0;
  }
}

}  // namespace flexframe::sim
