// Series of samples, a row each: what whole columns of them tell.
#pragma once

#include "sim/base/types.h"

namespace flexframe::sim {

// Largest minus smallest value of every column, in its unit; rows are gone through as they lie in memory. Empty where there is no row.
inline VecX column_ranges(const RowsX& series) {
  if (series.rows() == 0) return {};
  Eigen::RowVectorXd least = series.row(0), most = least;
  for (Eigen::Index i = 1; i < series.rows(); ++i) {
    least = least.cwiseMin(series.row(i));
    most = most.cwiseMax(series.row(i));
  }
  return (most - least).transpose();
}

}  // namespace flexframe::sim
