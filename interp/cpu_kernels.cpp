#include "interp/cpu_kernels.h"

#include <algorithm>
#include <cstring>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__)
#define FLEXFRAME_TARGET(name) __attribute__((target(name)))
#define FLEXFRAME_X86 1
#else
#define FLEXFRAME_X86 0
#endif
// Loops over sums that are to stay in registers.
#if defined(__clang__)
#define FLEXFRAME_UNROLL _Pragma("clang loop unroll(full)")
#else
#define FLEXFRAME_UNROLL _Pragma("GCC unroll 24")
#endif

namespace flexframe::interp {
namespace {

constexpr Eigen::Index cache_line = 64 / sizeof(float);

// One frame: the sums of a tile stay in registers over its columns.
template <typename V>
inline __attribute__((always_inline)) void combine(const float* __restrict tiles, std::span<const float> q, float* __restrict out,
                                                   Eigen::Index rows) {
  constexpr Eigen::Index lanes = sizeof(V) / sizeof(float);
  constexpr int W = static_cast<int>(tile_rows / lanes);
  const auto n = static_cast<Eigen::Index>(q.size());
  for (Eigen::Index first = 0; first < rows; first += tile_rows) {
    const float* from = tiles + first * n;
    V sum[W];
    FLEXFRAME_UNROLL
    for (int w = 0; w < W; ++w) sum[w] = V{};
    for (Eigen::Index k = 0; k < n; ++k) FLEXFRAME_UNROLL
    for (int w = 0; w < W; ++w) {
      V row;
      std::memcpy(&row, from + k * tile_rows + w * lanes, sizeof(V));
      sum[w] += row * q[k];
    }
    const Eigen::Index count = std::min(tile_rows, rows - first);
    if (count == tile_rows) std::memcpy(out + first, sum, sizeof sum);
    else std::memcpy(out + first, sum, count * sizeof(float));
  }
}

// W vectors of rows of a tile for G frames (q: n x G). The W * G sums stay in registers over all columns.
// out: the first of the rows in the first frame; rows of it and frames that exist are written.
template <typename V, int W, int G>
inline __attribute__((always_inline)) void tile_frames(const float* __restrict from, const float* __restrict q, Eigen::Index n,
                                                       float* __restrict out, Eigen::Index out_stride, Eigen::Index rows,
                                                       Eigen::Index frames) {
  constexpr Eigen::Index lanes = sizeof(V) / sizeof(float), strip = W * lanes;
  // The next strip's places in the frames come to the cache while this one is computed.
  for (Eigen::Index g = 0; g < frames; ++g)
    for (Eigen::Index i = strip; i < 2 * strip; i += cache_line) __builtin_prefetch(out + g * out_stride + i, 1);
  V sum[G][W];
  FLEXFRAME_UNROLL
  for (int g = 0; g < G; ++g) FLEXFRAME_UNROLL
  for (int w = 0; w < W; ++w) sum[g][w] = V{};
  for (Eigen::Index k = 0; k < n; ++k) {
    V row[W];
    FLEXFRAME_UNROLL
    for (int w = 0; w < W; ++w) std::memcpy(&row[w], from + k * tile_rows + w * lanes, sizeof(V));
    FLEXFRAME_UNROLL
    for (int g = 0; g < G; ++g) FLEXFRAME_UNROLL
    for (int w = 0; w < W; ++w) sum[g][w] += row[w] * q[k * G + g];
  }
  FLEXFRAME_UNROLL
  for (int g = 0; g < G; ++g) {
    if (g >= frames) break;
    if (rows == strip) std::memcpy(out + g * out_stride, sum[g], sizeof sum[g]);
    else std::memcpy(out + g * out_stride, sum[g], rows * sizeof(float));
  }
}

// V: vector type; W vectors of rows by G frames: as many sums as leave registers for the rows and a factor.
template <typename V, int W, int G>
inline __attribute__((always_inline)) void combine_batch(const float* tiles, const Eigen::MatrixXf& factor, float* out,
                                                         Eigen::Index out_stride, Eigen::Index rows) {
  constexpr Eigen::Index strip = W * static_cast<Eigen::Index>(sizeof(V) / sizeof(float));
  static_assert(tile_rows % strip == 0);
  const Eigen::Index n = factor.rows(), frames = factor.cols();
  thread_local std::vector<float> q;
  // A few frames at a time over the block: their streams are written side by side, faster than one alone.
  for (Eigen::Index f = 0; f < frames; f += G) {
    const Eigen::Index width = std::min<Eigen::Index>(G, frames - f), side = width > G / 2 ? G : G / 2;
    q.assign(n * side, 0.0f);
    for (Eigen::Index g = 0; g < width; ++g)
      for (Eigen::Index k = 0; k < n; ++k) q[k * side + g] = factor(k, f + g);
    for (Eigen::Index i = 0; i < rows; i += strip) {
      const float* from = tiles + tile_place(i, 0, n);
      float* to = out + f * out_stride + i;
      const Eigen::Index count = std::min(strip, rows - i);
      if (side == G) tile_frames<V, W, G>(from, q.data(), n, to, out_stride, count, width);
      else tile_frames<V, W, G / 2>(from, q.data(), n, to, out_stride, count, width);
    }
  }
}

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));
typedef float Sixteen __attribute__((vector_size(64)));

#if FLEXFRAME_X86
// The widest instructions of the machine; without fused multiplication the bits are those of plain code.
FLEXFRAME_TARGET("avx2") void combine_avx2(const float* tiles, std::span<const float> q, float* out, Eigen::Index rows) {
  combine<Eight>(tiles, q, out, rows);
}
FLEXFRAME_TARGET("avx512f") void combine_avx512(const float* tiles, std::span<const float> q, float* out, Eigen::Index rows) {
  combine<Sixteen>(tiles, q, out, rows);
}
FLEXFRAME_TARGET("avx2")
void combine_batch_avx2(const float* tiles, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, Eigen::Index rows) {
  combine_batch<Eight, 2, 4>(tiles, factor, out, out_stride, rows);
}
FLEXFRAME_TARGET("avx512f,prfchw")
void combine_batch_avx512(const float* tiles, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, Eigen::Index rows) {
  combine_batch<Sixteen, 3, 8>(tiles, factor, out, out_stride, rows);
}
bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}
bool has_avx512() {
  static const bool has = __builtin_cpu_supports("avx512f") != 0;
  return has;
}
#endif

}  // namespace

void combine_tiles(const float* tiles, std::span<const float> factor, std::span<float> out) {
  const auto rows = static_cast<Eigen::Index>(out.size());
#if FLEXFRAME_X86
  if (has_avx512()) return combine_avx512(tiles, factor, out.data(), rows);
  if (has_avx2()) return combine_avx2(tiles, factor, out.data(), rows);
#endif
  combine<Four>(tiles, factor, out.data(), rows);
}

int batch_rows(Eigen::Index n) {
  // 256 KiB of columns, whole tiles, some of them at least.
  const Eigen::Index rows = 65536 / std::max<Eigen::Index>(1, n) / tile_rows * tile_rows;
  return static_cast<int>(std::clamp<Eigen::Index>(rows, 6 * tile_rows, 160 * tile_rows));
}

void combine_tiles_batch(const float* tiles, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, int rows) {
#if FLEXFRAME_X86
  if (has_avx512()) return combine_batch_avx512(tiles, factor, out, out_stride, rows);
  if (has_avx2()) return combine_batch_avx2(tiles, factor, out, out_stride, rows);
#endif
  combine_batch<Four, 2, 4>(tiles, factor, out, out_stride, rows);
}

}  // namespace flexframe::interp
