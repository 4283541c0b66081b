#include "sim/run/method_choice.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/massless.h"
#include "sim/scene/joint_kinds.h"
#include "sim/time/events.h"
#include "sim/time/newton_matrix.h"
#include "sim/time/price.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

namespace {

constexpr double few_radians = 500.0;
// In loops the Runge-Kutta method makes Newton's matrix anew in every step, by differences, and stages that leave the loops' lengths
// shake what is stiff: it is the dearer one up to about there, and errs ten times as much.
constexpr double few_radians_in_loops = 2500.0;

// Radians that a vibration makes until the run ends or it has decayed to a millionth; damping: 2 ratio frequency, 1/s. What decays without
// vibrating makes none.
double radians_seen(double frequency, double damping, double duration) {
  if (damping >= 2.0 * frequency) return 0.0;
  const double living = damping > 0.0 ? -2.0 * std::log(1e-6) / damping : duration;
  return frequency * std::min(duration, living);
}

// Of a body's or a chain's vibrations, where stiffness alone damps them: the most radians of one at or below a frequency.
double most_radians(double frequency, double time_constant, double duration) {
  const double longest = std::sqrt(-2.0 * std::log(1e-6) / (time_constant * duration));
  return radians_seen(std::min(frequency, longest), time_constant * std::pow(std::min(frequency, longest), 2), duration);
}

// Whether the run stays where a static start put it.
bool stays_at_rest(const System& system) {
  const Scene& scene = system.scene;
  return scene.simulation.static_start && system.work.w.isZero(0.0) &&
         std::all_of(system.model.expressions.begin(), system.model.expressions.end(),
                     [](const TimeFunction& e) { return e.constant(); }) &&
         system.model.blocks.empty() &&
         std::none_of(system.model.functions.begin(), system.model.functions.end(),
                      [](const StateFunction& f) { return f.expression.depends_on_time(); }) &&
         std::none_of(scene.joints.begin(), scene.joints.end(), [](const JointDef& j) { return j.initial.value || j.initial.rate; });
}

// The exponential method makes a matrix of all rates, with its vibrations, in every step: it may cost so many evaluations. From five on
// runs are as dear as by the Runge-Kutta method, from fifteen on two to twenty times (20 rates of a beam).
constexpr double most_evaluations_a_matrix = 4.0;
// Tighter than that Adams, which follows vibrations too, is up to three times as cheap.
constexpr double followed_from = 0.9999e-8;

// Whether an independent rate is one of a body's deflection.
bool is_elastic(const Model& model, int rate) {
  return std::any_of(model.parts.begin(), model.parts.end(), [&](const Part& p) { return rate >= p.ev0 && rate < p.ev0 + p.body.n; });
}

// Whether anything but a body may hold what moves: forces that depend on the state are springs too.
bool has_spring(const Model& model) {
  const auto is_one = [](const Load& l) {
    return (l.def.kind != ForceKind::force && l.def.kind != ForceKind::torque) || l.table_part >= 0;
  };
  return !model.flexures.empty() || !model.functions.empty() || std::any_of(model.loads.begin(), model.loads.end(), is_one) ||
         std::any_of(model.parts.begin(), model.parts.end(), [](const Part& p) { return p.joint.spring.has_value(); }) ||
         std::any_of(model.loops.begin(), model.loops.end(), [](const LoopJoint& l) { return l.spring.has_value(); });
}

// Independent rates of all mechanisms.
int independent_rates(const System& system) {
  size_t rates = 0;
  for (const ClusterWork& c : system.work.clusters) rates += c.partition.ind.size();
  return static_cast<int>(rates);
}

// Whether vibrations are better followed to the end than stepped over: few rates, of bodies on prescribed motions or of mechanisms that
// turn freely, whose loops shake the bodies anew in every turn.
bool worth_following(const System& system) {
  return may_follow(system) && linear_model_price(independent_rates(system)) <= most_evaluations_a_matrix * system.price;
}

}  // namespace

std::string why_not_exponential(const System& system) {
  if (has_events(system)) return "dry friction, stops and contacts have events, which need to be located";
  if (!system.model.blocks.empty()) return "blocks have states of their own";
  return all_have_inertia(system.model) ? "" : "massless bodies need an equilibrium in every evaluation";
}

bool may_follow(const System& system) {
  if (system.tolerance < followed_from || !why_not_exponential(system).empty()) return false;
  const Model& model = system.model;
  bool free_joints = false;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (const int k : system.work.clusters[c].partition.ind) {
      if (is_elastic(model, model.clusters[c].v0 + k)) continue;
      if (model.clusters[c].loops.empty()) return false;
      free_joints = true;
    }
  return !(free_joints && has_spring(model));
}

// Explicit steps are limited by stability to about one radian of the fastest elastic vibration. Up to 2000 such radians in the run
// Adams is the cheapest; beyond, the L-stable Runge-Kutta method steps over vibrations that the tolerance does not see (BDF of order
// 3 to 5 is unstable for them, of order 2 it is three times as dear). Where damping turns the fastest vibrations into decay, BDF is stable
// and the cheapest: a damped beam on its way to large deformations took it 100 steps and the Runge-Kutta method, whose trial stages
// overshoot, several thousand. Slower vibrations that are damped lightly it has to follow until they have died away, at some ten steps a
// radian: from 500 radians on it is the dearer one (cantilevers with Rayleigh damping: 12 000 steps instead of 460), in loops from some
// thousand on (few_radians_in_loops). Few rates of bodies are followed by the exponential method in place of the Runge-Kutta method, which
// is off by a hundred to a thousand times as much there.
Method choose_method(const System& system, double& fastest_vibration) {
  double fastest = 0.0;
  bool decays = true;  // the fastest vibration of every elastic body is damped beyond critically
  double radians = 0.0;
  const double duration = system.model.settings.duration;
  for (const Part& p : system.model.parts) {
    double top = 0.0, damping = 0.0;
    for (int k = 0; k < p.body.n; ++k) {
      const double square = p.body.Ke(k, k) / p.body.Me(k, k), damped = p.body.De.size() > 0 ? p.body.De(k, k) / p.body.Me(k, k) : 0.0;
      radians = std::max(radians, radians_seen(std::sqrt(std::max(square, 0.0)), damped, duration));
      if (square <= top) continue;
      top = square;
      damping = damped;
    }
    decays = decays && (p.body.n == 0 || damping > 2.0 * std::sqrt(top));
    fastest = std::max(fastest, top);
  }
  for (const Flexure& f : system.model.flexures) {
    const double top = flexure_frequency(f);
    // Pieces that stretch do so faster than they bend: of the chain the fastest counts.
    const bool fastest_of_chain = std::none_of(f.parts.begin(), f.parts.end(), [&](int part) {
      const FlexibleBody& piece = system.model.parts[part].body;
      return piece.n > 0 && (piece.Ke.diagonal().array() / piece.Me.diagonal().array()).maxCoeff() > top * top;
    });
    if (fastest_of_chain) decays = decays && f.links.time_constant * top > 2.0;
    if (decays) radians = std::max(radians, most_radians(top, f.links.time_constant, duration));
    fastest = std::max(fastest, top * top);
  }
  if (massless_decay(system.model, system.work) * system.model.settings.duration > 2000.0) return Method::bdf;
  // Friction that follows the slip's direction turns it at mu N / (m s), without bound where it starts slowly from rest (a pull in a
  // turning direction: 315 000 steps of Adams, 1400 of BDF).
  if (std::any_of(system.friction.points.begin(), system.friction.points.end(),
                  [](const FrictionPoint& p) { return p.phase == FrictionPhase::slip; }))
    return fastest > 0.0 && !decays ? Method::dirk : Method::bdf;
  fastest_vibration = std::sqrt(fastest);
  // At rest implicit steps grow to the length of the run; explicit ones follow vibrations that nobody excites.
  if (fastest_vibration > 0.0 && !decays && stays_at_rest(system)) return Method::dirk;
  if (fastest_vibration * duration < 2000.0) return Method::adams;
  if (decays && radians < (system.model.loops.empty() ? few_radians : few_radians_in_loops)) return Method::bdf;
  return worth_following(system) ? Method::exponential : Method::dirk;
}

bool may_be_followed(const System& system) {
  for (size_t c = 0; c < system.model.clusters.size(); ++c)
    if (deformation_closes(system.model, system.work.clusters[c].partition, static_cast<int>(c))) return false;
  return true;
}

namespace {

// "joint 'slide'" or "body 'rod'" of every independent rate.
std::vector<std::string> rate_owners(const System& system) {
  std::vector<std::string> out;
  const Model& model = system.model;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) {
      const int v = model.clusters[c].v0 + k;
      for (const Part& p : model.parts) {
        const bool of_joint = v >= p.v0 && v < p.v0 + p.joint.nv;
        if (!of_joint && (v < p.ev0 || v >= p.ev0 + p.body.n)) continue;
        const bool named = (of_joint && p.joint.scene_joint >= 0) || p.scene_body < 0;
        out.push_back(named ? fmt::format("joint '{}'", p.joint.name) : fmt::format("body '{}'", system.scene.bodies[p.scene_body].name));
        break;
      }
    }
  return out;
}

// Beyond so many rates the eigenvalues cost more than they tell.
constexpr Eigen::Index most_rates = 150;

}  // namespace

FastestPart find_fastest(System& system, double t, const VecX& y) {
  FastestPart out;
  if (!all_have_inertia(system.model)) return out;
  MatX A, B;
  try {
    difference_rates(system, t, y.data(), nullptr, A, B);
  } catch (const SimulationError&) {
    return out;
  }
  const Eigen::Index n = A.rows();
  if (n == 0 || n > most_rates || !A.allFinite() || !B.allFinite()) return out;
  // Coordinates in units in which both halves of the matrix are of one size.
  const double unit = std::max({std::sqrt(A.cwiseAbs().maxCoeff()), B.cwiseAbs().maxCoeff(), 1e-300});
  MatX J = MatX::Zero(2 * n, 2 * n);
  J.topRightCorner(n, n).diagonal().setConstant(unit);
  J.bottomLeftCorner(n, n) = A / unit;
  J.bottomRightCorner(n, n) = B;
  const ComplexEigen eigen(J);
  if (eigen.info() != Eigen::Success) return out;
  Eigen::Index fastest = 0;
  out.rate = eigen.eigenvalues().cwiseAbs().maxCoeff(&fastest);
  out.decays = true;
  for (Eigen::Index k = 0; k < 2 * n; ++k)
    if (const std::complex<double> value = eigen.eigenvalues()[k]; std::abs(value) > 0.01 * out.rate)
      out.decays = out.decays && -value.real() > 0.9 * std::abs(value);
  // The share of a rate in a motion, whatever its unit: its entries in the right and the left eigenvector.
  const Eigen::MatrixXcd left = eigen.left_eigenvectors();
  Eigen::VectorXd share = eigen.eigenvectors().col(fastest).tail(n).cwiseAbs();
  if (left.allFinite()) share = share.cwiseProduct(left.row(fastest).tail(n).transpose().cwiseAbs());
  Eigen::Index owner = 0;
  share.maxCoeff(&owner);
  const std::vector<std::string> owners = rate_owners(system);
  if (owner < static_cast<Eigen::Index>(owners.size())) out.owner = owners[owner];
  return out;
}

bool MethodReview::due(long steps, double effort, double t, double duration) {
  if (steps < next_) return false;
  const double done = t - from_;
  pace_ = done / std::max(1.0, effort - from_effort_);
  step_ = done / static_cast<double>(std::max(1L, steps - from_steps_));
  to_go_ = (duration - t) / std::max(step_, 1e-300);
  from_ = t;
  from_steps_ = steps;
  from_effort_ = effort;
  next_ = 4 * steps;
  return true;
}

bool MethodReview::hopeless(double most) const {
  // A start that takes short steps for a while is over after some thousand of them.
  const double far = from_steps_ < 8000     ? 1e4
                     : from_steps_ < 32000  ? 100.0
                     : from_steps_ < 128000 ? 20.0
                     : from_steps_ < 512000 ? 5.0
                                            : 2.0;
  return to_go_ > far * most;
}

std::string what_takes_steps(System& system, double t, const VecX& y, double step) {
  const FastestPart fastest = find_fastest(system, t, y);
  // Turns: a full one takes some twenty steps.
  double spin = 0.0;
  std::string turns;
  for (const Part& p : system.model.parts) {
    // Joints without a word stand between the pieces of a beam: they bend.
    if (traits(p.joint.kind).word.empty()) continue;
    double square = 0.0;
    for (int k = 0; k < rates_of(p.joint.kind); ++k)
      if (!is_length(p.joint.kind, k))
        square += std::pow(p.joint.motion >= 0 ? system.work.motion[p.joint.motion].rate : system.work.w[p.v0 + k], 2);
    if (const double rate = std::sqrt(square); rate > spin) spin = rate, turns = p.joint.name;
  }
  if (spin * step > 0.01 && spin > 0.3 * fastest.rate)
    return fmt::format("they follow joint '{}', which turns at {:.3g} rad/s", turns, spin);
  if (fastest.rate * step > 0.01)
    return fmt::format("they follow {}, which {} at {:.3g} {}", fastest.owner, fastest.decays ? "decays" : "vibrates", fastest.rate,
                       fastest.decays ? "1/s" : "rad/s");
  return fmt::format("the tolerance of {:g} asks for them", system.tolerance);
}

}  // namespace flexframe::sim
