#include "sim/run/model_check.h"

#include "sim/base/work_clock.h"
#include "sim/run/left_out.h"
#include "sim/run/model_comparison.h"
#include "sim/run/richer_beams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

// Volumes of the richer model for each of the run's. The error falls with the square: what the comparison leaves out is a fifteenth of what
// it finds for one frame, a third for volumes, of which more would be dear.
int richer(int pieces) { return pieces == 1 ? 4 : 2; }

const char* boundary_word(Boundary b) {
  switch (b) {
    case Boundary::clamped_free:
      return "clamped-free";
    case Boundary::supported_supported:
      return "supported-supported";
    case Boundary::supported_free:
      return "supported-free";
    case Boundary::free_free:
      return "free-free";
    case Boundary::clamped_clamped:
      return "clamped-clamped";
    default:
      return "clamped-supported";
  }
}

// Whether a joint of the scene takes hold of a place, for a sentence about ends that nothing holds.
bool is_held(const Scene& scene, const std::string& body, const std::string& frame) {
  const auto here = [&](const FrameRef& f) { return f.body == body && (f.frame == frame || (f.frame.empty() && frame == "root")); };
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const JointDef& j) { return here(j.parent) || here(j.child); });
}

// Beams in one frame have their damping ratios in every mode, however many they are.
bool damped_alike(const Scene& scene, const Scene& rich, const std::vector<size_t>& bodies) {
  const auto in_one_frame = [](const Scene& s, size_t b) {
    const auto* beam = std::get_if<BeamDef>(&s.bodies[b].kind);
    return beam && (beam->model == BeamModel::finite_element || beam->model == BeamModel::modal);
  };
  return std::all_of(bodies.begin(), bodies.end(), [&](size_t b) { return in_one_frame(scene, b) && in_one_frame(rich, b); });
}

// Changes the scene's beams by `enrich`; both scenes get plain damping where the models could not have the same otherwise, or `plainly`.
template <class Enrich>
Comparison compared(const Scene& scene, const std::vector<EffectState>& states, const std::vector<size_t>& bodies,
                    std::vector<size_t>& changed, const Enrich& enrich, const ModelCheckOptions& options, bool plainly = false) {
  Scene rich = scene;
  for (const size_t body : bodies)
    if (std::optional<Scene> next = enrich(rich, body)) rich = std::move(*next), changed.push_back(body);
  std::optional<Scene> plain;
  if (options.no_run_of_it) plain = scene;
  if (damped_by_modes(scene, changed) && (plainly || !damped_alike(scene, rich, changed))) {
    plain = with_plain_damping(scene, changed, states);
    for (const size_t body : changed)
      std::get<BeamDef>(rich.bodies[body].kind).damping = std::get<BeamDef>(plain->bodies[body].kind).damping;
  }
  return Comparison(scene, std::move(rich), std::move(plain), options.budget, options.run, options.asked);
}

void check_forms(const Scene& scene, const std::vector<EffectState>& states, const Histories& base, const ModelCheckOptions& options,
                 SolverStatistics& out) {
  std::vector<size_t> bodies, changed;
  for (size_t b = 0; b < scene.bodies.size(); ++b)
    if (const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind); beam && has_forms_of_ends(*beam)) bodies.push_back(b);
  if (bodies.empty()) return;
  const double until = work_seconds() + options.budget;
  const auto measured = [&](bool plainly) {
    ModelCheckOptions left = options;
    left.budget = std::max(0.0, until - work_seconds());
    changed.clear();
    Comparison comparison = compared(
        scene, states, bodies, changed, [&](const Scene& s, size_t b) { return with_elements(s, states, b); }, left, plainly);
    return changed.empty() ? std::nullopt : comparison.measure(base);
  };
  std::optional<OutputChange> found = measured(false);
  // A time constant takes the elements' fast vibrations away, which cost much and may hide the rest.
  if (!found && damped_by_modes(scene, bodies)) found = measured(true);
  for (const size_t b : bodies) {
    const BodyDef& body = scene.bodies[b];
    const Boundary boundary = std::get<BeamDef>(body.kind).boundary;
    const std::string owner = fmt::format("body '{}'", body.name),
                      forms = fmt::format("{} a {} beam", misfit_words, boundary_word(boundary));
    const bool tip_held = is_held(scene, body.name, "tip");
    if (found && found->share > options.asked) {
      out.notes.warn(owner, fmt::format("{}{}: with finite elements {} changes by {} its range; take model = \"finite-element\"{}", forms,
                                        (boundary == Boundary::clamped_clamped || boundary == Boundary::clamped_supported) && !tip_held
                                            ? ", but no joint holds its tip"
                                            : "",
                                        found->column, found->share > 9.5 ? "far more than" : fmt::format("{:.2g} of", found->share),
                                        std::get<BeamDef>(body.kind).model == BeamModel::modal
                                            ? ", or more modes, of the boundary that its joints make"
                                            : " and boundary = \"clamped-free\""));
    } else if (found) {
      out.notes.tell(owner, fmt::format("{}: with finite elements {} changes by {:.1g} of its range", forms, found->column, found->share));
    } else if ((boundary == Boundary::clamped_clamped || boundary == Boundary::clamped_supported) && !tip_held) {
      out.notes.warn(owner, fmt::format("{}, but no joint holds its tip: it is far too stiff; take boundary = \"clamped-free\"", forms));
    } else if (boundary != Boundary::supported_supported && !(boundary == Boundary::clamped_supported) && tip_held) {
      // Of a beam between two hinges it makes one per cent of the frequency, and after twelve cycles everything.
      out.notes.warn(owner, fmt::format("{}, but a joint holds its tip; what that makes was not checked, which would take too long or lie "
                                        "below the time error: take model = \"finite-element\", or ask flexframe check",
                                        forms));
    } else {
      out.notes.tell(
          owner,
          fmt::format("{}; whether that fits its joints was not checked, which would take too long or lie below the time error", forms));
    }
  }
}

// Elements that tell what one frame lacks as well as any more (pendulum: 1.72e-3, 1.75e-3, 1.74e-3 of its deflection with 12, 24 and 48),
// and volumes of finite elements, whose error falls with the fourth power of their number there. So few elements tell it to a half for a
// seventh of the price (1.2e-3 to 2.0e-3; four-bar's reaction 4.7e-3 with 6 and 12), which is enough where it is far from what is asked.
constexpr int telling_elements = 12, few_elements = 6, telling_volumes = 2;
constexpr double surely_less = 1.7, surely_more = 2.0;

// A beam of many finite elements, or of some of their modes, in one frame: as few elements tell what its bending lacks.
bool tells_by_fewer(const Scene& scene, const LinearLimit& limit) {
  const auto& beam = std::get<BeamDef>(scene.bodies[static_cast<size_t>(limit.body)].kind);
  return limit.pieces == 1 && beam.model == BeamModel::finite_element && beam.elements > telling_elements;
}

// What bending in its own frame changes, beside more volumes of the beams `changed`.
struct BesideVolumes {
  std::optional<OutputChange> found, unconfirmed;
  std::vector<size_t> changed;
  double cpu = 0.0;  // of the run with them, s
  int elements = 0;  // of each beam there
};

BesideVolumes bending_beside_volumes(const Scene& scene, const std::vector<EffectState>& states, const Histories& base,
                                     const std::vector<LinearLimit>& doubtful, const ModelCheckOptions& options, int telling) {
  const auto limit_of = [&](size_t body) -> const LinearLimit& {
    return *std::find_if(doubtful.begin(), doubtful.end(), [&](const LinearLimit& l) { return l.body == static_cast<int>(body); });
  };
  BesideVolumes out;
  std::vector<size_t> bodies;
  for (const LinearLimit& l : doubtful)
    if (std::holds_alternative<BeamDef>(scene.bodies[static_cast<size_t>(l.body)].kind)) bodies.push_back(static_cast<size_t>(l.body));
  const bool fewer =
      !bodies.empty() && std::all_of(bodies.begin(), bodies.end(), [&](size_t b) { return tells_by_fewer(scene, limit_of(b)); });
  Scene coarse = scene;
  if (fewer)
    for (const size_t b : bodies) {
      std::optional<Scene> next = with_elements(coarse, states, b);
      if (!next) return out;
      std::get<BeamDef>(next->bodies[b].kind).elements = telling;
      coarse = std::move(*next);
    }
  ModelCheckOptions of_pair = options;
  of_pair.no_run_of_it = fewer;
  Comparison comparison = compared(
      coarse, states, bodies, out.changed,
      [&](const Scene& s, size_t b) {
        return with_volumes(s, states, b, fewer ? telling_volumes : richer(limit_of(b).pieces) * limit_of(b).pieces);
      },
      of_pair);
  if (out.changed.empty()) return out;
  out.found = comparison.measure(base);
  if (!out.found && comparison.too_long()) out.unconfirmed = comparison.unconfirmed();
  out.cpu = comparison.rich_cpu();
  for (const size_t b : out.changed)
    out.elements = std::max(out.elements, fewer ? telling : elements_of(std::get<BeamDef>(scene.bodies[b].kind)));
  return out;
}

BendingWorth check_bending(const Scene& scene, const std::vector<EffectState>& states, const std::vector<LinearLimit>& limits,
                           const Histories& base, const ModelCheckOptions& options, SolverStatistics& out) {
  std::vector<LinearLimit> doubtful;
  BendingWorth worth;
  for (const LinearLimit& l : limits) worth.share = std::max(worth.share, l.counts());
  for (const LinearLimit& l : limits)
    if (l.counts() > options.surely_small * options.asked) doubtful.push_back(l);
  if (doubtful.empty()) return worth;
  BesideVolumes beside = bending_beside_volumes(scene, states, base, doubtful, options, few_elements);
  if (beside.elements == few_elements && beside.found && surely_less * beside.found->share > options.asked &&
      beside.found->share < surely_more * options.asked)
    if (BesideVolumes more = bending_beside_volumes(scene, states, base, doubtful, options, telling_elements); more.found)
      beside = std::move(more);
  const std::optional<OutputChange>& found = beside.found;
  worth.cpu = beside.cpu, worth.elements = beside.elements;
  double largest_share = 0.0;
  for (const LinearLimit& l : doubtful) {
    const bool changed = std::find(beside.changed.begin(), beside.changed.end(), static_cast<size_t>(l.body)) != beside.changed.end();
    // With r times as many volumes the error is r^2 times as small; only beams have any.
    const int volumes = !changed ? 0 : tells_by_fewer(scene, l) ? telling_volumes : richer(l.pieces) * l.pieces;
    if (!found || !changed) {
      // What an output changes by may be a multiple of what the deflection does, of which alone the estimate knows.
      if (beside.unconfirmed && changed && l.counts() <= options.asked)
        out.notes.warn(fmt::format("body '{}'", scene.bodies[l.body].name),
                       fmt::format("{}, where linear displacements are wrong by about {:.1g} % of the deflection, which may be more of an "
                                   "output's range ({} in a looser run); that was not measured, as it would take several times as long as "
                                   "the run: take model = \"mixed\" with {} volumes{} and compare",
                                   far_words(l, l.pieces > 1 ? "one of its volumes" : "its frame"), 100.0 * l.error(),
                                   beside.unconfirmed->column, volumes, l.may_go_on ? ", or add \"large_bending\" to 'effects'," : ""));
      else warn_of_linear_limits(scene, {l}, options.asked, out.notes);
      continue;
    }
    const double share = found->share / (1.0 - std::pow(static_cast<double>(l.pieces) / volumes, 2));
    largest_share = std::max(largest_share, share);
    const std::string owner = fmt::format("body '{}'", scene.bodies[l.body].name);
    const std::string turned = far_words(l, l.pieces > 1 ? "one of its volumes" : "its frame");
    if (share > options.asked) {
      const int enough = static_cast<int>(std::ceil(l.pieces * std::max(1.5, std::sqrt(1.5 * share / options.asked))));
      out.notes.warn(owner, fmt::format("{}, too far for linear displacements: with {} volumes {} changes by {:.2g} of its range; take "
                                        "model = \"mixed\" with volumes = {}{}",
                                        turned, volumes, found->column, found->share, std::min(enough, 200),
                                        l.may_go_on ? ", or add \"large_bending\" to 'effects'" : ""));
    } else {
      out.notes.tell(owner,
                     fmt::format("{}: with {} volumes {} changes by {:.1g} of its range", turned, volumes, found->column, found->share));
    }
  }
  if (found) worth.share = largest_share;
  return worth;
}

// What to take where twice as many elements change an output by this share of its range. Lumps, volumes and what rings err by the second
// power of their length or less, which makes that three quarters of what is wrong; a half of what is asked is left for other errors.
std::string enough_elements(const BeamDef& beam, double share, double asked) {
  const int elements = elements_of(beam), wanted = static_cast<int>(std::ceil(elements * std::sqrt(share / (0.75 * 0.5 * asked))));
  return fmt::format("its {} element{} too few for how it moves; take {} or more{}", elements, elements == 1 ? " is" : "s are", wanted,
                     beam.model == BeamModel::mixed ? " in all volumes together" : "");
}

// Beams whose number of elements or modes nobody has judged, or whose vibrations samples do not show, or that ring or are coarse: beside
// half as many elements, and twice as many where that leaves it open. Returns those of which that told.
std::vector<size_t> check_elements(const Scene& scene, const std::vector<EffectState>& states, const Histories& base,
                                   const ModelCheckOptions& options, SolverStatistics& out) {
  std::vector<size_t> bodies, changed, divided;
  const auto is_in = [](const std::vector<size_t>& list, size_t b) { return std::find(list.begin(), list.end(), b) != list.end(); };
  for (const std::vector<size_t>* candidates : {&options.unjudged, &options.between_samples, &options.ringing, &options.coarse}) {
    const bool lumped_too = candidates == &options.ringing || candidates == &options.coarse;
    for (const size_t b : *candidates)
      if (const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
          beam && (lumped_too || beam->model != BeamModel::lumped) && !has_forms_of_ends(*beam) && !is_in(bodies, b))
        bodies.push_back(b);
  }
  if (bodies.empty()) return {};
  // Twice as many take away three quarters of an error of second order, and other effects that are left out add to what elements lack:
  // without an asked accuracy, which adds them up, less is warned of.
  ModelCheckOptions judged = options;
  if (options.unjudged.empty()) judged.asked *= 0.75;
  // Elements err by the first power of their length at least where they ring, else by the second: what half of them change by little, twice
  // as many, which cost eight times that, cannot change by more.
  std::optional<OutputChange> half;
  bool dear = false;  // twice as many would take longer than they may, as the price grows from half of them
  if (!options.unjudged.empty() || !options.ringing.empty() || !options.coarse.empty()) {
    const double before = work_seconds();
    const auto fewer = [&](const Scene& s, size_t b) {
      std::optional<Scene> next = with_half_as_many(s, states, b);
      if (next && !is_in(options.unjudged, b)) keep_as_many(scene, b, *next);
      return next;
    };
    // What two loose runs are apart by in time may be more than that: where a search asks, tighter ones tell before twice as many have to,
    // if they cost little.
    constexpr double little = 0.3;  // CPU s of the run
    ModelCheckOptions of_half = judged;
    if (!options.unjudged.empty() && options.run.run && options.run.run->statistics.work < little) of_half.asked *= 0.5;
    Comparison comparison = compared(scene, states, bodies, changed, fewer, of_half);
    if (changed.size() == bodies.size()) half = comparison.measure(base);
    changed.clear();
    judged.budget = std::max(0.0, judged.budget - (work_seconds() - before));
    dear = half && std::pow(base.statistics.work, 2) > judged.budget * comparison.rich_cpu();
    if (half && half->share <= 0.5 * judged.asked) {
      for (const size_t b : bodies)
        out.notes.tell(fmt::format("body '{}'", scene.bodies[b].name),
                       fmt::format("with half as many elements {} changes by {:.1g} of its range", half->column, half->share));
      return bodies;
    }
  }
  const auto twice = [&](const Scene& s, size_t b) {
    bool in_two = false;
    std::optional<Scene> next = with_twice_as_many(s, states, b, in_two);
    if (in_two) divided.push_back(b);
    if (next && !is_in(options.unjudged, b)) keep_as_many(scene, b, *next);
    return next;
  };
  Comparison comparison = compared(scene, states, bodies, changed, twice, judged);
  const std::optional<OutputChange> found = changed.empty() || dear ? std::nullopt : comparison.measure(base);
  std::vector<size_t> measured;
  for (const size_t b : bodies) {
    const std::string owner = fmt::format("body '{}'", scene.bodies[b].name);
    const bool two = is_in(divided, b), given = is_in(options.unjudged, b);
    // Of what only closed formulas doubt they warn themselves.
    const bool silent = !found && is_in(options.coarse, b) && !given && !is_in(options.between_samples, b) && !is_in(options.ringing, b);
    if (found ? is_in(changed, b) : half && (!silent || half->share <= judged.asked)) measured.push_back(b);
    if (silent) continue;
    const char* more = two ? "two volumes of as many elements each" : "twice as many elements";
    if (!found && !given && half && half->share <= judged.asked)
      out.notes.tell(owner, fmt::format("with half as many elements {} changes by {:.1g} of its range", half->column, half->share));
    else if (!found && !given && half)
      out.notes.warn(owner, fmt::format("with half as many elements {} changes by {:.2g} of its range, so that its elements may be too few "
                                        "for how it rings; what more of them change was not measured, as that would take several times as "
                                        "long as the run: compare with a run of {}, damp it, or let its loads come gradually",
                                        half->column, half->share, more));
    else if (!found && !given && comparison.too_long())
      out.notes.warn(owner, fmt::format("vibrates so fast that its elements may be too few; what more of them change was not measured, as "
                                        "that would take several times as long as the run: compare with a run of {}",
                                        more));
    else if (!found && !given)
      out.notes.tell(owner, "vibrates so fast that its elements may be too few; what more of them would change could not be told");
    else if (!found)
      out.notes.warn(owner,
                     fmt::format("{}, and the influence of more of them could not be measured: it is not part of the estimated error",
                                 unjudged_words));
    else if (found->share > judged.asked)
      out.notes.warn(owner, fmt::format("with {} {} changes by {:.2g} of its range: {}", more, found->column, found->share,
                                        two ? "take model = \"mixed\" with volumes = 2 and as many elements (one volume is computed with "
                                              "no more than 300 coordinates give)"
                                            : enough_elements(std::get<BeamDef>(scene.bodies[b].kind), found->share, options.asked)));
    else out.notes.tell(owner, fmt::format("with {} {} changes by {:.1g} of its range", more, found->column, found->share));
  }
  return measured;
}

// Beams near the load at which they tip over sideways: beside half their elements, which costs little. The linear twist in elements makes
// that load too large by the square of their length, so that what half of them change is three times what is wrong; somewhat less near the
// load, where the deflection grows faster than the load does.
void check_tipping(const Scene& scene, const std::vector<EffectState>& states, const Histories& base, const ModelCheckOptions& options,
                   SolverStatistics& out) {
  std::vector<size_t> changed;
  if (options.may_tip.empty()) return;
  constexpr double times_wrong = 2.5;
  const auto half = [&](const Scene& s, size_t b) {
    const auto& beam = std::get<BeamDef>(s.bodies[b].kind);
    const bool volumes = beam.model == BeamModel::mixed;
    const int elements = std::max(1, volumes ? beam.elements / 2 : elements_of(beam) / 2);
    const bool fewer = volumes && beam.elements == 1;
    std::optional<Scene> next =
        volumes ? with_volumes(s, states, b, fewer ? std::max(1, beam.volumes / 2) : beam.volumes) : with_elements(s, states, b);
    if (next) std::get<BeamDef>(next->bodies[b].kind).elements = elements;
    return next;
  };
  ModelCheckOptions judged = options;
  judged.asked *= times_wrong;
  Comparison comparison = compared(scene, states, options.may_tip, changed, half, judged);
  const std::optional<OutputChange> found = changed.empty() ? std::nullopt : comparison.measure(base);
  for (const size_t b : options.may_tip) {
    const std::string owner = fmt::format("body '{}'", scene.bodies[b].name);
    const char* near = "is near the load at which it tips over sideways";
    const int elements = elements_of(std::get<BeamDef>(scene.bodies[b].kind));
    if (!found) {
      out.notes.warn(owner,
                     fmt::format("{}, and what more than its {} elements would change could not be measured: take more", near, elements));
      continue;
    }
    const double share = found->share / times_wrong;
    const auto enough = static_cast<int>(std::ceil(elements * std::sqrt(2.0 * share / options.asked)));
    if (share > options.asked)
      out.notes.warn(owner, fmt::format("{}, where its {} elements are too few: about {:.2g} of the range of {}; take {} (of a mixed beam "
                                        "in all volumes together)",
                                        near, elements, share, found->column, enough));
    else
      out.notes.tell(owner,
                     fmt::format("{}: its {} elements are wrong by about {:.1g} of the range of {}", near, elements, share, found->column));
  }
}

}  // namespace

void measure_shear_of_lumps(const Scene& scene, const std::vector<EffectState>& states, const Histories& base,
                            const ModelCheckOptions& options, std::vector<LeftOutWorth>& left_out) {
  for (LeftOutWorth& w : left_out) {
    if (w.effect != "shear" || w.possible || !(w.share > options.asked)) continue;
    Scene elements = scene;
    std::vector<size_t> bodies, changed;
    for (size_t b = 0; b < scene.bodies.size(); ++b) {
      const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
      if (!beam || std::find(w.owners.begin(), w.owners.end(), scene.bodies[b].name) == w.owners.end()) continue;
      std::optional<Scene> next = beam->model == BeamModel::lumped ? with_elements(elements, states, b) : std::nullopt;
      if (!next) {
        bodies.clear();
        break;
      }
      elements = std::move(*next);
      bodies.push_back(b);
    }
    if (bodies.empty()) continue;
    ModelCheckOptions pair = options;
    pair.no_run_of_it = true;
    Comparison comparison = compared(
        elements, states, bodies, changed,
        [&](const Scene& s, size_t b) {
          std::optional<Scene> out = s;
          std::get<BeamDef>(out->bodies[b].kind).effects.names.push_back("shear");
          return out;
        },
        pair);
    if (const std::optional<OutputChange> found = comparison.measure(base)) w.share = found->share, w.column = found->column;
  }
}

std::optional<Scene> with_richer_models(const Scene& scene, const std::vector<EffectState>& states, const std::vector<LinearLimit>& limits,
                                        const Histories& base, const ModelCheckOptions& options) {
  Scene out = scene;
  bool any = false;
  // The richer model of a beam, `telling` of it where it is measured. unmeasured: whether a beam is to be changed where no comparison came
  // to an end.
  const auto take = [&](const std::vector<size_t>& bodies, const auto& enrich, const auto& telling, const auto& unmeasured) {
    std::vector<size_t> changed;
    if (bodies.empty()) return;
    const auto kept = [](const Scene& s, std::optional<Scene> next) {
      return next && next->outputs.size() == s.outputs.size() ? next : std::nullopt;
    };
    Comparison comparison = compared(
        scene, states, bodies, changed, [&](const Scene& s, size_t b) { return kept(s, telling(s, b)); }, options);
    const std::optional<OutputChange> found = changed.empty() ? std::nullopt : comparison.measure(base);
    if (found && found->share <= options.asked) return;
    for (const size_t b : changed)
      if (!found && !unmeasured(b)) continue;
      else if (std::optional<Scene> next = kept(out, enrich(out, b))) out = std::move(*next), any = true;
  };
  std::vector<size_t> forms, bent;
  for (size_t b = 0; b < scene.bodies.size(); ++b)
    if (const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind); beam && has_forms_of_ends(*beam)) forms.push_back(b);
  for (const LinearLimit& l : limits)
    if (l.pieces == 1 && l.counts() > options.surely_small * options.asked) bent.push_back(static_cast<size_t>(l.body));
  const auto elements = [&](const Scene& s, size_t b) { return with_elements(s, states, b); };
  // As many modes as the forms are, with the shapes that the joints and loads make, tell whether these fit (blade: 18 coordinates for 70).
  const auto modes = [&](const Scene& s, size_t b) {
    std::optional<Scene> next = with_elements(s, states, b);
    if (!next) return next;
    auto& beam = std::get<BeamDef>(next->bodies[b].kind);
    beam.keep_modes = elements_of(beam) / 2;
    beam.keep_axial = beam.keep_torsion = 2;
    return next;
  };
  take(forms, elements, modes, [](size_t) { return false; });
  const auto surely_bent = [&](size_t b) {
    return std::any_of(limits.begin(), limits.end(),
                       [&](const LinearLimit& l) { return l.body == static_cast<int>(b) && l.counts() > 2.0 * options.asked; });
  };
  // A beam in forms that do not fit says nothing of volumes.
  if (any) std::erase_if(bent, [&](size_t b) { return std::find(forms.begin(), forms.end(), b) != forms.end(); });
  const auto volumes = [&](const Scene& s, size_t b) { return with_volumes(s, states, b, richer(1)); };
  take(bent, volumes, volumes, surely_bent);
  if (any) return out;
  return std::nullopt;
}

bool any_to_check(const Scene& scene, const std::vector<LinearLimit>& limits, const ModelCheckOptions& options) {
  const auto of_forms = [](const BodyDef& body) {
    const auto* beam = std::get_if<BeamDef>(&body.kind);
    return beam && has_forms_of_ends(*beam);
  };
  return !options.unjudged.empty() || !options.between_samples.empty() || !options.ringing.empty() || !options.coarse.empty() ||
         !options.may_tip.empty() || std::any_of(scene.bodies.begin(), scene.bodies.end(), of_forms) ||
         std::any_of(limits.begin(), limits.end(), [&](const LinearLimit& l) { return l.counts() > options.surely_small * options.asked; });
}

ModelWorth check_models(const Scene& scene, const std::vector<EffectState>& states, const std::vector<LinearLimit>& limits,
                        const Histories& base, const ModelCheckOptions& options, SolverStatistics& out) {
  ModelCheckOptions left = options;
  const double until = work_seconds() + options.budget;
  const auto spend = [&] { left.budget = std::max(0.0, until - work_seconds()); };
  ModelWorth worth;
  check_forms(scene, states, base, left, out);
  spend();
  worth.measured = check_elements(scene, states, base, left, out);
  spend();
  check_tipping(scene, states, base, left, out);
  spend();
  worth.bending = check_bending(scene, states, limits, base, left, out);
  return worth;
}

}  // namespace flexframe::sim
