// What is done where steps leave a loop where it cannot be.
#pragma once

#include "sim/base/error.h"

#include <fmt/format.h>

#include <optional>
#include <string>

namespace flexframe::sim {

// Closed loops that a run could not follow: a step went over into another assembly, to where they cannot be closed, or none goes on.
struct LoopsLost : SimulationError {
  LoopsLost(const std::string& what, double at) : SimulationError(what), tolerance(at) {}
  double tolerance;  // of the run
};

// once(tolerance): a run, at the scene's tolerance where none is given; its result has `statistics`. At loose tolerances steps may be so
// long that loops are lost which the motion keeps: the run is made again from its start at a tenth, since steps that are taken again alone
// set out from where the ones before them have led. Where that fails too, the sentence is true.
template <class Run>
auto with_kept_loops(std::optional<double> tolerance, Run&& once) {
  constexpr double loose = 1.001e-4;
  std::string lost;
  for (;;) try {
      auto out = once(tolerance);
      if (!lost.empty())
        out.statistics.notes.tell(
            "", fmt::format("computed with tolerance {:.0e}: longer steps did not follow the loops ({})", *tolerance, lost));
      return out;
    } catch (const LoopsLost& error) {
      if (error.tolerance <= loose) throw;
      tolerance = 0.1 * error.tolerance;
      lost = error.what();
    }
}

}  // namespace flexframe::sim
