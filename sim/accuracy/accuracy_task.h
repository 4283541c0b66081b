// The search for a setting that keeps an asked accuracy, as far as it has come, and its stages in the order in which they are taken: time
// (accuracy_time), what is left out (accuracy_effects), the run itself (accuracy_finish). Errors are relative to the ranges of the outputs.
#pragma once

#include "sim/accuracy/accuracy_search.h"
#include "sim/accuracy/settings_memory.h"
#include "sim/run/judged_run.h"
#include "sim/run/model_check.h"
#include "sim/run/run_scene.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// Least order at which the error of time follows the tolerance when it has to be lowered (simulate.h: 0.2 to 1.2).
inline constexpr double cautious_order = 0.6;
// Share of the asked accuracy that may stay out unasked.
inline constexpr double unasked = 1.0 / 3.0;
// A run with an effect switched that takes so many times as long as the one without is given up.
inline constexpr double dearest = 20.0;
// CPU seconds of a run that may take as long as it does.
inline constexpr double unlimited = 1e300;

// CPU s for a check of the models beside a run of so many: richer ones take up to twenty times as long, and nobody waits minutes for that.
inline double check_budget(double run) { return std::min(std::max(1.0, 20.0 * run), 10.0 + 2.0 * run); }

// The same where places of pictures are asked for, whose tolerances are tight: what a run of seconds is off by there is told by estimates.
inline double check_budget_of_pictures(double run) { return std::min(check_budget(run), std::max(8.0, 1.5 * run)); }

struct Finished;

struct Task {
  double accuracy;
  const SimulateOptions* options;
  Search search;
  Setting setting;
  Histories loose, coarse;  // one level below: at ten times the tolerance, and at it
  double time = 0.0;        // error of the latter
  double decade = 1.0;      // CPU time at a tenth of the tolerance
  // What is left out and what it would change, relative, columns x samples: stiff bodies' flexibility, effects of bodies.
  MatX rigid, left_out;
  std::vector<EffectState> without;
  // Of effects that are off, where left_out is their sum: by column, or where that is empty one number for all outputs.
  struct Share {
    std::string effect;
    std::vector<std::string> owners;
    double worth = 0.0;
    VecX columns = {};
  };
  std::vector<Share> shares;
  // What the last run lacks and no setting brings: shear of sections without shear areas.
  std::vector<LeftOutWorth> lacking;
  std::vector<std::string> chosen;
  std::shared_ptr<std::optional<Finished>> nearest;  // the run that came nearest to the accuracy so far, of all ways
  std::shared_ptr<std::optional<Finished>> written;  // the same of runs as written that were judged whole and refused
  bool straight = false;                             // no runs are spent on whether a looser one would have done
  double clear = 1e300;  // straight: at this tolerance errors of time do not hide what modes lack; looser ones have to show it

  Setting below() const { return {search.has_levels() ? setting.level - 1 : setting.level, setting.tolerance}; }
  Setting loose_below() const { return {below().level, 10.0 * setting.tolerance}; }
  // Makes the two runs below, at a tighter tolerance where they fail.
  void run_below();
  // The tighter of them at another setting, if it succeeds there.
  bool coarse_again();
  void leave_out(const std::vector<EffectState>& what, const MatX& change);
  // Effects that came on since their shares were told are left out no longer.
  void drop_shares_of_what_is_on();
  // Keeps a run that is nearer to the accuracy than those before, for the case that the search's time ends.
  void keep(const Finished& finished);
  // Found again at another setting, in a run that is given up after so many CPU seconds.
  void find_left_out(const Setting& here, const Histories& run, double seconds);
};

// a - reference at the reference's samples, relative to the ranges of its outputs: columns x samples.
MatX relative(const Histories& a, const Histories& reference);
// Whether outputs move, but none of them so that it counts (output_ranges).
bool nothing_counts(const Histories& a, const Histories& b);
// The largest of it.
double apart(const Histories& a, const Histories& reference);
double largest(const MatX& m);

// Factors for what a run changes in places, in rates, and in forces and accelerations.
using ByKind = std::array<double, 3>;
double of_kind(const std::string& unit, const ByKind& factors);
// What is lacking, as a share of what half the elements, volumes or modes change, the fewest of a body being so many: they err by four
// times as much at least, in what is no rate; rates of vibrations converge slowly, and few elements in no order that one could rely on.
inline ByKind by_half(int fewest) { return fewest < 4 ? ByKind{1.0, 2.0, 2.0} : ByKind{1.0 / 3.0, 1.0, 2.0}; }

// Time, one level below: the tolerance is lowered until half of the asked error is kept. Where vibrations have to be followed for that,
// `others` gets the ways that do as well at this level: which of them is the cheapest one may be another matter with more modes.
void settle_time(Task& t, std::vector<Task>* others = nullptr);

// Stiff bodies are rigid unless that shows.
void settle_rigid(Task& t);

// One effect of some bodies, all on or all off.
struct Item {
  std::vector<EffectState> members;
  MatX share;          // with it less without it, relative: columns x samples; empty: it cannot be switched
  double worth = 0.0;  // the largest of them
  double price = 1.0;  // CPU time with it switched, as a multiple
  std::string name() const;
};

// Effects that the program decides. Returns those that may be left out or not.
std::vector<Item> settle_effects(Task& t);

// A run that keeps the accuracy, or comes as near as it can.
struct Finished {
  Results results;
  std::vector<LinearLimit> limits;             // how far its bodies were bent
  std::vector<std::string> described, chosen;  // the setting in words, what was left out
  Scene scene;                                 // at this setting
  std::optional<Method> method;                // of the search
  std::optional<JudgedRun> judged;             // where it went straight: the run, and what its motion says of effects
  Setting setting;
  std::vector<EffectState> states;  // effects of a run as written; empty: the search's
  Histories looser, coarse;         // at ten times the tolerance, one level below
  ErrorSizes sizes;                 // of all outputs, as add_up found them last
  double error = -1.0;              // of the output that is furthest off; negative: not known
  std::string column;
  double time = 0.0, space = 0.0, effects = 0.0;  // its parts
  double loose_tolerance = 0.0;                   // of `looser`
  std::string unreached;                          // why no search is made where the error is larger than what is asked; empty: the modes
  bool ends_search = false;                       // none comes nearer in its time
  double cpu() const { return results.statistics.cpu_seconds; }
  double work() const { return results.statistics.work; }
  // Errors of one output at about the same time add up; those of space and of what is left out have nothing to do with each other, and add
  // as squares. Columns x samples of `fine`. Errors of time that may not fall with the tolerance are `equal` times those, and add as
  // squares too: whichever is more.
  double add_up(const Histories& fine, const MatX& in_time, const MatX& in_space, const MatX& in_effects, double equal = 0.0);
  // Forces at t = 0 of elements whose length neither half nor twice as many change (Search::shorter_at_ends): until strains have come about
  // a joint holds what the element beside it weighs, which falls with its length alone. Counts where it is more than the rest. fine: of the
  // results.
  void count_start(Search& search, const Histories& fine);
  // How far off the outputs are after the first instants, which `sizes` spread over a twentieth of the run: loads that come at once leave
  // the first sample off where nothing else is, as a joint holds then what the beam's element beside it weighs. Negative: not known.
  double after_start() const;
};

// The run itself, checked against others; finer as long as that is what lacks. Given up once a run of it takes `limit` CPU s.
std::optional<Finished> finish(Task& t, double limit);
// The same where vibrations are followed: each body's modes are judged by themselves.
std::optional<Finished> finish_followed(Task& t, double limit);
// CPU s that a search may take beside a run of so many. Runs of seconds get less than fifteen times theirs: nobody waits minutes to learn
// that an accuracy cannot be had.
inline double search_allowance(double run) { return std::max(10.0, std::min(15.0 * run, 30.0 + 3.0 * run)); }

// Without a search: the scene as it is written at a few tolerances, judged by a looser run, by one of half the elements, by the energy that
// it loses and by what its motion says of the effects that are off (judged_run.h); or, where undamped vibrations have to be followed, with
// as many modes as the accuracy asks for. None where that does not keep the accuracy without a warning: then the search begins. t.search is
// of the scene with the effects that its motion needs afterwards.
// left: where its runs keep the accuracy in time and something else does not, the last of them, for the search that begins.
struct StraightRun {
  JudgedRun run;     // its scene: without the modes that were kept of it
  Scene as_run;      // with these
  Histories looser;  // at ten times its tolerance
  double tolerance = 0.0, time = 0.0;
  std::vector<std::string> described;  // the setting in words
  bool kept = true;                    // false: one that took so long that the effects it called for are not asked for again
};
std::optional<Finished> go_straight(Task& t, const Scene& as_given, std::optional<StraightRun>& left);

// What these shares make of the outputs of h, at all times: columns x samples.
MatX left_out_by(const std::vector<Task::Share>& shares, const Histories& h);

// Settings that are tried for the run itself.
inline constexpr int most_rounds = 14;
// The run itself, into `out`: throws TooDear where its CPU time exceeds a limit, SearchSpent at the end of the search's time.
struct TooDear {};
void run_itself(const Task& t, const Setting& setting, double limit, Finished& out);

}  // namespace flexframe::sim
