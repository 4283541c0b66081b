// Keeps the steps of a run from passing over what acts for a short time or over a short way: pulses of forces, distributed loads and
// prescribed motions (scene/function_scan.h), peaks of tables over a joint's coordinate.
#pragma once

#include "sim/scene/function_scan.h"
#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

class StepGuard {
 public:
  // A segment of the run in which no expression changes its piece.
  void begin(const System& system, double from, double to);
  // How far a step from (t, y) may go, a time; the last step had the length `step`, the next goes to `farthest` at most. Infinite where
  // there is nothing to pass over; a scene in which no load depends on time or place pays nothing.
  double limit(const System& system, double t, const VecX& y, double step, double farthest);
  // Sentences about functions that vary too densely to be looked after.
  std::vector<std::string> complaints() const;

 private:
  void add(const std::string& name, FunctionScan&& scan);

  struct Place {
    FunctionScan scan;
    int part;                  // whose coordinate it depends on
    double t = 0.0, at = 0.0;  // where it was last looked at
    bool seen = false;
  };
  std::vector<FunctionScan> scans_;
  std::vector<std::string> names_;  // of each scan
  std::vector<Place> places_;
};

}  // namespace flexframe::sim
