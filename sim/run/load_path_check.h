// How right a load path is: the same path with what its beams go without, and with other numbers of elements.
//
// Two curves are compared as curves: the distance of a state of one from the other, of load and of every vector of outputs, each over its
// range, so that a structure that snaps a little earlier is a little off.
#pragma once

#include "sim/model/model.h"
#include "sim/run/linear_limit.h"
#include "sim/run/load_path.h"

#include <functional>
#include <vector>

namespace flexframe::sim {

// A path as it was followed, with what tells how right it is.
struct FollowedPath {
  LoadPath path;
  std::vector<EffectState> effects;
  std::vector<LinearLimit> limits;  // how far its bodies were bent
  size_t directions = 0;            // coordinates that are sought
  double size = 1.0;                // of the mechanism, m
  double force = 0.0;               // the largest that acts in it at any state, N
};
using FollowPath = std::function<FollowedPath(const Scene&)>;

// How far a state of `path` lies from the curve `other`, at most.
struct OffCurve {
  double share = 0.0;  // of the range of `column`
  std::string column;  // "load" or an output, a vector by its name; empty: the path ends early, the other one does not
  double load = 0.0;   // of that state
};
// Columns that `other` does not have are not compared, nor states beyond its end where it ends early. loads: the range of loads; size: of
// the mechanism, m; force: the largest in it, N. What moves by less than a thousandth of others of its kind (moments: of forces times the
// size), or than a millionth of that force (of the size: a billionth), counts by that.
OffCurve off_curve(const LoadPath& path, const LoadPath& other, double loads, double size, double force);

// The path of a scene. Beams with automatic effects get all that they can have where that moves it by more than a third of
// unasked_accuracy, and large_bending where one frame is not enough, notes say so; of what else moves it by more than that, and of beams of
// too few elements, warnings are added. Throws what follow throws for the scene itself.
LoadPath judged_load_path(const Scene& scene, const LoadPathOptions& options, const FollowPath& follow);

}  // namespace flexframe::sim
