// SUNDIALS' serial vector with its busiest operations compiled for wider registers: the integrators' own work on states of ten to a hundred
// values was an eighth of a run. Same results on every machine: the order of all sums is fixed.
#pragma once

#include <nvector/nvector_serial.h>

namespace flexframe::sim {

// A vector over n values that the caller keeps alive; clones of it have the same operations. Freed by N_VDestroy.
N_Vector make_solver_vector(long n, double* values, SUNContext context);

}  // namespace flexframe::sim
