// Sines and cosines of many angles, four at once in wide registers.
#pragma once

#include "sim/base/four.h"

#include <cstdint>

namespace flexframe::sim {

// Of four angles (rad), one after the other: for those that the next one is not for.
void sine_cosine_each(const Four& angle, Four& sine, Four& cosine);

// Of four angles (rad) at once, right to 3e-16, within functions for wide registers. What the nearest quarter turn leaves, pi / 4 at
// most, goes by the power series up to where its terms end below the last digit. Pi / 2 is taken in three parts, of which the first two
// have 33 bits, so that their products with up to twenty bits of quarter turns are exact (Cody, Waite, Software Manual for the Elementary
// Functions, 1980).
FLEXFRAME_INLINE void sine_cosine(const Four& angle, Four& sine, Four& cosine) {
  using Bits [[gnu::vector_size(32)]] = std::int64_t;
  constexpr double most = 1e6;
  const Bits far = (Bits)(angle < -most) | (Bits)(angle > most) | (Bits)(angle != angle);
  if (far[0] | far[1] | far[2] | far[3]) return sine_cosine_each(angle, sine, cosine);
  // Added and taken away again it leaves the nearest whole number, which the last bits of the sum are.
  constexpr double whole = 6755399441055744.0;  // 1.5 2^52
  const Four sum = angle * 0.6366197723675814 + whole, quarters = sum - whole;
  const Bits bits = (Bits)sum;
  const Four x = ((angle - quarters * 0x1.921fb544p+0) - quarters * 0x1.0b4611a6p-34) - quarters * 2.0222662487959506e-21, z = x * x;
  Four s = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0, c = z * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
  s = s * z - 1.0 / 39916800.0, c = c * z + 1.0 / 479001600.0;
  s = s * z + 1.0 / 362880.0, c = c * z - 1.0 / 3628800.0;
  s = s * z - 1.0 / 5040.0, c = c * z + 1.0 / 40320.0;
  s = s * z + 1.0 / 120.0, c = c * z - 1.0 / 720.0;
  s = s * z - 1.0 / 6.0, c = c * z + 1.0 / 24.0;
  s = x + x * z * s, c = 1.0 - (0.5 * z - z * z * c);
  // A quarter turn makes a sine of a cosine, two change signs.
  const Bits odd = (bits & 1) != 0;
  const Bits sine_size = odd ? (Bits)c : (Bits)s, cosine_size = odd ? (Bits)s : (Bits)c;
  sine = (Four)(sine_size ^ ((bits & 2) << 62));
  cosine = (Four)(cosine_size ^ (((bits + 1) & 2) << 62));
}

// Of n angles (rad), which may lie where the sines go; right to 3e-16.
void sines_cosines(const double* angles, int n, double* sines, double* cosines);

}  // namespace flexframe::sim
