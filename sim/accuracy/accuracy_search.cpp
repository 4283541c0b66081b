#include "sim/accuracy/accuracy_search.h"

#include "sim/base/words.h"
#include "sim/bodies/normal_modes.h"
#include "sim/bodies/resolution.h"
#include "sim/dynamics/massless.h"
#include "sim/model/effects.h"
#include "sim/run/second_run.h"
#include "sim/run/start_forces.h"
#include "sim/scene/force_kinds.h"
#include "sim/start/make_system.h"
#include "sim/time/events.h"
#include "sim/time/newton_matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

namespace flexframe::sim {
namespace {

// Samples of the runs that are compared.
constexpr int compared_samples = 200;

bool names_nodes(const Scene& scene, const std::string& body) {
  const auto node = [&](const FrameRef& f) {
    return f.body == body && (f.frame.rfind("node[", 0) == 0 || f.frame.rfind("station[", 0) == 0);
  };
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) { return node(j.parent) || node(j.child); }) ||
         std::any_of(scene.forces.begin(), scene.forces.end(), [&](const ForceDef& f) { return node(f.on) || node(f.from); }) ||
         std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) { return node(o.of); });
}

std::vector<Resolvable> resolvable_bodies(const Scene& scene, const Model& model) {
  std::vector<Resolvable> out;
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if (!beam || !beam->initial.q.empty() || !beam->initial.qd.empty() || beam->keep_modes) continue;
    const bool coordinates = std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) {
      return o.of.body == scene.bodies[b].name && (o.quantity == Quantity::q || o.quantity == Quantity::qd);
    });
    if (coordinates || names_nodes(scene, scene.bodies[b].name)) continue;
    Resolvable r;
    r.body = b;
    r.model = beam->model;
    std::array<std::vector<double>, 4> directions;
    for (const Part& p : model.parts) {
      if (p.scene_body != static_cast<int>(b) || beam->model != BeamModel::finite_element || p.body.stiffness.size() == 0) continue;
      r.coordinates += p.body.n;
      std::array<std::vector<double>, 4>& by_direction = directions;
      by_direction = {};
      for (int k = 0; k < p.body.n; ++k)
        by_direction[coordinate_direction(p.body, k)].push_back(std::sqrt(std::max(0.0, p.body.stiffness[k])));
      // The direction with the lowest frequency sets the count.
      for (const auto& list : by_direction)
        if (!list.empty() && (r.frequencies.empty() || list.front() < r.frequencies.front())) r.frequencies = list;
    }
    if (beam->model == BeamModel::finite_element && r.frequencies.empty()) continue;
    const auto softest = [&](size_t direction) { return !r.frequencies.empty() && r.frequencies == directions[direction]; };
    r.stretches = !directions[0].empty() && !softest(0);
    r.twists = !directions[3].empty() && !softest(3);
    if (beam->model == BeamModel::modal) {
      if (beam->modes.empty()) continue;
      for (const auto& [direction, numbers] : beam->modes) r.given = std::max(r.given, *std::max_element(numbers.begin(), numbers.end()));
    } else {
      r.given = beam->model == BeamModel::mixed ? beam->volumes : beam->elements;
    }
    out.push_back(r);
  }
  return out;
}

// Whether the vibrations of a beam go on for some periods at least, however fast: ratios of a tenth of critical damping at most.
bool barely_damped(const BodyDef& body) {
  const auto* beam = std::get_if<BeamDef>(&body.kind);
  if (!beam) return false;
  const Damping& d = beam->damping;
  return d.mass == 0.0 && d.stiffness == 0.0 && std::all_of(d.ratio.begin(), d.ratio.end(), [](double r) { return r <= 0.1; });
}

// Whether an output may be a force, an acceleration or made of them.
bool is_force(Quantity q) {
  static const std::set<Quantity> forces{Quantity::acceleration,  Quantity::reaction, Quantity::force,      Quantity::power,
                                         Quantity::section_force, Quantity::stress,   Quantity::expression, Quantity::output};
  return forces.contains(q);
}

// Modes of the softest body at a level: 1 2 3 4 6 8 12 16 ...
int modes_at(int level) {
  if (level < 3) return std::max(1, level + 1);
  const int half = (level - 3) / 2;
  return (level % 2 == 1 ? 4 : 6) << half;
}

// As many as few modes may have (rounding: beam_elements.cpp).
constexpr int most_elements = 300;

// Modes more that tell what is missing: symmetric ones and others take turns, and every second one may have no part in the motion.
constexpr int telling_modes = 2;

}  // namespace

Search::Search(const Scene& scene, const SimulateOptions& options) : scene_(scene), options_(&options) {
  scene_.simulation.accuracy.reset();
  scene_.simulation.tolerance = default_tolerance;
  Scene unsolved = scene_;  // where it rests is nothing to bodies and events
  unsolved.simulation.static_start = false;
  const System system = make_system(unsolved);
  states = effect_states(scene_, system.model);
  for (const Note& n : system.notes.all())
    if (n.severity == Severity::warning) warnings.push_back(n);
  method = options.method;
  touches = has_events(system);
  smooth = !touches && all_have_inertia(system.model) && system.model.blocks.empty();
  cheap_ = system.plane || matrix_is_cheap(system);
  bodies_ = resolvable_bodies(scene_, system.model);
  reads_forces = std::any_of(scene_.outputs.begin(), scene_.outputs.end(), [](const OutputDef& o) { return is_force(o.quantity); });
  pictures = std::any_of(scene_.outputs.begin(), scene_.outputs.end(), [](const OutputDef& o) { return o.size > 0.0; });
  for (const Part& p : system.model.parts) elastic = elastic || p.body.n > 0;
  for (const Part& p : system.model.parts) undamped = undamped && p.body.De.size() == 0;
  for (const Part& p : system.model.parts)
    rings = rings && (p.body.De.size() == 0 || barely_damped(scene_.bodies[static_cast<size_t>(p.scene_body)]));
  for (const Resolvable& r : bodies_)
    if (!r.frequencies.empty()) softest_ = softest_ == 0.0 ? r.frequencies.front() : std::min(softest_, r.frequencies.front());
}

Scene Search::at(const Setting& setting) const {
  Scene out = scene_;
  out.simulation.tolerance = setting.tolerance;
  const int modes = modes_at(setting.level);
  // Bending frequencies of a beam with free ends grow as (2k + 1)^2: midway to the next one is the limit for all bodies.
  const double limit = softest_ * std::pow((2.0 * modes + 2.0) / 3.0, 2.0);
  for (const Resolvable& r : bodies_) {
    BeamDef& beam = std::get<BeamDef>(out.bodies[r.body].kind);
    const double share = std::pow(2.0, 0.5 * (setting.level - 4));
    if (r.model == BeamModel::finite_element) {
      // What is stiffer than that is rigid, unless its flexibility was found to matter.
      int keep = r.frequencies.front() < limit || flexible.count(scene_.bodies[r.body].name) > 0 ? 1 : 0;
      while (keep > 0 && keep < modes && r.frequencies.front() * std::pow((2.0 * keep + 3.0) / 3.0, 2.0) < limit) ++keep;
      if (const auto least = least_.find(r.body); keep > 0 && least != least_.end()) keep = std::max(keep, least->second);
      const auto more = more_.find(r.body);
      this->keep(r, keep, more == more_.end() ? 0 : more->second, beam);
      // Stiff shapes shorten explicit steps and lengthen series.
      const bool few = follows_vibrations(method) && !reads_forces && !with_static.contains(r.body) && !lacks_shear(r.body, keep);
      beam.keep_static = !few || takes_moments(r.body);
      // In space every hold moves in six ways: two welded beams took six times as long for the same error.
      beam.keep_inertia = few && !bends_in_space(r.body);
    } else if (r.model == BeamModel::modal) {
      for (auto& [direction, numbers] : beam.modes) numbers = mode_numbers(direction, modes);
    } else {
      // More of them at every level, however few the scene gives: two levels that are the same would look like no error.
      const int n = std::max(setting.level + 1, static_cast<int>(std::lround(r.given * share)));
      (r.model == BeamModel::mixed ? beam.volumes : beam.elements) = n;
    }
  }
  return out;
}

namespace {

// Whether joints lead from two places of the body to the ground, each without passing through it.
bool held_at_two(const Scene& scene, const std::string& body) {
  std::set<std::string> reached{"ground"};
  for (bool more = true; std::exchange(more, false);)
    for (const JointDef& j : scene.joints)
      if (j.parent.body != body && j.child.body != body && reached.contains(j.parent.body) != reached.contains(j.child.body))
        reached.insert({j.parent.body, j.child.body}), more = true;
  std::set<std::string> places;
  for (const JointDef& j : scene.joints)
    for (const auto& [here, there] : {std::pair(&j.parent, &j.child), std::pair(&j.child, &j.parent)})
      if (here->body == body && reached.contains(there->body)) places.insert(here->frame.empty() ? "root" : here->frame);
  return places.size() > 1;
}

}  // namespace

// Whether modes alone lack too much of what a force at its end deflects a beam by shear: a quarter of it over their number, as slowly as
// that falls (clamped beam of 3.3 heights, whose shear is 0.07 of its deflection: 2.8e-3, 2.0e-3, 1.0e-3, 5e-4 of it with 4, 8, 16, 32
// modes, 1e-4 with the shape that the force makes; two runs with 8 and 12 modes saw a quarter of it). What joints pass on has its shapes
// beside the modes anyway, and a torque is no such force: its shape instead of those of the inertia took 2.6e-3 where these took 7e-4
// (crank of the slider-crank, asked for 1e-3). A beam that is held at two places bends up to sixteen times less for its shear, both ends
// clamped and pushed in the middle (clamped and guided tube, shear 0.004: 3.7e-3, 1.35e-3, 6.4e-4 with 6, 12, 24 modes, told 4.6e-4).
bool Search::lacks_shear(size_t body, int modes) const {
  const std::string& name = scene_.bodies[body].name;
  const auto pushes = [&](const ForceDef& f) {
    return traits(f.kind).force && (f.on.body == name || (traits(f.kind).between && f.from.body == name));
  };
  if (scene_.simulation.gravity.isZero(0.0) && std::none_of(scene_.forces.begin(), scene_.forces.end(), pushes)) return false;
  const bool shears = std::any_of(states.begin(), states.end(),
                                  [&](const EffectState& s) { return s.body == static_cast<int>(body) && s.effect == "shear" && s.on; });
  if (modes == 0 || !shears) return false;
  const double stiffer = held_at_two(scene_, name) ? 16.0 : 1.0;
  return 0.25 * stiffer * shear_share(std::get<BeamDef>(scene_.bodies[body].kind), true, true) > 0.1 * accuracy * modes;
}

// A moment on a beam, of a spring, a stop or friction in a joint's free direction too, turns its sections at once, of which n modes lack
// 1/n. With the shapes of its inertia beside them more modes hardly bring it, so that two runs do not see it: flap on a stop, 12
// modes, 3.6e-2 of the turn, of which 16 bring 1e-4; 2.4e-4 with the shapes of forces at rest. Beam on a sprung hinge, asked for 0.1 and
// 0.01: 0.21 and 0.07 off, told as 0.08 and 0.03; 1.3e-3 and 1.1e-3 with these. A torque at the hinge about which its beam turns
// is balanced by the inertia of that turning, whose shape is there; in mechanisms of several bodies, whose estimates count twice, that does
// (crank of the slider-crank).
bool Search::takes_moments(size_t body) const {
  const std::string& name = scene_.bodies[body].name;
  const auto at_joint = [&](const JointDef& j) {
    return (j.spring || j.stop || j.friction) && (j.parent.body == name || j.child.body == name);
  };
  const auto turns = [&](const ForceDef& f) {
    return traits(f.kind).moment && !(bodies_.size() > 1 && turns_hinge(f)) &&
           (f.on.body == name || (traits(f.kind).between && f.from.body == name));
  };
  return std::any_of(scene_.joints.begin(), scene_.joints.end(), at_joint) ||
         std::any_of(scene_.forces.begin(), scene_.forces.end(), turns);
}

// A torque on a beam at the hinge about which it turns.
bool Search::turns_hinge(const ForceDef& force) const {
  const auto place = [](const FrameRef& f) { return f.frame.empty() ? "root" : f.frame; };
  return force.kind == ForceKind::torque && std::any_of(scene_.joints.begin(), scene_.joints.end(), [&](const JointDef& j) {
           return j.kind == JointKind::revolute && j.child.body == force.on.body && place(j.child) == place(force.on);
         });
}

bool Search::bends_in_space(size_t body) const {
  const auto bends = [&](const char* effect) {
    return std::any_of(states.begin(), states.end(),
                       [&](const EffectState& s) { return s.body == static_cast<int>(body) && s.effect == effect && s.on; });
  };
  return bends("bending_xy") && bends("bending_xz");
}

// So many modes of a beam's bending, of stretching and torsion a few and `more`.
void Search::keep(const Resolvable& body, int modes, int more, BeamDef& beam) const {
  beam.keep_modes = modes;
  const auto elements = [this](int n) { return std::min(most_elements, static_cast<int>(fineness * elements_behind_modes(n))); };
  beam.elements = std::max({body.given, elements_for_modes(modes), elements(modes)});
  const int stiff = modes > 0 ? std::min(modes, stiff_at_first) + more : 0;
  if (body.stretches) beam.keep_axial = stiff;
  if (body.twists) beam.keep_torsion = stiff;
  if (body.stretches || body.twists) beam.elements = std::max({beam.elements, elements_for_modes(stiff), elements(stiff)});
}

Scene Search::with_half(const Setting& setting) const {
  Scene out = at(setting);
  for (const Resolvable& r : bodies_) {
    BeamDef& beam = std::get<BeamDef>(out.bodies[r.body].kind);
    if (!beam.keep_modes || *beam.keep_modes < 2) continue;
    const auto more = more_.find(r.body);
    keep(r, (*beam.keep_modes + 1) / 2, more == more_.end() ? 0 : more->second, beam);
  }
  return out;
}

Scene Search::finer_than(const Setting& setting) const {
  const Scene here = at(setting);
  Scene next = at({setting.level + 1, setting.tolerance});
  for (const Resolvable& r : bodies_) {
    const std::optional<int> have = std::get<BeamDef>(here.bodies[r.body].kind).keep_modes;
    BeamDef& beam = std::get<BeamDef>(next.bodies[r.body].kind);
    if (!have || *have == 0 || !beam.keep_modes) continue;
    const auto more = more_.find(r.body);
    keep(r, std::max(*beam.keep_modes, *have + telling_modes), (more == more_.end() ? 0 : more->second) + telling_modes, beam);
  }
  return next;
}

void Search::keep_at_least(const Scene& scene) {
  for (const Resolvable& r : bodies_)
    if (const std::optional<int> keep = std::get<BeamDef>(scene.bodies[r.body].kind).keep_modes; keep && *keep > 0) least_[r.body] = *keep;
}

// The n-th mode of bending brings lambda_n^-4 of what a load that comes at once deflects, that of stretching or twist n^-2, and their
// shares at rest have one sign: what n modes lack falls as n^-3, or as 1/n. Levels of elements and volumes err by the square of their
// length. Two runs tell whether it falls slower here; rates and section forces, whose modes' shares add as squares, fall as n^-1.5.
// (A beam let go, 6 modes: 1.34e-4 of the range is lacking; as squares of shares that fall by 1.6 a step 9.2e-5 were told.)
double Refinement::error() const {
  double order = stiff ? 1.0 : body ? 3.0 : 2.0;
  constexpr double slowest = 1.5, step = 0.25;
  const auto change = [this](double p) { return (std::pow(grown, p) - 1.0) / (1.0 - std::pow(growth, -p)); };
  if (before > 0.0)
    while (order > slowest && change(order) > before / std::max(left, 1e-300)) order -= step;
  return left / (1.0 - std::pow(growth, -order));
}

std::vector<Refinement> Search::refinements(const Setting& setting) const {
  std::vector<Refinement> out;
  const Scene here = at(setting);
  bool others = false;
  for (const Resolvable& r : bodies_) {
    if (r.model != BeamModel::finite_element) others = true;
    else if (const std::optional<int> keep = std::get<BeamDef>(here.bodies[r.body].kind).keep_modes; keep && *keep > 0) {
      out.push_back({r.body});
      if (r.stretches || r.twists) out.push_back({r.body, true});
    }
  }
  if (others) out.push_back({});
  return out;
}

double Search::refine(const Refinement& what, Setting& setting) {
  const Scene here = at(setting);
  if (!what.body) {
    keep_at_least(here);  // those with modes keep what they have
    ++setting.level;
    return std::numbers::sqrt2;
  }
  const BeamDef& beam = std::get<BeamDef>(here.bodies[*what.body].kind);
  if (what.stiff) {
    more_[*what.body] += (beam.keep_axial ? beam.keep_axial : beam.keep_torsion).value_or(stiff_at_first);
    return 2.0;
  }
  const int have = *beam.keep_modes;
  int level = 0;
  while (modes_at(level) < have + telling_modes) ++level;
  least_[*what.body] = modes_at(level);
  return static_cast<double>(modes_at(level)) / have;
}

// More modes of bending bring more of stretching and torsion with them, up to those that are kept at first: these count towards twice as
// many. (A crank of three modes had eight of stretching instead of six, which set the steps of the run that judged it.)
void Search::refine_all(std::vector<Refinement>& list, Setting& setting) {
  const Scene here = at(setting);
  const auto stiff_of = [](const Scene& scene, size_t body) {
    const BeamDef& beam = std::get<BeamDef>(scene.bodies[body].kind);
    return (beam.keep_axial ? beam.keep_axial : beam.keep_torsion).value_or(0);
  };
  for (Refinement& r : list)
    if (!r.stiff) r.growth = refine(r, setting);
  const Scene bent = at(setting);
  for (Refinement& r : list) {
    if (!r.stiff) continue;
    more_[*r.body] += std::max(0, 2 * stiff_of(here, *r.body) - stiff_of(bent, *r.body));
    r.growth = 2.0;
  }
}

std::optional<Scene> Search::coarser(int by) const {
  Scene out = scene_;
  bool any = false;
  for (const Resolvable& r : bodies_) {
    BeamDef& beam = std::get<BeamDef>(out.bodies[r.body].kind);
    if (r.model == BeamModel::modal) {
      for (auto& [direction, numbers] : beam.modes)
        if (numbers.size() > 1) numbers.resize((numbers.size() + static_cast<size_t>(by) - 1) / static_cast<size_t>(by)), any = true;
      continue;
    }
    int& count = r.model == BeamModel::mixed ? beam.volumes : beam.elements;
    if (count > 1) count = (count + by - 1) / by, any = true;
  }
  if (any) return out;
  return std::nullopt;
}

std::optional<Scene> Search::doubled() const {
  Scene out = scene_;
  for (const Resolvable& r : bodies_) {
    BeamDef& beam = std::get<BeamDef>(out.bodies[r.body].kind);
    if (r.model == BeamModel::modal) return std::nullopt;
    (r.model == BeamModel::mixed ? beam.volumes : beam.elements) *= 2;
  }
  return out;
}

std::optional<Scene> Search::shorter_at_ends() const {
  // A place so many elements from an end is a node beside it, or near that, with half as many too (put_nodes_on_frames).
  constexpr double sets_length = 2.0;
  if (!reads_forces || scene_.simulation.static_start) return std::nullopt;
  Scene out = scene_;
  bool any = false;
  for (const Resolvable& r : bodies_) {
    if (r.model != BeamModel::finite_element) continue;
    any |= halve_first_elements(std::get<BeamDef>(out.bodies[r.body].kind), sets_length);
  }
  if (any) return out;
  return std::nullopt;
}

int Search::fewest() const {
  int out = 0;
  for (const Resolvable& r : bodies_) out = out == 0 ? r.given : std::min(out, r.given);
  return out;
}

// Where every coordinate takes differences in each of Newton's matrices, evaluations and matrices cost n^3 and more: space arm of two beams
// of ten elements, 90 rates 0.4 CPU s, ten of them 0.015. Elsewhere a run of so many costs some hundredths of a second.
bool Search::dear_as_given() const {
  int coordinates = 0;
  for (const Resolvable& r : bodies_) {
    if (r.model != BeamModel::finite_element) return false;
    coordinates += r.coordinates;
  }
  return coordinates > (cheap_ ? 100 : 40);
}

Scene Search::with_modes(int modes, int more) const {
  Scene out = scene_;
  for (const Resolvable& r : bodies_)
    if (r.model == BeamModel::finite_element) keep(r, modes, more, std::get<BeamDef>(out.bodies[r.body].kind));
  return out;
}

bool Search::all_in_elements() const {
  const auto in_elements = [](const Resolvable& r) { return r.model == BeamModel::finite_element; };
  return !bodies_.empty() && std::all_of(bodies_.begin(), bodies_.end(), in_elements);
}

int Search::level_for_modes(double modes) {
  int level = 0;
  while (modes_at(level) < modes) ++level;
  return level;
}

bool Search::chooses(size_t body) const {
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const Resolvable& r) { return r.body == body; });
}

Histories Search::run(const Scene& scene) {
  SimulateOptions o;
  o.method = method;
  o.samples = compared_samples;
  o.weight_shares = options_->weight_shares;
  o.progress = [this](double) {
    if (work_seconds() > until) throw SearchSpent{};
    if (options_->progress) options_->progress(0.0);
  };
  if (work_seconds() > until) throw SearchSpent{};
  Histories h = simulate_histories(scene, o);
  cpu += h.statistics.work;
  return h;
}

std::optional<Histories> Search::run_within(const Scene& scene, double seconds, const System* from) {
  SimulateOptions o;
  o.method = method;
  o.samples = compared_samples;
  o.weight_shares = options_->weight_shares;
  const double start = work_seconds();
  if (start > until) throw SearchSpent{};
  struct TooLong {};
  o.progress = [&](double) {
    if (options_->progress) options_->progress(0.0);
    const double now = work_seconds();
    if (now > until) throw SearchSpent{};
    if (now - start > seconds) throw TooLong{};
  };
  std::optional<Histories> out;
  try {
    if (from) {
      o.tolerance = scene.simulation.tolerance;
      out = simulate_histories_from(*from, scene, o);
    } else {
      out = simulate_histories(scene, o);
    }
  } catch (const TooLong&) {
  } catch (const SimulationError&) {  // a step beyond the limit of stability can tear a body apart
  } catch (const InputError&) {       // a method that this scene is not for
  }
  cpu += work_seconds() - start;
  return out;
}

void Search::set_effect(const EffectState& s, bool on) {
  scene_ = with_effect(scene_, states, s.owner, s.effect, on);
  for (Resolvable& r : bodies_) {
    if (scene_.bodies[r.body].name != s.owner || r.model != BeamModel::finite_element) continue;
    if (s.effect == "axial") r.stretches = on;
    if (s.effect == "torsion") r.twists = on;
  }
  for (BodyDef& b : scene_.bodies)
    if (b.name == s.owner) {
      if (auto* beam = std::get_if<BeamDef>(&b.kind)) beam->chosen.effects = true;
    }
  for (EffectState& other : states)
    if (other.owner == s.owner && other.effect == s.effect) other.on = on, other.by = "program";
}

bool Search::adopt(const std::vector<EffectState>& of_run) {
  bool more = false;
  const std::vector<EffectState> before = states;
  for (const EffectState& now : of_run)
    for (const EffectState& s : before)
      if (now.on && !s.on && s.owner == now.owner && s.effect == now.effect) set_effect(s, true), more = true;
  return more;
}

bool Search::spread_stiff() {
  bool more = false;
  for (const char* effect : {"axial", "torsion"}) {
    const std::vector<EffectState> before = states;
    const auto here = [&](const EffectState& s) { return s.effect == effect && s.body >= 0 && chooses(static_cast<size_t>(s.body)); };
    if (std::none_of(before.begin(), before.end(), [&](const EffectState& s) { return here(s) && s.on; })) continue;
    for (const EffectState& s : before)
      if (here(s) && !s.on && decides(s)) set_effect(s, true), more = true;
  }
  return more;
}

namespace {

// A beam of finite elements as chosen, in words.
std::string modes_in_words(const BodyDef& body, const BeamDef& beam) {
  if (beam.keep_modes == 0) return fmt::format("'{}' rigid", body.name);
  return fmt::format("'{}' {}{}{}{} of {}", body.name, how_many(*beam.keep_modes, "modes"),
                     beam.keep_axial ? fmt::format(", keep_axial = {}", *beam.keep_axial) : "",
                     beam.keep_torsion ? fmt::format(", keep_torsion = {}", *beam.keep_torsion) : "",
                     beam.keep_static && beam.keep_inertia ? " (keep_inertia = true)"
                     : beam.keep_static                    ? ""
                     : beam.keep_inertia                   ? " (keep_static = false, keep_inertia = true)"
                                                           : " (keep_static = false)",
                     how_many(beam.elements, "elements"));
}

}  // namespace

std::vector<std::string> Search::describe(const Scene& chosen, double tolerance) const {
  std::vector<std::string> out{fmt::format("tolerance {:.1e}", tolerance)};
  for (const Resolvable& r : bodies_)
    if (r.model == BeamModel::finite_element)
      out.push_back(modes_in_words(chosen.bodies[r.body], std::get<BeamDef>(chosen.bodies[r.body].kind)));
  return out;
}

std::vector<std::string> Search::describe(const Setting& setting) const {
  std::vector<std::string> out{fmt::format("tolerance {:.1e}", setting.tolerance)};
  const Scene chosen = at(setting);
  for (const Resolvable& r : bodies_) {
    const BodyDef& b = chosen.bodies[r.body];
    const BeamDef& beam = std::get<BeamDef>(b.kind);
    switch (r.model) {
      case BeamModel::finite_element:
        out.push_back(modes_in_words(b, beam));
        break;
      case BeamModel::modal:
        out.push_back(fmt::format("'{}' {} a direction", b.name, how_many(modes_at(setting.level), "modes")));
        break;
      case BeamModel::mixed:
        out.push_back(fmt::format("'{}' {}", b.name, how_many(beam.volumes, "volumes")));
        break;
      default:
        out.push_back(fmt::format("'{}' {}", b.name, how_many(beam.elements, "lumps")));
    }
  }
  if (method && method != options_->method) out.push_back(fmt::format("method {}", method_name(*method)));
  return out;
}

std::vector<std::string> Search::rigid_at(const Setting& setting) const {
  std::vector<std::string> out;
  const Scene chosen = at(setting);
  for (const Resolvable& r : bodies_)
    if (std::get<BeamDef>(chosen.bodies[r.body].kind).keep_modes == 0) out.push_back(chosen.bodies[r.body].name);
  return out;
}

bool Search::decides(const EffectState& s) const {
  if (!s.possible || s.by != "program" || s.effect == "shear" || s.effect == "large_bending") return false;
  return std::any_of(scene_.bodies.begin(), scene_.bodies.end(), [&](const BodyDef& b) {
    const auto* beam = std::get_if<BeamDef>(&b.kind);
    return beam && b.name == s.owner && (beam->effects.automatic || beam->chosen.effects);
  });
}

}  // namespace flexframe::sim
