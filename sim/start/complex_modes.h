// Modes of M x'' + D x' + K x = 0 with any D and K: damped, gyroscopic and circulatory systems.
//
// The equations are written in the undamped modes of the symmetric part of K (M = 1 there). What D and the skew part of K do not couple is
// solved in closed form; the rest as x' = v, v' = -K x - D v with a general eigenvalue solver, every coordinate scaled by its frequency.
// Low frequencies keep their digits beside high ones: the symmetric problem is solved again for those below 1e-8 of the largest omega^2,
// without the others, and roots whose damping the general solver does not resolve are found again by Newton's method on the equations.
//
// An eigenvalue can be told to the digits of its matrices only: entries known to E shift a simple eigenvalue with left and right
// vectors l, r (l r = 1) by |l| E |r| (Wilkinson, The Algebraic Eigenvalue Problem, 1965, ch. 2 sec. 9), and split a double one, as every
// rigid-body mode is, by about sqrt(E). What lies within that distance of zero counts as zero: rounding makes no mode unstable.
#pragma once

#include "sim/base/types.h"

#include <complex>
#include <functional>
#include <vector>

namespace flexframe::sim {

struct SecondOrder {
  MatX M, D, K;           // n x n: kg, N s/m, N/m (or what the coordinates make of them); M symmetric and positive definite
  MatX D_error, K_error;  // n x n, >= 0: to how much each entry is known
};

struct ComplexMode {
  std::complex<double> lambda;  // rad/s; of a pair the one with Im >= 0; 0: a motion without stiffness
  double error = 0.0;           // rad/s, to how much lambda is known
  Eigen::VectorXcd x;           // n, the entry with the largest modulus is 1
};

// Every pair of conjugate eigenvalues once, every real one by itself; of a zero eigenvalue each motion once, not the pair of position and
// velocity. Real parts (imaginary ones) below what their error resolves are zero. In no order. Throws SimulationError where M is not
// positive definite.
std::vector<ComplexMode> complex_modes(const SecondOrder& system);

// Further states z of first order beside the motion: M x'' + D x' + K x = G z, z' = A z + B x + B_rate x'. n_z rows and columns.
struct FurtherStates {
  MatX A;          // n_z x n_z, 1/s
  MatX B, B_rate;  // n_z x n
  MatX G;          // n x n_z
};

// As complex_modes, with further states, whose own motions count too (an integrator that nothing holds: 0). Their matrices are known to
// 1e-9 of each entry. x of a mode is its displacement; it is zero where only the states move.
std::vector<ComplexMode> complex_modes(const SecondOrder& system, const FurtherStates& states);

// Of z' = A z, with displacements x = shape(z); A is taken as known to 1e-13 of the products that its entries are made of (A_size, n x n).
std::vector<ComplexMode> first_order_modes(const MatX& A, const MatX& A_size,
                                           const std::function<Eigen::VectorXcd(const Eigen::VectorXcd&)>& shape);

}  // namespace flexframe::sim
