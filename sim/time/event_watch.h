// Where in an integrator's step a phase ends: the first zero of its margins from above (events.h), on the interpolant of the step.
//
// A step is looked at inside as well as at its end unless all margins are large against what they change by, and where a margin has its
// least value in between that is followed down: a slide that goes back and forth within a step, or a ball that only grazes its stop, is
// found. What expressions and contacts look at is looked at more often where bodies turn far within a step, and where a margin that falls
// and rises again might reach zero in between as far as its slopes at two looks tell: a tip that brushes a wall once a turn, a ball that
// would be past its partner by the end of the step. A margin that starts at zero (a body that starts on its stop, a slip that starts from
// rest) and falls has its zero at the start: no phase can hold where friction would push along the motion or a stop would be passed
// through. Zero: what rounding leaves of it (event_roundings). The integrators' own search would see changes of sign between the ends of
// steps only.
#pragma once

#include "sim/time/system.h"

#include <vector>

namespace flexframe::sim {

class EventWatch {
 public:
  // The phases begin, or go on, at (t, y).
  void begin(System& system, double t, const VecX& y);
  // Looks at the last step of an integrator that goes on from where begin or look was called last. True where a phase ends within it: t and
  // y become those of its end, and directions() is what pass_events wants. `system.work` is left somewhere within the step.
  bool look(System& system, const Integrator& integrator, double& t, VecX& y);
  // Per margin -1 where it came to zero, else 0.
  const std::vector<int>& directions() const { return directions_; }
  // The state from which the last step set out, and its time.
  double start_time() const { return start_.t; }
  const VecX& start_state() const { return start_y_; }

 private:
  struct Point {
    double t = 0.0;
    std::vector<double> margin, rate;
  };
  void state_at(const Integrator& integrator, double t, VecX& y) const;
  void take_out_slope(System& system, const Integrator& integrator);
  bool find(System& system, const Integrator& integrator, std::vector<Point>& points, Point& before, Point& after);
  Point at(System& system, const Integrator& integrator, double t);
  Point at(System& system, double t, const VecX& y) const;
  bool ended(const Point& p) const;
  bool calm(const Point& end) const;
  std::vector<Point> looks(System& system, const Integrator& integrator, double t, const VecX& y);
  void look_between(System& system, const Integrator& integrator, std::vector<Point>& points);
  bool dips(System& system, const Integrator& integrator, const std::vector<Point>& points, Point& before, Point& after);
  void locate(System& system, const Integrator& integrator, Point& before, Point& after);

  Point start_, before_;  // ends of the last two steps; before_ has no margins where a phase began since
  VecX start_y_, scratch_;
  double end_ = 0.0;           // of the step that is looked at
  VecX missed_;                // the start's state less what the interpolant says there
  VecX turned_;                // its rates times the step, less the interpolant's; empty where these are not looked at
  bool just_begun_ = false;    // no step since a phase began
  std::vector<double> floor_;  // per margin: below it the phase has ended
  std::vector<int> directions_;
};

}  // namespace flexframe::sim
