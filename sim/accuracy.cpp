#include "sim/accuracy.h"

#include "sim/effect_report.h"
#include "sim/normal_modes.h"
#include "sim/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <map>
#include <optional>
#include <set>

namespace flexframe::sim {
namespace {

// Samples of the runs that are compared.
constexpr int compared_samples = 200;
// Least order at which the error of time follows the tolerance when it has to be lowered (simulate.h: 0.2 to 1.2).
constexpr double cautious_order = 0.6;

double thread_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

bool names_nodes(const Scene& scene, const std::string& body) {
  const auto node = [&](const FrameRef& f) { return f.body == body && (f.frame.rfind("node[", 0) == 0 || f.frame.rfind("station[", 0) == 0); };
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) { return node(j.parent) || node(j.child); }) ||
         std::any_of(scene.forces.begin(), scene.forces.end(), [&](const ForceDef& f) { return node(f.on) || node(f.from); }) ||
         std::any_of(scene.outputs.begin(), scene.outputs.end(), [&](const OutputDef& o) { return node(o.of); });
}

// A body whose resolution may be chosen.
struct Resolvable {
  size_t body = 0;
  BeamModel model = BeamModel::finite_element;
  int given = 0;                    // elements, volumes, highest mode of the scene
  std::vector<double> frequencies;  // rad/s, finite elements: of the first bending direction, ascending
};

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
    for (const Part& p : model.parts) {
      if (p.scene_body != static_cast<int>(b) || beam->model != BeamModel::finite_element || p.body.stiffness.size() == 0) continue;
      std::array<std::vector<double>, 4> by_direction;
      for (int k = 0; k < p.body.n; ++k) by_direction[static_cast<size_t>(coordinate_direction(p.body, k))].push_back(std::sqrt(std::max(0.0, p.body.stiffness[k])));
      // The direction with the lowest frequency sets the count.
      for (const auto& list : by_direction)
        if (!list.empty() && (r.frequencies.empty() || list.front() < r.frequencies.front())) r.frequencies = list;
    }
    if (beam->model == BeamModel::finite_element && r.frequencies.empty()) continue;
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

// Modes of the softest body at a level: 1 2 3 4 6 8 12 16 ...
int modes_at(int level) {
  if (level < 3) return std::max(1, level + 1);
  const int half = (level - 3) / 2;
  return (level % 2 == 1 ? 4 : 6) << half;
}

struct Setting {
  int level = 1;
  double tolerance = 1e-4;
};

class Search {
 public:
  Search(const Scene& scene, const SimulateOptions& options) : scene_(scene), options_(options) {
    scene_.simulation.accuracy.reset();
    scene_.simulation.tolerance = default_tolerance;
    const System system = make_system(scene_);
    states = effect_states(scene_, system.model);
    method = options.method;
    bodies_ = resolvable_bodies(scene_, system.model);
    for (const Part& p : system.model.parts) undamped = undamped && p.body.De.size() == 0;
    for (const Resolvable& r : bodies_)
      if (!r.frequencies.empty()) softest_ = softest_ == 0.0 ? r.frequencies.front() : std::min(softest_, r.frequencies.front());
  }

  bool has_levels() const { return !bodies_.empty(); }
  const Scene& scene() const { return scene_; }

  Scene at(const Setting& setting) const {
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
        beam.keep_modes = keep;
        beam.keep_static = method != Method::erk;  // stiff shapes shorten explicit steps
        beam.elements = std::max(r.given, 3 * keep);
      } else if (r.model == BeamModel::modal) {
        for (auto& [direction, numbers] : beam.modes) {
          numbers.clear();
          for (int k = 1; k <= (direction == "axial" || direction == "torsion" ? std::max(1, modes / 3) : modes); ++k) numbers.push_back(k);
        }
      } else {
        const int n = std::max(1, static_cast<int>(std::lround(r.given * share)));
        (r.model == BeamModel::mixed ? beam.volumes : beam.elements) = n;
      }
    }
    return out;
  }

  // The next level, with a mode more in every flexible body than this one has: what the run's own resolution is judged by.
  Scene finer_than(const Setting& setting) const {
    const Scene here = at(setting);
    Scene next = at({setting.level + 1, setting.tolerance});
    for (const Resolvable& r : bodies_) {
      const std::optional<int> have = std::get<BeamDef>(here.bodies[r.body].kind).keep_modes;
      BeamDef& beam = std::get<BeamDef>(next.bodies[r.body].kind);
      if (!have || *have == 0 || !beam.keep_modes) continue;
      beam.keep_modes = std::max(*beam.keep_modes, *have + 1);
      beam.elements = std::max(r.given, 3 * *beam.keep_modes);
    }
    return next;
  }
  // From now on no fewer modes than these.
  void keep_at_least(const Scene& scene) {
    for (const Resolvable& r : bodies_)
      if (const std::optional<int> keep = std::get<BeamDef>(scene.bodies[r.body].kind).keep_modes; keep && *keep > 0) least_[r.body] = *keep;
  }

  Histories run(const Scene& scene) {
    SimulateOptions o;
    o.method = method;
    o.samples = compared_samples;
    if (options_.progress) o.progress = [this](double) { options_.progress(0.0); };
    Histories h = simulate_histories(scene, o);
    cpu += h.statistics.cpu_seconds;
    return h;
  }

  // The same, given up after so many CPU seconds.
  std::optional<Histories> run_within(const Scene& scene, double seconds) {
    SimulateOptions o;
    o.method = method;
    o.samples = compared_samples;
    const double start = thread_seconds();
    struct TooLong {};
    o.progress = [&](double) {
      if (options_.progress) options_.progress(0.0);
      if (thread_seconds() - start > seconds) throw TooLong{};
    };
    std::optional<Histories> out;
    try {
      out = simulate_histories(scene, o);
    } catch (const TooLong&) {
    } catch (const SimulationError&) {  // a step beyond the limit of stability can tear a body apart
    }
    cpu += thread_seconds() - start;
    return out;
  }

  void set_effect(const EffectState& s, bool on) {
    scene_ = with_effect(scene_, states, s.owner, s.effect, on);
    for (BodyDef& b : scene_.bodies)
      if (b.name == s.owner) {
        if (auto* beam = std::get_if<BeamDef>(&b.kind)) beam->effects.by_program = true;
      }
    for (EffectState& other : states)
      if (other.owner == s.owner && other.effect == s.effect) other.on = on, other.by = "program";
  }

  std::vector<std::string> describe(const Setting& setting) const {
    std::vector<std::string> out{fmt::format("tolerance {:.1e}", setting.tolerance)};
    const Scene chosen = at(setting);
    for (const Resolvable& r : bodies_) {
      const BodyDef& b = chosen.bodies[r.body];
      const BeamDef& beam = std::get<BeamDef>(b.kind);
      switch (r.model) {
        case BeamModel::finite_element:
          if (beam.keep_modes == 0) out.push_back(fmt::format("'{}' rigid", b.name));
          else out.push_back(fmt::format("'{}' {} modes{} of {} elements", b.name, *beam.keep_modes, beam.keep_static ? "" : " (keep_static = false)", beam.elements));
          break;
        case BeamModel::modal: out.push_back(fmt::format("'{}' {} modes a direction", b.name, modes_at(setting.level))); break;
        case BeamModel::mixed: out.push_back(fmt::format("'{}' {} volumes", b.name, beam.volumes)); break;
        default: out.push_back(fmt::format("'{}' {} lumps", b.name, beam.elements));
      }
    }
    return out;
  }

  std::vector<EffectState> states;
  bool undamped = true;          // no body damps its own vibrations
  std::optional<Method> method;  // of all runs
  double cpu = 0.0;              // s, of all runs but the last
  std::set<std::string> flexible;  // stiff bodies whose flexibility matters

  // Bodies that a setting makes rigid.
  std::vector<std::string> rigid_at(const Setting& setting) const {
    std::vector<std::string> out;
    const Scene chosen = at(setting);
    for (const Resolvable& r : bodies_)
      if (std::get<BeamDef>(chosen.bodies[r.body].kind).keep_modes == 0) out.push_back(chosen.bodies[r.body].name);
    return out;
  }

 private:
  Scene scene_;
  const SimulateOptions& options_;
  std::vector<Resolvable> bodies_;
  double softest_ = 0.0;
  std::map<size_t, int> least_;  // modes of bodies, at any level
};

double apart(const Histories& a, const Histories& reference, std::string* column = nullptr) {
  const Difference d = compare_histories(a, reference, output_ranges(reference));
  if (column && d.column >= 0) *column = reference.columns[static_cast<size_t>(d.column)];
  return d.largest;
}

bool automatic(const Scene& scene, const std::string& owner) {
  for (const BodyDef& b : scene.bodies)
    if (const auto* beam = std::get_if<BeamDef>(&b.kind); beam && b.name == owner) return beam->effects.automatic || beam->effects.by_program;
  return false;
}

}  // namespace

Results simulate_to_accuracy(const Scene& scene, double accuracy, const SimulateOptions& options) {
  Search search(scene, options);
  AccuracyStatement out;
  out.asked = accuracy;
  Setting setting;
  setting.tolerance = std::clamp(0.1 * accuracy, 1e-11, 1e-3);

  // Time, one level below: lower the tolerance until half of the asked error is kept.
  const auto below = [&] { return Setting{search.has_levels() ? setting.level - 1 : setting.level, setting.tolerance}; };
  const auto loose = [&] { return Setting{below().level, 10.0 * setting.tolerance}; };
  Histories first, coarse;
  for (;;) {
    try {
      first = search.run(search.at(loose()));
      coarse = search.run(search.at(below()));
      break;
    } catch (const SimulationError&) {
      // Too loose to hold the mechanism together, perhaps; what fails at a tight tolerance as well fails.
      if (setting.tolerance <= 1e-7) throw;
      setting.tolerance *= 0.1;
    }
  }
  bool explicit_pays = scene.simulation.method == Method::automatic;
  double explicit_tolerance = std::min(1e-5, 0.01 * accuracy);
  std::optional<Histories> explicit_run;
  for (int round = 0; round < 12; ++round) {
    out.time = error_of_difference * apart(first, coarse, &out.column);
    if (out.time <= 0.5 * accuracy || setting.tolerance <= 1e-11) break;
    // Vibrations whose phase is asked for have to be followed, not stepped over: there an explicit method of sixth order is cheaper, as
    // long as what is kept of the bodies is not stiff. Each round lowers its tolerance by a decade, for as long as the next round would take.
    if (explicit_pays && !search.method && coarse.statistics.method != method_name(Method::erk)) {
      search.method = Method::erk;
      const double longest = (round == 0 ? 20.0 : 4.0) * coarse.statistics.cpu_seconds;
      std::optional<Histories> wide = explicit_run ? std::move(explicit_run) : search.run_within(search.at({below().level, 10.0 * explicit_tolerance}), longest);
      explicit_run = wide ? search.run_within(search.at({below().level, explicit_tolerance}), longest) : std::nullopt;
      double time = explicit_run ? error_of_difference * apart(*wide, *explicit_run) : 1.0;
      // Vibrations that nothing damps have to be followed to the end: more decades are tried while they help. Damped ones leave long steps to others.
      for (double before = 1.0; search.undamped && explicit_run && time > 0.5 * accuracy && time < 0.5 * before && explicit_tolerance > 1e-10;) {
        before = time;
        explicit_tolerance *= 0.1;
        wide = std::move(explicit_run);
        explicit_run = search.run_within(search.at({below().level, explicit_tolerance}), longest);
        if (explicit_run) time = error_of_difference * apart(*wide, *explicit_run);
      }
      explicit_pays = explicit_run.has_value();
      if (explicit_pays && time <= 0.5 * accuracy) {
        setting.tolerance = explicit_tolerance;
        out.time = time;
        first = std::move(*wide);
        coarse = std::move(*explicit_run);
        out.chosen.push_back("method erk");
        break;
      }
      explicit_tolerance *= 0.1;
      search.method.reset();
    }
    const double step = std::clamp(std::pow(0.4 * accuracy / out.time, 1.0 / cautious_order), 0.01, 0.2);
    const bool one_decade = step > 0.05;
    setting.tolerance = std::max(1e-11, one_decade ? 0.1 * setting.tolerance : step * setting.tolerance);
    // A step of a decade finds its looser run already there.
    first = one_decade ? std::move(coarse) : search.run(search.at(loose()));
    coarse = search.run(search.at(below()));
  }
  const double decade = std::max(1.05, coarse.statistics.cpu_seconds / std::max(first.statistics.cpu_seconds, 1e-9));

  // Stiff bodies are rigid unless that shows.
  for (const std::string& name : search.rigid_at(below())) {
    search.flexible.insert(name);
    try {
      const Histories changed = search.run(search.at(loose()));
      const double share = changed.columns == first.columns ? apart(changed, first) : 1.0;
      if (share <= std::max(0.1 * accuracy, out.time)) {
        out.effects += std::min(share, 0.1 * accuracy);
        out.chosen.push_back(fmt::format("flexibility of '{}' worth {:.1g}", name, share));
        search.flexible.erase(name);
        continue;
      }
    } catch (const SimulationError&) {
      search.flexible.erase(name);
      continue;
    }
    coarse = search.run(search.at(below()));
  }

  // Effects that the program decides: each switched alone, at the coarse level.
  const std::vector<EffectState> before = search.states;
  for (const EffectState& s : before) {
    if (!s.possible || !automatic(search.scene(), s.owner) || s.by != "program" || s.effect == "shear") continue;
    Scene other = search.at(below());
    try {
      other = with_effect(other, search.states, s.owner, s.effect, !s.on);
      const Histories changed = search.run(other);
      if (changed.columns != coarse.columns) continue;
      const double share = apart(changed, coarse);
      const bool worth = s.on ? share > 0.1 * accuracy : share > accuracy / 3.0;
      if (worth != s.on) {
        search.set_effect(s, worth);
        out.chosen.push_back(fmt::format("{} of '{}' {} (worth {:.1g})", s.effect, s.owner, worth ? "on" : "off", share));
        coarse = search.run(search.at(below()));
      }
      if (!worth) out.effects += share;
    } catch (const SimulationError&) {
      // A run that fails with the switch thrown says that it is better left as it is.
    }
  }

  // The run itself, checked against the one below; one level more as long as space is what lacks.
  SimulateOptions last = options;
  last.tolerance.reset();
  last.method = search.method;
  last.estimate_error = false;
  Results results;
  Histories looser;         // the level of the run itself, at ten times its tolerance
  double last_step = 0.0;   // difference of the two levels before
  for (int round = 0;; ++round) {
    const Scene chosen = search.at(setting);
    results = simulate(chosen, last);
    const Histories fine = to_histories(results);
    std::string column;
    const double step = search.has_levels() ? apart(coarse, fine, &column) : 0.0;
    // A geometric series: what is still to come is the last step / (ratio - 1). The first ratio is taken for 3; free vibrations after a
    // release converge slowly, by 1.5 a level.
    const double ratio = last_step > 0.0 ? std::clamp(last_step / std::max(step, 1e-300), 1.5, 6.0) : 3.0;
    out.space = step / (ratio - 1.0);
    // The error of time again, in the modes that the level below did not have.
    looser = search.run(search.at({setting.level, 10.0 * setting.tolerance}));
    std::string in_time;
    out.time = error_of_difference * apart(looser, fine, &in_time);
    out.column = out.space > out.time ? column : in_time;
    const bool stuck = last_step > 0.0 && step > 0.5 * last_step;
    const double step_before = last_step;
    last_step = step;
    // Levels may differ in some bodies only, and jumps of loads converge slowly in all of them. Where no static deflections stand for the
    // modes left out, a finer run tells.
    if (search.has_levels() && search.method == Method::erk && out.time + out.space + out.effects <= accuracy) {
      const Scene finer = search.finer_than(setting);
      const Histories judge = search.run(finer);
      const double left = apart(fine, judge, &column);
      if (left > out.space) out.space = left, out.column = column;
      if (out.time + left + out.effects > accuracy && round < 14) {
        search.cpu += results.statistics.cpu_seconds;
        search.keep_at_least(finer);
        ++setting.level;
        coarse = fine;
        continue;
      }
    }
    if (round == 14 || out.time + out.space + out.effects <= accuracy) break;
    if (!search.has_levels() && setting.tolerance <= 1e-11) break;
    search.cpu += results.statistics.cpu_seconds;
    // More modes that do not help are the error of time in them.
    if (!search.has_levels() || ((stuck || out.time > 0.5 * accuracy) && setting.tolerance > 1e-10)) {
      const double step_down = std::pow(0.4 * accuracy / std::max(out.time, 0.4 * accuracy), 1.0 / cautious_order);
      setting.tolerance = std::max(1e-11, setting.tolerance * std::clamp(step_down, 0.05, 0.3));
      coarse = search.run(search.at(below()));
      last_step = stuck ? 0.0 : step_before;
      continue;
    }
    ++setting.level;
    coarse = fine;
  }

  // What half the error would cost: the larger of the two errors has to shrink.
  const double finer_time = std::pow(decade, std::log10(2.0) / cautious_order);
  const double finer_space = std::max(1.0, results.statistics.cpu_seconds / std::max(coarse.statistics.cpu_seconds, 1e-9));
  out.half_cost = out.time >= out.space ? finer_time : finer_space;
  const std::vector<std::string> settings = search.describe(setting);
  out.chosen.insert(out.chosen.begin(), settings.begin(), settings.end());
  out.search_cpu = search.cpu;
  SolverStatistics& s = results.statistics;
  s.error_estimate = out.time + out.space + out.effects;
  s.error_column = out.column;
  if (s.error_estimate > accuracy)
    s.warnings.push_back(fmt::format("accuracy {:g} was asked; the estimated error is {:.1e} of the range of {}", accuracy, s.error_estimate, out.column));
  if (options.check_effects) {
    NeglectOptions check;
    check.tolerance = loose().tolerance;
    const Histories whole = to_histories(results);
    check.floor = std::max(out.time, apart(looser, whole));
    check.budget = std::max(check_price * s.cpu_seconds, least_check);
    check.method = search.method;
    check.run = &whole;
    check.run_tolerance = setting.tolerance;
    check.run_error = s.error_estimate;
    report_neglected(search.at(setting), search.states, looser, check, accuracy, s);
  }
  s.accuracy = out;
  return results;
}

}  // namespace flexframe::sim
