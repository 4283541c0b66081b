// Loaded before a program (LD_PRELOAD): its clocks of CPU time run forty times as fast, as on a machine that is so much slower.
#include <dlfcn.h>

#include <ctime>

extern "C" int clock_gettime(clockid_t id, timespec* time) {
  constexpr long long faster = 40, second = 1000000000;
  using Clock = int (*)(clockid_t, timespec*);
  static const auto real = reinterpret_cast<Clock>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int failed = real(id, time);
  if (failed != 0 || (id != CLOCK_THREAD_CPUTIME_ID && id != CLOCK_PROCESS_CPUTIME_ID)) return failed;
  const long long now = faster * (static_cast<long long>(time->tv_sec) * second + time->tv_nsec);
  time->tv_sec = now / second;
  time->tv_nsec = now % second;
  return 0;
}
