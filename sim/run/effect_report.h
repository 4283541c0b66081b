// What every effect of a scene is worth: its share of the outputs, its coordinates and its price, found by running the scene with and
// without it.
//
// A share is the largest difference of an output between the two runs, relative to the output's range (histories.h): phases count. Pairs of
// runs are thinned and loose, and made again at a tighter tolerance where the run without the effect (or with it) is off by a good part of
// the share itself; what they cannot tell from their own error of time integration is reported as below `floor`.
#pragma once

#include "sim/model/effects.h"
#include "sim/run/histories_run.h"

#include <functional>
#include <string>
#include <vector>

namespace flexframe::sim {

// Names of owners that are no bodies: joints ("joint 'guide'") and the whole scene.
inline constexpr const char* whole_scene = "scene";

// The scene with one effect of one owner on or off. states: of the scene as it stands (Model::effects). Throws ArgumentError for an
// effect that the owner cannot have.
Scene with_effect(const Scene& scene, const std::vector<EffectState>& states, const std::string& owner, const std::string& effect, bool on);

// The scene with all of these switched on; two of one body too, which with_effect, called twice with the same states, would not give.
Scene with_effects_on(const Scene& scene, std::vector<EffectState> states, const std::vector<EffectState>& more);

// Effects of joints (friction, stops) and of the whole scene (gravity), then those of the model's bodies.
std::vector<EffectState> effect_states(const Scene& scene, const Model& model);

struct EffectRow {
  EffectState state;
  bool measured = false;               // a pair of runs was made
  double share = 0.0;                  // of the output it changes most; 0 where the effect cannot occur
  std::string column;                  // that output
  VecX shares;                         // per column of the report
  double floor = 0.0;                  // error of time integration of the last pair: a smaller share is not to be trusted
  double cpu_on = 0.0, cpu_off = 0.0;  // s, of the pair
  std::string note;                    // why there is no number
};

struct EffectReport {
  std::vector<std::string> columns;
  std::vector<EffectRow> rows;
  double tolerance = 0.0;  // of the pairs
  double floor = 0.0;      // error of time integration of the scene as it stands
  double cpu = 0.0;        // s, of the scene as it stands
};

struct EffectOptions {
  double tolerance = 0.0;                         // of the pairs; 0: ten times the scene's
  int repeats = 3;                                // of every run, interleaved, for the price; runs above half a second are not repeated
  std::function<void(double fraction)> progress;  // may throw to stop
};

// Throws what simulate throws for the scene as it stands.
EffectReport report_effects(const Scene& scene, const EffectOptions& options = {});

// The check after a run of what was left out and could occur, per effect on all bodies at once, each by one pair of runs.
struct Neglected {
  std::string effect;
  std::vector<std::string> owners;
  double share = 0.0;
  std::string column;
  bool resolved = true;  // false: the share is not above the error of the pair itself
  bool possible = true;  // false: the bodies' models cannot have it
};
// An effect for which the budget was spent, or with which the run fails.
struct Untried {
  std::string effect;
  std::vector<std::string> owners;
  std::string failed;  // why the run with it fails; empty: it took too long
};
struct NeglectCheck {
  std::vector<Neglected> found;  // one an effect that was tried
  std::vector<Untried> untried;
  double cpu = 0.0;  // s
};

struct LeftOutWorth;  // left_out.h

struct NeglectOptions {
  double tolerance = 1e-4;  // of the pairs
  double budget = 1e300;    // CPU s; a run that would pass it is not begun or given up, what confirms may take as much again
  double floor = 0.0;       // error of time integration at that tolerance
  std::optional<Method> method;
  // A share above `confirm_above` is measured again at the run's own tolerance, against the run: pairs at a loose tolerance step over
  // vibrations in different ways, which can look like an effect.
  const Histories* run = nullptr;
  double run_tolerance = 0.0, run_error = 0.0, confirm_above = 1e300;
  double deflection = 0.0;           // m, the largest of a body: what places that stand still are measured against
  bool second_order = true;          // stiffening and gyroscopic terms
  bool deformations = false;         // also deformations, which run_scene judges along the motion itself (left_out.h)
  std::vector<std::string> further;  // these deformations also
  // What is known of these effects without a second run: report_neglected takes out what it measured.
  std::vector<LeftOutWorth>* told = nullptr;
};

// output_ranges of both (histories.h), the larger; places that stand still (m) count against the largest deflection of a body, m, angles
// against the largest turn of a section, rad; forces, moments and stresses that do against their size.
VecX common_ranges(const Histories& a, const Histories& b, double deflection, double turn = 0.0);

// What check_neglected would measure: effects that are off and could occur, each with all of its owners.
std::vector<Untried> neglected(const std::vector<EffectState>& states, const NeglectOptions& options);

// base: histories of the scene itself at options.tolerance. Where that is the run's own, nothing is confirmed.
NeglectCheck check_neglected(const Scene& scene, const std::vector<EffectState>& states, const Histories& base,
                             const NeglectOptions& options);

// Price of the check against that of the run: a pair at ten times the tolerance takes about half of a run, and what is worth more than is
// asked is run again at the run's own.
inline constexpr double check_price = 1.5;
// What it may take in any case, CPU s: nobody waits for that.
inline constexpr double least_check = 0.5;

// A note of what was measured, no less than `floor`.
void tell_neglected(const Neglected& n, double floor, Notes& notes);

// Checks and says what was found: warnings for what is worth more than `asked`, notes for the rest.
void report_neglected(const Scene& scene, const std::vector<EffectState>& states, const Histories& base, const NeglectOptions& options,
                      double asked, SolverStatistics& out);

// Of what is asked: where the estimate of a deformation that is left out becomes a warning.
inline constexpr double told_of_left_out = 0.8;

// What is worth more than `asked` as warnings, the rest as notes; where the program decides the effects, and of what is of second order,
// half of it, as no less is told than half of a worth.
void report_left_out(const Scene& scene, const std::vector<LeftOutWorth>& found, double asked, SolverStatistics& out);

// Adds what beams with automatic effects need of what they went without: the scene is to be simulated anew. A note says what and why. False
// if nothing.
bool call_for(const std::vector<LeftOutWorth>& found, double asked, Scene& scene, Notes& notes);

// "stiffening of 'rod' was left out and is worth 12 % of tip.y: add \"stiffening\" to its effects"
std::string neglect_text(const Scene& scene, const Neglected& neglected);

}  // namespace flexframe::sim
