#include "interp/sparse.h"

#include "interp/parallel.h"

namespace flexframe::interp {

SparseWeights join_weights(const SparseWeights& a, const SparseWeights& b, double share) {
  SparseWeights out;
  out.rows = a.rows;
  out.cols = a.cols + b.cols;
  const bool precise = a.precise.size() == a.column.size() && b.precise.size() == b.column.size();
  const auto add = [&](const SparseWeights& from, int row, int first, double part) {
    for (auto k = from.begin[row]; k < from.begin[row + 1]; ++k) {
      const double weight = precise ? from.precise[k] : static_cast<double>(from.single[k]);
      out.column.push_back(first + from.column[k]);
      out.single.push_back(static_cast<float>(part * weight));
      if (precise) out.precise.push_back(part * weight);
    }
  };
  for (int row = 0; row < a.rows; ++row) {
    add(a, row, 0, 1.0 - share);
    add(b, row, a.cols, share);
    out.begin.push_back(std::ssize(out.column));
  }
  return out;
}

void multiply_single(const SparseWeights& weights, const PointsF& sources, std::span<const int> scatter, std::span<float> out,
                     int threads) {
  const int count = static_cast<int>(scatter.size());
  // Sources padded to four floats: one load, one product, one sum an entry, the same bits as three of each.
  typedef float Four __attribute__((vector_size(16)));
  std::vector<Four> source(sources.rows());
  for (Eigen::Index s = 0; s < sources.rows(); ++s) source[s] = Four{sources(s, 0), sources(s, 1), sources(s, 2), 0.0f};
  parallel_chunks(count, 8192, threads, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      const size_t row = scatter[v];
      Four sum{0.0f, 0.0f, 0.0f, 0.0f};
      for (auto k = weights.begin[row]; k < weights.begin[row + 1]; ++k) sum += weights.single[k] * source[weights.column[k]];
      float* o = out.data() + 3 * static_cast<std::ptrdiff_t>(v);
      o[0] = sum[0];
      o[1] = sum[1];
      o[2] = sum[2];
    }
  });
}

Points multiply_precise(const SparseWeights& weights, const Points& sources, std::span<const int> scatter) {
  if (weights.precise.size() != weights.column.size()) throw InputError("the map has no weights in double precision (option precise)");
  Points out(static_cast<Eigen::Index>(scatter.size()), 3);
  for (size_t v = 0; v < scatter.size(); ++v) {
    const size_t row = scatter[v];
    Vec3 sum = Vec3::Zero();
    for (auto k = weights.begin[row]; k < weights.begin[row + 1]; ++k)
      sum += weights.precise[k] * sources.row(weights.column[k]).transpose();
    out.row(static_cast<Eigen::Index>(v)) = sum.transpose();
  }
  return out;
}

void multiply_rows(const SparseWeights& weights, const RowsF& sources, RowsF& out, int threads) {
  const Eigen::Index width = sources.cols();
  out.resize(weights.rows, width);
  parallel_chunks(weights.rows, 2048, threads, [&](int first, int last) {
    for (int row = first; row < last; ++row) {
      float* o = out.data() + row * width;
      std::fill(o, o + width, 0.0f);
      for (auto k = weights.begin[row]; k < weights.begin[row + 1]; ++k) {
        const float w = weights.single[k];
        const float* s = sources.data() + weights.column[k] * width;
        for (Eigen::Index c = 0; c < width; ++c) o[c] += w * s[c];
      }
    }
  });
}

}  // namespace flexframe::interp
