// Inner loops of the mode products: sums of columns with factors, for one frame and for batches of frames.
// The columns lie in tiles of 48 rows (16 vertices): all columns of a tile one after the other, then the next tile. So a product
// reads one stream from end to end, which processors fetch ahead best, and the sums of a tile stay in registers.
// Every output element is the sum over the columns in their order, one multiplication and one addition each, whatever the
// instruction set: all paths give the same bits.
#pragma once

#include <Eigen/Dense>

#include <span>

namespace flexframe::interp {

inline constexpr Eigen::Index tile_rows = 48;

// Element i of column k of n columns stands at tiles[tile_place(i, k, n)].
inline Eigen::Index tile_place(Eigen::Index i, Eigen::Index k, Eigen::Index n) {
  return (i / tile_rows * n + k) * tile_rows + i % tile_rows;
}

// out[i] = sum_k factor[k] * column k at i, for the out.size() rows from the first of a tile on; the last tile may be cut.
void combine_tiles(const float* tiles, std::span<const float> factor, std::span<float> out);

// Rows to give to combine_tiles_batch at once, so that they stay in the second-level cache for n columns: whole tiles.
int batch_rows(Eigen::Index n);

// out[i + f * out_stride] = sum_k factor(k, f) * column k at i, i < rows.
void combine_tiles_batch(const float* tiles, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, int rows);

}  // namespace flexframe::interp
