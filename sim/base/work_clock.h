// Work of simulations, counted: what decides how far checks and searches go. A clock would decide otherwise on another machine, or on the
// same one under load, so that one scene would get other settings from run to run.
#pragma once

namespace flexframe::sim {

// What the calling thread has counted so far, in seconds that it takes about on one core of a processor of 2022 (3 GHz, AVX-512): within a
// factor of two for most scenes.
double work_seconds();
void count_work(double seconds);

}  // namespace flexframe::sim
