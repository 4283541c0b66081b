// Values that were sampled along a step: the parabola closest to them, in which what oscillates is averaged, and what vibrations make of
// the rest.
#pragma once

#include "sim/base/types.h"

namespace flexframe::sim {

// values: a column a place, at 0, 1 / m, ..., 1 of the step (m + 1 of them). every: only each of that many is looked at; at least three.
// Least squares with the weights of the trapezium rule, so that many places give the integrals of the values times 1, x and x^2. Out, in
// the values' units: a row a value, the coefficients of 1, x and x^2, x from -1 at the step's beginning to 1 at its end.
MatX closest_parabola(const MatX& values, Eigen::Index every = 1);

// Values at twice as many places: the ones known stand at the even columns, the odd ones are zero.
MatX spread(const MatX& values);

// Amounts p'' + f^2 p = load, w = p', from rest, the load known at the places only: sums of the trapezium rule over cos(f s) load and
// sin(f s) load, which are linear between the places. Errors: those of the rule, second order in f span / m.
struct Shaken {
  VecX frequencies;   // rad/s, n
  double span = 0.0;  // s
  MatX sums;          // 2 n x (m + 1)
  bool empty() const { return sums.size() == 0; }
  // [p; w] at s seconds from the beginning.
  VecX at(double s) const;
};
// loads: n x (m + 1), a column a place.
Shaken shake(const VecX& frequencies, double span, const MatX& loads);

}  // namespace flexframe::sim
