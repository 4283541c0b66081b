#include "sim/run/frequency_check.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/error.h"
#include "sim/dynamics/directions.h"
#include "sim/run/effect_report.h"
#include "sim/run/few_modes.h"
#include "sim/run/richer_beams.h"
#include "sim/run/run_scene.h"
#include "sim/start/make_system.h"
#include "sim/start/statics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <initializer_list>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>

namespace flexframe::sim {
namespace {

// A linearisation takes some forty evaluations a direction and the third power of their number.
constexpr size_t most_directions = 200;

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
  std::optional<Scene> out = with_elements(scene, states, body);
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
  std::optional<Scene> out =
      beam.model == BeamModel::mixed ? as_twice_the_volumes(scene, states, body) : with_elements(scene, states, body);
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

// Stiffening is off though axial forces may count.
std::optional<Scene> with_stiffening(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  std::vector<EffectState> more;
  for (const EffectState& s : states)
    if (s.body == static_cast<int>(body) && !s.on && s.possible && s.effect == "stiffening") more.push_back(s);
  if (more.empty()) return std::nullopt;
  return with_effects_on(scene, states, more);
}

// What a static start bends in its own frame.
std::optional<Scene> with_large_bending(const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  const std::string& name = scene.bodies[body].name;
  const bool off = std::any_of(states.begin(), states.end(),
                               [&](const EffectState& s) { return s.owner == name && s.effect == "large_bending" && s.possible && !s.on; });
  if (!off || !wants_statics(scene)) return std::nullopt;
  return with_effect(scene, states, name, "large_bending", true);
}

std::optional<Scene> richer_beam(RicherBeams::By by, const Scene& scene, const std::vector<EffectState>& states, size_t body) {
  switch (by) {
    case RicherBeams::By::shapes:
      return with_more_shapes(scene, states, body);
    case RicherBeams::By::shear:
      return with_shear_and_shapes(scene, states, body);
    case RicherBeams::By::stiffening:
      return with_stiffening(scene, states, body);
    case RicherBeams::By::bending:
      return with_large_bending(scene, states, body);
    case RicherBeams::By::further:
    case RicherBeams::By::of_files:
      break;
  }
  return with_further(scene, states, body);
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
    std::optional<Scene> changed = richer_beam(by, scene, states, b);
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

// Bodies of files with all that their files say beyond their coordinates.
std::optional<RicherBeams> richer_by_files(const System& system, bool& too_many) {
  const FurtherOfBodies further = further_of_files(system.scene, system.model);
  if (further.empty()) return std::nullopt;
  RicherBeams out;
  out.by = RicherBeams::By::of_files;
  for (const auto& [name, shapes] : further) out.bodies.push_back(name);
  try {
    out.system = make_system(system.scene, {}, further);
  } catch (const InputError&) {
    return std::nullopt;
  } catch (const SimulationError&) {
    return std::nullopt;
  }
  if (independent_directions(out.system.model, out.system.work).size() <= most_directions) return out;
  too_many = true;
  return std::nullopt;
}

std::string with_words(const RicherBeams& richer) {
  switch (richer.by) {
    case RicherBeams::By::shapes:
      return "with finer elements or more modes";
    case RicherBeams::By::shear:
      return "with shear and rotary inertia, which are off, and finer elements";
    case RicherBeams::By::stiffening:
      return "with what axial forces do to bending, which is off";
    case RicherBeams::By::bending:
      return "with large_bending, which is off";
    case RicherBeams::By::of_files:
      return "with further shapes of its finite element model, which its file keeps to measure this";
    case RicherBeams::By::further:
      break;
  }
  return "with lengthening and twist, which are off";
}

const char* advice(const RicherBeams& richer, const Scene& scene) {
  if (richer.by == RicherBeams::By::further) return "add \"axial\" or \"torsion\" to 'effects'";
  if (richer.by == RicherBeams::By::of_files) return "reduce the model with more modes";
  if (richer.by == RicherBeams::By::stiffening) return "add \"stiffening\" to 'effects'";
  if (richer.by == RicherBeams::By::bending) return "add \"large_bending\" to 'effects'";
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

// Frequencies at which responses are compared, and those of the richer model about each.
struct Compared {
  static constexpr Eigen::Index beside = 3, middle = 1, over_range = 17;  // the first ones over the range, the lowest first
  std::vector<double> own, other;

  void add(double at, double below, double above) {
    own.push_back(at);
    for (const double f : {at * below, at, at * above}) other.push_back(f);
  }
};

// Over the range, where the richer model may be faster or slower by `shift`, which is told of the frequencies; and beside resonances that
// it has alone (so near a response is some hundred times that at rest), on one side of them, where neither sign is passed.
Compared compared_frequencies(const VecX& range, const std::vector<double>& resonances, double shift) {
  const double lowest = range[0], highest = range[range.size() - 1];
  Compared out;
  for (int i = 0; i < Compared::over_range; ++i)
    out.add(lowest * std::pow(highest / lowest, i / (Compared::over_range - 1.0)), 1.0 - shift, 1.0 + shift);
  for (const double f : resonances) out.add(1.006 * f, 1.003 / 1.006, 1.01 / 1.006);
  return out;
}

// The largest response of its unit in column k, places and turns and their rates counted as one: what is nought by symmetry is nought
// beside the others, though nothing else may turn.
double largest_of_unit(const FrequencyResponse& r, Eigen::Index k, const std::string& unit, double size) {
  const double w = 2.0 * std::numbers::pi * r.frequencies[k];
  const std::map<std::string_view, double> metres = {{"m", 1.0},    {"m/s", 1.0 / w},    {"m/s^2", 1.0 / (w * w)},
                                                     {"rad", size}, {"rad/s", size / w}, {"rad/s^2", size / (w * w)}};
  constexpr double aside = 100.0;  // of another unit: what moves a millionth as far is no curve
  const auto wanted = metres.find(unit);
  double largest = 0.0;
  for (size_t o = 0; o < r.units.size(); ++o) {
    const double value = std::abs(r.values(static_cast<Eigen::Index>(o), k));
    const auto has = metres.find(r.units[o]);
    if (r.units[o] == unit) largest = std::max(largest, value);
    else if (wanted != metres.end() && has != metres.end()) largest = std::max(largest, aside * value * has->second / wanted->second);
  }
  return largest;
}

// Takes the lowest frequency of both responses into account: changes by more than `least` of what the richer model gives.
void compare_lowest(const FrequencyResponse& own, const FrequencyResponse& other, double length, double least, Change& worst) {
  constexpr double counts = 1e-8;  // of the largest of its unit: differences of outputs have some nine digits
  constexpr Eigen::Index at = Compared::middle;
  for (size_t c = 0; c < own.columns.size(); ++c) {
    const auto same = std::find(other.columns.begin(), other.columns.end(), own.columns[c]);
    if (same == other.columns.end()) continue;
    const auto there = static_cast<Eigen::Index>(same - other.columns.begin());
    const double largest = largest_of_unit(other, at, own.units[c], length);
    const double size = std::abs(other.values(there, at));
    if (size <= counts * largest) continue;
    const double off = std::abs(own.values(static_cast<Eigen::Index>(c), 0) - other.values(there, at)) / size;
    if (off > std::max(least, worst.share)) worst = {off, own.frequencies[0], own.columns[c]};
  }
}

double distance(std::complex<double> point, std::complex<double> from, std::complex<double> to) {
  const std::complex<double> way = to - from;
  const double length = std::norm(way), along = length > 0.0 ? ((point - from) * std::conj(way)).real() / length : 0.0;
  return std::abs(point - from - std::clamp(along, 0.0, 1.0) * way);
}

std::string output_of(const std::string& column) { return column.substr(0, column.find('.')); }

// The largest amplitude of the columns of one output, at frequency k.
double largest_of_output(const FrequencyResponse& response, const std::string& output, Eigen::Index k) {
  double out = 0.0;
  for (size_t c = 0; c < response.columns.size(); ++c)
    if (output_of(response.columns[c]) == output) out = std::max(out, std::abs(response.values(static_cast<Eigen::Index>(c), k)));
  return out;
}

// Changes by more than `least` at any of these frequencies, of what the richer model has nowhere about it, relative to its size there: at
// least a share of the whole vector and of what the output has at the frequencies beside it, where it passes through zero. Beside a
// resonance of either model three frequencies are no curve; how right it is its frequency tells.
void compare_over_range(const FrequencyResponse& own, const FrequencyResponse& other, double length, double least, Change& worst) {
  constexpr double of_vector = 0.02, of_neighbours = 0.3, rounding = 1e-8;
  constexpr Eigen::Index per = Compared::beside;
  const Eigen::Index count = own.frequencies.size();
  constexpr double beside = 0.025;
  const auto resonates = [&](double f) {
    const auto near = [&](double mode) { return std::abs(f - mode) < beside * mode; };
    return std::any_of(own.modes.begin(), own.modes.end(), near) || std::any_of(other.modes.begin(), other.modes.end(), near);
  };
  for (size_t c = 0; c < own.columns.size(); ++c) {
    const auto same = std::find(other.columns.begin(), other.columns.end(), own.columns[c]);
    if (same == other.columns.end()) continue;
    const auto there = static_cast<Eigen::Index>(same - other.columns.begin());
    const auto size_at = [&](Eigen::Index k) { return other.values.row(there).segment(per * k, per).cwiseAbs().maxCoeff(); };
    for (Eigen::Index k = 0; k < count; ++k) {
      if (k < Compared::over_range && resonates(own.frequencies[k])) continue;
      const double of_unit = largest_of_unit(other, per * k + Compared::middle, own.units[c], length);
      const double vector = largest_of_output(other, output_of(own.columns[c]), per * k + Compared::middle);
      const double before = size_at(std::max<Eigen::Index>(k - 1, 0)), after = size_at(std::min(k + 1, count - 1));
      const double size = std::max({size_at(k), of_vector * vector, of_neighbours * std::sqrt(before * after)});
      if (size <= rounding * of_unit) continue;
      const std::complex<double> mine = own.values(static_cast<Eigen::Index>(c), k);
      const auto theirs = other.values.row(there).segment(per * k, per);
      const double off = std::min(distance(mine, theirs[0], theirs[1]), distance(mine, theirs[1], theirs[2])) / size;
      if (off > std::max(least, worst.share)) worst = {off, own.frequencies[k], own.columns[c]};
    }
  }
}

VecX as_vector(const std::vector<double>& values) {
  return Eigen::Map<const VecX>(values.data(), static_cast<Eigen::Index>(values.size()));
}

// What the vibrations of both models have at their resonances, each at its own: amplitudes there follow from damping and from how near the
// next vibration is. What is undamped has none.
void compare_resonances(const System& system, const System& richer, const FrequencyResponse& here, const FrequencyResponse& there,
                        const VecX& range, double least, Change& worst) {
  constexpr double same = 0.03, of_vector = 0.1, damped = 1e-6;
  std::vector<double> own_at, other_at;
  for (size_t i = 0; i < std::min(here.modes.size(), there.modes.size()); ++i) {
    const double f = here.modes[i], g = there.modes[i];
    if (f < range[0] || f > range[range.size() - 1] || std::abs(f - g) > same * g) continue;
    if (here.damping[i] <= damped || there.damping[i] <= damped) continue;
    own_at.push_back(f), other_at.push_back(g);
  }
  if (own_at.empty()) return;
  const FrequencyResponse own = frequency_response(system, here.force, as_vector(own_at)),
                          other = frequency_response(richer, here.force, as_vector(other_at));
  for (size_t c = 0; c < own.columns.size(); ++c) {
    const auto found = std::find(other.columns.begin(), other.columns.end(), own.columns[c]);
    if (found == other.columns.end()) continue;
    const auto row = static_cast<Eigen::Index>(found - other.columns.begin());
    for (Eigen::Index k = 0; k < own.frequencies.size(); ++k) {
      const double vector = largest_of_output(other, output_of(own.columns[c]), k);
      const double size = std::max(std::abs(other.values(row, k)), of_vector * vector);
      const double off = std::abs(std::abs(own.values(static_cast<Eigen::Index>(c), k)) - std::abs(other.values(row, k))) / size;
      if (off > std::max(least, worst.share)) worst = {off, own.frequencies[k], own.columns[c]};
    }
  }
}

// Undamped frequencies, Hz, ascending, 0 for what moves freely or is unstable, and the part of each one's stiffness that is the bodies'
// own; that of loads, springs and joints is the rest.
struct Undamped {
  VecX hertz, elastic;
};

Undamped undamped(const System& system, const Linearisation& linear) {
  Undamped out;
  const MatX& M = linear.equations.M;
  if (M.rows() == 0) return out;
  const MatX K = 0.5 * (linear.equations.K + linear.equations.K.transpose());
  const GeneralizedEigen modes(K, M);
  if (modes.info() != Eigen::Success) return out;
  out.hertz = modes.eigenvalues().cwiseMax(0.0).cwiseSqrt() / (2.0 * std::numbers::pi);
  out.elastic = VecX::Ones(out.hertz.size());
  if (!system.model.flexures.empty()) return out;  // their stiffness is in their joints
  VecX energy = VecX::Zero(out.hertz.size());
  for (const Part& part : system.model.parts) {
    if (part.body.n == 0) continue;
    const MatX shapes = linear.rates.middleRows(part.ev0, part.body.n) * modes.eigenvectors();
    energy += shapes.cwiseProduct(part.body.Ke * shapes).colwise().sum();
  }
  for (Eigen::Index i = 0; i < energy.size(); ++i)
    out.elastic[i] = modes.eigenvalues()[i] > 0.0 ? std::min(1.0, energy[i] / modes.eigenvalues()[i]) : 0.0;
  return out;
}

// A start that is no equilibrium is left at once, and so is what its loads make of a stiffness: a beam that may lengthen does not yet pull
// there, where one that may not does. What is no more than that has no frequency to compare.
void leave_out_loads(const Linearisation& linear, double asked, Undamped& own) {
  if (linear.equilibrium) return;
  own.hertz = (own.elastic.array() < asked).select(0.0, own.hertz);
}

// Of ascending values those next to each of `own`; one value or more.
VecX nearest(const VecX& own, const VecX& values) {
  VecX out(own.size());
  Eigen::Index at = 0;
  for (Eigen::Index i = 0; i < own.size(); ++i) {
    while (at + 1 < values.size() && std::abs(values[at + 1] - own[i]) <= std::abs(values[at] - own[i])) ++at;
    out[i] = values[at];
  }
  return out;
}

// Of a richer model about its own equilibrium where `own` is about one: what more gives way, as a blade that lengthens as it turns, is not
// held where the assembly leaves it. Beside an unstable one there is none to look for.
Linearisation about_equilibrium(const Linearisation& own, const System& richer) {
  Linearisation out = linearise(richer);
  const bool unstable = !own.modes.empty() && own.modes.front().kind == LinearMode::unstable;
  if (unstable || !own.equilibrium || out.equilibrium || richer.scene.simulation.static_start) return out;
  Scene scene = richer.scene;
  scene.simulation.static_start = true;
  return linearise(make_system(scene));
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
    const Linearisation further = about_equilibrium(linear, *looked.system);
    Undamped other = undamped(*looked.system, further);
    leave_out_loads(further, unasked_accuracy, other);
    left = further_vibrations(undamped_frequencies(linear), other.hertz, highest);
  } catch (const InputError&) {
    return;
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
  for (const RicherBeams::By by :
       {RicherBeams::By::shapes, RicherBeams::By::shear, RicherBeams::By::stiffening, RicherBeams::By::bending, RicherBeams::By::further})
    if (std::optional<RicherBeams> richer = richer_by(system, by, too_many)) out.push_back(std::move(*richer));
  if (std::optional<RicherBeams> richer = richer_by_files(system, too_many)) out.push_back(std::move(*richer));
  if (too_many)
    notes.tell("", fmt::format("how right the frequencies are was not looked at: finer bodies would have more than {} degrees of freedom",
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
  Undamped compared = undamped(system, linear);
  leave_out_loads(linear, asked, compared);
  const VecX& own = compared.hertz;
  if (own.size() == 0) return;
  // What the differences leave of a motion without stiffness is no vibration.
  const double rest = 1e-6 * own[own.size() - 1];
  VecX by_shapes;
  for (const RicherBeams& r : richer) {
    // A beam that can lengthen gives way where others push along it, and bears another share of what presses it at its equilibrium.
    const bool further = r.by == RicherBeams::By::further;
    VecX other;
    try {
      // What files say beyond their coordinates moves no equilibrium.
      const bool files = r.by == RicherBeams::By::of_files;
      other = undamped_frequencies(files ? linearise(r.system) : about_equilibrium(linear, r.system));
    } catch (const InputError&) {  // it has no equilibrium
      continue;
    } catch (const SimulationError&) {
      continue;
    }
    if (r.by == RicherBeams::By::shapes) by_shapes = other;
    // What lengthens has vibrations between the others.
    if (further) other = nearest(own, other);
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
  constexpr double in_motion = 2.5;  // times what is asked: frequencies beyond it are told of by themselves
  const VecX& range = response.frequencies;
  for (const RicherBeams& r : richer) {
    Change worst;
    try {
      std::vector<double> resonances;
      if (r.by == RicherBeams::By::further)
        resonances = further_vibrations(undamped_frequencies(linear), undamped_frequencies(linearise(r.system)), range[range.size() - 1]);
      const Compared at = compared_frequencies(range, resonances, asked);
      const FrequencyResponse own = frequency_response(system, response.force, as_vector(at.own)),
                              other = frequency_response(r.system, response.force, as_vector(at.other));
      compare_lowest(own, other, system.model.size, asked, worst);
      compare_over_range(own, other, system.model.size, in_motion * asked, worst);
      compare_resonances(system, r.system, own, other, range, in_motion * asked, worst);
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
