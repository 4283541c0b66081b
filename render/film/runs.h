// Several runs in one picture: two settings, two simulators, before and after.
#pragma once

#include "render/film/settings.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <span>
#include <string>
#include <vector>

namespace flexframe::film {

struct Run {
  const sim::Results* results = nullptr;
  const sim::Scene* scene = nullptr;  // that it was made from; null: unknown
  std::string name;                   // in the legend and before the names of its bodies
};

// Largest difference of a column that runs share, over the samples of the first as far as the other reaches.
struct RunDifference {
  std::string column, unit, run;
  double largest = 0.0;  // in the unit
  double share = 0.0;    // of the first run's range (histories.h); 0: it does not move
  double at = 0.0;       // s
};

// The runs as one, for make_animation: bodies of the later ones are named "RUN: BODY" and brought to the times of the first; a run that
// ends earlier stands still.
struct RunsTogether {
  sim::Results results;
  sim::Scene scene;
  std::vector<RunDifference> differences;
  std::vector<std::string> notes;
};

// beside: each run moved aside by its width, else all at their place and the later ones see-through. by_run: each run in its colour, named
// in settings.runs. settings.overlay.plot becomes one column that all runs share (the first of it, else the first that moves), of every
// run, and the differences from the first run. Throws sim::InputError for fewer than two or more than eight runs.
RunsTogether put_together(std::span<const Run> runs, bool beside, bool by_run, RenderSettings& settings);

}  // namespace flexframe::film
