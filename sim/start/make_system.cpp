#include "sim/start/make_system.h"

#include "sim/dynamics/beam_loads.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/stops.h"
#include "sim/model/model_build.h"
#include "sim/model/motion_jumps.h"
#include "sim/start/assembly.h"
#include "sim/start/held_lengths.h"
#include "sim/start/massless_find.h"
#include "sim/start/static_problem.h"
#include "sim/start/statics.h"
#include "sim/time/price.h"

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

// Whether anything supplies or takes out energy besides gravity and springs.
bool has_power(const Model& model) {
  if (!model.loads.empty()) return true;
  for (const LoopJoint& l : model.loops)
    if (l.spring) return true;
  for (const Part& p : model.parts)
    if (p.body.De.size() > 0 || p.joint.motion >= 0 || p.joint.spring || p.joint.stop || p.joint.friction) return true;
  for (const Flexure& f : model.flexures)
    if (f.links.time_constant > 0.0) return true;
  return false;
}

// A spring between two points pulls along the line through them; one that is pressed or stretched at length zero has no line to act along.
void check_springs(const Model& model, const Scene& scene, const Work& work) {
  for (const Load& load : model.loads) {
    const Spring& s = load.def.spring;
    // A cable is slack there.
    if (load.def.kind != ForceKind::spring_damper || load.def.cable || s.preload - s.stiffness * s.rest == 0.0) continue;
    const double length = (frame_world(model, work, load.on).p - frame_world(model, work, load.from).p).norm();
    // What the assembly leaves open, relative to the size.
    if (length > 1e-12 * model.size) continue;
    throw InputError(
        fmt::format("{}:{}: force{}: both ends of the spring are at the same point at the start, where its force of {:.4g} N has no "
                    "direction; move an end, start the mechanism from another position, or give neither rest nor preload",
                    scene.file.string(), load.def.line, load.def.name.empty() ? "" : fmt::format(" '{}'", load.def.name),
                    std::abs(s.preload - s.stiffness * s.rest)));
  }
}

// Model, work space and assembled start of system.scene.
void build(System& system, const FurtherOfBodies& further) {
  system.model = build_model(system.scene, further);
  system.work = make_work(system.model);
  system.notes = system.model.notes;
  system.notes.warn(system.scene.doubts);
  check_motions(system.model, system.scene, system.notes);
  check_tables(system.scene, system.notes);
  for (TimeFunction& e : system.model.expressions) {
    const std::vector<double> switches = e.switch_times(0.0, system.scene.simulation.duration);
    const double end = switches.empty() ? system.scene.simulation.duration : switches.front();
    e.freeze(0.5 * end);
  }
  assemble(system.model, system.scene, system.work, system.notes);
  check_springs(system.model, system.scene, system.work);
}

// Which state a static start found.
void say_rest(const StaticSolution& found, double duration, Notes& notes) {
  const std::string text = fmt::format("static equilibrium: {} Newton steps{}, coordinates moved by up to {:.4g} m", found.iterations,
                                       found.load_steps > 1 ? fmt::format(" in {} load steps", found.load_steps) : "", found.moved);
  const Stability& s = found.stability;
  if (s.stable) notes.tell("", text);
  else if (!s.flutters_little(duration))
    notes.warn("",
               text + "; it is unstable: the smallest disturbance makes the mechanism leave it" +
                   (s.diverges || s.growth == 0.0
                        ? ""
                        : fmt::format(", swinging at {:.3g} Hz and growing by {:.3g} 1/s; a damping ratio of {:.2g} would make it stable",
                                      s.frequency, s.growth, s.damping_wanted)));
  else
    notes.tell("", text + fmt::format("; without damping it flutters at {:.3g} Hz, but grows by {:.2g} 1/s only: by {:.2g} % within the "
                                      "run; a damping ratio of {:.2g} would make it stable",
                                      s.frequency, s.growth, 100.0 * std::expm1(s.growth * duration), s.damping_wanted));
  if (found.snapped >= 0.0)
    notes.tell("", fmt::format("static equilibrium: with loads raised from zero the mechanism snaps through or buckles at {:.3g} % of "
                               "them; the state it snapped to is taken",
                               100.0 * found.snapped));
  // What starts at rest beside an equilibrium that moves on vibrates about it.
  constexpr double noticed = 0.1;
  if (const double swing = s.slowest > 0.0 ? found.leaves / s.slowest : 0.0; swing > noticed * found.moved)
    notes.tell("", fmt::format("static equilibrium: it holds at t = 0 only, since the motions turn its loads: it moves on by {:.3g} m/s, "
                               "while the run starts at rest beside the motions and vibrates by up to {:.2g} m",
                               found.leaves, swing));
  if (!found.accelerating.empty())
    notes.tell(
        "", fmt::format("static equilibrium: prescribed motions accelerate at t = 0 ({}); their inertia forces are taken as a steady load",
                        found.accelerating));
}

}  // namespace

System make_system(const Scene& scene, const BeforeRest& before, const FurtherOfBodies& further) {
  System system;
  system.scene = scene;
  build(system, further);
  while (let_lengthen(held_lengths(system.model, system.scene, system.work), system.scene, system.notes)) build(system, further);
  if (wants_statics(scene)) {
    load_at_rest(system.model, system.work);
    const std::vector<char> left = before ? before(system.model, system.work) : std::vector<char>();
    const StaticSolution at_rest = solve_statics(system.model, scene, system.work, left);
    update_expressions(system.model, 0.0, system.work);
    assemble_rates(system.model, scene, system.work, system.notes);
    say_rest(at_rest, scene.simulation.duration, system.notes);
    system.softened = at_rest.softened;
  }
  const bool all_inertia = !find_massless(system);
  system.notes.tell(neglected_stiffening(system.model, scene, system.work));
  system.friction = make_friction(system.model, system.work);
  system.stops = stop_parts(system.model);
  for (const Part& p : system.model.parts) system.driven = system.driven || p.joint.motion >= 0;
  std::string why_not;
  if (all_inertia) system.plane = make_plane(system.model, system.work, why_not);
  // What presses surfaces together may stand normal to the plane.
  if (system.plane && system.friction.reactions && !system.plane->forces_within) system.plane.reset();
  system.quadrature = has_power(system.model);
  system.tolerance = scene.simulation.tolerance.value_or(default_tolerance);
  system.price = evaluation_price(system);
  return system;
}

}  // namespace flexframe::sim
