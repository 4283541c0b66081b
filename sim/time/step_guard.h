// Keeps the steps of a run from passing over what acts for a short time or over a short way: pulses of forces, distributed loads and
// prescribed motions (scene/function_scan.h), peaks of tables over a joint's coordinate, and of expressions over what they read: these
// are looked for along the way that the motion would take if it went on as it does.
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
  // `system.work` may be left at another state: true in `moved`.
  double limit(System& system, double t, const VecX& y, double step, double farthest, bool& moved);
  // Sentences about functions that vary too densely to be looked after.
  std::vector<std::string> complaints() const;

 private:
  void add(const std::string& name, FunctionScan&& scan);
  double limit_of_places(const System& system, double t, const VecX& y, double farthest);
  double limit_of_readings(System& system, double t, const VecX& y, double step, double farthest, bool& moved);

  // What all functions read, where the motion is expected at that time.
  struct Look {
    double t = 0.0;
    std::vector<double> values;
  };
  bool look_ahead(System& system, double t, double ahead, const VecX& y, Look& into) const;
  bool all_shown(const System& system, const Look& now, const Look& half, const Look& end);

  struct Place {
    FunctionScan scan;
    int part;                  // whose coordinate it depends on
    double t = 0.0, at = 0.0;  // where it was last looked at
    bool seen = false;
  };
  std::vector<FunctionScan> scans_;
  std::vector<std::string> names_;  // of each scan
  std::vector<Place> places_;

  struct Reader {
    PathScan scan;
    int function;       // of the model
    double peak = 0.0;  // its largest size so far, or within any reach where that is bounded
    std::vector<double> at;
  };
  std::vector<Reader> readers_;
  double known_until_ = 0.0, before_ = 0.0;
  VecX y_before_;  // at before_
  long shortened_ = 0;
};

}  // namespace flexframe::sim
