// Four numbers in a register, wherever they lie.
#pragma once

#include "sim/base/wide.h"

namespace flexframe::sim {

// Four values that lie one after the other, anywhere. Loops over them are written out: left to itself the compiler takes eight at a time
// and goes through up to seven that are left one by one, which is most of the work for columns of ten to thirty.
using Four [[gnu::vector_size(32)]] = double;
struct [[gnu::packed, gnu::may_alias]] AnyFour {
  Four v;
};
FLEXFRAME_INLINE AnyFour& four(double* p) { return *reinterpret_cast<AnyFour*>(p); }
FLEXFRAME_INLINE const AnyFour& four(const double* p) { return *reinterpret_cast<const AnyFour*>(p); }
// to = n numbers from `from`, which do not overlap: of as few as a body has, a library's copy costs more than the copying. The last fours
// overlap what is copied already: the compiler makes much of loops over what is left.
FLEXFRAME_INLINE void copy_fours(const double* from, long n, double* to) {
  if (n < 4) {
    if (n > 0) to[0] = from[0];
    if (n > 1) to[1] = from[1];
    if (n > 2) to[2] = from[2];
    return;
  }
  for (long k = 0; k + 4 <= n; k += 4) four(to + k).v = four(from + k).v;
  if (n & 3) four(to + n - 4).v = four(from + n - 4).v;
}

}  // namespace flexframe::sim
