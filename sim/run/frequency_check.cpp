#include "sim/run/frequency_check.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/error.h"
#include "sim/dynamics/directions.h"
#include "sim/run/effect_report.h"
#include "sim/run/model_check.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>

namespace flexframe::sim {
namespace {

// A linearisation takes some forty evaluations a direction and the third power of their number.
constexpr size_t most_directions = 200;

// The beam as finite elements with the effects that are on.
std::optional<Scene> as_elements(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  if (std::get<BeamDef>(scene.bodies[body].kind).model != BeamModel::lumped) return with_elements(scene, states, body);
  Scene out = scene;
  BeamDef& beam = std::get<BeamDef>(out.bodies[body].kind);
  beam.model = BeamModel::finite_element;
  beam.curvature_coupling = false;
  list_effects(states, out.bodies[body].name, beam);
  return out;
}

// Twice as many volumes of as many elements.
std::optional<Scene> as_twice_the_volumes(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const BeamDef& beam = std::get<BeamDef>(scene.bodies[body].kind);
  std::optional<Scene> out = with_volumes(scene, states, body, 2 * beam.volumes);
  if (out) std::get<BeamDef>(out->bodies[body].kind).elements = beam.modes.empty() ? beam.elements : 2;
  return out;
}

// Whether a place is named by the number of a node.
bool names_nodes(const Scene& scene, const std::string& body) {
  const auto names = [&](const FrameRef& f) { return f.body == body && f.frame.starts_with("node["); };
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) { return names(j.parent) || names(j.child); }) ||
         std::any_of(scene.forces.begin(), scene.forces.end(), [&](const ForceDef& f) { return names(f.on) || names(f.from); }) ||
         std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) { return names(o.of); });
}

std::optional<Scene> with_more_shapes(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const BeamDef& beam = std::get<BeamDef>(scene.bodies[body].kind);
  if (beam.model == BeamModel::mixed) return as_twice_the_volumes(scene, states, body);
  if (beam.keep_modes) {
    Scene out = scene;
    BeamDef& finer = std::get<BeamDef>(out.bodies[body].kind);
    for (std::optional<int>* kept : {&finer.keep_modes, &finer.keep_axial, &finer.keep_torsion})
      if (*kept) *kept = 2 * **kept + 2;
    if (!names_nodes(scene, scene.bodies[body].name)) finer.elements *= 2;
    return out;
  }
  std::optional<Scene> out = as_elements(scene, states, body);
  if (out && beam.model == BeamModel::finite_element) std::get<BeamDef>(out->bodies[body].kind).elements *= 2;
  return out;
}

bool is_given(const BeamDef& beam) { return !beam.initial.q.empty() || !beam.initial.qd.empty(); }

bool has_elements(const BeamDef& beam) {
  return beam.model == BeamModel::finite_element || (beam.model == BeamModel::mixed && beam.modes.empty());
}

// Forms and links have no shear: they become elements.
std::optional<Scene> with_shear(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const BeamDef& beam = std::get<BeamDef>(scene.bodies[body].kind);
  if (!(beam.section.shear_y > 0.0 && beam.section.shear_z > 0.0)) return std::nullopt;
  const auto is = [&](const char* effect, bool on) {
    return std::any_of(states.begin(), states.end(),
                       [&](const EffectState& s) { return s.body == static_cast<int>(body) && s.effect == effect && s.on == on; });
  };
  if (is("shear", true) || !(is("bending_xy", true) || is("bending_xz", true))) return std::nullopt;
  if (has_elements(beam)) return with_effect(scene, states, scene.bodies[body].name, "shear", true);
  std::optional<Scene> out = beam.model == BeamModel::mixed ? as_twice_the_volumes(scene, states, body) : as_elements(scene, states, body);
  if (out) std::get<BeamDef>(out->bodies[body].kind).effects.names.emplace_back("shear");
  return out;
}

// What shear and more shapes are worth together may be more than is asked though neither is.
std::optional<Scene> with_shear_and_shapes(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const std::optional<Scene> shapes = with_more_shapes(scene, states, body);
  return with_shear(shapes ? *shapes : scene, states, body);
}

// The beam with those of these deformations that are off; with `excluded` those too that a scene in a plane has no use for. Eigenforms
// stay: their other forms are not given.
std::optional<Scene> with_deformations(const Scene& scene, const std::vector<EffectState>& states, size_t body,
                                       std::initializer_list<std::string_view> wanted, bool excluded) {
  if (std::get<BeamDef>(scene.bodies[body].kind).model == BeamModel::modal) return std::nullopt;
  std::vector<EffectState> more;
  for (const EffectState& s : states)
    if (s.body == static_cast<int>(body) && !s.on && (s.possible || excluded) &&
        std::find(wanted.begin(), wanted.end(), s.effect) != wanted.end())
      more.push_back(s);
  if (more.empty()) return std::nullopt;
  return with_effects_on(scene, states, more);
}

std::optional<Scene> with_further(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  return with_deformations(scene, states, body, {"axial", "torsion"}, false);
}

// Those of `other` up to `highest` that `own` does not have: what both have may differ by what a little more flexibility changes.
std::vector<double> further_vibrations(const VecX& own, const VecX& other, double highest) {
  constexpr double same = 0.02;
  std::vector<double> out;
  if (own.size() == 0 || other.size() == 0) return out;
  const double rest = 1e-6 * own[own.size() - 1];  // no vibration, but what differences leave of one without stiffness
  Eigen::Index i = 0;
  while (i < own.size() && own[i] <= rest) ++i;
  for (const double f : other) {
    if (f <= rest) continue;
    if (f > highest) break;
    while (i < own.size() && own[i] < (1.0 - same) * f) ++i;
    if (i < own.size() && own[i] <= (1.0 + same) * f) ++i;
    else out.push_back(f);
  }
  return out;
}

// The beams of finite elements by so many of their lowest shapes that most_directions do for all of them: modes held at their joints and
// what joints move are right for the lowest vibrations. Empty where that would be too few.
std::optional<Scene> in_few_shapes(Scene scene) {
  constexpr int held_and_stiff = 10, fewest = 3, enough = 10;  // a beam's shapes by its ends, of its axis and of twist; modes of a bending
  std::vector<BeamDef*> beams;
  for (BodyDef& body : scene.bodies)
    if (auto* beam = std::get_if<BeamDef>(&body.kind); beam && beam->model == BeamModel::finite_element && !is_given(*beam))
      beams.push_back(beam);
  if (beams.empty()) return std::nullopt;
  const int modes = (static_cast<int>(most_directions / beams.size()) - held_and_stiff) / 2;
  if (modes < fewest) return std::nullopt;
  for (BeamDef* beam : beams) {
    beam->keep_modes = std::min(modes, enough);
    beam->keep_axial = beam->keep_torsion = 2;
  }
  return scene;
}

// The model of a scene, in few shapes if it has too many directions; empty where they are too many then too, or the scene cannot be.
struct Looked {
  std::optional<System> system;
  bool few_shapes = false, too_many = false;
};

Looked model_to_look_at(const Scene& scene) {
  Looked out;
  try {
    for (const bool few : {false, true}) {
      const std::optional<Scene> looked = few ? in_few_shapes(scene) : scene;
      if (!looked) break;
      System system = make_system(*looked);
      if (independent_directions(system.model, system.work).size() > most_directions) continue;
      out.system = std::move(system);
      out.few_shapes = few;
      return out;
    }
    out.too_many = true;
  } catch (const InputError&) {  // what the richer model cannot have
  } catch (const SimulationError&) {}
  return out;
}

// The first change that finds a beam is made of the scene, those of further beams of what came out.
std::optional<RicherBeams> richer_by(const System& system, RicherBeams::By by, bool& too_many) {
  RicherBeams out;
  out.by = by;
  Scene scene = system.scene;
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if (!beam || is_given(*beam)) continue;
    const std::vector<EffectState>& states = system.model.effects;
    std::optional<Scene> changed = by == RicherBeams::By::shapes  ? with_more_shapes(scene, states, b)
                                   : by == RicherBeams::By::shear ? with_shear_and_shapes(scene, states, b)
                                                                  : with_further(scene, states, b);
    if (!changed) continue;
    scene = std::move(*changed);
    out.bodies.push_back(scene.bodies[b].name);
  }
  if (out.bodies.empty()) return std::nullopt;
  Looked looked = model_to_look_at(scene);
  too_many = too_many || (looked.too_many && by == RicherBeams::By::shapes);
  if (!looked.system) return std::nullopt;
  out.system = std::move(*looked.system);
  out.few_shapes = looked.few_shapes;
  return out;
}

std::string with_words(const RicherBeams& richer) {
  switch (richer.by) {
    case RicherBeams::By::shapes:
      return "with finer elements or more modes";
    case RicherBeams::By::shear:
      return "with shear and rotary inertia, which are off, and finer elements";
    case RicherBeams::By::further:
      break;
  }
  return "with lengthening and twist, which are off";
}

const char* advice(const RicherBeams& richer, const Scene& scene) {
  if (richer.by == RicherBeams::By::further) return "add \"axial\" or \"torsion\" to 'effects'";
  for (const BodyDef& b : scene.bodies) {
    if (b.name != richer.bodies.front()) continue;
    const BeamDef& beam = std::get<BeamDef>(b.kind);
    if (richer.by == RicherBeams::By::shear)
      return has_elements(beam) ? "add \"shear\" to 'effects'" : "take model = \"finite-element\" with the effect \"shear\"";
    if (beam.model == BeamModel::modal) return "take model = \"finite-element\", or more modes that fit the beam's ends";
    if (beam.model == BeamModel::lumped) return "take model = \"finite-element\", or more elements";
    if (beam.keep_modes) return "take a larger keep_modes or more elements";
    if (beam.model == BeamModel::mixed) return "take more volumes or elements";
  }
  return "take more elements";
}

// The output that a richer model changes most.
struct Change {
  double share = 0.0, frequency = 0.0;
  std::string column;  // empty: none
};

// Takes the k-th frequency of both responses into account: changes by more than `least` of what the richer model gives, of outputs that are
// more than `counts` of the largest of their unit there.
void compare_responses(const FrequencyResponse& own, const FrequencyResponse& other, Eigen::Index k, double least, double counts,
                       Change& worst) {
  for (size_t c = 0; c < own.columns.size(); ++c) {
    const auto same = std::find(other.columns.begin(), other.columns.end(), own.columns[c]);
    if (same == other.columns.end()) continue;
    const auto there = static_cast<Eigen::Index>(same - other.columns.begin());
    double largest = 0.0;  // of its unit
    for (size_t o = 0; o < other.units.size(); ++o)
      if (other.units[o] == own.units[c]) largest = std::max(largest, std::abs(other.values(static_cast<Eigen::Index>(o), k)));
    const double size = std::abs(other.values(there, k));
    if (size <= counts * largest) continue;
    const double off = std::abs(own.values(static_cast<Eigen::Index>(c), k) - other.values(there, k)) / size;
    if (off > std::max(least, worst.share)) worst = {off, own.frequencies[k], own.columns[c]};
  }
}

// Where else than at the lowest frequency lengthening and twist may count: beside their resonances (so near a response is some hundred
// times that at rest, and rounding no more) and here and there over the range.
VecX told_frequencies(const VecX& range, const std::vector<double>& resonances) {
  constexpr int over_range = 12;
  constexpr double beside = 1.003;
  const double lowest = range[0], highest = range[range.size() - 1];
  std::vector<double> out;
  for (int i = 1; i < over_range; ++i) out.push_back(lowest * std::pow(highest / lowest, i / static_cast<double>(over_range)));
  for (const double f : resonances) out.push_back(beside * f);
  out.push_back(lowest);
  std::sort(out.begin(), out.end());
  return Eigen::Map<const VecX>(out.data(), static_cast<Eigen::Index>(out.size()));
}

}  // namespace

void tell_of_left_vibrations(const System& system, const Linearisation& linear, double highest, Severity severity, Notes& notes) {
  const std::initializer_list<std::string_view> deformations = {"bending_xy", "bending_xz", "axial", "torsion"};
  Scene scene = system.scene;
  std::vector<std::string> bodies;
  std::set<std::string> names;
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    if (!beam || is_given(*beam)) continue;
    std::optional<Scene> changed = with_deformations(scene, system.model.effects, b, deformations, true);
    if (!changed) continue;
    scene = std::move(*changed);
    bodies.push_back(scene.bodies[b].name);
    for (const EffectState& s : system.model.effects)
      if (s.body == static_cast<int>(b) && !s.on && std::find(deformations.begin(), deformations.end(), s.effect) != deformations.end())
        names.insert(s.effect);
  }
  if (bodies.empty()) return;
  const Looked looked = model_to_look_at(scene);
  if (looked.too_many)
    notes.tell("", fmt::format("vibrations by {} are off and were not looked for: they bring more than {} degrees of freedom",
                               fmt::join(names, ", "), most_directions));
  if (!looked.system) return;
  std::vector<double> left;
  try {
    left = further_vibrations(undamped_frequencies(linear), undamped_frequencies(linearise(*looked.system)), highest);
  } catch (const SimulationError&) {
    return;
  }
  if (left.empty()) return;
  const std::string owner = fmt::format("body '{}'", fmt::join(bodies, "' and '"));
  const bool one = left.size() == 1;
  std::string what =
      fmt::format("{} vibration{} below {:.5g} Hz {} not among these, ", left.size(), one ? "" : "s", highest, one ? "is" : "are");
  what += fmt::format("the lowest at {:.5g} Hz: it takes \"{}\", which {} off; list {} in 'effects' beside what is on", left.front(),
                      fmt::join(names, "\", \""), names.size() == 1 ? "is" : "are", names.size() == 1 ? "it" : "them");
  if (severity == Severity::warning) notes.warn(owner, what);
  else notes.tell(owner, what);
}

VecX undamped_frequencies(const Linearisation& linear) {
  const MatX& M = linear.equations.M;
  if (M.rows() == 0) return {};
  const Cholesky root(M);
  if (root.info() != Eigen::Success) return {};
  const MatX half = root.solve_lower(MatX(0.5 * (linear.equations.K + linear.equations.K.transpose())));
  const MatX K = root.solve_lower(MatX(half.transpose()));
  const VecX squares = SymmetricEigen(MatX(0.5 * (K + K.transpose()))).eigenvalues();
  return squares.cwiseMax(0.0).cwiseSqrt() / (2.0 * std::numbers::pi);
}

std::vector<RicherBeams> richer_beams(const System& system, Notes& notes) {
  std::vector<RicherBeams> out;
  bool too_many = false;
  for (const RicherBeams::By by : {RicherBeams::By::shapes, RicherBeams::By::shear, RicherBeams::By::further})
    if (std::optional<RicherBeams> richer = richer_by(system, by, too_many)) out.push_back(std::move(*richer));
  if (too_many)
    notes.tell("", fmt::format("how right the frequencies are was not looked at: finer beams would have more than {} degrees of freedom",
                               most_directions));
  return out;
}

double sixth_frequency(const Linearisation& linear) {
  std::vector<double> all;
  for (const LinearMode& mode : linear.modes)
    if (mode.frequency > 0.0) all.push_back(std::abs(mode.pole) / (2.0 * std::numbers::pi));
  std::sort(all.begin(), all.end());
  return all.empty() ? 0.0 : all[std::min<size_t>(all.size(), 6) - 1];
}

void tell_of_frequencies(const System& system, const Linearisation& linear, const std::vector<RicherBeams>& richer, double asked,
                         double highest, Notes& notes) {
  const VecX own = undamped_frequencies(linear);
  if (own.size() == 0) return;
  // What the differences leave of a motion without stiffness is no vibration.
  const double rest = 1e-6 * own[own.size() - 1];
  VecX by_shapes;
  for (const RicherBeams& r : richer) {
    if (r.by == RicherBeams::By::further) continue;
    VecX other;
    try {
      other = undamped_frequencies(linearise(r.system));
    } catch (const SimulationError&) {
      continue;
    }
    if (r.by == RicherBeams::By::shapes) by_shapes = other;
    Eigen::Index first = -1, last = -1;
    for (Eigen::Index i = 0; i < std::min(own.size(), other.size()); ++i) {
      if (own[i] <= rest || std::abs(own[i] - other[i]) <= asked * other[i] || (r.few_shapes && own[i] < other[i])) continue;
      // What shapes alone change is said of them; shear is told of where it adds to that.
      const bool same = r.by == RicherBeams::By::shear && i < by_shapes.size() && std::abs(own[i] - by_shapes[i]) > asked * by_shapes[i] &&
                        std::abs(other[i] - by_shapes[i]) <= 0.3 * asked * other[i];
      if (same) continue;
      if (first < 0) first = i;
      if (own[i] <= (1.0 + 1e-6) * highest) last = i;  // it may be a mode's own
    }
    if (first < 0) continue;
    const std::string owner = fmt::format("body '{}'", fmt::join(r.bodies, "' and '"));
    if (last >= 0) {
      const std::string from = first < last ? fmt::format("frequencies from {:.5g} Hz on", own[first]) : "frequencies";
      notes.warn(owner, fmt::format("{} change by more than {:.2g} % {}, that of {:.5g} Hz to {:.5g} Hz: {}", from, 100.0 * asked,
                                    with_words(r), own[last], other[last], advice(r, system.scene)));
    } else {
      notes.tell(owner,
                 fmt::format("frequencies from {:.5g} Hz on change by more than {:.2g} % {}", own[first], 100.0 * asked, with_words(r)));
    }
  }
}

void tell_of_response(const System& system, const Linearisation& linear, const FrequencyResponse& response,
                      const std::vector<RicherBeams>& richer, double asked, Notes& notes) {
  // Away from rest what vibrates may be a per cent faster or slower, which nobody tells, and a response changes by more.
  constexpr double in_motion = 0.05, in_motion_counts = 1e-3;
  const VecX& range = response.frequencies;
  for (const RicherBeams& r : richer) {
    Change worst;
    try {
      VecX at = range.head(1);
      if (r.by == RicherBeams::By::further)
        at = told_frequencies(
            range, further_vibrations(undamped_frequencies(linear), undamped_frequencies(linearise(r.system)), range[range.size() - 1]));
      const FrequencyResponse own = frequency_response(system, response.force, at),
                              other = frequency_response(r.system, response.force, at);
      compare_responses(own, other, 0, asked, 1e-8, worst);  // differences of outputs have some nine digits
      for (Eigen::Index k = 1; k < at.size(); ++k) compare_responses(own, other, k, in_motion, in_motion_counts, worst);
    } catch (const InputError&) {  // the richer model's start is no equilibrium
      continue;
    } catch (const SimulationError&) {
      continue;
    }
    if (worst.column.empty()) continue;
    notes.warn(fmt::format("body '{}'", fmt::join(r.bodies, "' and '")),
               fmt::format("the response of {} at {:.4g} Hz changes by {:.2g} % {}: {}", worst.column, worst.frequency, 100.0 * worst.share,
                           with_words(r), advice(r, system.scene)));
  }
}

void tell_of_last_modes(const System& system, double highest, Notes& notes) {
  for (size_t b = 0; b < system.scene.bodies.size(); ++b) {
    if (!std::holds_alternative<ModalDef>(system.scene.bodies[b].kind)) continue;
    const FlexibleBody& body = system.model.parts[static_cast<size_t>(system.model.pieces[b].front())].body;
    if (body.n == 0) continue;
    Linearisation own;
    own.equations.M = body.Me;
    own.equations.K = body.Ke;
    const VecX hertz = undamped_frequencies(own);
    if (hertz.size() == 0 || highest <= hertz[hertz.size() - 1]) continue;
    notes.warn(fmt::format("body '{}'", system.scene.bodies[b].name),
               fmt::format("its file has no modes above {:.4g} Hz: the response beyond is without them; reduce the model with more modes",
                           hertz[hertz.size() - 1]));
  }
}

}  // namespace flexframe::sim
