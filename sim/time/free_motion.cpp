#include "sim/time/free_motion.h"

#include "sim/base/small_matrices.h"
#include "sim/base/wide.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// What does not vibrate turns by so little within a span, and the rest of it is coupling.
constexpr double hardly = 1e-3;
constexpr double weak = 1e-3;

// Of x = z: sin(z) / z and (sin(z) / z - cos(z)) / z, from sine and cosine.
FLEXFRAME_INLINE void bessel(double z, double sin, double cos, double& zeroth, double& first) {
  const double square = z * z, over = 1.0 / (square < 2.5e-3 ? 1.0 : z);
  const double far_zeroth = sin * over, far_first = (far_zeroth - cos) * over;
  const double near_zeroth = 1.0 - square * (1.0 / 6.0) * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0)));
  const double near_first = z * (1.0 / 3.0) * (1.0 - square * (1.0 / 10.0) * (1.0 - square * (1.0 / 28.0)));
  zeroth = square < 2.5e-3 ? near_zeroth : far_zeroth;
  first = square < 2.5e-3 ? near_first : far_first;
}

// Integrals over a span, from -span/2 to span/2, for one mode j and modes i = 0 to n - 1, c = cos(f s), S = sin(f s) / f.
struct Integrals {
  double *SS, *cc, *sSc, *scS;  // S_i S_j, c_i c_j, s S_i c_j, s c_i S_j
};

FLEXFRAME_WIDE
void integrate(const double* f, const double* sin, const double* cos, int n, int j, double span, Integrals out) {
  const double fj = f[j], sj = sin[j], cj = cos[j], half = 0.5 * span, quarter = 0.25 * span * span;
  for (int i = 0; i < n; ++i) {
    double sum0, sum1, difference0, difference1;
    bessel((f[i] + fj) * half, sin[i] * cj + cos[i] * sj, cos[i] * cj - sin[i] * sj, sum0, sum1);
    bessel((f[i] - fj) * half, sin[i] * cj - cos[i] * sj, cos[i] * cj + sin[i] * sj, difference0, difference1);
    out.SS[i] = half * (difference0 - sum0) / (f[i] * fj);
    out.cc[i] = half * (difference0 + sum0);
    out.sSc[i] = quarter * (sum1 + difference1) / f[i];
    out.scS[i] = quarter * (sum1 - difference1) / fj;
  }
}

// The integral of the coupling, [p; w] x [p; w]: constant + tau slope, tau the middle of the span.
struct Coupling {
  MatX constant, slope;
  Coupling(const Modes& m, const VecX& f, double span);
};

// Turned back and forth by the angles of modes i and j: p' = -S_i g, w' = c_i g with g = (a + b s) (c_j p + S_j w) + e (c_j w - f_j^2 S_j p).
// Odd parts vanish.
Coupling::Coupling(const Modes& m, const VecX& f, double span) : constant(2 * f.size(), 2 * f.size()), slope(MatX::Zero(2 * f.size(), 2 * f.size())) {
  const Eigen::Index n = f.size();
  const VecX sin = (0.5 * span * f).array().sin(), cos = (0.5 * span * f).array().cos();
  VecX SS(n), cc(n), sSc(n), scS(n), a(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    integrate(f.data(), sin.data(), cos.data(), static_cast<int>(n), static_cast<int>(j), span, {SS.data(), cc.data(), sSc.data(), scS.data()});
    a = m.A.col(j);
    a[j] += f[j] * f[j];
    const auto b = m.A1.col(j), e = m.B.col(j);
    constant.col(j).head(n) = f[j] * f[j] * e.cwiseProduct(SS) - b.cwiseProduct(sSc);
    constant.col(n + j).tail(n) = b.cwiseProduct(scS) + e.cwiseProduct(cc);
    constant.col(n + j).head(n) = -a.cwiseProduct(SS);
    constant.col(j).tail(n) = a.cwiseProduct(cc);
    slope.col(n + j).head(n) = -b.cwiseProduct(SS);
    slope.col(j).tail(n) = b.cwiseProduct(cc);
  }
}

}  // namespace

VecX FreeMotion::turned(const VecX& z, double s) const {
  const Eigen::Index n = frequencies_.size();
  VecX out(2 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double f = frequencies_[k], cos = std::cos(f * s), sin = std::sin(f * s);
    out[k] = cos * z[k] + sin / f * z[n + k];
    out[n + k] = cos * z[n + k] - f * sin * z[k];
  }
  return out;
}

FreeMotion::FreeMotion(const Modes& m, double tau, double length, int spans, const VecX& z) {
  const Eigen::Index n = m.frequencies.size();
  span_ = length / spans;
  frequencies_ = m.frequencies.cwiseMax(hardly / span_);
  const Coupling coupling(m, frequencies_, span_);
  before_.resize(2 * n, spans);
  after_.resize(2 * n, spans);
  VecX now = turned(z, 0.5 * span_), first(2 * n), second(2 * n), third(2 * n);
  for (int k = 0; k < spans; ++k) {
    if (k > 0) now = turned(now, span_);
    before_.col(k) = now;
    const MatX K = coupling.constant + (tau + (k + 0.5) * span_) * coupling.slope;
    multiply(K, now.data(), first.data());
    multiply(K, first.data(), second.data());
    now += first + 0.5 * second;
    // The next term counts a sixth of that at most where the coupling is weak.
    if (!(second.squaredNorm() < weak * weak * first.squaredNorm())) {
      multiply(K, second.data(), third.data());
      now += third / 6.0;
    }
    after_.col(k) = now;
  }
}

VecX FreeMotion::at(double s) const {
  const Eigen::Index k = std::clamp(static_cast<Eigen::Index>(s / span_), Eigen::Index{0}, before_.cols() - 1);
  const double into = std::clamp(s / span_ - static_cast<double>(k), 0.0, 1.0);
  return turned(before_.col(k) + into * (after_.col(k) - before_.col(k)), (into - 0.5) * span_);
}

FreeMotion follow_free(const Modes& modes, const ModalWeights& weights, double tau, double length, const VecX& z, double most,
                       int most_spans, int& spans) {
  const Eigen::Index n = modes.frequencies.size();
  spans = std::max(1, spans);
  if (2 * spans > most_spans) return {};
  FreeMotion coarse(modes, tau, length, spans, z);
  for (VecX end = coarse.at(length);; spans *= 2) {
    if (2 * spans > most_spans) return {};
    FreeMotion fine(modes, tau, length, 2 * spans, z);
    const VecX fine_end = fine.at(length), off = fine_end - end;
    // Of second order: the finer one is off by a third of what they differ by.
    const double error = std::sqrt((off.head(n).cwiseProduct(weights.p).squaredNorm() + off.tail(n).cwiseProduct(weights.w).squaredNorm()) /
                                   weights.size) /
                         3.0;
    if (error <= most) {
      if (error < 0.1 * most) spans = std::max(1, spans / 2);
      return fine;
    }
    end = fine_end;
  }
}

}  // namespace flexframe::sim
