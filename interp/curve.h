// Nodes with rotations along curved lines: arcs, rings, helices, frames of bars.
//
// A chain is a row of nodes that follow one another inside a slender body. Its rest line is the spline through them; the rotations of its
// nodes are interpolated by the same spline in frames that move along the line (less the chain's best rigid motion, which is exact), and
// the line follows from them, u' = (R - I) c'. What is left between two nodes is closed by the bending of an unloaded beam (for a straight
// line that makes Hermite's cubic, the exact shape) and by stretch. Sections stay rigid: u(x) = u(s) + (R(s) - I) (x - c(s)).
//
// Sources per station of a chain (nodes and subdivisions between them): 4 vectors, the displacement of the line and the turned directions
// (R - I) e_x, (R - I) e_y, (R - I) e_z. Vertices take them by weights, Hermite's between two stations.
// Sources: Simo, Vu-Quoc, A three-dimensional finite-strain rod model II, 1986, eq. 2.4 (line and sections); Wang et al., Computation of
// rotation minimizing frames, 2008, table I (frames along the line); spline.h.
#pragma once

#include "interp/sparse.h"
#include "interp/spline.h"
#include "interp/types.h"

#include <vector>

namespace flexframe::interp {

struct Chain {
  std::vector<int> node;     // in order; of a closed chain each once
  bool closed = false;       // the last is followed by the first
  int first_source = 0;      // of its first station
  int stations = 0;          // of a closed chain the first is not repeated
  std::vector<double> s;     // parameter at the points of the grid: two steps a station, m
  SplineRows rows;           // grid x nodes
  Points centre, tangent;    // of the grid's points: c (m) and c' = dc/ds
  std::vector<Mat3> frame;   // of the grid's points: moves along the line with no more twist than it must
  std::vector<double> span;  // lengths of the intervals between nodes, m
};

struct CurveLift {
  Points positions;   // of the nodes
  bool given = true;  // rotations come with the data; else they are estimated from the line, without twist
  std::vector<Chain> chains;
};

// Nodes that follow one another. One node alone is a chain of one station.
struct NodeRow {
  std::vector<int> node;
  bool closed = false;  // the first follows the last, without a corner
};
// nodes: N x 3, m. Distances between nodes that follow one another must not be zero.
CurveLift make_curves(const Points& nodes, const std::vector<NodeRow>& rows, bool rotations_given);

// Number P of the sources. lift_exact and lift_linear: the sources (P x 3, m) of nodes that are displaced (N x 3, m) and turned (N x 3
// rotation vectors, rad; 0 x 3 where rotations are not given); exact for large rotations, and linear for modes.
int source_count(const CurveLift& curves);
Points lift_exact(const CurveLift& curves, const Points& displacement, const Points& rotation);
Points lift_linear(const CurveLift& curves, const Points& displacement, const Points& rotation);

// Where a vertex hangs: on chain `chain` between two stations. Distance to the line, m.
struct Foot {
  int chain = -1, station = 0;
  double share = 0.0, distance = 0.0;
};
// The nearest foot on the intervals between nodes `first` and `last` (of the chain's row; last beyond the row's end: round a closed one).
Foot find_foot(const CurveLift& curves, int chain, int first, int last, const Vec3& x);

// Weights of a vertex that hangs on several feet, by shares that sum to one: entries (source, weight) are added to `out`.
void add_foot(const CurveLift& curves, const Foot& foot, double share, const Vec3& x, std::vector<std::pair<int, double>>& out);

// Largest amplification of the nodes' rotations by the splines.
double curve_lebesgue(const CurveLift& curves);

}  // namespace flexframe::interp
