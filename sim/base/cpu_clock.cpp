#include "sim/base/cpu_clock.h"

#include <ctime>

namespace flexframe::sim {

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace flexframe::sim
