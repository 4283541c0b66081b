#include "sim/time/integrator_vector.h"

#include "sim/base/four.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

FLEXFRAME_WIDE
void sum(long n, double a, const double* x, double b, const double* y, double* z) {
  long i = 0;
  for (; i + 4 <= n; i += 4) four(z + i).v = a * four(x + i).v + b * four(y + i).v;
  for (; i < n; ++i) z[i] = a * x[i] + b * y[i];
}

FLEXFRAME_WIDE
void scale(long n, double a, const double* x, double* z) {
  long i = 0;
  for (; i + 4 <= n; i += 4) four(z + i).v = a * four(x + i).v;
  for (; i < n; ++i) z[i] = a * x[i];
}

FLEXFRAME_WIDE
void add(long n, double a, const double* x, double* z) {
  long i = 0;
  for (; i + 4 <= n; i += 4) four(z + i).v += a * four(x + i).v;
  for (; i < n; ++i) z[i] += a * x[i];
}

FLEXFRAME_WIDE
double square_sum(long n, const double* x, const double* w) {
  double s[4] = {};
  long i = 0;
  for (; i + 4 <= n; i += 4)
    for (int k = 0; k < 4; ++k) s[k] += (x[i + k] * w[i + k]) * (x[i + k] * w[i + k]);
  for (; i < n; ++i) s[0] += (x[i] * w[i]) * (x[i] * w[i]);
  return (s[0] + s[1]) + (s[2] + s[3]);
}

void linear_sum(double a, N_Vector x, double b, N_Vector y, N_Vector z) {
  sum(NV_LENGTH_S(x), a, NV_DATA_S(x), b, NV_DATA_S(y), NV_DATA_S(z));
}

// z may be X[0], as SUNDIALS allows, and no other.
int linear_combination(int count, double* c, N_Vector* X, N_Vector z) {
  const long n = NV_LENGTH_S(z);
  double* const out = NV_DATA_S(z);
  int k = 1;
  if (count == 1) scale(n, c[0], NV_DATA_S(X[0]), out);
  else sum(n, c[0], NV_DATA_S(X[0]), c[1], NV_DATA_S(X[1]), out), k = 2;
  for (; k < count; ++k) add(n, c[k], NV_DATA_S(X[k]), out);
  return 0;
}

void scaled(double a, N_Vector x, N_Vector z) { scale(NV_LENGTH_S(x), a, NV_DATA_S(x), NV_DATA_S(z)); }

void constant(double c, N_Vector z) { std::fill_n(NV_DATA_S(z), NV_LENGTH_S(z), c); }

double wrms_norm(N_Vector x, N_Vector w) {
  const long n = NV_LENGTH_S(x);
  return std::sqrt(square_sum(n, NV_DATA_S(x), NV_DATA_S(w)) / static_cast<double>(n));
}

}  // namespace

N_Vector make_solver_vector(long n, double* values, SUNContext context) {
  N_Vector v = N_VMake_Serial(n, values, context);
  if (!v) return v;
  v->ops->nvlinearsum = linear_sum;
  v->ops->nvlinearcombination = linear_combination;
  v->ops->nvscale = scaled;
  v->ops->nvconst = constant;
  v->ops->nvwrmsnorm = wrms_norm;
  return v;
}

}  // namespace flexframe::sim
