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

}  // namespace flexframe::sim
