#include "sim/run/run_scene.h"

#include "sim/results/recorder.h"
#include "sim/results/sampling.h"
#include "sim/run/across_plane.h"
#include "sim/run/coarse_beams.h"
#include "sim/run/complete_inertia.h"
#include "sim/run/effect_report.h"
#include "sim/run/expected_turn.h"
#include "sim/run/few_modes.h"
#include "sim/run/held_in_passing.h"
#include "sim/run/held_warping.h"
#include "sim/run/integrate_run.h"
#include "sim/run/judged_run.h"
#include "sim/run/left_out.h"
#include "sim/run/left_ranges.h"
#include "sim/run/lost_loops.h"
#include "sim/run/method_choice.h"
#include "sim/run/missing_stiffening.h"
#include "sim/run/missing_works.h"
#include "sim/run/model_check.h"
#include "sim/run/open_reactions.h"
#include "sim/run/passes.h"
#include "sim/run/pressed_beams.h"
#include "sim/run/ringing_beams.h"
#include "sim/run/second_run.h"
#include "sim/run/start_forces.h"
#include "sim/run/stop_springs.h"
#include "sim/run/time_error.h"
#include "sim/run/work_budget.h"
#include "sim/run/zero_displacements.h"
#include "sim/start/make_system.h"
#include "sim/start/statics.h"
#include "sim/time/sample_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

namespace flexframe::sim {
namespace {

// Enough samples to see the largest difference of two histories; a full set costs as much as a loose run.
constexpr int estimate_samples = 400;

// A scene with effects that a run turned out to need.
struct Called {
  Scene scene;
  Notes notes;
  double asked = unasked_accuracy;
  bool more = false;
  std::vector<std::string> lengthened = {};  // beams that lengthen since the motion ended without that, as `lost` says
  std::string lost = {};
  // Of the deflection, what bending in a body's own frame may lack before it is followed further: all that is tolerated, or of an accuracy
  // that is asked for a share which leaves room for the errors of time and space, as following it costs twice as much.
  double tolerated_bending() const { return asked == unasked_accuracy ? asked : 0.3 * asked; }
};

// What the motion calls for.
bool calls(const std::vector<LeftOutWorth>& left_out, const std::vector<LinearLimit>& limits, Called& called) {
  const bool effects = call_for(left_out, called.asked, called.scene, called.notes);
  return call_large_bending(limits, called.tolerated_bending(), called.scene, called.notes) || effects;
}

// What a motion that ended calls for; false: nothing would let it go on.
bool calls(const LoopsLost& lost, Called& called) {
  if (!called.lengthened.empty()) return false;
  called.lengthened = let_lengthen_in_passing(lost.what(), called.scene, called.notes);
  called.lost = lost.what();
  return !called.lengthened.empty();
}

// once(): a run. Throws what ended the motion where nothing lets it go on, or nothing but beams pulled apart.
template <class Run>
auto within_reach(const Called& called, Run&& once) {
  const bool lengthens = !called.lengthened.empty();
  try {
    return once();
  } catch (const BeyondReach&) {
    throw SimulationError(called.lost);
  } catch (const SimulationError&) {
    if (lengthens) throw SimulationError(called.lost);
    throw;
  }
}

// Effects that the program leaves out are judged in every run, those that the scene leaves out where errors of outputs are estimated.
bool judges_effects(const Scene& scene, const SimulateOptions& options) {
  if (!options.check_effects) return false;
  return (options.estimate_error && !scene.outputs.empty()) || std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& b) {
           const auto* beam = std::get_if<BeamDef>(&b.kind);
           return beam && beam->effects.automatic;
         });
}

// What is known from a run beside its results.
struct Alone {
  std::optional<System> start;          // of the scene, for the second run
  std::vector<std::string> lengthened;  // Called::lengthened
  std::vector<double> shares;           // of the weights (ErrorWeights), of the last pass
  std::vector<EffectState> effects;
  std::vector<LinearLimit> limits;
  std::vector<int> unstiffened;          // without_second_order
  std::vector<LeftOutWorth> left_out;    // deformations
  std::vector<LeftOutWorth> to_measure;  // stiffening and gyroscopic terms and what shifts events, which a pair of runs tells better
  bool blows_unseen = false;             // something struck, and at no look anything was touched
};

bool is_deformation(const LeftOutWorth& w) { return !is_of_second_order(w.effect); }

// Where forces are read, what gives way inside shifts them from one support to another: a pair of runs tells that, also at rest.
bool shifts_forces(const LeftOutWorth& w, double asked) { return w.possible && w.inside > 0.5 * asked && w.share < asked; }

// Estimates of what elements are worth (coarse_beams.h) are lower than the truth by no more than that, as a rule.
constexpr double sure_of_coarse = 0.8;
// Runs with other numbers of elements tell from here on: of what is held at both ends the formulas tell 0.6 of what is true.
constexpr double told_from_coarse = 0.5;

// What runs beside a run say of its error of time.
struct RunsBeside {
  std::optional<Histories> looser;
  Difference difference;  // of the looser one
  bool tried = false;     // the looser one was made, or failed
};

// Of a run beside one: the same weights, fewer samples, nothing said.
SimulateOptions of_second_run(const SimulateOptions& options, const std::vector<double>& shares) {
  SimulateOptions other = options;
  other.weight_shares = shares;
  other.progress = {};
  other.tell = {};
  other.samples = estimate_samples;
  return other;
}

// The outputs of a run ten times looser; none where it fails, which is a warning where the error of time was to come from it.
std::optional<Histories> looser_run(const Scene& scene, const SimulateOptions& options, const Alone& alone, bool needed,
                                    SolverStatistics& run) {
  SimulateOptions other = of_second_run(options, alone.shares);
  other.tolerance = std::min(10.0 * run.tolerance, 0.1);
  try {
    return simulate_histories_from(*alone.start, scene, other);
  } catch (const SimulationError& error) {
    if (needed)
      run.notes.warn("", fmt::format("the error of the time integration is not estimated: the comparison run at a larger tolerance "
                                     "failed ({})",
                                     error.what()));
    return {};
  }
}

// Runs the scene once more, and says what the error of time is: ten times tighter where that costs little, ten times looser where it does
// not.
RunsBeside estimate_time(const Scene& scene, const SimulateOptions& options, const Alone& alone, const Histories& reference,
                         Results& results) {
  const std::optional<Histories> tighter = tighter_run(*alone.start, scene, of_second_run(options, alone.shares), results);
  SolverStatistics& run = results.statistics;
  RunsBeside out;
  if (!tighter || is_loose(run)) out.looser = looser_run(scene, options, alone, !tighter, run);
  out.tried = !tighter || is_loose(run);
  if (tighter) out.difference = estimate_by_tighter(*tighter, out.looser ? &*out.looser : nullptr, reference, run);
  else if (out.looser) out.difference = estimate_time_error(*out.looser, reference, run);
  return out;
}

// The run itself, made again where its motion is far below the sizes that its errors were weighed against. judge: what beams go without is
// looked at.
Results simulate_at(std::optional<double> tolerance, const Scene& scene, const SimulateOptions& options, bool judge, Alone& alone,
                    int& indefinite) {
  return with_narrowed_weights(alone.shares, [&](const std::vector<double>& shares, std::vector<double>& wanted) {
    System system = alone.start ? copy_start(*alone.start) : make_system(scene);
    if (options.estimate_error && !alone.start) alone.start = copy_start(system);
    if (tolerance) system.tolerance = *tolerance;
    system.weights.shares = shares;
    if (options.tell)
      for (const std::string& sentence : expected_turns(system, unasked_accuracy).texts(Severity::note)) options.tell(sentence);
    alone.effects = effect_states(scene, system.model);
    const std::vector<double> times = sample_times(scene.simulation);
    Recorder recorder(system, times);
    LeftRanges ranges(system);
    OpenReactions open(system);
    std::optional<LeftOut> left_out;
    if (judge) left_out.emplace(system, system.model.effects, options.pictures || scene.outputs.empty());
    std::vector<size_t> looks;
    if (left_out && !left_out->empty()) looks = left_out->looks(system, times);
    const bool strikes =
        !system.model.contacts.empty() || std::any_of(scene.joints.begin(), scene.joints.end(), [](const JointDef& j) { return j.stop; });
    bool touched = false;
    size_t sample = 0, next = 0, recorded = 0;
    PulledBeams pulled(system, times.size());
    const LengthenedBeams lengthened(system, alone.lengthened);
    RunSpan span = whole_run(scene.simulation, times);
    const SolverStatistics statistics = integrate(
        system, options.method.value_or(scene.simulation.method), span, {options.progress, steps_allowed(scene, options), options.tell},
        [&](System& s, double t, const VecX& y) {
          recorder.record(s, t, y);
          require_sample_closed(s, recorder.in_plane());
          lengthened.look(s);
          ranges.look(s, t);
          const bool reactions = open.wants(recorded, times.size()), judged = next < looks.size() && looks[next] == sample++,
                     pulls = pulled.wants(recorded);
          if (recorder.in_plane() && (reactions || judged || pulls)) set_state(s, t, y.data(), false);
          if (reactions) open.look(s);
          if (pulls) pulled.look(s, t, y, recorded);
          ++recorded;
          if (judged) left_out->look(s, t, y), ++next;
          if (judged && strikes) touched = touched || !find_touched(s, t, y).empty();
        },
        indefinite);
    alone.shares = system.weights.shares;
    alone.blows_unseen = strikes && statistics.events > 0 && !touched;
    wanted = system.weights.narrowed(system);
    Results results = recorder.finish(system);
    results.statistics = statistics;
    results.statistics.notes = system.notes;
    ranges.warn(results.statistics.notes);
    open.warn(results.statistics.notes);
    alone.left_out.clear();
    alone.to_measure.clear();
    if (left_out)
      for (LeftOutWorth& w : left_out->worth(results, wants_statics(scene)))
        if (!scene.outputs.empty() || w.share > 0.0) (is_deformation(w) ? alone.left_out : alone.to_measure).push_back(std::move(w));
    alone.limits = linear_limits(scene, system.model, results);
    pulled.count(scene, results, wants_statics(scene), alone.limits);
    if (std::any_of(results.outputs.begin(), results.outputs.end(), [](const ResultOutput& o) { return o.size > 0.0; }))
      for (const double seen = outputs_over_sizes(to_histories(results)); LinearLimit & l : alone.limits) l.seen = seen;
    alone.unstiffened = without_second_order(system.model, scene);
    return results;
  });
}

// options: the method becomes the one by which the run was made where another did not follow the loops.
Results simulate_alone(const Scene& scene, SimulateOptions& options, bool judge, Alone& alone, int& indefinite) {
  return with_kept_loops(options.tolerance, [&](std::optional<double> tolerance, bool stepping) {
    indefinite = -1;
    if (stepping) options.method = Method::dirk;
    return simulate_at(tolerance, scene, options, judge, alone, indefinite);
  });
}

// What rotary inertia does to a mechanism that turns with its beams is estimated by its share of the inertia, several times too much or, of
// what tumbles, too little.
bool may_turn(const LeftOutWorth& w) { return w.possible && w.turning > 3e-3; }

// Where blows, reversals of friction and the like lie shifts with what is left out, and what follows with them: a deformation that is worth
// more than this along the motion as it is may be worth a multiple. Blows between two looks strain the beams unseen (a rod dropped on a
// stop seven times as stiff, 1.9 % off: no influence of its stretching told). Of eigenforms, whose strains may say nothing of the beam
// (forget_misfits), it is measured however large it seems.
constexpr double may_shift_events = 5e-4;

bool of_eigenforms(const Scene& scene, const LeftOutWorth& w) {
  return std::all_of(scene.bodies.begin(), scene.bodies.end(), [&](const BodyDef& body) {
    const auto* beam = std::get_if<BeamDef>(&body.kind);
    return std::find(w.owners.begin(), w.owners.end(), body.name) == w.owners.end() || (beam && beam->model == BeamModel::modal);
  });
}

void measure_what_shifts(const Scene& scene, const SolverStatistics& run, double asked, Alone& alone) {
  const auto shifts = [&](const LeftOutWorth& w) {
    return (run.events > 0 && w.possible && (alone.blows_unseen || w.share > may_shift_events || w.blow > may_shift_events) &&
            (w.share < asked || of_eigenforms(scene, w))) ||
           shifts_forces(w, asked) || may_turn(w);
  };
  std::copy_if(alone.left_out.begin(), alone.left_out.end(), std::back_inserter(alone.to_measure), shifts);
  std::erase_if(alone.left_out, shifts);
}

// What shifts events or forces and was not measured, as that would have taken too long or failed.
// hidden: as the error of time, which is warned of, would hide it.
void warn_of_unmeasured(std::vector<LeftOutWorth>& worth, long events, bool blows_unseen, bool hidden, Notes& notes) {
  for (const LeftOutWorth& w : worth) {
    if (!is_deformation(w) || may_turn(w)) continue;
    if (blows_unseen) {
      notes.warn("", fmt::format("{} of '{}' is left out, and bodies strike between the samples, so that its influence is not known; add "
                                 "\"{}\" to 'effects', or measure it with flexframe effects",
                                 w.effect, fmt::join(w.owners, "', '"), w.effect));
      continue;
    }
    if (hidden && w.share <= unasked_accuracy)
      notes.tell("", fmt::format("{} of '{}' left out: {:.1g} of the range of {} along this motion; what it shifts beyond that was not "
                                 "measured, as the error of the time integration would hide it",
                                 w.effect, fmt::join(w.owners, "', '"), w.share, w.column.empty() ? "the outputs" : w.column));
    else if (events > 0 && w.blow > unasked_accuracy && w.share <= may_shift_events)
      notes.warn("", fmt::format("{} of '{}' is left out: where bodies strike it would take up about {:.1g} of the blow, and what that "
                                 "changes was not measured; add \"{}\" to 'effects', or measure it with flexframe effects",
                                 w.effect, fmt::join(w.owners, "', '"), w.blow, w.effect));
    else if (events > 0 && w.share > may_shift_events)
      notes.warn("", fmt::format("{} of '{}' is left out: its influence along this motion is {:.1g} of the range of {}, but it also shifts "
                                 "when friction reverses or bodies touch, and its influence may be several times that; add \"{}\" to "
                                 "'effects', or measure it with flexframe effects",
                                 w.effect, fmt::join(w.owners, "', '"), w.share, w.column, w.effect));
    else
      notes.tell("", fmt::format("{} of '{}' left out: {:.1g} of the range of {}; forces within the mechanism may change by about {:.1g}, "
                                 "which was not measured beside this run; flexframe effects measures it",
                                 w.effect, fmt::join(w.owners, "', '"), w.share, w.column.empty() ? "the outputs" : w.column, w.inside));
  }
  std::erase_if(worth, [](const LeftOutWorth& w) { return is_deformation(w) && !may_turn(w); });
}

// Strains along the motion of eigenforms that do not fit say nothing of the beam.
void forget_misfits(const Notes& notes, std::vector<LeftOutWorth>& worth) {
  const auto misfit = [&](const std::string& body) {
    return std::any_of(notes.all().begin(), notes.all().end(), [&](const Note& n) {
      return n.severity == Severity::warning && n.owner == fmt::format("body '{}'", body) && n.text.starts_with(misfit_words);
    });
  };
  std::erase_if(worth, [&](const LeftOutWorth& w) { return std::all_of(w.owners.begin(), w.owners.end(), misfit); });
}

// A run of which nothing is said yet but its error of time, if that: the rest is worth its price only where it is not made again.
struct Unjudged {
  Scene scene;  // as it was simulated
  SimulateOptions options;
  Results results;
  Alone alone;
  Histories reference;  // of the run
  RunsBeside beside;
  Notes& notes() { return results.statistics.notes; }
};

// called: what beams with automatic effects turn out to need; then nothing more is done with the run. judge: what they go without is looked
// at.
Unjudged simulate_once(const Scene& scene, const SimulateOptions& options, bool judge, Called* called, int& indefinite) {
  Unjudged out;
  out.options = options;
  if (called) out.alone.lengthened = called->lengthened;
  out.alone.shares = options.weight_shares;
  try {
    out.results = simulate_alone(scene, out.options, judge && judges_effects(scene, options), out.alone, indefinite);
  } catch (const LoopsLost& lost) {
    if (!called || !options.check_effects || !calls(lost, *called)) throw;
    called->more = true;
    return out;
  }
  if (called && calls(out.alone.left_out, out.alone.limits, *called)) {
    called->more = true;
    return out;
  }
  out.scene = scene;
  return out;
}

void estimate_time(Unjudged& run) {
  if (!run.options.estimate_error || run.results.outputs.empty()) return;
  run.reference = to_histories(run.results);
  run.beside = estimate_time(run.scene, run.options, run.alone, run.reference, run.results);
}

// Whether pairs of runs tell anything of effects that are left out: not where the error of time, which is warned of, hides what is less
// than several times what counts, as the same will be asked of the tighter run that the warning advises.
bool resolves(const Unjudged& run, const NeglectOptions& check) {
  constexpr double hidden = 5.0 * unasked_accuracy;
  const double told_from = run.beside.looser ? 2.0 * run.beside.difference.largest : 3.0 * check.run_error;
  return check.run_error <= unasked_accuracy || told_from <= hidden;
}

struct Measured {
  bool models = false;                // what they cannot show
  bool hidden = false;                // effects were not, as the error of time hides them
  std::vector<size_t> elements = {};  // beams of whose number of them other numbers have told
};

// What is of second order and left out, and what the models cannot show, beside looser runs, which are made only where there is such.
// coarse: beams that closed formulas call so.
Measured measure(Unjudged& run, bool judge_models, const std::vector<size_t>& coarse) {
  const SimulateOptions& options = run.options;
  Results& results = run.results;
  Alone& alone = run.alone;
  if (!options.estimate_error || results.outputs.empty() || !options.check_effects) return {};
  NeglectOptions check;
  check.method = options.method;
  check.run = &run.reference;
  check.run_tolerance = results.statistics.tolerance;
  check.run_error = std::max(0.0, results.statistics.error_estimate);
  check.told = &alone.to_measure;
  for (const ResultBody& body : results.bodies)
    if (body.displacement.size() > 0) check.deflection = std::max(check.deflection, body.displacement.cwiseAbs().maxCoeff());
  for (const LeftOutWorth& w : alone.to_measure) check.further.push_back(w.effect);
  // Also where no output moves: another model's may.
  ModelCheckOptions richer{unasked_accuracy, model_check_budget(results.statistics.work), check};
  if (judge_models) {
    richer.may_tip = beams_that_may_tip(run.scene, alone.effects, results);
    richer.between_samples =
        beams_between_samples(run.scene, alone.start->model, alone.effects, results, sure_of_coarse * unasked_accuracy);
    richer.ringing = beams_that_ring(run.scene, alone.effects, run.reference, unasked_accuracy);
    richer.coarse = coarse;
  }
  const bool models = judge_models && any_to_check(run.scene, alone.limits, richer);
  const bool resolved = resolves(run, check);
  const size_t effects = resolved ? neglected(alone.effects, check).size() : 0;
  // A single effect is measured beside the run itself: that is no dearer than two looser runs, and tells more.
  const bool beside_run = effects == 1 && !models && !run.beside.tried;
  if ((models || effects > 0) && !beside_run && !run.beside.tried) {
    run.beside.looser = looser_run(run.scene, options, alone, false, results.statistics);
    if (run.beside.looser) run.beside.difference = compare_histories(*run.beside.looser, run.reference, output_ranges(run.reference));
  }
  const bool paired = run.beside.looser.has_value();
  check.tolerance = paired ? run.beside.looser->statistics.tolerance : check.run_tolerance;
  check.floor = paired ? run.beside.difference.largest : 1.5 * check.run_error;
  std::vector<size_t> elements;
  if (models && paired) {
    richer.run = check;
    elements = check_models(run.scene, alone.effects, alone.limits, *run.beside.looser, richer, results.statistics).measured;
  }
  if (judge_models) {
    ModelCheckOptions lumps = richer;
    lumps.run = check;
    lumps.asked = told_of_left_out * unasked_accuracy;
    measure_shear_of_lumps(run.scene, alone.effects, paired ? *run.beside.looser : run.reference, lumps, alone.left_out);
  }
  // A second run of the same length is made of short ones only, else one beside the looser run.
  const bool beside_itself = results.statistics.work <= least_check || !paired;
  const ComparedRun itself{run.reference, check.run_tolerance, 0, check.run_error, check.deflection};
  if (judge_models)
    warn_of_few_modes(
        run.scene, options,
        beside_itself ? itself : ComparedRun{*run.beside.looser, check.tolerance, estimate_samples, check.floor, check.deflection},
        unasked_accuracy, results.statistics);
  if (judge_models) {
    // Bodies whose last modes are heavier take up to three times as long: their masses couple.
    const double work = results.statistics.work, price = work <= 4.0 * least_check ? 4.0 : check_price;
    warn_of_last_modes(*alone.start, run.scene, options, run.reference, unasked_accuracy, std::max(2.0 * least_check, price * work),
                       results);
  }
  const bool forces = std::any_of(alone.to_measure.begin(), alone.to_measure.end(),
                                  [](const LeftOutWorth& w) { return shifts_forces(w, unasked_accuracy); });
  if (effects > 0 && (paired || beside_run) && (forces || output_ranges(run.reference).maxCoeff() > 0.0)) {
    // What shifts events is not known without its run.
    const bool shifting = std::any_of(alone.to_measure.begin(), alone.to_measure.end(), is_deformation);
    check.budget = std::max(check_price * results.statistics.work, shifting ? 2.0 * least_check : least_check);
    report_neglected(run.scene, alone.effects, paired ? *run.beside.looser : run.reference, check, unasked_accuracy, results.statistics);
  }
  return {models && paired, !resolved, elements};
}

// Says of a run what its model lacks. check: only how far the bodies were bent is wanted, of which nothing is said.
void judge(Unjudged& run, bool check) {
  const SimulateOptions& options = run.options;
  Alone& alone = run.alone;
  SolverStatistics& s = run.results.statistics;
  if (options.estimate_error) measure_what_shifts(run.scene, s, unasked_accuracy, alone);
  const std::vector<CoarseBeam> coarse = coarse_beams(run.scene, alone.effects, run.results);
  const Measured measured = measure(run, !check, coarse_bodies(coarse, run.scene, told_from_coarse * unasked_accuracy));
  forget_misfits(s.notes, alone.left_out);
  report_left_out(run.scene, alone.left_out, unasked_accuracy, s);
  warn_of_unmeasured(alone.to_measure, s.events, alone.blows_unseen, measured.hidden, s.notes);
  report_left_out(run.scene, alone.to_measure, unasked_accuracy, s);
  warn_of_coarse_beams(unmeasured_beams(coarse, run.scene, measured.elements), sure_of_coarse * unasked_accuracy, s.notes);
  tell_of_bare_spans(run.scene, alone.effects, run.results, options.pictures || run.scene.outputs.empty(), unasked_accuracy, s.notes);
  warn_of_held_warping(run.scene, alone.effects, run.results, unasked_accuracy, s.notes);
  warn_of_tipping(run.scene, alone.effects, run.results, s.notes);
  if (!check && options.estimate_error && options.check_effects)
    warn_of_start_forces(run.scene, alone.effects, run.reference, unasked_accuracy, s.notes);
  warn_of_missing_stiffening(run.scene, alone.unstiffened, run.results, unasked_accuracy, s.notes);
  if (check) return;
  if (judges_effects(run.scene, options)) warn_of_leaving_plane(run.scene, alone.effects, s.notes);
  if (!measured.models) warn_of_linear_limits(run.scene, alone.limits, unasked_accuracy, s.notes);
}

// Each time at least one effect of a beam is added; three times are more than any scene has needed.
constexpr int most_calls = 3;

// The run, made again with what its beams with automatic effects turn out to need, its error of time not estimated. `called` is the scene
// as it was simulated.
Unjudged simulate_as_called(const SimulateOptions& options, Called& called) {
  for (int round = 0;; ++round) {
    called.more = false;
    const Scene now = called.scene;
    Unjudged run = within_reach(called, [&] {
      return with_complete_inertia(now, [&](const Scene& s, int& indefinite) {
        return simulate_once(s, options, true, round < most_calls ? &called : nullptr, indefinite);
      });
    });
    if (called.more) continue;
    run.notes().prepend(called.notes);
    return run;
  }
}

// A run for which nobody chose a tolerance and whose estimated error is too large is made again with the tolerance that the warning
// advises, as long as that costs little (price_at), and somewhat more where an output is so far off that it is worth nothing: then a decade
// or more on the way to it is better than nothing too. What turns out to need twice the steps, or far more work, is given up.
constexpr double cheap_repetition = 2e6;
constexpr double worth_nothing = 0.1;
constexpr double repetition_then = 1e7;
constexpr int most_repetitions = 2;

bool chosen_tolerance(const Scene& scene, const SimulateOptions& options) { return scene.simulation.tolerance || options.tolerance; }

std::optional<double> better_tolerance(const Scene& scene, const SimulateOptions& options, const Results& results) {
  const SolverStatistics& run = results.statistics;
  // The other half is for what the model leaves out. From a looser run twice the error is told as a rule.
  const double enough = is_looked_at_tighter(results) ? 0.5 * unasked_accuracy : unasked_accuracy;
  if (chosen_tolerance(scene, options) || !options.estimate_error || !(run.error_estimate > enough)) return {};
  const double tolerance = advised_tolerance(run.tolerance, run.error_estimate);
  const bool worthless = run.error_estimate > worth_nothing;
  if (price_at(results, tolerance) <= (worthless ? repetition_then : cheap_repetition)) return tolerance;
  for (double nearer = 10.0 * tolerance; worthless && nearer < 0.11 * run.tolerance; nearer *= 10.0)
    if (price_at(results, nearer) <= repetition_then) return nearer;
  return {};
}

// Whether a tighter run shows that the one before was so many times its estimate off: two runs that step over a vibration agree in what
// they lack.
bool told_too_little(const Results& before, const Results& tighter, double times) {
  const Histories now = to_histories(tighter);
  return compare_histories(to_histories(before), now, output_ranges(now)).largest > times * before.statistics.error_estimate;
}

// The run at that tolerance by the method that it ended with, whose price is known; the backward differences of low order are good at loose
// tolerances only. None where it fails or promises no more.
std::optional<Unjudged> repeated(const Results& first, const SimulateOptions& options, double tolerance, Called& called) {
  const SolverStatistics& before = first.statistics;
  SimulateOptions tight = options;
  tight.tolerance = tolerance;
  const auto method = std::find(method_words().begin(), method_words().end(), before.method);
  if (method != method_words().end() && before.method != method_name(Method::bdf))
    tight.method = static_cast<Method>(method - method_words().begin());
  const double growth = growth_of_steps(before.method, before.tolerance, tolerance);
  const double steps = 2.0 * growth * static_cast<double>(before.steps) + 1000.0;
  tight.max_steps = std::min(steps, steps_allowed(called.scene, options));
  const double work = 0.5 + std::max(2e-6 * price_at(first, tolerance), growth * before.work);
  // Not by its pace: what dies away, or another method, makes the rest of it faster.
  tight.progress = give_up_after(work, options.progress);
  try {
    Unjudged again = simulate_as_called(tight, called);
    again.options.progress = options.progress;
    estimate_time(again);
    const bool better = again.results.statistics.error_estimate < before.error_estimate || told_too_little(first, again.results, 1.0);
    return better ? std::optional(std::move(again)) : std::nullopt;
  } catch (const SimulationError&) {
    return {};
  } catch (const BudgetSpent&) {
    return {};
  }
}

// Steps over vibrations leave out what these do to forces and accelerations, and tighter ones leave out hardly less. Where nobody chose a
// tolerance or a method, and that is too much, vibrations are followed, though a step then costs more than "auto" spends by itself. It has
// to bring more than two estimates, each of which holds within a factor, may be apart.
constexpr double much_less = 0.3;

// Where an output is so far off that it is worth nothing it may take this many times the run, and CPU s. (Spatial loop of elastic links
// that is let go: steps over vibrations 0.23 of a reaction off at 1e-6 after 0.7 CPU s, 0.06 at 1e-8 after 7; followed 2e-3 after 0.5.)
constexpr double longer_then = 5.0, longest_then = 4.0;

// none: they may not be followed, or that brings no more, takes longer than a check beside the run, or fails.
std::optional<Unjudged> followed(const Scene& scene, const SimulateOptions& options, const Unjudged& run, Called& called) {
  const SolverStatistics& before = run.results.statistics;
  const bool chosen = chosen_tolerance(scene, options) || options.method.value_or(scene.simulation.method) != Method::automatic;
  if (chosen || before.method != method_name(Method::dirk) || !(before.error_estimate > unasked_accuracy) || !run.alone.start ||
      !may_follow(*run.alone.start))
    return {};
  SimulateOptions other = options;
  other.method = Method::exponential;
  const double then = before.error_estimate > worth_nothing ? std::min(longer_then * before.work, longest_then) : 0.0;
  other.progress =
      give_up_when_late(std::max({2.0 * least_check, check_price * before.work, then}), scene.simulation.duration, options.progress);
  const Called kept = called;
  try {
    Unjudged again = simulate_as_called(other, called);
    again.options.progress = options.progress;
    estimate_time(again);
    const SolverStatistics& now = again.results.statistics;
    if (now.method == method_name(Method::exponential) && now.error_estimate >= 0.0 &&
        now.error_estimate < much_less * before.error_estimate) {
      again.notes().tell("", fmt::format("method exponential taken: with steps over the vibrations the estimated error of the time "
                                         "integration was {:.2g} of the range of {}",
                                         before.error_estimate, before.error_column));
      return again;
    }
  } catch (const SimulationError&) {
    // What cannot be followed is stepped over.
  } catch (const BudgetSpent&) {
    // So is what takes too long.
  }
  called = kept;
  return {};
}

// What elastic bodies do in so few implicit steps is looked at once more, with steps for a tenth of the tolerance: it costs milliseconds,
// and an estimate from a looser run, which takes fewer still, is worth little. Where that tells far more than the estimate, the tighter run
// takes the place of one whose tolerance nobody chose; else its difference is the estimate. At a loose tolerance that is so of every method
// and body: steps are then as long as drives and samples let them be, in both runs alike. (Where the estimate comes from a tighter run
// there is nothing more to see.)
constexpr long few_steps = 100;
constexpr double estimates_hold_to = 5.0;  // tests/trust/estimates.py

void check_few_steps(const Scene& scene, const SimulateOptions& once, Unjudged& unjudged, Called& called) {
  const Results& results = unjudged.results;
  SolverStatistics& run = unjudged.results.statistics;
  const bool elastic = std::any_of(results.bodies.begin(), results.bodies.end(), [](const ResultBody& b) { return b.q.cols() > 0; });
  const bool implicit = elastic && run.method == method_name(Method::dirk) && run.steps <= few_steps;
  const auto method = std::find(method_words().begin(), method_words().end(), run.method);
  if (!(run.error_estimate >= 0.0) || !(implicit || is_loose(run)) || method == method_words().end() || is_looked_at_tighter(results))
    return;
  SimulateOptions tight = once;
  tight.tolerance = std::max(1e-12, 0.1 * run.tolerance);
  tight.method = static_cast<Method>(method - method_words().begin());
  tight.max_steps = std::min(10.0 * static_cast<double>(std::max(run.steps, few_steps)), steps_allowed(called.scene, once));
  try {
    Unjudged again = simulate_as_called(tight, called);
    if (!told_too_little(results, again.results, estimates_hold_to)) return;
    if (!chosen_tolerance(scene, once)) {
      unjudged = std::move(again);
      estimate_time(unjudged);
      return;
    }
    const Histories now = to_histories(again.results);
    const Difference off = compare_histories(to_histories(results), now, output_ranges(now));
    run.error_estimate = off.largest;
    run.error_column = now.columns[static_cast<size_t>(off.column)];
    if (off.largest > unasked_accuracy)
      run.notes.warn("", fmt::format("the estimated error of the time integration is {:.2g} of the range of {}: take tolerance = {:.0e}",
                                     off.largest, run.error_column, advised_tolerance(run.tolerance, off.largest)));
  } catch (const SimulationError&) {
    // What cannot be followed more closely shows nothing.
  }
}

}  // namespace

Results run_scene(const Scene& scene, const SimulateOptions& options) {
  Called called{scene, {}, unasked_accuracy, false};
  SimulateOptions once = options;
  // A run that is made anew says nothing twice.
  std::set<std::string> said;
  if (options.tell)
    once.tell = [&](const std::string& sentence) {
      if (said.insert(sentence).second) options.tell(sentence);
    };
  Unjudged run = simulate_as_called(once, called);
  estimate_time(run);
  const SolverStatistics first = run.results.statistics;
  check_few_steps(scene, once, run, called);
  if (std::optional<Unjudged> again = followed(scene, once, run, called)) run = std::move(*again);
  for (int round = 0; round < most_repetitions; ++round) {
    const std::optional<double> tolerance = better_tolerance(scene, options, run.results);
    std::optional<Unjudged> again = tolerance ? repeated(run.results, once, *tolerance, called) : std::nullopt;
    if (!again) break;
    run = std::move(*again);
  }
  judge(run, false);
  add_missing_works(run.scene, run.options, run.alone.shares, run.results);
  Results results = std::move(run.results);
  if (results.statistics.tolerance < first.tolerance)
    results.statistics.notes.tell(
        "", fmt::format("tolerance {:.0e} taken: with the default one the estimated error of the time integration was {:.2g} of the range "
                        "of {}",
                        results.statistics.tolerance, first.error_estimate, first.error_column));
  tell_of_energies(results, false);
  tell_of_zero_displacements(scene, results);
  if (const auto fast = faster_than_samples(results)) results.statistics.notes.tell(fast->owner, fast_motion_text(*fast));
  return results;
}

Scene with_called_effects(const Scene& scene, const SimulateOptions& options, double asked) {
  SimulateOptions plain = options;
  plain.estimate_error = false;
  plain.check_effects = true;
  Called called{scene, {}, asked, false};
  try {
    if (judges_effects(scene, plain)) simulate_as_called(plain, called);
  } catch (const SimulationError&) {
    // What cannot be simulated as it stands shows nothing.
  }
  return called.scene;
}

namespace {

// Effects that `called` lists and `before` does not are on.
void switch_on(const Scene& before, const Scene& called, std::vector<EffectState>& effects) {
  const auto names = [](const Scene& scene, size_t b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    return beam ? beam->effects.names : std::vector<std::string>{};
  };
  for (size_t b = 0; b < called.bodies.size(); ++b) {
    const std::vector<std::string> had = names(before, b), has = names(called, b);
    for (EffectState& s : effects)
      if (s.owner == called.bodies[b].name && std::find(has.begin(), has.end(), s.effect) != has.end() &&
          std::find(had.begin(), had.end(), s.effect) == had.end())
        s.on = true;
  }
}

}  // namespace

JudgedRun run_judged(const Scene& scene, const SimulateOptions& options, double asked, bool again) {
  Called called{scene, {}, asked, false};
  for (int round = 0;; ++round) {
    JudgedRun out;
    out.scene = called.scene;
    Alone alone;
    bool ended = false;
    out.results = within_reach(called, [&] {
      return with_complete_inertia(out.scene, [&](const Scene& s, int& indefinite) {
        alone = Alone{};
        alone.lengthened = called.lengthened;
        alone.shares = options.weight_shares;
        SimulateOptions used = options;
        try {
          return simulate_alone(s, used, true, alone, indefinite);
        } catch (const LoopsLost& lost) {
          if (!calls(lost, called)) throw;
          ended = true;
          return Results{};
        }
      });
    });
    if (ended) continue;
    if (round < most_calls && calls(alone.left_out, alone.limits, called)) {
      if (again) continue;
      switch_on(out.scene, called.scene, alone.effects);
      out.scene = called.scene;
      out.called = true;
    }
    out.start = std::move(alone.start);
    out.shares = std::move(alone.shares);
    out.results.statistics.notes.prepend(called.notes);
    out.effects = std::move(alone.effects);
    out.limits = std::move(alone.limits);
    out.left_out = std::move(alone.left_out);
    out.second_order = std::move(alone.to_measure);
    return out;
  }
}

Results run_for_check(const Scene& scene, const SimulateOptions& options, std::vector<LinearLimit>& limits) {
  Unjudged run =
      with_complete_inertia(scene, [&](const Scene& s, int& indefinite) { return simulate_once(s, options, false, nullptr, indefinite); });
  estimate_time(run);
  judge(run, true);
  limits = run.alone.limits;
  return std::move(run.results);
}

}  // namespace flexframe::sim
