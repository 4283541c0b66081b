#include "sim/run/idle_bending.h"

#include "sim/base/error.h"
#include "sim/bodies/normal_modes.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/massless.h"
#include "sim/start/make_system.h"
#include "sim/start/statics.h"
#include "sim/start/structural_matrices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace flexframe::sim {
namespace {

// Bending is rounding below so much of the largest acceleration of a state, or where its stiffness would balance it at so much of the size:
// loops are closed to less.
constexpr double rounding = 1e-8, closed = 1e-10;

bool bends(const FlexibleBody& body, int k) {
  const int direction = coordinate_direction(body, k);
  return direction == 1 || direction == 2;
}

// Whether what acts at one time tells what acts at others.
bool may_be_judged(const Scene& scene) {
  return !wants_statics(scene) && !scene.colored_by_stress &&
         std::none_of(scene.joints.begin(), scene.joints.end(), [](const JointDef& j) { return j.stop.has_value(); }) &&
         std::none_of(scene.forces.begin(), scene.forces.end(),
                      [](const ForceDef& f) { return f.kind == ForceKind::contact || f.kind == ForceKind::user; });
}

// Of a beam without bending the weight's moments are told by other outputs than these.
bool tells_moments(Quantity q) {
  switch (q) {
    case Quantity::position:
    case Quantity::velocity:
    case Quantity::rotation:
    case Quantity::angular_velocity:
    case Quantity::displacement:
    case Quantity::value:
    case Quantity::rate:
    case Quantity::distance:
    case Quantity::distance_rate:
    case Quantity::expression:
      return false;
    default:
      return true;
  }
}

bool is_candidate(const Scene& scene, const Model& model, size_t b) {
  const BodyDef& body = scene.bodies[b];
  const auto* beam = std::get_if<BeamDef>(&body.kind);
  if (!beam || !beam->effects.automatic || beam->axis || !beam->modes.empty() || beam->model == BeamModel::lumped) return false;
  // Coordinates are numbered, and modes that have ratios of their own; a chain is damped like its first mode, which bends.
  if (!beam->initial.q.empty() || !beam->initial.qd.empty() || beam->damping.ratio.size() > 1) return false;
  if (beam->model == BeamModel::mixed && !beam->damping.ratio.empty()) return false;
  if (std::any_of(scene.outputs.begin(), scene.outputs.end(),
                  [&](const OutputDef& o) { return (o.quantity == Quantity::q || o.quantity == Quantity::qd) && o.of.body == body.name; }))
    return false;
  const auto chosen = [&](const char* effect) {
    return std::any_of(model.effects.begin(), model.effects.end(), [&](const EffectState& s) {
      return s.body == static_cast<int>(b) && s.effect == effect && s.on && s.by == "program";
    });
  };
  return chosen("bending_xy") && chosen("bending_xz");
}

// The mechanism at states in which the beams that are to go without bending have none.
class Probe {
 public:
  explicit Probe(System& system)
      : system_(system), directions_(independent_directions(system.model, system.work)), q_(system.work.q), motion_(system.work.motion) {
    for (const Part& part : system.model.parts)
      for (int k = 0; k < part.body.n; ++k)
        if (bends(part.body, k)) slowest_ = std::min(slowest_, std::sqrt(part.body.Ke(k, k) / part.body.Me(k, k)));
  }

  // Takes out of `idle` what is bent at any of the states; whether anything was.
  bool exclude_bent(std::set<int>& idle) {
    const double duration = system_.model.settings.duration;
    const size_t before = idle.size();
    for (const double time : {0.0, 0.37 * duration, 0.81 * duration}) look({time, 0.4, 0.0, 0.0}, idle);
    // Turning at a tenth of what the beams vibrate at shows a mass beside the axis.
    look({0.0, 0.4, 0.0, 0.1 * slowest_}, idle);
    look({0.0, -0.7, 1e-4, 0.0}, idle);
    look({0.0, 0.4, 1e-3, 0.1 * slowest_}, idle);
    return idle.size() < before;
  }

 private:
  // turns: of joints, rad or of the size; deformation: of the size; rates: rad/s or of the size.
  struct State {
    double time, turns, deformation, rates;
  };

  void look(const State& state, std::set<int>& idle) {
    Work& work = system_.work;
    const Model& model = system_.model;
    work.q = q_;
    work.w.setZero();
    for (size_t i = 0; i < directions_.size(); ++i) {
      const Direction& d = directions_[i];
      const Part& part = model.parts[static_cast<size_t>(d.part)];
      if (d.rate < 0 && idle.contains(part.scene_body) && bends(part.body, -1 - d.rate)) continue;
      // Some number for each.
      const double share = std::sin(1.0 + 2.3 * static_cast<double>(i)), unit = model.size / d.scale;
      move_along(model, d, share * unit * (d.rate < 0 ? state.deformation : state.turns), work);
      work.w[d.v] = share * unit * state.rates * (d.rate < 0 ? 1e-3 : 1.0);
    }
    update_expressions(system_.model, state.time, work);
    // Driven joints stand as they start, at the rates of that time or of the state.
    for (size_t i = 0; i < work.motion.size(); ++i) {
      work.motion[i].value = motion_[i].value;
      if (state.rates > 0.0) work.motion[i].rate = state.rates * std::min(1.0, model.size);
    }
    update_positions(model, work);
    update_velocities(model, work);
    update_system_accelerations(system_);
    const VecX sizes = rate_sizes(model);
    const double largest = work.wdot.cwiseProduct(sizes).cwiseAbs().maxCoeff();
    for (const Part& part : model.parts)
      for (int k = 0; k < part.body.n && idle.contains(part.scene_body); ++k) {
        if (!bends(part.body, k)) continue;
        const double unit = sizes[part.ev0 + k], pushed = std::abs(work.wdot[part.ev0 + k]) * unit;
        const double balanced = pushed * part.body.Me(k, k) / part.body.Ke(k, k);
        if ((pushed > rounding * largest && balanced > closed * model.size) || std::abs(work.q[part.eq0 + k]) * unit > closed * model.size)
          idle.erase(part.scene_body);
      }
  }

  System& system_;
  const std::vector<Direction> directions_;
  const VecX q_;
  const std::vector<TimeJet> motion_;
  double slowest_ = std::numeric_limits<double>::max();  // rad/s, of what bends in the bodies
};

// Of each of these beams the lowest frequency of the mechanism, as it starts, at which it bends, rad/s; 0: not known.
std::map<int, double> lowest_bending(System& system, const std::set<int>& beams) {
  constexpr double takes_part = 0.05;  // of the strain energy
  const std::vector<Direction> directions = independent_directions(system.model, system.work);
  const StructuralMatrices matrices = structural_matrices(system.model, system.work, directions);
  const StructuralVibrations found = structural_vibrations(matrices);
  std::map<int, double> out;
  if (found.frequencies.size() == 0) return out;
  // What moves without stiffness is no vibration.
  const double least = 1e-6 * found.frequencies[found.frequencies.size() - 1];
  for (Eigen::Index m = 0; m < found.frequencies.size() && out.size() < beams.size(); ++m) {
    if (found.frequencies[m] <= least) continue;
    const VecX w = matrices.N * found.shapes.col(m);
    std::map<int, double> bending;
    double all = 0.0;
    for (const Part& part : system.model.parts) {
      if (part.body.n == 0) continue;
      const VecX e = w.segment(part.ev0, part.body.n), force = part.body.Ke * e;
      all += e.dot(force);
      for (int k = 0; k < part.body.n && beams.contains(part.scene_body); ++k)
        if (bends(part.body, k)) bending[part.scene_body] += e[k] * force[k];
    }
    for (const auto& [beam, energy] : bending)
      if (energy > takes_part * all) out.try_emplace(beam, found.frequencies[m]);
  }
  return out;
}

}  // namespace

Scene without_idle_bending(const Scene& given, bool asked) {
  Scene scene = given;
  for (BodyDef& body : scene.bodies)
    if (auto* beam = std::get_if<BeamDef>(&body.kind)) beam->chosen.first_bending = 0.0;
  const auto automatic = [](const BodyDef& b) {
    const auto* beam = std::get_if<BeamDef>(&b.kind);
    return beam && beam->effects.automatic;
  };
  if (!may_be_judged(scene) || std::none_of(scene.bodies.begin(), scene.bodies.end(), automatic)) return scene;
  const bool weight =
      !asked && std::none_of(scene.outputs.begin(), scene.outputs.end(), [](const OutputDef& o) { return tells_moments(o.quantity); });
  try {
    System system = make_system(scene);
    if (system.plane || !all_have_inertia(system.model)) return scene;
    std::set<int> idle;
    for (size_t b = 0; b < scene.bodies.size(); ++b)
      if (is_candidate(scene, system.model, b)) idle.insert(static_cast<int>(b));
    if (idle.empty()) return scene;
    if (weight) system.model.settings.gravity.setZero();
    for (TimeFunction& e : system.model.expressions) e.unfreeze();
    Probe probe(system);
    // What is bent bends others.
    while (!idle.empty() && probe.exclude_bent(idle)) {}
    if (idle.empty()) return scene;
    System at_start = make_system(scene);
    for (const auto& [b, first] : lowest_bending(at_start, idle))
      std::get<BeamDef>(scene.bodies[static_cast<size_t>(b)].kind).chosen.first_bending = first;
  } catch (const InputError&) {
    // What cannot be simulated as it stands is told by its run.
  } catch (const SimulationError&) {}
  return scene;
}

}  // namespace flexframe::sim
