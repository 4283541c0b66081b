// Interpolation along a line by the spline of fifth degree: the weights of n values in the value and the slope anywhere on it.
// Source: de Boor, A practical guide to splines, 1978, ch. X (B-splines), ch. XIII (interpolation; not-a-knot ends).
#pragma once

#include "interp/types.h"

#include <Eigen/Sparse>

#include <span>

namespace flexframe::interp {

struct SplineRows {
  Eigen::SparseMatrix<double, Eigen::RowMajor> value, slope;  // wanted x n; slopes per unit of the parameter
  double lebesgue = 1.0;                                      // largest sum of |weight| of a value
};

// at: n parameters, increasing; wanted: parameters from at.front() to at.back(), increasing. period > 0: the line is closed, the value at
// at.front() + period is that at at.front() and wanted may go up to there. Fifth degree where there are six values, less where there are
// fewer or where uneven parameters make it amplify errors more than four times. Throws ArgumentError for fewer than two values.
SplineRows spline_rows(std::span<const double> at, std::span<const double> wanted, double period);

}  // namespace flexframe::interp
