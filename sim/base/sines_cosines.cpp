#include "sim/base/sines_cosines.h"

#include "sim/base/sine_cosine.h"

namespace flexframe::sim {

void sine_cosine_each(const Four& angle, Four& sine, Four& cosine) {
  Four s{}, c{};
  for (int i = 0; i < 4; ++i) {
    double one = 0.0, other = 0.0;
    sine_cosine(angle[i], one, other);
    s[i] = one, c[i] = other;
  }
  sine = s;
  cosine = c;
}

namespace {

FLEXFRAME_WIDE
void wide_sines_cosines(const double* angles, int n, double* sines, double* cosines) {
  int k = 0;
  for (; k + 4 <= n; k += 4) {
    const Four angle = four(angles + k).v;
    Four sine, cosine;
    sine_cosine(angle, sine, cosine);
    four(sines + k).v = sine;
    four(cosines + k).v = cosine;
  }
  if (k == n) return;
  Four rest{}, sine, cosine;
  for (int i = 0; k + i < n; ++i) rest[i] = angles[k + i];
  sine_cosine(rest, sine, cosine);
  for (int i = 0; k + i < n; ++i) sines[k + i] = sine[i], cosines[k + i] = cosine[i];
}

}  // namespace

void sines_cosines(const double* angles, int n, double* sines, double* cosines) { wide_sines_cosines(angles, n, sines, cosines); }

}  // namespace flexframe::sim
