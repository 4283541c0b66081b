#include "sim/base/work_clock.h"

namespace flexframe::sim {

namespace {

thread_local double counted = 0.0;

}  // namespace

double work_seconds() { return counted; }
void count_work(double seconds) { counted += seconds; }

}  // namespace flexframe::sim
