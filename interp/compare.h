// Which of two maps of a body is the better one: by leaving nodes out, by smooth motions, by the softest motions of an elastic surface.
#pragma once

#include "interp/known.h"
#include "interp/partition.h"

#include <string>

namespace flexframe::interp {

// Root mean square over the motions of the map's error as leaving nodes out tells it (MeanError), relative to what deforms. A motion counts
// as 1 at most, so that one that nobody can follow does not decide. NaN: no motion, or no prediction.
// lift and leave_one_out stand in for those of the map.
double left_out_error(const Map& map, const Weld& weld, const NodeMotions& known);

// A map and its rows to the vertices (welded vertices x sources).
struct Candidate {
  const Map& map;
  const SparseWeights& weights;
};

// How much of b to take beside a: with 1 - share of a and share of b, 0..1, leaving nodes out makes the least error of all blends
// (stacking: D. H. Wolpert, Stacked generalization, Neural Networks 5, 1992; L. Breiman, Stacked regressions, Machine Learning 24, 1996):
// errors that do not go together cancel. Leaving nodes out cannot rank two maps that lie nearer to each other than 0.4 of what it tells of
// either, so half of both is taken then; and says nothing where they lie farther apart than both are told to err: share NaN.
struct BestBlend {
  double share = 0.0, error = 0.0;  // error: of the blend, as left_out_error; NaN: not known
};
BestBlend best_blend(const Candidate& a, const Candidate& b, const Weld& weld, const NodeMotions& known);

// Why the elastic surface (map.lift, elastic.weights) is worse than the kernel, or empty: the kernel follows the body's softest motions as
// the elastic surface has them, and is the better one in smooth motions that every body can do. A thin body with two faces is one whose far
// face hangs on its rim alone. Limits: interp/README.md.
std::string bends_worse(const Weld& weld, const Map& map, const Partition& elastic, const Partition& kernel);

}  // namespace flexframe::interp
