// Eigenvalues and eigenforms of the uniform Euler-Bernoulli beam, and of its lengthening and twist, for every boundary.
//
// Bending: phi(xi) = a cos(lambda xi) + b sin(lambda xi) + c exp(-lambda xi) + d exp(-lambda (1 - xi)), xi = x/L. It is Heckmann et al.
// 2006 eq. 10 with the growing exponential counted from the tip, so that nothing overflows or cancels, however high the mode (the usual
// cosh - cos - sigma (sinh - sin) loses all digits near mode 12). Lengthening, twist: sin or cos of lambda xi. Only elastic forms are
// counted: mode 1 of supported_free is lambda = 3.9266, of free_free 4.7300.
#pragma once

#include "sim/scene/scene.h"

namespace flexframe::sim::beam {

// A form normalised to int_0^1 phi^2 dxi = 1, positive where it leaves the root.
struct Eigenform {
  double lambda = 0.0;                                                 // wave number times L
  double cosine = 0.0, sine = 0.0, root_decay = 0.0, tip_decay = 0.0;  // a b c d
};

// Mode (1, 2, ...) of bending: omega = (lambda/L)^2 sqrt(EI / rho A). Accurate to the last digits of a double.
Eigenform bending_form(Boundary boundary, int mode);

// Mode of lengthening: omega = lambda/L sqrt(E/rho), or of twist: omega = lambda/L sqrt(G J / (rho (Iy + Iz))).
// Held at the root and free at the tip; both ends free for free_free, both held for clamped_clamped.
Eigenform rod_form(Boundary boundary, int mode);

// d^order phi / dxi^order, order 0 .. 3.
double evaluate(const Eigenform& form, double xi, int order);

}  // namespace flexframe::sim::beam
