// A scene simulated to an asked accuracy of its outputs: tolerance, modes or elements, and effects are chosen.
//
// Three errors are estimated by comparing runs (histories.h), all relative to the ranges of the outputs: of time (another tolerance), of
// space (other modes or elements) and of what is left out (with and without). Coarse and loose runs come first, because they are cheap:
// they tell the tolerance, for the scene's method and for those that follow every vibration. Then each of these ways is gone in runs of
// limited length until one comes to the end, the others as long as they are cheaper; the last run is the result. Where vibrations are
// followed each body's modes are judged by a run with more of them in it alone, elsewhere a run is judged by the level below it and, once
// it seems good enough, by one above. Errors of time and space at about the same time add up; those of bodies, and of modes left out of
// one, vibrate at frequencies of their own and add as squares.
//
// Before all that the scene is run as written at a tenth of the accuracy and tighter, and what comes is taken where it keeps the accuracy
// without a warning (accuracy_straight.cpp): judged in time by a looser run and by the energy that its vibrations lose to the method, in
// space by half the elements, in effects along its own motion. Undamped vibrations that have to be followed are followed by the exponential
// method with as many modes as their convergence asks for. Where the scene as written has so many coordinates that its runs are dear, all
// of that is done with a few modes of every beam and the shapes of forces at rest, judged by half as many modes more. What half the
// elements leave open, twice as many tell. Where that does not do, the search begins.
//
// First the search runs the scene as it stands. Its price bounds the search (accuracy.cpp, search_allowance), and it tells beams that bend
// too far for one frame, or deform in forms of other ends (model_check.h): these become volumes or finite elements, if no output is lost by
// that. Where the search finds nothing in its time, or nothing that keeps the accuracy, the run that came nearest is the result, or the
// scene as it stands, judged by a looser run and one of half the elements.
//
// Where the scene lists effects they stay; where it says "auto", what is worth less than a tenth of the asked accuracy goes, unless the run
// is dearer without. What is off and worth less than a third in all stays off; what is worth more than nine tenths comes. Between these the
// cheaper way is taken: the run is made without it, its worth counted among the errors (finer in time and space to make up for it), and
// with it for as long as that is the cheaper one. A worth is believed once it is larger than what a decade of tolerance changes in the two
// runs that told it.
//
// The knob of space is common to all bodies, but where vibrations are followed: a frequency. A finite-element beam keeps the eigenmodes
// below it and the static deflections of the rest, of three elements a mode at least; one that has none below it is rigid unless that
// shows; modal beams have the eigenforms 1..m, mixed ones volumes, lumped ones elements in the same proportion. Beams whose nodes or
// coordinates the scene names stay as they are.
#pragma once

#include "sim/accuracy/settings_memory.h"
#include "sim/run/run_scene.h"

namespace flexframe::sim {

// options.tolerance is ignored. memory: where settings are kept from one call to the next, or null; what was found before is run again
// without the search. Throws what simulate throws.
Results simulate_to_accuracy(const Scene& scene, double accuracy, const SimulateOptions& options, const SettingsMemory* memory = nullptr);

// A run with the settings that a search found and other samples; its statement of the error is the search's. output_rate: 1/s. Throws what
// simulate throws.
Results run_with_settings(const RememberedSettings& found, double output_rate, const SimulateOptions& options);

// That where an accuracy is asked for, by the options or the scene, and no tolerance by the options; else run_scene.
Results simulate_as_asked(const Scene& scene, const SimulateOptions& options, const SettingsMemory* memory = nullptr);

}  // namespace flexframe::sim
