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

// Up to four columns at a time onto a block that stays in the first-level cache; written out, since compilers make poor loops of it.
inline __attribute__((always_inline)) void add_four(const float* __restrict a, Eigen::Index stride, const float* q, bool first, float* __restrict out, Eigen::Index rows) {
  const float *__restrict b = a + stride, *__restrict c = b + stride, *__restrict d = c + stride;
  const float p = q[0], r = q[1], s = q[2], t = q[3];
  if (first)
    for (Eigen::Index i = 0; i < rows; ++i) out[i] = a[i] * p + b[i] * r + c[i] * s + d[i] * t;
  else
    for (Eigen::Index i = 0; i < rows; ++i) out[i] = out[i] + a[i] * p + b[i] * r + c[i] * s + d[i] * t;
}
inline __attribute__((always_inline)) void add_three(const float* __restrict a, Eigen::Index stride, const float* q, bool first, float* __restrict out, Eigen::Index rows) {
  const float *__restrict b = a + stride, *__restrict c = b + stride;
  const float p = q[0], r = q[1], s = q[2];
  if (first)
    for (Eigen::Index i = 0; i < rows; ++i) out[i] = a[i] * p + b[i] * r + c[i] * s;
  else
    for (Eigen::Index i = 0; i < rows; ++i) out[i] = out[i] + a[i] * p + b[i] * r + c[i] * s;
}
inline __attribute__((always_inline)) void add_one(const float* __restrict a, float p, bool first, float* __restrict out, Eigen::Index rows) {
  if (first)
    for (Eigen::Index i = 0; i < rows; ++i) out[i] = a[i] * p;
  else
    for (Eigen::Index i = 0; i < rows; ++i) out[i] = out[i] + a[i] * p;
}

inline __attribute__((always_inline)) void combine(const float* c, Eigen::Index stride, std::span<const float> q, float* out, Eigen::Index rows) {
  const auto n = static_cast<Eigen::Index>(q.size());
  // Blocks of 16 KiB of the output, so that the sums wait in the cache for the next columns.
  constexpr Eigen::Index block = 4096;
  for (Eigen::Index begin = 0; begin < rows; begin += block) {
    const Eigen::Index count = std::min(block, rows - begin);
    float* o = out + begin;
    Eigen::Index k = 0;
    if (n == 0) std::fill(o, o + count, 0.0f);
    for (; k + 4 <= n; k += 4) add_four(c + begin + k * stride, stride, q.data() + k, k == 0, o, count);
    if (n - k == 3) {
      add_three(c + begin + k * stride, stride, q.data() + k, k == 0, o, count);
    } else {
      for (; k < n; ++k) add_one(c + begin + k * stride, q[static_cast<size_t>(k)], k == 0, o, count);
    }
  }
}

// One tile of rows (W vectors of column k at from + k * step) for G frames (q: n x G). The W * G sums stay in registers over all columns.
// out: the tile's first row in the first frame; rows of it and frames that exist are written.
template <typename V, int W, int G>
inline __attribute__((always_inline)) void tile_frames(const float* __restrict from, Eigen::Index step, const float* __restrict q, Eigen::Index n,
                                                       float* __restrict out, Eigen::Index out_stride, Eigen::Index rows, Eigen::Index frames) {
  constexpr Eigen::Index lanes = sizeof(V) / sizeof(float), tile = W * lanes;
  // The next tile's places in the frames come to the cache while this one is computed.
  for (Eigen::Index g = 0; g < frames; ++g)
    for (Eigen::Index i = tile; i < 2 * tile; i += cache_line) __builtin_prefetch(out + g * out_stride + i, 1);
  V sum[G][W];
  FLEXFRAME_UNROLL
  for (int g = 0; g < G; ++g)
    FLEXFRAME_UNROLL
    for (int w = 0; w < W; ++w) sum[g][w] = V{};
  for (Eigen::Index k = 0; k < n; ++k) {
    V row[W];
    FLEXFRAME_UNROLL
    for (int w = 0; w < W; ++w) std::memcpy(&row[w], from + k * step + w * lanes, sizeof(V));
    FLEXFRAME_UNROLL
    for (int g = 0; g < G; ++g)
      FLEXFRAME_UNROLL
      for (int w = 0; w < W; ++w) sum[g][w] += row[w] * q[k * G + g];
  }
  FLEXFRAME_UNROLL
  for (int g = 0; g < G; ++g) {
    if (g >= frames) break;
    if (rows == tile) std::memcpy(out + g * out_stride, sum[g], sizeof sum[g]);
    else std::memcpy(out + g * out_stride, sum[g], static_cast<size_t>(rows) * sizeof(float));
  }
}

// Columns are read where they lie if the processor's prefetching can follow them: few of them, or not many in the cache.
constexpr Eigen::Index few_columns = 8, few_cached_columns = 24, cached_floats = 1 << 19;

// V: vector type; W vectors of rows by G frames: as many sums as leave registers for the rows and a factor.
template <typename V, int W, int G>
inline __attribute__((always_inline)) void combine_batch(const float* c, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out,
                                                         Eigen::Index out_stride, Eigen::Index rows) {
  constexpr Eigen::Index tile = W * static_cast<Eigen::Index>(sizeof(V) / sizeof(float));
  const Eigen::Index n = factor.rows(), frames = factor.cols(), tiles = (rows + tile - 1) / tile;
  thread_local std::vector<float> packed, q;
  // Else rows of a tile side by side for all columns, read in long runs. The last tile in any case: it is filled with zeros.
  const bool in_place = n <= few_columns || (n <= few_cached_columns && n * stride <= cached_floats);
  const Eigen::Index first_packed = in_place ? rows / tile : 0;
  packed.resize(static_cast<size_t>((tiles - first_packed) * tile * n));
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index t = first_packed; t < tiles; ++t) {
      float* to = packed.data() + ((t - first_packed) * n + k) * tile;
      const float* from = c + k * stride + t * tile;
      const Eigen::Index count = std::min(tile, rows - t * tile);
      if (count == tile) {
        std::memcpy(to, from, static_cast<size_t>(tile) * sizeof(float));
      } else {
        std::copy(from, from + count, to);
        std::fill(to + count, to + tile, 0.0f);
      }
    }
  // A few frames at a time over the block: their streams are written side by side, faster than one alone.
  for (Eigen::Index f = 0; f < frames; f += G) {
    const Eigen::Index width = std::min<Eigen::Index>(G, frames - f), side = width > G / 2 ? G : G / 2;
    q.assign(static_cast<size_t>(n * side), 0.0f);
    for (Eigen::Index g = 0; g < width; ++g)
      for (Eigen::Index k = 0; k < n; ++k) q[static_cast<size_t>(k * side + g)] = factor(k, f + g);
    for (Eigen::Index t = 0; t < tiles; ++t) {
      const bool here = t < first_packed;
      const float* from = here ? c + t * tile : packed.data() + (t - first_packed) * n * tile;
      const Eigen::Index step = here ? stride : tile, count = std::min(tile, rows - t * tile);
      float* to = out + f * out_stride + t * tile;
      if (side == G) tile_frames<V, W, G>(from, step, q.data(), n, to, out_stride, count, width);
      else tile_frames<V, W, G / 2>(from, step, q.data(), n, to, out_stride, count, width);
    }
  }
}

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));
typedef float Sixteen __attribute__((vector_size(64)));

#if FLEXFRAME_X86
// The widest instructions of the machine; without fused multiplication the bits are those of plain code.
FLEXFRAME_TARGET("avx2") void combine_avx2(const float* c, Eigen::Index stride, std::span<const float> q, float* out, Eigen::Index rows) { combine(c, stride, q, out, rows); }
FLEXFRAME_TARGET("avx2") void combine_batch_avx2(const float* c, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, Eigen::Index rows) {
  combine_batch<Eight, 2, 4>(c, stride, factor, out, out_stride, rows);
}
FLEXFRAME_TARGET("avx512f,prfchw") void combine_batch_avx512(const float* c, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, Eigen::Index rows) {
  combine_batch<Sixteen, 3, 8>(c, stride, factor, out, out_stride, rows);
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

void combine_columns(const float* columns, Eigen::Index stride, std::span<const float> factor, std::span<float> out) {
  const auto rows = static_cast<Eigen::Index>(out.size());
#if FLEXFRAME_X86
  if (has_avx2()) return combine_avx2(columns, stride, factor, out.data(), rows);
#endif
  combine(columns, stride, factor, out.data(), rows);
}

int batch_rows(Eigen::Index n) {
  // 256 KiB of columns, whole tiles of 48 rows, some of them at least.
  constexpr Eigen::Index tile = 48;
  const Eigen::Index rows = 65536 / std::max<Eigen::Index>(1, n) / tile * tile;
  return static_cast<int>(std::clamp<Eigen::Index>(rows, 6 * tile, 160 * tile));
}

void combine_columns_batch(const float* columns, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, int rows) {
#if FLEXFRAME_X86
  if (has_avx512()) return combine_batch_avx512(columns, stride, factor, out, out_stride, rows);
  if (has_avx2()) return combine_batch_avx2(columns, stride, factor, out, out_stride, rows);
#endif
  combine_batch<Four, 2, 4>(columns, stride, factor, out, out_stride, rows);
}

}  // namespace flexframe::interp
