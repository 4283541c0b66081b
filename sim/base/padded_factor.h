// The factor of a small matrix that fills up a multiple of four rows, and the solution by it: parts of functions that are compiled for
// wider registers (wide.h). Where the compiler knows the numbers of rows nothing is left of the loops.
#pragma once

#include "sim/base/four.h"

#include <cmath>
#include <cstddef>

namespace flexframe::sim {

// Columns j to j + 3 of a factorisation less what the columns before j, a multiple of four, take from rows i to i + 3.
struct Panel {
  Four column[4];
};
FLEXFRAME_INLINE void subtract_columns(const double* base, std::ptrdiff_t stride, std::ptrdiff_t j, std::ptrdiff_t i, Panel& p) {
  const double* const c = base + j * stride + i;
  Four s0 = four(c).v, s1 = four(c + stride).v, s2 = four(c + 2 * stride).v, s3 = four(c + 3 * stride).v;
  const double* l = base;
  for (std::ptrdiff_t k = 0; k < j; k += 4, l += 4 * stride) {
    const double *const l1 = l + stride, *const l2 = l1 + stride, *const l3 = l2 + stride;
    const Four a = four(l + i).v, b = four(l1 + i).v, d = four(l2 + i).v, e = four(l3 + i).v;
    s0 -= (l[j] * a + l1[j] * b) + (l2[j] * d + l3[j] * e);
    s1 -= (l[j + 1] * a + l1[j + 1] * b) + (l2[j + 1] * d + l3[j + 1] * e);
    s2 -= (l[j + 2] * a + l1[j + 2] * b) + (l2[j + 2] * d + l3[j + 2] * e);
    s3 -= (l[j + 3] * a + l1[j + 3] * b) + (l2[j + 3] * d + l3[j + 3] * e);
  }
  p.column[0] = s0;
  p.column[1] = s1;
  p.column[2] = s2;
  p.column[3] = s3;
}

// base: n x n in the lower half of a square of a multiple of four rows and columns, filled up by a unit matrix. Zeros above.
FLEXFRAME_INLINE bool factorise_columns(double* base, int n, int stride) {
  for (int j = 0; j < n; j += 4) {
    double below[4][4], inverse[4];
    double* const top = base + static_cast<std::ptrdiff_t>(j) * (stride + 1);
    Panel p;
    subtract_columns(base, stride, j, j, p);
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < a; ++b) {
        below[a][b] = p.column[b][a];
        p.column[a] -= below[a][b] * p.column[b];
      }
      // 1e-14: what is left of a diagonal after it has cancelled.
      const double pivot = p.column[a][a];
      if (!(pivot > 1e-14 * top[static_cast<std::ptrdiff_t>(a) * (stride + 1)])) return false;
      const double root = std::sqrt(pivot);
      inverse[a] = 1.0 / root;
      p.column[a] *= inverse[a];
      p.column[a][a] = root;
      for (int b = 0; b < a; ++b) p.column[a][b] = 0.0;
      four(top + static_cast<std::ptrdiff_t>(a) * stride).v = p.column[a];
    }
    for (int i = j + 4; i < stride; i += 4) {
      subtract_columns(base, stride, j, i, p);
      double* const c = base + static_cast<std::ptrdiff_t>(j) * stride + i;
      const Four x = p.column[0] * inverse[0];
      const Four y = (p.column[1] - below[1][0] * x) * inverse[1];
      const Four z = ((p.column[2] - below[2][0] * x) - below[2][1] * y) * inverse[2];
      four(c).v = x;
      four(c + stride).v = y;
      four(c + 2 * static_cast<std::ptrdiff_t>(stride)).v = z;
      four(c + 3 * static_cast<std::ptrdiff_t>(stride)).v =
          (((p.column[3] - below[3][0] * x) - below[3][1] * y) - below[3][2] * z) * inverse[3];
    }
  }
  return true;
}

// v: n values and room for three more. Four columns at a time; L(i, i) and below are read, and up to three values behind a column.
FLEXFRAME_INLINE void solve_columns(const double* L, int n, double* v) {
  const std::ptrdiff_t stride = n;
  int j = 0;
  for (; j + 4 <= n; j += 4) {
    const double *const l0 = L + j * stride, *const l1 = l0 + stride, *const l2 = l1 + stride, *const l3 = l2 + stride;
    const double a = v[j] / l0[j], b = (v[j + 1] - a * l0[j + 1]) / l1[j + 1];
    const double c = ((v[j + 2] - a * l0[j + 2]) - b * l1[j + 2]) / l2[j + 2];
    const double d = (((v[j + 3] - a * l0[j + 3]) - b * l1[j + 3]) - c * l2[j + 3]) / l3[j + 3];
    v[j] = a, v[j + 1] = b, v[j + 2] = c, v[j + 3] = d;
    for (int i = j + 4; i < n; i += 4)
      four(v + i).v = (((four(v + i).v - a * four(l0 + i).v) - b * four(l1 + i).v) - c * four(l2 + i).v) - d * four(l3 + i).v;
  }
  // Up to three columns are left: written out, as loops over so few cost more than what they do.
  if (const int left = n - j; left > 0) {
    const double *const l0 = L + j * (stride + 1), *const l1 = l0 + stride + 1, *const l2 = l1 + stride + 1;
    double* const x = v + j;
    x[0] /= l0[0];
    if (left > 1) x[1] = (x[1] - x[0] * l0[1]) / l1[0];
    if (left > 2) {
      x[2] = ((x[2] - x[0] * l0[2]) - x[1] * l1[1]) / l2[0];
      x[2] /= l2[0];
      x[1] = (x[1] - l1[1] * x[2]) / l1[0];
      x[0] = ((x[0] - l0[1] * x[1]) - l0[2] * x[2]) / l0[0];
    } else if (left > 1) {
      x[1] /= l1[0];
      x[0] = (x[0] - l0[1] * x[1]) / l0[0];
    } else {
      x[0] /= l0[0];
    }
    v[n] = v[n + 1] = v[n + 2] = 0.0;
  }
  while ((j -= 4) >= 0) {
    const double *const l0 = L + j * stride, *const l1 = l0 + stride, *const l2 = l1 + stride, *const l3 = l2 + stride;
    Four s0{}, s1{}, s2{}, s3{};
    // Behind the values stand zeros.
    for (int i = j + 4; i < n; i += 4) {
      const Four x = four(v + i).v;
      s0 += four(l0 + i).v * x;
      s1 += four(l1 + i).v * x;
      s2 += four(l2 + i).v * x;
      s3 += four(l3 + i).v * x;
    }
    const double d = (v[j + 3] - ((s3[0] + s3[1]) + (s3[2] + s3[3]))) / l3[j + 3];
    const double c = (v[j + 2] - ((s2[0] + s2[1]) + (s2[2] + s2[3])) - l2[j + 3] * d) / l2[j + 2];
    const double b = (v[j + 1] - ((s1[0] + s1[1]) + (s1[2] + s1[3])) - l1[j + 2] * c - l1[j + 3] * d) / l1[j + 1];
    v[j] = (v[j] - ((s0[0] + s0[1]) + (s0[2] + s0[3])) - l0[j + 1] * b - l0[j + 2] * c - l0[j + 3] * d) / l0[j];
    v[j + 1] = b, v[j + 2] = c, v[j + 3] = d;
  }
}

}  // namespace flexframe::sim
