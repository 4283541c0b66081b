// The clock that prices are stated in.
#pragma once

namespace flexframe::sim {

// CPU time of the calling thread so far, s.
double cpu_seconds();
// Of all threads of the process, s.
double process_cpu_seconds();

}  // namespace flexframe::sim
