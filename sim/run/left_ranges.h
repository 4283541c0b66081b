// What a run shows to have left the range in which its description holds: cams beyond their table, points beyond the end of their curve,
// ropes that would have to push, springs on rotation vectors beyond half a turn, spheres pressed through each other, angles whose whole
// turns nothing counts between samples.
#pragma once

#include "sim/base/notes.h"
#include "sim/dynamics/reactions.h"
#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

class LeftRanges {
 public:
  explicit LeftRanges(const System& system);
  // Looks at the state in `system`, which was recorded last, at the time t (s). Costs nothing where the model has none of these.
  void look(System& system, double t);
  // A warning for each that was left, with the first time.
  void warn(Notes& into) const;

 private:
  struct Watched {
    std::string owner, what;        // "joint 'wire'", half a sentence
    int part = -1, coordinate = 0;  // its coordinate, or
    int coupling = -1;              // the pull of this rope, N
    int quaternion = -1;            // the turn of these coordinates of the part, rad
    int contact = -1;               // how deep this one is, m
    int bushing = -1;               // the turn of this load's ends against each other, rad
    int loop = -1;                  // how far this joint turns from sample to sample, rad
    Quat last{1.0, 0.0, 0.0, 0.0};  // of the bushing: where it was turned, followed beyond half a turn
    double low = 0.0, high = 0.0;
    bool left = false;
    double first = 0.0;     // s
    double farthest = 0.0;  // value
  };
  std::vector<Watched> watched_;
  bool ropes_ = false;
  double last_ = 0.0;  // time of the sample before, s
  Reactions reactions_;
};

}  // namespace flexframe::sim
