// The clock of the benchmarks.
#pragma once

#include <ctime>

namespace flexframe::test {

// CPU time of all threads of the process so far, s.
inline double process_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace flexframe::test
