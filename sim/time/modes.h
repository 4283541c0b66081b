// Modes of w' = A p + B w + load, p' = w + load: amounts in which A is as good as diagonal, and where fast ones rest.
//
// A fast vibration is split into what the rest of the motion and the loads hold it at, and its free part (free_motion.h). Once that is
// taken out the mode rests, whatever its inertia is: with more of it (its row of the equations times less than one) it vibrates no faster
// than anything else has to be followed, and is held at the same place to second order.
#pragma once

#include "sim/base/types.h"

namespace flexframe::sim {

struct Modes {
  MatX shapes, gauges;  // n x n, gauges shapes = 1: w = shapes amounts, amounts = gauges w
  MatX A, B, A1;        // in amounts; A1 (1/s^3): change of A in time
  VecX frequencies;     // rad/s of what vibrates, 0 of what does not or is no mode
};

// A x; for tens of rows a general library takes twice as long.
VecX times(const MatX& A, const Eigen::Ref<const VecX>& x);

// The same into `y`, which is not x: where it has room for it nothing is asked for.
void times_into(const MatX& A, const VecX& x, VecX& y);

// Shapes and gauges of A by its eigenvectors (real and imaginary parts of complex ones); false where there are no n independent ones.
bool find_modes(const MatX& A, Modes& modes);
// A alone in amounts: enough to tell how far the shapes are from its own.
void express_matrix(const MatX& A, Modes& modes);
// All else of `modes` from the shapes and A in amounts.
void express_others(const MatX& B, const MatX& A1, Modes& modes);
// How far the shapes are from those of A, as expressed: the largest share of one that has to be added to another.
double mixing(const Modes& modes);
// Shapes and gauges that are as good as the square of that; false where they are not close enough. All else has to be expressed anew.
bool renew_modes(Modes& modes);

// Amounts at a time, tau seconds after that of A, and the loads there with their rates: n numbers each.
struct ModalState {
  double tau;
  VecX w, p, load_w, load_p, rate_w, rate_p;
};

// Sizes of errors: weights of an amount of w and of p; the number of components that their mean is over.
struct ModalWeights {
  VecX w, p;
  double size;
};

// Where the modes marked in `fast` (1, else 0) rest under the loads and the motion of the others: u, v of p and w, zero of the others.
void held_at(const Modes& modes, const VecX& fast, const ModalState& state, VecX& u, VecX& v);

}  // namespace flexframe::sim
