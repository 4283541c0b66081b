#include "sim/time/power_series.h"

#include "sim/base/four.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstring>

namespace flexframe::sim {
namespace {

// Vectors go by reference: how they would be returned depends on the processor.
template <typename V>
inline __attribute__((always_inline)) void load(const double* from, V& v) {
  std::memcpy(&v, from, sizeof(V));
}

// One power's numbers of w in 8 blocks rows, and the largest of them, weighted. Sums stay in registers, several for each row so that
// additions need not wait for each other: of eight rows four, of more two, as more than that leave registers of four numbers.
template <typename V, int blocks>
inline __attribute__((always_inline)) void next_rows(const PowerSeries& s, int first, const double* from, double factor,
                                                     const double* loads, double* to, V& largest) {
  constexpr int lanes = sizeof(V) / sizeof(double), W = 8 * blocks / lanes, sums = blocks == 1 ? 4 : 2;
  V sum[sums][W] = {};
  const double* A = s.matrix + first;
  const auto add = [&](int j, const double* x) __attribute__((always_inline)) {
    for (int w = 0; w < W; ++w) {
      V a;
      load(A + static_cast<Eigen::Index>(w) * lanes, a);
      sum[j][w] += a * *x;
    }
    A += s.rows;
  };
  const auto add_block = [&](const double* x) __attribute__((always_inline)) {
    int k = 0;
    for (; k + sums <= s.n; k += sums)
      for (int j = 0; j < sums; ++j) add(j, x + k + j);
    for (; k < s.n; ++k) add(0, x + k);
  };
  add_block(from - s.rows);  // p of the power before
  add_block(from);
  add_block(from + s.rows);
  for (int w = 0; w < W; ++w) {
    const Eigen::Index at = first + static_cast<Eigen::Index>(w) * lanes;
    V whole = sum[0][w] + sum[1][w], other;
    if constexpr (sums == 4) whole += sum[2][w] + sum[3][w];
    if (loads) {
      load(loads + at, other);
      whole += other;
    }
    whole *= factor;
    std::memcpy(to + at, &whole, sizeof(V));
    load(s.weights + at, other);
    const V size = (whole < 0.0 ? -whole : whole) * other;
    largest = size <= largest ? largest : size;
  }
}

template <typename V>
inline __attribute__((always_inline)) int expand_by(const PowerSeries& s, int most_terms, double* terms) {
  constexpr int lanes = sizeof(V) / sizeof(double);
  const Eigen::Index stride = 2 * static_cast<Eigen::Index>(s.rows);
  int small = 0;
  for (int k = 0; k < most_terms; ++k) {
    const double factor = s.length / (k + 1.0);
    const double* from = terms + (k + 1) * stride;
    double* to = terms + (k + 2) * stride;
    const double* loads = k < 3 ? s.loads + k * stride : nullptr;
    V largest = {};
    int i = 0;
    for (; i + 24 <= s.rows; i += 24) next_rows<V, 3>(s, i, from, factor, loads, to, largest);
    if (s.rows - i == 16) next_rows<V, 2>(s, i, from, factor, loads, to, largest);
    else if (s.rows - i == 8) next_rows<V, 1>(s, i, from, factor, loads, to, largest);
    for (Eigen::Index j = 0; j < s.rows; j += lanes) {
      V p, other;
      load(from + j, p);
      if (loads) {
        load(loads + s.rows + j, other);
        p += other;
      }
      p *= factor;
      std::memcpy(to + s.rows + j, &p, sizeof(V));
    }
    double sum = largest[0], most = largest[0];
    for (int j = 1; j < lanes; ++j) {
      sum += largest[j];
      most = largest[j] > most ? largest[j] : most;
    }
    if (!(sum < 1e300)) return 0;
    small = most < s.negligible ? small + 1 : 0;
    if (small >= 2 && k >= 3) return k + 2;
  }
  return 0;
}

typedef double Two __attribute__((vector_size(16)));
#if defined(__x86_64__) && defined(__GNUC__)
typedef double Eight __attribute__((vector_size(64)));
__attribute__((target("avx2"))) int expand_avx2(const PowerSeries& s, int most_terms, double* terms) {
  return expand_by<Four>(s, most_terms, terms);
}
__attribute__((target("avx512f"))) int expand_avx512(const PowerSeries& s, int most_terms, double* terms) {
  return expand_by<Eight>(s, most_terms, terms);
}
#endif

}  // namespace

int expand(const PowerSeries& series, int most_terms, double* terms) {
#if defined(__x86_64__) && defined(__GNUC__)
  static const bool avx512 = __builtin_cpu_supports("avx512f") != 0, avx2 = __builtin_cpu_supports("avx2") != 0;
  if (avx512) return expand_avx512(series, most_terms, terms);
  if (avx2) return expand_avx2(series, most_terms, terms);
#endif
  return expand_by<Two>(series, most_terms, terms);
}

namespace {

// N numbers of every column, kept in registers.
template <int N>
FLEXFRAME_INLINE void evaluate_rows(const double* terms, std::ptrdiff_t size, int count, double x, double* out) {
  double z[N] = {};
  for (std::ptrdiff_t k = count; k-- > 0;) {
    const double* const c = terms + k * size;
    for (int i = 0; i < N; ++i) z[i] = z[i] * x + c[i];
  }
  for (int i = 0; i < N; ++i) out[i] = z[i];
}

FLEXFRAME_WIDE
void evaluate(const Powers& p, double x, double* out) {
  int i = 0;
  for (; i + 16 <= p.size; i += 16) evaluate_rows<16>(p.terms + i, p.stride, p.count, x, out + i);
  for (; i + 4 <= p.size; i += 4) evaluate_rows<4>(p.terms + i, p.stride, p.count, x, out + i);
  for (; i < p.size; ++i) evaluate_rows<1>(p.terms + i, p.stride, p.count, x, out + i);
}

// Every product waits for the one before: two registers at four places keep the processor busy.
FLEXFRAME_WIDE
void evaluate_four(const Powers& p, const double* x, double* out) {
  for (int i = 0; i + 8 <= p.size; i += 8) {
    Four low[4] = {}, high[4] = {};
    for (std::ptrdiff_t k = p.count; k-- > 0;) {
      const double* const c = p.terms + k * p.stride + i;
      for (int l = 0; l < 4; ++l) {
        low[l] = low[l] * x[l] + four(c).v;
        high[l] = high[l] * x[l] + four(c + 4).v;
      }
    }
    for (int l = 0; l < 4; ++l) {
      four(out + l * p.size + i).v = low[l];
      four(out + l * p.size + i + 4).v = high[l];
    }
  }
}

}  // namespace

// clang compiles for wider registers only what no header declares before.
void evaluate_powers(const Powers& powers, double x, double* out) { evaluate(powers, x, out); }
void evaluate_powers_four(const Powers& powers, const double* x, double* out) { evaluate_four(powers, x, out); }

}  // namespace flexframe::sim
