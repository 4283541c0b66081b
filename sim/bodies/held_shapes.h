// The lowest modes and the static shapes of a long thin body as it is held, by its banded matrices: O(length x shapes^2).
#pragma once

#include "sim/base/types.h"

#include <Eigen/SparseCore>

#include <vector>

namespace flexframe::sim {

using BandMatrix = Eigen::SparseMatrix<double>;

// n coordinates, numbered along the body.
struct LongBody {
  BandMatrix K, M;         // n x n, symmetric; M positive definite, K positive definite but for the rigid motions
  MatX rigid;              // n x r, the rigid motions
  std::vector<int> clamp;  // r coordinates that hold the body in a statically determined way
  VecX scale;              // n, the unit in which a coordinate is measured, so that all are comparable
};

struct Holds {
  MatX holds;            // n x h, what joints hold: columns^T x = 0
  MatX loads;            // n x l, unit loads
  int places = 0;        // at how many places between its ends the body is held: the spans may all have the same frequencies
  bool inertia = false;  // the inertia of motions of what holds the body loads it too
};

// Shapes, n x any, all of them orthogonal by mass to the rigid motions, orthonormal by mass: the span of the `count` lowest vibrations of
// the held body (Craig, Bampton, AIAA J. 6, 1968), the deformations by motions of what holds it against each other, and, for the vibrations
// left out, the static deflections under the unit loads (MacNeal, Computers & Structures 1, 1971). With Holds::inertia they are loads too
// that the rigid motions and those deformations make by their inertia (the next term of the dynamic stiffness in squares of frequencies):
// frequencies of the body on holds that give way then converge faster with the number of vibrations.
MatX held_shapes(const LongBody& body, const Holds& holds, int count);

// The `count` lowest vibrations of the held body alone, ascending: n x count (fewer where there are no more), orthonormal by mass.
// stiffness: the squares of their angular frequencies. A block Krylov space of the static response to inertia, whose values are counted by
// Sturm's theorem; bodies of few coordinates and what fails the count are solved whole.
MatX held_vibrations(const LongBody& body, const Holds& holds, int count, VecX& stiffness);

}  // namespace flexframe::sim
