// Sparse rows of scalar weights and their products with blocks of vectors, three components side by side.
#pragma once

#include "interp/types.h"

#include <cstdint>
#include <span>
#include <vector>

namespace flexframe::interp {

// Compressed rows: entries of row i at begin[i]..begin[i+1].
struct SparseWeights {
  int rows = 0, cols = 0;
  std::vector<std::int64_t> begin{0};
  std::vector<int> column;
  std::vector<float> single;    // float32 values
  std::vector<double> precise;  // the same in double, or empty
};

// Sources of both side by side, those of the first before those of the second: (1 - share) a and share b. Rows of both: the same vertices.
// In double where both are.
SparseWeights join_weights(const SparseWeights& a, const SparseWeights& b, double share);

// out (rows x 3) = weights * sources (cols x 3), one row after the other; scatter[v] is the row of output vertex v.
void multiply_single(const SparseWeights& weights, const PointsF& sources, std::span<const int> scatter, std::span<float> out, int threads);
Points multiply_precise(const SparseWeights& weights, const Points& sources, std::span<const int> scatter);

// Weights times many columns: sources cols x 3 F row-major (x y z of picture 0, of picture 1, ...), out rows x 3 F likewise.
using RowsF = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
void multiply_rows(const SparseWeights& weights, const RowsF& sources, RowsF& out, int threads);

}  // namespace flexframe::interp
