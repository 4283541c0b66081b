#include "sim/run/richer_beams.h"

#include "sim/bodies/beam_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

template <class Change>
void change_frames(Scene& scene, const std::string& body, const Change& change) {
  const auto one = [&](FrameRef& f) {
    if (f.body == body) change(f.frame);
  };
  for (JointDef& j : scene.joints) one(j.parent), one(j.child);
  for (ForceDef& f : scene.forces) one(f.on), one(f.from);
  for (OutputDef& o : scene.outputs) one(o.of);
}

// The number in "node[3]", -1 for other names.
int index_of(const std::string& frame, const std::string& series) {
  if (frame.rfind(series + "[", 0) != 0 || frame.back() != ']') return -1;
  const std::string digits = frame.substr(series.size() + 1, frame.size() - series.size() - 2);
  return !digits.empty() && digits.size() < 7 && std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; })
             ? std::stoi(digits)
             : -1;
}

// Nodes become frames of their own name's number; false where a place is named that the new beam cannot have.
bool name_places(Scene& scene, BeamDef& beam, const std::string& name) {
  const int nodes = beam.model == BeamModel::mixed ? beam.volumes * beam.elements : beam.elements;
  bool known = true;
  change_frames(scene, name, [&](std::string& frame) {
    if (const int k = index_of(frame, "node"); k >= 0 && nodes > 0) {
      frame = fmt::format("at {} of {}", k, nodes);
      beam.frames[frame] = std::min(1.0, static_cast<double>(k) / nodes);
    } else if (index_of(frame, "station") >= 0) {
      known = false;
    }
  });
  return known;
}

}  // namespace

int elements_of(const BeamDef& beam) {
  if (beam.model == BeamModel::mixed) return beam.volumes * (beam.modes.empty() ? beam.elements : 2);
  int modes = 0;
  for (const auto& [direction, numbers] : beam.modes)
    if (!numbers.empty()) modes = std::max(modes, *std::max_element(numbers.begin(), numbers.end()));
  return beam.model == BeamModel::modal ? std::max(8, 2 * modes) : beam.elements;
}

BeamEffects deformations(const std::vector<EffectState>& states, size_t body) {
  BeamEffects out;
  for (const EffectState& s : states) {
    if (s.body != static_cast<int>(body) || !s.on) continue;
    out.axial |= s.effect == "axial", out.torsion |= s.effect == "torsion";
    out.bending_xy |= s.effect == "bending_xy", out.bending_xz |= s.effect == "bending_xz";
  }
  return out;
}

Scene with_plain_damping(const Scene& scene, const std::vector<size_t>& bodies, const std::vector<EffectState>& states) {
  Scene out = scene;
  for (const size_t body : bodies) {
    auto* beam = std::get_if<BeamDef>(&out.bodies[body].kind);
    if (!beam || (beam->damping.ratio.empty() && beam->damping.mass == 0.0)) continue;
    // Without damping by mass, which holds the first mode back by mass / 2 omega.
    BeamDef plain = *beam, critical = *beam;
    plain.damping.mass = 0.0;
    critical.damping = {};
    critical.damping.ratio = {1.0};
    const BeamEffects effects = deformations(states, body);
    const double two_over_omega = chain_time_constant(critical, effects);
    const double tau = chain_time_constant(plain, effects) + beam->damping.mass * std::pow(0.5 * two_over_omega, 2);
    beam->damping = {};
    beam->damping.stiffness = tau;
  }
  return out;
}

bool damped_by_modes(const Scene& scene, const std::vector<size_t>& bodies) {
  return std::any_of(bodies.begin(), bodies.end(), [&](const size_t body) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
    const auto damps = [](double r) { return r != 0.0; };
    return beam && beam->model != BeamModel::mixed &&
           (beam->damping.mass != 0.0 || std::any_of(beam->damping.ratio.begin(), beam->damping.ratio.end(), damps));
  });
}

void list_effects(const std::vector<EffectState>& states, const std::string& body, BeamDef& beam) {
  beam.effects.automatic = false;
  beam.effects.names.clear();
  for (const EffectState& s : states)
    if (s.owner == body && s.on && s.effect != "gyroscopic" && s.effect != "damping") beam.effects.names.push_back(s.effect);
}

namespace {

// The beam with these effects, its places named apart from nodes; null where the scene gives what another model cannot take over.
BeamDef* remade(Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const std::string& name = scene.bodies[body].name;
  auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (!beam || !beam->initial.q.empty() || !beam->initial.qd.empty()) return nullptr;
  if (!name_places(scene, *beam, name)) return nullptr;
  std::erase_if(scene.outputs,
                [&](const OutputDef& o) { return o.of.body == name && (o.quantity == Quantity::q || o.quantity == Quantity::qd); });
  list_effects(states, name, *beam);
  beam->modes.clear();
  beam->keep_modes.reset();
  beam->keep_axial.reset();
  beam->keep_torsion.reset();
  beam->chosen.complete_inertia = false;
  return beam;
}

}  // namespace

std::optional<Scene> with_volumes(const Scene& scene, const std::vector<EffectState>& states, size_t body, int volumes) {
  Scene out = scene;
  const auto* given = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (!given || given->model == BeamModel::lumped) return std::nullopt;
  const int elements = elements_of(*given);
  BeamDef* beam = remade(out, states, body);
  if (!beam) return std::nullopt;
  if (beam->boundary != Boundary::clamped_free)
    std::erase_if(out.outputs,
                  [&](const OutputDef& o) { return o.of.body == out.bodies[body].name && o.quantity == Quantity::displacement; });
  std::erase(beam->effects.names, "large_bending");
  beam->model = BeamModel::mixed;
  beam->volumes = volumes;
  beam->elements = std::max(1, (elements + volumes - 1) / volumes);
  beam->boundary = Boundary::clamped_free;
  return out;
}

std::optional<Scene> with_elements(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  Scene out = scene;
  const auto* given = std::get_if<BeamDef>(&scene.bodies[body].kind);
  const int elements = given ? elements_of(*given) : 0;
  BeamDef* beam = remade(out, states, body);
  if (!beam) return std::nullopt;
  beam->model = BeamModel::finite_element;
  beam->curvature_coupling = false;
  beam->elements = std::max(8, elements);
  if (beam->boundary == Boundary::clamped_clamped || beam->boundary == Boundary::clamped_supported) beam->boundary = Boundary::clamped_free;
  return out;
}

bool has_forms_of_ends(const BeamDef& beam) {
  return beam.model == BeamModel::modal || (beam.model == BeamModel::finite_element &&
                                            (beam.boundary == Boundary::clamped_clamped || beam.boundary == Boundary::clamped_supported));
}

namespace {

// A lumped beam of so many pieces; none where the scene gives their coordinates.
std::optional<Scene> with_pieces(const Scene& scene, size_t body, int pieces) {
  Scene out = scene;
  const std::string& name = scene.bodies[body].name;
  auto& beam = std::get<BeamDef>(out.bodies[body].kind);
  if (!beam.initial.q.empty() || !beam.initial.qd.empty() || !name_places(out, beam, name)) return std::nullopt;
  std::erase_if(out.outputs,
                [&](const OutputDef& o) { return o.of.body == name && (o.quantity == Quantity::q || o.quantity == Quantity::qd); });
  beam.elements = pieces;
  return out;
}

}  // namespace

std::optional<Scene> with_half_as_many(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const auto& beam = std::get<BeamDef>(scene.bodies[body].kind);
  const int fewest = beam.model == BeamModel::lumped ? 2 : 4;  // links err by the square of their length from two on
  const int elements = elements_of(beam) / 2;
  if (elements < fewest) return std::nullopt;
  if (beam.model == BeamModel::lumped) return with_pieces(scene, body, elements);
  const bool mixed = beam.model == BeamModel::mixed;
  std::optional<Scene> next =
      mixed ? with_volumes(scene, states, body, beam.elements > 1 ? beam.volumes : beam.volumes / 2) : with_elements(scene, states, body);
  if (next) std::get<BeamDef>(next->bodies[body].kind).elements = mixed ? std::max(1, beam.elements / 2) : elements;
  return next;
}

std::optional<Scene> with_twice_as_many(const Scene& scene, const std::vector<EffectState>& states, size_t body, bool& divided) {
  const auto& beam = std::get<BeamDef>(scene.bodies[body].kind);
  if (beam.model == BeamModel::lumped) return with_pieces(scene, body, 2 * beam.elements);
  if (beam.model == BeamModel::mixed) {
    std::optional<Scene> next = with_volumes(scene, states, body, 2 * beam.volumes);
    if (next && beam.modes.empty()) std::get<BeamDef>(next->bodies[body].kind).elements = beam.elements;
    return next;
  }
  const int elements = elements_of(beam);
  BeamDef finer = beam;
  finer.elements = 2 * elements;
  finer.keep_modes.reset();
  const BeamEffects effects = deformations(states, body);
  const int computed = beam::computed_elements(finer, effects);
  divided = beam.model == BeamModel::finite_element && computed < 2 * elements && computed <= beam::computed_elements(beam, effects);
  std::optional<Scene> next = divided ? with_volumes(scene, states, body, 2) : with_elements(scene, states, body);
  if (next) std::get<BeamDef>(next->bodies[body].kind).elements = divided ? computed : 2 * elements;
  divided &= next.has_value();
  return next;
}

void keep_as_many(const Scene& scene, size_t body, Scene& changed) {
  const auto& from = std::get<BeamDef>(scene.bodies[body].kind);
  auto& to = std::get<BeamDef>(changed.bodies[body].kind);
  if (to.model != BeamModel::finite_element) return;
  to.keep_modes = from.keep_modes, to.keep_axial = from.keep_axial, to.keep_torsion = from.keep_torsion;
}

}  // namespace flexframe::sim
