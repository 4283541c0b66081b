// A scene simulated to an asked accuracy of its outputs: tolerance, modes or elements, and effects are chosen.
//
// Three errors are estimated by comparing runs (histories.h), all relative to the ranges of the outputs: of time (ten times the tolerance), of
// space (one level fewer modes or elements) and of what is left out (with and without). Coarse and loose runs come first, because they are
// cheap; the last run is the result and is checked against the one below it. Where the scene lists effects they stay; where it says "auto",
// what is worth less than a tenth of the asked accuracy goes, and what is worth more than a third comes.
//
// The knob of space is common to all bodies: a frequency. A finite-element beam keeps the eigenmodes below it and the static
// deflections of the rest, of three elements a mode at least; one that has none below it is rigid unless that shows; modal beams have the eigenforms 1..m, mixed ones volumes, lumped ones elements in the same proportion.
// Beams whose nodes or coordinates the scene names stay as they are.
#pragma once

#include "sim/simulate.h"

namespace flexframe::sim {

// options.tolerance is ignored. Throws what simulate throws.
Results simulate_to_accuracy(const Scene& scene, double accuracy, const SimulateOptions& options);

}  // namespace flexframe::sim
