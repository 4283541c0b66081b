// Both of an angle (rad) at once, which costs little more than one; the same bits as std::sin and std::cos.
#pragma once

#include <cmath>

namespace flexframe::sim {

inline void sine_cosine(double angle, double& sine, double& cosine) {
#ifdef __GLIBC__
  ::sincos(angle, &sine, &cosine);
#else
  sine = std::sin(angle);
  cosine = std::cos(angle);
#endif
}

}  // namespace flexframe::sim
