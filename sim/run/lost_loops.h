// What is done where steps leave a loop where it cannot be.
#pragma once

#include "sim/base/error.h"

#include <fmt/format.h>

#include <optional>
#include <string>

namespace flexframe::sim {

// Closed loops that a run could not follow: a step went over into another assembly, to where they cannot be closed, or none goes on.
struct LoopsLost : SimulationError {
  LoopsLost(const std::string& what, double at, bool followed) : SimulationError(what), tolerance(at), vibrations_followed(followed) {}
  double tolerance;          // of the run
  bool vibrations_followed;  // by the exponential method, which nobody asked for
};

// once(tolerance, stepping): a run, at the scene's tolerance where none is given, by the Runge-Kutta method where stepping is true; its
// result has `statistics`. At loose tolerances steps may be so long that loops are lost which the motion keeps: the run is made again from
// its start at a tenth, since steps that are taken again alone set out from where the ones before them have led. So may those of the
// exponential method at any tolerance: made again by steps over the vibrations. Where that fails too, the sentence is true.
template <class Run>
auto with_kept_loops(std::optional<double> tolerance, Run&& once) {
  constexpr double loose = 1.001e-4;
  std::string lost;
  bool stepping = false;
  for (;;) try {
      auto out = once(tolerance, stepping);
      if (stepping)
        out.statistics.notes.tell(
            "", fmt::format("computed with method dirk: the exponential method's steps did not follow the loops ({})", lost));
      else if (!lost.empty())
        out.statistics.notes.tell(
            "", fmt::format("computed with tolerance {:.0e}: longer steps did not follow the loops ({})", *tolerance, lost));
      return out;
    } catch (const LoopsLost& error) {
      const bool tighter = error.tolerance > loose;
      if (!tighter && (stepping || !error.vibrations_followed)) throw;
      if (tighter) tolerance = 0.1 * error.tolerance;
      else stepping = true;
      lost = error.what();
    }
}

}  // namespace flexframe::sim
