// Inner loops of the mode products: sums of columns with factors, for one frame and for batches of frames.
// Every output element is the sum over the columns in their order, one multiplication and one addition each, whatever the
// instruction set: all paths give the same bits.
#pragma once

#include <Eigen/Dense>

#include <span>

namespace flexframe::interp {

// out[i] = sum_k factor[k] * columns[i + k * stride].
void combine_columns(const float* columns, Eigen::Index stride, std::span<const float> factor, std::span<float> out);

// Rows to give to combine_columns_batch at once, so that they stay in the second-level cache for n columns.
int batch_rows(Eigen::Index n);

// out[i + f * out_stride] = sum_k factor(k, f) * columns[i + k * stride], i < rows.
void combine_columns_batch(const float* columns, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, int rows);

}  // namespace flexframe::interp
