// Rotation: omega^2 grows by about Omega^2 (Wright et al. 1982: the factor lies between 1.17 and 0.17 for flap and lag of the first
// mode); axial load: omega^2 = omega_1^2 (1 - P/Pcr), Pcr = pi^2 EI/L^2 (Heckmann et al. 2006 section 6.2).
#include "sim/dynamics/beam_loads.h"

#include "sim/bodies/normal_modes.h"
#include "sim/dynamics/kinematics.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flexframe::sim {
namespace {

// Largest value or rate of an expression over the run, at a thousand times.
double largest(const Model& model, int expression, bool rate) {
  TimeFunction f = model.expressions[expression];
  f.unfreeze();
  double most = 0.0;
  for (int k = 0; k <= 1000; ++k) {
    const double t = model.settings.duration * k / 1000.0;
    try {
      most = std::max(most, std::abs(rate ? f.jet(t).rate : f.value(t)));
    } catch (const SimulationError&) {
      break;  // what is no number is the run's affair, which says when and where
    }
  }
  return most;
}

// Largest rate of turning across the axis x (world), rad/s.
double turning(const Model& model, const Work& work, int part, const Vec3& x) {
  double driven = 0.0;
  for (int i = part; i != ground; i = model.parts[i].parent) {
    const TreeJoint& j = model.parts[i].joint;
    if (j.motion < 0 || is_length(j.kind, 0)) continue;
    const Vec3 axis = frame_world(model, work, j.reversed ? j.outboard : j.inboard).R * j.axis;
    driven += largest(model, j.motion, true) * axis.cross(x).norm();
  }
  const Vec6& V = work.parts[part].V;
  return std::max(driven, std::hypot(V[4], V[5]));
}

}  // namespace

std::vector<std::string> neglected_stiffening(const Model& model, const Scene& scene, const Work& work) {
  // A hundredth of a frequency is a fiftieth of its square.
  constexpr double least = 0.02;
  std::vector<std::string> out;
  for (const EffectState& effect : model.effects) {
    if (effect.effect != "stiffening" || effect.on || !effect.possible || effect.body < 0) continue;
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[effect.body].kind);
    if (!beam || model.pieces[effect.body].size() != 1) continue;
    const int at = model.pieces[effect.body].front();
    const Part& part = model.parts[at];
    double first = std::numeric_limits<double>::infinity(), bending = first;
    for (int k = 0; k < part.body.n; ++k) {
      const int direction = coordinate_direction(part.body, k);
      if (direction != 1 && direction != 2) continue;
      const double square = part.body.Ke(k, k) / part.body.Me(k, k);
      if (square <= 0.0 || square >= first) continue;
      first = square;
      bending = beam->material.youngs_modulus * (direction == 1 ? beam->section.iz : beam->section.iy);
    }
    if (!std::isfinite(first)) continue;

    const Vec3 x = work.parts[at].world.R.col(0);
    const double rate = turning(model, work, at, x);
    double force = 0.5 * part.body.mass * std::abs(model.settings.gravity.dot(x));
    for (const Load& load : model.loads) {
      if (load.def.kind != ForceKind::force || load.table || load.function >= 0 || load.expression < 0 || model.frames[load.on].part != at)
        continue;
      const Vec3 direction = load.def.follower ? Vec3(frame_world(model, work, load.on).R * load.def.direction) : load.def.direction;
      force += std::abs(direction.dot(x)) * largest(model, load.expression, false);
    }
    const double omega = std::sqrt(first), share = force * beam->length * beam->length / (std::numbers::pi * std::numbers::pi * bending);
    std::string what;
    if (rate * rate > least * first)
      what = fmt::format("it rotates at up to {:.3g} rad/s, {:.3g} times its first bending frequency{}", rate, rate / omega,
                         rate > omega ? ", where the deflection grows without bound" : "");
    if (share > least) what += fmt::format("{}its axial force reaches {:.3g} times pi^2 EI/L^2", what.empty() ? "" : "; ", share);
    if (!what.empty())
      out.push_back(
          fmt::format("body '{}': the effect stiffening is off, but needed: {}; add \"stiffening\" to 'effects'", part.name, what));
  }
  return out;
}

}  // namespace flexframe::sim
