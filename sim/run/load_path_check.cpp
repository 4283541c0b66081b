#include "sim/run/load_path_check.h"

#include "sim/base/error.h"
#include "sim/base/words.h"
#include "sim/run/effect_report.h"
#include "sim/run/run_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>

namespace flexframe::sim {
namespace {

// What the program leaves out may be worth so much, as in a run (effect_report.cpp: call_for).
constexpr double left_out_at_most = unasked_accuracy / 3.0;
// A path costs some hundred times the third power of what is sought: finer beams are followed up to so many, coarser ones instead beyond.
constexpr size_t most_directions = 100;
// Errors fall with the square of their number at least: half as many differ by three errors, twice as many by three quarters of one.
constexpr double by_halves = 1.0 / 3.0, by_twice = 4.0 / 3.0;

// The outputs of one vector and one unit.
struct Group {
  std::string name;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> columns;  // of a path, of the other one
  double range = 0.0;
};

std::vector<Group> groups_of(const LoadPath& path, const LoadPath& other, double size, double force) {
  std::vector<Group> out;
  std::map<std::pair<std::string, std::string>, size_t> known;
  std::vector<std::string> units;
  for (size_t c = 0; c < path.columns.size(); ++c) {
    const auto same = std::find(other.columns.begin(), other.columns.end(), path.columns[c]);
    if (same == other.columns.end()) continue;
    const std::string name = path.columns[c].substr(0, path.columns[c].find('.'));
    const auto [at, fresh] = known.try_emplace({name, path.units[c]}, out.size());
    if (fresh) {
      out.push_back({name, {}, 0.0});
      units.push_back(path.units[c]);
    }
    out[at->second].columns.emplace_back(static_cast<Eigen::Index>(c), same - other.columns.begin());
  }
  std::map<std::string, double> largest;
  for (size_t g = 0; g < out.size(); ++g) {
    double squares = 0.0;
    for (const auto& [own, there] : out[g].columns) {
      double low = other.states.front().outputs[there], high = low;
      for (const LoadPathState& s : other.states) {
        low = std::min(low, s.outputs[there]);
        high = std::max(high, s.outputs[there]);
      }
      squares += (high - low) * (high - low);
    }
    out[g].range = std::sqrt(squares);
    double& most = largest[units[g]];
    most = std::max(most, out[g].range);
  }
  // What hardly moves beside the others of its kind may be rounding.
  largest["N"] = std::max(largest["N"], 1e-3 * force);
  largest["N m"] = std::max(largest["N m"], size * largest["N"]);
  largest["m"] = std::max(largest["m"], 1e-6 * size);
  largest["rad"] = std::max(largest["rad"], 1e-6);
  for (size_t g = 0; g < out.size(); ++g) out[g].range = std::max(out[g].range, 1e-3 * largest[units[g]]);
  std::erase_if(out, [](const Group& g) { return !(g.range > 0.0); });
  return out;
}

// A state in load and outputs over their ranges.
VecX scaled(const LoadPathState& state, const std::vector<Group>& groups, double loads, bool other) {
  std::vector<double> out = {state.load / loads};
  for (const Group& g : groups)
    for (const auto& [own, there] : g.columns) out.push_back(state.outputs[other ? there : own] / g.range);
  return Eigen::Map<const VecX>(out.data(), static_cast<Eigen::Index>(out.size()));
}

// The load's, and each group's part of a difference of scaled states.
OffCurve largest_part(const VecX& difference, const std::vector<Group>& groups) {
  OffCurve out{std::abs(difference[0]), "load", 0.0};
  Eigen::Index at = 1;
  for (const Group& g : groups) {
    const auto n = static_cast<Eigen::Index>(g.columns.size());
    const double size = difference.segment(at, n).norm();
    if (size > out.share) out = {size, g.name, 0.0};
    at += n;
  }
  return out;
}

constexpr std::array<std::string_view, 6> may_be_off = {"axial", "bending_xy", "bending_xz", "torsion", "shear", "stiffening"};

// What beams go without and could have. Listed modes decide over directions by themselves.
std::vector<EffectState> off_effects(const Scene& scene, const std::vector<EffectState>& states) {
  std::vector<EffectState> out;
  for (const EffectState& s : states) {
    if (s.on || !s.possible || s.body < 0 || std::find(may_be_off.begin(), may_be_off.end(), s.effect) == may_be_off.end()) continue;
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[static_cast<size_t>(s.body)].kind);
    if (beam && beam->modes.empty()) out.push_back(s);
  }
  return out;
}

bool program_decides(const Scene& scene, const EffectState& s) {
  const EffectChoice& choice = std::get<BeamDef>(scene.bodies[static_cast<size_t>(s.body)].kind).effects;
  return choice.automatic && std::find(choice.without.begin(), choice.without.end(), s.effect) == choice.without.end();
}

// The path of another model; none where it has no such path.
std::optional<FollowedPath> followed(const FollowPath& follow, const Scene& scene) {
  try {
    FollowedPath out = follow(scene);
    if (out.path.states.size() > 1) return out;
  } catch (const InputError&) {  // the other model's start is no equilibrium
  } catch (const SimulationError&) {
  } catch (const ArgumentError&) {}  // what its beams cannot have
  return std::nullopt;
}

// Each once, as words.
std::string owners_of(const std::vector<EffectState>& states) {
  std::set<std::string> names;
  for (const EffectState& s : states) names.insert(quote(s.owner));
  return list_words(std::vector(names.begin(), names.end()));
}

std::string effects_of(const std::vector<EffectState>& states) {
  std::set<std::string> names;
  for (const EffectState& s : states) names.insert(s.effect);
  return list_words(std::vector(names.begin(), names.end()));
}

const char* it_or_them(const std::vector<EffectState>& states) {
  return std::any_of(states.begin(), states.end(), [&](const EffectState& s) { return s.effect != states.front().effect; }) ? "them" : "it";
}

// The scene with twice or half of the elements of every beam that can have them; none where no beam can.
std::optional<Scene> with_other_elements(const Scene& scene, bool half) {
  Scene out = scene;
  bool any = false;
  for (BodyDef& body : out.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || beam->model == BeamModel::modal || beam->all_elements || !beam->initial.q.empty()) continue;
    // Shapes that are kept are those of enough elements; their number is what counts.
    int& number = beam->keep_modes ? *beam->keep_modes : beam->model == BeamModel::mixed ? beam->volumes : beam->elements;
    if (half && (number < 2 || beam->keep_modes)) continue;
    number = half ? number / 2 : 2 * number;
    any = true;
  }
  return any ? std::optional(out) : std::nullopt;
}

// "is off by 0.08 of the range of tip at the load 0.3"
std::string off_words(const OffCurve& off) {
  if (off.column.empty()) return fmt::format("ends at the load {:.4g}", off.load);
  return fmt::format("is off by {:.2g} of the range of {} (load {:.4g})", off.share, off.column, off.load);
}

class Judge {
 public:
  Judge(const Scene& scene, const LoadPathOptions& options, const FollowPath& follow)
      : scene_(scene), loads_(std::abs(options.to - options.from)), follow_(follow) {}

  LoadPath path() {
    now_ = follow_(scene_);
    bend_further();
    look_at_effects();
    bend_further();
    warn_of_effects();
    warn_of_bending(judge_elements());
    LoadPath out = std::move(now_.path);
    out.notes = notes_.texts(Severity::note);
    const std::vector<std::string> warnings = notes_.texts(Severity::warning);
    out.warnings.insert(out.warnings.end(), warnings.begin(), warnings.end());
    return out;
  }

 private:
  void bend_further() {
    if (call_large_bending(now_.limits, unasked_accuracy, scene_, notes_)) now_ = follow_(scene_);
  }

  // What is off and moves the path.
  struct Worth {
    std::vector<EffectState> states;
    OffCurve off;                      // share < 0: the path with them cannot be followed
    std::optional<FollowedPath> with;  // the path with them
  };

  Worth measure(std::vector<EffectState> states) {
    Worth out;
    out.with = followed(follow_, with_effects_on(scene_, now_.effects, states));
    out.states = std::move(states);
    if (out.with) out.off = off_curve(now_.path, out.with->path, loads_, now_.size, now_.force);
    else out.off.share = -1.0;
    return out;
  }

  static bool counts(const Worth& w) { return w.off.share < 0.0 || w.off.share > left_out_at_most; }

  // Of what the program decides all, or nothing; of the rest each by itself, or all where only that counts.
  void look_at_effects() {
    std::vector<EffectState> free, given;
    for (const EffectState& s : off_effects(scene_, now_.effects)) (program_decides(scene_, s) ? free : given).push_back(s);
    if (!free.empty()) {
      Worth all = measure(free);
      if (all.with && counts(all)) switch_on(all);
      else if (counts(all)) worth_.push_back(std::move(all));
    }
    if (given.empty()) return;
    Worth all = measure(given);
    if (!counts(all)) return;
    std::vector<Worth> each;
    for (const std::string_view effect : may_be_off) {
      std::vector<EffectState> states;
      std::copy_if(given.begin(), given.end(), std::back_inserter(states), [&](const EffectState& s) { return s.effect == effect; });
      if (states.empty() || states.size() == given.size()) continue;
      Worth one = measure(std::move(states));
      if (counts(one)) each.push_back(std::move(one));
    }
    if (each.empty()) each.push_back(std::move(all));
    std::move(each.begin(), each.end(), std::back_inserter(worth_));
  }

  // The path with these is the path.
  void switch_on(Worth& all) {
    notes_.tell("", fmt::format("switched on: {} of {}; without {} the curve {}", effects_of(all.states), owners_of(all.states),
                                it_or_them(all.states), off_words(all.off)));
    scene_ = with_effects_on(scene_, now_.effects, all.states);
    now_ = std::move(*all.with);
  }

  void warn_of_effects() {
    for (const Worth& w : worth_) {
      if (w.off.share < 0.0) {
        notes_.warn("", fmt::format("left out: {} of {}; the curve with {} cannot be followed, so that what this is worth is not known",
                                    effects_of(w.states), owners_of(w.states), it_or_them(w.states)));
        continue;
      }
      if (w.off.share <= unasked_accuracy) continue;
      notes_.warn("", fmt::format("left out: {} of {}; without {} the curve {}: add {} to 'effects'", effects_of(w.states),
                                  owners_of(w.states), it_or_them(w.states), off_words(w.off), it_or_them(w.states)));
    }
  }

  // Bodies that bend farther within their frames than linear displacements can show, with the load at which they bend most. measured:
  // whether other numbers of volumes have shown what that is worth.
  void warn_of_bending(bool measured) {
    for (const LinearLimit& limit : now_.limits) {
      if (limit.at_rest <= unasked_accuracy || (measured && limit.pieces > 1)) continue;
      const BodyDef& body = scene_.bodies[static_cast<size_t>(limit.body)];
      notes_.warn(
          fmt::format("body '{}'", body.name),
          fmt::format("bends by up to {:.2g} degrees within its own frame (load {:.4g}), where linear displacements are {}: {}",
                      limit.turn * 180.0 / std::numbers::pi, limit.when,
                      limit.at_rest < 0.5 ? fmt::format("wrong by about {:.2g} % of the deflection", 100.0 * limit.at_rest) : "wrong",
                      !std::holds_alternative<BeamDef>(body.kind) ? "divide it into several bodies"
                      : limit.pieces > 1                          ? "take more volumes"
                                                                  : "take model = \"mixed\" with several volumes"));
    }
  }

  // Whether other numbers of elements were followed.
  bool judge_elements() {
    std::optional<Scene> other = with_other_elements(scene_, false);
    if (!other) return false;
    const bool half = 2 * now_.directions > most_directions;
    if (half) other = with_other_elements(scene_, true);
    const std::optional<FollowedPath> with = other ? followed(follow_, *other) : std::nullopt;
    if (!with) {
      notes_.tell("", "whether the beams have enough elements was not looked at");
      return false;
    }
    OffCurve off = off_curve(now_.path, with->path, loads_, now_.size, now_.force);
    off.share *= half ? by_halves : by_twice;
    if (off.share <= unasked_accuracy) return true;
    notes_.warn("", fmt::format("the beams have too few elements, volumes or modes: beside {} as many the curve {}; take twice as many",
                                half ? "half" : "twice", off_words(off)));
    return true;
  }

  Scene scene_;
  double loads_;
  const FollowPath& follow_;
  FollowedPath now_;
  std::vector<Worth> worth_;
  Notes notes_;
};

}  // namespace

OffCurve off_curve(const LoadPath& path, const LoadPath& other, double loads, double size, double force) {
  // Bars that do not lengthen may jam where elastic ones go on.
  if (other.complete && !path.complete) return {1.0, {}, path.states.back().load};
  const std::vector<Group> groups = groups_of(path, other, size, force);
  std::vector<VecX> curve;
  for (const LoadPathState& state : other.states) curve.push_back(scaled(state, groups, loads, true));
  OffCurve out;
  for (const LoadPathState& state : path.states) {
    const VecX at = scaled(state, groups, loads, false);
    OffCurve nearest{1e300, {}, 0.0};
    bool beyond = false;
    for (size_t k = 0; k + 1 < curve.size(); ++k) {
      const VecX along = curve[k + 1] - curve[k];
      const double square = along.squaredNorm();
      const double part = square > 0.0 ? (at - curve[k]).dot(along) / square : 0.0;
      const OffCurve off = largest_part(at - curve[k] - std::clamp(part, 0.0, 1.0) * along, groups);
      if (off.share >= nearest.share) continue;
      nearest = off;
      beyond = !other.complete && k + 2 == curve.size() && part > 1.0;
    }
    if (beyond) break;  // as those after it
    if (nearest.share <= out.share) continue;
    out = nearest;
    out.load = state.load;
  }
  return out;
}

LoadPath judged_load_path(const Scene& scene, const LoadPathOptions& options, const FollowPath& follow) {
  return Judge(scene, options, follow).path();
}

}  // namespace flexframe::sim
