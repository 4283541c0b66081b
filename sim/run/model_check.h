// What the models of a scene's beams cannot show, measured beside the run: outputs of the same scene with richer models of these beams.
//
// Beams that linear_limit.h says may bend too far for the displacement field of one frame are made of several times as many volumes
// (beam_pieces.h), each in a frame of its own, so that the error falls with the square of their number. Beams that deform in
// forms of certain ends (eigenforms; finite elements held at both ends of the frame) are made of finite elements that take any form. Both
// runs have the same damping.
#pragma once

#include "sim/run/effect_report.h"
#include "sim/run/linear_limit.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// How the note or warning about a beam of eigenforms begins, whose owner it is.
inline constexpr std::string_view misfit_words = "its modes are those of";
// What a warning begins with that nobody has judged the number of elements or modes that the scene gives.
inline constexpr std::string_view unjudged_words = "the scene gives its number of elements or modes";

struct ModelCheckOptions {
  double asked = 1e-2;                       // error of an output that is tolerated, relative to its range
  double budget = 1.0;                       // CPU s, of all checks; one that would take longer than what is left of it is given up
  NeglectOptions run;                        // the run, its tolerances and errors; budget and confirm_above unused
  std::vector<size_t> unjudged = {};         // beams whose number of elements or modes nothing else has judged
  std::vector<size_t> between_samples = {};  // beams of few elements perhaps, by how they vibrate there (coarse_beams.h)
  std::vector<size_t> ringing = {};          // beams of few elements perhaps, by what outputs show (ringing_beams.h)
  std::vector<size_t> coarse = {};           // beams of few elements by closed formulas, which warn themselves (coarse_beams.h)
  double surely_small = 0.5;                 // nothing is measured below this share of what is asked: estimates err by so much
  bool no_run_of_it = false;                 // the scene is another one than the run's: it is run too
  std::vector<size_t> may_tip = {};          // beams of few elements perhaps (coarse_beams.h: beams_that_may_tip)
};

// CPU s for the checks beside a run of so many: what takes longer is told by its estimate, with how to measure it.
inline double model_check_budget(double run) { return std::max(1.0, 3.0 * run); }

// What bending in its own frame is worth of an output's range: the estimate, or what volumes beside it have told, in a run of so many CPU
// s with so many elements in each beam (0: not measured).
struct BendingWorth {
  double share = 0.0, cpu = 0.0;
  int elements = 0;
};

struct ModelWorth {
  BendingWorth bending;
  std::vector<size_t> measured;  // beams of whose elements half or twice as many have told
};

// Whether check_models has any beam to check.
bool any_to_check(const Scene& scene, const std::vector<LinearLimit>& limits, const ModelCheckOptions& options);

// Checks beams of certain forms, those that are unjudged, coarse, or fast between samples, by twice their elements, those that may tip by
// half of them, and the beams of `limits` whose error may be above what is asked, and says what was found: warnings for what is worth more,
// with what keeps it, notes for the rest. What cannot be measured is warned of by its estimate. base: histories of the scene itself at
// options.run.tolerance.
ModelWorth check_models(const Scene& scene, const std::vector<EffectState>& states, const std::vector<LinearLimit>& limits,
                        const Histories& base, const ModelCheckOptions& options, SolverStatistics& out);

// What shear is worth to lumped beams, which cannot have it, where `left_out` tells more than is asked: between finite elements without and
// with it. As it was where that could not be measured.
void measure_shear_of_lumps(const Scene& scene, const std::vector<EffectState>& states, const Histories& base,
                            const ModelCheckOptions& options, std::vector<LeftOutWorth>& left_out);

// The scene with richer models of those beams for which they change more than is asked; none where there is no such beam, or an output
// would be lost.
std::optional<Scene> with_richer_models(const Scene& scene, const std::vector<EffectState>& states, const std::vector<LinearLimit>& limits,
                                        const Histories& base, const ModelCheckOptions& options);

// One run of a scene (run_scene.h) without the check of its models: how far they were bent instead.
Results run_for_check(const Scene& scene, const SimulateOptions& options, std::vector<LinearLimit>& limits);

}  // namespace flexframe::sim
