// Two runs side by side: a scene as it is, and with richer models of some of its beams, as far as a budget of CPU time allows. Tells a
// difference only where it is more than both runs err by in time.
#pragma once

#include "sim/run/effect_report.h"

#include <optional>
#include <string>

namespace flexframe::sim {

// The largest difference of the outputs that both have, relative to their ranges.
struct OutputChange {
  double share = 0.0;
  std::string column;
};

class Comparison {
 public:
  // plain: the scene to compare with where the run itself is of another one, or damped in another way than the richer scene's beams can be.
  // budget: CPU s. run: the run, its tolerances and errors; asked: relative to ranges, what is told of differences of less need not be
  // sure.
  Comparison(Scene scene, Scene rich, std::optional<Scene> plain, double budget, const NeglectOptions& run, double asked);

  // What the richer models change; none where nothing moves, the budget is spent, the richer run fails, or errors of time hide it. base:
  // histories of the scene at the looser tolerance of `run`.
  std::optional<OutputChange> measure(const Histories& base);

  // Whether measure() was given up as the budget would not do.
  bool too_long() const { return too_long_; }

  // What the first, looser pair of runs tells where that says more than is asked and than these runs err by, and no tighter one came to an
  // end.
  const std::optional<OutputChange>& unconfirmed() const { return unconfirmed_; }

  // CPU s of the last run of the richer scene, 0: none came to an end.
  double rich_cpu() const { return rich_run_.statistics.work; }

 private:
  std::optional<OutputChange> by_steps(const Histories& base);
  bool follows() const;
  bool steps_over_vibrations() const;
  std::optional<OutputChange> followed_by_both();
  double growth_to(double tolerance) const;
  Histories simulated(const Scene& scene, double tolerance);
  const Histories& simulate_rich(double tolerance);
  std::optional<OutputChange> at(double tolerance, const Histories& run);
  bool is_resolved(const OutputChange& found, const Histories& looser) const;

  Scene scene_, rich_;
  std::optional<Scene> plain_;
  Histories rich_run_;  // the last one
  int samples_ = 0;
  double budget_, asked_, spent_ = 0.0;
  bool too_long_ = false, followed_ = false;
  std::optional<OutputChange> unconfirmed_;
  const NeglectOptions& run_;
  std::optional<Method> method_;
};

}  // namespace flexframe::sim
