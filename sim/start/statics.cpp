#include "sim/start/statics.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/small_matrices.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/model/state_functions.h"
#include "sim/scene/joint_kinds.h"
#include "sim/start/linearise.h"
#include "sim/start/static_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace flexframe::sim {
namespace {

std::string name_of(const Model& model, const Direction& d) {
  const Part& p = model.parts[d.part];
  return d.rate >= 0 ? fmt::format("joint '{}'", p.joint.name) : fmt::format("the deformation of body '{}'", p.name);
}

// How an equilibrium is sought.
enum class Way {
  downhill,  // damped until the stiffness is positive definite: to a stable state, as a motion in honey would
  nearest,   // Newton's method as it stands: to the state beside the start, stable or not
};

struct Found {
  bool rest = false;
  bool crossed = false;  // the way led over states at which the stiffness is not positive definite
  int worst = 0;         // the direction with the largest force left
  MatX tangent;          // stiffness at the place of rest where it was needed there, else empty
};

// Of the stiffest direction.
constexpr double rounding_of_stiffness = 1e-12;
// Of the softest: a step by the symmetric part of such a stiffness errs by less than its differences do.
constexpr double symmetric_to = 1e-6;

// Of so many rows at most a factor is made by the house's kernel, which needs less than half of a library's time there but does not go
// through large ones block by block.
constexpr Eigen::Index most_rows = 500;

// A = L L^T of a symmetric matrix, if it is positive definite.
class Definite {
 public:
  // False where it is not.
  bool make(const MatX& A) {
    if (A.rows() <= most_rows) return cholesky(A, L_);
    large_.emplace(A);
    return large_->info() == Eigen::Success;
  }
  void solve(const VecX& b, VecX& x) const {
    if (large_) {
      x = large_->solve(b);
      return;
    }
    x = b;
    sim::solve(L_, x.data());
  }

 private:
  MatX L_;
  std::optional<Cholesky> large_;
};

bool is_definite(const MatX& A) { return Definite().make(A); }

bool same_directions(const std::vector<Direction>& a, const std::vector<Direction>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Direction& x, const Direction& y) { return x.v == y.v; });
}

// A damped stiffness factorised.
class Factors {
 public:
  // definite: the factors of its symmetric part S, if they are known; they serve where K is symmetric. False where it is singular.
  bool make(const MatX& K, const MatX& S, double damping, std::optional<Definite> definite) {
    if (definite && (K - S).cwiseAbs().maxCoeff() <= symmetric_to * S.diagonal().cwiseAbs().minCoeff()) {
      definite_ = std::move(definite);
      return true;
    }
    lu_ = K + damping * MatX::Identity(K.rows(), K.cols());
    return factorise(lu_, order_) > 0.0;
  }
  void solve(const VecX& b, VecX& x) const {
    if (definite_) definite_->solve(b, x);
    else sim::solve(lu_, order_, b.data(), x.data());
  }

 private:
  std::optional<Definite> definite_;
  MatX lu_;
  std::vector<int> order_;
};

// One search at the present share of the loads.
Found search(StaticProblem& p, const Sought& what, Way way, StaticSolution& out) {
  Found found;
  MatX K;
  bool serves = false;  // K is still that of the place, to the digits of its differences, along these:
  std::vector<Direction> along;
  // A step of a tenth of what the differences take changes it by less than they err.
  constexpr double little = 1e-7;
  double damping = 0.0, last = -1.0;
  for (int iteration = 0; iteration < (way == Way::downhill ? 400 : 50); ++iteration) {
    p.find_directions(what);
    const Eigen::Index n = static_cast<Eigen::Index>(p.sought.size());
    found.rest = n == 0;
    if (n == 0) return found;
    VecX f, next;
    if (!p.evaluate(nullptr, f)) return found;
    out.residual = f.cwiseAbs().maxCoeff(&found.worst);
    // Nothing is left of the forces but rounding: a few hundred roundings of the largest of them, through O(n) bodies.
    found.rest = out.residual <= 1e-13 * p.rest.scale;
    serves = serves && same_directions(p.sought, along);
    if (found.rest) {
      if (serves) found.tangent = std::move(K);
      return found;
    }
    if (!serves && !p.stiffness(K)) return found;
    along = p.sought;
    ++out.iterations;
    const MatX S = 0.5 * (K + K.transpose());
    const double stiffest = std::max(S.diagonal().cwiseAbs().maxCoeff(), p.rest.scale / p.model.size);
    std::optional<Definite> definite;  // the factors of S with its damping
    for (int attempt = 0; way == Way::downhill && attempt < 60; ++attempt) {
      if (definite.emplace().make(S + damping * MatX::Identity(n, n))) break;
      definite.reset();
      damping = std::max(10.0 * damping, rounding_of_stiffness * stiffest);
      // What turns freely has no stiffness but its rounding, of either sign.
      found.crossed = found.crossed || damping > 2.0 * rounding_of_stiffness * stiffest;
    }
    Factors factors;
    VecX x(n), follows(n);
    if (!factors.make(K, S, damping, std::move(definite))) return found;
    factors.solve(f, x);
    if (!x.allFinite()) return found;
    const double longest = x.cwiseAbs().maxCoeff(&found.worst);
    // The last step no longer mends anything: rounding of the forces, or of places where a stiff body resists them (fifty roundings of the
    // size). What turns freely goes on by rounding alone.
    const double rounding = std::max(1e-8 * p.rest.scale, 1e-14 * p.model.size * stiffest);
    if (damping <= 1e-9 * stiffest && longest <= 1e-9 * p.model.size && out.residual <= rounding) {
      found.rest = last >= 0.0 && out.residual >= 0.5 * last;
      if (found.rest) {
        found.tangent = std::move(K);
        return found;
      }
      last = out.residual;
    } else {
      f.cwiseAbs().maxCoeff(&found.worst);
    }
    serves = longest <= little * p.model.size;
    double share = std::min(1.0, 0.5 * p.model.size / longest);
    const VecX q = p.work.q;
    const double slope = f.dot(x);
    bool accepted = false;
    for (int halving = 0; halving < 40 && !accepted; ++halving, share *= 0.5) {
      for (Eigen::Index k = 0; k < n; ++k) move_along(p.model, p.sought[k], share * x[k] / p.scale[k], p.work);
      accepted = p.evaluate(nullptr, next) && !leapt(p, q);
      if (accepted) {
        // The step that would follow with the same stiffness: shorter, if this one led nearer.
        factors.solve(next, follows);
        const double correction = follows.norm();
        // Downhill: still pushed along the step, or back by less than half of what pushed at its start, without leaving what stiff bodies
        // allow.
        accepted = way == Way::nearest
                       ? correction <= (1.0 - 0.25 * share) * x.norm()
                       : (slope > 0.0 && next.dot(x) >= -0.5 * slope && correction <= 2.0 * x.norm()) || next.norm() < 0.9 * f.norm();
      }
      if (!accepted) p.work.q = q;
    }
    if (!accepted) {
      p.evaluate(nullptr, f);
      // At the limit of the digits no step can be better.
      found.rest = out.residual <= rounding && longest <= 1e-8 * p.model.size;
      if (found.rest || way == Way::nearest || damping > 1e3 * stiffest) return found;
      damping = std::max(100.0 * damping, 1e-9 * stiffest);
      serves = true;
      continue;
    }
    damping *= share > 0.4 ? 0.1 : 1.0;
    for (const Direction& d : p.sought) {
      const Part& part = p.model.parts[d.part];
      if (d.rate >= 0 && std::abs(p.work.q[part.q0]) > 1e4 * (is_length(part.joint.kind, 0) ? p.model.size : 1.0)) return found;
    }
    renew_partitions(p.model, p.by_size, p.work);
  }
  return found;
}

// Loads raised from zero. Where the states reached so come to an end, at a limit load, the mechanism runs downhill from the last one to
// where it comes to rest (it snaps through, or buckles); `snapped` is then the share of the loads at which it did, else negative.
struct Raised {
  Found found;
  double share = 0.0, snapped = -1.0;
};

Raised raise_loads(StaticProblem& p, const Sought& what, const VecX& start, StaticSolution& out) {
  Raised r;
  p.work.q = start;
  p.by_size = true;
  p.load(0.0);
  update_positions(p.model, p.work);
  renew_partitions(p.model, p.by_size, p.work);
  double step = 0.1;
  VecX reached = start;
  out.load_steps = 0;
  while (r.share < 1.0) {
    const double next = std::min(1.0, r.share + step);
    p.load(next);
    ++out.load_steps;
    r.found = search(p, what, Way::downhill, out);
    const bool jumped = r.found.rest && r.found.crossed && r.share > 0.0;
    if (r.found.rest && (!jumped || step < 5e-3)) {
      if (jumped && r.snapped < 0.0) r.snapped = next;
      r.share = next;
      reached = p.work.q;
      step *= 1.5;
      continue;
    }
    step *= 0.5;
    if (step < 1e-3) return r;
    p.work.q = reached;
    update_positions(p.model, p.work);
    renew_partitions(p.model, p.by_size, p.work);
  }
  return r;
}

// Whether the loads have a potential and nothing is driven: a stiffness that is positive definite is then proof of stability (Lagrange,
// Dirichlet). A torque about an axis that stands still has none in space (Ziegler 1952), nor has what follows a body.
bool is_conservative(const StaticProblem& p) {
  return std::all_of(p.motion.begin(), p.motion.end(), [](const TimeJet& jet) { return jet.rate == 0.0 && jet.acceleration == 0.0; }) &&
         std::all_of(p.model.loads.begin(), p.model.loads.end(),
                     [](const Load& l) {
                       return !l.table && l.function < 0 && !l.def.follower &&
                              (l.def.kind == ForceKind::force || l.def.kind == ForceKind::spring_damper);
                     }) &&
         std::all_of(p.model.parts.begin(), p.model.parts.end(), [](const Part& part) {
           const MatX& K = part.body.Ke;  // matrices of a scene may be any
           return (K - K.transpose()).norm() <= 1e-9 * K.norm();
         });
}

// Whether the mechanism stays at an equilibrium that was found: no pole of its small motions grows. Where coordinates are held in the
// search, or modes cannot be had, by the stiffness along those that were sought (softer than 1e-9 of the stiffest is neutral, to the digits
// of the differences).
// tangent: the stiffness there, if it is known already, else empty.
Stability find_stability(StaticProblem& p, const Sought& what, MatX tangent = {}) {
  p.find_directions(what);
  const size_t all = independent_directions(p.model, p.work).size();
  if (p.sought.empty()) return {};
  // Eigenvalues relative to the diagonal, so that soft coordinates count like stiff ones; the differences err by 1e-6 of those.
  MatX K = std::move(tangent);
  const auto made = [&] {
    if (K.rows() == static_cast<Eigen::Index>(p.sought.size()) || p.stiffness(K)) return true;
    K.resize(0, 0);
    return false;
  };
  if (is_conservative(p) && made() && K.diagonal().minCoeff() > 0.0) {
    const VecX unit = K.diagonal().cwiseSqrt().cwiseInverse();
    const MatX S = unit.asDiagonal() * (0.5 * (K + K.transpose())) * unit.asDiagonal() - 1e-4 * MatX::Identity(K.rows(), K.cols());
    if (is_definite(S)) return {};
  }
  if (p.sought.size() == all && all <= 300) {
    System system;
    system.model = p.model;
    system.work = p.work;
    // The loads of the search are those at t = 0 itself.
    for (TimeFunction& e : system.model.expressions) e.unfreeze();
    try {
      Stability out;
      const std::vector<LinearMode> modes = linearise(system).modes;
      for (const LinearMode& mode : modes)
        if (const double size = std::abs(mode.pole); mode.kind == LinearMode::vibration && (out.slowest == 0.0 || size < out.slowest))
          out.slowest = size;
      for (const LinearMode& mode : modes) {
        if (mode.kind != LinearMode::unstable) break;
        if (out.stable) out.growth = mode.growth;
        out.stable = false;
        out.diverges = out.diverges || mode.frequency == 0.0;
        if (-mode.damping > out.damping_wanted) out.damping_wanted = -mode.damping, out.frequency = mode.frequency;
      }
      return out;
    } catch (const SimulationError&) {}
  }
  if (!made()) return {};
  const VecX eigenvalues = SymmetricEigen(0.5 * (K + K.transpose()), Eigen::EigenvaluesOnly).eigenvalues();
  const bool falls = eigenvalues[0] <= -1e-9 * eigenvalues.cwiseAbs().maxCoeff();
  return {!falls, falls};
}

// A beam of one piece whose material line is longer or shorter by a tenth than it is: its linear displacements are turned far beyond small
// angles. -1: none.
int beyond_its_field(const Model& model, const Scene& scene, const Work& work, double& length) {
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if (!beam || model.pieces[b].size() != 1) continue;
    const Part& part = model.parts[model.pieces[b].front()];
    const VecX& q = work.parts[model.pieces[b].front()].q;
    if (part.body.n == 0 || part.body.rod) continue;  // a rod keeps its length
    std::vector<std::pair<double, Vec3>> places;
    for (const FlexibleNode& node : part.body.nodes) {
      Vec3 at = node.origin + node.phi * q;
      for (int a = 0; a < 3; ++a)
        if (node.phi2[a].size() > 0) at[a] += 0.5 * q.dot(node.phi2[a] * q);
      places.emplace_back(node.origin.x(), at);
    }
    std::sort(places.begin(), places.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    length = 0.0;
    for (size_t k = 1; k < places.size(); ++k) length += (places[k].second - places[k - 1].second).norm();
    const double rest = places.empty() ? 0.0 : places.back().first - places.front().first;
    if (std::abs(length - rest) > 0.1 * rest) return static_cast<int>(b);
  }
  return -1;
}

// Joints whose motions accelerate at the start: "joint 'cart' with 2000".
std::string accelerating(const StaticProblem& p) {
  std::string out;
  for (const Part& part : p.model.parts)
    if (part.joint.motion >= 0 && p.motion[part.joint.motion].acceleration != 0.0)
      out += fmt::format("{}joint '{}' with {:.4g} {}", out.empty() ? "" : ", ", part.joint.name, p.motion[part.joint.motion].acceleration,
                         is_length(part.joint.kind, 0) ? "m/s^2" : "rad/s^2");
  return out;
}

// m/s: how fast the equilibrium moves as prescribed motions go on, since these turn weight and forces of constant direction, as seen from
// what they move. What is sought rests beside them at the start.
double leaving_speed(StaticProblem& p, double size) {
  constexpr double way = 1e-4;  // rad, or of the size: small enough for a derivative, large enough for its digits
  double fastest = 0.0;
  for (const Part& part : p.model.parts)
    if (part.joint.motion >= 0)
      fastest = std::max(fastest, std::abs(p.motion[part.joint.motion].rate) / (is_length(part.joint.kind, 0) ? size : 1.0));
  MatX K;
  if (!(fastest > 0.0) || p.sought.empty() || !p.stiffness(K)) return 0.0;
  const VecX q = p.work.q;
  const std::vector<TimeJet> motion = p.motion;
  const double dt = way / fastest;
  VecX moved[2];
  bool known = true;
  for (const int side : {0, 1}) {
    for (size_t i = 0; i < motion.size(); ++i) p.motion[i].value = motion[i].value + (side == 0 ? -dt : dt) * motion[i].rate;
    p.load(1.0);
    known = known && p.evaluate(nullptr, moved[side]);
    p.work.q = q;
  }
  p.motion = motion;
  p.load(1.0);
  update_positions(p.model, p.work);
  std::vector<int> order;
  if (!known || factorise(K, order) == 0.0) return 0.0;
  const VecX change = (moved[1] - moved[0]) / (2.0 * dt);
  VecX rate(change.size());
  solve(K, order, change.data(), rate.data());
  return rate.allFinite() ? rate.cwiseAbs().maxCoeff() : 0.0;
}

[[noreturn]] void refuse(const Scene& scene, StaticProblem& p, const Sought& what, const Raised& raised, const VecX& start) {
  const Direction d = p.sought.empty() ? Direction{} : p.sought[raised.found.worst];
  const double force = p.rest.force.size() > 0 ? p.rest.force[d.v] : 0.0;
  // The same without the accelerations of prescribed motions: then it is these that nothing balances.
  if (const std::string moving = accelerating(p); !moving.empty()) {
    for (TimeJet& jet : p.motion) jet.acceleration = 0.0;
    p.load(1.0);
    p.work.q = start;
    StaticSolution ignored;
    bool rests = search(p, what, Way::downhill, ignored).rest;
    if (!rests) rests = raise_loads(p, what, start, ignored).found.rest;
    if (rests)
      throw InputError(
          fmt::format("{}: there is no static equilibrium because prescribed motions accelerate at t = 0 ({}): {} is in equilibrium only "
                      "while they move at a constant rate; let the motion begin smoothly, or leave out the static start",
                      scene.file.string(), moving, name_of(p.model, d)));
  }
  const Part& part = p.model.parts[d.part];
  const std::string beyond = raised.share > 0.0 ? fmt::format(" beyond {:.3g} % of the loads", 100.0 * raised.share) : "";
  if (d.rate < 0)
    throw InputError(
        fmt::format("{}: there is no static equilibrium{}: {} stays out of balance; it buckles or deforms too far for its model: use model "
                    "= \"mixed\" with more volumes, or smaller loads",
                    scene.file.string(), beyond, name_of(p.model, d)));
  throw InputError(
      fmt::format("{}: there is no static equilibrium{}: a load of {:.4g} {} on {} stays unbalanced; give it a spring, a stop or a joint "
                  "that holds it, or hold it where it is with initial = {{ value = ... }}",
                  scene.file.string(), beyond, std::abs(force), is_length(part.joint.kind, d.rate) ? "N" : "Nm", name_of(p.model, d)));
}

// Whether the start without loads is a stable equilibrium: then a state that is not reached by raising them has been snapped to.
bool rests_without_loads(StaticProblem& p, const Sought& what, const VecX& start) {
  const VecX q = p.work.q;
  p.work.q = start;
  p.load(0.0);
  VecX f;
  MatX K;
  p.find_directions(what);
  const bool at_rest = p.evaluate(nullptr, f) && p.stiffness(K) && f.norm() * 1e-3 <= 1e-9 * K.norm() * p.model.size &&
                       is_definite(0.5 * (K + K.transpose()));
  p.load(1.0);
  p.work.q = q;
  return at_rest;
}

// Near positions in line a search may turn a link round and round: whole turns mean nothing to a hinge by itself. One by whose angle
// something goes keeps what the search found.
void take_back_turns(const Model& model, const Scene& scene, const VecX& start, Work& work) {
  constexpr double turn = 2.0 * std::numbers::pi;
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& part = model.parts[i];
    const TreeJoint& j = part.joint;
    if (j.kind != JointKind::revolute || j.motion >= 0 || j.spring || j.stop || j.scene_joint < 0) continue;
    const int at = static_cast<int>(i);
    const bool counted =
        is_read(scene, scene.joints[j.scene_joint]) ||
        std::any_of(model.loads.begin(), model.loads.end(), [&](const Load& l) { return l.table && l.table_part == at; }) ||
        std::any_of(model.couplings.begin(), model.couplings.end(), [&](const CouplingRow& row) {
          return std::any_of(row.terms.begin(), row.terms.end(), [&](const CouplingRow::Term& term) { return term.part == at; });
        });
    double& q = work.q[part.q0];
    const double moved = q - start[part.q0];
    if (!counted && std::abs(moved) >= turn) q -= turn * std::round(moved / turn);
  }
}

// The state of rest; p.work holds it.
void find_rest(StaticProblem& p, const Sought& what, const Scene& scene, const VecX& start, StaticSolution& out) {
  // What turns is held by more than stiffness: above its critical speed a shaft is stable at a saddle of its energy. The state beside the
  // start is taken if it is stable.
  const bool turning = std::any_of(p.motion.begin(), p.motion.end(), [](const TimeJet& jet) { return jet.rate != 0.0; });
  VecX beside;
  if (turning && search(p, what, Way::nearest, out).rest) {
    out.stability = find_stability(p, what);
    if (out.stability.stable || out.stability.flutters_little(scene.simulation.duration)) return;
    beside = p.work.q;
  }
  const bool flutters = beside.size() > 0 && !out.stability.diverges && out.stability.growth > 0.0;
  double length = 0.0;
  p.work.q = start;
  Found found = search(p, what, Way::downhill, out);
  if (beside.size() > 0 && (!found.rest || !find_stability(p, what).stable || beyond_its_field(p.model, scene, p.work, length) >= 0)) {
    // Nothing better downhill: the state beside the start, which is left at the smallest disturbance.
    p.work.q = beside;
    search(p, what, Way::nearest, out);
    return;  // its stability is known
  }
  if (!found.rest) {
    // Forces that follow the mechanism have no hill to run down.
    p.work.q = start;
    found = search(p, what, Way::nearest, out);
    if (found.rest) {
      out.stability = find_stability(p, what);
      if (out.stability.stable) return;
    }
  }
  if (!found.rest || (found.crossed && !flutters && rests_without_loads(p, what, start))) {
    const VecX direct = p.work.q;
    const Raised raised = raise_loads(p, what, start, out);
    out.snapped = raised.snapped;
    if (!raised.found.rest && !found.rest) refuse(scene, p, what, raised, start);
    found.tangent = raised.found.tangent;
    if (!raised.found.rest) {
      p.load(1.0);
      p.work.q = direct;
      found = search(p, what, Way::downhill, out);
    }
  }
  out.stability = find_stability(p, what, std::move(found.tangent));
}

// A shaft's deflection grows by 1 / |1 - (speed / critical speed)^2|, a pressed column's by 1 / (1 - P / Pcr), and so does what is added
// to it: the elastic stiffness along the deflection over the tangent stiffness along it, joints free to follow.
double softening(StaticProblem& p) {
  const auto n = static_cast<Eigen::Index>(p.sought.size());
  constexpr Eigen::Index most = 300;
  MatX K;
  if (n == 0 || n > most || !p.stiffness(K)) return 1.0;
  double elastic = 0.0;  // twice the energy
  for (size_t i = 0; i < p.model.parts.size(); ++i) {
    const VecX& q = p.work.parts[i].q;
    if (q.size() > 0) elastic += q.dot(p.model.parts[i].body.Ke * q);
  }
  std::vector<Eigen::Index> joints;
  VecX along = VecX::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Direction& d = p.sought[static_cast<size_t>(k)];
    if (d.rate >= 0) joints.push_back(k);
    else along[k] = d.scale * p.work.parts[d.part].q[-1 - d.rate];
  }
  VecX force = K * along;
  const auto held = std::ssize(joints);
  if (held > 0) {
    const MatX inner = K(joints, joints);
    const VecX pushed = force(joints);
    VecX followed = VecX::Zero(n);
    followed(joints) = -inner.completeOrthogonalDecomposition().solve(pushed);
    along += followed;
    force = K * along;
  }
  const double tangent = std::abs(along.dot(force));
  constexpr double largest = 1e3;
  return elastic > tangent ? std::min(largest, elastic / tangent) : 1.0;
}

}  // namespace

bool wants_statics(const Scene& scene) {
  return scene.simulation.static_start || std::any_of(scene.bodies.begin(), scene.bodies.end(), starts_static);
}

StaticSolution solve_statics(const Model& model, const Scene& scene, Work& work, const std::vector<char>& left) {
  Sought what = what_is_sought(model, scene);
  what.left = left;
  StaticSolution out;
  const VecX rates = work.w;
  work.w.setZero();
  lock_held(model, what, work);
  StaticProblem p = static_problem(model, work);
  const VecX start = work.q;
  find_rest(p, what, scene, start, out);
  take_back_turns(model, scene, start, work);
  update_positions(model, work);

  double length = 0.0;
  if (const int body = beyond_its_field(model, scene, work, length); body >= 0)
    throw InputError(
        fmt::format("{}: static equilibrium: body '{}' would be bent so far that its linear displacements stretch it from {:.4g} m to "
                    "{:.4g} m: use model = \"mixed\" with several volumes "
                    "for large deformations",
                    scene.file.string(), scene.bodies[body].name, std::get<BeamDef>(scene.bodies[body].kind).length, length));
  p.find_directions(what);
  for (const Direction& d : p.sought) {
    const Part& part = model.parts[d.part];
    const int at = d.rate < 0 ? part.eq0 - 1 - d.rate : part.q0 + (part.joint.nq == part.joint.nv ? d.rate : 0);
    out.moved = std::max(out.moved, d.scale * std::abs(work.q[at] - start[at]));
  }
  out.accelerating = accelerating(p);
  out.softened = softening(p);
  if (out.stability.slowest > 0.0) out.leaves = leaving_speed(p, model.size);
  if (p.by_size)
    for (size_t c = 0; c < model.clusters.size(); ++c)
      if (!work.clusters[c].partition.dep.empty()) work.clusters[c].partition = choose_partition(model, static_cast<int>(c), work, false);
  unlock(model, work);
  work.expression_value = p.expression;
  work.motion = p.motion;
  update_positions(model, work);
  work.w = rates;
  return out;
}

}  // namespace flexframe::sim
