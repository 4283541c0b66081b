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
#include <numbers>
#include <optional>

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

// Lengthening and twist where they could be but are off.
std::optional<Scene> with_further(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  std::optional<Scene> out;
  if (std::get<BeamDef>(scene.bodies[body].kind).model == BeamModel::modal) return out;  // its forms along the axis are not given
  for (const EffectState& s : states)
    if (s.body == static_cast<int>(body) && !s.on && s.possible && (s.effect == "axial" || s.effect == "torsion"))
      out = with_effect(out ? *out : scene, states, s.owner, s.effect, true);
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
  try {
    out.system = make_system(scene);
  } catch (const InputError&) {  // what the richer model cannot have
    return std::nullopt;
  } catch (const SimulationError&) {
    return std::nullopt;
  }
  if (independent_directions(out.system.model, out.system.work).size() <= most_directions) return out;
  too_many = too_many || by == RicherBeams::By::shapes;
  return std::nullopt;
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

}  // namespace

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
    if (mode.frequency > 0.0) all.push_back(mode.frequency);
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
      if (own[i] <= rest || std::abs(own[i] - other[i]) <= asked * other[i]) continue;
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

void tell_of_response(const System& system, const std::string& force, const FrequencyResponse& response,
                      const std::vector<RicherBeams>& richer, double asked, Notes& notes) {
  const double lowest = response.frequencies[0];
  const VecX at = VecX::Constant(1, lowest);
  for (const RicherBeams& r : richer) {
    FrequencyResponse other;
    try {
      other = frequency_response(r.system, force, at);
    } catch (const InputError&) {  // the richer model's start is no equilibrium
      continue;
    } catch (const SimulationError&) {
      continue;
    }
    double worst = asked;
    std::string column;
    for (size_t c = 0; c < response.columns.size(); ++c) {
      const auto same = std::find(other.columns.begin(), other.columns.end(), response.columns[c]);
      if (same == other.columns.end()) continue;
      const auto there = static_cast<Eigen::Index>(same - other.columns.begin());
      double largest = 0.0;  // of its unit
      for (size_t k = 0; k < other.units.size(); ++k)
        if (other.units[k] == response.units[c]) largest = std::max(largest, std::abs(other.values(static_cast<Eigen::Index>(k), 0)));
      // Differences of outputs have some nine digits.
      const double size = std::abs(other.values(there, 0));
      if (size <= 1e-8 * largest) continue;
      const double off = std::abs(response.values(static_cast<Eigen::Index>(c), 0) - other.values(there, 0)) / size;
      if (off > worst) worst = off, column = response.columns[c];
    }
    if (column.empty()) continue;
    notes.warn(fmt::format("body '{}'", fmt::join(r.bodies, "' and '")),
               fmt::format("the response of {} at {:.4g} Hz changes by {:.2g} % {}: {}", column, lowest, 100.0 * worst, with_words(r),
                           advice(r, system.scene)));
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
