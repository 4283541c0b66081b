#include "sim/run/effect_report.h"

#include "sim/run/left_out.h"
#include "sim/run/run_scene.h"
#include "sim/run/second_run.h"

#include "sim/scene/effect_names.h"
#include "sim/start/make_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <set>
#include <stdexcept>

namespace flexframe::sim {
namespace {

void drop(std::vector<std::string>& list, const std::string& name) { list.erase(std::remove(list.begin(), list.end(), name), list.end()); }

void switch_beam(BeamDef& beam, const std::vector<EffectState>& states, const std::string& owner, const std::string& effect, bool on) {
  EffectChoice& choice = beam.effects;
  drop(choice.without, effect);
  if (effect == "gyroscopic" || effect == "damping") {
    if (!on) choice.without.push_back(effect);
    return;
  }
  std::vector<std::string> names;
  for (const EffectState& s : states)
    if (s.owner == owner && s.on && s.effect != effect &&
        std::find(beam_effect_names().begin(), beam_effect_names().end(), s.effect) != beam_effect_names().end())
      names.push_back(s.effect);
  if (on) names.push_back(effect);
  choice.automatic = false;
  choice.names = names;
  if (beam.modes.empty() || effect == "stiffening" || effect == "shear" || effect == "large_bending") return;
  // Modes that are listed decide: the direction's first one, or none of it.
  if (on) beam.modes.try_emplace(effect, std::vector<int>{1});
  else beam.modes.erase(effect);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return n == 0 ? 0.0 : n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

// Of forces, moments and stresses that stand still, so that `ranges` has none: the largest component of the vector, if it is no rounding of
// the other forces.
VecX sizes_of_still_forces(const Histories& h, const VecX& ranges) {
  constexpr double rounding = 1e-9;
  VecX out = VecX::Zero(ranges.size());
  if (h.values.cols() == 0) return out;
  const auto largest = [&](const auto& of) {
    double most = 0.0;
    for (Eigen::Index k = 0; k < out.size(); ++k)
      if (of(k)) most = std::max(most, h.values.row(k).cwiseAbs().maxCoeff());
    return most;
  };
  const auto vector_of = [&](Eigen::Index k) { return h.columns[k].substr(0, h.columns[k].rfind('.')); };
  const double force = std::max(h.scales.force, largest([&](Eigen::Index k) { return h.units[k] == "N"; })),
               reach = h.scales.length > 0.0 ? h.scales.length : 1.0;
  for (Eigen::Index c = 0; c < out.size(); ++c) {
    const std::string& unit = h.units[c];
    if (ranges[c] > 0.0 || (unit != "N" && unit != "N m" && unit != "Pa")) continue;
    const double size = largest([&](Eigen::Index k) { return h.units[k] == unit && vector_of(k) == vector_of(c); });
    if (size > rounding * (unit == "N" ? force : unit == "N m" ? force * reach : 0.0)) out[c] = size;
  }
  return out;
}

}  // namespace

VecX common_ranges(const Histories& a, const Histories& b, double deflection, double turn) {
  VecX out = output_ranges(a, b).cwiseMax(output_ranges(b, a));
  for (Eigen::Index c = 0; c < out.size(); ++c)
    if (out[c] == 0.0 && (a.units[c] == "m" || a.units[c] == "rad")) out[c] = a.units[c] == "m" ? deflection : turn;
  return out.cwiseMax(sizes_of_still_forces(a, out)).cwiseMax(sizes_of_still_forces(b, out));
}

Scene with_effect(const Scene& scene, const std::vector<EffectState>& states, const std::string& owner, const std::string& effect,
                  bool on) {
  Scene out = scene;
  if (owner == whole_scene && effect == "gravity") {
    if (!on) out.simulation.gravity.setZero();
    return out;
  }
  for (JointDef& j : out.joints) {
    if (owner != fmt::format("joint '{}'", j.name)) continue;
    if (!on && effect == "friction") j.friction.reset();
    if (!on && effect == "stops") j.stop.reset();
    return out;
  }
  for (BodyDef& b : out.bodies) {
    if (b.name != owner) continue;
    if (auto* beam = std::get_if<BeamDef>(&b.kind)) {
      switch_beam(*beam, states, owner, effect, on);
      return out;
    }
    if (auto* modal = std::get_if<ModalDef>(&b.kind)) {
      drop(modal->effects.without, effect);
      if (!on) modal->effects.without.push_back(effect);
      return out;
    }
  }
  throw ArgumentError(fmt::format("'{}' cannot have the effect {}", owner, effect));
}

Scene with_effects_on(const Scene& scene, std::vector<EffectState> states, const std::vector<EffectState>& more) {
  Scene out = scene;
  for (const EffectState& wanted : more) {
    out = with_effect(out, states, wanted.owner, wanted.effect, true);
    for (EffectState& s : states)
      if (s.owner == wanted.owner && s.effect == wanted.effect) s.on = true;
  }
  return out;
}

std::vector<EffectState> effect_states(const Scene& scene, const Model& model) {
  std::vector<EffectState> out = model.effects;
  const auto add = [&](const std::string& owner, const char* effect, bool on, const char* why) {
    EffectState s;
    s.owner = owner;
    s.effect = effect;
    s.on = s.possible = on;
    s.by = "scene";
    s.why = why;
    out.push_back(s);
  };
  for (const JointDef& j : scene.joints) {
    if (j.friction) add(fmt::format("joint '{}'", j.name), "friction", true, "the scene gives it");
    if (j.stop) add(fmt::format("joint '{}'", j.name), "stops", true, "the scene gives them");
  }
  const bool heavy = !scene.simulation.gravity.isZero(0.0);
  add(whole_scene, "gravity", heavy, heavy ? "the scene gives it" : "the scene gives none");
  return out;
}

namespace {

// The largest deflection of a body along a run, m, and the largest turn of a section, rad, as they are shown.
struct Deformed {
  double deflection = 0.0, turn = 0.0;
};
Deformed deformed_by(const Scene& scene, SimulateOptions options) {
  options.estimate_error = options.check_effects = false;
  Deformed out;
  for (const ResultBody& body : run_scene(scene, options).bodies) {
    if (body.displacement.size() > 0) out.deflection = std::max(out.deflection, body.displacement.cwiseAbs().maxCoeff());
    if (body.rotation.size() > 0) out.turn = std::max(out.turn, body.rotation.cwiseAbs().maxCoeff());
  }
  return out;
}

// common_ranges of two runs, of the scene and of another one. here: what the scene deforms by, found where it is asked for first.
VecX ranges_of_pair(const Histories& changed, const Histories& base, const Scene& other, const Scene& scene, const SimulateOptions& options,
                    std::optional<Deformed>& here) {
  const VecX moving = common_ranges(changed, base, 0.0);
  bool still = false;
  for (Eigen::Index c = 0; c < moving.size(); ++c) still = still || (moving[c] == 0.0 && (base.units[c] == "m" || base.units[c] == "rad"));
  if (!still) return moving;
  if (!here) here = deformed_by(scene, options);
  const Deformed there = &other == &scene ? *here : deformed_by(other, options);
  return common_ranges(changed, base, std::max(here->deflection, there.deflection), std::max(here->turn, there.turn));
}

}  // namespace

namespace {

// Pairs of runs, of the scene as it stands and of others, at one tolerance and at tenths of it.
class Pairs {
 public:
  // options: of the loosest pair.
  Pairs(const Scene& scene, const SimulateOptions& options) : scene_(scene), options_(options) {}

  SimulateOptions options(size_t decade) const {
    SimulateOptions out = options_;
    out.tolerance = *options_.tolerance * std::pow(0.1, static_cast<double>(decade));
    return out;
  }
  // Of the scene as it stands.
  const Histories& base(size_t decade) {
    while (bases_.size() <= decade) bases_.push_back(simulate_histories(scene_, options(bases_.size())));
    return bases_[decade];
  }
  // By what a tenth of its tolerance changes that run, of the outputs' ranges.
  double base_error(size_t decade) {
    base(decade + 1);
    return compare_histories(base(decade), base(decade + 1), ranges(base(decade + 1), base(decade), scene_)).largest;
  }
  VecX ranges(const Histories& changed, const Histories& here, const Scene& other) {
    return ranges_of_pair(changed, here, other, scene_, options_, deformed_);
  }

 private:
  const Scene& scene_;
  SimulateOptions options_;
  std::deque<Histories> bases_;  // references to its elements stay
  std::optional<Deformed> deformed_;
};

// What the other scene's run differs by from the scene's. Where a tenth of the tolerance changes the other run by a good part of that, the
// pair is made again at that tolerance: one run that steps over vibrations may be a third off where the other is not (a bracket in space at
// 1e-5: shear told as 0.39 of a range, where 7e-4 is true).
void measure_share(Pairs& pairs, const Scene& other, Histories changed, double floor, EffectRow& row) {
  // So many times the error of the scene's own run the other one is not off.
  constexpr double its_own = 0.3, plain = 30.0;
  constexpr size_t tightest = 3;  // decades below the first
  row.floor = floor;
  for (size_t decade = 0;; ++decade) {
    const Histories& base = pairs.base(decade);
    const VecX ranges = pairs.ranges(changed, base, other);
    const Difference d = compare_histories(changed, base, ranges);
    row.measured = !ranges.isZero(0.0);
    row.share = d.largest;
    row.column = d.column >= 0 ? base.columns[d.column] : "";
    row.shares = d.columns;
    if (!row.measured) row.note = "no output moves, and no body deforms: there is nothing to measure it against";
    if (!row.measured || decade == tightest || !std::isfinite(row.share)) return;
    if (decade == 0 && (row.share <= floor || row.share > plain * floor)) return;
    Histories tighter = simulate_histories(other, pairs.options(decade + 1));
    const double own = compare_histories(changed, tighter, pairs.ranges(tighter, changed, other)).largest;
    if (own <= its_own * row.share) return;
    // What is left of the error after a decade is less than that decade changed.
    row.floor = std::max(pairs.base_error(decade), own);
    changed = std::move(tighter);
  }
}

}  // namespace

EffectReport report_effects(const Scene& as_given, const EffectOptions& options) {
  const Scene scene = with_called_effects(as_given, {}, unasked_accuracy);
  const System system = make_system(scene);
  EffectReport out;
  const double scene_tolerance =
      scene.simulation.tolerance.value_or(scene.simulation.accuracy ? 0.1 * *scene.simulation.accuracy : default_tolerance);
  SimulateOptions pair;
  pair.tolerance = options.tolerance > 0.0 ? options.tolerance : std::min(10.0 * scene_tolerance, 1e-2);
  pair.samples = 400;
  out.tolerance = *pair.tolerance;
  const std::vector<EffectState> states = effect_states(scene, system.model);

  size_t measurable = 0, done = 0;
  for (const EffectState& s : states) measurable += s.possible;
  const auto advance = [&] {
    ++done;
    if (options.progress) options.progress(static_cast<double>(done) / static_cast<double>(measurable + 2));
  };

  Pairs pairs(scene, pair);
  const Histories& base = pairs.base(0);
  out.columns = base.columns;
  out.cpu = base.statistics.cpu_seconds;
  advance();
  out.floor = pairs.base_error(0);
  advance();

  for (const EffectState& s : states) {
    EffectRow row;
    row.state = s;
    row.shares = VecX::Zero(base.values.rows());
    row.floor = out.floor;
    if (!s.possible) {
      out.rows.push_back(row);
      continue;
    }
    const Scene other = with_effect(scene, states, s.owner, s.effect, !s.on);
    std::vector<double> cpu_here{base.statistics.cpu_seconds}, cpu_other;
    try {
      Histories changed = simulate_histories(other, pair);
      cpu_other.push_back(changed.statistics.cpu_seconds);
      if (changed.columns == base.columns) measure_share(pairs, other, std::move(changed), out.floor, row);
      else row.note = "it changes the number of output columns";
      for (int r = 1; r < options.repeats && cpu_here[0] + cpu_other[0] < 0.5; ++r) {
        cpu_here.push_back(simulate_histories(scene, pair).statistics.cpu_seconds);
        cpu_other.push_back(simulate_histories(other, pair).statistics.cpu_seconds);
      }
    } catch (const std::runtime_error& error) {
      // A run that fails with the effect toggled says as much as a number.
      row.note = fmt::format("{} it the run fails: {}", s.on ? "without" : "with", error.what());
    }
    row.cpu_on = median(s.on ? cpu_here : cpu_other);
    row.cpu_off = median(s.on ? cpu_other : cpu_here);
    out.rows.push_back(row);
    advance();
  }
  return out;
}

std::vector<Untried> neglected(const std::vector<EffectState>& states, const NeglectOptions& options) {
  std::vector<Untried> out;
  for (const char* effect : {"stiffening", "gyroscopic", "bending_xy", "bending_xz", "torsion", "axial", "shear"}) {
    const bool second_order = is_of_second_order(effect);
    const bool wanted = std::find(options.further.begin(), options.further.end(), effect) != options.further.end();
    if (!(second_order ? options.second_order : options.deformations) && !wanted) continue;
    Untried u;
    u.effect = effect;
    for (const EffectState& s : states)
      if (s.effect == effect && !s.on && s.possible) u.owners.push_back(s.owner);
    if (!u.owners.empty()) out.push_back(std::move(u));
  }
  return out;
}

namespace {

// The run with an effect by the method of the run without it where that follows vibrations, else by that of the options: of two methods
// each loses something else. (Slider-crank followed at 9e-4 beside one that stretches, stepped over by dirk: 0.62 apart, where 1e-4 is
// true.) options: by which it was made.
std::optional<Histories> run_with_effect(const Scene& other, const std::string& method, SimulateOptions& options, double budget,
                                         double& spent) {
  if (!options.method && method == method_name(Method::exponential)) {
    SimulateOptions same = options;
    same.method = Method::exponential;
    try {
      std::optional<Histories> out = simulated_within(other, same, budget, spent);
      options = same;
      return out;
    } catch (const std::runtime_error&) {
      // With the effect the method is not for it.
    }
  }
  return simulated_within(other, options, budget, spent);
}

// The share again at the run's own tolerance; as it was where that takes too long. Where the run with the effect is off by as much itself,
// which a decade changes in it, at tighter ones: beams that stretch ask for more than those that bend. (Slider-crank at 9e-5, 1e-3 off:
// with stretching, worth 1e-4, 3e-2 off.) loose: the run with the effect at options.tolerance.
void confirm(const Scene& other, const NeglectOptions& options, SimulateOptions pair, const Histories& loose, Neglected& n, double& spent) {
  constexpr double tightest = 1e-3, mostly_its_own = 0.5;
  Histories last = loose;
  double taken = 0.0;
  for (double tolerance = options.run_tolerance; tolerance > 0.5 * tightest * options.run_tolerance; tolerance *= 0.1) {
    pair.tolerance = tolerance;
    const double before = taken;
    const std::optional<Histories> tight = simulated_within(other, pair, options.budget - taken, taken);
    spent += taken - before;
    if (!tight || tight->columns != options.run->columns) return;
    const VecX ranges = common_ranges(*tight, *options.run, options.deflection);
    const Difference sure = compare_histories(*tight, *options.run, ranges);
    n.share = sure.largest;
    n.column = sure.column >= 0 ? options.run->columns[sure.column] : "";
    n.resolved = n.share > 3.0 * options.run_error;
    if (n.share <= options.confirm_above || compare_histories(last, *tight, ranges).largest < mostly_its_own * n.share) return;
    last = *tight;
  }
}

}  // namespace

NeglectCheck check_neglected(const Scene& scene, const std::vector<EffectState>& states, const Histories& base,
                             const NeglectOptions& options) {
  NeglectCheck out;
  SimulateOptions as_base;
  as_base.tolerance = options.tolerance;
  as_base.method = options.method;
  as_base.samples = static_cast<int>(base.times.size());
  double longest = base.statistics.work;
  for (const Untried& candidate : neglected(states, options)) {
    Neglected n;
    n.effect = candidate.effect;
    n.owners = candidate.owners;
    if (out.cpu + longest > options.budget) {
      out.untried.push_back(candidate);
      continue;
    }
    std::vector<EffectState> more;
    std::copy_if(states.begin(), states.end(), std::back_inserter(more),
                 [&](const EffectState& s) { return s.effect == n.effect && !s.on && s.possible; });
    const Scene other = with_effects_on(scene, states, more);
    try {
      SimulateOptions pair = as_base;
      const std::optional<Histories> changed = run_with_effect(other, base.statistics.method, pair, options.budget - out.cpu, out.cpu);
      if (!changed) {
        out.untried.push_back(candidate);
        continue;
      }
      longest = std::max(longest, changed->statistics.work);
      if (changed->columns != base.columns) continue;
      const Difference d = compare_histories(*changed, base, common_ranges(*changed, base, options.deflection));
      n.share = d.largest;
      n.column = d.column >= 0 ? base.columns[d.column] : "";
      n.resolved = n.share > 2.0 * options.floor;
      if (options.run && options.tolerance > options.run_tolerance && n.share > options.confirm_above)
        confirm(other, options, pair, *changed, n, out.cpu);
      out.found.push_back(n);
    } catch (const std::runtime_error& error) {
      out.untried.push_back({n.effect, n.owners, error.what()});
    }
  }
  return out;
}

namespace {

// What to write to have the effect, for the first of its owners.
std::string remedy_of(const Scene& scene, const Neglected& n) {
  const BodyDef* body = nullptr;
  for (const BodyDef& b : scene.bodies)
    if (!body && b.name == n.owners.front()) body = &b;
  const auto* beam = body ? std::get_if<BeamDef>(&body->kind) : nullptr;
  const auto* modal = body ? std::get_if<ModalDef>(&body->kind) : nullptr;
  const EffectChoice* choice = beam ? &beam->effects : modal ? &modal->effects : nullptr;
  if (choice && std::find(choice->without.begin(), choice->without.end(), n.effect) != choice->without.end())
    return fmt::format("take \"{}\" out of 'without'", n.effect);
  if (!beam) return fmt::format("add \"{}\" to 'effects'", n.effect);
  std::string list = choice->automatic ? "\"auto\", " : "";
  if (!choice->automatic)
    for (const std::string& name : choice->names) list += fmt::format("\"{}\", ", name);
  const std::string words = fmt::format("effects = [{}\"{}\"]", list, n.effect);
  const bool shear = n.effect == "shear";
  const auto bends = [&](const char* name) {
    return choice->automatic || std::find(choice->names.begin(), choice->names.end(), name) != choice->names.end();
  };
  const bool rigid_in_shear =
      (bends("bending_xy") && beam->section.shear_y <= 0.0) || (bends("bending_xz") && beam->section.shear_z <= 0.0);
  if (shear && beam->model != BeamModel::lumped && rigid_in_shear)
    return fmt::format("give the section shear_y and shear_z{}, and add \"shear\" to 'effects': {}",
                       beam->modes.empty() ? "" : ", take model = \"finite-element\" without 'modes'", words);
  if (beam->model == BeamModel::lumped && !n.possible)
    return fmt::format("a lumped beam cannot have it: take model = \"finite-element\" and {}", words);
  if (beam->model == BeamModel::modal && (shear || !beam->modes.empty()) && n.effect != "stiffening")
    return fmt::format("take model = \"finite-element\"{} and {}", beam->modes.empty() ? "" : " without 'modes'", words);
  if (!beam->modes.empty() && shear) return fmt::format("take 'elements' in place of 'modes' and {}", words);
  return fmt::format("add \"{}\" to 'effects': {}", n.effect, words);
}

std::string quoted(const std::vector<std::string>& owners) {
  std::string out;
  for (const std::string& owner : owners) out += fmt::format("{}'{}'", out.empty() ? "" : ", ", owner);
  return out;
}

// Takes `next` into the entry of the same effect for which same(entry) holds, whose share is then the larger of both; else as a new one.
template <class Same>
void merge(std::vector<LeftOutWorth>& all, const LeftOutWorth& next, const Same& same) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const LeftOutWorth& have) { return have.effect == next.effect && same(have); });
  if (found == all.end()) {
    all.push_back(next);
    return;
  }
  found->owners.insert(found->owners.end(), next.owners.begin(), next.owners.end());
  if (next.share > found->share) found->share = next.share, found->column = next.column;
}

}  // namespace

void tell_neglected(const Neglected& n, double floor, Notes& notes) {
  const std::string influence = n.resolved
                                    ? fmt::format("{:.1g} of the range of {}", n.share, n.column)
                                    : fmt::format("its influence is below the {:.1g} that this check resolves", std::max(n.share, floor));
  notes.tell("", fmt::format("{} of {} left out: {}", n.effect, quoted(n.owners), influence));
}

void report_neglected(const Scene& scene, const std::vector<EffectState>& states, const Histories& base, const NeglectOptions& options,
                      double asked, SolverStatistics& out) {
  NeglectOptions confirmed = options;
  confirmed.confirm_above = asked;
  const NeglectCheck check = check_neglected(scene, states, base, confirmed);
  const auto told = [&](const std::string& effect) {
    return options.told &&
           std::any_of(options.told->begin(), options.told->end(), [&](const LeftOutWorth& w) { return w.effect == effect; });
  };
  for (const Neglected& n : check.found) {
    if (options.told) std::erase_if(*options.told, [&](const LeftOutWorth& w) { return w.effect == n.effect; });
    if (n.share > asked && n.resolved) {
      out.notes.warn("", neglect_text(scene, n));
      continue;
    }
    tell_neglected(n, options.floor, out.notes);
  }
  for (const Untried& u : check.untried) {
    if (told(u.effect)) continue;
    out.notes.tell(
        "", fmt::format("{} of {} left out; its influence was not checked: {}; flexframe effects measures it", u.effect, quoted(u.owners),
                        u.failed.empty() ? "that would take longer than the run" : "with it the run fails (" + u.failed + ")"));
  }
}

namespace {

// Whether most of the deformation is left out.
bool missed_in_pictures(const LeftOutWorth& f) { return f.possible && f.shown > 0.5; }

}  // namespace

void report_left_out(const Scene& scene, const std::vector<LeftOutWorth>& found, double asked, SolverStatistics& out) {
  const auto neglected = [](const LeftOutWorth& f) { return Neglected{f.effect, f.owners, f.share, f.column, true, f.possible}; };
  // Like bodies give one line.
  std::vector<LeftOutWorth> warned, told;
  for (const LeftOutWorth& f : found) {
    const bool by_formula = is_of_second_order(f.effect);
    if (f.share > (by_formula ? 0.5 : told_of_left_out) * asked)
      merge(warned, f, [&](const LeftOutWorth& have) { return remedy_of(scene, neglected(have)) == remedy_of(scene, neglected(f)); });
    else
      merge(told, f, [&](const LeftOutWorth& have) {
        return (have.share > 0.0) == (f.share > 0.0) && missed_in_pictures(have) == missed_in_pictures(f);
      });
  }
  for (const LeftOutWorth& f : warned) out.notes.warn("", neglect_text(scene, neglected(f)));
  for (const LeftOutWorth& f : told) {
    std::string worth = "no influence on the outputs";
    if (f.share > 0.0) worth = fmt::format("{}{:.1g} of the range of {}", f.owners.size() > 1 ? "at most " : "", f.share, f.column);
    if (missed_in_pictures(f))
      worth += fmt::format("; pictures do not show its {:.1g} m, most of the deformation: add \"{}\" to 'effects'", f.reach, f.effect);
    out.notes.tell("", fmt::format("{} of {} left out: {}", f.effect, quoted(f.owners), worth));
  }
}

namespace {

// Bending that nothing excites comes where the beam is nearer to bending by itself than this (LeftOutWorth::critical).
constexpr double most_critical = 0.25;

// Whether bending that was left out as nothing seemed to excite it (idle_bending.h) has to come.
bool calls_idle_bending(const LeftOutWorth& f, double asked, const Scene& scene) {
  if (!f.possible || !f.effect.starts_with("bending")) return false;
  if (f.critical <= most_critical && f.share <= asked * (worth_leaving_out / 1e-2)) return false;
  return std::any_of(scene.bodies.begin(), scene.bodies.end(), [&](const BodyDef& body) {
    const auto* beam = std::get_if<BeamDef>(&body.kind);
    return beam && beam->chosen.first_bending > 0.0 && std::find(f.owners.begin(), f.owners.end(), body.name) != f.owners.end();
  });
}

}  // namespace

bool call_for(const std::vector<LeftOutWorth>& found, double asked, Scene& scene, Notes& notes) {
  // Along a motion that lacks the bending that it should have, other effects may be all that moves an output.
  const bool bends_first =
      std::any_of(found.begin(), found.end(), [&](const LeftOutWorth& f) { return calls_idle_bending(f, asked, scene); });
  std::vector<LeftOutWorth> counted_in;
  std::set<std::string> critical;
  double most = 0.0;
  bool called = false;
  // The smallest stay out as long as all of them together are worth less than a third of what counts.
  double together = 0.0;
  for (auto f = found.rbegin(); f != found.rend(); ++f) {  // NOLINT(modernize-loop-convert): from the last to the first
    together += f->share;
    const bool by_itself = f->critical > most_critical;
    if (bends_first && !f->effect.starts_with("bending")) continue;
    if (!f->possible || (together <= asked * (worth_leaving_out / 1e-2) && f->blow <= asked && !by_itself)) continue;
    std::vector<std::string> taken;
    for (const std::string& owner : f->owners)
      for (BodyDef& body : scene.bodies) {
        auto* beam = std::get_if<BeamDef>(&body.kind);
        if (body.name != owner || !beam) continue;
        EffectChoice& choice = beam->effects;
        const auto listed = [&](const std::vector<std::string>& names) {
          return std::find(names.begin(), names.end(), f->effect) != names.end();
        };
        const bool modes_decide = beam->model == BeamModel::modal && !beam->modes.empty() && f->effect != "shear";
        if (!choice.automatic || listed(choice.without) || listed(choice.names) || modes_decide) continue;
        choice.names.push_back(f->effect);
        beam->chosen.effects = true;
        taken.push_back(owner);
      }
    if (taken.empty()) continue;
    if (by_itself) critical.insert(taken.begin(), taken.end()), most = std::max(most, f->critical);
    else if (f->share > asked * (worth_leaving_out / 1e-2) || f->blow <= asked)
      merge(counted_in, {f->effect, taken, true, f->share, f->column}, [](const LeftOutWorth&) { return true; });
    else
      notes.tell("", fmt::format("{} of {} switched on: where bodies strike it takes up about {:.2g} of the blow", f->effect, quoted(taken),
                                 f->blow));
    called = true;
  }
  if (!critical.empty())
    notes.tell("", fmt::format("bending of {} switched on: what turns, presses or twists {} comes to {:.2g} of where beams may bend by "
                               "themselves",
                               quoted({critical.begin(), critical.end()}), critical.size() > 1 ? "them" : "it", most));
  for (const LeftOutWorth& f : counted_in)
    notes.tell("", fmt::format("{} of {} switched on: a run without it showed an influence of {} {:.2g} of the range of {}", f.effect,
                               quoted(f.owners), f.owners.size() > 1 ? "up to" : "about", f.share, f.column));
  return called;
}

std::string neglect_text(const Scene& scene, const Neglected& n) {
  return fmt::format("{} of {} is left out, but its influence is {:.2g} of the range of {}: {}", n.effect, quoted(n.owners), n.share,
                     n.column, remedy_of(scene, n));
}

}  // namespace flexframe::sim
