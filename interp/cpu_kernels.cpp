#include "interp/cpu_kernels.h"

#include <algorithm>
#include <cstring>
#include <vector>

// AVX2 where the machine has it; without fused multiplication the bits are those of plain code.
#if defined(__x86_64__) && defined(__GNUC__)
#define FLEXFRAME_AVX2 __attribute__((target("avx2")))
#define FLEXFRAME_HAS_AVX2 1
#else
#define FLEXFRAME_HAS_AVX2 0
#endif

namespace flexframe::interp {
namespace {

constexpr Eigen::Index tile = 16;   // rows of the inner loops
constexpr Eigen::Index group = 4;   // frames of the inner loops

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

// One tile of rows (packed n x tile) for four frames (factors n x 4).
inline __attribute__((always_inline)) void tile_product(const float* __restrict packed, const float* __restrict q, Eigen::Index n, float* __restrict sums) {
  // Eight sums of eight floats stay in the registers over all columns.
  typedef float Eight __attribute__((vector_size(32)));
  static_assert(tile == 16 && group == 4);
  Eight a0{}, a1{}, b0{}, b1{}, c0{}, c1{}, d0{}, d1{};
  for (Eigen::Index k = 0; k < n; ++k) {
    Eight low, high;
    std::memcpy(&low, packed + k * tile, sizeof low);
    std::memcpy(&high, packed + k * tile + 8, sizeof high);
    const float* f = q + group * k;
    a0 += low * f[0];
    a1 += high * f[0];
    b0 += low * f[1];
    b1 += high * f[1];
    c0 += low * f[2];
    c1 += high * f[2];
    d0 += low * f[3];
    d1 += high * f[3];
  }
  for (const Eight* sum : {&a0, &a1, &b0, &b1, &c0, &c1, &d0, &d1}) {
    std::memcpy(sums, sum, sizeof *sum);
    sums += 8;
  }
}

inline __attribute__((always_inline)) void combine_batch(const float* c, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out,
                                                         Eigen::Index out_stride, Eigen::Index rows) {
  const Eigen::Index n = factor.rows(), frames = factor.cols(), tiles = (rows + tile - 1) / tile;
  thread_local std::vector<float> packed, q;
  // Few columns: writing the frames is all the work, packing would only add to it.
  if (n <= 4) {
    q.resize(static_cast<size_t>(n));
    for (Eigen::Index f = 0; f < frames; ++f) {
      for (Eigen::Index k = 0; k < n; ++k) q[static_cast<size_t>(k)] = factor(k, f);
      combine(c, stride, q, out + f * out_stride, rows);
    }
    return;
  }
  packed.resize(static_cast<size_t>(tiles * tile * n));
  // Rows of a tile side by side for all columns; the last tile is filled with zeros.
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index t = 0; t < tiles; ++t) {
      float* to = packed.data() + (t * n + k) * tile;
      const Eigen::Index count = std::min(tile, rows - t * tile);
      std::copy(c + k * stride + t * tile, c + k * stride + t * tile + count, to);
      std::fill(to + count, to + tile, 0.0f);
    }
  q.resize(static_cast<size_t>(group * n));
  float sums[group * tile];
  for (Eigen::Index f = 0; f < frames; f += group) {
    const Eigen::Index width = std::min(group, frames - f);
    for (Eigen::Index k = 0; k < n; ++k)
      for (Eigen::Index g = 0; g < group; ++g) q[static_cast<size_t>(group * k + g)] = g < width ? factor(k, f + g) : 0.0f;
    for (Eigen::Index t = 0; t < tiles; ++t) {
      tile_product(packed.data() + t * n * tile, q.data(), n, sums);
      const Eigen::Index count = std::min(tile, rows - t * tile);
      for (Eigen::Index g = 0; g < width; ++g) std::copy(sums + g * tile, sums + g * tile + count, out + (f + g) * out_stride + t * tile);
    }
  }
}

#if FLEXFRAME_HAS_AVX2
FLEXFRAME_AVX2 void combine_avx2(const float* c, Eigen::Index stride, std::span<const float> q, float* out, Eigen::Index rows) { combine(c, stride, q, out, rows); }
FLEXFRAME_AVX2 void combine_batch_avx2(const float* c, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, Eigen::Index rows) {
  combine_batch(c, stride, factor, out, out_stride, rows);
}
bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}
#endif

}  // namespace

void combine_columns(const float* columns, Eigen::Index stride, std::span<const float> factor, std::span<float> out) {
  const auto rows = static_cast<Eigen::Index>(out.size());
#if FLEXFRAME_HAS_AVX2
  if (has_avx2()) return combine_avx2(columns, stride, factor, out.data(), rows);
#endif
  combine(columns, stride, factor, out.data(), rows);
}

int batch_rows(Eigen::Index n) {
  // 256 KiB of columns, whole tiles, at least 16 tiles.
  const Eigen::Index rows = 65536 / std::max<Eigen::Index>(1, n) / tile * tile;
  return static_cast<int>(std::clamp<Eigen::Index>(rows, 16 * tile, 8192));
}

void combine_columns_batch(const float* columns, Eigen::Index stride, const Eigen::MatrixXf& factor, float* out, Eigen::Index out_stride, int rows) {
#if FLEXFRAME_HAS_AVX2
  if (has_avx2()) return combine_batch_avx2(columns, stride, factor, out, out_stride, rows);
#endif
  combine_batch(columns, stride, factor, out, out_stride, rows);
}

}  // namespace flexframe::interp
